"""The path as a controller runs it: approximated vertices are passed on a parabola.

The path departs from the polygon the distance d before a vertex and joins it d after.  In between, with u from 0 to 1,
it is

    (1 - u) A + u B

A the place (1 - u) d before the vertex on the motion that ends there, B the one u d after it: of straight motions the
quadratic Bezier curve with the vertex in its middle.  Orientations change likewise.  d is the approximation
distance, and at most half of either motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, sums
from postproc.base.geometry import Poses, lengths, product, rotation_from_vector, turn_between
from postproc.compensation.gap_sides import GapSides
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.run_sides import ON_LINE, ON_PARABOLA, Stations, rounded_sides

_NO_LENGTH = 1e-9

_NO_TURN = 1e-13
"""[rad] Orientations that differ by less differ by rounding."""


@dataclass(frozen=True, eq=False)
class RunPath:
    """N motions.  reach (N,) [m]: d at the vertex where a motion starts, 0 where it is not approximated; unknown (N,):
    the vertex where it starts is passed at a distance that is not known; taken as it is programmed."""

    task: CompensationProblem
    reach: Floats
    unknown: Bools

    @staticmethod
    def of(task: CompensationProblem) -> RunPath:
        path, desired_path, n = task.toolpath, task.desired_path, len(task.toolpath)
        reach, unknown = np.zeros(n), np.zeros(n, bool)
        both = desired_path.traceable[1:] & desired_path.traceable[:-1] & (path.tool[1:] == path.tool[:-1])
        both &= path.continues[1:] & ~(path.approximation[:-1] <= 0)
        rows = np.flatnonzero(both) + 1
        distance = path.approximation[rows - 1]
        unknown[rows] = np.isnan(distance)
        rows, distance = rows[~unknown[rows]], distance[~unknown[rows]]
        reach[rows] = np.minimum(
            distance, 0.5 * np.minimum(desired_path.length[rows - 1], desired_path.length[rows])
        )
        return RunPath(task, reach, unknown)

    def at(self, rows: Ints, share: Floats) -> Poses:
        """Poses (K) at the shares (K,) of the motions ``rows`` (K,)."""
        poses = self._programmed(rows, share)
        for some, vertex, u in self._near(rows, share):
            poses.put(some, _blended(*self._both(vertex, u), u))
        return poses

    def tangent(self, rows: Ints, share: Floats) -> Floats:
        """(K, 3) unit vectors along the path at the shares (K,) of ``rows`` (K,); zero where a motion only turns the
        tool."""
        tangents = self._programmed_tangent(rows, share)
        for some, vertex, u in self._near(rows, share):
            tangents[some] = self._tangent_between(vertex, u, *self._both(vertex, u))
        return tangents

    def pose_and_tangent(self, rows: Ints, share: Floats) -> tuple[Poses, Floats]:
        """Poses (K) and tangents (K, 3) at the shares (K,) of the motions ``rows`` (K,), as ``at`` and ``tangent``."""
        poses, tangents = self._programmed(rows, share), self._programmed_tangent(rows, share)
        for some, vertex, u in self._near(rows, share):
            before, after = self._both(vertex, u)
            poses.put(some, _blended(before, after, u))
            tangents[some] = self._tangent_between(vertex, u, before, after)
        return poses, tangents

    @cached_property
    def _even(self) -> Bools:
        """(N,) straight motions that turn the tool evenly about one axis, if at all."""
        path = self.task.desired_path
        even = np.isfinite(path.angle) & ~path.arc
        even[path.half_turns.rows] = False
        return even

    def _programmed(self, rows: Ints, share: Floats) -> Poses:
        """As ``at``, with all vertices as they are programmed.  What is the same along a motion is asked for once where
        several of the K places in a row are on it."""
        even = self._even[rows]
        if even.all():
            return self._evenly(rows, share)
        poses = Poses(np.empty((len(rows), 3, 3)), np.empty((len(rows), 3)))
        for some, at in ((even, self._evenly), (~even, self.task.desired_path.at)):
            if some.any():
                poses.put(some, at(rows[some], share[some]))
        return poses

    def _evenly(self, rows: Ints, share: Floats) -> Poses:
        """As ``_programmed``, of motions that turn the tool evenly."""
        path, (motions, own) = self.task.desired_path, _runs(rows)
        start, end = path.start[motions], path.end[motions]
        part, way = share[:, None], end.position - start.position
        position = start.position.take(own, axis=0) + part * way.take(own, axis=0)
        rotation = start.rotation.take(own, axis=0)
        turns = np.flatnonzero((path.angle[motions] > _NO_TURN)[own])
        if len(turns):
            turn = turn_between(start.rotation, end.rotation)
            by = rotation_from_vector(part[turns] * turn[own[turns]])
            rotation[turns] = product(by, rotation[turns])
        return Poses(rotation, position)

    def _programmed_tangent(self, rows: Ints, share: Floats) -> Floats:
        """As ``tangent``, with all vertices as they are programmed."""
        desired_path = self.task.desired_path
        motions, own = _runs(rows)
        tangents = desired_path.tangent(motions, np.zeros(len(motions))).take(own, axis=0)
        arcs = np.flatnonzero(desired_path.arc[rows])
        if len(arcs):
            tangents[arcs] = desired_path.tangent(rows[arcs], share[arcs])
        return tangents

    def _tangent_between(self, vertex: Ints, u: Floats, before: Poses, after: Poses) -> Floats:
        """(K, 3) on the parabolas at the vertices where motions (K,) start, ``before`` and ``after`` being A and B."""
        length, reach, weight = self.task.desired_path.length, self.reach[vertex], u[:, None]
        one = self._programmed_tangent(vertex - 1, 1 - reach * (1 - u) / length[vertex - 1])
        two = self._programmed_tangent(vertex, reach * u / length[vertex])
        along = (after.position - before.position) / reach[:, None] + (1 - weight) * one + weight * two
        return np.asarray(along / np.maximum(lengths(along), _NO_LENGTH)[:, None])

    @cached_property
    def sides(self) -> GapSides | None:
        """On which side of its gap each axis lies along the path; None where the model does not ask."""
        lost, path = self.task.lost_motion, self.task.desired_path
        if lost is None or not self.reach.any():
            return None if lost is None else lost.programmed
        stations = Stations(lost.row, lost.share, lost.row, lost.share, lost.axes, lost.restart)
        near = stations.crossing(lost)
        near = near[(near >= 0) & (near < len(self.reach))]
        near = near[path.traceable[near] & (path.length[near] > 0) & (self.task.track.branch[near] >= 0)]
        length = np.where(path.length > 0, path.length, 1.0)
        before = self.reach[near, None] / length[near, None]
        after = np.append(self.reach, 0.0)[near + 1, None] / length[near, None]
        line = np.broadcast_to(ON_LINE, (len(near), len(ON_LINE)))
        share = np.concatenate([line, before * ON_PARABOLA, 1.0 - after * ON_PARABOLA], axis=1)
        row = np.repeat(near, share.shape[1])
        count, share = len(row), share.ravel()
        motor = np.full((count, lost.axes.shape[1]), np.nan)
        added = Stations(row, share, row, share, motor, np.zeros(count, bool))
        return rounded_sides(self.task, stations, near, added, self.at)

    def shares(self, rows: Ints, parts: Ints, halves: Ints, opens: Bools) -> tuple[Ints, Floats]:
        """Places along the motions ``rows`` (R,): their numbers among these (S,), ascending, and shares (S,).

        The ends of ``parts`` (R,) even parts of each motion, and of ``halves`` (R,) even parts of the halves of the
        parabolas on it; of its start nothing, as it is the end of another, but where ``opens`` (R,).
        """
        number, share = _even_shares(parts)
        first = np.flatnonzero(opens)
        numbers, shares = [number, first], [share, np.zeros(len(first))]
        length = self.task.desired_path.length[rows]
        following = np.where(rows + 1 < len(self.reach), rows + 1, 0)
        for at_end, reach in ((False, self.reach[rows]), (True, self.reach[following])):
            near = np.flatnonzero(reach > 0)
            own, part = _even_shares(halves[near])
            part = part * (reach[near] / length[near])[own]
            numbers.append(near[own])
            shares.append(1 - part if at_end else part)
        number, share = np.concatenate(numbers), np.concatenate(shares)
        order = np.lexsort((share, number))
        number, share = number[order], share[order]
        other = np.append(True, (number[1:] != number[:-1]) | (share[1:] > share[:-1] + 1e-9))[: len(number)]
        return number[other], share[other]

    def corner(self, rows: Ints) -> Floats:
        """(R,) [rad] by how much the path turns on the parabolas where the motions ``rows`` (R,) start."""
        angle = np.zeros(len(rows))
        some = np.flatnonzero(self.reach[rows] > 0)
        if len(some):
            at = rows[some]
            one = self.task.desired_path.tangent(at - 1, np.ones(len(at)))
            two = self.task.desired_path.tangent(at, np.zeros(len(at)))
            angle[some] = np.arccos(np.clip(np.sum(one * two, axis=1), -1.0, 1.0))
        return angle

    def departure(self, rows: Ints) -> tuple[Floats, Floats]:
        """(R,) [m] and (R,) [rad] by how much position and orientation depart, in the middle of the parabolas where the
        motions ``rows`` (R,) start, from the polygon: a quarter of d times by how much the direction of the path, and
        the turn of the tool per length, change there."""
        path, off, turn = self.task.desired_path, np.zeros(len(rows)), np.zeros(len(rows))
        some = np.flatnonzero(self.reach[rows] > 0)
        at = rows[some]
        quarter = 0.25 * self.reach[at]
        one, two = path.tangent(at - 1, np.ones(len(at))), path.tangent(at, np.zeros(len(at)))
        off[some] = quarter * lengths(two - one)
        turns = (path.angle[at] > _NO_TURN) | (path.angle[at - 1] > _NO_TURN)
        one, two = (self._turn_rate(each[turns]) for each in (at - 1, at))
        turn[some[turns]] = quarter[turns] * lengths(two - one)
        return off, turn

    def _turn_rate(self, rows: Ints) -> Floats:
        """(R, 3) [rad/m] turn of the tool per length of the motions ``rows`` (R,)."""
        path = self.task.desired_path
        turn = turn_between(path.start[rows].rotation, path.end[rows].rotation)
        return np.asarray(turn / np.maximum(path.length[rows], _NO_LENGTH)[:, None])

    def _near(self, rows: Ints, share: Floats) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Which of ``rows`` (K,) at the shares (K,) are on the parabola where they start, and then which on the one
        where they end: their numbers, the motions that start at those vertices, and u."""
        length = self.task.desired_path.length[rows]
        following = np.where(rows + 1 < len(self.reach), rows + 1, 0)  # the first one starts nowhere
        for vertex, distance in ((rows, share * length), (following, (share - 1) * length)):
            some = np.flatnonzero(np.abs(distance) < self.reach[vertex])
            if len(some):
                yield some, vertex[some], 0.5 + 0.5 * distance[some] / self.reach[vertex[some]]

    def _both(self, vertex: Ints, u: Floats) -> tuple[Poses, Poses]:
        """A and B at the vertices where motions (K,) start."""
        desired_path, reach = self.task.desired_path, self.reach[vertex]
        before = self._programmed(vertex - 1, 1 - reach * (1 - u) / desired_path.length[vertex - 1])
        return before, self._programmed(vertex, reach * u / desired_path.length[vertex])


def _blended(before: Poses, after: Poses, u: Floats) -> Poses:
    """The poses (K) on parabolas at u (K,), between A and B."""
    weight, rotation = u[:, None], before.rotation.copy()
    turn = turn_between(before.rotation, after.rotation)
    turns = np.flatnonzero(lengths(turn) > _NO_TURN)
    if len(turns):
        rotation[turns] = product(rotation_from_vector(weight[turns] * turn[turns]), rotation[turns])
    return Poses(rotation, (1 - weight) * before.position + weight * after.position)


def _runs(rows: Ints) -> tuple[Ints, Ints]:
    """The motions (R,) of ``rows`` (K,) without those that are as the one before, and which of them each is (K,)."""
    other = np.append(True, rows[1:] != rows[:-1])[: len(rows)]
    return rows[other], np.cumsum(other) - 1


def _even_shares(parts: Ints) -> tuple[Ints, Floats]:
    """Numbers of owners, and the shares at which even ``parts`` (R,) of them end."""
    number = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(number)) - np.repeat(sums(parts)[:-1], parts) + 1) / np.repeat(parts, parts)
    return number, share
