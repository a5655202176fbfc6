"""Points of a rounded polygon as near to a curve as points that keep their distance can be.

``point_fit`` finds points that are near enough for most ramps at once, and moves those apart that came too near to each
other.  Where lines as short as they may be decide how near a polygon comes, that is no way to the best of them.  Here
each step is a linear programme: by the slopes of the errors it makes the largest of them least, within a box around the
points, and with no line shorter than it may be.  The length of a line is convex in its ends: one that is long enough by
its slope is so in truth (sequential linear programming: Fletcher and Sainz de la Maza 1989).

A curve turns at some places, and each has its own largest error: the sum of them is made least where points are looked
for from the start on.  If only the largest of all were, a place with a smaller error would come no nearer, and would
hold the others up by where its points are.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM
from postproc.compensation.point_fit import (
    LONGEST,
    Curves,
    Polygons,
    evaluate_polygons,
    long_enough,
    moved_apart,
)

STEPS = 120
"""Linear programmes of a search."""

FIRST, SHORTEST = 0.05 * MM, 1e-6
"""[m] The box around the points: at first, and where the search ends."""

WIDER, NARROWER = 2.0, 0.4
"""The box after a step that came nearer, and after one that did not."""

SOME, GAIN = 6, 0.9999
"""So many steps in which no more than this share remains of the error, or the search ends."""

FAR = 1.0 * MM
"""Errors beside other turns than the one that counts."""

LITTLE = 0.1
"""Errors below this share of the largest are left out of a step."""

ANGLES = np.arange(8) * np.pi / 4
"""[rad] In these directions from itself an error is bounded, square to the curve."""

MICRO = 1e6
"""The programme is solved in um: its solver takes 1e-7 for nothing."""


def closest_points(
    curve: Curves,
    parameter: Floats,
    reach: Floats,
    shortest: Floats,
    enough: float,
    vertex: int,
    start: Floats | None = None,
    each_turn: bool = False,
) -> tuple[Floats, float]:
    """As ``fit_points``, of one curve: points (1, K, 3) [m] from where they have the ``parameter`` (1, K) [m] on, and
    their largest distance [m] from it, inf where they have no room; ``reach`` (1, K) and ``shortest`` (1, K - 1) [m] as
    there.  start (1, K, 3) [m]: there the points start; None: on the curve.  each_turn: of the curve has an error of
    its own, or the largest of all is made least."""
    floor = np.full(curve.turn.shape[1], enough) if each_turn else np.zeros(1)
    points = curve.at(parameter)[0] if start is None else start
    best = _search(curve, points, parameter, reach, shortest, vertex, floor, enough * len(floor))
    return best.points, float(best.largest[0]) if long_enough(best.points, shortest).all() else np.inf


def closest_to_turn(
    curve: Curves,
    start: Floats,
    parameter: Floats,
    reach: Floats,
    shortest: Floats,
    enough: float,
    vertex: int,
    turn: int,
) -> tuple[Floats, float]:
    """As ``closest_points``, beside the ``turn`` of the curve alone: points (1, K, 3) [m] and their largest distance
    [m] there; beside the other turns it may be ``FAR``.  start (1, K, 3) [m]: there the points start; parameter, reach
    (1, K) and shortest (1, K - 1) [m] as there."""
    floor = np.full(curve.turn.shape[1], FAR)
    floor[turn] = enough
    best = _search(curve, start, parameter, reach, shortest, vertex, floor, enough + FAR * (len(floor) - 1))
    if not long_enough(best.points, shortest).all():
        return best.points, np.inf
    here = _turn_nearest(curve, best, len(floor)) == turn
    return best.points, float(np.linalg.norm(best.off[0][here], axis=1).max(initial=0.0))


def _search(
    curve: Curves,
    start: Floats,
    parameter: Floats,
    reach: Floats,
    shortest: Floats,
    vertex: int,
    floor: Floats,
    enough: float,
) -> Polygons:
    """The polygon whose largest errors beside each turn, or (of one ``floor``) anywhere, together are least; each is
    ``floor`` (T,) [m] at least, and ``enough`` [m] together ends the search."""
    turns = len(floor)
    best = evaluate_polygons(curve, moved_apart(start, shortest), reach, None, parameter, vertex, True)
    if not long_enough(best.points, shortest).all():
        return best
    past, box = [_sum_of_largest(best, _turn_nearest(curve, best, turns), floor)], FIRST
    for _ in range(STEPS):
        done = past[-1] <= enough or (len(past) > SOME and past[-1] > GAIN * past[-1 - SOME])
        if done or box < SHORTEST:
            return best
        moved = best.points.copy()
        moved[0, 1:-1] += _step(best, curve, shortest[0], box, floor, _turn_nearest(curve, best, turns))
        found = evaluate_polygons(curve, moved, reach, best.parameter, best.label, vertex, True)
        size = _sum_of_largest(found, _turn_nearest(curve, found, turns), floor)
        if long_enough(moved, shortest).all() and size < past[-1]:
            best, box = found, min(WIDER * box, LONGEST)
            past.append(size)
        else:
            box *= NARROWER
    return best


def _turn_nearest(curve: Curves, polygon: Polygons, turns: int) -> Ints:
    """(S,) the number of the turn of the curve that is nearest to each place of the polygon; 0 where one counts."""
    turn = curve.turn[0, :turns]
    return np.asarray(np.searchsorted(0.5 * (turn[1:] + turn[:-1]), polygon.parameter[0]))


def _sum_of_largest(polygon: Polygons, turn: Ints, floor: Floats) -> float:
    """[m] The largest errors of places beside each ``turn`` (S,), ``floor`` (T,) [m] at least, together."""
    largest = floor.copy()
    np.maximum.at(largest, turn, np.linalg.norm(polygon.off[0], axis=1))
    return float(largest.sum())


def _step(
    polygon: Polygons, curve: Curves, shortest: Floats, box: float, floor: Floats, turn: Ints
) -> Floats:
    """(K - 2, 3) [m] by how much the inner points move, ``box`` [m] at most in each coordinate;
    ``turn`` (S,): beside which turn the places are."""
    from scipy.optimize import linprog  # where it is needed alone

    off, slope, turns = polygon.off[0], polygon.slope[0], len(floor)
    size = np.linalg.norm(off, axis=1)
    some = size > LITTLE * size.max()
    off, slope, size, turn = off[some], slope[some], size[some], turn[some]
    tangent = curve.at(polygon.parameter)[1][0][some]
    one = off / np.maximum(size, 1e-15)[:, None]
    two = np.cross(tangent, one)
    two /= np.maximum(np.linalg.norm(two, axis=1), 1e-15)[:, None]
    ways = np.cos(ANGLES)[:, None, None] * one + np.sin(ANGLES)[:, None, None] * two
    width = slope.shape[2]
    errors = np.einsum("dsk,skv->dsv", ways, slope).reshape(-1, width)
    now = np.einsum("dsk,sk->ds", ways, off).ravel()

    line = np.diff(polygon.points[0], axis=0)
    length = np.linalg.norm(line, axis=1)
    line /= length[:, None]
    count = len(length)
    shorter = np.zeros((count, count + 1, 3))
    numbers = np.arange(count)
    shorter[numbers, numbers], shorter[numbers, numbers + 1] = line, -line
    lines = shorter[:, 1:-1].reshape(count, width)

    largest = np.tile(turn, len(ways))[:, None] == np.arange(turns)
    rows = np.block([[errors, -largest.astype(float)], [lines, np.zeros((count, turns))]])
    most = MICRO * np.concatenate([-now, np.minimum(length - shortest, 1.0)])
    sides = [*[(-MICRO * box, MICRO * box)] * width, *[(MICRO * least, None) for least in floor]]
    cost = np.append(np.zeros(width), np.ones(turns))
    solved = linprog(cost, rows, most, bounds=sides, method="highs")
    step = np.zeros(width) if solved.x is None else solved.x[:width] / MICRO
    return np.asarray(step.reshape(-1, 3))
