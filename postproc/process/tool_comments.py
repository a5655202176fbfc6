"""Tools as the comments of a program state them, where these can be read in one way only.

The posts of Autodesk Fusion and HSM list the tools at the start of a program:

    comment  = "T" number "D=" diameter "CR=" corner ["TAPER=" angle "deg"] "- ZMIN=" height "-" type
    type     = "flat end mill" | "ball end mill" | "bullnose end mill" | "drill"

with lengths in the unit of the program, which the comment does not name.  It follows from ``ZMIN``, the lowest place of
the tip: a comment is read only where the motions of that tool go down to it either in mm or in inches, and not in both.
Comments of other posts (FreeCAD, Mastercam) name a tool as the user called it, or state no type: they are not read.
Where such a comment names a size, ``16mm Endmill`` or ``DIA. - 10.``, and that is not the diameter that the process
file states, one of them is wrong.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from postproc.base.units import DEG, MM
from postproc.toolpath import Kind, Toolpath

_NUMBER = r"([-+]?(?:\d++(?:\.\d*+)?|\.\d++))"
_COMMENT = re.compile(
    rf"\s*T(\d+)\s+D={_NUMBER}\s+CR={_NUMBER}(?:\s+TAPER={_NUMBER}\s*deg)?"
    rf"\s+-\s+ZMIN={_NUMBER}\s+-\s+([a-z]++(?: [a-z]++)*+)\s*",
    re.IGNORECASE,
)
_SHAPES = {"flat end mill": "flat", "ball end mill": "ball", "bullnose end mill": "bull", "drill": "drill"}
_UNITS = (1.0, 25.4)  # mm
_SAME = 0.002  # of the unit: posts write three decimals


_UNIT = r"(mm|inch(?:es)?|in|\")(?!\w)"
_NOUN = r"(?:end ?mills?|ball ?mills?|face ?mills?|ball ?noses?|bull ?noses?|drills?|cutters?)(?!\w)"
_OTHER = re.compile(r"holder|shank|stock|blank|hole|pocket|bore|helix|thread", re.IGNORECASE)
_NUMBERED = re.compile(r"(?<!\w)(?:T|TOOL)[ :=#-]{0,3}(\d++)", re.IGNORECASE)
_NAMED = re.compile(_NOUN, re.IGNORECASE)
_SIZES = (
    re.compile(rf"(?<![\w./]){_NUMBER} ?{_UNIT} ?(?:[a-z]++ ){{0,2}}{_NOUN}", re.IGNORECASE),
    re.compile(rf"(?<!\w){_NOUN} ?(?:dia(?:meter)?\.?|d)? ?[=:,-]? ?{_NUMBER} ?{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?<!\w)(?:d ?[=:]|dia(?:meter)?\.? ?[=:-]?) ?{_NUMBER}(?: ?{_UNIT})?", re.IGNORECASE),
)
_NEAR = 0.02


@dataclass(frozen=True)
class NamedDiameter:
    """A diameter that a comment in ``line`` names: its number, and its unit [mm], None where it names none."""

    value: float
    unit: float | None
    line: int

    @property
    def words(self) -> str:
        """As it is there, for messages."""
        unit = {1.0: " mm", 25.4: " inches"}.get(self.unit or 0.0, "")
        return f"{self.value:g}{unit}"

    def may_be(self, diameter: float) -> bool:
        """Whether it is ``diameter`` [m], in its unit or, without one, in any."""
        units = _UNITS if self.unit is None else (self.unit,)
        return any(abs(self.value * unit * MM - diameter) <= _NEAR * diameter for unit in units)


def read_named_diameters(toolpath: Toolpath) -> dict[int, list[NamedDiameter]]:
    """Number of a tool -> the diameters that comments name for it, where a comment names one only."""
    numbers = np.array([frame.number or 0 for frame in toolpath.frames] + [0])[toolpath.tool]
    found: dict[int, list[NamedDiameter]] = {}
    for comment in toolpath.comments:
        text = " ".join(comment.text.split())
        numbered = _NUMBERED.search(text)
        if _OTHER.search(text) or not (numbered or _NAMED.search(text)):
            continue
        sizes = {
            (float(match[1]), (25.4 if match[2][0] in 'iI"' else 1.0) if match[2] else None)
            for form in _SIZES
            for match in form.finditer(text)
        }
        values = {value for value, _ in sizes}
        if len(values) != 1 or min(values) <= 0 or not len(numbers):
            continue
        number = int(numbered[1]) if numbered else int(numbers[min(comment.row, len(numbers) - 1)])
        unit = next((unit for _, unit in sizes if unit is not None), None)
        found.setdefault(number, []).append(NamedDiameter(min(values), unit, comment.line))
    return found


@dataclass(frozen=True)
class CommentedTool:
    """A tool by a comment in ``line``: shape, radius, corner radius [m], half angle of a drill's point [rad]."""

    number: int
    shape: str
    radius: float
    corner: float
    taper: float | None
    line: int

    @property
    def words(self) -> str:
        """What the comment states, for messages."""
        more = f", corner radius {self.corner / MM:g} mm" if self.shape == "bull" else ""
        more += f", point angle {2 * self.taper / DEG:g} deg" if self.taper is not None else ""
        return f"{self.shape}, diameter {2 * self.radius / MM:g} mm{more}"


