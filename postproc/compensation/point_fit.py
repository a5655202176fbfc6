"""Points of a rounded polygon that follows a curve, as near to it as so few points can.

The controller goes straight from point to point and rounds each off by a parabola (``rounded_path``).  All coordinates
of the inner points are free: across the curve they take away what is off; along it they decide where the polygon turns
and, as a parabola reaches no farther than half of the shorter line beside it, how closely.  The largest distance across
the curve is made least by Gauss-Newton steps, damped and of limited length (Levenberg 1944), each the least largest
error of the linear problem by raised weights (Lawson 1961).

Beside a vertex the motions may be arcs: a piece of one is the line between its points, and what the arc of the commands
bends away from such a line, which moves with its points.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM

STEPS, WEIGHINGS, SECANTS = 24, 8, 4
"""Gauss-Newton steps, how often the weights are raised within one, and steps to the nearest place of the curve."""

FIRST, SHORTEST, LONGEST = 5e-4, 2e-6, 2e-3
"""[m] Length of a step: at first; where the search ends; at most."""

SPREADS, TOO_SHORT = 12, 1e-7
"""How often lines that are too short are made longer after a step, and by how much [m] they may be too short then."""

ON_PARABOLA, ON_LINE = np.linspace(0.0, 1.0, 25), 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 21))
"""Where parabolas and lines are evaluated: lines closer near their ends, where curves turn."""

FROM_POINT = np.array([0.0, 0.2, 0.5, 0.8, 1.1, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0]) * MM
"""[m] The same on the first and the last line, from their inner points on: farther the curves are straight."""

FLATTEST = 0.05
"""The curve goes along its tangents by this share of its parameter at least."""


@dataclass(frozen=True)
class Curves:
    """G curves of N places each, with the points before and after them at which the polygon is where it is: so far the
    curves are straight.

    first, step (G,) [m]: of the parameters; ends (G, 2) [m]: parameters of the points before and after; turn (G, T)
    [m]: at which the curve turns, ascending; place (G, N + 2, 3) [m]; tangent (G, N + 2, 3): unit vectors, square to
    which the distance is measured (where the tool is early or late nothing is off).  arc (G, 2): the motions before and
    after the vertex, at 0, are; unrounded (G, N + 2, 3) [m]: the places as they are where no vertex is rounded off.
    """

    first: Floats
    step: Floats
    ends: Floats
    turn: Floats
    place: Floats
    tangent: Floats
    arc: Bools
    unrounded: Floats

    def __getitem__(self, chosen: Ints | Bools) -> Curves:
        return Curves(*(getattr(self, each.name)[chosen] for each in fields(self)))

    def nearest(self, points: Floats, parameter: Floats, secants: int = SECANTS) -> Floats:
        """(G, K) [m] parameters of the places nearest to points (G, K, 3), looked for from ``parameter`` (G, K)."""
        for _ in range(secants):
            here, tangent, along = self.at(parameter)
            gap = np.sum((points - here) * tangent, axis=2)
            parameter = parameter + np.clip(
                gap / np.maximum(np.sum(along * tangent, axis=2), FLATTEST), -LONGEST, LONGEST
            )
        return parameter

    def away(self, start: Floats, first: Floats, distance: Floats, direction: int) -> Floats:
        """(G,) [m] parameters of the places from ``first`` (G,) [m] on, ahead (``direction`` 1) or back (-1), that are
        ``distance`` (G,) [m] or more from those with the parameters ``start`` (G,) [m]; ``first`` where none is."""
        count = self.place.shape[1] - 2
        parameter = self.first[:, None] + self.step[:, None] * np.arange(count)
        gap = _sizes(self.place[:, 1:-1] - self.at(start[:, None])[0])
        good = (gap >= distance[:, None]) & (direction * (parameter - first[:, None]) >= 0.0)
        nearest = np.min(np.where(good, direction * parameter, np.inf), axis=1)
        here = _sizes((self.at(first[:, None])[0] - self.at(start[:, None])[0])[:, 0])
        return np.where(np.isfinite(nearest) & (here < distance), direction * nearest, first)

    def at(self, parameter: Floats) -> tuple[Floats, Floats, Floats]:
        """Places, tangents and derivatives (G, S, 3) of the places at parameters (G, S)."""
        low, part, size = self._number(parameter)
        one = np.arange(len(low))[:, None]
        here, there = self.place[one, low], self.place[one, low + 1]
        tangent = self.tangent[one, low] * (1.0 - part) + self.tangent[one, low + 1] * part
        return here + part * (there - here), tangent, (there - here) / size

    def bends(self, low: Floats, high: Floats, share: Floats, side: int) -> Floats:
        """(G, S, 3) [m] by how much the arcs from the parameters ``low`` (G,) to ``high`` (G,), before the vertex
        (``side`` 0) or after it, are off the lines between their ends, at the shares (G, S); 0 of lines."""
        ends = np.stack([low, high], axis=1)
        parameter = low[:, None] + share * (high - low)[:, None]
        found, last = self._at_unrounded(parameter), self._at_unrounded(ends)
        found -= last[:, :1] + share[..., None] * (last[:, 1:] - last[:, :1])
        return np.where(self.arc[:, side, None, None], found, 0.0)

    def _at_unrounded(self, parameter: Floats) -> Floats:
        low, part, _ = self._number(parameter)
        one = np.arange(len(low))[:, None]
        return np.asarray(self.unrounded[one, low] * (1.0 - part) + self.unrounded[one, low + 1] * part)

    def _number(self, parameter: Floats) -> tuple[Ints, Floats, Floats]:
        """(G, S) numbers of the places before parameters (G, S), (G, S, 1) the parts of the way to the next, and
        (G, S, 1) [m] of how long a way."""
        last = self.place.shape[1] - 2  # of the curve itself
        first, step, ends = self.first[:, None], self.step[:, None], self.ends
        stop = first + (last - 1) * step
        number = 1.0 + (parameter - first) / step
        before, after = parameter < first, parameter > stop
        number = np.where(before, 1.0 - (first - parameter) / (first - ends[:, :1]), number)
        number = np.where(after, last + (parameter - stop) / (ends[:, 1:] - stop), number)
        number = np.clip(number, 0.0, last + 1.0)
        low = np.minimum(number.astype(np.int64), last)
        size = np.where(low == 0, first - ends[:, :1], np.where(low == last, ends[:, 1:] - stop, step))
        return low, (number - low)[..., None], size[..., None]


@dataclass
class Polygons:
    """Polygons of K points (G, K, 3) with S places on them: off (G, S, 3) across the curves, slope (G, S, 3, V): by how
    much the V coordinates of the inner points change it, parameter (G, S) of the nearest places of the curves; label
    (G, K): parameters of the points."""

    points: Floats
    off: Floats
    slope: Floats
    parameter: Floats
    label: Floats

    @property
    def largest(self) -> Floats:
        """(G,) [m]"""
        return np.asarray(_sizes(self.off).max(axis=1))


def fit_points(
    curves: Curves, parameter: Floats, reach: Floats, shortest: Floats, enough: float, vertex: int
) -> tuple[Floats, Floats]:
    """Points (G, K, 3) of polygons along G ``curves``, and the largest distance (G,) [m] of each from its curve.

    parameter (G, K) [m]: where the points start, on the curves; the first and the last stay.  reach (G, K) [m]: from
    where on points are rounded off; shortest (G, K - 1) [m]: lines.  enough [m]: a distance that needs no improvement.
    vertex: which of the points is that between the motions.
    """
    points = moved_apart(curves.at(parameter)[0], shortest)
    best = evaluate_polygons(curves, points, reach, None, parameter, vertex)
    largest = np.where(long_enough(points, shortest), best.largest, np.inf)
    trust, damping = np.full(len(points), FIRST), np.full(len(points), 1e-2)
    for _ in range(STEPS):
        some = np.flatnonzero((largest > enough) & (trust > SHORTEST))
        if not len(some):
            return best.points, largest
        off, slope = best.off[some], best.slope[some]
        step = least_largest(off, slope, damping[some]).reshape(len(some), -1, 3)
        step *= np.minimum(1.0, trust[some] / np.maximum(np.abs(step).max(axis=(1, 2)), 1e-15))[:, None, None]
        moved = best.points[some]
        moved[:, 1:-1] += step
        moved = moved_apart(moved, shortest[some])
        found = evaluate_polygons(
            curves[some], moved, reach[some], best.parameter[some], best.label[some], vertex
        )
        after = np.where(long_enough(moved, shortest[some]), found.largest, np.inf)
        won = after < largest[some]
        at = some[won]
        for name in ("points", "off", "slope", "parameter", "label"):
            getattr(best, name)[at] = getattr(found, name)[won]
        largest[at] = after[won]
        damping[some] = np.where(won, np.maximum(0.4 * damping[some], 1e-4), 6.0 * damping[some])
        trust[some] = np.where(won, np.minimum(1.5 * trust[some], LONGEST), 0.4 * trust[some])
    return best.points, largest


def _sizes(vectors: Floats) -> Floats:
    """(...) lengths of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.sum(vectors * vectors, axis=-1)))


