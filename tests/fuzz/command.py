"""The fuzzer as a command: real programs of a folder, mutated."""

from __future__ import annotations

import argparse
import hashlib
import signal
import sys
import time
import traceback
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import numpy as np

from fuzz.examine import Broken, examined
from fuzz.hostile import hostile
from fuzz.mutations import MUTATIONS, mutated
from postproc.base.document import Document
from postproc.base.findings import Refusal
from postproc.base.units import DEG
from postproc.languages import DIALECTS, detect
from postproc.languages.dialect import Dialect, ReadingSettings

LIMIT_S = 30.0
"""Seconds after which a run hangs."""
BASE_S, PER_MB_S = 1.0, 2.0
"""Seconds that reading may take: a constant, and for each 10^6 bytes."""
HURT_S = 2.0
"""Seconds for a megabyte that is made to hurt."""
SLOWEST = 5
SETTINGS = ReadingSettings(orientation=np.array([0.0, 0.0, 180.0 * DEG]))


@dataclass(frozen=True)
class Source:
    """A program as it was found: its dialect and its files."""

    dialect: Dialect
    documents: tuple[Document, ...]


@dataclass(frozen=True)
class Run:
    """One mutant: what was done, how long reading took, how many motions moved, and what went wrong ("" nothing)."""

    name: str
    mutation: str
    documents: tuple[Document, ...]
    seconds: float
    motions: int
    moved: int
    failure: str
    place: str


class Hangs(Exception):
    """A run took longer than LIMIT_S."""


def sources(folder: Path) -> list[Source]:
    """All programs below a folder that a dialect claims."""
    found = []
    for path in sorted(folder.rglob("*")):
        if not path.is_file():
            continue
        raw = path.read_bytes()
        try:
            dialect = detect(path, raw)
        except Refusal:
            continue
        beside = [Document(other, other.read_bytes()) for other in dialect.companions(path)]
        found.append(Source(dialect, (Document(path, raw), *beside)))
    return found


def run(source: Source, seed: int, number: int, only: tuple[str, ...] = (), timed: bool = True) -> Run:
    """One mutant of a program; ``seed`` and ``number`` say which; ``timed``: being slow is a failure."""
    random = np.random.default_rng([seed, number])
    documents = list(source.documents)
    which = 0 if len(documents) == 1 or random.random() < 0.7 else 1
    mutation, raw = mutated(documents[which].raw, random, only)
    documents[which] = Document(documents[which].path, raw)
    mutant = tuple(documents)
    failure, place, seconds, motions, moved = "", "", 0.0, 0, 0
    previous = signal.signal(signal.SIGALRM, _hangs)
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    begin = time.process_time()
    try:
        seen = examined(source.dialect, mutant, random, SETTINGS)
        seconds, motions, moved = seen.seconds, seen.motions, seen.moved
        size = sum(len(document.raw) for document in mutant)
        if timed and seconds > BASE_S + PER_MB_S * size / 1e6:
            raise Broken(f"reading {size} bytes took {seconds:.1f} s")
    except Broken as broken:
        failure, place = str(broken), "held"
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(last.filename).name}:{last.lineno}"
        failure = f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    if failure:
        seconds = time.process_time() - begin
    name = documents[0].path.name
    return Run(
        name, f"{mutation} of {documents[which].path.suffix}", mutant, seconds, motions, moved, failure, place
    )


def _hangs(number: int, frame: FrameType | None) -> None:
    raise Hangs(f"longer than {LIMIT_S:g} s")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="real programs")
    parser.add_argument(
        "--hostile", action="store_true", help="instead: a megabyte of input that is made to hurt"
    )
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help=f"mutations: {', '.join(MUTATIONS)}")
    parser.add_argument("--dialect", default="", help=f"only programs of {', '.join(DIALECTS)}")
    parser.add_argument(
        "--largest", type=int, default=300_000, help="bytes of a program, above which it is left out"
    )
    parser.add_argument("--keep", type=Path, help="where mutants that failed are written")
    said = parser.parse_args()
    if said.hostile:
        return _hurt(said.dialect)
    if said.folder is None:
        parser.error("name a folder of programs, or --hostile")
    found = [
        source
        for source in sources(said.folder)
        if source.dialect.name == (said.dialect or source.dialect.name)
        and sum(len(document.raw) for document in source.documents) <= said.largest
    ]
    if not found:
        print(f"no program below {said.folder}", file=sys.stderr)
        return 2
    only = tuple(said.only.split(",")) if said.only else ()
    failures: dict[tuple[str, str], list[tuple[int, Run]]] = defaultdict(list)
    slowest: list[tuple[float, int, Run]] = []
    counts: Counter[str] = Counter()
    for number in range(said.runs):
        done = run(found[number % len(found)], said.seed, number, only)
        counts.update(runs=1, motions=done.motions, moved=done.moved)
        if done.failure:
            kind = done.failure if done.place != "held" else _sort(done.failure)
            failures[done.place, kind].append((number, done))
        slowest = sorted([*slowest, (done.seconds, number, done)], key=lambda item: -item[0])[:SLOWEST]
    print(
        f"{counts['runs']} mutants of {len(found)} programs, {counts['motions']} motions, {counts['moved']} moved"
    )
    print("slowest:")
    for seconds, number, done in slowest:
        size = sum(len(document.raw) for document in done.documents)
        print(f"  {seconds:6.2f} s  run {number}  {size} bytes  {done.name}  {done.mutation}")
    for (place, _), runs in sorted(failures.items(), key=lambda item: -len(item[1])):
        number, first = min(runs, key=lambda item: sum(len(d.raw) for d in item[1].documents))
        print(f"{len(runs)} x {place}: {first.failure}\n    run {number}  {first.name}  {first.mutation}")
        if said.keep:
            _keep(said.keep, first)
    print(f"{sum(map(len, failures.values()))} failures")
    return 1 if failures else 0


def _hurt(only: str) -> int:
    """Reads every hostile input with every dialect, and tells which took long or failed."""
    bad = 0
    for dialect in DIALECTS.values():
        if dialect.name != (only or dialect.name):
            continue
        for name, raw in hostile(10**6).items():
            source = Source(dialect, (Document(Path("a.src" if dialect.name == "krl" else "a.nc"), raw),))
            done = run(source, 1, 0, only=("nothing",))
            if done.failure or done.seconds > HURT_S:
                bad += 1
                print(
                    f"{done.seconds:6.2f} s  {dialect.name:10} {name:24} {done.failure} {done.place}"[:160],
                    flush=True,
                )
    return 1 if bad else 0


def _sort(failure: str) -> str:
    """A failure without its numbers."""
    return "".join(letter for letter in failure if not letter.isdigit())


def _keep(folder: Path, done: Run) -> None:
    digest = hashlib.sha256(done.documents[0].raw).hexdigest()[:8]
    place = folder / f"{Path(done.name).stem}_{digest}"
    place.mkdir(parents=True, exist_ok=True)
    for document in done.documents:
        (place / document.path.name).write_bytes(document.raw)
    (place / "failure.txt").write_text(f"{done.failure}\n{done.place}\n{done.mutation}\n", encoding="utf-8")
