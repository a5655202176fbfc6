"""``python -m tests.benchmarks.batching`` prints what ``compensate batch`` takes for many small programs, and whether a
Dask cluster on this machine writes the same bytes.

A batch is a process of its own, with start-up and all reports; its workers load the package once each.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
from pathlib import Path

from tests.benchmarks.machine import heading
from tests.benchmarks.parts import program
from tests.benchmarks.processes import Cost, cost_of

EACH = 0.12
"""[s] Goal by the clock for a program, on two cores."""


def batch(programs: Path, output: Path, *options: object) -> Cost:
    words = [sys.executable, "-m", "postproc", "batch", programs, "--force", "-q", "-o", output, *options]
    return cost_of(words, (0, 3))


def digest(folder: Path) -> str:
    """Of names and bytes of all programs, differences and tables in a folder; pages and results name their place."""
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".src", ".diff", ".csv"):
            found.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=int, default=200, help="[%(default)s]")
    parser.add_argument("--motions", type=int, default=100, help="of each [%(default)s]")
    parser.add_argument("--dask", type=int, default=0, metavar="WORKERS", help="a cluster as well")
    asked = parser.parse_args()
    print(heading())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number in range(asked.programs):
            program(folder / "parts" / f"{number:04}", "krl", asked.motions + number % 7)
        parts = folder / "parts" / "**" / "*.src"
        count = f"{asked.programs} programs of {asked.motions} motions"
        cost = batch(parts, folder / "here")
        each = cost.wall / asked.programs
        print(
            f"{count}: {cost.wall:.2f} s, processor {cost.cpu:.2f} s; a program {each:.3f} s,"
            f" processor {cost.cpu / asked.programs:.3f} s  (wanted {EACH:g} s)"
        )
        if asked.dask:
            from distributed import LocalCluster

            with LocalCluster(n_workers=asked.dask, threads_per_worker=1, host="127.0.0.1") as cluster:
                cost = batch(parts, folder / "there", "--dask", cluster.scheduler_address)
            same = digest(folder / "here") == digest(folder / "there")
            print(
                f"the same on {asked.dask} Dask workers: {cost.wall:.2f} s;"
                f" bytes {'the same' if same else 'NOT the same'}"
            )


if __name__ == "__main__":
    main()