def long_enough(points: Floats, shortest: Floats) -> Bools:
    """(G,) whether no line of the points (G, K, 3) is shorter than ``shortest`` (G, K - 1) [m]."""
    return np.asarray((_sizes(np.diff(points, axis=1)) >= shortest - TOO_SHORT).all(axis=1))


def moved_apart(points: Floats, shortest: Floats) -> Floats:
    """Points (G, K, 3), ``points`` (G, K, 3) with the inner ones moved so far apart that lines are ``shortest``
    (G, K - 1) [m] or longer; some are shorter still where there is no room."""
    inner = np.ones(points.shape[1])
    inner[[0, -1]] = 0.0
    share = inner[1:] / np.maximum(inner[1:] + inner[:-1], 1.0)
    for _ in range(SPREADS):
        step = np.diff(points, axis=1)
        size = _sizes(step)
        lack = np.maximum(shortest - size, 0.0)
        if not lack.any():
            return points
        push = (lack / np.maximum(size, 1e-12))[..., None] * step
        points = points.copy()
        points[:, 1:] += share[:, None] * push
        points[:, :-1] -= (inner[:-1] * (1.0 - share))[:, None] * push
    return points


def least_largest(off: Floats, slope: Floats, damping: Floats) -> Floats:
    """(G, V) [m] steps with which the largest of ``off`` (G, S, 3) + ``slope`` (G, S, 3, V) steps is least, with the
    ``damping`` (G,) of each: a share of the mean of its squared slopes."""
    groups, samples, _, free = slope.shape
    flat, side = slope.reshape(groups, 3 * samples, free), off.reshape(groups, 3 * samples, 1)
    given = np.ones((groups, samples))
    best, least = np.zeros((groups, free)), np.full(groups, np.inf)
    for _ in range(WEIGHINGS):
        heavy = np.swapaxes(flat * np.repeat(given, 3, axis=1)[..., None], 1, 2)
        matrix = heavy @ flat
        ridge = damping * np.maximum(np.trace(matrix, axis1=1, axis2=2), 1e-12) / free
        step = -np.linalg.solve(matrix + ridge[:, None, None] * np.eye(free), heavy @ side)[..., 0]
        remains = _sizes((side[..., 0] + (flat @ step[..., None])[..., 0]).reshape(groups, samples, 3))
        largest = np.maximum(remains.max(axis=1), 1e-12)
        won = largest < least
        best[won], least[won] = step[won], largest[won]
        given = given * (remains / largest[:, None] + 1e-3)
        given = np.maximum(given / given.max(axis=1, keepdims=True), 1e-6)
    return best


