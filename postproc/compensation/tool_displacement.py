"""The surface that a longer or thicker tool leaves: displaced along the spindle, and towards the wall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, turned
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.known_error import KnownError
from postproc.process.operation_names import OperationNames

_STEEP = 0.1
"""Sine of the angle between spindle and feed below which no side of the feed is known."""

_SHARPEST = -0.5
"""Cosine between the normals of two walls below which they have no common vertex: it would lie far out."""

_SAME_PLACE = 1e-6
"""[m] A motion that starts no farther from where another one ends follows it."""


@dataclass(frozen=True, eq=False)
class ToolDisplacement(KnownError):
    """dl a + s dr (a x t) / |a x t|: a: spindle, tip-ward; t: feed; s: the wall lies right (1) or left (-1) of the
    feed, seen along the spindle, or nobody knows (0); on the other side where the program mirrors its coordinates.

    Where two cuts meet, the displacement d is off both walls: n1 . d = s1 dr and n2 . d = s2 dr with their normals n,
    as the parallels to both meet there.  Along a motion what d has beside its own normal goes evenly from its start to
    its end; a cut along the spindle is moved as the cut that it leads to, or comes from.

    spindle (N, 3): unit vectors in tool axes; tool (N,): its number; length: number of a tool -> dl [m]; radius: of a
    tool -> dr [m]; side: tool and operation -> s as programmed; motion_side (N,): s of single motions, 0 where that of
    the operation counts, None where it always does; hand (N,): 1, -1 where s is mirrored, 0 where it is not known; None
    where it is 1; cuts (N,): motions that cut, None where none is known to meet another one.
    """

    path: DesiredPath
    spindle: Floats
    tool: Ints
    operations: OperationNames
    length: Mapping[int, float] = field(default_factory=dict)
    radius: Mapping[int, float] = field(default_factory=dict)
    side: Mapping[tuple[int, str], int] = field(default_factory=dict)
    hand: Ints | None = None
    cuts: Bools | None = None
    motion_side: Ints | None = None

    def at(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Floats:
        """(K, 3) [m] of motions ``rows`` (K,) at ``wanted`` (K) poses, at ``share`` (K,) of their paths."""
        along = np.ones(len(rows)) if share is None else share
        axis = turned(wanted.rotation, self.spindle[rows])
        tool = self.tool[rows]
        moved = np.zeros((len(rows), 3))
        for number, size in self.length.items():
            moved += np.where(tool == number, size, 0.0)[:, None] * axis
        if any((tool == number).any() for number in self.radius):
            moved += self._off_walls(rows, axis, along)
        return np.nan_to_num(moved)

    def _off_walls(self, rows: Ints, axis: Floats, share: Floats) -> Floats:
        """(K, 3) [m] what the radius does to the surface, with spindles along ``axis`` (K, 3) at the shares (K,)."""
        here = self._wall(rows, axis, share)
        moved = here.size[:, None] * here.normal
        if self.cuts is None:
            return moved
        ends = [self._at_end(rows, 0), self._at_end(rows, 1)]
        weight = np.stack([1.0 - share, share])
        for (own, vertex, met), part in zip(ends, weight, strict=True):
            rest = vertex - own.size[:, None] * own.normal
            turned_along = np.zeros_like(rest)
            for one, other in ((own.tangent, here.tangent), (own.beside, here.beside)):
                turned_along += np.sum(rest * one, axis=1)[:, None] * other
            moved += np.where((met & ~here.steep)[:, None], part[:, None] * turned_along, 0.0)
        # along the spindle there is no normal of its own
        vertices = [np.where(met[:, None], vertex, 0.0) for _, vertex, met in ends]
        (_, _, starts), (_, _, stops) = ends
        weight = np.where(starts & stops, weight, np.where([starts, stops], 1.0, 0.0))
        between = weight[0][:, None] * vertices[0] + weight[1][:, None] * vertices[1]
        return np.where(here.steep[:, None], between, moved)

    def _at_end(self, rows: Ints, end: int) -> tuple[_Wall, Floats, Bools]:
        """At the start (0) or end (1) of ``rows`` (K,): their walls, the displacement (K, 3) [m] of the vertex with the
        cut that meets them there, and whether (K,) there is one."""
        assert self.cuts is not None
        count = len(self.tool)
        other = np.clip(rows + (1 if end else -1), 0, count - 1)
        last, first = (rows, other) if end else (other, rows)
        poses = self.path.end[last], self.path.start[first]
        gap = np.linalg.norm(poses[0].position - poses[1].position, axis=1)
        met = (other != rows) & self.cuts[rows] & self.cuts[other] & (gap <= _SAME_PLACE)
        met &= self.tool[rows] == self.tool[other]
        axis = turned(poses[0].rotation, self.spindle[rows])
        own, beside = (
            self._wall(at, axis, np.full(len(rows), float(side)))
            for at, side in ((rows, end), (other, 1 - end))
        )
        vertex, common = _common(own, beside)
        return own, vertex, met & common

    def _wall(self, rows: Ints, axis: Floats, share: Floats) -> _Wall:
        tangent = self.path.tangent(rows, share)
        across = np.cross(axis, tangent)
        sine = np.linalg.norm(across, axis=1)
        steep = ~(sine > _STEEP)
        normal = np.where(steep[:, None], 0.0, across / np.maximum(sine, _STEEP)[:, None])
        size = np.where(steep, 0.0, self._towards_wall(rows, self.tool[rows]))
        return _Wall(normal, tangent, np.cross(normal, tangent), size, steep)

    def _towards_wall(self, rows: Ints, tool: Ints) -> Floats:
        """(K,) [m] s dr."""
        size = np.zeros(len(rows))
        for number, radius in self.radius.items():
            by_name = np.array([self.side.get((number, name), 0) for name in self.operations.names])
            sides = by_name[self.operations.which[rows]]
            if self.motion_side is not None:
                sides = np.where(self.motion_side[rows] != 0, self.motion_side[rows], sides)
            size += np.where(tool == number, radius * sides, 0.0)
        return size if self.hand is None else size * self.hand[rows]


@dataclass(frozen=True, eq=False)
class _Wall:
    """Walls beside K places of cuts: normal, feed (tangent) and the third direction (beside) (K, 3), size (K,) [m]
    along the normal; steep (K,): the feed is along the spindle."""

    normal: Floats
    tangent: Floats
    beside: Floats
    size: Floats
    steep: Bools


def _common(own: _Wall, other: _Wall) -> tuple[Floats, Bools]:
    """(K, 3) [m] the displacement that is off both walls, and whether (K,) there is one that is not far out."""
    cosine = np.sum(own.normal * other.normal, axis=1)
    mean, half = 0.5 * (own.size + other.size), 0.5 * (own.size - other.size)
    sum_, difference = own.normal + other.normal, own.normal - other.normal
    one = (mean / np.maximum(1.0 + cosine, 1.0 + _SHARPEST))[:, None] * sum_
    two = (half / np.maximum(1.0 - cosine, 1e-12))[:, None] * difference
    both = one + np.where((half == 0.0)[:, None], 0.0, two)
    alone = own.size[:, None] * own.normal + other.size[:, None] * other.normal
    known = (own.steep | (own.size != 0.0)) & (other.steep | (other.size != 0.0))
    largest = np.maximum(np.abs(own.size), np.abs(other.size))
    near = np.linalg.norm(both, axis=1) <= largest / np.sqrt(0.5 * (1.0 + _SHARPEST))
    near &= (cosine >= _SHARPEST) | own.steep | other.steep
    only = own.steep | other.steep
    return np.where(only[:, None], alone, both), known & (only | near)
