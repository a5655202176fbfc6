"""The path of approximated motions: of the program, and of its output under load.

An approximated motion leaves its line the distance d before its end point and joins the next one d after it (d: the
approximation, no more than half of either motion), on a parabola: at its parameter t it is at (1 - t) a + t b, with a
the place d (1 - t) before the end point on the one motion, b the place d t after it on the other.  Of straight motions
that is the quadratic Bezier curve with the end point as its control point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, lengths
from postproc.base.units import MM
from postproc.compensation.approximations import approximations
from postproc.compensation.brackets import Brackets
from postproc.compensation.desired_path import interpolate_poses
from postproc.compensation.gap_sides import GapSides
from postproc.compensation.path_error import PathSegments
from postproc.compensation.place_search import PlacesBeside
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.run_sides import ON_LINE, ON_PARABOLA, SAME_PLACE, Stations, rounded_sides
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.compensation.summits import summits

ROUNDS, SETTLED = 6, 2e-8
"""Steps in which the place of the path that the tool is nearest to is looked for; [m] a smaller one is none."""

FLATTEST = 0.05
"""The tool goes along the path by this share at least of what its place under load does."""

AT_ENDS, BETWEEN = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9)
"""Where a motion is evaluated: shares of the reach of the parabolas at its ends, and of its length."""

NEAR = np.array([0.8, 1.6, 2.5, 3.5, 5.0, 8.0]) * MM
"""[m] And so far from its ends: what is long changes there."""

CLOSER, AROUND = 2, np.linspace(-1.0, 1.0, 7)
"""How often, and where, it is evaluated closer to its largest error."""

TURNINGS, AT_TURN = 12, 5e-8
"""Steps at most to the place where the force turns, and [m] how near to it one is the last."""

NEAREST = 1e-12
"""[m] The extent of a motion that leads nowhere."""


@dataclass(frozen=True)
class Deviations:
    """S places of the output under load.  row (S,), share (S,): of the original's path, to which the tool is nearest;
    shift (S, 3) [m]: of the tool from there, across the path; turn (S, 3) [rad]: against the orientation there."""

    row: Ints
    share: Floats
    shift: Floats
    turn: Floats

    @staticmethod
    def empty(count: int) -> Deviations:
        return Deviations(np.zeros(count, np.int64), np.zeros(count), *np.zeros((2, count, 3)))

    def put(self, numbers: Ints, other: Deviations) -> None:
        """Sets ``numbers`` (K,) to the K places of the other."""
        for one in fields(self):
            getattr(self, one.name)[numbers] = getattr(other, one.name)


@dataclass(frozen=True)
class Blend:
    """Of S places on motions: on the parabola between the places ``before`` on the motions ``first`` (S,) and ``after``
    on the motions that follow them, at the parameters ``t`` (S,); those that are on no parabola have t = 0, and the
    place ``before`` is theirs."""

    first: Ints
    before: Floats
    after: Floats
    t: Floats


def extents(segments: PathSegments) -> Floats:
    """(K,) [m] how long they are."""
    step = segments.end.position - segments.start.position
    length = lengths(step)
    arc = np.flatnonzero(np.isfinite(segments.sweep))
    rise = np.sum(step[arc] * segments.normal[arc], axis=1)
    length[arc] = np.hypot(
        segments.sweep[arc] * lengths(segments.start.position[arc] - segments.centre[arc]), rise
    )
    return np.maximum(length, NEAREST)


class RoundedOutput:
    """A part of a division, with its parabolas: ``motions`` (K,) and those beside them.  What nothing states is taken
    for the largest approximation that there may be."""

    def __init__(self, task: CompensationProblem, division: Subdivision, motions: Ints) -> None:
        self.task, self.division = task, division
        near = np.unique(np.clip(motions[:, None] + np.arange(-1, 3), 0, len(division) - 1))
        self.motions = near[task.desired_path.traceable[division.source[near]]]
        self.segments = subdivided_motions(task, division, self.motions)
        self.extent = extents(self.segments)
        self.reach = self._reaches()

    def _reaches(self) -> Floats:
        """(L,) [m] of the parabola at the end of each; 0 without one."""
        reach = np.zeros(len(self.motions))
        next_here = np.flatnonzero(np.diff(self.motions) == 1)
        source = self.division.source[self.motions]
        path = self.task.toolpath
        goes_on = path.continues[source[next_here + 1]] | (source[next_here + 1] == source[next_here])
        at = next_here[goes_on & (path.tool[source[next_here]] == path.tool[source[next_here + 1]])]
        blend = np.nan_to_num(approximations(self.task, self.division, self.motions[at]), nan=np.inf)
        reach[at] = np.fmin(blend, 0.5 * np.minimum(self.extent[at], self.extent[at + 1]))
        return reach

    def place(self, motions: Ints) -> Ints:
        """(K,) where ``motions`` (K,) are in this part.  Raises ValueError where one is not."""
        at = np.minimum(np.searchsorted(self.motions, motions), len(self.motions) - 1)
        if not np.array_equal(self.motions[at], motions):
            raise ValueError("a motion is not in this part")
        return at

    def samples(self, at: Ints) -> Floats:
        """(K, S) ascending shares of the segments ``at`` (K,) at which they are evaluated, parabolas included."""
        extent, reach = self.extent[at, None], self.reach[at, None]
        before = np.where(at > 0, self.reach[np.maximum(at - 1, 0)], 0.0)[:, None]
        between = np.broadcast_to(BETWEEN, (len(at), len(BETWEEN)))
        near = np.minimum(NEAR / extent, 0.5)
        parabolas = AT_ENDS * before / extent, 1.0 - AT_ENDS * reach / extent
        return np.sort(np.concatenate([*parabolas, near, 1.0 - near, between], axis=1), axis=1)

    def largest(self, motions: Ints) -> tuple[Floats, Floats]:
        """(K,) [m] and (K,) [rad]: by how much the tool under load is off along ``motions`` (K,), from the middle of
        the parabola at their start to that at their end."""
        at = self.place(motions)
        share = self.samples(at)
        return self.peaks(np.broadcast_to(at[:, None], share.shape), share)

    def peaks(self, at: Ints, share: Floats, closer: int = CLOSER) -> tuple[Floats, Floats]:
        """(K,) [m] and (K,) [rad]: by how much the tool is off at most at the shares (K, S) of the segments ``at``
        (K, S), in the order of the path, ``closer`` times nearer around the largest of them and around others that may
        be larger in between, and at the ``turns`` of the force."""
        many = len(share)
        off, angle, owner = np.zeros(many), np.zeros(many), np.arange(many)
        gap = np.where(np.diff(at, axis=1) == 0, np.diff(share, axis=1), 0.0)
        edge = np.zeros((many, 1))
        width = np.maximum(np.hstack([edge, gap]), np.hstack([gap, edge]))
        for level in range(closer + 1):
            found = self.deviations(at.ravel(), share.ravel())
            here, turned = (lengths(part).reshape(at.shape) for part in (found.shift, found.turn))
            np.maximum.at(off, owner, here.max(axis=1))
            np.maximum.at(angle, owner, turned.max(axis=1))
            if level == closer:
                break
            if level == 0:
                for which, _, _, there in self.where_force_turns(at, share, found):
                    np.maximum.at(off, which, lengths(there.shift))
                    np.maximum.at(angle, which, lengths(there.turn))
            row, peak = summits(here) if level == 0 else (np.arange(len(here)), here.argmax(axis=1))
            owner, at = owner[row], np.repeat(at[row, peak][:, None], len(AROUND), axis=1)
            centre, width = share[row, peak][:, None], width[row, peak][:, None]
            share = np.clip(centre + width * AROUND, 0.0, 1.0)
            width = np.repeat(width * (AROUND[1] - AROUND[0]), len(AROUND), axis=1)
        return off, angle

    @cached_property
    def turns(self) -> Floats:
        """(T, 2) rows and shares of the program's path near these motions where the force turns: where ramps of it
        start or end, and where motions start, as it changes within them."""
        rows = np.unique(self.segments.rows)
        rows = np.union1d(rows, np.minimum(rows + 1, len(self.task.toolpath) - 1))
        row = rows[self.task.carries[rows]]
        share = np.zeros(len(row))
        ramps = self.task.force.ramps
        if ramps is not None:
            end, at = ramps.ends()
            near = np.isin(end, rows)
            row, share = np.concatenate([row, end[near]]), np.concatenate([share, at[near]])
        return np.stack([row, share], axis=1)

    def where_force_turns(
        self, at: Ints, share: Floats, deviations: Deviations
    ) -> Iterator[tuple[Ints, Ints, Floats, Deviations]]:
        """Where the tool is at the ``turns`` of the force, nearer each time: between the two of the shares (K, S) of
        the segments ``at`` (K, S) beside each, of which the places are ``deviations`` (K S).  Which (T,) of the K they
        are, their segments (T,) and shares (T,), and the deviations (T) there."""
        if not self.turns.size:
            return
        low = int(min(deviations.row.min(), self.turns[:, 0].min()))
        high = int(max(deviations.row.max(), self.turns[:, 0].max()))
        length = self.task.desired_path.length[low : high + 1]
        begins = np.concatenate([[0.0], np.cumsum(length)])
        place = (begins[deviations.row - low] + deviations.share * length[deviations.row - low]).reshape(
            at.shape
        )
        row = self.turns[:, 0].astype(np.int64) - low
        turns = np.unique(begins[row] + self.turns[:, 1] * length[row])
        passed = np.searchsorted(turns, place)
        which, number = np.nonzero((np.diff(passed, axis=1) > 0) & (np.diff(at, axis=1) == 0))
        if not len(which):
            return
        turn = turns[np.minimum(passed[which, number], len(turns) - 1)]
        segment = at[which, number]
        ends = (share[which, number + k] for k in (0, 1))
        brackets = Brackets(*ends, *(place[which, number + k] - turn for k in (0, 1)))
        between, there = np.empty(len(which)), Deviations.empty(len(which))
        active = np.arange(len(which))
        for _ in range(TURNINGS):
            between[active] = brackets.secants(active)
            here = self.deviations(segment[active], between[active])
            there.put(active, here)
            yield which, segment, between, there
            own = here.share * self.task.desired_path.length[here.row]
            gap = begins[np.clip(here.row - low, 0, len(length) - 1)] + own - turn[active]
            brackets.narrow(active, between[active], gap)
            active = active[np.abs(gap) > AT_TURN]
            if not len(active):
                return

    def blend(self, at: Ints, share: Floats) -> Blend:
        """Where the shares (S,) of the segments ``at`` (S,) lie on parabolas."""
        first, before, after, t = at.copy(), share.copy(), np.zeros(len(at)), np.zeros(len(at))
        joined = (at > 0) & (self.motions[at] == self.motions[np.maximum(at - 1, 0)] + 1)
        for side in (0, 1):
            one = at - 1 + side if side else np.maximum(at - 1, 0)
            reach = self.reach[one]
            inside = (1.0 - share if side else share) * self.extent[at]
            some = np.flatnonzero((inside < reach) & (reach > 0) & (joined | bool(side)))
            k, r = one[some], reach[some]
            u = 0.5 + (0.5 if not side else -0.5) * inside[some] / r
            first[some], t[some] = k, u
            before[some] = 1.0 - r * (1.0 - u) / self.extent[k]
            after[some] = r * u / self.extent[k + 1]
        return Blend(first, before, after, t)

    def commands(self, blend: Blend) -> Poses:
        """(S) the poses to which the controller is sent."""
        poses = self.segments[blend.first].commands(self.task, blend.before)
        round_ = np.flatnonzero(blend.t > 0)
        if len(round_):
            other = self.segments[blend.first[round_] + 1].commands(self.task, blend.after[round_])
            poses.put(round_, interpolate_poses(poses[round_], other, blend.t[round_]))
        return poses

    def deviations(self, at: Ints, share: Floats) -> Deviations:
        """Of the tool under load at the shares (S,) of the segments ``at`` (S,), parabolas included."""
        command = self.commands(self.blend(at, share))
        segments = self.segments[at]
        sides = sides_of_output(self.task, self.division)
        came = None if sides is None else sides.at(self.motions[at], share)
        found = deviations(
            self.task, command, segments.rows, segments.along(share), self._ends_of_cuts(at, share), came
        )
        air = ~self.task.carries[segments.rows]  # nothing is cut there
        if air.any():
            found.shift[air], found.turn[air] = 0.0, 0.0
        return found

    def _ends_of_cuts(self, at: Ints, share: Floats) -> Bools:
        """(S,) where a cut is entered or left on a parabola: there it is an error to be early or late as well."""
        cut = self.task.carries[self.segments.rows]
        flows = self.reach[:-1] > 0
        entered = np.append(False, cut[1:] & ~cut[:-1] & flows)
        left = np.append(cut[:-1] & ~cut[1:] & flows, False)
        return np.asarray((entered[at] & (share == 0.0)) | (left[at] & (share == 1.0)))


def sides_of_output(task: CompensationProblem, division: Subdivision) -> GapSides | None:
    """On which side of its gap each axis lies along the motions of a division; None where the model does not ask."""
    if task.lost_motion is None:
        return None
    known = vars(division).get("_sides")
    if known is None or known[0] is not task:
        known = vars(division)["_sides"] = task, _sides_of_output(task, division)
    return known[1]


def _sides_of_output(task: CompensationProblem, division: Subdivision) -> GapSides:
    lost, source = task.lost_motion, division.source
    assert lost is not None
    ends = 2.0 * source + np.where(division.transitions, 0.0, division.share)
    motion = np.searchsorted(ends, 2.0 * lost.row + lost.share - SAME_PLACE)
    motion = np.where(lost.row < 0, -1, np.minimum(motion, len(division) - 1))
    first = _first_shares(division)
    extent = np.maximum(division.share - first, NEAREST)
    share = np.where(lost.row < 0, 1.0, np.clip((lost.share - first[motion]) / extent[motion], 0.0, 1.0))
    motor = lost.motors(task.gain)
    stations = Stations(motion, share, lost.row, lost.share, motor, lost.restart)
    own = np.flatnonzero(~division.transitions)
    stations = stations.with_ends(own, source[own], division.share[own])
    near = stations.crossing(lost)
    near = near[(near >= 0) & (near < len(division))]
    moved = task.desired_path.traceable & (task.desired_path.length > 0) & (task.track.branch >= 0)
    if task.process:
        moved &= task.carries
    near = near[moved[source[near]] & ~division.transitions[near]]
    if not len(near):
        return stations.sides(lost)
    output = RoundedOutput(task, division, near)
    at = output.place(near)
    before = np.where(at > 0, output.reach[np.maximum(at - 1, 0)], 0.0)[:, None] / output.extent[at, None]
    after = output.reach[at, None] / output.extent[at, None]
    line = np.broadcast_to(ON_LINE, (len(near), len(ON_LINE)))
    shares = np.concatenate([line, before * ON_PARABOLA, 1.0 - after * ON_PARABOLA], axis=1)
    number, shares = np.repeat(near, shares.shape[1]), shares.ravel()
    along = first[number] + shares * (division.share - first)[number]
    none = np.full((len(number), motor.shape[1]), np.nan)
    added = Stations(number, shares, source[number], along, none, np.zeros(len(number), bool))

    def commands(motions: Ints, share: Floats) -> Poses:
        return output.commands(output.blend(output.place(motions), share))

    return rounded_sides(task, stations, near, added, commands)


def _first_shares(division: Subdivision) -> Floats:
    """(M,) of the sources' paths, where the motions start."""
    same = np.append(False, division.source[1:] == division.source[:-1])
    return np.where(same, np.append(0.0, division.share[:-1]), 0.0)


