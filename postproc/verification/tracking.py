"""Where on the grid of the wanted path each command is: the cheapest way through all places where it may be.

Of a command on its own the nearest place may be a wrong one: at the other side of a small arc, on the leg that the path
comes back on.  So all of them are kept, and a whole stretch decides (map matching as a shortest path, dynamic
programming over the candidates of each command; P. Newson and J. Krumm, 2009, doi 10.1145/1653771.1653818).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import lengths
from postproc.base.units import MM
from postproc.verification.path_grid import PathGrid

REACH, MARGIN = 1.5, 2.0 * MM
"""How far from the last place the next ones may be, besides the path of the commands: so many times the largest
displacement of the tool, and this.  How much farther than the commands a tool may go."""

SPAN, BLOCK = 60.0 * MM, 128
"""Path of the commands that are looked at together, and how many they are at most."""

LEAST_STEP = 0.02 * MM
"""Path that a command represents, at least: where the tool only turns, its distance still counts."""


def track_commands(grid: PathGrid, stretch: Ints, command: Floats) -> tuple[Ints, Floats]:
    """Interval and part of it (S,) of the grid in which each command (S, 3) is; ``stretch`` (S,): that of the grid on
    which it is, ascending."""
    interval, part = np.empty(len(command), np.int64), np.empty(len(command))
    start = np.flatnonzero(np.append(True, stretch[1:] != stretch[:-1])[: len(stretch)])
    for first, stop in zip(start, np.append(start[1:], len(command))[: len(start)], strict=True):
        low, high = int(grid.first[stretch[first]]), int(grid.first[stretch[first] + 1])
        tracking = _Tracking(grid, slice(low, high), command[first:stop])
        interval[first:stop], part[first:stop] = tracking.run()
        interval[first:stop] += low
    return interval, part


class _Tracking:
    """Goes with S commands along the J nodes of one stretch.

    A way through the candidates costs, per command: |how far it goes on along the path - how far the command goes on|,
    and the command's step x (its distance / the reach)^2; all [m].
    """

    def __init__(self, grid: PathGrid, nodes: slice, command: Floats) -> None:
        self.v, self.tangent, self.arc = grid.v[nodes], grid.tangent[nodes], grid.arc[nodes]
        self.level = np.sum(self.v * self.tangent, axis=1)
        self.reach = REACH * grid.farthest + MARGIN
        self.last = len(self.v) - 2
        self.command = command
        self.step = np.append(0.0, lengths(np.diff(command, axis=0)))
        self.chosen = np.zeros(len(command), np.int64)
        # where the last command may be, and what the cheapest way to there costs
        self.places, self.cost = [float(self.arc[0])], [0.0]
        self.open: list[tuple[int, list[int], list[int]]] = []

    def run(self) -> tuple[Ints, Floats]:
        """Interval and part of it (S,) of each command."""
        gone = np.cumsum(self.step)
        blocks: list[_Candidates] = []
        done = count = 0
        while done < len(gone):
            stop = int(np.searchsorted(gone, gone[done] + SPAN, side="right"))
            block = slice(done, min(stop, done + BLOCK))
            blocks.append(self._candidates(block))
            self._go_through(blocks[-1], block, count)
            done, count = block.stop, count + len(blocks[-1].row)
        self._decide()
        interval = np.concatenate([block.interval for block in blocks])
        share = np.concatenate([block.share for block in blocks])
        return interval[self.chosen], share[self.chosen]

    def _go_through(self, some: _Candidates, block: slice, count: int) -> None:
        """Chooses among the candidates of the commands of ``block``, ``count`` of those before."""
        first = np.searchsorted(some.row, np.arange(block.stop - block.start + 1))
        self.chosen[block] = count + first[:-1]
        is_open = np.diff(first) > 1
        asked = is_open | np.append(len(self.places) > 1, is_open[:-1])
        arc, step = some.arc.tolist(), self.step[block].tolist()
        weight = np.maximum(self.step[block], LEAST_STEP)[some.row]
        away = ((some.away / self.reach) ** 2 * weight).tolist()
        start = first.tolist()
        for row in np.flatnonzero(asked).tolist():
            if row and not is_open[row - 1]:
                self.places, self.cost = [arc[start[row - 1]]], [0.0]
            here = slice(start[row], start[row + 1])
            kept, came = self._go_on(arc[here], away[here], step[row])
            self.open.append((block.start + row, [count + start[row] + number for number in kept], came))
            if not is_open[row]:
                self._decide()
        if not is_open[-1]:
            self.places, self.cost = [arc[-1]], [0.0]

    def _go_on(self, places: list[float], away: list[float], step: float) -> tuple[list[int], list[int]]:
        """From the candidates of the command before to those at ``places`` (K,) [m]: which of these are kept, and from
        which of the former they come.  Not kept is what the cheapest one, gone on to there, is not dearer than: no
        cheapest way leads through it."""
        came, cost = [], []
        before = [place + step for place in self.places]
        for place, own in zip(places, away, strict=True):
            ways = [total + abs(place - one) for total, one in zip(self.cost, before, strict=True)]
            least = min(ways)
            came.append(ways.index(least))
            cost.append(least + own)
        least = min(cost)
        best = cost.index(least)
        kept = [
            number
            for number, total in enumerate(cost)
            if number == best or total < least + abs(places[number] - places[best])
        ]
        self.places, self.cost = [places[number] for number in kept], [cost[number] for number in kept]
        return kept, [came[number] for number in kept]

    def _decide(self) -> None:
        """Chooses the cheapest way of all open commands, from its end."""
        at = self.cost.index(min(self.cost))
        for command, kept, came in reversed(self.open):
            self.chosen[command] = kept[at]
            at = came[at]
        self.open.clear()

    def _candidates(self, block: slice) -> _Candidates:
        """Near the last place, where the tools of the commands of ``block`` may be: where h turns from positive to
        negative; where nothing is square to the tool, the nearest node, and the solution will show."""
        command = self.command[block]
        begin, end = min(self.places) - self.reach, max(self.places) + self.reach
        nodes = np.searchsorted(self.arc, [begin, end + REACH * self.step[block].sum()])
        low, high = min(max(int(nodes[0]) - 1, 0), self.last), min(int(nodes[1]), self.last)
        value = command @ self.tangent[low : high + 2].T
        value -= self.level[low : high + 2]
        is_behind = value < 0
        # of two dimensions at once it takes several times as long to look for what is true
        row, interval = np.divmod(np.flatnonzero(is_behind[:, :-1] < is_behind[:, 1:]), high + 1 - low)
        one, two = value[row, interval], value[row, interval + 1]
        share, interval = one / (one - two), interval + low
        # before the start and after the end of the stretch these are the places
        before = np.flatnonzero(is_behind[:, 0]) if low == 0 else np.zeros(0, np.int64)
        beyond = np.flatnonzero(~is_behind[:, -1]) if high == self.last else np.zeros(0, np.int64)
        has = np.zeros(len(command), bool)
        has[row] = has[before] = has[beyond] = True
        without = np.flatnonzero(~has)
        node = [low + int(np.argmin(lengths(at - self.v[low : high + 2]))) for at in command[without]]
        nearest = np.minimum(np.array(node, np.int64), self.last)
        row = np.concatenate([row, before, beyond, without])
        interval = np.concatenate(
            [interval, np.zeros(len(before), np.int64), np.full(len(beyond), self.last), nearest]
        )
        share = np.concatenate([share, np.zeros(len(before)), np.ones(len(beyond)), node - nearest])
        order = np.argsort(row, kind="stable")
        row, interval, share = row[order], interval[order], share[order]
        v = self.v[interval] + share[:, None] * (self.v[interval + 1] - self.v[interval])
        arc = self.arc[interval] + share * (self.arc[interval + 1] - self.arc[interval])
        return _Candidates(row, interval, share, arc, lengths(command[row] - v))


@dataclass(frozen=True, eq=False)
class _Candidates:
    """row (C,) ascending; interval, share of it, arc [m], and how far the tool is away [m]."""

    row: Ints
    interval: Ints
    share: Floats
    arc: Floats
    away: Floats
