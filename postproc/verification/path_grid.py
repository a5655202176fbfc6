"""The wanted path as a grid of nodes, with the displacement of a tool that is sent there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, sums
from postproc.base.batches import each_block
from postproc.base.geometry import Poses, lengths
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.verification.run_path import RunPath

NODES = 2.0 * MM
"""Distance of the nodes on the wanted path, at most."""

LEAST_NODES = 2
"""Intervals of a motion at least."""

TURN = np.radians(15.0)
"""By how much the path turns from one node to the next, at most."""

RESIDUAL, NEARLY = 1e-7, 1e-6
"""[m] How far along the path a tool may be from the place whose force it has; and where the displacement hardly changes
on the way there: what the tool is ahead is taken off its error then, as the last step along the path would."""

SPOT = 1e-6
"""[m] A motion that is not longer only turns the tool."""


@dataclass(frozen=True, eq=False)
class PathGrid:
    """J nodes on the wanted path, one stretch after another: ``first`` (K + 1,) where each stretch starts.

    row (J,) and share (J,) of its path; arc (J,) [m] along the stretch; v (J, 3) [m], tangent (J, 3); gap (J,): the
    interval to the next node is within one vertex; of the last node of a stretch there is none.  goal_at (J, 3) [m];
    farthest [m]: the largest displacement.
    """

    original: CompensationProblem
    path: RunPath
    first: Ints
    row: Ints
    share: Floats
    arc: Floats
    v: Floats
    tangent: Floats
    gap: Bools
    goal_at: Floats
    farthest: float

    @staticmethod
    def of(original: CompensationProblem, path: RunPath, start: Ints, stop: Ints) -> PathGrid:
        """Of the stretches of rows ``start`` to before ``stop`` (K,)."""
        count = stop - start
        rows = np.repeat(start - sums(count)[:-1], count) + np.arange(count.sum())
        length = original.desired_path.length[rows]
        parts = np.maximum(LEAST_NODES, np.ceil(length / NODES))
        parts = np.maximum(parts, np.ceil(np.nan_to_num(original.desired_path.sweep[rows]) / TURN))
        corner = path.corner(np.append(rows, 0))
        corner = np.maximum(corner[:-1], np.where(np.diff(rows, append=-1) == 1, corner[1:], 0.0))
        halves = np.where(corner > TURN, np.ceil(0.5 * corner / TURN), 0).astype(np.int64)
        number, share = path.shares(rows, parts.astype(np.int64), halves, np.ones(len(rows), bool))
        row, nodes = rows[number], np.bincount(number, minlength=len(rows))
        first = sums(nodes)[sums(count)]
        before = np.append(0.0, np.cumsum(length))
        own = before[:-1] - np.repeat(before[sums(count)[:-1]], count)
        arc = own[number] + share * length[number]
        v, tangent, goals = (np.empty((len(row), 3)) for _ in range(3))

        def fill(part: slice) -> None:
            there, tangent[part] = path.pose_and_tangent(row[part], share[part])
            wrench = original.force.along(row[part], share[part])
            real = original.simulated(row[part], there, wrench, share=share[part])
            goal = original.goal(row[part], there, share[part]).position
            goals[part], v[part] = goal, goal - np.nan_to_num(real.pose.position - there.position)

        each_block(fill, len(row))
        gap = np.append(row[1:] != row[:-1], True)[: len(row)]
        farthest = float(lengths(goals - v).max(initial=0.0))
        return PathGrid(original, path, first, row, share, arc, v, tangent, gap, goals, farthest)

    @cached_property
    def on_the_spot(self) -> Bools:
        """(N,) motions on the cuts that only turn the tool."""
        spot = np.zeros(len(self.original.toolpath), bool)
        spot[self.row] = self.original.desired_path.length[self.row] < SPOT
        return spot

    @cached_property
    def near(self) -> Floats:
        """(J,) [m] how far along the path from its place a tool may be found, in the interval after each node: so far
        that the displacement changes by ``RESIDUAL`` on the way, from that to ``NEARLY``.  Within a vertex it may
        change without any."""
        moved, step = np.diff(self.goal_at - self.v, axis=0), np.diff(self.arc)
        near = np.full(len(self.arc), RESIDUAL)
        some = np.flatnonzero(~self.gap[:-1])
        rate = lengths(moved[some]) / np.maximum(step[some], SPOT)
        near[some] = np.clip(RESIDUAL / np.maximum(rate, RESIDUAL), RESIDUAL, NEARLY)
        return near

    def place(self, interval: Ints, part: Floats) -> tuple[Ints, Floats]:
        """Row (S,) and share (S,) at the parts (S,) of intervals (S,); of a vertex the end of the motion before it."""
        row, share = self.row[interval], self.share[interval]
        step = np.where(
            self.gap[interval], 0.0, self.share[np.minimum(interval + 1, len(self.row) - 1)] - share
        )
        return row, share + part * step

    def along(self, interval: Ints, part: Floats) -> Floats:
        """(S,) [m] along the stretch, at ``part`` (S,) of ``interval`` (S,)."""
        step = self.arc[interval + 1] - self.arc[interval]
        return self.arc[interval] + part * step

    def goal(self, interval: Ints, part: Floats) -> tuple[Poses, Floats, Floats]:
        """Goal poses (S), tangents (S, 3) and wrenches (S, 6) at the parts (S,) of intervals."""
        row, share = self.place(interval, part)
        wanted, tangent = self.path.pose_and_tangent(row, share)
        goal, wrench = self.original.goal(row, wanted, share), self.original.force.along(row, share)
        over = np.flatnonzero(self.gap[interval])
        if len(over):
            other, start = self.row[interval[over] + 1], np.zeros(len(over))
            weight = part[over, None]
            turned = (1 - weight) * tangent[over] + weight * self.path.tangent(other, start)
            tangent[over] = turned / np.maximum(lengths(turned), 1e-12)[:, None]
            wrench[over] = (1 - weight) * wrench[over] + weight * self.original.force.along(other, start)
        return goal, tangent, wrench
