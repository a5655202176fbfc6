"""Compensate the cells of the paper's square with and without its gravity compensator, and compare the programs.

    python compare.py

Everything is done by the command line, in a temporary folder: `map` finds the cells in reach, a program visits each
of them under the force, `compensate` corrects it with three robot files that differ in the compensator alone.
"""

from __future__ import annotations

import csv
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SQUARE = "--x 200:2200 --y=-1000:1000 --z 500 --grid 41 --tool 0,0,300 --orientation 0,0,180"
FORCE = "--force=-360,0,560@world"

CELL = """\
robot: kuka_kr270
tools:
  1: {x: 0, y: 0, z: 300, a: 0, b: 0, c: 0, axis: +z}
bases:
  1: {x: 0, y: 0, z: 0, a: 0, b: 0, c: 0}
"""

# what stands in robots/kuka_kr270.yaml -> what stands there instead
MODELS = {
    "without compensator": (r"(K_c:\s+value: )\S+", r"\g<1>0"),
    "sign as_printed": (r"sign: energy", "sign: as_printed"),
    "sign energy": (r"sign: energy", "sign: energy"),
}


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run(f"map --robot kuka_kr270 {SQUARE} {FORCE} --csv {folder / 'square.csv'} -q")
        cells = [row for row in rows(folder / "square.csv") if row["reachable"] == "1"]
        write_program(folder, cells)
        original = robot_file().read_text(encoding="utf-8")
        moved = {}
        for number, (title, (what, instead)) in enumerate(MODELS.items()):
            text, found = re.subn(what, instead, original)
            if found != 1:
                raise SystemExit(f"{what!r} stands {found} times in the robot file")
            (folder / f"robot{number}.yaml").write_text(text, encoding="utf-8")
            out = folder / f"out{number}"
            run(
                f"{folder / 'square.src'} {FORCE} --robot {folder / f'robot{number}.yaml'}"
                f" -o {out / 'square.src'} -q"
            )
            moved[title] = corrections(out / "square.corrections.csv")
        report(moved)


def run(words: str) -> None:
    done = subprocess.run([sys.executable, "-m", "postproc", *words.split()], check=False)
    if done.returncode not in (
        0,
        3,
    ):  # 3: cells at the rim whose correction leaves the axis limits stay as they are
        raise SystemExit(done.returncode)


def robot_file() -> Path:
    from postproc.robot.description import find_robot

    return find_robot("kuka_kr270")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def write_program(folder: Path, cells: list[dict[str, str]]) -> None:
    """To each cell through the air, then a cut to it."""
    lines = ["DEF square()", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]"]
    for cell in cells:
        axes = ",".join(f"A{i} {cell[f'A{i}_deg']}" for i in range(1, 7))
        place = ",".join(f"{axis.upper()} {cell[f'{axis}_mm']}" for axis in "xyz")
        lines += [f"PTP {{{axes}}}", f"LIN {{{place},A 0,B 0,C 180}}"]
    (folder / "square.src").write_text("\n".join([*lines, "END", ""]), encoding="ascii")
    (folder / "cell.yaml").write_text(CELL, encoding="ascii")


def corrections(path: Path) -> dict[str, tuple[float, ...]]:
    """line -> how far its target was moved [mm], for the motions that were corrected."""
    return {
        row["line"]: tuple(float(row[f"correction_{axis}_mm"]) for axis in "xyz")
        for row in rows(path)
        if row["state"] == "corrected"
    }


def report(moved: dict[str, dict[str, tuple[float, ...]]]) -> None:
    classical = moved["without compensator"]
    print(f"{'compensated with':20}  cells  largest correction mm  farthest from without compensator mm")
    for title, places in moved.items():
        both = places.keys() & classical.keys()
        apart = max(math.dist(places[line], classical[line]) for line in both)
        largest = max(math.hypot(*move) for move in places.values())
        print(f"{title:20}  {len(places):5}  {largest:21.4f}  {apart:36.4f}")


if __name__ == "__main__":
    main()
