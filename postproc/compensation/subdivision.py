"""What is inserted so that the path between corrected points is right too: transition moves where the correction steps,
and points where a straight or round path between two of them would leave the tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import ROWS, each_block, in_blocks
from postproc.base.findings import Finding
from postproc.base.geometry import Placed, PoseRows, Poses, lengths, turn_between
from postproc.base.units import DEG, MM
from postproc.compensation.correct import CorrectionResult, MotionOutcome, correct
from postproc.compensation.cuts import feed_motions
from postproc.compensation.desired_path import start_poses
from postproc.compensation.mirror import interpolate_pose
from postproc.compensation.orientations import shortest, spread
from postproc.compensation.path_error import PathSegments, path_errors, path_errors_at
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.reversals import find_reversals
from postproc.robot.half_turns import HALF
from postproc.toolpath import Kind, Role

ROOM = 0.7
"""Share of the tolerance that the path between points may take: written digits take a part of the rest, and so does a
tool that is early or late where the force changes."""

ROUNDED = 0.5
"""Share of the tolerance by which a controller may round an inserted point without another one near it."""

STEP = 0.1
"""Share of the tolerance by which the correction may step, or change on a way, without a look at what that does."""

LITTLE = 3 * DEG
"""Axes that turn by less leave a robot's compliance as it is: what changes with its square is a thousandth."""

WIDEST = 300 * DEG
"""An arc that turns further is divided: the moved end of a nearly full circle could lie on the wrong side."""

SAME = 1e-9
"""[m] Points that are nearer are one."""

_ORDER = {False: 2.0, True: 3.0}
"""The error between points of a straight segment falls with the square of its length, that of an arc through three
points with the third power at least; where to look first for the number that is enough."""


@dataclass(frozen=True)
class Limits:
    """What may be inserted.  keep: nothing; min_segment [m]: no segment is shorter, nor than what the tool moves in
    ``cycle`` [s], an interpolation cycle of the controller; max_growth: the output has at most so many times the
    motions of the input, or ``least`` more than that has; ramp_end [m]: where a ramp ends a point may be as near to
    another as this."""

    no_insert: bool = False
    min_segment: float = 1.0 * MM
    max_growth: float = 2.0
    cycle: float = 0.0
    least: int = 0
    ramp_end: float = 1.0 * MM

    def inserted(self, count: int) -> int:
        """Motions that may be inserted into a program of ``count``."""
        return max(int(self.max_growth * count) - count, self.least)


@dataclass(frozen=True)
class Subdivision:
    """M motions of the output for the N of the input, see ``Plan``.

    source, role (M,); share (M,): of the source's path, where the motion ends; command (M): TCP poses in the robot
    base, NaN where a target is not known; centre, normal (M, 3), sweep (M,): corrected arcs in the robot base, NaN for
    all others; moved (M,): the motion is another than in the input.  held: rows that cannot be corrected after all, and
    why.  lead_ins (L,): motions in air of the input that end where the cut after them starts corrected.  blend (M,)
    [m]: of each motion as in a Toolpath, where it was written.
    """

    source: Ints
    role: Ints
    share: Floats
    command: Placed
    centre: Floats
    normal: Floats
    sweep: Floats
    moved: Bools
    findings: tuple[Finding, ...] = ()
    not_refined: Mapping[int, Finding] = field(default_factory=dict)
    lead_ins: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    blend: Floats | None = None

    def __len__(self) -> int:
        return len(self.source)

    @cached_property
    def original(self) -> Bools:
        """(N,) the row is a motion of the program."""
        return np.asarray(self.role == Role.ORIGINAL)

    @cached_property
    def original_command(self) -> PoseRows:
        """(N) where the motions of the input end."""
        own = np.flatnonzero(self.original)
        return PoseRows(len(own), lambda rows: self.command[own[rows]])

    @cached_property
    def transitions(self) -> Bools:
        """(N,) the row is a transition move."""
        return np.asarray(self.role == Role.TRANSITION)

    @property
    def inserted(self) -> int:
        return int(np.sum(self.role != Role.ORIGINAL))


