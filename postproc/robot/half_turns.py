"""How far A1, A4 and A6 of a KUKA-type arm turn from one motion to the next.

Between two postures an axis has turned by the difference of its angles and any number of whole turns; the kind
of motion decides: on a path motion the axes follow the pose continuously, in a PTP each takes the shorter turn.  Where
a path motion turns the tool by half a turn, both senses are equally short and rounding would decide.  The program has
run: of two senses the one is taken that keeps all axes within their limits until a motion states its axes or its T;
where both do, the one that leads through zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import (
    Poses,
    lengths,
    on_arc,
    turn_beside,
    turning,
    wrapped,
)
from postproc.base.units import DEG

TURNING = [0, 3, 5]
"""Axes of a KUKA-type arm that can make more than half a turn to either side: A1, A4, A6."""

HALF = 0.01 * DEG
"""A turn that is nearer to half a turn may go either way: written angles are rounded."""

EVEN = 1e-6
"""[rad] by which one of two senses must be shorter to be the short way; written angles differ by more, rounding by
less."""

LARGE = 30 * DEG
"""A pose cannot turn by half a turn while all six axes turn by less."""

WIDE = 90 * DEG
"""An axis that turns by more between two motions is followed through the motion."""

FINE = 60 * DEG
"""By so much an axis may turn between two looks at a way."""

DEEPEST = 10
"""A way is halved at most so many times; then the axis is at a singularity."""

_MOST_STATES = 16
_MARGIN = 1e-9


@dataclass(frozen=True)
class HalfTurns:
    """Path motions that turn the tool by half a turn: rows (H,) ascending, and vector (H, 3) [rad], by which each turns
    it in axes of the robot base."""

    rows: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    vector: Floats = field(default_factory=lambda: np.empty((0, 3)))

    def put(self, rows: Ints, turn: Floats) -> None:
        """Sets those of ``turn`` (K, 3) that belong to half turns among ``rows`` (K,)."""
        if len(self.rows):
            at = np.minimum(np.searchsorted(self.rows, rows), len(self.rows) - 1)
            half = self.rows[at] == rows
            turn[half] = self.vector[at[half]]


@dataclass(frozen=True, eq=False)
class PathMotions:
    """K path motions.  start, end: flange poses in the robot base; tool: on the flange; centre, normal (K, 3), sweep
    (K,): of arcs in the robot base, NaN for straight ones; along (K, 3) [rad]: by which the tool turns with its arc."""

    start: Poses
    end: Poses
    tool: Poses
    centre: Floats
    normal: Floats
    sweep: Floats
    along: Floats

    def __len__(self) -> int:
        return len(self.sweep)

    @cached_property
    def turn(self) -> Floats:
        """(K, 3) [rad] the shorter turn, in axes of the robot base, beside what the tool turns with its arc."""
        return turn_beside(self.start.rotation, self.end.rotation, self.along)

    @property
    def half(self) -> Bools:
        """(K,) both senses are equally short."""
        return np.asarray(lengths(self.turn) > np.pi - HALF)

    def __getitem__(self, rows: Ints) -> PathMotions:
        return PathMotions(
            self.start[rows],
            self.end[rows],
            self.tool[rows],
            self.centre[rows],
            self.normal[rows],
            self.sweep[rows],
            self.along[rows],
        )

    def flange(self, turn: Floats, share: Floats) -> Poses:
        """Flange poses (K) at the shares (K,) of the paths of the TCP, which turn evenly by ``turn`` (K, 3) [rad]."""
        start, end = self.start @ self.tool, self.end @ self.tool
        position = start.position + share[:, None] * (end.position - start.position)
        arcs = np.flatnonzero(np.isfinite(self.sweep))
        if len(arcs):
            position[arcs] = on_arc(
                start.position[arcs],
                end.position[arcs],
                self.centre[arcs],
                self.normal[arcs],
                self.sweep[arcs],
                share[arcs],
            )
        return Poses(turning(start.rotation, turn, self.along, share), position) @ self.tool.inverse()


Solve = Callable[[Ints, Poses], Floats]
"""Arm angles (K, 6) [rad] of places (K,) among the motions at flange poses (K); NaN where out of reach."""


def axis_travel(motions: PathMotions, turn: Floats, first: Floats, last: Floats, solve: Solve) -> Floats:
    """(K, 3) [rad] by how much A1, A4, A6 turn on paths that turn the tool by ``turn`` (K, 3); first, last (K, 6): the
    angles at their ends.  NaN where a path leads out of reach."""
    total = np.zeros((len(motions), 3))
    owner = np.arange(len(motions))
    low, high = np.zeros(len(owner)), np.ones(len(owner))
    here, there = first[:, TURNING], last[:, TURNING]
    for depth in range(DEEPEST + 1):
        step = wrapped(there - here)
        far = (np.abs(step) > FINE).any(axis=1) & (depth < DEEPEST)
        far |= depth < 2  # paths are looked at in four parts at least: a whole turn shows nothing at its ends
        near = np.flatnonzero(~far)
        np.add.at(total, owner[near], step[near])
        if not far.any():
            break
        owner, low, high, here, there = owner[far], low[far], high[far], here[far], there[far]
        share = 0.5 * (low + high)
        middle = solve(owner, motions[owner].flange(turn[owner], share))[:, TURNING]
        owner = np.repeat(owner, 2)
        low, high = (np.stack(pair, 1).ravel() for pair in ((low, share), (share, high)))
        here, there = (np.stack(pair, 1).reshape(-1, 3) for pair in ((here, middle), (middle, there)))
    return total


@dataclass(frozen=True)
class TurnChoices:
    """Motions that may turn in either sense: place (H,) ascending, and by how much the other one differs in A1, A4, A6:
    more (H, 3) [rad], whole turns."""

    place: Ints
    more: Floats


def turn_senses(
    motions: PathMotions, first: Floats, last: Floats, solve: Solve
) -> tuple[Floats, Floats, Floats, Bools]:
    """Steps (K, 3) of A1, A4, A6; what the other sense adds to them (K, 3); the rotation vectors of both (K, 2, 3); and
    which motions (K,) may turn in either sense.

    The first of two senses is the shorter one, or where they are even the one that leads from angle to angle in
    (-pi, pi] without a whole turn, that is through zero.
    """
    turn, half = motions.turn, np.asarray(motions.half)
    step = axis_travel(motions, turn, first, last, solve)
    reaches: Bools = np.asarray(np.isfinite(step).all(axis=1))
    step = np.where(reaches[:, None], step, wrapped(last - first)[:, TURNING])
    more, vectors = np.zeros_like(step), np.stack([turn, turn], axis=1)
    rows = np.flatnonzero(half)
    if len(rows):
        size = lengths(turn[rows])
        back = turn[rows] * (1.0 - 2 * np.pi / size)[:, None]
        vectors[rows, 1] = back
        other = axis_travel(
            motions[rows], back, first[rows], last[rows], lambda at, poses: solve(rows[at], poses)
        )
        good: Bools = np.asarray(np.isfinite(other).all(axis=1))
        both = good & reaches[rows]
        through = signed(last[rows])[:, TURNING] - signed(first[rows])[:, TURNING]
        nearer = np.abs(other - through).sum(axis=1) < np.abs(step[rows] - through).sum(axis=1) - 1.0
        alone = good & ~reaches[rows]
        swap = ((np.pi - size < EVEN) & nearer & both) | alone
        more[rows[both]] = (other - step[rows])[both]
        at = rows[swap]
        step[at], more[at], vectors[at] = other[swap], -more[at], vectors[at][:, ::-1]
        more[rows[alone]] = 0.0
    return step, more, vectors, np.asarray(half)


def signed(angle: Floats) -> Floats:
    """Angles (...) [rad] in (-pi, pi], of ``angle`` (...), where rounding does not decide between the two."""
    value = wrapped(angle)
    return np.where(value < -np.pi + EVEN, value + 2 * np.pi, value)


def choose_senses(value: Floats, resets: Ints, choices: TurnChoices, low: Floats, high: Floats) -> Bools:
    """(H,) the choices that take the other sense.

    value (R, 3): A1, A4, A6 [rad] of R motions one after the other with the first sense everywhere; resets (Q,):
    motions that state their own, ascending from 0; low, high (3,): limits.
    """
    take = np.zeros(len(choices.place), np.bool_)
    bad = ((value < low - _MARGIN) | (value > high + _MARGIN)).any(axis=1)
    run = np.searchsorted(resets, choices.place, side="right")
    spoilt = np.unique(np.searchsorted(resets, np.flatnonzero(bad), side="right"))
    ends = np.append(resets, len(value))
    for one in spoilt[np.isin(spoilt, run)].tolist():
        among = np.flatnonzero(run == one)
        stop = int(ends[one]) if one < len(ends) else len(value)
        place = choices.place[among]
        lowest = np.minimum.reduceat(value[:stop], place, axis=0)
        highest = np.maximum.reduceat(value[:stop], place, axis=0)
        take[among] = _best(lowest, highest, choices.more[among], low, high)
    return take


def _best(lowest: Floats, highest: Floats, more: Floats, low: Floats, high: Floats) -> Bools:
    """(H,) which of H choices one after the other take the other sense, so that the least is beyond the limits.

    lowest, highest (H, 3): the range of the axes from each choice to the next; more (H, 3): what the other sense adds
    from there on.
    """
    turns = np.round(more / (2 * np.pi)).astype(int)
    states: dict[tuple[int, ...], float] = {(0, 0, 0): 0.0}
    trail: list[dict[tuple[int, ...], tuple[tuple[int, ...], bool]]] = []
    clear: dict[tuple[int, ...], int] = {}

    def excess(state: tuple[int, ...]) -> Floats:
        by = 2 * np.pi * np.array(state)
        under, over = low - (lowest + by), (highest + by) - high
        return np.asarray((np.maximum(under, 0) + np.maximum(over, 0)).sum(axis=1))

    excesses: dict[tuple[int, ...], Floats] = {}
    for at, turn in enumerate(turns.tolist()):
        following: dict[tuple[int, ...], float] = {}
        came: dict[tuple[int, ...], tuple[tuple[int, ...], bool]] = {}
        for state, cost in states.items():
            for other in (False, True):
                there = tuple(a + b for a, b in zip(state, turn, strict=True)) if other else state
                if there not in excesses:
                    excesses[there] = excess(there)
                    beyond = np.flatnonzero(excesses[there] > _MARGIN)
                    clear[there] = int(beyond[-1]) + 1 if len(beyond) else 0
                total = cost + 1e3 * float(excesses[there][at]) + 1e-6 * other
                if total < following.get(there, np.inf):
                    following[there], came[there] = total, (state, other)
        states = dict(sorted(following.items(), key=lambda item: item[1])[:_MOST_STATES])
        trail.append(came)
        if clear[next(iter(states))] <= at + 1:
            break  # nothing is beyond a limit from here on
    take = np.zeros(len(more), np.bool_)
    state = next(iter(states))
    for at in range(len(trail) - 1, -1, -1):
        state, take[at] = trail[at][state]
    return take