def original_blend(task: CompensationProblem, row: Ints, share: Floats) -> tuple[Ints, Floats, Floats]:
    """Vertices (S,), the rows at whose end they are, and where (S,) on their parabola, -1 to 1, the shares (S,) of the
    paths of rows (S,) lie (outside of it: farther); the reach (S,) [m] of the parabola."""
    vertex = np.where(share < 0.5, row - 1, row)
    reach = original_reach(task, vertex)
    length = task.desired_path.length[row]
    away = np.where(share < 0.5, share, share - 1.0) * length
    return vertex, np.where(reach > 0, away / np.where(reach > 0, reach, 1.0), np.inf), reach


def original_reach(task: CompensationProblem, row: Ints) -> Floats:
    """(S,) [m] of the parabola at the end of the rows (S,) of the program; 0 without one."""
    desired_path, path = task.desired_path, task.toolpath
    one = np.clip(row, 0, max(len(path) - 2, 0))
    two = np.minimum(one + 1, len(path) - 1)
    goes_on = (row == one) & (two > one) & desired_path.traceable[one] & desired_path.traceable[two]
    goes_on &= path.continues[two] & (path.tool[one] == path.tool[two])
    half = 0.5 * np.minimum(desired_path.length[one], desired_path.length[two])
    return np.where(goes_on, np.fmin(path.approximation[one], half), 0.0)


