"""G-code of the kinds that the cases have: lines and arcs in mm, three axes or a TCP mode with rotary words."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from .cell import Cell
from .motion import CONTINUOUS, DEG, MM, Motion, about

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))", re.I)
_FORCE = re.compile(r"\(\s*FORCE\s+(OFF|[-+0-9., Ee]+?)\s*(?:@\s*(\w+))?\s*\)", re.I)
_ACROSS = {17: 2, 18: 1, 19: 0}


class Unread(ValueError):
    """A word that this reader does not know."""


def read_gcode(path: Path, cell: Cell) -> list[Motion]:
    """The motions of a program, in order.  Rotary words turn the tool of the cell: Rz(C) Ry(B) Rx(A)."""
    reader = _Reader(cell)
    for number, line in enumerate(path.read_bytes().decode("latin-1").splitlines(), 1):
        reader.take(line, number)
    return reader.motions


class _Reader:
    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.motions: list[Motion] = []
        self.state = Motion("", 0)
        self.place: dict[str, float] = {}
        self.turn = {"A": 0.0, "B": 0.0, "C": 0.0}
        self.move, self.plane, self.absolute = 0, 17, True
        self.approximation = CONTINUOUS
        self.tip, self.stated = False, set[str]()
        self.waiting = min(cell.tools)
        self.set_tool(self.waiting)
        self.state.base = cell.bases.get(1, cell.robot_base)

    def set_tool(self, number: int) -> None:
        self.state.tool, self.state.spindle = self.cell.tools[number], self.cell.spindles[number]

    def take(self, line: str, number: int) -> None:
        for found in _FORCE.finditer(line):
            if found[1].upper() == "OFF":
                self.state.force = None
            else:
                values = [float(v) for v in re.split(r"[\s,]+", found[1].strip())]
                self.state.force = (np.array((values + [0.0] * 6)[:6]), (found[2] or "base").lower())
        code = re.sub(r"\([^)]*\)|;.*", "", line).strip()
        if not code or code[0] in "%O:/":
            return
        words = [(k.upper(), float(v)) for k, v in _WORD.findall(code)]
        values = {k: v for k, v in words if k not in "GMN"}
        exact = False
        for code_number in (v for k, v in words if k == "G"):
            exact |= code_number == 9
            self.general(code_number)
        if "T" in values:
            self.waiting = int(values["T"])
        if ("M", 6.0) in words:
            self.set_tool(self.waiting)
        if "F" in values:
            self.state.feed = values["F"] * MM / 60
        if any(k in values for k in "XYZABC"):
            self.motion(values, number, exact)

    def general(self, code: float) -> None:
        if code in (0, 1, 2, 3):
            self.move = int(code)
        elif code in _ACROSS:
            self.plane = int(code)
        elif code in (54, 55, 56, 57, 58, 59):
            self.state.base = self.cell.bases[int(code) - 53]
        elif code in (90, 91):
            self.absolute = code == 90
        elif code in (61, 61.1):
            self.approximation = 0.0
        elif code in (43.4, 49):
            self.tip = code == 43.4
        elif code == 64:
            self.approximation = CONTINUOUS
        elif code not in (4, 9, 21, 40, 43, 80, 94):
            raise Unread(f"G{code:g}")

    def motion(self, values: dict[str, float], line: int, exact: bool) -> None:
        before = dict(self.place)
        for key in "XYZ":
            if key in values:
                self.place[key] = values[key] + (0.0 if self.absolute else before[key])
        for key in "ABC":
            if key in values:
                self.stated.add(key)
                self.turn[key] = values[key] + (0.0 if self.absolute else self.turn[key])
        end = np.array([self.place.get(k, 0.0) for k in "XYZ"]) * MM
        new = replace(self.state, line=line, kind="PTP" if self.move == 0 else "LIN", position=end)
        a, b, c = (self.turn[k] * DEG for k in "ABC")
        new.rotation = about(2, c) @ about(1, b) @ about(0, a) @ self.cell.orientation
        if self.tip and any(k in self.stated for k in "ABC"):
            new.words = np.array([a, b, c])
        new.turns = "none" if new.words is None else "axis"
        new.approximation = 0.0 if exact else self.approximation
        if self.move in (2, 3):
            self.arc(new, np.array([before[k] for k in "XYZ"]) * MM, values)
        self.motions.append(new)

    def arc(self, new: Motion, start: np.ndarray, values: dict[str, float]) -> None:
        k = _ACROSS[self.plane]
        new.kind, new.normal = "CIRC", np.eye(3)[k] * (1.0 if self.move == 3 else -1.0)
        if "R" in values:
            radius = values["R"] * MM
            chord = (new.position - start) * (np.arange(3) != k)
            half = np.linalg.norm(chord) / 2
            height = np.sqrt(max(radius**2 - half**2, 0.0))
            across = np.cross(new.normal, chord) / (2 * half)
            new.centre = start + chord / 2 + across * height * np.sign(radius)
        else:
            new.centre = start + np.array([values.get(w, 0.0) for w in "IJK"]) * MM
            new.centre[k] = start[k]
