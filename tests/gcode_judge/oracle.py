"""What rs274 makes of a program: its motions in order, in the coordinates of the program, with their lines.

rs274 prints canonical calls with four decimals in the program's unit, without the shift of G92, which it states apart;
axes of arcs are (X, Y) in G17, (Z, X) in G18, (Y, Z) in G19.  Beside each call stands the N word of the line that it
comes from: the program is run with its line numbers there, which mean nothing to LinuxCNC.  One process a program.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .blocks import Made

RS274 = shutil.which("rs274")
MISSING = "rs274 is missing: install the package linuxcnc-uspace"
TIMEOUT = 20.0
"""[s]; a program that runs longer is one that does not end."""
INCH = 25.4
_CALL = re.compile(r"^ *\d+ N(\S*) +([A-Z0-9_]+)\((.*)\)$", re.M)
_AXES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}


@dataclass(frozen=True)
class Motion:
    """A motion of rs274.

    line: from 1.  kind: "PTP", "LIN" or "CIRC".  start, end (3,) [mm]: in the coordinates of the work offset in
    force, with the shift of G92 in them, as the program's reader has them.  step, start_step [mm]: of the last
    digits printed. base: number of the work offset; rewritten: the program has changed it.  tool: in the spindle,
    -1 before any change to a tool of a T word.  offset (3,) [mm], rotation [deg]: the work offset in force;
    offset_step [mm]: of its last digits.  Of arcs: centre (3,) [mm]; turn [rad], counter-clockwise about the plane's
    third axis."""

    line: int
    kind: str
    start: np.ndarray
    end: np.ndarray
    step: float
    start_step: float
    base: int
    rewritten: bool
    tool: int
    centre: np.ndarray | None = None
    turn: float = 0.0
    plane: tuple[int, int, int] = (0, 1, 2)
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: float = 0.0
    offset_step: float = 1e-4

    @property
    def still(self) -> bool:
        """It moves nothing, as a G0 alone."""
        return self.kind != "CIRC" and bool(
            np.abs(self.end - self.start).max() < 2 * max(self.step, self.start_step)
        )


def execute(made: Made, folder: Path, numbered: bool = True) -> list[Motion] | None:
    """The motions of a program but those beside the contour, None where rs274 does not accept it; the files of the run
    go into ``folder``."""
    (folder / "made.ngc").write_text(made.numbered if numbered else made.text, encoding="latin-1")
    lengths = (0.5, 1.25, 2.0, 3.5)
    (folder / "tool.tbl").write_text(
        "".join(f"T{n} P{n} D0.0 Z{length} ;\n" for n, length in enumerate(lengths, 1))
    )
    (folder / "fresh.var").write_text(_memory(made.offsets))
    command = [str(RS274), "-g", "-n", "2", "-t", "tool.tbl", "-v", "fresh.var", "made.ngc"]
    if made.delete:
        command.insert(1, "-b")
    try:
        # The table of tools is kept in a file of the home folder, which all runs would share.
        (folder / ".tool.mmap").unlink(missing_ok=True)
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "HOME": str(folder)},
            capture_output=True,
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
    if done.returncode or done.stderr.decode("latin-1").strip() != "executing":
        return None
    motions = _Account().of(done.stdout.decode("latin-1"))
    beside = made.beside if numbered else {}
    last = {motion.line: at for at, motion in enumerate(motions)}
    return [
        motion
        for at, motion in enumerate(motions)
        if motion.line not in beside or (beside[motion.line] and at == last[motion.line])
    ]


def _memory(seed: int) -> str:
    """Offsets G54 to G59.3 and the places of G28 and G30, in inches."""
    chance = random.Random(seed)
    rows = [(5161 + axis, chance.uniform(-9, 9)) for axis in range(3)]
    rows += [(5181 + axis, chance.uniform(-9, 9)) for axis in range(3)]
    rows += [(5221 + 20 * n + axis, chance.uniform(-20, 20)) for n in range(9) for axis in range(3)]
    return "".join(f"{number}\t{value:.4f}\n" for number, value in rows)


class _Account:
    """Follows the canonical calls."""

    def __init__(self) -> None:
        self.unit = 1.0
        self.axes = _AXES["XY"]
        self.shift, self.shift_unit = np.zeros(3), 1.0
        self.offset, self.length, self.rotation = np.zeros(3), np.zeros(3), 0.0
        self.here, self.step, self.offset_step = np.zeros(3), 1e-4, 1e-4
        self.base, self.tool, self.selected = 1, -1, False
        self.offsets: dict[int, np.ndarray] = {}
        self.rewritten: set[int] = set()
        self.motions: list[Motion] = []

    def of(self, text: str) -> list[Motion]:
        for word, name, arguments in _CALL.findall(text):
            number = int(word) if word.isdigit() else -1
            if name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
                end = np.array([float(value) for value in arguments.split(",")[:3]]) * self.unit + self.shift
                kind = "PTP" if name == "STRAIGHT_TRAVERSE" else "LIN"
                self.add(number, kind, end)
            elif name == "NURBS_FEED":
                self.here = np.array([np.nan, np.nan, self.here[2]])  # its end is not printed
            elif name == "ARC_FEED":
                self.arc(number, [float(value) for value in arguments.split(",")[:6]])
            else:
                self.state(name, arguments)
        return self.motions

    def state(self, name: str, arguments: str) -> None:
        """What holds from here on; the machine stays where it is."""
        place = self.turned(self.here, self.rotation) + self.offset + self.length
        self.set(name, arguments)
        self.here = self.turned(place - self.offset - self.length, -self.rotation)

    @staticmethod
    def turned(vector: np.ndarray, angle: float) -> np.ndarray:
        cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ vector

    def set(self, name: str, arguments: str) -> None:
        if name == "USE_LENGTH_UNITS":
            self.unit = INCH if "INCH" in arguments else 1.0
        elif name == "SELECT_PLANE":
            self.axes = _AXES[arguments[-2:]]
        elif name == "SET_G92_OFFSET":
            # What the program's reader has as coordinates are those with this shift: they stay.
            self.shift = np.array([float(value) for value in arguments.split(",")[:3]]) * self.unit
            self.shift_unit = self.unit
        elif name == "SET_G5X_OFFSET":
            words = arguments.split(",")
            self.base = int(words[0])
            values = np.array([float(word) for word in words[1:4]]) * self.unit
            self.offset, self.offset_step = values, 1e-4 * self.unit
            if np.abs(self.offsets.setdefault(self.base, values) - values).max() > 0.01:
                self.rewritten.add(self.base)
        elif name == "SET_XY_ROTATION":
            self.rotation = float(arguments)
        elif name == "USE_TOOL_LENGTH_OFFSET":
            first = arguments.replace(",", " ").split()[:3]
            self.length = np.array([float(word) for word in first]) * self.unit
        elif name == "SELECT_TOOL":
            self.selected = True
        elif name == "CHANGE_TOOL" and self.selected:
            self.tool = int(float(arguments))

    def add(self, line: int, kind: str, end: np.ndarray, **arc: object) -> None:
        # Both the place and the shift are printed with four decimals.
        step = 1e-4 * (self.unit + self.shift_unit * self.shift.any())
        changed = self.base in self.rewritten or self.rotation != 0.0
        arc |= {"offset": self.offset, "rotation": self.rotation, "offset_step": self.offset_step}
        self.motions.append(
            Motion(line, kind, self.here, end, step, self.step, self.base, changed, self.tool, **arc)  # type: ignore[arg-type]
        )
        self.here, self.step = end, step

    def arc(self, line: int, numbers: list[float]) -> None:
        one, two, first, second, third = (value * self.unit for value in (*numbers[:4], numbers[5]))
        u, v, w = self.axes
        end, centre = np.zeros(3), self.here.copy()
        end[[u, v, w]] = one, two, third
        end += self.shift
        centre[[u, v]] = first + self.shift[u], second + self.shift[v]
        rounds = round(numbers[4])
        before, after = (np.arctan2(*(at - centre)[[v, u]]) for at in (self.here, end))
        sense = 1 if rounds > 0 else -1
        angle = (sense * (after - before)) % (2 * np.pi)
        # the start may be printed in the other unit, with coarser digits
        if np.hypot(*(end - self.here)[[u, v]]) < 2.0 * max(1e-4 * self.unit, self.step):
            angle = 2 * np.pi
        angle += 2 * np.pi * (abs(rounds) - 1)
        self.add(line, "CIRC", end, centre=centre, turn=float(sense * angle), plane=(u, v, w))