def original(task: CompensationProblem, row: Ints, share: Floats) -> tuple[Poses, Floats]:
    """The poses (S) of the program's path at the shares (S,) of rows (S,), parabolas included, and unit tangents
    (S, 3)."""
    desired_path = task.desired_path
    poses, tangent = desired_path.at(row, share), desired_path.tangent(row, share)
    vertex, away, reach = original_blend(task, row, share)
    some = np.flatnonzero(np.abs(away) < 1.0)
    if len(some):
        one, d = vertex[some], reach[some]
        t = 0.5 + 0.5 * away[some]
        a = 1.0 - d * (1.0 - t) / desired_path.length[one]
        b = d * t / desired_path.length[one + 1]
        before, after = desired_path.at(one, a), desired_path.at(one + 1, b)
        poses.put(some, interpolate_poses(before, after, t))
        along = (1.0 - t)[:, None] * desired_path.tangent(one, a) + t[:, None] * desired_path.tangent(
            one + 1, b
        )
        along = along * d[:, None] + after.position - before.position
        tangent[some] = along / np.maximum(lengths(along), NEAREST)[:, None]
    return poses, tangent


def _moved(task: CompensationProblem, row: Ints, share: Floats, step: Floats) -> tuple[Ints, Floats]:
    """The places (S,) that lie by ``step`` (S,) [m] farther along the program's path than row (S,), share (S,); no
    farther than the motions before and after them, of the same cut."""
    desired_path, path = task.desired_path, task.toolpath

    def length(rows: Ints) -> Floats:
        return np.maximum(desired_path.length[rows], NEAREST)

    share = share + step / length(row)
    for side in (1, -1):
        other = np.clip(row + side, 0, len(path) - 1)
        over = (share > 1.0) if side > 0 else (share < 0.0)
        later = other if side > 0 else row
        can = over & (other != row) & desired_path.traceable[other] & path.continues[later]
        can &= task.carries[other] & (path.tool[other] == path.tool[row])
        beyond = ((share - 1.0) if side > 0 else -share) * length(row) / length(other)
        share = np.where(can, beyond if side > 0 else 1.0 - beyond, share)
        row = np.where(can, other, row)
    return row, np.clip(share, 0.0, 1.0)


