"""The cell file of another placement: the old one with other numbers, comments kept."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml.comments import CommentedMap

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import abc_from_rotation, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.languages import DIALECT_OPTIONS
from postproc.placement.room import TOOL_TURN, TRACK, TURN
from postproc.robot.yaml_round_trip import Number, Quoted, edited

FILES = ("robot", "process", "force")
"""Keys of a cell that may name a file beside it."""


@dataclass(frozen=True)
class MovedCell:
    """What of a cell moves.  base: number; tools: numbers of those that are turned; track: name of the external axis,
    joint: its column among the robot's joints, None for an axis of the cell; decimals of the millimetres written."""

    cell: Cell
    raw: bytes
    base: int
    tools: tuple[int, ...]
    track: str | None = None
    joint: int | None = None
    decimals: int = 1

    def at(self, place: Floats) -> bytes:
        """The bytes of the cell file with the part at ``place`` (6,), in the old file's folder."""
        return edited(self.raw, self.cell.path, lambda top: self._edit(top, place))

    def in_folder(self, raw: bytes, destination: Path) -> bytes:
        """``raw`` for a file ``destination``: what it names beside the old cell is named from there."""
        old, new = self.cell.path.parent.resolve(), destination.parent.resolve()
        if old == new:
            return raw
        return edited(raw, self.cell.path, lambda top: _rename(top, old, new))

    def _edit(self, top: CommentedMap, place: Floats) -> None:
        frame = self.cell.bases[self.base]
        section = top["bases"][_key(top["bases"], self.base)]
        for key, value in zip("xyz", place[:3] / MM, strict=True):
            _set(section, key, value, self.decimals)
        if place[TURN]:
            turn = rotation_from_vector(np.array([0.0, 0.0, place[TURN]]))
            _set_angles(section, turn @ frame.rotation)
        if place[TOOL_TURN]:
            for number in self.tools:
                tool = self.cell.tools[number]
                turned = tool.pose.rotation @ rotation_from_vector(place[TOOL_TURN] * tool.axis)
                _set_angles(top["tools"][_key(top["tools"], number)], turned)
        if self.track is not None:
            value = place[TRACK] / MM
            if self.joint is None:
                _set(top["external_axes"][_key(top["external_axes"], self.track)], "start", value, 1)
            else:
                top["start"][self.joint] = Number(_digits(value, 1))


def _set(section: CommentedMap, key: str, value: float, decimals: int) -> None:
    """Writes a number in place of one that differs."""
    text = _digits(value, decimals)
    if key not in section or abs(float(section[key]) - value) > 0.5 * 10.0**-decimals:
        section[key] = Number(text)


def _set_angles(section: CommentedMap, rotation: Floats) -> None:
    near = [float(section.get(key, 0.0)) * DEG for key in "abc"]
    for key, angle in zip("abc", abc_from_rotation(rotation, near) / DEG, strict=True):
        if key in section or abs(angle) > 1e-9:
            _set(section, key, angle, 6)


def _digits(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text


def _key(section: CommentedMap, name: object) -> object:
    """The key of ``section`` that is written as ``name``."""
    return next(key for key in section if str(key) == str(name))


def _rename(top: CommentedMap, old: Path, new: Path) -> None:
    """Names files beside the old cell from the folder of the new one."""
    dialect = top.get("dialect")
    places = [(top, key) for key in FILES] + (
        [(dialect, one.key) for one in DIALECT_OPTIONS if one.is_file and dialect]
    )
    for section, key in places:
        value = section.get(key)
        if isinstance(value, str) and not os.path.isabs(value) and os.path.isfile(old / value):
            section[key] = Quoted(os.path.relpath(old / value, new).replace(os.sep, "/"))


def refuse_same_file(cell: Cell, output: Path) -> None:
    """Raises Refusal FIL007 where the new cell file would replace the old one."""
    if os.path.exists(output) and os.path.samefile(output, cell.path):
        help = "name another file with -o"
        raise Refusal(Finding("FIL007", "this output is an input of the same run", str(output), help=help))
