"""What is stated of the side of a cut, where the program mirrors its coordinates."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.findings import Finding
from postproc.cell import MotionFrames
from postproc.process.stated_forces import FEED, StatedForces
from postproc.process.wrenches import is_air
from postproc.toolpath import Toolpath

_SIDEWAYS = (1, 3, 5)
"""Channels that a mirror along the feed and the spindle reverses: fy, mx, mz."""

_SHOWN = 6


def cut_sides(toolpath: Toolpath, frames: MotionFrames) -> Ints:
    """(N,) 1 where motions cut on the side on which they are programmed, -1 on the other one, 0 where that is not
    known: as of ``Reflections``."""
    return toolpath.reflections.sides(toolpath.rotation, frames.spindle_in_tool)


def oblique_findings(rows: Ints, what: str, toolpath: Toolpath, file: str) -> list[Finding]:
    """FRC036 of motions ``rows`` (K,), mirrored in a plane oblique to their tool; what: what is not done for them."""
    if not len(rows):
        return []
    message = f"{_motions(rows, toolpath)} are mirrored obliquely to the spindle, and {what}"
    return [Finding("FRC036", message, file, int(toolpath.line[rows[0]]))]


def sideways_findings(
    stated: StatedForces, toolpath: Toolpath, frames: MotionFrames, file: str
) -> tuple[Finding, ...]:
    """FRC037 of motions whose force is stated in the feed frame with a part to a side that is mirrored."""
    if not toolpath.reflections.which.any():
        return ()
    acts = stated.any(_SIDEWAYS) & (stated.frames == FEED) & ~is_air(toolpath)
    rows = np.flatnonzero(acts & (cut_sides(toolpath, frames) != 1))
    if not len(rows):
        return ()
    message = (
        f"{_motions(rows, toolpath)} are mirrored, and their force is stated @feed: it acts along and across the"
        " mirrored feed, and is not mirrored itself"
    )
    return (Finding("FRC037", message, file, int(toolpath.line[rows[0]])),)


def _motions(rows: Ints, toolpath: Toolpath) -> str:
    """``3 motions (lines 12, 13, 14)``"""
    lines = np.unique(toolpath.line[rows]).tolist()
    shown = ", ".join(map(str, lines[:_SHOWN])) + (", ..." if len(lines) > _SHOWN else "")
    return f"{len(rows)} motions (line{'s' * (len(lines) > 1)} {shown})"
