"""What a tool of another radius, with its tip in place, does to surfaces that lean.

A ball moves them by -dr (1 + n . a) along their normal, nothing on a floor across the spindle and dr on a wall along
it; a tool with a flat end and rounded or sharp corners by -dr |n x a|.  n: outward normal of the part, a: spindle,
tip-ward.  A program does not say where its tool touches: the measured points do, each for the places of the tip about
its own.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.base.units import MM
from postproc.learning.touched_points import TouchedPoints

NEAR = 5 * MM
"""Distance of the tip to that of a measured point up to which the point counts fully; then by its fourth power."""

LOOSE = 1e-3
"""Weight of the smallest displacement beside that of the points."""


def radius_share(normal: Floats, spindle: Floats, ball: bool | Bools) -> Floats:
    """(K,) by how much surfaces with normals (K, 3) are deeper per larger radius of a tool along spindles (K, 3),
    tip-ward; ball: whether it is one, of all or of each (K,)."""
    along = np.sum(normal * spindle, axis=1)
    return np.asarray(np.where(ball, 1.0 + along, np.sqrt(np.maximum(1.0 - along**2, 0.0))))


@dataclass(frozen=True, eq=False)
class SurfaceDisplacement:
    """``radius``: number of a tool -> dr [m]; ``ball``: numbers of those with a ball; tool, operation (N,): of each
    motion; ``acts`` (N,): motions that it is of; ``points`` (K): those that were measured."""

    radius: Mapping[int, float]
    ball: Collection[int]
    tool: Ints
    operation: Ints
    acts: Bools
    points: TouchedPoints

    def at(self, rows: Ints, wanted: Poses) -> Floats:
        """(K, 3) [m] of motions ``rows`` (K,) at ``wanted`` (K) poses: the d that moves the points of the same
        operation as the radius does, the nearer the more; none where no point of it was measured."""
        moved = np.zeros((len(rows), 3))
        for number, size in self.radius.items():
            for operation in np.unique(self.operation[rows]).tolist():
                of_it = (self.tool == number) & (self.operation == operation) & self.acts
                own, known = np.flatnonzero(of_it[rows]), np.flatnonzero(of_it[self.points.row])
                if len(own) and len(known):
                    moved[own] = size * self._share(known, wanted.position[own], number in self.ball)
        return moved

    def _share(self, known: Ints, place: Floats, ball: bool) -> Floats:
        """(J, 3) displacement per dr at places (J, 3) [m] of the tip, by the points ``known`` (L,)."""
        points = self.points
        normal, tip = points.normal[known], points.point[known] - points.to_contact[known]
        target = -radius_share(normal, points.spindle[known], ball)
        square = ((place[:, None] - tip[None]) ** 2).sum(axis=2)
        weight = 1.0 / (1.0 + square / NEAR**2) ** 2
        weight /= weight.max(axis=1, keepdims=True)
        whole = np.einsum("jl,la,lb->jab", weight, normal, normal) + LOOSE * np.eye(3)
        pull = (weight * target) @ normal
        return np.asarray(np.linalg.solve(whole, pull[..., None])[..., 0])
