"""Motions that may be divided: the intervals of their paths, and the path error between the points of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import ROWS, in_blocks
from postproc.base.findings import Finding
from postproc.base.geometry import Poses, lengths
from postproc.base.units import DEG
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.desired_path import start_poses
from postproc.compensation.orientations import shares_between
from postproc.compensation.path_error import PathSegments, path_errors, path_errors_at
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Limits
from postproc.toolpath import Kind

ROOM = 0.7
"""Share of the tolerance that the path between points may take: written digits take a part of the rest, and so does a
tool that is early or late where the force changes."""

STEP = 0.1
"""Share of the tolerance by which the correction may step, or change on a path, without a check of what that does."""

WIDEST = 300 * DEG
"""An arc that turns further is divided: the moved end of a nearly full circle could lie on the wrong side."""

SAME = 1e-9
"""[m] Points that are nearer are one."""


class DivisibleMotions:
    """What a subdivision is searched in; ``transitions``, ``knots`` and ``refinement`` change it.

    rows (R,): corrected motions whose path is known, and ``spline`` (R,), splines that start a cut.  Of each:
    ``needs_transition``, a transition move leads to where its path starts; ``has_lead_in``, the motion in air before it
    does; start_at (R,): the place among ``starts`` of the TCP command where a path starts that may get one of them, -1
    of all others: they start where the motion before them ends.

    Intervals (I,), in the order of the path: owner (I,), place among ``rows``; low, high (I,): shares of its path.  A
    path is one interval, or is parted where a ramp of its force ends or an axis turns round.  Each is divided into
    ``count`` (I,) even segments.
    """

    def __init__(self, task: CompensationProblem, full: CorrectionResult, limits: Limits) -> None:
        self.task, self.full, self.limits = task, full, limits
        path = task.toolpath
        self.n = len(path)
        entered = self._splines()
        self.rows = np.flatnonzero((full.corrected & task.desired_path.traceable) | entered)
        self.spline = entered[self.rows]
        self.entry = start_poses(full.command, path, task.tool, task.model.robot, task.track, task.external)
        self.free = np.full(self.n, not limits.no_insert)
        self.free[list(path.constraints.no_insert_before)] = False
        self.start_at = np.full(len(self.rows), -1, np.int32)
        self.starts = self.entry[:0]
        self.needs_transition, self.has_lead_in = (
            np.zeros(len(self.rows), bool),
            np.zeros(len(self.rows), bool),
        )
        self.returns = np.zeros(self.n, bool)
        self.step = np.zeros(len(self.rows))
        self.split_error = np.zeros(len(self.rows))
        self._whole_motions()
        self.not_refined: dict[int, Finding] = {}
        self.findings: list[Finding] = []

    def _splines(self) -> Bools:
        """(N,) splines with which a corrected cut starts: what is between their points is the controller's, but the
        first of them starts where its correction does."""
        corrected, path = self.full.corrected, self.task.toolpath
        first: Bools = corrected & (path.kind == Kind.SPL) & ~np.append(False, corrected[:-1])
        rows = np.flatnonzero(first)
        first[rows] = np.isfinite(self.task.desired_path.start[rows].position[:, 0])
        return first

    def _whole_motions(self) -> None:
        """One interval a motion."""
        count = len(self.rows)
        self.owner: Ints = np.arange(count, dtype=np.int32)
        self.low: Floats = np.broadcast_to(0.0, (count,))
        self.high: Floats = np.broadcast_to(1.0, (count,))
        self.count: Ints = np.ones(count, np.int32)
        self.least: Ints = self.count
        self.error: Floats = np.zeros(count)

    def path_starts(self, chosen: Ints) -> Poses:
        """The commands (A) where the paths of the motions ``chosen`` (A,) start: after a transition move or a lead-in,
        or where the motion before them ends."""
        starts = self.entry[self.rows[chosen]]
        own = np.flatnonzero(self.needs_transition[chosen] | self.has_lead_in[chosen])
        if len(own):
            starts.put(own, self.starts[self.start_at[chosen[own]]])
        return starts

    def least_segments(self) -> Ints:
        """(I,) segments that an interval has at least."""
        rows, part = self.rows[self.owner], self.high - self.low
        sweep = np.nan_to_num(self.task.desired_path.sweep[rows]) * part
        least = np.where(sweep > WIDEST, np.ceil(sweep / np.pi), 1).astype(np.int32)
        # of a half turn the corrected ends could be nearer in the other sense
        half = np.isin(rows, self.task.track.half_turns.rows) & (part == 1.0)
        return np.where(half, np.maximum(least, 2), least)

    def leave_undivided(self, rows: Ints, code: str, message: str) -> None:
        """Note of ``rows`` (K,) that they are not divided as they should be, and why; what is noted first counts."""
        for row in rows.tolist():
            line = int(self.task.toolpath.line[row])
            self.not_refined.setdefault(row, Finding(code, message, self.task.file, line))

    def spacing(self, rows: Ints, least: float) -> Floats:
        """(K,) [m] the shortest segment that may be made of the motions ``rows`` (K,), ``least`` [m] or more."""
        feed = np.nan_to_num(self.task.toolpath.feed[rows])
        return np.maximum(least, feed * self.limits.cycle)

    def largest_errors(self, chosen: Ints, count: Ints) -> Floats:
        """(A,) the largest error between the points of the intervals ``chosen`` (A,) in ``count`` (A,) even segments,
        in parts of the one that is allowed."""

        def largest(part: slice) -> Floats:
            segments, owner = self.segments(chosen[part], count[part])
            size = self._allowed(*path_errors(self.task, segments))
            errors = self._rounded_off(chosen[part], count[part])
            np.maximum.at(errors, owner, size)
            return errors

        return np.concatenate([np.empty(0), *in_blocks(largest, len(chosen), motions_per_block(count))])

    def _rounded_off(self, chosen: Ints, count: Ints) -> Floats:
        """(A,) by how much the controller rounds off points inserted into the arcs among the intervals ``chosen``
        (A,), divided into ``count`` (A,) segments, in parts of the error that is allowed.

        The parabola from d before a point of a circle to d after it passes the middle of the places d / 2 before and
        after: d^2 / (8 r) inside of it, d half of a segment at most.  Of arcs between exact points alone, where it is
        stated: short segments beside a corner that is approximated itself would change that corner.
        """
        task, rows = self.task, self.rows[self.owner[chosen]]
        off = np.zeros(len(rows))
        if task.toolpath.constraints.exact_stays:
            return off
        divided = (count > 1) | (self.low[chosen] > 0.0) | (self.high[chosen] < 1.0)
        exact = task.toolpath.approximation == 0
        divided &= exact[rows] & exact[np.maximum(rows - 1, 0)]
        arc = np.flatnonzero(task.desired_path.arc[rows] & divided)
        if not len(arc):
            return off
        at = rows[arc]
        part = (self.high - self.low)[chosen[arc]] / count[arc]
        stated = np.nan_to_num(task.toolpath.constraints.inserted_approximation[at])
        reach = np.minimum(stated, 0.5 * part * task.desired_path.length[at])
        radius = lengths(task.desired_path.start[at].position - task.desired_path.circles(at)[0])
        off[arc] = reach**2 / (8.0 * np.maximum(radius, SAME))
        return self._allowed(off, np.zeros(len(off)))

    def errors_at(self, chosen: Ints, share: Floats) -> Floats:
        """(A,) the same at the shares (A,) of the intervals ``chosen`` (A,), undivided."""

        def there(part: slice) -> Floats:
            segments, _ = self.segments(chosen[part], self.least[chosen[part]])
            last = np.cumsum(self.least[chosen[part]]) - 1
            return self._allowed(*path_errors_at(self.task, segments[last], share[part]))

        return np.concatenate([np.empty(0), *in_blocks(there, len(chosen))])

    def _allowed(self, off: Floats, angle: Floats) -> Floats:
        """(K,) errors [m], [rad] in parts of those that are allowed."""
        return np.maximum(off / self.task.tolerance, angle / self.task.tolerance_angle) / ROOM

    def segments(self, chosen: Ints, count: Ints) -> tuple[PathSegments, Ints]:
        """The segments (S) of the intervals ``chosen`` (A,) in ``count`` (A,) even ones each, and (S,) the place in
        ``chosen`` of each."""
        path = self.owner[chosen]
        owner = np.repeat(np.arange(len(path)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        low, high = self.low[chosen][owner], self.high[chosen][owner]
        at = self.rows[path][owner]
        toolpath = self.task.toolpath
        first, last = (
            shares_between(toolpath, at, low, high, part / count[owner]) for part in (number, number + 1)
        )
        end = self.full.command[at].copy()
        inner = np.flatnonzero(last < 1.0)
        end.put(inner, self.commands(at[inner], last[inner]))
        start = self.path_starts(path[owner])
        parted = np.flatnonzero((number == 0) & (low > 0.0))
        if len(parted):
            start.put(parted, self.commands(at[parted], low[parted]))
        later = np.flatnonzero(number > 0)
        start.put(later, end[later - 1])
        segments = PathSegments.straight(at, first, last, start, end)
        curved = np.flatnonzero(self.task.desired_path.arc[at])
        if len(curved):
            via = self.commands(at[curved], 0.5 * (first + last)[curved])
            normal = arc_normals(self.task, at[curved])
            arcs = PathSegments.round(
                at[curved], first[curved], last[curved], start[curved], via, end[curved], normal
            )
            for name in ("centre", "normal", "sweep"):
                values = getattr(segments, name).copy()
                values[curved] = getattr(arcs, name)
                segments = replace(segments, **{name: values})
        return segments, owner

    def commands(self, rows: Ints, share: Floats, where: str = "between its points") -> Poses:
        """The commands (K) by which the tool is at the shares (K,) of the paths of ``rows`` (K,), under the force
        there."""
        wanted = self.task.desired_path.at(rows, share)
        if not len(rows):
            return wanted
        goal = self.task.goal(rows, wanted, share)
        done = self.task.command(rows, wanted, self.task.force.along(rows, share), goal, share=share)
        bad = ~(done.reachable & done.settled & done.converged)
        self.leave_undivided(rows[bad], "COR009", f"{where} the corrected pose is out of reach")
        return done.command


def motions_per_block(count: Ints) -> int:
    """Motions of a block whose ``count`` (A,) segments are about as many as the rows of one."""
    return max(1, int(ROWS * len(count) / max(int(count.sum()), 1)))


def arc_normals(task: CompensationProblem, rows: Ints) -> Floats:
    """(K, 3) about which the arcs ``rows`` (K,) have to turn; NaN where any plane will do."""
    return np.where(task.toolpath.arcs.plane_free[rows, None], np.nan, task.desired_path.circles(rows)[1])
