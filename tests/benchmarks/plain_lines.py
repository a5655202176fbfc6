"""Seconds of reading plain lines: `python -m tests.benchmarks.plain_lines [--lines N] [--beside FOLDER]`.

Each reading is in a process of its own, after a small one that has loaded what it needs; ``--beside``: the folder of
another state of the package, which reads the same files.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

KRL_HEAD = (
    "DEF m()\n$TOOL=TOOL_DATA[1]\n$BASE=BASE_DATA[1]\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}\n$VEL.CP=0.05\n"
)
GCODE_HEAD = "G21 G17 G90 G94 G54\nT1 M6\nG43 H1\nG0 X0 Y0 Z50.\nG1 Z5. F500\n"
READ = """
import resource, sys, tempfile, time
from pathlib import Path
from postproc.workflows.preparation import read_program
path = Path(sys.argv[1])
with tempfile.TemporaryDirectory() as folder:
    small = Path(folder) / path.name
    small.write_bytes(path.read_bytes()[:3000].rpartition(b"\\n")[0] + b"\\n")
    read_program(small)
start = time.process_time()
read_program(path)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(f"{time.process_time() - start:.2f} s of the processor, {peak:.0f} MB")
"""


def krl(random_: random.Random, lines: int) -> Iterator[str]:
    yield KRL_HEAD
    limits = ("X", 0, 900), ("Y", -300, 300), ("Z", 0, 200), ("A", -20, 20), ("B", -20, 20), ("C", 170, 180)
    for _ in range(lines):
        values = ",".join(f"{name} {random_.uniform(low, high):.3f}" for name, low, high in limits)
        yield f"LIN {{{values}}} C_DIS\n"
    yield "END\n"


def gcode(random_: random.Random, lines: int) -> Iterator[str]:
    yield GCODE_HEAD
    limits = ("X", 0, 900), ("Y", -300, 300), ("Z", 0, 200)
    for number in range(lines):
        words = " ".join(f"{name}{random_.uniform(low, high):.3f}" for name, low, high in limits)
        yield f"N{number + 1} G1 {words}\n"
    yield "M2\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=1_000_000)
    parser.add_argument("--beside", type=Path, help="folder of another state of the package")
    options = parser.parse_args()
    here = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as folder:
        for name, written in (("part.src", krl), ("part.ngc", gcode)):
            path = Path(folder) / name
            with path.open("w") as file:
                file.writelines(written(random.Random(4), options.lines))
            for state, root in (("this state", here), ("beside", options.beside)):
                if root is None:
                    continue
                environment = os.environ | {"PYTHONPATH": str(root)}
                command = [sys.executable, "-c", READ, str(path)]
                found = subprocess.run(command, env=environment, cwd=folder, check=True, capture_output=True)
                print(f"{options.lines} lines, {path.suffix[1:]}, {state}: {found.stdout.decode().strip()}")


if __name__ == "__main__":
    main()
