"""G52 and G92: where the origin of the programmed coordinates lies.

The frames of both are shifts: base = programmed + shift.  G92 states which coordinates the present position has, so its
shift is known only where the position is.  On a Fanuc both add up; LinuxCNC keeps one shift for both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.languages.gcode.control import Event, Once, ProgrammedFrame
from postproc.languages.gcode.words import key

_AXES = tuple(key(letter) for letter in "XYZABC")


def start() -> ProgrammedFrame:
    """Programmed coordinates are those of the base."""
    return ProgrammedFrame(np.eye(3), np.zeros(6))


def one_shift(event: Event) -> ProgrammedFrame:
    """LinuxCNC: G52 and G92 share their shift; G92.1 clears, G92.2 suspends and G92.3 restores it."""
    frame = event.frame
    saved = np.full(6, np.nan) if frame.memory is None else frame.memory
    given, mentioned = _axis_words(event)
    if event.once & (1 << Once.LOCAL):
        shift = np.where(mentioned, given, frame.shift)
    elif event.once & (1 << Once.SHIFT):
        shift = np.where(mentioned, event.position - given, frame.shift)
    elif event.once & (1 << Once.RESTORE):
        return replace(frame, shift=saved)
    elif event.once & (1 << Once.SUSPEND):
        return replace(frame, shift=np.zeros(6), memory=saved)
    else:
        shift = np.zeros(6)
    return replace(frame, shift=shift, memory=shift)


def two_shifts(event: Event) -> ProgrammedFrame:
    """Fanuc: the local shift of G52 and that of G92 add up; G92 cancels the local shift along the axes that it names
    (operator's manuals, "local coordinate system"); G92.1 clears both along the axes that it names with 0
    (programming manuals, "workpiece coordinate system preset")."""
    frame = event.frame
    local = np.zeros(6) if frame.memory is None else frame.memory
    given, mentioned = _axis_words(event)
    if event.once & (1 << Once.LOCAL):
        rest = frame.shift - local
        local = np.where(mentioned, given, local)
        return replace(frame, shift=rest + local, memory=local)
    if event.once & (1 << Once.SHIFT):
        shift = np.where(mentioned, event.position - given, frame.shift)
        return replace(frame, shift=shift, memory=np.where(mentioned, 0.0, local))
    named = (
        mentioned if mentioned.any() else np.abs(frame.shift) + np.abs(local) > 0
    )  # of none it is not known
    cleared = np.where(mentioned & (given == 0), 0.0, np.nan)
    return replace(frame, shift=np.where(named, cleared, frame.shift), memory=np.where(named, cleared, local))


def _axis_words(event: Event) -> tuple[Floats, Floats]:
    """(6,) values [m, rad] of the axis words of the block, 0 where absent; which are there."""
    scale = np.array([event.scale] * 3 + [DEG] * 3)
    values = np.array([event.words.get(axis, 0.0) for axis in _AXES])
    return values * scale, np.array([axis in event.words for axis in _AXES])
