"""The place on the original's path that belongs to each command of a program, force and place solved together.

The place is the arc length at which the path is square to the way to the deflected tool, the tool being deflected by
the wrench of that very place: (x(c, F(s)) - g(s)) . g'(s) = 0, where that goes from ahead to behind as s grows, so that
a tool that is pushed ahead comes back.  Where several places do that, the way through all samples of a cut decides."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .force import Field
from .motion import MM
from .path import Path

GRID, POINTS = 0.02 * MM, 50_000
"""Steps in which places are looked for, larger where a cut would have more of them."""
NEARBY = 5.0 * MM
"""A tool this far from the path counts, along a stretch of it, as much as a jump along the path of the same length."""
MARCHES, ROUNDS, SMOOTH = 3, 8, 6
REACHES, CLOSE = (1.1, 3.3, 10.0, 30.0, 100.0), (0.5, 3.0, 10.0)
BETWEEN = (0.1, *CLOSE, 30.0)
FROM_GUESS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 6.0)
"""Steps of the grid to either side in which a place is looked for again, one after the other."""
SETTLED = 1e-10
APART, NEAREST, MOST = 0.01 * MM, 1e-7, 200_000
"""By how much more or less than the program the places of two samples beside each other may go on without samples
between them, how near these may come to each other [m], and how many there may be."""
BESIDE, OFF_GUESS, AROUND, PARTS, TRIED, WALKS = 0.05 * MM, 0.3 * MM, 1.0 * MM, 400, 3, 60
"""Where a place leaps there may be two: of samples so far around it all places across the leap, and so much beside it,
are looked for, on so many parts, and so many are tried; the leap goes on then to where both are as near, in so many
rounds at most."""

SPREAD = np.concatenate([side * 1e-8 * 2.0 ** np.arange(14) for side in (-1, 1)])
"""[m] Further places beside either side of a leap: two may be there close to each other."""


class Tools:
    """A program's commands at labels (S,) of one of its cuts, motions ``rows``, and the tool there under wrenches."""

    def __init__(self, path: Path, rows: tuple, label: np.ndarray, nodes: tuple) -> None:
        """nodes: labels and joint angles of ``Path.joints_at_nodes``."""
        motion, _ = path.find(label, *rows)
        position, rotation, outside = path.at(label, *rows)
        command, turned = path.in_robot(motion, position, rotation, outside)
        guess = np.stack([np.interp(label, nodes[0], nodes[1][:, j]) for j in range(6)], axis=1)
        self.robot, self.tool = path.robot, path.motions[rows[0]].tool
        self.q = self.robot.settle(command, turned, self.tool, guess)
        self._turns, self._places = path.frames(motion, outside)

    def own(self, wrench: np.ndarray) -> np.ndarray:
        """(S, 6) wrenches in the robot's axes of those in base axes."""
        return (wrench.reshape(-1, 2, 3) @ self._turns.swapaxes(1, 2)).reshape(-1, 6)

    def loaded(self, wrench: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tool (S, 3), (S, 3, 3) in the base and its compliance (S, 3, 6) under wrenches (S, 6) in base axes."""
        to_base = self._turns.swapaxes(1, 2)
        place, tilted, compliance = self.robot.rest(self.q, self.own(wrench), self.tool)
        gives = np.concatenate([to_base @ compliance[:, :3, k : k + 3] @ self._turns for k in (0, 3)], axis=2)
        return np.einsum("kij,kj->ki", to_base, place - self._places), to_base @ tilted, gives


def find_places(
    wanted: Path, cut: tuple, one: Field, label: np.ndarray, tools: Tools
) -> tuple[np.ndarray, np.ndarray]:
    """Labels (S,) on the cut of ``wanted`` that belong to the program's own ``label`` (S,), and which were not
    found."""
    loaded = tools.loaded
    low, high = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    share = (label - label[0]) / max(label[-1] - label[0], 1e-12)
    wrench = one.at(low + share * (high - low))
    for _ in range(MARCHES):
        there, _, gives = loaded(wrench)
        place = _march(wanted, cut, one, label, there, wrench, gives)
        place, lost = settle_places(wanted, cut, one, place, loaded)
        if not lost.any():
            break
        wrench = one.at(place)
    there, _, _ = loaded(one.at(place))
    # beside a corner places may have been looked for on the wrong side: those between the good ones are others
    away = np.linalg.norm(there - wanted.points(place, *cut), axis=1)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(away, SMOOTH, mode="edge"), 2 * SMOOTH + 1)
    good = ~lost & (away <= 2.0 * np.median(near, axis=1) + 1e-7)
    between = np.interp(label, label[good], place[good]) if good.any() else place
    other, still = settle_places(wanted, cut, one, between, loaded, CLOSE)
    nearer = ~still & (
        lost | (np.linalg.norm(loaded(one.at(other))[0] - wanted.points(other, *cut), axis=1) < away)
    )
    return np.where(nearer, other, place), lost & ~nearer


def settle_places(
    wanted: Path, cut: tuple, one: Field, place: np.ndarray, loaded: Callable, reaches: tuple = REACHES
) -> tuple[np.ndarray, np.ndarray]:
    """Labels (S,) near ``place`` at which the tool, under the wrench of that place, has the path square to it, and
    which were not found; ``loaded``: wrenches to the tool and its compliance."""
    for _ in range(ROUNDS):
        wrench = one.at(place)
        there, _, gives = loaded(wrench)
        found, lost = _refined(wanted, cut, one, place, there, wrench, gives, reaches)
        moved, place = np.abs(found - place).max(), found
        if moved < SETTLED:
            break
    return place, lost


def divided(
    wanted: Path, cut: tuple, one: Field, label: np.ndarray, place: np.ndarray, tools_at: Callable
) -> tuple[np.ndarray, np.ndarray]:
    """Labels and places (S,), with samples between those whose places go on by more or less than the program, by
    halves: until no two are ``APART``, or both sides of a leap are there.  ``tools_at``: ``Tools`` at labels."""
    missing = np.zeros(0)
    while len(label) < MOST:
        step = np.diff(label)
        k = np.flatnonzero((np.abs(np.diff(place) - step) > APART) & (step > NEAREST))
        more = np.setdiff1d(0.5 * (label[k] + label[k + 1]), missing)
        if not len(more):
            break
        there = beside_neighbours(wanted, cut, one, (label, place), more, tools_at(more))
        good = np.isfinite(there)
        missing = np.append(missing, more[~good])
        order = np.argsort(np.append(label, more[good]), kind="stable")
        label, place = np.append(label, more[good])[order], np.append(place, there[good])[order]
    return label, place


def beside_neighbours(
    wanted: Path, cut: tuple, one: Field, known: tuple[np.ndarray, np.ndarray], more: np.ndarray, tools: Tools
) -> np.ndarray:
    """The places (M,) of further labels (M,), ``tools`` theirs, between those of the ``known`` labels and places beside
    them; NaN where there is none."""
    label, place = known
    k = np.clip(np.searchsorted(label, more) - 1, 0, len(label) - 2)
    low, high = np.sort(np.stack([place[k], place[k + 1]]), axis=0)
    margin = (0.1 * (high - low) + 0.1 * APART)[:, None]
    between, middle = np.stack([low, high], axis=1), 0.5 * (low + high)
    return nearest_between(wanted, cut, one, middle, tools, between, margin, PARTS // 10)


def nearest_across_leaps(
    wanted: Path, cut: tuple, one: Field, label: np.ndarray, place: np.ndarray, tools_at: Callable
) -> np.ndarray:
    """The labels ``place`` (S,), with those of the nearer place where there are two."""
    place = place.copy()

    def away(rows: np.ndarray, tools: Tools, at: np.ndarray) -> np.ndarray:
        return np.linalg.norm(tools.loaded(one.at(at))[0] - wanted.points(at, *cut), axis=1)

    as_near: set[float] = set()
    for _ in range(WALKS):
        walked = False
        for k in np.flatnonzero(np.abs(np.diff(place) - np.diff(label)) > APART):
            if label[k] in as_near:
                continue
            rows = np.flatnonzero(np.abs(label - label[k]) < AROUND)
            tools = tools_at(label[rows])
            low, high = np.sort(place[k : k + 2])
            between = np.tile([low, high], (len(rows), 1))
            moved = False
            # under the force of either side too, as the tool is not linear in it
            for guess in (place[rows].copy(), np.full(len(rows), low), np.full(len(rows), high)):
                found = nearest_between(wanted, cut, one, guess, tools, between, BESIDE, PARTS)
                other = np.where(np.isfinite(found), found, place[rows])
                nearer = away(rows, tools, other) < away(rows, tools, place[rows]) - SETTLED
                place[rows] = np.where(nearer, other, place[rows])
                moved |= bool(nearer.any())
            walked |= moved
            if not moved:
                as_near.add(label[k])
        if not walked:
            break
    return place


def nearest_between(
    wanted: Path,
    cut: tuple,
    one: Field,
    place: np.ndarray,
    tools: Tools,
    between: np.ndarray,
    beside: float | np.ndarray,
    parts: int,
) -> np.ndarray:
    """Of all places between two labels (S, 2), and ``beside`` these [m], looked for on so many ``parts``, the nearest
    (S,) of each of the ``tools``, NaN without one; the forces of ``place`` (S,) are the first guess."""
    ends = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    low, high = np.clip(between + beside * np.array([-1.0, 1.0]), *ends).T
    sides = between.T
    wrench = one.at(place)
    there, _, gives = tools.loaded(wrench)
    size = max(1, 200_000 // parts)
    tried = np.full((TRIED, len(place)), np.nan)
    for first in range(0, len(place), size):
        rows = slice(first, first + size)
        even = np.linspace(low[rows], high[rows], parts + 1, axis=1)
        beside_sides = [side[rows, None] + SPREAD for side in sides]
        at = np.sort(np.concatenate([even, *beside_sides], axis=1), axis=1)
        at = np.clip(at, low[rows, None], high[rows, None])
        along = at.ravel()
        force = one.at(along).reshape(*at.shape, 6) - wrench[rows, None]
        beside = there[rows, None] + force @ gives[rows].swapaxes(1, 2)
        beside -= wanted.points(along, *cut).reshape(*at.shape, 3)
        ahead = (beside * wanted.direction(along, *cut).reshape(*at.shape, 3)).sum(2)
        k, here = np.nonzero((ahead[:, :-1] > 0) & (ahead[:, 1:] <= 0))
        order = np.lexsort(((beside[k, here] ** 2).sum(1), k))
        k, here = k[order], here[order]
        number = np.arange(len(k)) - np.searchsorted(k, k)
        k, here, number = (v[number < TRIED] for v in (k, here, number))
        share = ahead[k, here] / np.maximum(ahead[k, here] - ahead[k, here + 1], 1e-15)
        tried[number, first + k] = at[k, here] + (at[k, here + 1] - at[k, here]) * share
    best, least = np.full(len(place), np.nan), np.full(len(place), np.inf)
    for start in tried:
        none = np.isnan(start)
        found, gone = settle_places(wanted, cut, one, np.where(none, place, start), tools.loaded, FROM_GUESS)
        away = np.linalg.norm(tools.loaded(one.at(found))[0] - wanted.points(found, *cut), axis=1)
        away = np.where(none | gone | (np.abs(found - start) > OFF_GUESS), np.inf, away)
        best, least = np.where(away < least, found, best), np.minimum(least, away)
    return best


def _march(
    wanted: Path,
    cut: tuple,
    one: Field,
    label: np.ndarray,
    there: np.ndarray,
    wrench: np.ndarray,
    gives: np.ndarray,
) -> np.ndarray:
    """(S,) labels, on a grid, that the tool passes in turn.

    At each sample the places in a window at which the path is square to the way to the tool are candidates.  Of all
    ways through them that is taken which is nearest to the tool, and which goes on along the path as the program goes
    on: a path that comes back the same way is not taken for its first leg again."""
    low, high = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    grid = np.linspace(low, high, min(max(int((high - low) / GRID), 8), POINTS) + 1)
    points, forces = wanted.points(grid, *cut), one.at(grid)
    tangents = wanted.direction(grid, *cut)
    free = there - np.einsum("kij,kj->ki", gives, wrench)
    reach = np.linalg.norm(np.einsum("kij,kj->ki", gives, wrench), axis=1).max()
    ahead = np.append(0.0, np.diff(label))
    size = grid[1] - grid[0]
    window, last, farthest = int((1.5 * reach + 2 * MM) / size) + 2, 0, 0
    steps = (ahead * 1.5 / size).astype(int) + 2 * window
    candidates, costs = [], []
    for k in range(len(label)):
        a, b = max(farthest - window, 0), min(last + steps[k], len(grid) - 1) + 1
        beside = free[k] + forces[a:b] @ gives[k].T - points[a:b]
        ahead_of = np.einsum("ij,ij->i", beside, tangents[a:b])
        square = np.einsum("ij,ij->i", beside, beside)
        here = np.flatnonzero((ahead_of[:-1] > 0) & (ahead_of[1:] <= 0))
        here = np.where(square[here] < square[here + 1], here, here + 1)
        if a == 0 and ahead_of[0] <= 0:
            here = np.append(here, 0)
        if b == len(grid) and ahead_of[-1] >= 0:
            here = np.append(here, len(square) - 1)
        if not len(here):
            here = np.array([square.argmin()])
        last = a + int(here[square[here].argmin()])
        farthest = max(farthest, last)
        candidates.append(a + here)
        costs.append(square[here] * (max(ahead[k], 0.1 * MM) / NEARBY**2))
    return grid[_cheapest(candidates, costs, ahead / size, size)]


def _cheapest(candidates: list, costs: list, ahead: np.ndarray, size: float) -> np.ndarray:
    """One candidate of each sample, so that the sum of ``costs`` and of what they are off the program's own steps
    ``ahead`` (S,), in grid steps of ``size`` [m], is least."""
    total, came = costs[0] + candidates[0] * size, []
    for k in range(1, len(candidates)):
        if len(candidates[k]) == 1 and len(candidates[k - 1]) == 1:
            came.append(np.zeros(1, int))
            total = costs[k]
            continue
        off = np.abs(candidates[k][:, None] - candidates[k - 1] - ahead[k]) * size + total
        came.append(off.argmin(1))
        total = costs[k] + off.min(1)
    chosen = [int(total.argmin())]
    for back in reversed(came):
        chosen.append(int(back[chosen[-1]]))
    return np.array([c[i] for c, i in zip(candidates, reversed(chosen), strict=True)])


def _refined(
    wanted: Path,
    cut: tuple,
    one: Field,
    place: np.ndarray,
    there: np.ndarray,
    wrench: np.ndarray,
    gives: np.ndarray,
    reaches: tuple,
) -> tuple[np.ndarray, np.ndarray]:
    """The labels (S,) near ``place`` at which the path is square to the way to the tool, by bisection and
    secants; which were not found."""
    ends = wanted.start[cut[0]], wanted.start[cut[1] + 1]
    size = max(GRID, (ends[1] - ends[0]) / POINTS)

    def ahead_of(rows: np.ndarray, at: np.ndarray) -> np.ndarray:
        tool = there[rows] + np.einsum("kij,kj->ki", gives[rows], one.at(at) - wrench[rows])
        return ((tool - wanted.points(at, *cut)) * wanted.direction(at, *cut)).sum(1)

    rows = np.arange(len(place))
    a, b = place.copy(), place.copy()
    fa, fb = np.zeros(len(rows)), np.zeros(len(rows))
    lost = np.ones(len(rows), bool)
    for reach in reaches:
        some = np.flatnonzero(lost)
        a[some], b[some] = (np.clip(place[some] + side * reach * size, *ends) for side in (-1, 1))
        fa[some], fb[some] = ahead_of(some, a[some]), ahead_of(some, b[some])
        lost = ((fa <= 0) & (a > ends[0])) | ((fb >= 0) & (b < ends[1]))
    found = np.where(fa <= 0, a, b)
    rows = np.flatnonzero((fa > 0) & (fb < 0))
    a, b, fa, fb = a[rows], b[rows], fa[rows], fb[rows]
    for turn in range(60):
        if not len(rows):
            break
        middle = 0.5 * (a + b) if turn % 3 == 2 else a + (b - a) * fa / (fa - fb)
        f = ahead_of(rows, middle)
        found[rows] = middle
        done = (np.abs(f) < 1e-13) | (b - a < 1e-12)
        left = f > 0
        a, fa = np.where(left, middle, a), np.where(left, f, fa)
        b, fb = np.where(left, b, middle), np.where(left, fb, f)
        rows, a, b, fa, fb = (v[~done] for v in (rows, a, b, fa, fb))
    return found, lost
