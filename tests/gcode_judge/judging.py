"""Programs judged by their seeds, on all processors, and differences shrunk."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from itertools import repeat
from pathlib import Path

from .blocks import Made
from .comparison import Comparison, Difference, compare
from .generator import make
from .oracle import execute
from .reading import Reading, read
from .shrinking import Shrinking

PART = 25
"""Seeds that a process takes at a time."""


@dataclass
class Totals:
    """programs, accepted by rs274; counts of motions as in ``Comparison``; differing: seed -> its first difference."""

    programs: int = 0
    accepted: int = 0
    motions: int = 0
    known: int = 0
    located: int = 0
    misplaced: int = 0
    differing: dict[int, Difference] = field(default_factory=dict)

    def add(self, other: Totals) -> None:
        for name in ("programs", "accepted", "motions", "known", "located", "misplaced"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.differing.update(other.differing)


def judge(made: Made, folder: Path, reader: Callable[[Made], Reading] = read) -> Comparison | None:
    """What the reader makes of a program against rs274; None where that does not accept it."""
    motions = execute(made, folder)
    return None if motions is None else compare(motions, reader(made))


def judge_seeds(seeds: Iterable[int], without: tuple[str, ...] = ()) -> Totals:
    """``without``: features that the programs do not have."""
    totals = Totals()
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            totals.programs += 1
            found = judge(make(seed, without), Path(folder))
            if found is None:
                continue
            totals.accepted += 1
            totals.motions += found.motions
            totals.known += found.known
            totals.located += found.located
            totals.misplaced += found.misplaced
            if found.differences:
                totals.differing[seed] = found.differences[0]
    return totals


def judge_all(count: int, seed: int, processes: int = 0, without: tuple[str, ...] = ()) -> Iterator[Totals]:
    """``count`` programs from ``seed`` on, part by part."""
    parts = [range(at, min(at + PART, seed + count)) for at in range(seed, seed + count, PART)]
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        yield from pool.map(judge_seeds, parts, repeat(without))


def shrink(seed: int, difference: Difference, without: tuple[str, ...] = ()) -> Made:
    """The least program made of that of a seed with a difference of the same kind."""
    return shrink_program(make(seed, without), difference)


def shrink_program(made: Made, difference: Difference, reader: Callable[[Made], Reading] = read) -> Made:
    with tempfile.TemporaryDirectory() as folder:

        def holds(candidate: Made) -> bool:
            found = judge(candidate, Path(folder), reader)
            return found is not None and any(one.kind == difference.kind for one in found.differences)

        return Shrinking(holds).least(made, difference.line)


def shrink_all(
    differing: dict[int, Difference], processes: int = 0, without: tuple[str, ...] = ()
) -> Iterator[tuple[int, Made]]:
    """Seed and shrunk program of each."""
    seeds = sorted(differing)
    with ProcessPoolExecutor(processes or os.cpu_count()) as pool:
        shrunk = pool.map(shrink, seeds, [differing[seed] for seed in seeds], repeat(without))
        yield from zip(seeds, shrunk, strict=True)
