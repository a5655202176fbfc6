"""The same bytes however a program is worked on: ``python -m tests.same_bytes --programs 100``.

All samples, and programs of both languages that are drawn at random (``tests/judge/drawn.py``), are compensated in one
thread in memory; then with 1, 2 and 4 threads, in blocks of 1, 7 and 4096 rows, with arrays in files whose pages are
given back all the time: each program with each of these numbers, and all of their nine pairs among the programs.
Every file that is written has to be the same to the last byte, or the refusal.

``--digests FILE`` writes the digest of each program's results, or compares them with those that are there: what
another state of the package writes, where this file is run with it (``PYTHONPATH=OTHER python tests/same_bytes.py``).
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from judge.drawn import drawn

import postproc
from postproc import api
from postproc.base import batches, geometry, paged_memory
from postproc.base.findings import Refusal

THREADS, BLOCKS = (1, 2, 4), (1, 7, 4096)
SUFFIXES = {".src", ".ngc", ".mod", ".ls"}
SAMPLES = Path(__file__).resolve().parents[1] / "samples"
PRICE = 60_000
"""Bytes of a program from which on blocks of one row are left to others: a sample takes minutes with them."""


def programs(count: int, folder: Path, samples: bool) -> Iterator[tuple[str, Path]]:
    """Name and file of each program, in a folder of its own."""
    found = sorted(path for path in SAMPLES.glob("*/*") if path.suffix in SUFFIXES)
    for sample in found if samples else ():
        there = folder / sample.parent.name
        if not there.exists():
            shutil.copytree(sample.parent, there)
        yield f"{sample.parent.name}/{sample.name}", there / sample.name
    for seed in range(count):
        case = drawn(seed)
        there = folder / f"drawn{seed}"
        there.mkdir()
        yield case.name, case.build(there)


def results(program: Path) -> str:
    """The digest of all files of a run, without the folders of program and package in them."""
    places = [str(place).encode() for place in (program.parent, Path(postproc.__file__).parents[1])]
    output, found = program.parent / "same", hashlib.sha256()
    parts = []
    shutil.rmtree(output, ignore_errors=True)
    try:
        api.compensate(program, force=True, output=output / program.name)
    except Refusal as refusal:
        parts.append(str(refusal).encode())
    for path in sorted(output.iterdir()) if output.exists() else ():
        parts += [path.name.encode() + b"\0", path.read_bytes()]
    for part in parts:
        for place in places:
            part = part.replace(place, b"")
        found.update(part)
    return found.hexdigest()


def set_work(rows: int, threads: int, paged: bool) -> None:
    """How blocks are made from now on."""
    changed: dict[Any, dict[str, int]] = {
        batches: {"ROWS": rows, "SPAN": rows + 1 if paged else 1 << 19},
        geometry: {"STORED": rows if paged else 1 << 14},
        paged_memory: {"PROGRAM": 0, "LARGE": 1 << 16, "RESIDENT": 0}
        if paged
        else {"PROGRAM": 16 << 20, "LARGE": 8 << 20, "RESIDENT": 256 << 20},
    }
    for module, values in changed.items():
        for name, value in values.items():
            setattr(module, name, value)
    os.environ[batches.THREADS] = str(threads)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--programs", type=int, default=100, help="that are drawn [%(default)s]")
    parser.add_argument("--without-samples", action="store_true", help="drawn programs alone")
    parser.add_argument("--digests", type=Path, help="written, or compared where it is there")
    asked = parser.parse_args()
    usual, other, runs = batches.ROWS, [], 0
    digests: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as name:
        for number, (program, path) in enumerate(
            programs(asked.programs, Path(name), not asked.without_samples)
        ):
            set_work(usual, 1, paged=False)
            digests[program] = results(path)
            for k, threads in enumerate(THREADS):
                rows = BLOCKS[(k + number) % len(BLOCKS)]
                if rows == 1 and path.stat().st_size > PRICE:
                    continue
                set_work(rows, threads, paged=True)
                runs += 1
                if results(path) != digests[program]:
                    other.append(f"{program}: {threads} threads, blocks of {rows} rows")
    print(f"{len(digests)} programs, {runs} further runs: {len(other)} with other bytes", *other, sep="\n  ")
    if asked.digests:
        lines = [f"{digest}  {program}" for program, digest in digests.items()]
        if asked.digests.exists():
            before = set(asked.digests.read_text().splitlines())
            changed = [line for line in lines if line not in before]
            print(
                f"against {asked.digests.name}: {len(changed)} of {len(lines)} changed", *changed, sep="\n  "
            )
        else:
            asked.digests.write_text("\n".join(lines) + "\n")
    sys.exit(1 if other else 0)


if __name__ == "__main__":
    main()