def subdivide(task: CompensationProblem, result: CorrectionResult, limits: Limits) -> Subdivision:
    """The motions of the output: end points as ``result`` has them, lead-ins, transition moves and further points where
    they are needed."""
    full = result
    if task.gain != 1.0:  # the points of a first cut are those of the last one
        full = correct(replace(task, gain=1.0, max_correction=np.inf))
        full = replace(full, state=result.state)
    search = _SubdivisionSearch(task, full, limits)
    search.add_transitions()
    search.split_at_knots()
    search.refine()
    search.enforce_budget()
    return search.division()


class _SubdivisionSearch:
    """rows (R,): corrected motions whose path is known, and ``spline`` (R,), splines that start a cut.  Of each:
    ``linked``, a transition move leads to where its path starts, or ``led``, the motion in air before it does; start_at
    (R,): the place among ``starts`` of the TCP command where a way starts that may get one of them, -1 of all others:
    they start where the motion before them ends.

    Intervals (I,), in the order of the path: owner (I,), place among ``rows``; low, high (I,): shares of its path.  A
    way is one interval, or is parted where a ramp of its force ends or an axis turns round.  Each is divided into
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
        first = corrected & (path.kind == Kind.SPL) & ~np.append(False, corrected[:-1])
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

    # where cuts begin

    def add_transitions(self) -> None:
        """Where the correction steps at the start of a motion under force, the motion in air before it ends where its
        own correction starts, or a transition move leads there."""
        task, rows, corrected = self.task, self.rows, self.full.corrected
        other = np.flatnonzero(
            np.concatenate(
                [rows[:0] > 0, *in_blocks(lambda part: task.steps(rows[part], corrected), len(rows))]
            )
        )
        self.starts = Poses(np.empty((len(other), 3, 3)), np.empty((len(other), 3)))
        self.start_at[other] = np.arange(len(other))

        def stepped(part: slice) -> None:
            at = rows[other[part]]
            own = self._commands(at, np.zeros(len(at)), "where this motion starts")
            shift, turn = task.pose_errors(at, own, self.entry[at])
            self.starts.put(part, own)
            self.step[other[part]] = np.maximum(
                np.linalg.norm(shift, axis=1) / task.tolerance,
                np.linalg.norm(turn, axis=1) / task.tolerance_angle,
            )

        each_block(stepped, len(other))
        carries = task.carries[rows]
        self.needs_transition = carries & (self.step > ROOM)
        some = np.flatnonzero(carries & (self.step > STEP) & ~self.needs_transition & ~self.spline)
        if len(some):
            self.needs_transition[some[self._errors(some, self._least()[some]) > 1.0]] = True
        entered = np.flatnonzero(self.needs_transition)
        self.has_lead_in[entered] = self._can_lead(rows[entered]) & self._turns_alike(entered)
        # before a spline block a transition move may be, though nothing else may be inserted before its points
        enters = np.isin(rows, list(task.toolpath.constraints.spline_headers)) & (not self.limits.no_insert)
        self.needs_transition &= ~self.has_lead_in & (self.free[rows] | enters)
        self._return_by_transition()

    def _can_lead(self, rows: Ints) -> Bools:
        """(K,) whether the motion before each of ``rows`` (K,) is one in air at feed, straight and of known end, whose
        text can say where the cut starts corrected."""
        path, before = self.task.toolpath, np.maximum(rows - 1, 0)
        can = (rows > 0) & (path.kind[before] == Kind.LIN) & path.known[before] & path.executes[before]
        can &= (self.full.state[before] == MotionOutcome.AIR) & ~self.task.carries[before]
        can &= feed_motions(path)[before] & (self.task.track.status[before] >= 0)
        can &= (path.tool[before] == path.tool[rows]) & (
            path.constraints.orientation_programmed[before] == path.constraints.orientation_programmed[rows]
        )
        free = path.orientation_control.redundant_axis
        can &= np.isclose(free[before], free[rows], atol=1e-9, equal_nan=True).all(axis=1)
        fixed = np.zeros(self.n, bool)
        fixed[[*path.constraints.refused, *path.constraints.locked]] = True
        return np.asarray(can & ~fixed[before])

    def _turns_alike(self, entered: Ints) -> Bools:
        """(K,) whether the motion before each of the places ``entered`` (K,) still turns the same way where it ends at
        the corrected begin: of half a turn the way may be the other one then."""
        alike, before, half = np.ones(len(entered), bool), self.rows[entered] - 1, self.task.track.half_turns
        at = np.flatnonzero(np.isin(before, half.rows))
        if len(at):
            start = self.task.desired_path.start[before[at]].rotation
            turn = turn_between(start, self.starts[self.start_at[entered[at]]].rotation)
            meant = half.vector[np.searchsorted(half.rows, before[at])]
            alike[at] = (np.sum(turn * meant, axis=1) > 0) & (lengths(turn) < np.pi - HALF)
        return alike

    def _start(self, chosen: Ints) -> Poses:
        """The commands (A) where the paths of the motions ``chosen`` (A,) begin: after a transition move or a lead-in,
        or where the motion before them ends."""
        found = self.entry[self.rows[chosen]]
        own = np.flatnonzero(self.needs_transition[chosen] | self.has_lead_in[chosen])
        if len(own):
            found.put(own, self.starts[self.start_at[chosen[own]]])
        return found

    def _least(self) -> Ints:
        """(I,) segments that an interval has at least."""
        rows, part = self.rows[self.owner], self.high - self.low
        sweep = np.nan_to_num(self.task.desired_path.sweep[rows]) * part
        least = np.where(sweep > WIDEST, np.ceil(sweep / np.pi), 1).astype(np.int32)
        # of a half turn the corrected ends could be nearer the other way round
        half = np.isin(rows, self.task.track.half_turns.rows) & (part == 1.0)
        return np.where(half, np.maximum(least, 2), least)

    def _return_by_transition(self) -> None:
        """An arc that is not corrected starts where it was programmed, even if the motion before it ends elsewhere."""
        path, full, desired_path = self.task.toolpath, self.full, self.task.desired_path
        arcs = np.flatnonzero((path.kind == Kind.CIRC) & ~full.corrected)
        arcs = arcs[arcs > 0]
        arcs = arcs[full.corrected[arcs - 1]]
        away = np.linalg.norm(self.entry[arcs].position - desired_path.start[arcs].position, axis=1)
        arcs = arcs[away > SAME]
        self.returns[arcs[self.free[arcs]]] = True
        self._leave_undivided(
            arcs[~self.free[arcs]] - 1, "COR013", "an uncorrected arc starts where this motion ends"
        )

    def _leave_undivided(self, rows: Ints, code: str, message: str) -> None:
        for row in rows.tolist():
            line = int(self.task.toolpath.line[row])
            self.not_refined.setdefault(row, Finding(code, message, self.task.file, line))

    # parts

    def split_at_knots(self) -> None:
        """Ways on which a ramp of the force ends are parted there, where one straight or round way would leave the
        tolerance."""
        row, share = self._knots()
        if not len(row):
            return
        at = np.searchsorted(self.rows, row)
        off = np.maximum(self._errors_at(at, share), self._errors(at, self.least[at]))
        np.maximum.at(self.split_error, at, off)
        self.split_error[self.split_error <= 1.0] = 0.0
        chosen = self.split_error[at] > 0.0
        self._split_intervals(*self._with_companions(at[chosen], share[chosen]))

    def _with_companions(self, at: Ints, share: Floats) -> tuple[Ints, Floats]:
        """The places (K,) of ``part``, each with another as near after it (else before it) as may be where the
        controller would round it by more than ``ROUNDED``.

        Where the correction turns by k [m a m], a parabola from d before it to d after it passes it at d k / 4
        (``corners``); d is half of the shorter segment beside it at most.
        """
        if not len(at):
            return at, share
        path, rows = self.task.toolpath, self.rows[at]
        length, spacing = self.task.desired_path.length[rows], self._spacing(rows, self.limits.ramp_end)
        blend = path.approximation[rows]
        # of an exact motion it is not known; where nothing is stated of an approximation, nothing is known of the path
        reach = np.where(blend == 0, 0.0 if path.constraints.exact_stays else np.inf, np.nan_to_num(blend))
        last = np.append(at[1:] != at[:-1], True)
        first = np.append(True, last[:-1])
        behind = (np.where(last, 1.0, np.append(share[1:], 1.0)) - share) * length
        before = (share - np.where(first, 0.0, np.append(0.0, share[:-1]))) * length
        reach = np.minimum(reach, 0.5 * np.minimum(before, behind))

        def kink(part: slice) -> Floats:
            shifts = []
            for side in (-1.0, 0.0, 1.0):
                place = share[part] + side * spacing[part] / length[part]
                wanted = self.task.desired_path.at(rows[part], place)
                shifts.append(self._commands(rows[part], place).position - wanted.position)
            return lengths(shifts[0] - 2.0 * shifts[1] + shifts[2]) / spacing[part]

        turned = np.concatenate([np.empty(0), *in_blocks(kink, len(at))])
        off = (0.25 * reach * turned > ROUNDED * self.task.tolerance) & (reach > 0.5 * spacing)
        off &= ~self.task.desired_path.arc[
            rows
        ]  # the points of so short an arc are on a line, in the digits of a program
        # a vertex of the program stays as round as it was
        corner = (
            np.nan_to_num(path.approximation[rows]),
            np.nan_to_num(path.approximation[np.maximum(rows - 1, 0)]),
        )
        room = np.maximum(spacing, np.where(last, 2.0 * corner[0], 0.0))
        sides = [off & (behind >= spacing + room)]
        room = np.where(
            first, np.maximum(spacing, 2.0 * corner[1]), 2.0 * spacing
        )  # the one before may have its own
        sides.append(off & ~sides[0] & (before >= spacing + room))
        if sum(int(side.sum()) for side in sides) > (self.limits.inserted(self.n) - len(at)) // 2:
            return at, share  # the points themselves come first
        step = spacing / length
        at = np.concatenate([at, *(at[side] for side in sides)])
        share = np.concatenate([share, (share + step)[sides[0]], (share - step)[sides[1]]])
        order = np.lexsort((share, at))
        return at[order], share[order]

    def _split_intervals(self, at: Ints, share: Floats) -> None:
        """Intervals of the ways ``at`` (K,) that end at the shares (K,), both ascending; of all others one."""
        number = np.arange(len(self.rows))
        owner = np.concatenate([number, at])
        low = np.concatenate([np.zeros(len(self.rows)), share])
        order = np.lexsort((low, owner))
        self.owner, self.low = owner[order].astype(np.int32), low[order]
        last = np.append(self.owner[1:] != self.owner[:-1], True)
        self.high = np.where(last, 1.0, np.append(self.low[1:], 1.0))
        self.count = self.least = self._least()
        self.error = np.zeros(len(self.owner))

    def _knots(self) -> tuple[Ints, Floats]:
        """Rows (K,) and shares (K,) of their paths where ramps end or an axis crosses its gap, and a point may be
        inserted."""
        ramps = self.task.force.ramps
        row, share = (np.empty(0, np.int64), np.empty(0)) if ramps is None else ramps.ends()
        if self.task.lost_motion is not None:
            every = np.arange(self.n)
            crossed = find_reversals(self.task, self._spacing(every, self.limits.min_segment))
            row, share = np.concatenate([row, crossed[0]]), np.concatenate([share, crossed[1]])
            order = np.lexsort((share, row))
            row, share = row[order], share[order]
        if not len(row):
            return row, share
        spacing = self._spacing(row, self.limits.ramp_end) / np.maximum(
            self.task.desired_path.length[row], SAME
        )
        good = (
            self.free[row]
            & np.isin(row, self.rows[~self.spline])
            & (share >= spacing)
            & (share <= 1.0 - spacing)
        )
        row, share, spacing = row[good], share[good], spacing[good]
        while len(row):  # of those too near to each other the first stays
            near = np.append(False, (row[1:] == row[:-1]) & (np.diff(share) < spacing[1:]))
            first = near & ~np.append(False, near[:-1])
            if not first.any():
                break
            row, share, spacing = row[~first], share[~first], spacing[~first]
        return row, share

    def _spacing(self, rows: Ints, least: float) -> Floats:
        """(K,) [m] the shortest segment that may be made of the motions ``rows`` (K,), ``least`` [m] or more."""
        feed = np.nan_to_num(self.task.toolpath.feed[rows])
        return np.maximum(least, feed * self.limits.cycle)

    # segments

    def refine(self) -> None:
        """The smallest number of even segments with which each interval is within the tolerance, or the most that may
        be."""
        desired_path, rows = self.task.desired_path, self.rows[self.owner]
        arc = desired_path.arc[rows]
        self.least = least = self._least()
        # A way that starts beside its place stays beside it, in however many segments.
        entered = self.needs_transition | self.has_lead_in | (self.step <= ROOM)
        cutting = self.task.carries[rows]
        can = self.free[rows] & (entered[self.owner] | ~cutting)
        if not self.limits.no_insert:
            lost = rows[(least > 1) & ~can]
            half = np.isin(lost, self.task.track.half_turns.rows)
            self._leave_undivided(
                lost[~half], "COR013", "an arc of nearly a full turn cannot be divided here"
            )
            self._leave_undivided(
                lost[half], "COR013", "a rotation of the tool by 180 deg cannot be divided here"
            )
        can &= cutting  # in air nothing is cut between the points
        # A motion that only turns the tool has no length to divide.
        length = desired_path.length[rows] * (self.high - self.low)
        length *= shortest(self.task.toolpath, rows, self.low, self.high)
        most = np.floor(length / self._spacing(rows, self.limits.min_segment))
        most = np.minimum(most, max(1, int(self.limits.max_growth * self.n), self.limits.least) + least)
        most = np.where(can, np.maximum(least, most), least).astype(np.int32)
        fails, holds = least - 1, np.zeros(len(rows), np.int32)
        ratio = np.zeros(len(rows))
        self.count, active = least.copy(), np.flatnonzero(~self._even())
        while len(active):
            found = self._errors(active, self.count[active])
            self.error[active] = np.where(self.count[active] == least[active], found, self.error[active])
            good = found <= 1.0
            won, lost = active[good], active[~good]
            holds[won] = self.count[won]
            fails[lost], ratio[lost] = self.count[lost], found[~good]
            going = np.where(
                holds[active] > 0, holds[active] - fails[active] > 1, fails[active] < most[active]
            )
            self.count[active] = np.where(holds[active] > 0, holds[active], most[active])
            active = active[going]
            power = 1.0 / np.where(arc[active], _ORDER[True], _ORDER[False])
            guess = np.ceil(np.maximum(fails[active], 1) * np.minimum(ratio[active], 1e6) ** power)
            top = np.where(holds[active] > 0, holds[active] - 1, most[active])
            self.count[active] = np.clip(guess, fails[active] + 1, top).astype(np.int32)

    def _even(self) -> Bools:
        """(I,) straight ways on which the correction hardly changes and the axes hardly turn: it lies on a line from
        begin to end, and between them nothing is off by more than a part of that change."""
        task, full, path = self.task, self.full, self.task.toolpath

        def even(part: slice) -> Bools:
            rows = self.rows[part]
            before = np.maximum(rows - 1, 0)
            alike = full.corrected[before] & (rows > 0) & (self.start_at[part] < 0)
            alike &= ~task.desired_path.arc[rows] & (path.tool[rows] == path.tool[before])
            if task.external is not None:
                alike &= ~task.external.moves(rows)
            for change, most in ((full.correction, task.tolerance), (full.turn, task.tolerance_angle)):
                alike &= lengths(change[rows] - change[before]) <= STEP * most
            return alike & (np.abs(task.track.q[rows] - task.track.q[before]) <= LITTLE).all(axis=1)

        found = np.concatenate([np.empty(0, bool), *in_blocks(even, len(self.rows))]) | self.spline
        if task.force.ramps is not None:
            found[np.isin(self.rows, task.force.ramps.row)] = False
        return found if len(self.owner) == len(self.rows) else found[self.owner]

    def enforce_budget(self) -> None:
        """Where all together are more than may be inserted: transition moves and parts first, then points, the largest
        errors before."""
        parts = np.bincount(self.owner, minlength=len(self.rows)) - 1
        wanted = int(self.needs_transition.sum()) + int(parts.sum()) + int((self.count - self.least).sum())
        spare = self.limits.inserted(self.n) - int(self.returns.sum()) - int((self.least - 1).sum())
        if wanted <= spare:
            return
        most = max(spare, 0)
        cost, need = (
            self.needs_transition + parts,
            np.maximum(self.step * self.needs_transition, self.split_error),
        )
        paid = allocate(cost, need, most) == cost
        self.needs_transition &= paid
        self._whole(~paid)
        points = self.count - self.least
        gets = allocate(points, self.error, most - int(cost[paid].sum()))
        self.count = self.least + gets
        # of each way what is still wrong on it
        np.maximum.at(need, self.owner[gets < points], self.error[gets < points])
        short = ~paid
        short[self.owner[gets < points]] = True
        first = int(self.rows[np.argmax(np.where(short, need, -1.0))])
        self.findings.append(
            Finding(
                "COR014",
                f"{wanted} motions are needed, max_growth ({self.limits.max_growth:g}) allows"
                f" {most}: {int(short.sum())} motions get fewer than they need; the largest error is here",
                self.task.file,
                int(self.task.toolpath.line[first]),
                help="raise max_growth or tolerance in the cell",
            )
        )

    def _whole(self, desired_path: Bools) -> None:
        """Makes ``desired_path`` (R,) one interval each."""
        kept = ~desired_path[self.owner] | (self.low == 0.0)
        self.owner, self.low, self.high = self.owner[kept], self.low[kept], self.high[kept].copy()
        joined = desired_path[self.owner] & (self.high < 1.0)
        self.high[joined] = 1.0
        self.least = self._least()
        self.count = np.where(joined, self.least, self.count[kept])
        self.error = np.where(joined, self.split_error[self.owner], self.error[kept])

    def _errors(self, chosen: Ints, count: Ints) -> Floats:
        """(A,) what is left between the points of the intervals ``chosen`` (A,) in ``count`` (A,) even segments, in
        parts of what may be left."""

        def largest(part: slice) -> Floats:
            segments, owner = self._segments(chosen[part], count[part])
            size = self._allowed(*path_errors(self.task, segments))
            found = np.zeros(len(count[part]))
            np.maximum.at(found, owner, size)
            return found

        return np.concatenate([np.empty(0), *in_blocks(largest, len(chosen), _rows(count))])

    def _errors_at(self, chosen: Ints, share: Floats) -> Floats:
        """(A,) the same at the shares (A,) of the intervals ``chosen`` (A,), undivided."""

        def there(part: slice) -> Floats:
            segments, _ = self._segments(chosen[part], self.least[chosen[part]])
            last = np.cumsum(self.least[chosen[part]]) - 1
            return self._allowed(*path_errors_at(self.task, segments[last], share[part]))

        return np.concatenate([np.empty(0), *in_blocks(there, len(chosen))])

    def _allowed(self, off: Floats, angle: Floats) -> Floats:
        """(K,) errors [m], [rad] in parts of what may be left."""
        return np.maximum(off / self.task.tolerance, angle / self.task.tolerance_angle) / ROOM

    def _segments(self, chosen: Ints, count: Ints) -> tuple[PathSegments, Ints]:
        """The segments of the intervals ``chosen``, and the place in ``chosen`` of each."""
        path = self.owner[chosen]
        owner = np.repeat(np.arange(len(path)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        low, high = self.low[chosen][owner], self.high[chosen][owner]
        at = self.rows[path][owner]
        first, last = (self._shares(at, low, high, part / count[owner]) for part in (number, number + 1))
        end = self.full.command[at]
        inner = np.flatnonzero(last < 1.0)
        end.put(inner, self._commands(at[inner], last[inner]))
        start = self._start(path[owner])
        parted = np.flatnonzero((number == 0) & (low > 0.0))
        if len(parted):
            start.put(parted, self._commands(at[parted], low[parted]))
        later = np.flatnonzero(number > 0)
        start.put(later, end[later - 1])
        segments = PathSegments.straight(at, first, last, start, end)
        bent = np.flatnonzero(self.task.desired_path.arc[at])
        if len(bent):
            via = self._commands(at[bent], 0.5 * (first + last)[bent])
            normal = _normals(self.task, at[bent])
            arcs = PathSegments.round(at[bent], first[bent], last[bent], start[bent], via, end[bent], normal)
            for name in ("centre", "normal", "sweep"):
                values = getattr(segments, name).copy()
                values[bent] = getattr(arcs, name)
                segments = replace(segments, **{name: values})
        return segments, owner

    def _shares(self, rows: Ints, low: Floats, high: Floats, part: Floats) -> Floats:
        """(K,) the parts ``part`` (K,), 0 to 1, of what lies between the shares ``low`` and ``high`` (K,)."""
        if self.task.toolpath.orientation_control.any_by_words:
            return spread(self.task.toolpath, rows, low, high, part)
        return np.where(part == 1.0, high, low + part * (high - low))

    def _commands(self, rows: Ints, share: Floats, where: str = "between its points") -> Poses:
        """The commands (K) by which the tool is at the shares (K,) of the ways of ``rows`` (K,), under the force
        there."""
        wanted = self.task.desired_path.at(rows, share)
        if not len(rows):
            return wanted
        goal = self.task.goal(rows, wanted, share)
        done = self.task.command(rows, wanted, self.task.force.along(rows, share), goal, share=share)
        bad = ~(done.reachable & done.settled & done.converged)
        self._leave_undivided(rows[bad], "COR009", f"{where} the corrected pose is out of reach")
        return done.command

    # the output

    def division(self) -> Subdivision:
        task, n = self.task, self.n
        segments, linked = np.ones(n, np.int32), self.returns.copy()
        if len(self.owner) == len(self.rows):
            segments[self.rows] = self.count
        else:
            segments[self.rows] = np.bincount(self.owner, self.count, len(self.rows)).astype(np.int32)
        linked[self.rows] = self.needs_transition
        total = segments + linked
        source = np.repeat(np.arange(n, dtype=np.int32), total)
        start = np.cumsum(total) - total  # of the motions of each row
        number = np.arange(len(source)) - start[source]
        is_link = linked[source] & (number == 0)
        is_own = number + 1 == total[source]
        role = np.where(is_link, Role.TRANSITION, np.where(is_own, Role.ORIGINAL, Role.INTERMEDIATE)).astype(
            np.int8
        )
        share = np.where(is_link, 0.0, 1.0)
        del number

        inserted = np.flatnonzero(~is_own)
        there = Poses(np.empty((len(inserted), 3, 3)), np.empty((len(inserted), 3)))
        transitions = np.flatnonzero(is_link[inserted])
        to = source[inserted[transitions]]
        there.put(transitions, task.desired_path.start[to])
        mine = np.searchsorted(self.rows, to)
        own = np.flatnonzero(self.full.corrected[to])
        there.put(transitions[own], self.starts[self.start_at[mine[own]]])

        arc = task.desired_path.arc[self.rows]
        none = np.broadcast_to(np.nan, (len(source), 3))
        desired_path = [none, none, none[:, 0]]
        if arc.any():
            desired_path = [path.copy() for path in desired_path]
        chosen = np.flatnonzero((self.count > 1) | arc[self.owner] | (self.high < 1.0))
        earlier = np.cumsum(self.count) - self.count  # segments before each interval
        first_of = np.searchsorted(self.owner, np.arange(len(self.rows)))
        first = (start + linked)[self.rows[self.owner]] + earlier - earlier[first_of[self.owner]]

        def divided(part: slice) -> None:
            some = chosen[part]
            segments, owner = self._segments(some, self.count[some])
            lost = task.desired_path.arc[segments.rows] & ~np.isfinite(segments.sweep)
            self._leave_undivided(
                segments.rows[lost], "COR013", "the corrected points of this arc are not on a circle"
            )
            each = self.count[some]
            number = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
            place = first[some][owner] + number
            share[place] = segments.last
            inner = np.flatnonzero(segments.last < 1.0)
            there.put(np.searchsorted(inserted, place[inner]), segments.end[inner])
            if arc.any():
                for path, values in zip(
                    desired_path, (segments.centre, segments.normal, segments.sweep), strict=True
                ):
                    path[place] = values

        each_block(divided, len(chosen), _rows(self.count[chosen]))

        full, led = self.full.command, np.flatnonzero(self.has_lead_in)
        lead_ins = self.rows[led] - 1
        leads = self.starts[self.start_at[led]]
        moved = self.full.corrected[source] | is_link
        moved[np.flatnonzero(is_own)[lead_ins]] = True

        def command(rows: Ints) -> Poses:
            at = source[rows]
            found = full[at]
            if len(lead_ins):
                near = np.minimum(np.searchsorted(lead_ins, at), len(lead_ins) - 1)
                some = np.flatnonzero((lead_ins[near] == at) & is_own[rows])
                found.put(some, leads[near[some]])
            added = np.flatnonzero(~is_own[rows])
            if len(added):
                found.put(added, there[np.searchsorted(inserted, rows[added])])
            return found

        division = Subdivision(
            source,
            role,
            share,
            PoseRows(len(source), command),
            desired_path[0],
            desired_path[1],
            desired_path[2],
            moved,
            tuple(self.findings),
            dict(sorted(self.not_refined.items())),
            lead_ins,
        )
        return division if task.gain == 1.0 else _scaled(task, division)


def allocate(wanted: Ints, need: Floats, spare: int) -> Ints:
    """(R,) how many of ``wanted`` (R,) each gets of ``spare``, those with the largest ``need`` (R,) first."""
    order = np.argsort(-need, kind="stable")
    before = np.cumsum(wanted[order]) - wanted[order]
    given = np.zeros_like(wanted)
    given[order] = np.clip(spare - before, 0, wanted[order])
    return given


def _rows(count: Ints) -> int:
    """Motions of a block whose ``count`` (A,) segments are about as many as the rows of one."""
    return max(1, int(ROWS * len(count) / max(int(count.sum()), 1)))


def _normals(task: CompensationProblem, rows: Ints) -> Floats:
    """(K, 3) about which the arcs ``rows`` (K,) have to turn; NaN where any plane will do."""
    return np.where(task.toolpath.arcs.plane_free[rows, None], np.nan, task.desired_path.circles(rows)[1])


def _scaled(task: CompensationProblem, division: Subdivision) -> Subdivision:
    """The division with the share ``gain`` of every correction."""
    source, desired_path = division.source, task.desired_path

    def command(rows: Ints) -> Poses:
        found = division.command[rows]
        moved = np.flatnonzero(division.moved[rows])
        at, share = source[rows[moved]], division.share[rows[moved]]
        wanted = task.wanted[at].copy()
        on_way = np.flatnonzero(desired_path.traceable[at])
        wanted.put(on_way, desired_path.at(at[on_way], share[on_way]))
        part = interpolate_pose(wanted, found[moved], task.gain)
        found.put(moved, Poses(task.reported_findings(at, share, part.rotation), part.position))
        return found

    scaled = replace(division, command=PoseRows(len(division), command))
    bent = np.flatnonzero(np.isfinite(division.sweep))
    if not len(bent):
        return scaled
    before, part = subdivided_motions(task, division, bent), subdivided_motions(task, scaled, bent)
    wanted = desired_path.at(source[bent], 0.5 * (before.first + before.last))
    via = interpolate_pose(wanted, before.at(np.full(len(bent), 0.5)), task.gain)
    normal = _normals(task, source[bent])
    arcs = PathSegments.round(part.rows, part.first, part.last, part.start, via, part.end, normal)
    for name in ("centre", "normal", "sweep"):
        values = getattr(scaled, name).copy()
        values[bent] = getattr(arcs, name)
        scaled = replace(scaled, **{name: values})
    return scaled


def subdivided_motions(task: CompensationProblem, division: Subdivision, motions: Ints) -> PathSegments:
    """Some ``motions`` (K,) of a division as the controller makes them, transition moves among them."""
    source = division.source[motions]
    robot, track = task.model.robot, task.track
    start = start_poses(division.original_command, task.toolpath, task.tool, robot, track, task.external)[
        source
    ]
    first = np.zeros(len(motions))
    inner = np.flatnonzero((motions > 0) & (division.source[motions - 1] == source))
    start.put(inner, division.command[motions[inner] - 1])
    first[inner] = division.share[motions[inner] - 1]
    return PathSegments(
        source,
        first,
        division.share[motions],
        start,
        division.command[motions],
        division.centre[motions],
        division.normal[motions],
        division.sweep[motions],
    )
