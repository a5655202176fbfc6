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
from postproc.base.geometry import lengths
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.verification.path_grid import RESIDUAL, PathGrid
from postproc.verification.place_solution import PlaceSolution
from postproc.verification.run_path import RunPath
from postproc.verification.tracking import track_commands

SAME_GUESS = 1e-6
"""Parts of an interval by which two first places of a command differ by rounding alone."""

LEAP, LEAST_LEAP, BESIDE, WALKS = 4.0, 0.05 * MM, 24, 40
"""By how many times the step of the command, and how much [m], a place leaps at least; so many commands before and
after it are tried on its other side, and so often at most, from where it leaps then."""


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
        here = PlaceSolution(grid, path.task, motion[some], share[some], there, came, low[some], high[some])
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
    lost = np.isin(stretch, stretch[between & ~placed.settled])  # what lies between known places was no help
    if lost.any():
        again = np.flatnonzero(lost)
        interval[again], part[again] = track_commands(grid, stretch[again], placed.command[again])
        guess[again] = interval[again] + part[again]
        todo = again[~(np.abs(guess[again] - placed.guess[again]) <= SAME_GUESS)]
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