def evaluate_polygons(
    curves: Curves,
    points: Floats,
    reach: Floats,
    near: Floats | None,
    label: Floats,
    vertex: int,
    stays: bool = False,
) -> Polygons:
    """The polygons (G, K, 3) against their curves; the nearest places are looked for from ``near`` (G, S), or from
    where the points have the parameters ``label`` (G, K); ``reach`` (G, K) [m] as of ``fit_points``.  stays: where a
    curve turns its place does, and that of the polygon moves along the polygon; else as everywhere."""
    label = _labels(curves, points, label, vertex)
    weights, slope, bend = _weights(curves, points, reach, label, vertex)
    place = weights @ points + bend
    secants = 2 if near is not None else SECANTS
    near = (weights @ label[..., None])[..., 0] if near is None else near[:, : place.shape[1]]
    at = curves.nearest(place, near, secants)
    more, factors = _turns(curves, at)
    before, after = (
        [np.take_along_axis(v, k, 1) for v in (*np.moveaxis(place, 2, 0), at)] for k in (more, more + 1)
    )
    *driven, passed = (b - a for a, b in zip(before, after, strict=True))
    weights, slope, bend = (_with_turns(values, more, factors) for values in (weights, slope, bend))
    place = weights @ points + bend
    at = curves.nearest(place, _with_turns(at, more, factors), 1)
    here, tangent, along = curves.at(at)
    off = place - here
    off -= np.sum(off * tangent, axis=2)[..., None] * tangent
    if stays:
        along[:, -more.shape[1] :] = np.stack(driven, axis=2) / np.maximum(passed, 1e-12)[..., None]
    # where a place moves, that of the curve follows: (place - here) stays square to the tangent
    ahead = along / np.maximum(np.sum(along * tangent, axis=2), FLATTEST)[..., None]
    slope = slope - ahead[..., None] * np.einsum("gsi,gsiv->gsv", tangent, slope)[:, :, None, :]
    return Polygons(points, off, slope, at, label)


