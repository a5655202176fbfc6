"""Force and place of a tool, found together.

The force on the tool belongs to the place on the wanted path at which the *deflected* tool is nearest to it, and it is
that force which deflects the tool:

    (x(c, F(s)) - g(s)) . t(s) = 0

with the command c, the tool x(c, F), the wanted path g, its tangent t, the force F by place.  From one command to the
next the place goes on along the cut.

First on a grid of nodes on the wanted path.  With the displacement E(s) of a tool that is sent to the wanted path
there, the equation is h(s) = (c - v(s)) . t(s) = 0 with v(s) = g(s) - E(s), which needs no robot.  A place is where h
turns from positive to negative: there a tool that is pushed ahead is after its place and comes back.  Then on the
robot itself, by Newton's steps on the path, with the slope of the grid, and in a bracket where these do not come to
rest; what does not then is reported.

Where two motions meet, two nodes are at one place: between them tangent and force go over from the one to the other.
So a corner holds the tool that is nearest to it, and a force that jumps has every value between its two.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, sums
from postproc.base.batches import each_block
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.base.units import MM
from postproc.compensation.mirror import Prediction
from postproc.compensation.problem import CompensationProblem
from postproc.verification.run_path import RunPath

NODES = 2.0 * MM
"""Distance of the nodes on the wanted path, at most."""

LEAST_NODES = 2
"""Intervals of a motion at least."""

RESIDUAL = 1e-7
"""[m] How far along the path a tool may be from the place whose force it has."""

SPOT = 1e-6
"""[m] A motion that is not longer only turns the tool."""

STEPS, HALVINGS = 10, 60
"""Newton's steps at most, and steps of bracketing of what they do not settle."""

FLAT = 0.02
"""Least slope of h that a step is taken with, in parts of a path that the force does not move."""

REACH, MARGIN = 1.5, 2.0 * MM
"""How far from the last place the next one may be, besides the path of the command: so many times the largest
displacement of the tool, and this."""

_BLOCK = 128
"""Commands that are looked at together."""


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
        parts = np.maximum(LEAST_NODES, np.ceil(length / NODES)).astype(np.int64)
        at = sums(parts + 1)
        row = np.repeat(rows, parts + 1)
        number = np.arange(len(row)) - np.repeat(at[:-1], parts + 1)
        share = number / np.repeat(parts, parts + 1)
        first = at[sums(count)]
        before = np.append(0.0, np.cumsum(length))
        own = before[:-1] - np.repeat(before[sums(count)[:-1]], count)
        arc = np.repeat(own, parts + 1) + share * np.repeat(length, parts + 1)
        v, tangent, goals = (np.empty((len(row), 3)) for _ in range(3))

        def made(part: slice) -> None:
            there = path.at(row[part], share[part])
            wrench = original.force.along(row[part], share[part])
            real = original.simulated(row[part], there, wrench, share=share[part])
            goal = original.goal(row[part], there, share[part]).position
            goals[part], v[part] = goal, goal - np.nan_to_num(real.pose.position - there.position)
            tangent[part] = path.tangent(row[part], share[part])

        each_block(made, len(row))
        gap = np.append(row[1:] != row[:-1], True)[: len(row)]
        farthest = float(lengths(goals - v).max(initial=0.0))
        return PathGrid(original, path, first, row, share, arc, v, tangent, gap, goals, farthest)

    @cached_property
    def on_the_spot(self) -> Bools:
        """(N,) motions on the cuts that only turn the tool."""
        found = np.zeros(len(self.original.toolpath), bool)
        found[self.row] = self.original.desired_path.length[self.row] < SPOT
        return found

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
        wanted = self.path.at(row, share)
        goal = self.original.goal(row, wanted, share)
        tangent, wrench = self.path.tangent(row, share), self.original.force.along(row, share)
        over = np.flatnonzero(self.gap[interval])
        if len(over):
            other, start = self.row[interval[over] + 1], np.zeros(len(over))
            weight = part[over, None]
            turned = (1 - weight) * tangent[over] + weight * self.path.tangent(other, start)
            tangent[over] = turned / np.maximum(lengths(turned), 1e-12)[:, None]
            wrench[over] = (1 - weight) * wrench[over] + weight * self.original.force.along(other, start)
        return goal, tangent, wrench


