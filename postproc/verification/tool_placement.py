"""Force and place of a tool, solved together.

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

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.base.units import MM
from postproc.compensation.mirror import Prediction
from postproc.compensation.problem import CompensationProblem
from postproc.verification.path_grid import LEAST_NODES, RESIDUAL, SPOT, PathGrid
from postproc.verification.run_path import RunPath
from postproc.verification.tracking import track_commands

STEPS, HALVINGS = 10, 60
"""Newton's steps at most, and steps of bracketing of what they do not settle."""

SAME_GUESS = 1e-6
"""Parts of an interval by which two first places of a command differ by rounding alone."""

LEAP, LEAST_LEAP, BESIDE, WALKS = 4.0, 0.05 * MM, 24, 40
"""By how many times the step of the command, and how much [m], a place leaps at least; so many commands before and
after it are tried on its other side, and so often at most, from where it leaps then."""

STRIDES = (0.02, 0.03, 0.05, 0.1, 0.1, 0.2, 0.2, 0.3, 0.5, 1.0)
"""Parts of intervals in which a place is looked for beside another one."""

FLAT = 0.02
"""Least slope of h that a step is taken with, in parts of a path that the force does not move."""


@dataclass(frozen=True, eq=False)
class PlacedTool:
    """S commands of a program.  row, share (S,): place on the original; arc (S,) [m]: the same along its stretch; error
    (S, 3) [m]: tool minus the wanted path there, robot base axes; turn (S,) [rad]: by how much the tool is turned
    against it, as far as that shows and the text can state it; force (S,) [N]; settled (S,): place and force agree;
    tool, command (S, 3) [m]; place (S,): the interval and the part of it, guess (S,) those from which it was found."""

    row: Ints
    share: Floats
    arc: Floats
    error: Floats
    turn: Floats
    force: Floats
    settled: Bools
    tool: Floats
    command: Floats
    guess: Floats
    place: Floats

    @staticmethod
    def empty(count: int) -> PlacedTool:
        row, settled = np.zeros(count, np.int64), np.zeros(count, bool)
        share, arc, turn, force, guess, place = np.full((6, count), np.nan)
        error, tool, command = np.full((3, count, 3), np.nan)
        return PlacedTool(row, share, arc, error, turn, force, settled, tool, command, guess, place)

    def at(self, numbers: Ints) -> PlacedTool:
        """Those of ``numbers`` (K,)."""
        return PlacedTool(*(getattr(self, one.name)[numbers] for one in fields(self)))

    def put(self, numbers: Ints, other: PlacedTool) -> None:
        """Sets ``numbers`` (K,) to the K commands of the other."""
        for one in fields(self):
            getattr(self, one.name)[numbers] = getattr(other, one.name)


def place_tool(
    grid: PathGrid,
    path: RunPath,
    stretch: Ints,
    at: tuple[Ints, Floats],
    known: tuple[PlacedTool, Ints] | None = None,
) -> PlacedTool:
    """The commands ``at`` motions (S,) of a program's ``path`` and shares (S,) of these; ``stretch`` (S,): which of the
    original's each of them runs, ascending, in the order of the path.  ``known``: commands that are placed already, and
    their numbers among the S; solved again is what is found from another place among more commands."""
    motion, share = at
    placed = PlacedTool.empty(len(motion))
    if known is not None:
        placed.put(known[1], known[0])
    unknown = np.flatnonzero(np.isnan(placed.guess))

    def fill_command(block: slice) -> None:
        some = unknown[block]
        placed.command[some] = path.at(motion[some], share[some]).position

    each_block(fill_command, len(unknown))
    guess, between = _between_known(placed, stretch, known)
    asked = np.flatnonzero(~between)
    if len(asked):
        interval, part = track_commands(grid, stretch[asked], placed.command[asked])
        guess[asked] = interval + part
    interval = np.minimum(guess.astype(np.int64), grid.first[stretch + 1] - 2)
    part = guess - interval
    todo = np.flatnonzero(~placed.settled | ~(np.abs(guess - placed.guess) <= SAME_GUESS))
    low, high = grid.first[stretch], grid.first[stretch + 1] - 2

    def solved(some: Ints, interval: Ints, part: Floats, beside: bool = False) -> PlacedTool:
        there = path.at(motion[some], share[some])
        came = None if path.sides is None else path.sides.at(motion[some], share[some])
        here = _Solution(grid, path.task, motion[some], share[some], there, came, low[some], high[some])
        if beside:
            here.find_beside(interval + part)
        else:
            here.find(interval, part)
        here.turn_on_the_spot()
        row, share_there = grid.place(here.interval, here.part)
        wanted = grid.path.at(row, share_there).rotation
        turn = lengths(judged(grid.original, row, wanted, here.turn))
        arc = grid.along(here.interval, here.part)
        place = here.interval + here.part
        own = (row, share_there, arc, here.error, turn, here.force, here.settled)
        return PlacedTool(*own, here.tool, there.position, guess[some], place)

    def solve_block(block: slice) -> None:
        some = todo[block]
        placed.put(some, solved(some, interval[some], part[some]))

    each_block(solve_block, len(todo))
    # of the original alone, which nothing is judged by, that would take a third of the time
    for _ in range(WALKS if path is not grid.path else 0):
        walked = False
        for some, place in _beside_leaps(placed, stretch):
            start = np.minimum(place.astype(np.int64), high[some])
            other = solved(some, start, place - start, beside=True)
            size, new = lengths(placed.error[some]), lengths(other.error)
            nearer = np.flatnonzero(other.settled & (~placed.settled[some] | (new < size - RESIDUAL)))
            placed.put(some[nearer], other.at(nearer))
            walked |= len(nearer) > 0
        if not walked:  # where it leaps now both sides are as near
            break
    return placed


