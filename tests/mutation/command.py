"""The command: a revision, the rooms, a sample of each, and the table."""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from mutation import judging, stream
from mutation.mutants import Mutant, mutants, sample
from mutation.second_stage import FurtherTests, further_tests

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
FIRST = 12
"""Tests that a mutant which is imported anew meets first: most fall at once, and few files are collected."""
ALIVE = ("survived", "not reached")
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


def tests_of(tree: Path, words: list[str], without: list[str]) -> list[str]:
    """Files of tests whose names hold one of ``words``, where there are any, and none of ``without``."""
    return [
        str(path.relative_to(tree))
        for path in sorted((tree / "tests").glob("test_*.py"))
        if not any(word in path.name for word in [*SLOW, *without])
        and (not words or any(word in path.name for word in words))
    ]


@dataclass(frozen=True)
class Drawn:
    """A mutant of a sample: the file's text with it, and the line before and after."""

    room: str
    mutant: Mutant
    text: str
    before: str
    after: str


def judge(
    folder: Path, tree: Path, mutant: Mutant, text: str, tests: dict[str, float], tier: str
) -> tuple[str, str]:
    """The verdict, and the test at which it fell, of tests (with their seconds, in their order) that come by a mutant;
    the mutant is written into the tree, and all is imported anew."""
    if not tests:
        return "not reached", ""
    path = tree / mutant.path
    kept, stat = path.read_bytes(), path.stat()
    names = list(tests)
    try:
        path.write_text(text, encoding="utf-8")
        for some in (names[:FIRST], names[FIRST:]):
            if some:
                verdict, test = judging.judge(tree, {name: tests[name] for name in some}, folder, tier)
                if verdict != "survived":
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


def drawn(
    tree: Path, rooms: list[str], size: int, seed: int, kept: Path
) -> tuple[dict[str, int], list[Drawn]]:
    """The number of mutants in each room, and a sample of each; drawn once a folder."""
    if kept.exists():
        read = json.loads(kept.read_text())
        return read["totals"], [Drawn(**{**one, "mutant": Mutant(**one["mutant"])}) for one in read["chosen"]]
    totals, chosen = {}, []
    for room in rooms:
        files = sorted(
            str(path.relative_to(tree)) for top in ROOMS[room] for path in (tree / top).rglob("*.py")
        )
        sources = {file: (tree / file).read_text(encoding="utf-8") for file in files}
        found = [mutant for file in files for mutant in mutants(tree, file)]
        totals[room] = len(found)
        for mutant, text in sample(found, size, seed, sources):
            chosen.append(Drawn(room, mutant, text, *changed(sources[mutant.path], text)))
    kept.write_text(json.dumps({"totals": totals, "chosen": [asdict(one) for one in chosen]}))
    return totals, chosen


def meet(
    folder: Path,
    tree: Path,
    chosen: list[Drawn],
    tests: list[str],
    log: Path,
    seconds: float,
    tier: str,
    further: FurtherTests | None = None,
) -> stream.Stream:
    """Lets each mutant meet tests of so many seconds; what can not be put in place is imported anew."""
    pairs = [(one.mutant, one.text) for one in chosen]
    seen = stream.run(tree, pairs, tests, log, seconds, tier, further)
    for number, one in enumerate(chosen):
        if number not in seen.verdicts:
            tests_met = seen.choice(number, seconds)
            verdict, test = judge(folder, tree, one.mutant, one.text, tests_met, tier)
            line = {"mutant": number, "verdict": verdict, "test": test}
            seen.add(line)
            with log.open("a", encoding="utf-8") as out:
                out.write(json.dumps(line) + "\n")
    return seen


