"""Up to which approximation distance corners hold the tolerance for which a program states none."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.compensation.approximations import with_distance
from postproc.compensation.corners import Corners, compare_corners_at
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision

FIRST = 0.2 * MM
"""[m] A distance at which all corners are compared: what is off grows with it at least evenly."""

CLOSEST, HALVINGS = 64, 8
"""Corners that are compared at further distances: those that are off most, and how often."""

ROUNDS = 3
"""How often all are compared at the distance that was found."""


def largest_distance(task: CompensationProblem, division: Subdivision, corners: Corners) -> float:
    """[m] The approximation distance up to which the ``corners``, of which nothing states one, are within the
    tolerance; 0 where none was found."""
    motion = corners.motion[corners.unknown]
    high = float(corners.distance[corners.unknown].max())
    if not _above(task, division, motion, high).any():
        return high
    some = motion[np.argsort(-_off(task, division, motion, min(FIRST, high)), kind="stable")[:CLOSEST]]
    low = 0.0
    for _ in range(ROUNDS):
        low = _bisected(task, division, some, high)
        more = motion[_above(task, division, motion, low)] if low > 0 else motion[:0]
        if not len(more):
            return low
        some, high = more, low
    return 0.0


def _bisected(task: CompensationProblem, division: Subdivision, motion: Ints, high: float) -> float:
    """[m] A distance below ``high`` [m] with which all of the corners ``motion`` (K,) are within the tolerance, nearly
    the largest."""
    low = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high) if low > 0 else 0.25 * high
        if _above(task, division, motion, middle).any():
            high = middle
        else:
            low = middle
    return low


def _above(task: CompensationProblem, division: Subdivision, motion: Ints, distance: float) -> Bools:
    return np.asarray(~(_off(task, division, motion, distance) <= task.tolerance))


def _off(task: CompensationProblem, division: Subdivision, motion: Ints, distance: float) -> Floats:
    """(K,) [m] by how much the corners ``motion`` (K,) are off where all that state none have this distance [m]."""
    return compare_corners_at(*with_distance(task, division, distance), motion).difference
