"""Places of commands on the wanted path, solved on the robot itself: force and place of each tool agree.

By Newton's steps on the path, with the slope of the grid, and in a bracket where these do not come to rest.  Where a
motion only turns the tool, or only external axes, all of its path is one place: how far it is gone decides there.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.compensation.mirror import Prediction
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import external_at
from postproc.verification.path_grid import LEAST_NODES, RESIDUAL, SPOT, PathGrid

STEPS, HALVINGS = 10, 60
"""Newton's steps at most, and steps of bracketing of what they do not settle."""

STRIDES = (0.02, 0.03, 0.05, 0.1, 0.1, 0.2, 0.2, 0.3, 0.5, 1.0)
"""Parts of intervals in which a place is looked for beside another one."""

ON_SPOT, TURNING = 100 * SPOT, 10 * SPOT
"""[m] A place that is not farther from one where the tool only turns is that one; a motion that is not longer than
written digits show only turns the tool."""

SAME_SHARE = 1e-3
"""Of the travel of external axes, by which written digits may be elsewhere."""

FLAT = 0.02
"""Least slope of h that a step is taken with, in parts of a path that the force does not move."""


SHUT = 1e-9
"""Parts of a vertex between a direction in which the tool is ahead and one in which it is not, where that is all."""


class PlaceSolution:
    """Places of S commands on the intervals ``low`` to ``high`` (S,) of their stretches, on the robot itself."""

    def __init__(
        self,
        grid: PathGrid,
        run: CompensationProblem,
        motion: Ints,
        share: Floats,
        command: Poses,
        came: Floats | None,
        low: Ints,
        high: Ints,
    ) -> None:
        """motion, share (S,): where on the path of ``run`` the ``command`` (S) poses are; ``came`` (S, n): on which
        side of their gaps the axes lie, None where nothing asks."""
        self.came = came
        self.grid, self.task, self.motion, self.share, self.command = grid, run, motion, share, command
        self.low, self.high = low, high
        count = len(motion)
        self.error, self.turn, self.tool = np.full((3, count, 3), np.nan)
        self.rotation = np.full((count, 3, 3), np.nan)
        self.force, self.settled = np.full(count, np.nan), np.zeros(count, bool)
        self.step = np.zeros(count)
        self.q: Floats | None = None
        self.displacement = np.zeros((0, 0))

    def find(self, interval: Ints, part: Floats) -> None:
        """From places nearby, interval and part (S,) of it: Newton's steps, and a bracket where these do not come to
        rest."""
        self.interval, self.part = interval.copy(), part.copy()
        self._find(np.arange(len(interval)))

    def _find(self, active: Ints) -> None:
        start = self.interval.copy()
        for _ in range(STEPS):
            some = np.isfinite(self._ahead(active)) & ~self.settled[active]
            active = active[some]
            if not len(active):
                return
            self._step(active)
        self._bracket(active, start[active])

    def find_beside(self, place: Floats) -> None:
        """From ``place`` (S,), numbers of intervals with their parts after the point, the next place in the direction
        in which the tool is off it: no step leads over one."""
        active = np.arange(len(place))
        self.interval, self.part = np.zeros(len(place), np.int64), np.zeros(len(place))
        ahead = self._at(active, place)
        sense = np.sign(ahead)
        near, far, there = place.copy(), place.copy(), ahead.copy()
        going = ~self.settled & np.isfinite(ahead)
        for step in STRIDES:
            some = np.flatnonzero(going)
            if not len(some):
                break
            far[some] = np.clip(near[some] + step * sense[some], self.low[some], self.high[some] + 1)
            there[some] = self._at(some, far[some])
            passed = there[some] * sense[some] <= 0
            on = some[~passed]
            near[on], ahead[on] = far[on], there[on]
            going[some[passed | ~np.isfinite(there[some])]] = False
        some = np.flatnonzero(~self.settled & np.isfinite(there) & (there * sense <= 0))
        forth = sense[some] > 0
        ends = (
            (np.where(forth, a[some], b[some]), np.where(forth, b[some], a[some]))
            for a, b in ((near, far), (ahead, there))
        )
        (below, above), (one, two) = ends
        self._between(some, below, above, one, two)

    def turn_on_the_spot(self) -> None:
        """Where a motion of the original only turns the tool, all of its path is one place: there the orientation shows
        how far it is gone.  A command that only turns belongs to that place, and so does one of the original before it
        (after it) whose tool the force moves past it: its orientation is compared with those there."""
        grid = self.grid
        if not grid.on_the_spot.any():
            return
        row, share = grid.place(self.interval, self.part)
        distance = grid.original.desired_path.length[row] * np.stack([1 - share, share])
        turns = self.task.desired_path.length[self.motion] < TURNING
        moved = lengths(self.tool - self.command.position)
        turning, away = np.full(len(row), -1), np.zeros(len(row))
        for candidate, far in ((row + 1, distance[0]), (row - 1, distance[1]), (row, np.zeros(len(row)))):
            inside = (candidate >= grid.row[self.low]) & (candidate <= grid.row[self.high])
            passed = (self.motion - candidate) * (row - candidate) <= 0
            passed &= self.task is grid.original
            reach = np.where(turns | passed, moved, 0.0) + ON_SPOT
            spot = grid.on_the_spot[np.clip(candidate, 0, len(grid.on_the_spot) - 1)]
            matches = inside & (far < reach) & spot
            turning, away = np.where(matches, candidate, turning), np.where(matches, far, away)
        some = np.flatnonzero((turning >= 0) & self.settled)
        if not len(some):
            return
        at = turning[some]
        start, end = (self._goal_rotation(at, np.full(len(at), side)) for side in (0.0, 1.0))
        gone = np.clip(_share(turn_between(start, self.rotation[some]), turn_between(start, end)), 0.0, 1.0)
        first, last, here = self._by_axes(at, some)
        by_axes = np.isfinite(here)  # these are where they are, whatever the force does
        own = by_axes & (first < last) & (first > -SAME_SHARE) & (last < 1 + SAME_SHARE)
        gone = np.where(by_axes, np.clip(here, 0.0, 1.0), gone)
        turn = turn_between(self._goal_rotation(at, gone), self.rotation[some])
        better = np.where(by_axes, own, lengths(turn) < lengths(self.turn[some]))
        self.turn[some[better]] = turn[better]
        on = np.flatnonzero(better & (away[some] < ON_SPOT))
        part = LEAST_NODES * gone[on]
        step = np.minimum(part.astype(np.int64), LEAST_NODES - 1)
        self._move(some[on], np.searchsorted(grid.row, at[on]) + step, part - step)
        after = first > 0.5
        wrong_side = np.where(after, row[some] <= at, row[some] >= at) & (away[some] < ON_SPOT)
        beside = np.flatnonzero(by_axes & ~own & wrong_side)
        self._leave(some[beside], at[beside], after[beside])

    def _move(self, rows: Ints, interval: Ints, part: Floats) -> None:
        """Other places of the commands ``rows`` (K,)."""
        self.interval[rows], self.part[rows] = interval, part
        self._ahead(rows)
        self.settled[rows] = True

    def _leave(self, rows: Ints, spot: Ints, after: Bools) -> None:
        """Places of the commands ``rows`` (K,) ``after`` (K,) or before the ``spot`` (K,), which they do not belong
        to."""
        low, high = np.searchsorted(self.grid.row, spot, "right"), np.searchsorted(self.grid.row, spot) - 2
        there = np.where(after, low <= self.high[rows], high >= self.low[rows])
        rows, after, low, high = rows[there], after[there], low[there], high[there]
        self.low[rows], self.high[rows] = (
            np.where(after, low, self.low[rows]),
            np.where(after, self.high[rows], high),
        )
        self.interval[rows], self.part[rows] = np.where(after, low, high), np.where(after, 0.0, 1.0)
        self.settled[rows] = False
        self._find(rows)

    def _by_axes(self, row: Ints, some: Ints) -> tuple[Floats, Floats, Floats]:
        """Of the travel of external axes on the original's rows (K,), the shares (K,) at which the motions of the
        commands ``some`` (K,) start and end and at which the commands are; NaN where none moves."""
        original, run = self.grid.original.toolpath, self.task.toolpath
        motion, none, all_of_it = self.motion[some], np.zeros(len(row)), np.ones(len(row))
        start, end = external_at(original, row, none), external_at(original, row, all_of_it)
        travel = np.nan_to_num(end - start)
        places = (external_at(run, motion, share) for share in (none, all_of_it, self.share[some]))
        first, last, here = (
            np.where(travel.any(axis=1), _share(np.nan_to_num(place - start), travel), np.nan)
            for place in places
        )
        return first, last, here

    def _goal_rotation(self, row: Ints, share: Floats) -> Floats:
        """(K, 3, 3) how the tool is meant to be at shares (K,) of the original's rows (K,)."""
        grid = self.grid
        return grid.original.goal(row, grid.path.at(row, share), share).rotation

    def _ahead(self, active: Ints) -> Floats:
        """(K,) [m] how far the tools of ``active`` (K,) are ahead of their places; NaN without equilibrium.  Notes
        which are settled, and where the tool is."""
        goal, tangent, wrench = self.grid.goal(self.interval[active], self.part[active])
        real = self._real(active, wrench)
        error = real.pose.position - goal.position
        good = real.reachable & real.settled
        ahead = np.where(good, np.sum(error * tangent, axis=1), np.nan)
        at_end = (self.interval[active] == self.high[active]) & (self.part[active] >= 1) & (ahead > 0)
        at_start = (self.interval[active] == self.low[active]) & (self.part[active] <= 0) & (ahead < 0)
        interval, part = self.interval[active], self.part[active]
        step = ahead / self._slope(active)
        arc = self.grid.arc[interval + 1] - self.grid.arc[interval]
        near = (np.abs(step) * arc <= self.grid.near[interval]) & ~self.grid.gap[interval]
        near &= (part + step >= 0) & (part + step <= 1)
        self.settled[active] = done = good & (near | (np.abs(ahead) <= RESIDUAL) | at_end | at_start)
        self.part[active] = np.where(near, part + step, part)
        error -= np.where(near, ahead, 0.0)[:, None] * tangent
        self.error[active], self.tool[active] = error, real.pose.position
        self.rotation[active] = real.pose.rotation
        self.force[active] = lengths(wrench[:, :3])
        self.step[active] = step
        if done.all():
            self.turn[active] = turn_between(goal.rotation, real.pose.rotation)
        elif done.any():
            self.turn[active[done]] = turn_between(goal.rotation[done], real.pose.rotation[done])
        return ahead

    def _slope(self, active: Ints) -> Floats:
        """(K,) [m] by how much less the tools of ``active`` are ahead of their places at the end of their interval than
        at its start."""
        grid, interval, place = self.grid, self.interval[active], self.command.position[active]
        one, two = (
            np.sum((place - grid.v[at]) * grid.tangent[at], axis=1) for at in (interval, interval + 1)
        )
        least = FLAT * (grid.arc[interval + 1] - grid.arc[interval]) + 1e-9
        return np.asarray(np.maximum(one - two, least))

    def _step(self, active: Ints) -> None:
        """Moves the places of ``active`` by the steps that were found where they are, no farther than into the next
        interval."""
        interval, old = self.interval[active], self.part[active]
        part = old + np.clip(self.step[active], -2.0, 2.0)
        # what leads beyond an end is not gone on with: the slope there is another one
        forth = (part > 1) & (old >= 1) & (interval < self.high[active])
        back = (part < 0) & (old <= 0) & (interval > self.low[active])
        self.part[active] = np.where(forth, 0.0, np.where(back, 1.0, np.clip(part, 0.0, 1.0)))
        self.interval[active] = interval + forth - back

    def _real(self, active: Ints, wrench: Floats) -> Prediction:
        """Where the tools of ``active`` are; the first solution is the start of the next."""
        motion, share, command = self.motion[active], self.share[active], self.command[active]
        if self.q is None:  # asked for all
            real = self.task.simulated(motion, command, wrench, share=share, came=self.came)
            self.q, self.displacement = real.q.copy(), real.displacement.copy()
            return real
        came = None if self.came is None else self.came[active]
        start, q = self.displacement[active], self.q[active]
        real = self.task.simulated(motion, command, wrench, start, q, share, came=came)
        self.displacement[active] = real.displacement
        return real

    def _bracket(self, active: Ints, interval: Ints) -> None:
        """Between a place that the tool is ahead of and one that it has not reached, as near as there are such: the
        secant through both, of which the one that stays counts half (Illinois)."""
        at = interval.astype(float)
        below, above = at.copy(), at + 1
        one, two = np.full(len(at), np.nan), np.full(len(at), np.nan)
        enclosed = np.zeros(len(at), bool)
        for wider in (0, 1, 2, 4, 8, 16, 32):
            some = np.flatnonzero(~enclosed)
            if not len(some):
                break
            rows = active[some]
            below[some] = np.maximum(at[some] - wider, self.low[rows])
            above[some] = np.minimum(at[some] + 1 + wider, self.high[rows] + 1)
            one[some], two[some] = self._at(rows, below[some]), self._at(rows, above[some])
            enclosed[some] = (one[some] >= 0) & (two[some] <= 0)
        below, above, one, two = (values[enclosed] for values in (below, above, one, two))
        self._between(active[enclosed], below, above, one, two)

    def _between(self, active: Ints, below: Floats, above: Floats, one: Floats, two: Floats) -> None:
        """Places between those ``below``, of which the tools are ``one`` (K,) [m] ahead, and those ``above``:
        ``two``."""
        side = np.zeros(len(active), np.int64)
        for _ in range(HALVINGS):
            if not len(active):
                break
            middle = below + (above - below) * one / np.where(one == two, 1.0, one - two)
            ahead = self._at(active, middle)
            is_ahead = ahead > 0
            two, one = (
                np.where(is_ahead & (side > 0), 0.5 * two, two),
                np.where(~is_ahead & (side < 0), 0.5 * one, one),
            )
            below, above = np.where(is_ahead, middle, below), np.where(is_ahead, above, middle)
            one, two, side = (
                np.where(is_ahead, ahead, one),
                np.where(is_ahead, two, ahead),
                np.where(is_ahead, 1, -1),
            )
            # at a reversal the path is square to the tool in no direction: the vertex is the place
            shut = (above - below <= SHUT) & self.grid.gap[self.interval[active]] & np.isfinite(ahead)
            self._settle(active[shut & ~self.settled[active]])
            going = ~self.settled[active] & np.isfinite(ahead)
            active, side = active[going], side[going]
            below, above, one, two = (values[going] for values in (below, above, one, two))

    def _settle(self, rows: Ints) -> None:
        """The commands ``rows`` (K,) are where they were last looked at."""
        goal, _, _ = self.grid.goal(self.interval[rows], self.part[rows])
        self.turn[rows] = turn_between(goal.rotation, self.rotation[rows])
        self.settled[rows] = True

    def _at(self, active: Ints, place: Floats) -> Floats:
        """How far the tools are ahead of these places: numbers of intervals, with their parts after the point."""
        self.interval[active] = np.minimum(np.floor(place).astype(np.int64), self.high[active])
        self.part[active] = place - self.interval[active]
        return self._ahead(active)


def _share(gone: Floats, travel: Floats) -> Floats:
    """(K,) of ``travel`` (K, d) that ``gone`` (K, d) is."""
    return np.asarray(np.sum(gone * travel, axis=1) / np.maximum(np.sum(travel**2, axis=1), 1e-18))