def read_tool_comments(toolpath: Toolpath) -> dict[int, CommentedTool]:
    """Number -> tool, of the comments that can be read; a tool that comments state differently is not among them."""
    lowest = _lowest(toolpath)
    tools: dict[int, CommentedTool] = {}
    twice = set()
    for comment in toolpath.comments:
        found = _COMMENT.fullmatch(comment.text)
        if not found:
            continue
        number, diameter, corner, angle, least, name = found.groups()
        shape = _SHAPES.get(" ".join(name.lower().split()))
        units = [
            unit
            for unit in _UNITS
            if abs(lowest.get(int(number), np.inf) - float(least) * unit) < _SAME * unit
        ]
        if shape is None or len(units) != 1:
            continue
        tool = _tool(
            int(number),
            shape,
            [float(word or 0) for word in (diameter, corner, angle)],
            units[0],
            comment.line,
        )
        if tool is None:
            continue
        if tool.number in tools and tools[tool.number].words != tool.words:
            twice.add(tool.number)
        tools.setdefault(tool.number, tool)
    return {number: tool for number, tool in tools.items() if number not in twice}


def _tool(number: int, shape: str, values: list[float], unit: float, line: int) -> CommentedTool | None:
    """None where the numbers do not belong to the shape."""
    diameter, corner, angle = values
    fits = {
        "flat": corner == 0 and angle == 0,
        "ball": abs(2 * corner - diameter) < 1e-6 and angle == 0,
        "bull": 0 < 2 * corner < diameter and angle == 0,
        "drill": corner == 0 and 1 <= angle <= 179,
    }
    if diameter <= 0 or not fits[shape]:
        return None
    scale = unit * MM
    taper = 0.5 * angle * DEG if shape == "drill" else None
    return CommentedTool(number, shape, 0.5 * diameter * scale, corner * scale, taper, line)


def _lowest(toolpath: Toolpath) -> dict[int, float]:
    """Number of a tool -> the lowest Z [mm] of its motions at a feed, in the programmed base."""
    numbers = np.array([frame.number or 0 for frame in toolpath.frames] + [0])[toolpath.tool]
    feeds = np.isin(toolpath.kind, (Kind.LIN, Kind.CIRC, Kind.SPL)) & np.isfinite(toolpath.position[:, 2])
    return {
        number: float(toolpath.position[feeds & (numbers == number), 2].min()) / MM
        for number in np.unique(numbers[feeds]).tolist()
    }
