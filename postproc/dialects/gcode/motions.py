"""The motions of a program, one row each, as far as reading goes: where they begin and end, and how they get there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Floats, Ints
from postproc.dialects.gcode.arcs import Arcs
from postproc.dialects.gcode.positions import Positions
from postproc.dialects.gcode.stands import Stand


@dataclass(frozen=True, eq=False)
class Motions:
    """block (N,): row in the blocks; move (N,) Move; kind (N,) Kind; plane (N,); begin, end (N, 6) [m, rad] in the
    frame of the program; place (N, 3) [m]: the end in the base; arcs in the frame, centre and normal (N, 3) of them
    in the base; length (N,) [m] of the way."""

    block: Ints
    move: Ints
    kind: Ints
    plane: Ints
    begin: Floats
    end: Floats
    place: Floats
    arcs: Arcs
    centre: Floats
    normal: Floats
    length: Floats
    stand: Stand

    @staticmethod
    def of(
        block: Ints,
        move: Ints,
        kind: Ints,
        plane: Ints,
        begin: Floats,
        end: Floats,
        where: Positions,
        arcs: Arcs,
        stand: Stand,
    ) -> Motions:
        turn = np.array([frame.turn for frame in where.frames])[where.frame[block]]
        shift = np.array([frame.shift[:3] for frame in where.frames])[where.frame[block]]
        centre = (turn @ arcs.centre[..., None])[..., 0] + shift
        # A mirrored frame turns the sense of a rotation about a mirrored axis.
        sense = np.sign(np.linalg.det(turn))[:, None]
        normal = (turn @ arcs.normal[..., None])[..., 0] * sense
        step = end[:, :3] - begin[:, :3]
        bent = np.isfinite(arcs.sweep)
        along = np.einsum("ij,ij->i", step, np.where(bent[:, None], arcs.normal, 0.0))
        radius = np.linalg.norm(begin[:, :3] - arcs.centre, axis=1)
        length = np.where(bent, np.hypot(radius * arcs.sweep, along), np.linalg.norm(step, axis=1))
        return Motions(
            block,
            move,
            kind,
            plane,
            begin,
            end,
            where.in_base()[block, :3],
            arcs,
            centre,
            normal,
            length,
            stand,
        )
