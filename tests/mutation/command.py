"""The command: a revision, the rooms, a sample of each, and the table."""

from __future__ import annotations

import argparse
import compileall
import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

from mutation import covered, judging
from mutation.mutants import Mutant, mutants, sample

HOME = Path(__file__).parent.parent.parent
ROOMS = {
    "effects": ["postproc/effects"],
    "compensation": ["postproc/compensation"],
    "languages": ["postproc/languages"],
    "krl": ["postproc/languages/krl"],
    "gcode": ["postproc/languages/gcode"],
}
SLOW = (  # browsers, hundreds of processes, thousands of programs: a mutant is not judged by these
    "batch",
    "blind",
    "browser",
    "campaign",
    "design",
    "faults",
    "fuzz",
    "rs274",
)
FIRST_S = 3.0
"""Processor seconds of tests that a mutant meets first: most fall at once."""
Z = 1.959963984540054
"""Two-sided 95 % of the normal distribution."""


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval (Wilson) of a share, hits / of."""
    if not of:
        return 0.0, 1.0
    share, z2 = hits / of, Z * Z / of
    centre = (share + z2 / 2) / (1 + z2)
    half = Z / (1 + z2) * math.sqrt(share * (1 - share) / of + z2 / of / 4)
    return centre - half, centre + half


def tree_of(folder: Path, revision: str) -> Path:
    """The files of a revision beside the results, written anew: mutants are written there, never into the checkout.

    A folder stays with the revision that it began with.
    """
    tree, kept = folder / "tree", folder / "revision"
    tree.mkdir(parents=True, exist_ok=True)
    if not kept.exists():
        told = subprocess.run(
            ["git", "rev-parse", revision], cwd=HOME, check=True, capture_output=True, text=True
        )
        kept.write_text(told.stdout)
    command = ["git", "archive", kept.read_text().strip()]
    packed = subprocess.run(command, cwd=HOME, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", str(tree)], input=packed, check=True)
    return tree


def cover_of(folder: Path, tree: Path, words: list[str]) -> covered.Cover:
    """What the suite covers, or those of its files whose names hold one of ``words``; measured once a folder."""
    kept = folder / "cover.json"
    if not kept.exists():
        compileall.compile_dir(tree, quiet=1)
        pid = os.fork()  # the tests' modules stay out of this process
        if pid == 0:
            code = 1
            try:
                judging.stay(tree)
                sys.dont_write_bytecode = False  # read by every judgement
                tests = [
                    str(path.relative_to(tree))
                    for path in sorted((tree / "tests").glob("test_*.py"))
                    if not any(word in path.name for word in SLOW)
                    and (not words or any(word in path.name for word in words))
                ]
                covered.cover(tree, [folders[0] for folders in ROOMS.values()], tests).save(kept)
                code = 0
            finally:
                os._exit(code)
        if os.waitpid(pid, 0)[1]:
            raise RuntimeError("the tests could not be measured")
    return covered.load(kept)


class Judge:
    """Judges mutants in a tree; tests that killed before come earlier."""

    def __init__(self, folder: Path, tree: Path, cover: covered.Cover, seconds: float) -> None:
        self.folder, self.tree, self.cover, self.seconds = folder, tree, cover, seconds
        self.kills: dict[str, int] = {}

    def rounds(self, mutant: Mutant) -> list[dict[str, float]]:
        """Tests that reach the mutant, cheap ones and old killers first: a first round and the rest."""
        cost = self.cover.seconds
        names = self.cover.reaching(mutant.path, mutant.first_line, mutant.line)
        names.sort(key=lambda name: (cost[name] + 0.02) / (1 + self.kills.get(name, 0)))
        first: dict[str, float] = {}
        rest: dict[str, float] = {}
        spent = 0.0
        for name in names:
            spent += cost[name]
            if spent <= FIRST_S or not first:
                first[name] = cost[name]
            elif spent <= self.seconds:
                rest[name] = cost[name]
        return [tests for tests in (first, rest) if tests]

    def judge(self, mutant: Mutant, text: str) -> tuple[str, str]:
        """The verdict and the test at which it fell."""
        path = self.tree / mutant.path
        kept, stat = path.read_bytes(), path.stat()
        verdict, test = "not reached", ""
        try:
            path.write_text(text, encoding="utf-8")
            for tests in self.rounds(mutant):
                verdict, test = judging.judge(self.tree, tests, self.folder)
                if verdict != "survived":
                    self.kills[test] = self.kills.get(test, 0) + 1
                    break
        finally:
            path.write_bytes(kept)
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
        return verdict, test if verdict != "survived" else ""


def changed(before: str, after: str) -> tuple[str, str]:
    """The first line that differs, as it was and as it is."""
    for old, new in zip(before.splitlines(), after.splitlines(), strict=False):
        if old != new:
            return old.strip(), new.strip()
    return "", ""


def row(name: str, total: int, results: list[dict]) -> str:
    count = {
        word: sum(one["verdict"] == word for one in results) for word in ("killed", "timeout", "survived")
    }
    lost = sum(one["verdict"] == "not reached" for one in results)
    dead = count["killed"] + count["timeout"]
    low, high = wilson(dead, len(results))
    share = 100 * dead / max(len(results), 1)
    return (
        f"{name:14}{total:7}{len(results):9}{count['killed']:8}{count['timeout']:9}{count['survived']:10}{lost:12}"
        f"{share:8.1f} % ({100 * low:.1f} to {100 * high:.1f})"
    )


def main(words: list[str] | None = None) -> int:
    """Judges samples; results stand in FOLDER/<room>-<seed>.jsonl, one mutant a line, and are taken up again."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("folder", type=Path, help="for the revision's files, what tests cover, and results")
    parser.add_argument("--room", action="append", choices=sorted(ROOMS))
    parser.add_argument("--sample", type=int, default=250, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="processor seconds of tests that one mutant meets"
    )
    parser.add_argument("--revision", default="HEAD")
    parser.add_argument(
        "--tests", nargs="*", default=[], metavar="WORD", help="only test files with such a word"
    )
    asked = parser.parse_args(words)
    folder = asked.folder.resolve()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the file that is mutated is put back
    tree = tree_of(folder, asked.revision)
    judging.warm()
    judge = Judge(folder, tree, cover_of(folder, tree, asked.tests), asked.seconds)
    table = []
    for room in asked.room or ["effects", "compensation", "krl", "gcode"]:
        files = sorted(
            str(path.relative_to(tree)) for top in ROOMS[room] for path in (tree / top).rglob("*.py")
        )
        sources = {file: (tree / file).read_text(encoding="utf-8") for file in files}
        found = [mutant for file in files for mutant in mutants(tree, file)]
        kept = folder / f"{room}-{asked.seed}.jsonl"
        results = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
        known = {(one["path"], one["operator"], one["occurrence"]): one for one in results}
        judged = []
        start = time.monotonic()
        for number, (mutant, text) in enumerate(sample(found, asked.sample, asked.seed, sources), 1):
            one = known.get((mutant.path, mutant.operator, mutant.occurrence))
            if one is None:
                verdict, test = judge.judge(mutant, text)
                before, after = changed(sources[mutant.path], text)
                one = {**asdict(mutant), "verdict": verdict, "test": test, "before": before, "after": after}
                with kept.open("a", encoding="utf-8") as out:
                    out.write(json.dumps(one) + "\n")
            judged.append(one)
            if number % 10 == 0:
                alive = sum(one["verdict"] in ("survived", "not reached") for one in judged)
                print(
                    f"{room}: {number} judged, {alive} alive, {time.monotonic() - start:.0f} s",
                    file=sys.stderr,
                )
        table.append(row(room, len(found), judged))
    print("room          mutants  sampled  killed  timeout  survived  not reached  killed % (95 %)")
    print("\n".join(table))
    return 0