def deviations(
    task: CompensationProblem,
    command: Poses,
    row: Ints,
    share: Floats,
    ends: Bools | None = None,
    came: Floats | None = None,
) -> Deviations:
    """How the tools at ``command`` (S) under load deviate from the program's path, parabolas included; from row (S,)
    and share (S,) themselves at the ``ends`` (S,) of cuts.  ``came`` (S, n): the sides of their gaps on which the axes
    lie, those of the place without.

    The force belongs to the place of the path that the tool is nearest to, where the path is square to the way to it;
    it is found by secants along the path, from row (S,) and share (S,) on, and between two places where these fail.
    """
    n = len(row)
    row, share = row.copy(), np.asarray(share, float).copy()
    found = Deviations(row, share, np.full((n, 3), np.inf), np.full((n, 3), np.inf))
    last, moved = np.full(n, np.nan), np.full(n, np.nan)
    beside = PlacesBeside(n)

    def ahead(active: Ints) -> Floats:
        """(K,) [m] by how much the tools ``active`` (K,) are ahead of their places; NaN where there is no answer."""
        at, where = row[active], share[active]
        wanted, tangent = original(task, at, where)
        goal = task.goal(at, wanted, where)
        here = command if len(active) == n else command[active]
        own = None if came is None else came[active]
        real = task.simulated(at, here, task.force.along(at, where), share=where, corrected=True, came=own)
        shift, turn = task.visible_errors(at, real.pose, goal)
        gap = np.sum(shift * tangent, axis=1)
        if ends is not None:
            gap[ends[active]] = 0.0
        good = real.reachable & real.settled
        shift = shift - gap[:, None] * tangent
        found.shift[active] = np.where(good[:, None], shift, np.inf)
        found.turn[active] = np.where(good[:, None], turn, np.inf)
        gap = np.where(good, gap, np.nan)
        beside.put(active, at, where, gap)
        return gap

    active = np.arange(n)
    for _ in range(ROUNDS):
        gap = ahead(active)
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = (last[active] - gap) / moved[active]
        slope = np.where(np.isfinite(slope), np.clip(slope, FLATTEST, 1.0 / FLATTEST), 1.0)
        step = gap / slope
        going = np.abs(step) > SETTLED
        if not going.any():
            return found
        last[active], moved[active] = gap, step
        active = active[going]
        row[active], share[active] = _moved(task, row[active], share[active], step[going])
    # where the force turns, secants lead from one side of the turn to the other and back
    beside.search(active, task.desired_path.length, row, share, ahead, SETTLED)
    return found
