"""Planes that a program states: G68 and G68.2 of a Fanuc, and swivelled planes of a Sinumerik (CYCLE800); mirrors of a
Fanuc (G51.1).

G68 turns the coordinates about the axis normal to the plane, at a centre, and leaves the tool as it is.  G68.2 states
the origin of a plane and its angles I J K about Z, the new X and the new Z; G53.1 then brings the tool along its Z.
CYCLE800 turns axis by axis, in the order that its mode states, and brings the tool along Z.  The tool's spin about its
axis is then the machine's: the tool is turned from its orientation in the cell by the least angle, as where a vector
states its direction.  Centres that are not stated, steps (G91), and what the control's parameters decide are not read.
G51.1 mirrors the axes that it names at the coordinates that it states, and G50.1 ends that of those that it names; the
two are read without another frame in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import DEG
from postproc.languages.gcode.control import Event, ProgrammedFrame, ToolAxis
from postproc.languages.gcode.words import key

MIRRORED, UNMIRRORED = (51.1,), (50.1,)
ROTATED, TILTED, ALIGNED, ENDED = (68.0,), (68.2,), (53.1,), (69.0, 69.1)
_LENGTHS = tuple(key(letter) for letter in "XYZ")
_ANGLES = tuple(key(letter) for letter in "IJK")
_UNIT = np.eye(3)
_NORMAL = np.array([2, 1, 0])
"""The axis normal to G17, G18, G19."""


class PlaneMemory(NamedTuple):
    """What a frame of a plane remembers: the frame before it; whether it is a tilted one, along which the tool can be
    brought."""

    before: ProgrammedFrame
    tilted: bool


class MirrorMemory(NamedTuple):
    """What a mirrored frame remembers: the frame before it; centres [m] of the mirrored axes, NaN of the others."""

    before: ProgrammedFrame
    centres: tuple[float, ...]


def with_planes(shifts: Callable[[Event], ProgrammedFrame]) -> Callable[[Event], ProgrammedFrame]:
    """The frame after a block of a Fanuc; ``shifts`` gives that after G52, G92 and G92.1."""

    def frame(event: Event) -> ProgrammedFrame:
        placed = event.frame.memory if isinstance(event.frame.memory, PlaneMemory) else None
        codes = set(event.codes)
        mirror = event.frame.memory if isinstance(event.frame.memory, MirrorMemory) else None
        if codes.intersection((*MIRRORED, *UNMIRRORED)):
            return _mirrored(event, mirror, placed is None)
        if mirror is not None and not codes.intersection(ENDED):
            lost = _unknown(mirror.before) if event.once else mirror.before
            return replace(_unknown(event.frame), memory=MirrorMemory(lost, mirror.centres))
        if codes.intersection(ENDED):
            return event.frame if placed is None else _ended(event.frame, placed)
        if codes.intersection(ALIGNED):
            if placed is None or not placed.tilted:
                return _unknown(event.frame)
            return replace(event.frame, tool=ToolAxis.NORMAL, rotary=np.full(3, np.nan))
        tilted = bool(codes.intersection(TILTED))
        if tilted or codes.intersection(ROTATED):
            memory = PlaneMemory(event.frame, tilted) if placed is None else placed
            if placed is not None or len(codes.intersection((*ROTATED, *TILTED))) > 1:
                return replace(_unknown(event.frame), memory=memory)
            return replace(_tilted(event) if tilted else _rotated(event), memory=memory)
        if placed is not None:
            # another origin, or another work offset, under the plane
            stays = PlaneMemory(_unknown(placed.before), placed.tilted) if event.once else placed
            return replace(_unknown(event.frame), memory=stays)
        return shifts(event) if event.once else event.frame

    return frame


def _mirrored(event: Event, mirror: MirrorMemory | None, alone: bool) -> ProgrammedFrame:
    """G51.1 X Y Z and G50.1 X Y Z; alone: no plane is in force."""
    before = event.frame if mirror is None else mirror.before
    centres = np.full(3, np.nan) if mirror is None else np.array(mirror.centres)
    named = np.array([one in event.words for one in _LENGTHS])
    begins = bool(set(event.codes).intersection(MIRRORED))
    if not begins and mirror is None and alone:
        return event.frame
    values = _lengths(event, centres)
    strange = {key(letter) for letter in "ABCIJKPQR"} & set(event.words)
    if not alone or strange or not event.absolute or not named.any() or not np.isfinite(values[named]).all():
        return replace(_unknown(event.frame), memory=MirrorMemory(_unknown(before), tuple(centres.tolist())))
    if begins and set(event.codes).intersection(UNMIRRORED):
        return replace(_unknown(event.frame), memory=MirrorMemory(_unknown(before), tuple(centres.tolist())))
    centres = np.where(named, values if begins else np.nan, centres)
    turned = np.isfinite(centres)
    if not turned.any():
        return replace(before, rotary=None)
    frame = _moved(before, _UNIT, 2.0 * np.nan_to_num(centres)).mirrored(np.where(turned, -1.0, 1.0))
    return replace(frame, memory=MirrorMemory(before, tuple(centres.tolist())))


def _unknown(frame: ProgrammedFrame) -> ProgrammedFrame:
    return replace(frame, shift=np.full(6, np.nan))


def _ended(frame: ProgrammedFrame, placed: PlaneMemory) -> ProgrammedFrame:
    """After G69: the coordinates are those from before, and a tool that was brought along the plane stays there."""
    if frame.tool != ToolAxis.NORMAL:
        return replace(placed.before, rotary=None)
    return replace(placed.before, tool=ToolAxis.UNKNOWN, rotary=np.full(3, np.nan))


def _lengths(event: Event, absent: Sequence[float] | Floats) -> Floats:
    """(3,) [m] X, Y, Z of the block; ``absent`` (3,) where it has no word."""
    return np.array(
        [
            event.words[one] * event.scale if one in event.words else other
            for one, other in zip(_LENGTHS, absent, strict=True)
        ]
    )


def _rotated(event: Event) -> ProgrammedFrame:
    """G68 X Y R; a centre that is not stated, which is where the tool is, is not read."""
    axis = int(_NORMAL[event.plane])
    strange = {_LENGTHS[axis], *_ANGLES, *(key(letter) for letter in "ABCPQ")} & set(event.words)
    if strange or not event.absolute:
        return _unknown(event.frame)
    centre = _lengths(event, np.full(3, np.nan))
    centre[axis] = 0.0
    turn = rotation_from_vector(_UNIT[axis] * event.words.get(key("R"), math.nan) * DEG)
    return _moved(event.frame, turn, centre - turn @ centre)


def _tilted(event: Event) -> ProgrammedFrame:
    """G68.2 X Y Z I J K; what is not stated is 0."""
    angles = [event.words.get(one, 0.0) * DEG for one in _ANGLES]
    others = {key(letter) for letter in "ABCPQRDH"} & set(event.words)
    if others or not event.absolute or not any(one in event.words for one in _ANGLES):
        return _unknown(event.frame)
    turn = turned_axis_by_axis(((2, angles[0]), (0, angles[1]), (2, angles[2])))
    return _moved(event.frame, turn, _lengths(event, np.zeros(3)))


def turned_axis_by_axis(steps: Sequence[tuple[int, float]]) -> Floats:
    """(3, 3) after turns by angles [rad] about axes 0, 1, 2, each the turned one of those before."""
    turn = np.eye(3)
    for axis, angle in steps:
        turn = turn @ rotation_from_vector(_UNIT[axis] * angle)
    return turn


def _moved(base: ProgrammedFrame, turn: Floats, shift: Floats) -> ProgrammedFrame:
    """The frame ``turn`` (3, 3), ``shift`` (3,) [m] in the coordinates of ``base``; not known where one is not."""
    if not np.isfinite(turn).all():
        return _unknown(base)
    moved = base.shift + np.concatenate([base.turn @ shift, np.zeros(3)])
    return replace(base, turn=base.turn @ turn, shift=moved, rotary=None)


def swivelled(event: Event, arguments: Sequence[str], values: Sequence[float]) -> ProgrammedFrame | None:
    """The plane of a CYCLE800 with numbers; None where it is not read.

    arguments: FR, TC, ST, MODE, X0 Y0 Z0, A B C, X1 Y1 Z1, DIR, FR_I, DMODE; values: their numbers, NaN of what is
    none, 0 of what is empty.  MODE: two bits for each turn, from the lowest, 1 2 3 for X Y Z, and none above; ST: its
    last digit is 1 where the plane is added to the one in force; DIR 0 turns no axis.
    """
    if len(arguments) < 14 or not np.isfinite([values[k] for k in (2, 3, *range(4, 14))]).all():
        return None
    state, mode, plane = int(values[2]), int(values[3]), values[15] if len(values) > 15 else 0.0
    order = [mode & 3, mode >> 2 & 3, mode >> 4 & 3]
    if (
        (state, mode) != (values[2], values[3])
        or sorted(order) != [1, 2, 3]
        or mode >> 6
        or state < 0
        or state % 10 > 1
        or state // 10 % 10 > 1
        or state // 100 % 1000
        or values[13] not in (-1.0, 1.0)
        or event.plane
        or plane not in (0.0, 1.0)
        or arguments[1].count('"') not in (0, 2)  # a comma in a name
        or arguments[1].strip("\"' \t") == "0"
    ):
        return None
    angles = (value * DEG for value in values[7:10])
    turn = turned_axis_by_axis([(axis - 1, angle) for axis, angle in zip(order, angles, strict=True)])
    before, after = np.array(values[4:7]) * event.scale, np.array(values[10:13]) * event.scale
    base = ProgrammedFrame(np.eye(3), np.zeros(6))
    if state % 10:
        plain = np.array_equal(event.frame.turn, np.eye(3)) and not event.frame.shift.any()
        if event.frame.tool != ToolAxis.NORMAL and not plain:
            return None
        base = event.frame
    moved = _moved(base, turn, before + turn @ after)
    return replace(moved, tool=ToolAxis.NORMAL, rotary=np.full(3, np.nan))
