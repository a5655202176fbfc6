"""Up to which approximation distance corners hold the tolerance for which a program states none."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM
from postproc.compensation.approximations import with_distance
from postproc.compensation.corners import Corners, compare_corners_at
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision

FIRST = 0.2 * MM
"""[m] A distance at which all corners are compared: what is off grows with it at least evenly."""

CLOSEST = 64
"""Corners that are compared at further distances: those that are off most."""

NEAR = 0.97
"""Share of the tolerance, and of a distance that is too large, from which on a distance is as good as the largest."""

STEPS = 8
"""How many distances are tried at most."""

ROUNDS = 3
"""How often all are compared at the distance that was found."""


def largest_distance(task: CompensationProblem, division: Subdivision, corners: Corners) -> float:
    """[m] The approximation distance up to which the ``corners``, of which nothing states one, are within the
    tolerance; 0 where none was found."""
    motion = corners.motion[corners.unknown]
    high = float(corners.distance[corners.unknown].max())
    at_high = _off(task, division, motion, high)
    if at_high.max() <= 1:
        return high
    first = min(FIRST, high)
    at_first = _off(task, division, motion, first)
    some = np.argsort(-at_first, kind="stable")[:CLOSEST]
    off, found = at_high, high
    for _ in range(ROUNDS):
        search = _DistanceSearch(0.0, 0.0, found, off[some].max())
        if first < found:
            search = replace(search.tried(first, at_first[some].max()), slow=False)
        for _ in range(STEPS):
            if search.is_near:
                break
            middle = search.next_distance()
            search = search.tried(middle, _off(task, division, motion[some], middle).max())
        if search.low == 0 or len(some) == len(motion):
            return search.low
        found = search.low
        off = _off(task, division, motion, found)
        if off.max() <= 1:
            return found
        some = np.flatnonzero(~(off <= 1))
    return 0.0


@dataclass(frozen=True)
class _DistanceSearch:
    """Distances [m] ``low``, at which all is within the tolerance, and ``high``, at which not, with the largest that is
    off there, shares of the tolerance; between them it is taken for a power of the distance, but after a ``slow`` step,
    by which they came no nearer to each other than half."""

    low: float
    off_low: float
    high: float
    off_high: float
    slow: bool = False

    @property
    def is_near(self) -> bool:
        return self.off_low >= NEAR or self.low >= NEAR * self.high

    def next_distance(self) -> float:
        """[m] Between the two."""
        if not np.isfinite(self.off_high):
            return 0.5 * (self.low + self.high) if self.low > 0 else 0.25 * self.high
        if self.slow and self.low > 0:
            return 0.5 * (self.low + self.high)
        aim = 0.5 * (1.0 + NEAR)
        if self.low == 0 or self.off_low == 0:
            return float(np.clip(self.high * aim / self.off_high, 0.01 * self.high, NEAR * self.high))
        power = np.log(self.off_high / self.off_low) / np.log(self.high / self.low)
        middle = self.low * (aim / self.off_low) ** (1.0 / max(power, 0.1))
        return float(np.clip(middle, self.low, self.high))

    def tried(self, distance: float, off: float) -> _DistanceSearch:
        """With what is off at a ``distance`` [m] between the two."""
        width, slow = self.high - self.low, not self.slow
        if off <= 1:
            return replace(self, low=distance, off_low=off, slow=slow and self.high - distance > 0.5 * width)
        return replace(self, high=distance, off_high=off, slow=slow and distance - self.low > 0.5 * width)


def _off(task: CompensationProblem, division: Subdivision, motion: Ints, distance: float) -> Floats:
    """(K,) by how much the corners ``motion`` (K,) are off where all that state none have this distance [m], shares of
    the tolerance; infinite where it is not known."""
    off = compare_corners_at(*with_distance(task, division, distance), motion).difference
    return np.where(np.isnan(off), np.inf, off / task.tolerance)
