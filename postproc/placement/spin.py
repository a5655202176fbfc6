"""The turn of a tool about its own axis along a path: the one that leaves the least error, and turns slowly.

The path is measured in ``allowance``: the angle [rad] that the tool may turn from its start to a place.  A turn
theta(a) is allowed where |theta(a) - theta(b)| <= |a - b|.  The largest error of the path becomes as small as such
turns permit (Bellman's recursion on a grid of angles, exact for a largest value; 1957, ISBN 0-691-07951-X); of all
turns with that largest error the recursion then takes one with small errors everywhere and little turning, and a moving
average bounds its second derivative.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import DEG
from postproc.model import StiffnessModel
from postproc.placement.part_motions import PartMotions
from postproc.placement.room import TOOL_TURN, Room
from postproc.placement.score_places import MAX, TURNING, Scoring, joint_margins, score_places

STEP = 5 * DEG
"""Of the grid of angles."""

MOST = 180 * DEG
"""The tool turns at most so far to each side."""

SAME = 1e-9
"""[rad] Angles that differ by less are the same."""

WINDOWS = ((40 * DEG, 2), (20 * DEG, 1), (10 * DEG, 1), (20 * DEG, 0), (10 * DEG, 0))
"""Allowances over which the moving average goes, with the ``spread`` of the turns, the smoothest first."""

TURNING_COST = 0.01
"""What a turn by one step of the grid counts beside the squared share of the largest error."""


@dataclass(frozen=True, eq=False)
class SpinScan:
    """What turned tools do at M places along a path: angle (K,) [rad] ascending, with 0 in its middle; error (K, M)
    [m] that is to become small, and size (K, M) [m] of the whole error, 0 at places that are not scored; feasible
    (K, M): within the margins."""

    angle: Floats
    error: NDArray[np.floating]
    size: NDArray[np.floating]
    feasible: Bools

    def take(self, places: Ints) -> SpinScan:
        """The places (L,) of them."""
        return SpinScan(self.angle, self.error[:, places], self.size[:, places], self.feasible[:, places])

    def finer(self, parts: int) -> SpinScan:
        """The same with so many parts of each step: errors linear between the angles, feasible where both ends are."""
        place = np.arange((len(self.angle) - 1) * parts + 1)
        low, high, share = (
            place // parts,
            -(-place // parts),
            (place % parts / parts)[:, None].astype(np.float32),
        )
        error, size = ((1 - share) * part[low] + share * part[high] for part in (self.error, self.size))
        angle = np.interp(place / parts, np.arange(len(self.angle)), self.angle)
        return SpinScan(angle, error, size, self.feasible[low] & self.feasible[high])

    def at(self, turn: Floats) -> tuple[Floats, Floats, bool]:
        """(M,) [m] error and size with the tool turned by ``turn`` (M,) [rad], between the angles linearly, and whether
        all are feasible."""
        place = (turn - self.angle[0]) / (self.angle[1] - self.angle[0])
        low = np.clip(np.floor(place).astype(np.int64), 0, len(self.angle) - 2)
        share, at = place - low, np.arange(len(turn))
        error, size = (
            (1 - share) * part[low, at] + share * part[low + 1, at] for part in (self.error, self.size)
        )
        fits = (self.feasible[low, at] | (share > 1 - SAME)) & (self.feasible[low + 1, at] | (share < SAME))
        return np.asarray(error), np.asarray(size), bool(fits.all())


def scan_spins(
    model: StiffnessModel,
    motions: PartMotions,
    room: Room,
    scoring: Scoring,
    place: Floats,
    step: float = STEP,
) -> SpinScan:
    """The errors and margins of all ``motions`` with the tool turned against its path, every ``step`` [rad], the part
    at ``place`` (6,).

    The turns of axes are followed from the posture of now, angle by angle: an axis does not jump by a turn.
    """
    side = round(MOST / step)
    angle = np.asarray(np.arange(-side, side + 1) * step, float)
    error = np.zeros((len(angle), len(motions)), np.float32)
    size = np.zeros_like(error)
    feasible = np.zeros((len(angle), len(motions)), np.bool_)
    whole = replace(scoring, objective=MAX)
    low, high = model.robot.limits.T
    turning = np.array([joint.kind == "revolute" for joint in model.robot.joints])
    for direction in (1, -1):
        before: Floats | None = None
        for k in range(side, len(angle)) if direction > 0 else range(side, -1, -1):
            there = place.copy()
            there[TOOL_TURN] -= angle[k]  # the path's orientation turns forth as a tool frame that turns back
            q, limit, singular = (part[0] for part in joint_margins(model, motions, there[None]))
            if before is not None:
                columns = list(TURNING)
                q[:, columns] -= 2 * np.pi * np.round((q[:, columns] - before[:, columns]) / (2 * np.pi))
            before = q
            free = np.minimum(q - low, high - q)[:, turning].min(axis=1)
            limit = np.where(np.isfinite(limit), free, limit)
            feasible[k] = (limit >= scoring.limit) & (singular >= scoring.singular)
            if k == side and direction < 0:
                continue
            for asked, values in ((scoring, error), (whole, size)):
                if asked is whole and scoring.objective == MAX:
                    size[k] = error[k]
                    continue
                scores = score_places(model, motions, room, asked, there[None], detailed=True)
                assert scores.error is not None
                values[k] = scores.error[0].mean(axis=1)
    return SpinScan(angle, np.asarray(error), np.asarray(size), feasible)


def plan_spin(
    scan: SpinScan, allowance: Floats, locked: Bools, most: Floats, window: float, spread: int
) -> Floats | None:
    """(M,) [rad] the turn of the tool at each place; None where no turn is feasible.

    allowance (M,) [rad], ascending: see above; locked (M,): places at which the tool does not turn; most (M,) [m]: no
    error becomes larger than this; window [rad] of the moving average; spread: steps of the grid to each side of the
    turn that are to be as good.
    """
    step = float(scan.angle[1] - scan.angle[0])
    nodes = _SpinNodes.of(allowance, step)
    still = len(scan.angle) // 2
    near = _widened(allowance, locked, 0.5 * window + step)
    allowed = scan.feasible & (scan.error <= most)
    allowed[still] = scan.feasible[still]
    allowed &= ~near | (np.arange(len(scan.angle)) == still)[:, None]
    cost = np.where(allowed, scan.error, np.inf)
    # an average over turns on both sides is no worse than these
    beside = maximum_filter1d(cost, 1 + 2 * spread, axis=0, mode="constant", cval=np.inf)
    cost = np.where((np.arange(len(scan.angle)) == still)[:, None], cost, beside)
    cost = np.maximum.reduceat(cost, nodes.first, axis=1).T
    level = _least_level(cost, nodes.gap)
    if not np.isfinite(level):
        return None
    chosen = _least_turning(np.where(cost <= level * (1 + 1e-9), cost, np.inf), nodes.gap, level)
    turn = nodes.smooth(scan.angle[chosen], allowance, window)
    return np.where(locked, 0.0, turn)


@dataclass(frozen=True, eq=False)
class _SpinNodes:
    """Places that lie within one step of allowance: first (N,) place of each; gap (N - 1,) steps to the next one;
    middle (N,) [rad] allowance; step [rad]."""

    first: Ints
    gap: Ints
    middle: Floats
    step: float

    @staticmethod
    def of(allowance: Floats, step: float) -> _SpinNodes:
        cell = np.floor(allowance / step).astype(np.int64)
        _, first = np.unique(cell, return_index=True)
        return _SpinNodes(first, np.diff(cell[first]), np.asarray((cell[first] + 0.5) * step, float), step)

    def smooth(self, turn: Floats, allowance: Floats, window: float) -> Floats:
        """(M,) ``turn`` (N,) at the places, averaged over ``window`` [rad] of allowance."""
        fine = self.step / 5
        count = int(np.ceil((self.middle[-1] - self.middle[0]) / fine)) + 1
        even = self.middle[0] + np.arange(count) * fine
        averaged = uniform_filter1d(
            np.interp(even, self.middle, turn), max(1, round(window / fine)), mode="nearest"
        )
        return np.asarray(np.interp(allowance, even, averaged))


def _widened(allowance: Floats, locked: Bools, by: float) -> Bools:
    """(M,) places that are within ``by`` [rad] of allowance of a ``locked`` one (M,)."""
    at = allowance[locked]
    if not len(at):
        return np.zeros(len(allowance), np.bool_)
    after = np.searchsorted(at, allowance)
    below = np.abs(allowance - at[np.maximum(after - 1, 0)])
    above = np.abs(at[np.minimum(after, len(at) - 1)] - allowance)
    return np.asarray(np.minimum(below, above) <= by)


def _least_level(cost: Floats, gap: Ints) -> float:
    """The least largest value of ``cost`` (N, K) along a sequence of angles that moves by at most ``gap`` (N - 1,)
    steps; infinite where there is none."""
    value = cost[0]
    away = _away(cost.shape[1])
    for own, steps in zip(cost[1:], gap, strict=True):
        value = np.maximum(own, np.where(away <= steps, value, np.inf).min(axis=1))
    return float(value.min())


def _least_turning(cost: Floats, gap: Ints, level: float) -> Ints:
    """(N,) the angles of the sequence with the least sum of squared errors, as shares of ``level``, and of squared
    turns."""
    away = _away(cost.shape[1])
    share = (cost / level if level > 0 else np.where(np.isfinite(cost), 0.0, np.inf)) ** 2
    value, came = share[0], np.zeros(cost.shape, np.int16)
    for k, steps in enumerate(gap, 1):
        via = np.where(away <= steps, value + TURNING_COST * away**2 / steps, np.inf)
        came[k] = via.argmin(axis=1)
        value = share[k] + via[np.arange(len(value)), came[k]]
    chosen = np.empty(len(cost), np.int64)
    chosen[-1] = value.argmin()
    for k in range(len(cost) - 1, 0, -1):
        chosen[k - 1] = came[k, chosen[k]]
    return chosen


def _away(count: int) -> Ints:
    """(K, K) steps between angles."""
    at = np.arange(count)
    return np.asarray(np.abs(at[:, None] - at))