def _labels(curves: Curves, points: Floats, label: Floats, vertex: int) -> Floats:
    """(G, K) parameters of points (G, K, 3), looked for from ``label`` (G, K), ascending; those of the ends and of the
    vertex stay."""
    if not curves.arc.any():
        return label
    fixed = label.copy()
    fixed[:, vertex] = 0.0
    inner = np.arange(1, points.shape[1] - 1)
    inner = inner[inner != vertex]
    fixed[:, inner] = curves.nearest(points[:, inner], label[:, inner])
    before, after = fixed[:, : vertex + 1], fixed[:, vertex:]
    fixed[:, : vertex + 1] = np.minimum.accumulate(before[:, ::-1], axis=1)[:, ::-1]
    fixed[:, vertex:] = np.maximum.accumulate(after, axis=1)
    return np.clip(fixed, label[:, :1], label[:, -1:])


def _turns(curves: Curves, at: Floats) -> tuple[Ints, Floats]:
    """Of the places on polygons that are nearest to where their curves turn: the numbers (G, T) of the places before
    them, by their parameters ``at`` (G, S), and the share (G, T) of the distance to the next."""
    rising = np.maximum.accumulate(at, axis=1)
    number = np.stack([np.sum(rising < turn[:, None], axis=1) for turn in curves.turn.T], axis=1)
    number = np.clip(number - 1, 0, at.shape[1] - 2)
    low, high = (np.take_along_axis(rising, number + k, 1) for k in (0, 1))
    return number, np.clip((curves.turn - low) / np.maximum(high - low, 1e-12), 0.0, 1.0)


def _with_turns(values: Floats, number: Ints, part: Floats) -> Floats:
    """``values`` (G, S, ...) with those at the places of ``_turns``."""
    one = np.arange(len(values))[:, None]
    shape = (*part.shape, *(1,) * (values.ndim - 2))
    share = part.reshape(shape)
    between = (1.0 - share) * values[one, number] + share * values[one, number + 1]
    return np.concatenate([values, between], axis=1)


