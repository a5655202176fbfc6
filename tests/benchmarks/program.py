"""Whole runs of the main job: ``python -m tests.benchmarks.program`` prints a table of time and memory by size.

Each run is a process of its own, with start-up, reading back and all reports; the programs are a waving path over a
part with a force for each motion, in KRL and, with one arc in five motions, in G-code.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

CELL = """\
robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
orientation: {a: 0, b: 0, c: 180}
"""


def path(count: int) -> np.ndarray:
    """(count, 3) [mm]: a wave that moves on, some 6 mm between points."""
    t = np.linspace(0, count / 50, count)
    return np.stack(
        [400 + 300 * np.cos(0.11 * t), 400 + 350 * np.sin(0.017 * t), np.full(count, -2.0)], axis=1
    )


def forces(folder: Path, name: str, lines: np.ndarray) -> None:
    """A force for each of the lines."""
    table = np.column_stack([lines, -100 - 50 * np.cos(0.0022 * lines), 120 + 0.0 * lines, 60 + 0.0 * lines])
    np.savetxt(folder / f"{name}.force.csv", table, "%d,%.2f,%.2f,%.2f", header="line,fx,fy,fz", comments="")


def krl(folder: Path, count: int) -> Path:
    points = path(count)
    x, y, _ = points[0].tolist()
    head = [
        "DEF big()",
        "BAS(#INITMOV,0)",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
        "$VEL.CP=0.05",
        f"LIN {{X {x:.3f},Y {y:.3f},Z 50.000,A 0.000,B 0.000,C 180.000}}",
    ]
    body = [
        f"LIN {{X {x:.3f},Y {y:.3f},Z {z:.3f},A 0.000,B 0.000,C 180.000}} C_DIS"
        for x, y, z in points.tolist()
    ]
    (folder / "big.src").write_text("\r\n".join([*head, *body, "LIN {Z 50.000}", "END", ""]))
    forces(folder, "big", np.arange(count) + len(head) + 1)
    return folder / "big.src"


def gcode(folder: Path, count: int) -> Path:
    points = path(count)
    x, y, _ = points[0].tolist()
    head = ["G21 G90 G17 G54", "T1 M6", f"G0 X{x:.3f} Y{y:.3f} Z50."]
    body = [f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F3000" for x, y, z in points.tolist()]
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    for i in range(4, count, 5):  # a flat arc of the same chord
        x, y, z = points[i].tolist()
        body[i] = f"G3 X{x:.3f} Y{y:.3f} Z{z:.3f} R{max(5 * step[i - 1], 10.0):.3f}"
    (folder / "big.ngc").write_text("\n".join([*head, *body, "G0 Z50.", "M30", ""]))
    forces(folder, "big", np.arange(count) + len(head) + 1)
    return folder / "big.ngc"


MAKERS: dict[str, Callable[[Path, int], Path]] = {"krl": krl, "gcode": gcode}


def run(maker: Callable[[Path, int], Path], count: int) -> tuple[float, float, float]:
    """Wall and processor time [s], and the largest memory [MB] of one run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "cell.yaml").write_text(CELL)
        program = maker(folder, count)
        begin = time.perf_counter()
        process = subprocess.Popen([sys.executable, "-m", "postproc", str(program), "--force", "-q"])
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        if os.waitstatus_to_exitcode(status) not in (0, 3):
            raise SystemExit(f"{program.name} with {count} motions failed")
        return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="1000,10000,100000", help="motions, between commas")
    sizes = [int(word) for word in parser.parse_args().sizes.split(",")]
    print(f"{'':6} {'motions':>9} {'wall s':>8} {'cpu s':>8} {'us a motion':>12} {'MB':>6} {'exponent':>9}")
    for language, maker in MAKERS.items():
        before: tuple[int, float] | None = None
        for count in sizes:
            wall, cpu, memory = run(maker, count)
            growth = "" if before is None else f"{np.log(cpu / before[1]) / np.log(count / before[0]):9.2f}"
            print(
                f"{language:6} {count:9d} {wall:8.2f} {cpu:8.2f} {1e6 * cpu / count:12.1f} {memory:6.0f} {growth}"
            )
            before = (count, cpu)


if __name__ == "__main__":
    main()
