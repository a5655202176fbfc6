"""Where a part may lie: the freedoms of a placement, their ranges, and the polygon on the table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, frozen
from postproc.base.units import DEG, MM

FREEDOMS = ("x", "y", "z", "turn", "tool_turn", "track")
"""Columns of a placement: origin of the base in $WORLD [m]; turn of the part about the vertical through it and of the
tool about its spindle, against the present [rad]; place of the linear track [m]."""

X, Y, Z, TURN, TOOL_TURN, TRACK = range(6)

UNITS = np.array([MM, MM, MM, DEG, DEG, MM])
"""SI size of the unit in which people state each freedom."""

WRITTEN = np.array([0.1, 0.1, 0.1, 0.01, 0.01, 0.1]) * UNITS
"""Steps to which a placement is rounded: no part is laid, and no fixture made, more closely."""


@dataclass(frozen=True, eq=False)
class Room:
    """The placements that are allowed: lower, upper, present (6,) in the order of ``FREEDOMS`` [m, rad]; a freedom
    whose ends are the same is fixed.  polygon (V, 2) [m]: corners of the area that x and y are confined to, None
    without one."""

    lower: Floats
    upper: Floats
    present: Floats
    polygon: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "present"):
            object.__setattr__(self, name, frozen(getattr(self, name), (6,)))
        if (self.lower > self.upper).any():
            raise ValueError("a range of the room is not ascending")

    @property
    def free(self) -> Ints:
        """(D,) the freedoms that are not fixed."""
        return np.flatnonzero(self.upper > self.lower)

    @property
    def stated(self) -> Ints:
        """(K,) the freedoms that are not fixed where they are now."""
        return np.flatnonzero((self.upper > self.lower) | (self.lower != self.present))

    def places(self, shares: Floats) -> Floats:
        """(P, 6) the placements at ``shares`` (P, D) of the ranges of the free ones."""
        return np.asarray(self._fill(shares))

    def _fill(self, shares: Floats) -> Floats:
        places = np.repeat(self.lower[None], len(shares), axis=0)
        free = self.free
        places[:, free] += shares * (self.upper - self.lower)[free]
        return places

    def shares(self, places: Floats) -> Floats:
        """(P, D) the inverse of that, of placements (P, 6)."""
        free = self.free
        return np.asarray((places[:, free] - self.lower[free]) / (self.upper - self.lower)[free])

    def rounded(self, places: Floats) -> Floats:
        """(P, 6) ``places`` (P, 6) as they are written, inside of the ranges."""
        steps = np.round(places / WRITTEN) * WRITTEN
        return np.where(self.upper > self.lower, np.clip(steps, self.lower, self.upper), places)

    def outside(self, places: Floats) -> Floats:
        """(P,) [m] how far the origins of ``places`` (P, 6) lie outside of the polygon; 0 inside."""
        if self.polygon is None:
            return np.zeros(len(places))
        points = places[:, :2]
        return np.where(inside_polygon(points, self.polygon), 0.0, edge_distance(points, self.polygon))

    def at_edge(self, place: Floats) -> tuple[str, ...]:
        """The names of freedoms that ``place`` (6,) has at an end of their range, to a hundredth of it; a polygon
        counts for x and y."""
        extent = self.upper - self.lower
        near = np.minimum(place - self.lower, self.upper - place) <= 0.01 * extent
        names = [FREEDOMS[i] for i in self.free if near[i]]
        if self.polygon is not None:
            corners = float(np.ptp(self.polygon, axis=0).max())
            if edge_distance(place[None, :2], self.polygon)[0] <= 0.01 * corners:
                names = [*(name for name in names if name not in "xy"), "polygon"]
        return tuple(names)


def inside_polygon(points: Floats, corners: Floats) -> Bools:
    """(P,) ``points`` (P, 2) that lie inside of the polygon ``corners`` (V, 2): a ray to +x crosses its sides an odd
    number of times."""
    inside = np.zeros(len(points), np.bool_)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = ax + (y - ay) / (by - ay) * (bx - ax)
        inside ^= crosses & (x < at)
    return inside


def edge_distance(points: Floats, corners: Floats) -> Floats:
    """(P,) [m] distance of ``points`` (P, 2) from the sides of the polygon ``corners`` (V, 2)."""
    nearest = np.full(len(points), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        share = np.clip((points - a) @ side / max(float(side @ side), 1e-30), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - a - share[:, None] * side, axis=1))
    return nearest
