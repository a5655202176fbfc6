"""The surface that a ball of another radius leaves, with its tip in place: moved by -dr (1 + n . a) along its normal.

n: outward normal of the part, a: spindle, tip-ward; nothing on a floor across the spindle, dr on a wall along it.  A
program does not say where its ball touches: the measured points do, each for the places of the tip about its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses
from postproc.base.units import MM
from postproc.learning.touched_points import TouchedPoints

NEAR = 5 * MM
"""Distance of the tip to that of a measured point up to which the point counts fully; then by its fourth power."""

LOOSE = 1e-3
"""Weight of the smallest displacement beside that of the points."""


@dataclass(frozen=True, eq=False)
class BallDisplacement:
    """``radius``: number of a tool with a ball -> dr [m]; tool, operation (N,): of each motion; ``points`` (K): those
    that were measured."""

    radius: Mapping[int, float]
    tool: Ints
    operation: Ints
    points: TouchedPoints

    def at(self, rows: Ints, wanted: Poses) -> Floats:
        """(K, 3) [m] of motions ``rows`` (K,) at ``wanted`` (K) poses: the d with n . d = -dr (1 + n . a) at the points
        of the same operation, the nearer the more; none where no point of it was measured."""
        moved = np.zeros((len(rows), 3))
        for number, size in self.radius.items():
            for operation in np.unique(self.operation[rows]).tolist():
                own = np.flatnonzero((self.tool[rows] == number) & (self.operation[rows] == operation))
                row = self.points.row
                known = np.flatnonzero((self.tool[row] == number) & (self.operation[row] == operation))
                if len(own) and len(known):
                    moved[own] = size * self._share(known, wanted.position[own])
        return moved

    def _share(self, known: Ints, place: Floats) -> Floats:
        """(J, 3) displacement per dr at places (J, 3) [m] of the tip, by the points ``known`` (L,)."""
        points = self.points
        normal, tip = points.normal[known], points.point[known] - points.to_contact[known]
        target = -(1.0 + np.sum(normal * points.spindle[known], axis=1))
        square = ((place[:, None] - tip[None]) ** 2).sum(axis=2)
        weight = 1.0 / (1.0 + square / NEAR**2) ** 2
        weight /= weight.max(axis=1, keepdims=True)
        whole = np.einsum("jl,la,lb->jab", weight, normal, normal) + LOOSE * np.eye(3)
        pull = (weight * target) @ normal
        return np.asarray(np.linalg.solve(whole, pull[..., None])[..., 0])
