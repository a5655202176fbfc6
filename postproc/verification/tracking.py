"""Where on the grid of the wanted path each command is, going on from the one before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import lengths
from postproc.base.units import MM
from postproc.verification.path_grid import PathGrid

REACH, MARGIN = 1.5, 2.0 * MM
"""How far from the last place the next one may be, besides the path of the command: so many times the largest
displacement of the tool, and this."""

STRIDE = 3.0 * MM
"""Of the path of the command, REACH times: places nearer to each other are all seen from the same last place, or many
of them would lead away step by step."""

_BLOCK = 128
"""Commands that are looked at together."""


def track_commands(grid: PathGrid, stretch: Ints, command: Floats) -> tuple[Ints, Floats]:
    """Interval and part of it (S,) of the grid in which each command (S, 3) is, going on from the one before;
    ``stretch`` (S,): that of the grid on which it is, ascending."""
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
        self.from_arc, self.gone = float(self.arc[0]), 0.0

    def run(self, command: Floats, interval: Ints, part: Floats) -> None:
        """Fills in ``interval`` and ``part`` (S,) of the commands (S, 3)."""
        step = np.append(0.0, REACH * lengths(np.diff(command, axis=0)))
        done = 0
        while done < len(command):
            block = slice(done, min(done + _BLOCK, len(command)))
            placed, share = self._locate(command[block], step[block])
            interval[done : done + len(placed)], part[done : done + len(placed)] = placed, share
            done += len(placed)

    def _locate(self, command: Floats, step: Floats) -> tuple[Ints, Floats]:
        """Of the commands (B, 3), or of the first of them whose path stays in view: of the intervals near the last
        place, where h changes from positive to negative, the one that the tool is nearest to."""
        begin = self.from_arc
        start = np.searchsorted(
            self.arc, [begin - 2 * self.reach, begin + 2 * self.reach + self.gone + step.sum()]
        )
        low, high = max(int(start[0]) - 1, 0), min(int(start[1]), self.last)
        some = self._candidates(command, low, high)
        least = -np.inf if low == 0 else float(self.arc[low])
        most = np.inf if high == self.last else float(self.arc[high + 1])
        first = np.searchsorted(some.row, np.arange(len(command) + 1)).tolist()
        arc, away, steps = some.arc.tolist(), some.away.tolist(), step.tolist()
        chosen: list[int] = []
        for row in range(len(command)):
            back, ahead = self.from_arc - self.reach, self.from_arc + self.reach + self.gone + steps[row]
            if row and (back < least or ahead > most):
                break
            best, nearest = -1, np.inf
            for number in range(first[row], first[row + 1]):
                if away[number] < nearest and back <= arc[number] <= ahead:
                    best, nearest = number, away[number]
            if best < 0:  # nowhere square to it: the solution will show
                if row:
                    break
                interval, share, place = self._node(command[:1], back, ahead)
                self._go_on(place, steps[0])
                return interval, share
            chosen.append(best)
            self._go_on(arc[best], steps[row])
        return some.interval[chosen], some.share[chosen]

    def _go_on(self, place: float, step: float) -> None:
        self.gone += step
        if self.gone >= STRIDE:
            self.from_arc, self.gone = place, 0.0

    def _candidates(self, command: Floats, low: int, high: int) -> _Candidates:
        """Where, in the intervals ``low`` to ``high``, the tools of the commands may be."""
        value = command @ self.tangent[low : high + 2].T - self.level[low : high + 2]
        is_behind = value < 0
        row, interval = np.nonzero(~is_behind[:, :-1] & is_behind[:, 1:])
        one, two = value[row, interval], value[row, interval + 1]
        share, interval = one / (one - two), interval + low
        # before the start and after the end of the stretch these are the places
        before = np.flatnonzero(is_behind[:, 0]) if low == 0 else np.zeros(0, np.int64)
        beyond = np.flatnonzero(~is_behind[:, -1]) if high == self.last else np.zeros(0, np.int64)
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