@dataclass(frozen=True, eq=False)
class PlacedTool:
    """S commands of a program.  row, share (S,): place on the original; arc (S,) [m]: the same along its stretch; error
    (S, 3) [m]: tool minus the wanted path there, robot base axes; turn (S,) [rad]: by how much the tool is turned
    against it, as far as that shows and the text can say it; force (S,) [N]; settled (S,): place and force agree."""

    row: Ints
    share: Floats
    arc: Floats
    error: Floats
    turn: Floats
    force: Floats
    settled: Bools


def place_tool(grid: PathGrid, path: RunPath, stretch: Ints, motion: Ints, share: Floats) -> PlacedTool:
    """The commands at the shares (S,) of motions ``motion`` (S,) of a program's ``path``; ``stretch`` (S,): which of
    the original's each of them runs, ascending, in the order of the path."""
    command = np.empty((len(motion), 3))

    def sent(block: slice) -> None:
        command[block] = path.at(motion[block], share[block]).position

    each_block(sent, len(motion))
    interval, part = _tracked(grid, stretch, command)
    low, high = grid.first[stretch], grid.first[stretch + 1] - 2
    count = len(motion)
    row, at, arc = np.empty(count, np.int64), np.empty(count), np.empty(count)
    error, turn = np.empty((count, 3)), np.empty(count)
    force, settled = np.empty(count), np.empty(count, bool)

    def found(block: slice) -> None:
        there = path.at(motion[block], share[block])
        here = _Solution(grid, path.task, motion[block], share[block], there, low[block], high[block])
        here.find(interval[block], part[block])
        here.turn_on_the_spot()
        row[block], at[block] = grid.place(here.interval, here.part)
        arc[block] = grid.along(here.interval, here.part)
        wanted = grid.path.at(row[block], at[block]).rotation
        turn[block] = lengths(judged(grid.original, row[block], wanted, here.turn))
        error[block], force[block] = here.error, here.force
        settled[block] = here.settled

    each_block(found, count)
    return PlacedTool(row, at, arc, error, turn, force, settled)


def judged(original: CompensationProblem, rows: Ints, rotation: Floats, turn: Floats) -> Floats:
    """(K, 3) [rad]: ``turn`` (K, 3) of tools at ``rotation`` (K, 3, 3), without what the text of ``rows`` (K,) cannot
    say: a turn about the tool's own axis where that is free, all of it where the orientation comes from outside."""
    path = original.toolpath
    free = np.nan_to_num(path.orientation_control.redundant_axis[rows])
    if free.any():
        axis = (rotation @ free[..., None])[..., 0]
        turn = turn - np.sum(turn * axis, axis=1, keepdims=True) * axis
    return np.where(path.constraints.orientation_programmed[rows][:, None], turn, 0.0)


