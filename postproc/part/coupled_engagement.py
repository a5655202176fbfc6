"""What a program cuts as it is posted, with a robot that yields: engagement, force and displacement of every place
solved together, in the order of the program, each in the stock that the displaced tools before it left.

Without a correction the robot yields, cuts less, and the force falls; what remains is cut by later passes.  The model
is linear in the wrench near the one that it is evaluated at; it is evaluated again at the solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import lengths, turned
from postproc.base.units import DEG, MM
from postproc.compensation.mirror import pose_error
from postproc.compensation.subdivision import Subdivision
from postproc.part.deflected_sweeps import axes_of, tips_of
from postproc.part.displacement import Displacements
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.coupled import AS_STRAIGHT, UNSETTLED, solve_pieces
from postproc.process.stock.coupled_pieces import Nodes, Pieces
from postproc.process.stock.displaced import displaced_rows
from postproc.process.stock.distance import ANGLE, CUTTER, MODE, ROW, TURN
from postproc.process.stock.engagement import laws_of, profiles_of
from postproc.process.stock.simulation import StockRun

MOST_PIECES = 300_000

SPACING, FINER = 0.5, 4
"""Radii of the cutter between two places, and how many times closer they are where the nominal cut changes."""

CLOSE, AFTER, BEFORE = 0.25 * MM, 2 * MM, 1 * MM
"""Places are as close near a vertex at which the path turns, up to so far after it and before it: there the tool turns
over some tenths of a millimetre."""

INSERTED = 0.5 * MM
"""Places are as close between points that the correction inserts."""

ENOUGH = 0.5e-6
"""[m] The linear displacement differs from that of the model by less at the solution."""

_APART, _FAR = 1e-6, 3 * MM
"""[m] Places that are closer are one; inserted points that are farther apart have the usual places between."""

_STEP, _LEVER = 10.0, 0.05
"""[N] by which the wrench is varied, and [m] by which moments are."""

_JOINED, _SAME_WAY = 1e-9, 3 * DEG
"""[m, rad] Motions that join as closely, with the spindle, go on under the force with which the one before ends; where
the feed turns by more there is a vertex."""

_ROUNDS = 3
_ATTEMPTS, _NEARER = 8, 4
_SURE, _LEAST, _MOST = 1.3, 0.3 * MM, 10 * MM
"""By how far the solution may be from the displacements for which the sweeps near each cell are listed."""


class Paths(NamedTuple):
    """Sweeps that may reach the part, ``rows`` (M, ROW), of motions (M,) and shares (M, 2) of these; which (M,): their
    cutter; number (M,): which of the sweeps of the program each is."""

    rows: Floats
    motion: Ints
    share: Floats
    which: Ints
    number: Ints


@dataclass(frozen=True, eq=False)
class CoupledEngagement:
    """Wrenches of a program as posted, solved at K places with its displacement.

    key (K,): twice the motion plus the share of its path, ascending; wrench (K, 6) [N, N m] in path axes; area (K,)
    [m2] removed across the feed; residual [m]: the largest difference between both displacements; pieces: the sweeps
    from one place to the next; unsettled (U,): motions with a place at which both differ by more than ``UNSETTLED``.
    """

    key: Floats
    wrench: Floats
    area: Floats
    residual: float
    pieces: Paths
    unsettled: Ints

    def along(self, motion: Ints, share: Floats) -> Floats:
        """(K, 6) [N, N m] the wrench at the shares (K,) of motions (K,); zero where nothing was solved."""
        at = 2.0 * motion + share
        # from the right: the start of a motion belongs to it, not to the end of the one before
        after = np.clip(np.searchsorted(self.key, at, side="right"), 1, len(self.key) - 1)
        low, high = self.key[after - 1], self.key[after]
        within = np.clip((at - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)[:, None]
        known = (np.floor(low / 2) == motion) & (at <= high + 1e-9)
        wrench = (1 - within) * self.wrench[after - 1] + within * self.wrench[after]
        return np.where(known[:, None], wrench, 0.0)

    @property
    def largest(self) -> float:
        """[N] the largest force."""
        return float(lengths(self.wrench[:, :3]).max(initial=0.0))


class PlacedPieces(NamedTuple):
    """P pieces of sweeps in their order, and the K places at their ends.

    rows (P, ROW), owner (P,): whose sweep each is a part of; motion (P,), share (P, 2): of the path of the motion;
    fresh (P,): the piece does not start where the one before ends; start, end (P,): its places; at_motion, at_share
    (K,): of the places.
    """

    rows: Floats
    owner: Ints
    motion: Ints
    share: Floats
    fresh: Bools
    start: Ints
    end: Ints
    at_motion: Ints
    at_share: Floats

    @staticmethod
    def of(paths: Paths, rows: Floats, owner: Ints, part: Floats) -> PlacedPieces:
        """Pieces ``rows`` (P, ROW) of the sweeps ``owner`` (P,), from and to the shares ``part`` (P, 2) of these."""
        motion, whole = paths.motion[owner], paths.share[owner]
        share = whole[:, :1] + part * (whole[:, 1:] - whole[:, :1])
        fresh = _starts(rows, motion, share)
        # a place at the end of every piece, and one at the start of those that are fresh
        end = np.cumsum(fresh + 1) - 1
        start = np.where(fresh, end - 1, np.append(0, end[:-1]))
        count = int(end[-1]) + 1
        at_motion, at_share = np.zeros(count, np.int64), np.zeros(count)
        at_motion[end], at_share[end] = motion, share[:, 1]
        at_motion[start[fresh]], at_share[start[fresh]] = motion[fresh], share[fresh, 0]
        return PlacedPieces(rows, owner, motion, share, fresh, start, end, at_motion, at_share)


class Expected(NamedTuple):
    """Displacements (K, 6) near which the solution is looked for, by how far it may be from them [m], and whether (1 or
    0) the wrenches of the nodes are near it, as of ``Pieces``."""

    displacement: Floats
    slack: float
    known: int


def solve_coupled(
    run: StockRun, paths: Paths, displaced: Displacements, lever: float
) -> CoupledEngagement | str:
    """The engagement of ``paths`` with tools that ``displaced`` says, or why it is not known."""
    task = displaced.task
    rows, owner, part = _pieces(run, paths, displaced.division, lever)
    if len(rows) > MOST_PIECES:
        return f"the program has {len(rows)} places to solve, at most {MOST_PIECES} are"
    pieces = PlacedPieces.of(paths, rows, owner, part)
    at_motion, at_share = pieces.at_motion, pieces.at_share
    count = len(at_motion)

    wrench, to_stock = task.force.along(at_motion, at_share), displaced.to_stock(at_motion)
    # a correction brings the tool near to the nominal engagement, whose wrenches these are
    slack, solved, known = _LEAST, None, int(displaced.division is not None)
    residual = np.zeros(count)
    for _ in range(_ROUNDS):
        base, slope = _linear(displaced, at_motion, at_share, wrench, to_stock)
        if not (np.isfinite(base).all() and np.isfinite(slope).all()):
            return "the displacement of the tool is not known at all places"
        guess = _rotated(to_stock, wrench)
        for attempt in range(_ATTEMPTS):
            listed = base + np.einsum("kij,kj->ki", slope, guess)
            solved = Nodes(base, slope, np.ascontiguousarray(guess), residual, np.zeros(count))
            _solve(run, paths, pieces, solved, Expected(listed, slack, known), lever)
            guess, known = solved.wrench, 1
            moved = base + np.einsum("kij,kj->ki", slope, guess)
            if _farthest(moved - listed, lever) <= slack:
                break
            # around this solution the next lists are shorter than with as much slack as it would have needed
            slack = _LEAST if attempt < _NEARER else min(_SURE * _farthest(moved - listed, lever), _MOST)
        wrench = _rotated(np.swapaxes(to_stock, 1, 2), guess)
        exact = _displacements(displaced, at_motion, at_share, wrench, to_stock)
        if _farthest(exact - moved, lever) <= ENOUGH:
            break
    assert solved is not None
    key, wrench, area = _by_motion(pieces, wrench, solved.area)
    swept = Paths(rows, pieces.motion, pieces.share, paths.which[owner], paths.number[owner])
    unsettled = np.unique(at_motion[solved.residual > UNSETTLED])
    return CoupledEngagement(key, wrench, area, float(solved.residual.max()), swept, unsettled)


def _pieces(
    run: StockRun, paths: Paths, division: Subdivision | None, lever: float
) -> tuple[Floats, Ints, Floats]:
    """Rows (P, ROW) of the pieces of sweeps, whose they are (P,), and their parts (P, 2)."""
    length = run.sweeps.length[paths.number]
    radius = np.array([cutter.radius for cutter in run.sweeps.cutters])[paths.which]
    uneven = np.isin(paths.number, run.engagement.uneven)
    even = np.maximum(np.ceil(length * np.where(uneven, FINER, 1) / (SPACING * radius)), 1).astype(np.int64)
    points = [_steps(np.zeros(len(length)), np.ones(len(length)), even)]
    start, end = find_vertices(paths)
    reach = length / np.maximum(length, 1e-12)
    for at, low, high in (
        (start, np.zeros(len(length)), np.minimum(AFTER / np.maximum(length, 1e-12), reach)),
        (end, np.maximum(1.0 - BEFORE / np.maximum(length, 1e-12), 0.0), np.ones(len(length))),
    ):
        count = np.ceil((high - low) * length / CLOSE).astype(np.int64)
        points.append(_steps(low, high, np.where(at, count, 0)))
    if division is not None:
        points.append(_inserted(paths, length, division))
    owner, part = (np.concatenate(values) for values in zip(*points, strict=True))
    order = np.lexsort((part, owner))
    owner, part = owner[order], part[order]
    # places that are as good as one are one, of which the ends of a sweep stay
    kept = (part == 0.0) | (part == 1.0)
    inner = np.minimum(part, 1.0 - part) * length[owner] > _APART
    kept |= inner
    owner, part = owner[kept], part[kept]
    new = np.append(True, (owner[1:] != owner[:-1]) | ((part[1:] - part[:-1]) * length[owner[1:]] > _APART))
    new |= (part == 1.0) & np.append(True, part[:-1] != 1.0)
    owner, part = owner[new], part[new]
    first = np.flatnonzero(owner[1:] == owner[:-1])
    owner, part = owner[first], np.stack([part[first], part[first + 1]], axis=1)
    none = np.zeros((len(owner), 6))
    rows = displaced_rows(paths.rows[owner], part, none, none, lever)
    same = ~rows[:, TURN : TURN + 3].any(axis=1) | (paths.rows[owner, ANGLE] > 0)
    rows[same, MODE] = paths.rows[owner[same], MODE]
    return rows, owner, part


def _steps(low: Floats, high: Floats, count: Ints) -> tuple[Ints, Floats]:
    """The sweeps (K,) and the shares (K,) of them that divide those from ``low`` to ``high`` (M,) by ``count`` (M,)."""
    many = np.where(count > 0, count + 1, 0)
    owner = np.repeat(np.arange(len(count)), many)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(many) - many, many)
    share = place / np.maximum(count, 1)[owner]
    part = low[owner] + share * (high - low)[owner]
    return owner, np.where(share == 1.0, high[owner], part)


def _inserted(paths: Paths, length: Floats, division: Subdivision) -> tuple[Ints, Floats]:
    """Where the correction has points inside of the sweeps, and close places between those."""
    own = np.flatnonzero(~division.transitions & (division.share > 0.0) & (division.share < 1.0))
    at = (division.source + division.share)[own]
    low = paths.motion + paths.share[:, 0]
    wide = np.maximum(paths.share[:, 1] - paths.share[:, 0], 1e-12)
    sweeps, parts = [np.zeros(0, np.int64)], [np.zeros(0)]
    first, last = np.searchsorted(at, low), np.searchsorted(at, low + wide)
    for k in np.flatnonzero(last > first).tolist():
        ends = np.concatenate([[0.0], (at[first[k] : last[k]] - low[k]) / wide[k], [1.0]])
        for begin, stop in pairwise(ends):
            far = (stop - begin) * length[k]
            count = int(np.ceil(far / INSERTED)) if far < _FAR else 1
            parts.append(np.linspace(begin, stop, count + 1))
            sweeps.append(np.full(count + 1, k))
    return np.concatenate(sweeps), np.clip(np.concatenate(parts), 0.0, 1.0)


def find_vertices(paths: Paths) -> tuple[Bools, Bools]:
    """(M,) sweeps that start, and that end, where the path turns inside of a cut."""
    rows = paths.rows
    goes_on = _joined(rows, rows[:, CUTTER])
    count = len(rows)
    turns = goes_on & (_cosine(_directions(rows, 1.0)[:-1], _directions(rows, 0.0)[1:]) < np.cos(_SAME_WAY))
    start, end = np.zeros(count, bool), np.zeros(count, bool)
    start[1:], end[:-1] = turns, turns
    return start, end


def _joined(rows: Floats, tool: Floats) -> Bools:
    """(P - 1,) sweeps ``rows`` (P, ROW) that end where the next one starts, with the same tool and spindle axis."""
    one = np.ones(len(rows) - 1)
    joined = lengths(tips_of(rows[1:], 0 * one) - tips_of(rows[:-1], one)) < _JOINED
    axis = _cosine(axes_of(rows[:-1], one), axes_of(rows[1:], 0 * one))
    return np.asarray(joined & (tool[1:] == tool[:-1]) & (axis > np.cos(_SAME_WAY)))


def _directions(rows: Floats, share: float) -> Floats:
    """(P, 3) the direction of the tip at ``share`` of sweeps, by a small step of them."""
    step = 1e-4 if share == 0.0 else -1e-4
    ends = [tips_of(rows, np.full(len(rows), at)) for at in (share, share + step)]
    return np.asarray((ends[1] - ends[0]) * np.sign(step))


def _cosine(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.sum(one * other, axis=1) / np.maximum(lengths(one) * lengths(other), 1e-30))


def _starts(rows: Floats, motion: Ints, share: Floats) -> Bools:
    """(P,) pieces that do not go on where the one before ends."""
    fresh = np.ones(len(rows), bool)
    within = (motion[1:] == motion[:-1]) & (np.abs(share[1:, 0] - share[:-1, 1]) < 1e-9)
    fresh[1:] = ~(within | _joined(rows, rows[:, CUTTER]))
    return fresh


def _linear(
    displaced: Displacements, motion: Ints, share: Floats, wrench: Floats, to_stock: Floats
) -> tuple[Floats, Floats]:
    """base (K, 6) and slope (K, 6, 6) of the displacement about ``wrench`` (K, 6), which is in path axes, as of
    ``Nodes``."""
    here = _displacements(displaced, motion, share, wrench, to_stock)
    slope = np.empty((len(motion), 6, 6))
    back = np.swapaxes(to_stock, 1, 2)
    for k in range(6):
        step = np.zeros(6)
        step[k] = _STEP if k < 3 else _STEP * _LEVER
        varied = wrench + _rotated(back, np.broadcast_to(step, wrench.shape))
        slope[:, :, k] = (_displacements(displaced, motion, share, varied, to_stock) - here) / step[k]
    in_stock = _rotated(to_stock, wrench)
    return here - np.einsum("kij,kj->ki", slope, in_stock), slope


def _displacements(
    displaced: Displacements, motion: Ints, share: Floats, wrench: Floats, to_stock: Floats
) -> Floats:
    """(K, 6) shift [m] and turn [rad] of the tool in the axes of the stock under ``wrench`` (K, 6) in path axes; zero
    where the path is not known."""
    moved = np.zeros((len(motion), 6))
    known = np.flatnonzero(displaced.traceable[motion])

    def look(part: slice) -> None:
        at = known[part]
        real, goal = displaced.predicted(motion[at], share[at], wrench[at])
        pair = [turned(to_stock[at], one) for one in pose_error(real.pose, goal)]
        moved[at] = np.where((real.reachable & real.settled)[:, None], np.hstack(pair), np.nan)

    each_block(look, len(known))
    return moved


def _rotated(rotation: Floats, wrench: Floats) -> Floats:
    """(K, 6) wrenches turned by ``rotation`` (K, 3, 3)."""
    return np.hstack([turned(rotation, wrench[:, :3]), turned(rotation, wrench[:, 3:])])


def _farthest(moved: Floats, lever: float) -> float:
    """[m] by how far a place within ``lever`` [m] of the tip is displaced at most by ``moved`` (K, 6)."""
    return float((lengths(moved[:, :3]) + lever * lengths(moved[:, 3:])).max(initial=0.0))


def _solve(
    run: StockRun, paths: Paths, pieces: PlacedPieces, nodes: Nodes, expected: Expected, lever: float
) -> None:
    """``nodes`` solved, near what is ``expected``."""
    rows, start, end = pieces.rows, pieces.start, pieces.end
    sweeps, before = run.sweeps, run.before
    cutters = run.engagement.stock.cutters
    earlier = np.zeros((0, ROW)) if before is None else run.engagement.stock.sweeps[: len(before.rows)]
    whole = np.broadcast_to([0.0, 1.0], (len(rows), 2))
    listed = expected.displacement
    near = displaced_rows(rows, whole, listed[start], listed[end], lever, AS_STRAIGHT)
    every = np.ascontiguousarray(np.concatenate([earlier, near]))
    stock, live = build_stock(run.blank, every, cutters, slack=expected.slack)
    number = paths.number[pieces.owner]
    laws = laws_of(sweeps, run.toolpath, run.process.edges)[number]
    solve_pieces(
        stock,
        profiles_of(sweeps.cutters),
        Pieces(
            np.ascontiguousarray(rows),
            np.ascontiguousarray(laws),
            np.ascontiguousarray(live[len(earlier) :]),
            np.ascontiguousarray(sweeps.heading[number]),
            start.astype(np.int64),
            end.astype(np.int64),
            pieces.fresh.astype(np.int64),
            len(earlier),
            expected.known,
        ),
        nodes,
        lever,
    )


def _by_motion(pieces: PlacedPieces, wrench: Floats, area: Floats) -> tuple[Floats, Floats, Floats]:
    """Keys, wrenches and areas of the places, with the start of motions that go on from the one before."""
    motion = pieces.motion
    more = np.flatnonzero(~pieces.fresh & np.append(True, motion[1:] != motion[:-1]))
    key = np.concatenate(
        [2.0 * pieces.at_motion + pieces.at_share, 2.0 * motion[more] + pieces.share[more, 0]]
    )
    order = np.argsort(key, kind="stable")
    index = np.concatenate([np.arange(len(pieces.at_motion)), pieces.start[more]])[order]
    return key[order], wrench[index], area[index]
