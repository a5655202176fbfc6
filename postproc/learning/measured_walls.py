"""On which side of the feed the measured walls lie, of an operation or of each of its motions; where surfaces lean.

A larger radius moves a wall towards the material.  Where all walls of an operation lie on one side it is that of the
operation, which other programs can use too; where they lie on both, it is that of the measured points of the same cut,
the nearest along the path.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.desired_path import DesiredPath
from postproc.learning.touched_points import TouchedPoints
from postproc.process.operation_names import OperationNames

_FLAT = 0.1
"""Cosine of the angle to the spindle below which a surface is a wall, and above 1 less which it is a floor."""

_SIDE = 0.9
"""Share of the points of an operation, or of a motion, that have to lie on one side of the feed."""


@dataclass(frozen=True)
class MeasuredWalls:
    """``sides``: operation -> -1 (left) or 1 (right, seen along the spindle towards the tip), where all its measured
    walls lie as programmed; ``operations``: tool -> those that it cuts; ``leaning``: operations with measured surfaces
    that neither lie across the spindle nor along it, of tools without a taper; ``both``: operations with walls on both
    sides, and ``motion_side`` (N,) -1, 1 of their motions, 0 of all others and where no side is known."""

    sides: Mapping[str, int]
    operations: Mapping[int, frozenset[str]]
    leaning: frozenset[str] = frozenset()
    both: frozenset[str] = frozenset()
    motion_side: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    def of(self, tool: int) -> dict[str, int]:
        """``sides`` of the operations that a tool cuts."""
        own = self.operations.get(tool, frozenset())
        return {name: side for name, side in self.sides.items() if name in own}


def measured_walls(
    points: TouchedPoints,
    path: DesiredPath,
    operations: OperationNames,
    tool: Ints,
    straight: Collection[int],
    hand: Ints,
    carries: Bools,
) -> MeasuredWalls:
    """Of ``points`` (K); tool (N,): number of each motion's tool; ``straight``: numbers of tools without a taper, whose
    radius acts less on surfaces that lean; hand (N,): as of ``ToolDisplacement``; carries (N,): motions that cut."""
    tangent = path.tangent(points.row, points.share)
    across = np.cross(points.spindle, tangent)
    # the material is where the outward normal comes from
    towards = -np.sum(across * points.normal, axis=1) * hand[points.row]
    wall = np.abs(towards) > 0.5
    along = np.abs(np.sum(points.spindle * points.normal, axis=1))
    leans = np.isin(tool[points.row], list(straight)) & (along > _FLAT) & (along < 1 - _FLAT)
    sides: dict[str, int] = {}
    leaning, both = set(), set()
    motion_side = np.zeros(len(tool), np.int64)
    for index, name in enumerate(operations.names):
        of_it = operations.which[points.row] == index
        own = np.flatnonzero(wall & of_it)
        if (leans & of_it).any():
            leaning.add(name)
        elif len(own):
            side = _common_side(towards[own])
            if side:
                sides[name] = side
            else:
                both.add(name)
                rows = np.flatnonzero(carries & (operations.which == index))
                motion_side[rows] = _sides_of_motions(path.length, carries, rows, points, own, towards[own])
    cut = {number: operations.which[carries & (tool == number)] for number in np.unique(tool).tolist()}
    names = np.array(operations.names)
    return MeasuredWalls(
        sides,
        {number: frozenset(names[which].tolist()) for number, which in cut.items()},
        frozenset(leaning),
        frozenset(both),
        motion_side,
    )


def _common_side(towards: Floats) -> int:
    """-1 or 1, on which nearly all of (K,) points lie; 0 where there is none."""
    mean = float(np.sign(towards).mean())
    return int(np.sign(mean)) if abs(mean) >= 2 * _SIDE - 1 else 0


def _sides_of_motions(
    length: Floats, carries: Bools, rows: Ints, points: TouchedPoints, own: Ints, towards: Floats
) -> Ints:
    """(J,) -1, 1 of motions ``rows`` (J,), by the points ``own`` (L,) of the same cut; 0 without any, and where one
    motion has both sides; length (N,) [m]."""
    cut = np.cumsum(~carries)
    end = np.cumsum(length)
    motions = np.unique(points.row[own])
    side = np.array([_common_side(towards[points.row[own] == row]) for row in motions.tolist()])
    middle = end - 0.5 * length
    found = np.zeros(len(rows), np.int64)
    for number in np.unique(cut[motions]).tolist():
        here, there = np.flatnonzero(cut[rows] == number), np.flatnonzero(cut[motions] == number)
        if len(here):
            apart = np.abs(middle[rows[here]][:, None] - middle[motions[there]][None])
            found[here] = side[there[np.argmin(apart, axis=1)]]
    return found
