"""KRL programs of the kinds that the cases have: straight lines of motions, inline forms, spline blocks."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from .cell import Cell, Frame
from .motion import CONTINUOUS, DEG, MM, Motion, from_abc

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[Ee][+-]?\d+)?"
_KEY = re.compile(rf"\b([A-Z][A-Z_]*\d?)\s+({NUMBER}|#\w+|TRUE|FALSE)", re.I)
_MOTION = re.compile(r"(S?PTP|S?LIN|S?CIRC|SPL)\b\s*(.*)", re.I)
_DECL = re.compile(
    r"DECL\s+(?:GLOBAL\s+)?(E6POS|POS|FRAME|E6AXIS|FDAT|LDAT|PDAT)\s+(\w+)\s*=\s*\{(.*)\}", re.I
)
STOPPING = re.compile(r"(?:WAIT|HALT)\b|\$(?:OUT|ANOUT)\s*\[", re.I)
_FORCE = re.compile(r";\s*FORCE\s+(OFF|[-+0-9., Ee]+?)\s*(?:@\s*(\w+))?\s*$", re.I)
FULL = ("X", "Y", "Z", "A", "B", "C")


class Unread(ValueError):
    """A line that this reader does not know; it guesses nothing."""


def read_krl(path: Path, cell: Cell) -> list[Motion]:
    """The motions of a ``.src`` with its ``.dat``, in order."""
    data = {}
    dat = path.with_suffix(".dat")
    if dat.exists():
        for line in dat.read_bytes().decode("latin-1").splitlines():
            if found := _DECL.match(line.strip()):
                data[found[2].upper()] = _aggregate(found[3])
    reader = _Reader(cell, data)
    for number, line in enumerate(path.read_bytes().decode("latin-1").splitlines(), 1):
        try:
            reader.take(line.strip(), number)
        except Unread as error:
            raise Unread(f"{path.name}:{number}: {error}: {line}") from None
    return reader.motions


def _aggregate(text: str) -> dict[str, float | str]:
    text = re.sub(r"^\s*\{?\s*(?:\w+\s*:)?", "", text)
    return {k.upper(): v.upper() if v[0] in "#TtFf" else float(v) for k, v in _KEY.findall(text)}


def _frame_of(values: dict) -> Frame:
    x, y, z, a, b, c = (float(values.get(key, 0.0)) for key in FULL)
    return from_abc(a, b, c), np.array([x, y, z]) * MM


def _without_comment(line: str) -> str:
    return re.sub(r'^((?:[^";]|"[^"]*")*);.*$', r"\1", line).strip()


class _Reader:
    def __init__(self, cell: Cell, data: dict[str, dict]) -> None:
        self.cell, self.data = cell, data
        self.motions: list[Motion] = []
        self.last: dict[str, float] = {}
        self.state = Motion("", 0)
        self.distance = 3.0 * MM
        self.active: dict[str, dict | None] = {}
        self.spline = 0
        self.in_spline = False
        self.continued = False
        self.set_tool(min(cell.tools, default=0))
        self.state.base = cell.robot_base

    def set_tool(self, number: int) -> None:
        if number:
            self.state.tool, self.state.spindle = self.cell.tools[number], self.cell.spindles[number]
        else:
            self.state.tool = (np.eye(3), np.zeros(3))

    def set_base(self, number: int) -> None:
        # bases stand in $WORLD, as what the program does; $WORLD itself is base 0
        self.state.base = self.cell.bases[number] if number else (np.eye(3), np.zeros(3))

    def take(self, line: str, number: int) -> None:
        if said := _FORCE.match(line):
            self.force(said[1], said[2])
            return
        code = _without_comment(line)
        if not code or code.startswith("&"):
            return
        if found := _MOTION.match(code):
            self.motion(found[1].upper(), found[2], number)
        elif code.upper().startswith("SPLINE"):
            self.spline += 1
            self.in_spline = True
        elif code.upper().startswith("ENDSPLINE"):
            self.in_spline = False
        else:
            if STOPPING.match(code) and not self.continued and self.motions:
                self.motions[-1].approximation = 0.0  # nothing is planned ahead, so nothing is rounded
            self.statement(code)
        self.continued = code.upper() == "CONTINUE"

    def force(self, numbers: str, frame: str | None) -> None:
        if numbers.upper() == "OFF":
            self.state.force = None
            return
        values = [float(v) for v in re.split(r"[\s,]+", numbers.strip())]
        self.state.force = (np.array((values + [0.0] * 6)[:6]), (frame or "base").lower())

    def statement(self, code: str) -> None:
        word = code.upper().replace(" ", "")
        if found := re.match(r"\$(BASE|TOOL)=(?:\w+_DATA\[(\d+)\]|(\{.*\})|\$NULLFRAME)", word):
            which = found[1]
            if found[3]:
                value = _frame_of(_aggregate(code[code.index("{") :]))
                if which == "TOOL":
                    self.state.tool = value
                else:
                    self.state.base = value
            elif which == "TOOL":
                self.set_tool(int(found[2] or 0))
            else:
                self.set_base(int(found[2] or 0))
        elif found := re.match(r"\$APO\.CDIS=(.*)", word):
            self.distance = float(found[1]) * MM
        elif found := re.match(r"\$VEL\.CP=(.*)", word):
            self.state.feed = float(found[1])
        elif found := re.match(r"\$ORI_TYPE=(#\w+)", word):
            self.state.orientation_type = found[1]
        elif found := re.match(r"\$CIRC_TYPE=(#\w+)", word):
            self.state.circle_type = found[1]
        elif found := re.match(r"([FLP])DAT_ACT=(\w+)", word):
            self.active[found[1]] = self.data.get(found[2])
        elif found := re.match(r"BAS\(#(\w+),([-+0-9.E]+)\)", word):
            self.bas(found[1], float(found[2]))
        elif re.match(r"(DEF|END|INTERRUPT|GLOBALINTERRUPT|HALT|WAIT|CONTINUE|\$|EXT|DECL|INT|BAS)", word):
            return
        else:
            raise Unread("a statement that the judge does not know")

    def bas(self, what: str, value: float) -> None:
        if what == "INITMOV":
            self.set_base(0)
            self.set_tool(min(self.cell.tools, default=0))
            self.distance = 3.0 * MM
            self.state.orientation_type, self.state.circle_type = "#VAR", "#BASE"
        elif what == "TOOL":
            self.set_tool(int(value))
        elif what == "BASE":
            self.set_base(int(value))
        elif what in ("CP_PARAMS", "PTP_PARAMS"):
            if frames := self.active.get("F"):
                self.set_tool(int(frames["TOOL_NO"]))
                self.set_base(int(frames["BASE_NO"]))
            if what == "CP_PARAMS":
                self.state.feed = value
                if said := self.active.get("L"):
                    self.distance = float(said["APO_DIST"]) * MM
                    self.state.orientation_type, self.state.circle_type = said["ORI_TYP"], said["CIRC_TYP"]

    def motion(self, word: str, rest: str, line: int) -> None:
        kind = word.removeprefix("S") if word not in ("SPL",) else word
        parts = re.findall(r"\{[^}]*\}|CA\s*[-+.\d]+|C_\w+|\w+", rest)
        points = [self.point(p) for p in parts if not re.match(r"(C_\w+$|CA\s)", p, re.I)]
        suffix = [p.upper() for p in parts if re.match(r"C_\w+$", p, re.I)]
        angle = [float(p[2:]) * DEG for p in parts if re.match(r"CA\s", p, re.I)]
        target = points[-1]
        new = replace(self.state, line=line, kind=kind, block=self.spline if self.in_spline else 0)
        new.approximation = self.approximation(suffix)
        if kind == "CIRC":
            new.via = np.array([float(points[0].get(k, self.last.get(k, 0.0))) for k in "XYZ"]) * MM
            new.angle = angle[0] if angle else None
        if "A1" in target:
            new.kind = "AXIS"
            new.axes = np.array([target[f"A{i}"] for i in range(1, 7)]) * DEG
            self.last = {k: v for k, v in target.items() if k.startswith("E")}
        else:
            self.last |= {k: float(v) for k, v in target.items() if k in FULL or k.startswith("E")}
            new.rotation, new.position = _frame_of(self.last)
            new.status, new.turn = ((int(target[k]) if k in target else None) for k in "ST")
        new.external = {k: float(v) for k, v in self.last.items() if k.startswith("E")}
        self.motions.append(new)

    def approximation(self, suffix: list[str]) -> float:
        if self.in_spline:
            return CONTINUOUS
        if "C_DIS" in suffix:
            return self.distance
        return CONTINUOUS if suffix else 0.0

    def point(self, text: str) -> dict:
        if text.startswith("{"):
            return _aggregate(text)
        if text.upper() == "XHOME":
            return {f"A{i}": v / DEG for i, v in enumerate(self.cell.start, 1)}
        if text.upper() in self.data:
            return self.data[text.upper()]
        raise Unread(f"no numbers for {text}")