class _Solution:
    """Places of S commands on the intervals ``low`` to ``high`` (S,) of their stretches, on the robot itself."""

    def __init__(
        self,
        grid: PathGrid,
        run: CompensationProblem,
        motion: Ints,
        share: Floats,
        command: Poses,
        low: Ints,
        high: Ints,
    ) -> None:
        self.grid, self.task, self.motion, self.share, self.command = grid, run, motion, share, command
        self.low, self.high = low, high
        count = len(motion)
        self.error, self.turn = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
        self.force, self.settled = np.full(count, np.nan), np.zeros(count, bool)
        self.q: Floats | None = None
        self.bent = np.zeros((0, 0))

    def find(self, interval: Ints, part: Floats) -> None:
        """From places nearby: Newton's steps, and a bracket where these do not come to rest."""
        self.interval, self.part = interval.copy(), part.copy()
        active = np.arange(len(interval))
        for _ in range(STEPS):
            ahead = self._ahead(active)
            active, ahead = active[~self.settled[active]], ahead[~self.settled[active]]
            some = np.isfinite(ahead)
            active, ahead = active[some], ahead[some]
            if not len(active):
                return
            self._step(active, ahead)
        self._bracket(active, interval[active])

    def turn_on_the_spot(self) -> None:
        """Where a motion of the original only turns the tool, all of its path is one place: there the orientation tells
        how far it is gone."""
        grid = self.grid
        if not grid.on_the_spot.any():
            return
        row, share = grid.place(self.interval, self.part)
        left = grid.original.desired_path.length[row] * np.stack([1 - share, share])
        turning = np.full(len(row), -1)
        for candidate, near in (
            (row + 1, left[0] < 100 * SPOT),
            (row - 1, left[1] < 100 * SPOT),
            (row, True),
        ):
            inside = (candidate >= grid.row[self.low]) & (candidate <= grid.row[self.high])
            found = inside & near & grid.on_the_spot[np.clip(candidate, 0, len(grid.on_the_spot) - 1)]
            turning = np.where(found, candidate, turning)
        some = np.flatnonzero((turning >= 0) & self.settled)
        if not len(some):
            return
        at = turning[some]
        start, end = (grid.path.at(at, np.full(len(at), side)).rotation for side in (0.0, 1.0))
        path = turn_between(start, end)
        gone = np.sum(turn_between(start, self.command.rotation[some]) * path, axis=1)
        part = LEAST_NODES * np.clip(gone / np.maximum(np.sum(path**2, axis=1), 1e-18), 0.0, 1.0)
        step = np.minimum(part.astype(np.int64), LEAST_NODES - 1)
        before, old = self.turn[some].copy(), (self.interval[some], self.part[some])
        self.interval[some], self.part[some] = np.searchsorted(grid.row, at) + step, part - step
        self._ahead(some)
        worse = lengths(self.turn[some]) > lengths(before)
        self.interval[some[worse]], self.part[some[worse]] = old[0][worse], old[1][worse]
        self._ahead(some[worse])
        self.settled[some[worse]] = True

    def _ahead(self, active: Ints) -> Floats:
        """(K,) [m] how far the tools of ``active`` (K,) are ahead of their places; NaN without equilibrium.  Notes
        which are settled, and where the tool is."""
        goal, tangent, wrench = self.grid.goal(self.interval[active], self.part[active])
        real = self._real(active, wrench)
        error = real.pose.position - goal.position
        good = real.reachable & real.settled
        ahead = np.where(good, np.sum(error * tangent, axis=1), np.nan)
        at_end = (self.interval[active] == self.high[active]) & (self.part[active] >= 1) & (ahead > 0)
        at_begin = (self.interval[active] == self.low[active]) & (self.part[active] <= 0) & (ahead < 0)
        self.error[active], self.force[active] = error, lengths(wrench[:, :3])
        self.settled[active] = done = good & ((np.abs(ahead) <= RESIDUAL) | at_end | at_begin)
        if done.all():
            self.turn[active] = turn_between(goal.rotation, real.pose.rotation)
        elif done.any():
            self.turn[active[done]] = turn_between(goal.rotation[done], real.pose.rotation[done])
        return ahead

    def _step(self, active: Ints, ahead: Floats) -> None:
        """Moves the places of ``active`` by what their tools are ``ahead`` [m] of them, no farther than into the next
        interval."""
        grid, interval = self.grid, self.interval[active]
        place = self.command.position[active]
        one, two = (
            np.sum((place - grid.v[at]) * grid.tangent[at], axis=1) for at in (interval, interval + 1)
        )
        least = FLAT * (grid.arc[interval + 1] - grid.arc[interval]) + 1e-9
        old = self.part[active]
        part = old + np.clip(ahead / np.maximum(one - two, least), -2.0, 2.0)
        # what leads beyond an end is not gone on with: the slope there is another one
        forth = (part > 1) & (old >= 1) & (interval < self.high[active])
        back = (part < 0) & (old <= 0) & (interval > self.low[active])
        self.part[active] = np.where(forth, 0.0, np.where(back, 1.0, np.clip(part, 0.0, 1.0)))
        self.interval[active] = interval + forth - back

    def _real(self, active: Ints, wrench: Floats) -> Prediction:
        """Where the tools of ``active`` are; what is found for the first time is begun with from then on."""
        motion, share, command = self.motion[active], self.share[active], self.command[active]
        if self.q is None:  # asked for all
            real = self.task.simulated(motion, command, wrench, share=share)
            self.q, self.bent = real.q.copy(), real.displacement.copy()
            return real
        real = self.task.simulated(motion, command, wrench, self.bent[active], self.q[active], share)
        self.bent[active] = real.displacement
        return real

    def _bracket(self, active: Ints, interval: Ints) -> None:
        """Between a place that the tool is ahead of and one that it is behind, as near as there are such: the secant
        through both, of which the one that stays counts half (Illinois)."""
        at = interval.astype(float)
        below, above = at.copy(), at + 1
        one, two = np.full(len(at), np.nan), np.full(len(at), np.nan)
        held = np.zeros(len(at), bool)
        for wider in (0, 1, 2, 4, 8):
            some = np.flatnonzero(~held)
            if not len(some):
                break
            rows = active[some]
            below[some] = np.maximum(at[some] - wider, self.low[rows])
            above[some] = np.minimum(at[some] + 1 + wider, self.high[rows] + 1)
            one[some], two[some] = self._at(rows, below[some]), self._at(rows, above[some])
            held[some] = (one[some] >= 0) & (two[some] <= 0)
        active, below, above, one, two = (values[held] for values in (active, below, above, one, two))
        side = np.zeros(len(active), np.int64)
        for _ in range(HALVINGS):
            if not len(active):
                break
            middle = below + (above - below) * one / np.where(one == two, 1.0, one - two)
            ahead = self._at(active, middle)
            left = ahead > 0
            two, one = (
                np.where(left & (side > 0), 0.5 * two, two),
                np.where(~left & (side < 0), 0.5 * one, one),
            )
            below, above = np.where(left, middle, below), np.where(left, above, middle)
            one, two, side = np.where(left, ahead, one), np.where(left, two, ahead), np.where(left, 1, -1)
            going = ~self.settled[active] & np.isfinite(ahead)
            active, below, above, one, two, side = (
                values[going] for values in (active, below, above, one, two, side)
            )

    def _at(self, active: Ints, place: Floats) -> Floats:
        """How far the tools are ahead of these places: numbers of intervals, with their parts after the point."""
        self.interval[active] = np.minimum(np.floor(place).astype(np.int64), self.high[active])
        self.part[active] = place - self.interval[active]
        return self._ahead(active)


