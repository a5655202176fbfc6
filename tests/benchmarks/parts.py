"""Milling programs of any size: a waving path over a part with a force for each motion, in KRL, G-code, RAPID
and TP.

Written block by block, so that the process that writes a million motions stays small: what a child process is said to
have taken at most counts from its parent's size.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator
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

BLOCK = 20_000

Maker = Callable[[Path, int], Path]


def path(count: int) -> np.ndarray:
    """(count, 3) [mm]: an ellipse that moves to and fro, 0.06 to 0.7 mm between points and never none."""
    t = np.arange(count) / 50
    y = 400 + 60 * np.sin(0.11 * t) + 200 * np.sin(0.017 * t)
    return np.stack([400 + 300 * np.cos(0.11 * t), y, np.full(count, -2.0)], axis=1)


def forces(folder: Path, lines: np.ndarray) -> None:
    """A force for each of the lines."""
    with open(folder / "big.force.csv", "w") as stream:
        stream.write("line,fx,fy,fz\n")
        for block in _blocks(lines):
            size = (-100 - 50 * np.cos(0.0022 * block)).tolist()
            stream.writelines(
                f"{n},{fx:.2f},120.00,60.00\n" for n, fx in zip(block.tolist(), size, strict=True)
            )


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
    with open(folder / "big.src", "w", newline="") as stream:
        stream.writelines(f"{line}\r\n" for line in head)
        for block in _blocks(points):
            stream.writelines(
                f"LIN {{X {x:.3f},Y {y:.3f},Z {z:.3f},A 0.000,B 0.000,C 180.000}} C_DIS\r\n"
                for x, y, z in block.tolist()
            )
        stream.write("LIN {Z 50.000}\r\nEND\r\n")
    forces(folder, np.arange(count) + len(head) + 1)
    return folder / "big.src"


def gcode(folder: Path, count: int) -> Path:
    """One motion in five is a flat arc."""
    points = path(count)
    x, y, _ = points[0].tolist()
    head = ["G21 G90 G17 G54", "T1 M6", f"G0 X{x:.3f} Y{y:.3f} Z50."]
    step = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    radius = np.maximum(5 * step, 10.0)
    radius[np.arange(count) % 5 != 4] = np.nan
    with open(folder / "big.ngc", "w") as stream:
        stream.writelines(f"{line}\n" for line in head)
        for block in _blocks(np.column_stack([points, radius])):
            stream.writelines(
                f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F3000\n"
                if r != r
                else f"G3 X{x:.3f} Y{y:.3f} Z{z:.3f} R{r:.3f}\n"
                for x, y, z, r in block.tolist()
            )
        stream.write("G0 Z50.\nM30\n")
    forces(folder, np.arange(count) + len(head) + 1)
    return folder / "big.ngc"


def rapid(folder: Path, count: int) -> Path:
    points = path(count)
    x, y, _ = points[0].tolist()
    head = ["MODULE big", "PROC main()", "ConfL \\Off;"]

    def line(x: float, y: float, z: float) -> str:
        target = f"[[{x:.3f},{y:.3f},{z:.3f}],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        return f"MoveL {target},v50,z1,tMill\\WObj:=wPart;\r\n"

    with open(folder / "big.mod", "w", newline="") as stream:
        stream.writelines(f"{line}\r\n" for line in head)
        stream.write(line(x, y, 50.0).replace("MoveL", "MoveJ"))
        for block in _blocks(points):
            stream.writelines(line(x, y, z) for x, y, z in block.tolist())
        stream.write("ENDPROC\r\nENDMODULE\r\n")
    with open(folder / "cell.yaml", "a") as stream:
        stream.write("symbols: {TMILL: 1, WPART: 1}\n")
    forces(folder, np.arange(count) + len(head) + 2)
    return folder / "big.mod"


def rapid_named(folder: Path, count: int) -> Path:
    """Each target is declared by a name."""
    points = path(count)
    x, y, _ = points[0].tolist()

    def declared(name: str, x: float, y: float, z: float) -> str:
        target = f"[[{x:.3f},{y:.3f},{z:.3f}],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
        return f"CONST robtarget {name}:={target};\r\n"

    with open(folder / "big.mod", "w", newline="") as stream:
        stream.write("MODULE big\r\n" + declared("pAbove", x, y, 50.0))
        for start in range(0, count, BLOCK):
            part = enumerate(points[start : start + BLOCK].tolist(), start)
            stream.writelines(declared(f"p{number}", *place) for number, place in part)
        stream.write("PROC main()\r\nConfL \\Off;\r\nMoveJ pAbove,v50,z1,tMill\\WObj:=wPart;\r\n")
        stream.writelines(f"MoveL p{number},v50,z1,tMill\\WObj:=wPart;\r\n" for number in range(count))
        stream.write("ENDPROC\r\nENDMODULE\r\n")
    with open(folder / "cell.yaml", "a") as stream:
        stream.write("symbols: {TMILL: 1, WPART: 1}\n")
    forces(folder, np.arange(count) + count + 6)
    return folder / "big.mod"


def tp(folder: Path, count: int) -> Path:
    points = path(count)
    head = ["/PROG BIG", "/MN", "   1:  UFRAME_NUM=1 ;", "   2:  UTOOL_NUM=1 ;", "   3:J P[1] 5% FINE    ;"]

    def point(number: int, x: float, y: float, z: float) -> str:
        axes = f"X = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm"
        turns = "W =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg"
        head = f"P[{number}]{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        return f"{head}\t{axes},\n\t{turns}\n}};\n"

    with open(folder / "big.ls", "w") as stream:
        stream.writelines(f"{line}\n" for line in head)
        stream.writelines(f"{n + 4:4d}:L P[{n + 2}] 50mm/sec CNT100    ;\n" for n in range(count))
        stream.write("/POS\n" + point(1, *points[0, :2].tolist(), 50.0))
        for start in range(0, count, BLOCK):
            part = enumerate(points[start : start + BLOCK].tolist(), start + 2)
            stream.writelines(point(number, *place) for number, place in part)
        stream.write("/END\n")
    forces(folder, np.arange(count) + len(head) + 1)
    return folder / "big.ls"


MAKERS: dict[str, Maker] = {"krl": krl, "gcode": gcode, "rapid": rapid, "rapid_named": rapid_named, "tp": tp}


def program(folder: Path, language: str, count: int) -> Path:
    """The program of ``count`` motions under force, with its cell and its forces, in ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cell.yaml").write_text(CELL)
    return MAKERS[language](folder, count)


def _blocks(rows: np.ndarray) -> Iterator[np.ndarray]:
    return (rows[begin : begin + BLOCK] for begin in range(0, len(rows), BLOCK))


def main() -> None:
    parser = argparse.ArgumentParser(description="Write a milling program with its cell and its forces.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("language", choices=MAKERS)
    parser.add_argument("count", type=int, help="motions under force")
    asked = parser.parse_args()
    print(program(asked.folder, asked.language, asked.count))


def made_apart(folder: Path, language: str, count: int) -> Path:
    """``program`` in a process of its own."""
    words = [sys.executable, "-m", "tests.benchmarks.parts", str(folder), language, str(count)]
    return Path(subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip())


if __name__ == "__main__":
    main()