def _weights(
    curves: Curves, points: Floats, reach: Floats, label: Floats, vertex: int
) -> tuple[Floats, Floats, Floats]:
    """(G, S, K): places of the rounded polygons as parts of their points (G, K, 3), (G, S, 3, V) by how much the
    coordinates of the inner points change them, what they do to the reach of the parabolas included, and (G, S, 3) [m]
    what arcs between points with the parameters ``label`` (G, K) add."""
    groups, count, _ = points.shape
    step = np.diff(points, axis=1)
    length = np.maximum(_sizes(step), 1e-9)
    change = np.zeros((groups, count - 1, count, 3))  # of the lengths
    for k in range(count - 1):
        change[:, k, k + 1] = step[:, k] / length[:, k, None]
        change[:, k, k] = -change[:, k, k + 1]
    round_ = np.zeros((groups, count))
    change_round = np.zeros((groups, count, count, 3))
    for i in range(1, count - 1):
        shorter = np.where(length[:, i - 1] < length[:, i], i - 1, i)
        half = 0.5 * length[np.arange(groups), shorter]
        round_[:, i] = np.minimum(reach[:, i], half)
        limited = (half < reach[:, i])[:, None, None]
        change_round[:, i] = np.where(limited, 0.5 * change[np.arange(groups), shorter], 0.0)
    parts, slopes, bends = [], [], []

    def add(part: Floats, more: Floats | None, bend: Floats) -> None:
        slope = part[:, :, None, :, None] * np.eye(3)[None, None, :, None, :]
        parts.append(part)
        slopes.append(slope if more is None else slope + more)
        bends.append(bend)

    def unrounded(i: int, share: Floats) -> Floats:
        if not curves.arc.any():
            return np.zeros((*share.shape, 3))
        return curves.bends(label[:, i], label[:, i + 1], share, 0 if i < vertex else 1)

    def line(i: int) -> None:
        low, high = round_[:, i] / length[:, i], 1.0 - round_[:, i + 1] / length[:, i]
        share = low[:, None] + ON_LINE * (high - low)[:, None]
        if i in (0, count - 2):  # from the inner point on
            away = np.minimum(FROM_POINT / length[:, i, None], (high - low)[:, None])
            share = low[:, None] + away if i else (high[:, None] - away)[:, ::-1]
        part = np.zeros((groups, share.shape[1], count))
        part[:, :, i], part[:, :, i + 1] = 1.0 - share, share
        add(part, None, unrounded(i, share))

    u = ON_PARABOLA
    line(0)
    for i in range(1, count - 1):
        shares = [round_[:, i] / length[:, i - 1 + k] for k in (0, 1)]
        part = np.zeros((groups, len(u), count))
        first, last = (1.0 - u) ** 2 * shares[0][:, None], u**2 * shares[1][:, None]
        part[:, :, i - 1], part[:, :, i + 1], part[:, :, i] = first, last, 1.0 - first - last
        more = np.zeros((groups, len(u), 3, count, 3))
        for k, curve in ((0, (1.0 - u) ** 2), (1, u**2)):
            of_share = change_round[:, i] - shares[k][:, None, None] * change[:, i - 1 + k]
            of_share = of_share / length[:, i - 1 + k][:, None, None]
            toward = curve[None, :, None] * (step[:, i] if k else -step[:, i - 1])[:, None, :]
            more += toward[:, :, :, None, None] * of_share[:, None, None]
        before = (1.0 - u)[:, None] * unrounded(i - 1, 1.0 - shares[0][:, None] * (1.0 - u))
        add(part, more, before + u[:, None] * unrounded(i, shares[1][:, None] * u))
        line(i)
    slope = np.concatenate(slopes, axis=1)[:, :, :, 1:-1]
    return (
        np.concatenate(parts, axis=1),
        slope.reshape(*slope.shape[:3], -1),
        np.concatenate(bends, axis=1),
    )