def _tracked(grid: PathGrid, stretch: Ints, command: Floats) -> tuple[Ints, Floats]:
    """Interval and part of it (S,) of the grid in which each command (S, 3) is found, going on from the one before."""
    interval, part = np.empty(len(command), np.int64), np.empty(len(command))
    start = np.flatnonzero(np.append(True, stretch[1:] != stretch[:-1])[: len(stretch)])
    for first, stop in zip(start, np.append(start[1:], len(command))[: len(start)], strict=True):
        low, high = int(grid.first[stretch[first]]), int(grid.first[stretch[first] + 1])
        _Tracking(grid, slice(low, high)).run(command[first:stop], interval[first:stop], part[first:stop])
        interval[first:stop] += low
    return interval, part


class _Tracking:
    """Goes along the J nodes of one stretch."""

    def __init__(self, grid: PathGrid, nodes: slice) -> None:
        self.v, self.tangent, self.arc = grid.v[nodes], grid.tangent[nodes], grid.arc[nodes]
        self.level = np.sum(self.v * self.tangent, axis=1)
        self.reach = REACH * grid.farthest + MARGIN
        self.last = len(self.v) - 2

    def run(self, command: Floats, interval: Ints, part: Floats) -> None:
        """Fills in ``interval`` and ``part`` (S,) of the commands (S, 3)."""
        step = np.append(0.0, REACH * lengths(np.diff(command, axis=0)))
        done, here = 0, float(self.arc[0])
        while done < len(command):
            block = slice(done, min(done + _BLOCK, len(command)))
            found, share, here = self._found(command[block], step[block], here)
            interval[done : done + len(found)], part[done : done + len(found)] = found, share
            done += len(found)

    def _found(self, command: Floats, step: Floats, here: float) -> tuple[Ints, Floats, float]:
        """Of the commands (B, 3), or of the first of them whose path stays in view: of the intervals near the last
        place, ``here`` [m], where h changes from positive to negative, the one that the tool is nearest to."""
        start = np.searchsorted(self.arc, [here - 2 * self.reach, here + 2 * self.reach + step.sum()])
        low, high = max(int(start[0]) - 1, 0), min(int(start[1]), self.last)
        some = self._candidates(command, low, high)
        least = -np.inf if low == 0 else float(self.arc[low])
        most = np.inf if high == self.last else float(self.arc[high + 1])
        first = np.searchsorted(some.row, np.arange(len(command) + 1)).tolist()
        arc, away, steps = some.arc.tolist(), some.away.tolist(), step.tolist()
        chosen: list[int] = []
        for row in range(len(command)):
            back, ahead = here - self.reach, here + self.reach + steps[row]
            if row and (back < least or ahead > most):
                break
            best, nearest = -1, np.inf
            for number in range(first[row], first[row + 1]):
                if away[number] < nearest and back <= arc[number] <= ahead:
                    best, nearest = number, away[number]
            if best < 0:  # nowhere square to it: the solution will tell
                if row:
                    break
                return self._node(command[:1], back, ahead)
            chosen.append(best)
            here = arc[best]
        return some.interval[chosen], some.share[chosen], here

    def _candidates(self, command: Floats, low: int, high: int) -> _Candidates:
        """Where, in the intervals ``low`` to ``high``, the tools of the commands may be found."""
        value = command @ self.tangent[low : high + 2].T - self.level[low : high + 2]
        behind = value < 0
        row, interval = np.nonzero(~behind[:, :-1] & behind[:, 1:])
        one, two = value[row, interval], value[row, interval + 1]
        share, interval = one / (one - two), interval + low
        # before the start and after the end of the stretch these are the places
        before = np.flatnonzero(behind[:, 0]) if low == 0 else np.zeros(0, np.int64)
        beyond = np.flatnonzero(~behind[:, -1]) if high == self.last else np.zeros(0, np.int64)
        row = np.concatenate([row, before, beyond])
        interval = np.concatenate(
            [interval, np.zeros(len(before), np.int64), np.full(len(beyond), self.last)]
        )
        share = np.concatenate([share, np.zeros(len(before)), np.ones(len(beyond))])
        order = np.argsort(row, kind="stable")
        row, interval, share = row[order], interval[order], share[order]
        v = self.v[interval] + share[:, None] * (self.v[interval + 1] - self.v[interval])
        arc = self.arc[interval] + share * (self.arc[interval + 1] - self.arc[interval])
        return _Candidates(row, interval, share, arc, lengths(command[row] - v))

    def _node(self, command: Floats, back: float, ahead: float) -> tuple[Ints, Floats, float]:
        """The nearest node."""
        low, high = np.searchsorted(self.arc, [back, ahead])
        low = min(int(low), self.last)
        at = low + int(np.argmin(lengths(command - self.v[low : max(int(high), low + 1)])))
        interval = min(at, self.last)
        return np.array([interval]), np.array([float(at - interval)]), float(self.arc[at])


@dataclass(frozen=True, eq=False)
class _Candidates:
    """row (C,) ascending; interval, share of it, arc [m], and how far the tool is away [m]."""

    row: Ints
    interval: Ints
    share: Floats
    arc: Floats
    away: Floats
