"""Whole runs of the main job: ``python -m tests.benchmarks.program`` prints a table of time and memory by size.

Each run is a process of its own, with start-up, reading back and all reports; the programs are a waving path over a
part with a force for each motion, in KRL and, with one arc in five motions, in G-code.  The exponent is that of the
growth of processor time with the number of motions, from the size before and fitted over all from 10,000 on.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

from tests.benchmarks.machine import heading
from tests.benchmarks.parts import MAKERS, made_apart
from tests.benchmarks.processes import Cost, compensation, cost_of

SIZES = "1000,10000,100000"
FITTED_FROM = 10_000
EXPONENT = 1.05
"""Goal of the growth."""

WALL = {
    "krl": {100: 0.35, 1_000_000: 8.0},
    "gcode": {100: 0.35, 1_000_000: 12.0},
    "rapid": {1_000_000: 20.0},
}
"""[s] Goals by the clock for whole runs, by language and size."""

MEMORY = {1_000_000: 800.0, 3_000_000: 1500.0, 10_000_000: 1500.0}
"""[MB] Goals."""

SMALL, SMALL_WALL = 2000, 1.0
HELP_WALL = 0.05
TIMES = 5


def rows(language: str, sizes: list[int]) -> list[tuple[int, Cost]]:
    """The cost of a run of each size, printed as it is known."""
    found: list[tuple[int, Cost]] = []
    for count in sizes:
        with tempfile.TemporaryDirectory() as name:
            cost = compensation(made_apart(Path(name), language, count), count)
        growth = ""
        if found:
            before, less = found[-1]
            growth = f"{np.log(cost.cpu / less.cpu) / np.log(count / before):9.2f}"
        goal = WALL.get(language, {}).get(count)
        wanted = [] if goal is None else [f"{goal:g} s"]
        wanted += [f"{MEMORY[count]:g} MB"] if count in MEMORY else []
        print(
            f"{language:6} {count:9d} {cost.wall:8.2f} {cost.cpu:8.2f} {1e6 * cost.cpu / count:12.1f}"
            f" {cost.memory:6.0f} {growth:9}  {', '.join(wanted)}".rstrip(),
            flush=True,
        )
        found.append((count, cost))
    return found


def fitted(found: list[tuple[int, Cost]]) -> float | None:
    """The exponent of processor time from ``FITTED_FROM`` motions on; None of fewer than two sizes."""
    seen = [(count, cost.cpu) for count, cost in found if count >= FITTED_FROM]
    if len(seen) < 2:
        return None
    return float(np.polyfit(*np.log(np.array(seen)).T, 1)[0])


def walls(work: Callable[[], Cost]) -> float:
    """[s] by the clock, the median of some."""
    return median(work().wall for _ in range(TIMES))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default=SIZES, help="motions, between commas [%(default)s]")
    parser.add_argument("--languages", default=",".join(MAKERS), help="[%(default)s]")
    asked = parser.parse_args()
    sizes = sorted(int(word) for word in asked.sizes.split(","))
    print(heading())
    print(
        f"{'':6} {'motions':>9} {'wall s':>8} {'cpu s':>8} {'us a motion':>12} {'MB':>6} {'exponent':>9}  wanted"
    )
    growths = {language: fitted(rows(language, sizes)) for language in asked.languages.split(",")}
    for language, growth in growths.items():
        if growth is not None:
            print(
                f"{f'{language}, exponent from {max(FITTED_FROM, sizes[0])} to {sizes[-1]}':48} {growth:7.2f}"
                f"    {EXPONENT:g}"
            )
    with tempfile.TemporaryDirectory() as name:
        small = made_apart(Path(name), "krl", SMALL)
        seconds = walls(lambda: compensation(small, SMALL))
    print(f"{f'krl, {SMALL} motions, wall, median of {TIMES}':48} {seconds:7.2f} s  {SMALL_WALL:g} s")
    seconds = walls(lambda: cost_of([sys.executable, "-m", "postproc", "--help"]))
    print(f"{f'--help, wall, median of {TIMES}':48} {seconds:7.2f} s  {HELP_WALL:g} s")


if __name__ == "__main__":
    main()
