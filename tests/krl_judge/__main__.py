"""Judges random programs: ``python -m tests.krl_judge --count 5000 --seed 1``."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable

from .judge import Case, Verdict, judge, judge_split, shrunk
from .programs import Generator
from .written import judge_written


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.krl_judge", description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument(
        "--seed", type=int, default=1, help="of the first program; each next one has the next"
    )
    parser.add_argument("--show", type=int, default=10, help="disagreements that are shrunk and printed")
    parser.add_argument(
        "--split", action="store_true", help="all routines but the first in modules of their own"
    )
    parser.add_argument(
        "--written",
        action="store_true",
        help="motions are moved, and what is written is run beside the program",
    )
    given = parser.parse_args()
    if given.written:
        return run_written(range(given.seed, given.seed + given.count))
    judged = judge_split if given.split else judge
    total: Counter[str] = Counter()
    start, wrong = time.perf_counter(), 0
    for seed in range(given.seed, given.seed + given.count):
        case = Generator(seed).case()
        verdict = judged(case)
        total.update(
            {
                name: getattr(verdict, name)
                for name in ("runs", "motions", "known", "constant", "constant_known", "stopped")
            }
        )
        if verdict.disagreements:
            wrong += 1
            if wrong <= given.show:
                show(seed, case, verdict.disagreements[0].word, judged)
    print(f"{given.count} programs, {total['runs']} runs, {total['stopped']} of them stopped before the end")
    print(f"{total['motions']} motions executed, claimed known {share(total['known'], total['motions'])}")
    print(
        f"{total['constant']} of a line that runs the same each time, "
        f"claimed known {share(total['constant_known'], total['constant'])}"
    )
    print(f"{wrong} programs with disagreements; {time.perf_counter() - start:.0f} s")
    return min(wrong, 1)


def run_written(seeds: range) -> int:
    """Runs what is written for programs whose motions are moved."""
    moves = wrong = 0
    for seed in seeds:
        count, found = judge_written(Generator(seed).case(), seed)
        moves += count
        wrong += bool(found)
        for one in found[:1]:
            print(f"seed {seed}: {one}", flush=True)
    print(f"{len(seeds)} programs, {moves} moved motions executed, {wrong} programs with others than planned")
    return min(wrong, 1)


def share(part: int, whole: int) -> str:
    return f"{part} ({100 * part / max(whole, 1):.1f} %)"


def show(seed: int, case: Case, word: str, judged: Callable[[Case], Verdict]) -> None:
    """Prints the smallest program that still disagrees in that word."""
    small = shrunk(case, lambda smaller: any(d.word == word for d in judged(smaller).disagreements))
    print(f"--- seed {seed}")
    print(small, end="")
    for found in judged(small).disagreements:
        print(f"    line {found.line}: {found.what}")
    print(flush=True)


if __name__ == "__main__":
    sys.exit(main())
