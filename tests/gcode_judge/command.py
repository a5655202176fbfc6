"""``python -m tests.gcode_judge --count 10000 --seed 1``: how G-code is read against LinuxCNC's interpreter.

Prints how many programs rs274 accepts, the coverage, and every difference with its shrunk program.  Exit code 1 where
there is one.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from .comparison import Difference
from .generator import make
from .judging import Totals, judge, judge_all, shrink_all
from .oracle import MISSING, RS274
from .spelling import FEATURES


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.gcode_judge", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="programs (1000)")
    parser.add_argument("--seed", type=int, default=1, help="of the first program (1)")
    parser.add_argument("--shrink", type=int, default=100, help="differing programs that are shrunk (100)")
    parser.add_argument("--processes", type=int, default=0, help="all processors without")
    parser.add_argument(
        "--without", nargs="*", default=[], metavar="FEATURE", choices=sorted(FEATURES),
        help="features that no program has, so that what is known of them hides nothing else",
    )  # fmt: skip
    parser.add_argument(
        "--show", type=int, help="print the program of this seed and its differences, no more"
    )
    options = parser.parse_args(arguments)
    if RS274 is None:
        print(MISSING, file=sys.stderr)
        return 2
    without = tuple(options.without)
    if options.show is not None:
        return show(options.show, without)
    start = time.monotonic()
    totals = Totals()
    for part in judge_all(options.count, options.seed, options.processes, without):
        totals.add(part)
    print(summary(totals, time.monotonic() - start), flush=True)
    return report(totals, options.shrink, options.processes, without)


def show(seed: int, without: tuple[str, ...]) -> int:
    made = make(seed, without)
    print(made.text, end="")
    with tempfile.TemporaryDirectory() as folder:
        found = judge(made, Path(folder))
    if found is None:
        print("rs274 does not accept it")
        return 2
    for difference in found.differences:
        print(shown(difference))
    return bool(found.differences)


def shown(difference: Difference) -> str:
    return f"line {difference.line}: {difference.kind}: {difference.message}"


def summary(totals: Totals, seconds: float) -> str:
    motions = max(totals.motions, 1)
    kinds = Counter(difference.kind for difference in totals.differing.values())
    return "\n".join(
        [
            f"{totals.programs} programs, {totals.accepted} accepted by rs274"
            f" ({totals.accepted / max(totals.programs, 1):.1%}), {totals.programs / seconds:.0f} a second",
            f"{totals.motions} motions of rs274: {totals.known} known ({totals.known / motions:.1%});"
            f" place right, refused or not: {totals.located} ({totals.located / motions:.1%});"
            f" {totals.misplaced} refused with another place",
            f"{len(totals.differing)} programs differ: "
            + (", ".join(f"{kind} {count}" for kind, count in kinds.most_common()) or "none"),
        ]
    )


def report(totals: Totals, limit: int, processes: int, without: tuple[str, ...] = ()) -> int:
    """Shrinks and prints; 1 where there is a difference."""
    shrunk = {seed: totals.differing[seed] for seed in sorted(totals.differing)[:limit]}
    for seed, made in shrink_all(shrunk, processes, without):
        print(f"\nseed {seed}, {shown(shrunk[seed])}; shrunk:\n{made.text}", end="", flush=True)
    if len(totals.differing) > limit:
        print(f"\n{len(totals.differing) - limit} more are not shrunk (--shrink)")
    return 1 if totals.differing else 0