def _between_known(
    placed: PlacedTool, stretch: Ints, known: tuple[PlacedTool, Ints] | None
) -> tuple[Floats, Bools]:
    """(S,) places of the commands on those stretches on which the commands that are placed already go on along the
    path as they go on themselves: their own, and of others those in between; and which (S,) are on such."""
    guess, step = placed.guess.copy(), np.append(0.0, lengths(np.diff(placed.command, axis=0)))
    if known is None:
        return guess, np.zeros(len(guess), bool)
    own, gone = np.sort(known[1]), np.cumsum(step)
    same = stretch[own[1:]] == stretch[own[:-1]]
    arc, moved = np.diff(placed.arc[own]), np.diff(gone[own])
    even = (np.abs(arc) <= LEAP * moved + LEAST_LEAP) & placed.settled[own[1:]] & placed.settled[own[:-1]]
    between = ~np.isin(stretch, stretch[own[1:][same & ~even]])
    new = np.flatnonzero(between & np.isnan(guess))
    after = np.searchsorted(own, new)
    inside = (after > 0) & (after < len(own))
    ends = own[np.clip(np.stack([after - 1, after]), 0, len(own) - 1)]
    inside &= (stretch[ends] == stretch[new]).all(axis=0)
    between &= ~np.isin(stretch, stretch[new[~inside]])
    share = (gone[new] - gone[ends[0]]) / np.maximum(gone[ends[1]] - gone[ends[0]], 1e-12)
    guess[new] = placed.place[ends[0]] + share * (placed.place[ends[1]] - placed.place[ends[0]])
    return guess, between


def _beside_leaps(placed: PlacedTool, stretch: Ints) -> Iterator[tuple[Ints, Floats]]:
    """Commands (K,) before and after those at which the place leaps on, and the place (K,) on the other side of the
    leap: of two places at which the path is square to the tool, the nearer one counts."""
    step = lengths(np.diff(placed.command, axis=0))
    leaps = np.flatnonzero((np.diff(placed.arc) > LEAP * step + LEAST_LEAP) & (stretch[1:] == stretch[:-1]))
    for side in (0, 1):
        away = np.arange(BESIDE)
        beside = leaps[:, None] + (1 + away if side else -away)
        at = np.clip(beside, 0, len(stretch) - 1)
        other = np.broadcast_to(placed.place[leaps + (1 - side)][:, None], at.shape)
        same = (beside == at) & (stretch[at] == stretch[leaps][:, None])
        some, first = np.unique(at[same], return_index=True)
        if len(some):
            yield some, other[same][first]


