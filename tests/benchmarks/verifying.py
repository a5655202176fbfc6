"""``python -m tests.benchmarks.verifying`` prints what ``compensate verify`` takes for programs of some sizes, each run
in a process of its own with start-up and result; the programs are those of ``tests/benchmarks/program.py``.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.machine import heading
from tests.benchmarks.parts import MAKERS, made_apart
from tests.benchmarks.processes import compensation, cost_of

WALL = {1_000_000: 20.0}
"""[s] Goals by the clock, by size."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--sizes", default="10000,100000,1000000", help="motions, between commas [%(default)s]"
    )
    parser.add_argument("--language", choices=MAKERS, default="krl")
    asked = parser.parse_args()
    print(heading())
    print(f"{'':6} {'motions':>9} {'wall s':>8} {'cpu s':>8} {'us a motion':>12} {'MB':>6}  wanted")
    for count in sorted(int(word) for word in asked.sizes.split(",")):
        with tempfile.TemporaryDirectory() as name:
            program = made_apart(Path(name), asked.language, count)
            compensation(program, count)
            written = program.parent / "compensated" / program.name
            words = [sys.executable, "-m", "postproc", "verify", program, written, "--force", "-q"]
            cost = cost_of([*words, "--json", Path(name) / "verified.json"], (0, 3))
        wanted = f"  {WALL[count]:g} s" if count in WALL else ""
        print(
            f"{asked.language:6} {count:9d} {cost.wall:8.2f} {cost.cpu:8.2f} {1e6 * cost.cpu / count:12.1f}"
            f" {cost.memory:6.0f}{wanted}",
            flush=True,
        )


if __name__ == "__main__":
    main()