def confirm(
    folder: Path,
    tree: Path,
    chosen: list[Drawn],
    first: stream.Stream,
    packages: list[str],
    seconds: float,
    results: list[dict],
) -> None:
    """Lets what lived meet all tests, slow ones too, and changes the verdicts in ``results`` of what falls then."""
    alive = [k for k, one in enumerate(results) if one["verdict"] in ALIVE]
    if not alive:
        return
    tests = tests_of(tree, [], [])
    near = [test for test in tests if stream.is_near(tree, test, packages)]
    judging.register_profile(judging.ALL)
    further = further_tests(first, alive, near, seconds)
    log = folder / "confirmed.jsonl"
    seen = meet(folder, tree, [chosen[k] for k in alive], tests, log, seconds, judging.ALL, further)
    for number, k in enumerate(alive):
        verdict, test = seen.verdicts[number]
        if verdict != "not reached":
            met = len(seen.choice(number, seconds))
            results[k].update(verdict=verdict, test=test, tests=max(met, results[k]["tests"]))
    fell = sum(results[k]["verdict"] not in ALIVE for k in alive)
    print(
        f"{len(alive)} that lived met further tests, slow ones too: {fell} fell; "
        f"{len(seen.seconds)} tests run, {seen.not_run} not for want of seconds"
    )


def main(words: list[str] | None = None) -> int:
    """Judges samples; results are in FOLDER/mutants.jsonl, one mutant a line; a run that was stopped goes on."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("folder", type=Path, help="for the revision's files and for results, of one sample")
    parser.add_argument("--room", action="append", choices=sorted(ROOMS))
    parser.add_argument("--sample", type=int, default=250, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--seconds", type=float, default=60.0, help="processor seconds of tests that one mutant meets"
    )
    parser.add_argument(
        "--confirm",
        type=float,
        default=120.0,
        metavar="SECONDS",
        help="processor seconds of all tests, slow ones too, that a mutant meets which lived; 0: none",
    )
    parser.add_argument("--revision", default="HEAD")
    parser.add_argument("--tier", choices=("fast", "all"), default="fast", help="which tests")
    parser.add_argument("--tests", nargs="*", default=[], metavar="WORD", help="only files with such a word")
    parser.add_argument("--without", nargs="*", default=[], metavar="WORD", help="no files with such a word")
    parser.add_argument("--near", action="store_true", help="only files that import what is in the rooms")
    asked = parser.parse_args(words)
    folder = asked.folder.resolve()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # the file that is mutated is put back
    tier = judging.FAST if asked.tier == "fast" else judging.ALL
    tree = tree_of(folder, asked.revision)
    judging.warm(tier)
    rooms = asked.room or ["effects", "compensation", "krl", "gcode"]
    totals, chosen = drawn(tree, rooms, asked.sample, asked.seed, folder / "drawn.json")
    tests = tests_of(tree, asked.tests, asked.without)
    if asked.near:
        near = [
            test
            for test in tests_of(tree, [], [])
            if stream.is_near(tree, test, [top for r in rooms for top in ROOMS[r]])
        ]
        # a word that leaves out files elsewhere may stand in the name of one that tests the room
        left_out = ", ".join(Path(test).stem for test in near if test not in tests)
        print(f"left out though they import the rooms: {left_out or 'none'}")
        tests = [test for test in near if test in tests]
    first = meet(folder, tree, chosen, tests, folder / "stream.jsonl", asked.seconds, tier)
    results = []
    for number, one in enumerate(chosen):
        verdict, test = first.verdicts[number]
        met = len(first.choice(number, asked.seconds))
        result = {"room": one.room, **asdict(one.mutant), "verdict": verdict, "test": test, "tests": met}
        results.append({**result, "before": one.before, "after": one.after})
    print(f"{len(first.seconds)} tests, {sum(first.seconds.values()):.0f} s of the processor")
    if asked.confirm > 0:
        everywhere = [top for room in rooms for top in ROOMS[room]]
        confirm(folder, tree, chosen, first, everywhere, asked.confirm, results)
    (folder / "mutants.jsonl").write_text("".join(json.dumps(one) + "\n" for one in results))
    print("room          mutants  sampled  killed  timeout  survived  not reached  killed % (95 %)")
    for room in rooms:
        print(row(room, totals[room], [one for one in results if one["room"] == room]))
    return 0