def judged(original: CompensationProblem, rows: Ints, rotation: Floats, turn: Floats) -> Floats:
    """(K, 3) [rad]: ``turn`` (K, 3) of tools at ``rotation`` (K, 3, 3), without what the text of ``rows`` (K,) cannot
    state: a turn about the tool's own axis where that is free, all of it where the orientation comes from outside.  A
    motion that keeps the orientation before it has to keep the right one."""
    path = original.toolpath
    free = np.nan_to_num(path.orientation_control.redundant_axis[rows])
    if free.any():
        axis = (rotation @ free[..., None])[..., 0]
        turn = turn - np.sum(turn * axis, axis=1, keepdims=True) * axis
    stated = path.constraints.orientation_programmed[rows] | path.keeps_orientation[rows]
    return np.where(stated[:, None], turn, 0.0)


class _Solution:
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
        """``came`` (S, n): on which side of their gaps the axes lie, None where nothing asks."""
        self.came = came
        self.grid, self.task, self.motion, self.share, self.command = grid, run, motion, share, command
        self.low, self.high = low, high
        count = len(motion)
        self.error, self.turn, self.tool = np.full((3, count, 3), np.nan)
        self.force, self.settled = np.full(count, np.nan), np.zeros(count, bool)
        self.step = np.zeros(count)
        self.q: Floats | None = None
        self.displacement = np.zeros((0, 0))

    def find(self, interval: Ints, part: Floats) -> None:
        """From places nearby: Newton's steps, and a bracket where these do not come to rest."""
        self.interval, self.part = interval.copy(), part.copy()
        active = np.arange(len(interval))
        for _ in range(STEPS):
            some = np.isfinite(self._ahead(active)) & ~self.settled[active]
            active = active[some]
            if not len(active):
                return
            self._step(active)
        self._bracket(active, interval[active])

    def find_beside(self, place: Floats) -> None:
        """From ``place`` (S,), numbers of intervals with their parts after the point, the next place in the direction
        in which the tool is off it: no step leads over one."""
        active = np.arange(len(place))
        self.interval, self.part = np.zeros(len(place), np.int64), np.zeros(len(place))
        ahead = self._at(active, place)
        way = np.sign(ahead)
        near, far, there = place.copy(), place.copy(), ahead.copy()
        going = ~self.settled & np.isfinite(ahead)
        for step in STRIDES:
            some = np.flatnonzero(going)
            if not len(some):
                break
            far[some] = np.clip(near[some] + step * way[some], self.low[some], self.high[some] + 1)
            there[some] = self._at(some, far[some])
            passed = there[some] * way[some] <= 0
            on = some[~passed]
            near[on], ahead[on] = far[on], there[on]
            going[some[passed | ~np.isfinite(there[some])]] = False
        some = np.flatnonzero(~self.settled & np.isfinite(there) & (there * way <= 0))
        forth = way[some] > 0
        ends = (
            (np.where(forth, a[some], b[some]), np.where(forth, b[some], a[some]))
            for a, b in ((near, far), (ahead, there))
        )
        (below, above), (one, two) = ends
        self._between(some, below, above, one, two)

    def turn_on_the_spot(self) -> None:
        """Where a motion of the original only turns the tool, all of its path is one place: there the orientation shows
        how far it is gone."""
        grid = self.grid
        if not grid.on_the_spot.any():
            return
        row, share = grid.place(self.interval, self.part)
        distance = grid.original.desired_path.length[row] * np.stack([1 - share, share])
        turning = np.full(len(row), -1)
        for candidate, near in (
            (row + 1, distance[0] < 100 * SPOT),
            (row - 1, distance[1] < 100 * SPOT),
            (row, True),
        ):
            inside = (candidate >= grid.row[self.low]) & (candidate <= grid.row[self.high])
            matches = inside & near & grid.on_the_spot[np.clip(candidate, 0, len(grid.on_the_spot) - 1)]
            turning = np.where(matches, candidate, turning)
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
            going = ~self.settled[active] & np.isfinite(ahead)
            active, side = active[going], side[going]
            below, above, one, two = (values[going] for values in (below, above, one, two))

    def _at(self, active: Ints, place: Floats) -> Floats:
        """How far the tools are ahead of these places: numbers of intervals, with their parts after the point."""
        self.interval[active] = np.minimum(np.floor(place).astype(np.int64), self.high[active])
        self.part[active] = place - self.interval[active]
        return self._ahead(active)
