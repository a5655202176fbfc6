"""The motions of a program, one row each, as far as reading goes: where they start and end, and how they get there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.languages.gcode.arcs import ArcGeometry
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.positions import Positions
from postproc.languages.gcode.tool_orientation import ToolOrientation

NOT_HIDDEN = 0


@dataclass(frozen=True, eq=False)
class GcodeMotions:
    """block (N,): row in the blocks; move (N,) Move; kind (N,) Kind; plane (N,); start, end (N, 6) [m, rad] in the
    frame of the program; place (N, 3) [m]: the end in the base; arcs in the frame, centre and normal (N, 3) of them in
    the base; length (N,) [m] of the way; room (N,) [m]: of drill cycles, from the bottom of the hole up to R, NaN of
    all others; hidden (N,): of canned cycles, why the hole is not that of the block (``drill_cycles.WHY``)."""

    block: Ints
    move: Ints
    kind: Ints
    plane: Ints
    start: Floats
    end: Floats
    place: Floats
    arcs: ArcGeometry
    centre: Floats
    normal: Floats
    length: Floats
    tool_orientation: ToolOrientation
    room: Floats
    hidden: Ints

    @staticmethod
    def of(
        block: Ints,
        move: Ints,
        kind: Ints,
        plane: Ints,
        where: Positions,
        arcs: ArcGeometry,
        orientation: ToolOrientation,
    ) -> GcodeMotions:
        """Of ``block``, ``move``, ``kind``, ``plane`` (N,) as of the class."""
        start, end = where.start[block], where.end[block]
        turn = np.array([frame.turn for frame in where.frames])[where.frame[block]]
        shift = np.array([frame.shift[:3] for frame in where.frames])[where.frame[block]]
        centre = (turn @ arcs.centre[..., None])[..., 0] + shift
        # A mirrored frame turns the sense of a rotation about a mirrored axis.
        sense = np.sign(np.linalg.det(turn))[:, None]
        normal = (turn @ arcs.normal[..., None])[..., 0] * sense
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        step = (turn @ (end[:, :3] - start[:, :3])[..., None])[..., 0]
        is_arc = np.isfinite(arcs.sweep)
        along = np.einsum("ij,ij->i", step, np.where(is_arc[:, None], normal, 0.0))
        radius = np.linalg.norm((turn @ (start[:, :3] - arcs.centre)[..., None])[..., 0], axis=1)
        length = np.where(is_arc, np.hypot(radius * arcs.sweep, along), np.linalg.norm(step, axis=1))
        return GcodeMotions(
            block,
            move,
            kind,
            plane,
            start,
            end,
            where.in_base()[block, :3],
            arcs,
            centre,
            normal,
            length,
            orientation,
            everywhere(np.nan, len(block)),
            everywhere(NOT_HIDDEN, len(block), np.int8),
        )
