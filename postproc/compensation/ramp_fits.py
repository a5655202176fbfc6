"""Points on ramps of the force, fitted from where they may start: few first, and closely where that is not enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.closest_points import closest_points, closest_to_turn
from postproc.compensation.point_fit import Curves, fit_points

ENOUGH = 0.85
"""Share of the allowed error with which a fit ends."""

CLOSE_ENOUGH = 0.97
"""The same of a close one, which takes longer."""


@dataclass(frozen=True)
class FittedRamps:
    """G ramps.  vertex, knot (G,): the motions of the division that end where the ramp starts and where it ends; row
    (G,): of the program, with the ramp; end [m] (G,): its length; exact (G,): the vertex is; reach (G, 2) [m]: from
    where on points before and after the vertex are rounded off; spacing (G, 2) [m]: the shortest motion before and
    after the vertex; margin (G, 2) [m]: as far the curve goes on before and after; after (G,): the motion that ends in
    the next point after those of the ramp; arc (G, 2): the motions before and after the vertex are."""

    vertex: Ints
    knot: Ints
    row: Ints
    end: Floats
    exact: Bools
    reach: Floats
    spacing: Floats
    margin: Floats
    after: Ints
    arc: Bools

    def __getitem__(self, chosen: Ints | Bools) -> FittedRamps:
        return FittedRamps(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class FittedPoints:
    """Points of one ramp: ``place`` (n, 3) [m], path lengths ``along`` (n,) [m] from the vertex, which of them is the
    motion that is there already, and the largest error [m]."""

    place: Floats
    along: Floats
    own: int
    largest: float


_V, _E = "vertex", "end"
Words = tuple[tuple[str, float], ...]
"""Points: beside the vertex or the end of the ramp, and how many before (less than 0) or after it."""


def _points(before: int, after: int, before_end: int, after_end: int) -> Words:
    """So many points before and after the vertex, and before and after the end of the ramp, besides both."""
    sides = ((_V, before, after), (_E, before_end, after_end))
    return tuple((at, float(k)) for at, low, high in sides for k in range(-low, high + 1))


STARTS: tuple[tuple[Words, ...], ...] = (
    (_points(0, 0, 0, 0),),
    (_points(0, 1, 0, 0), _points(1, 0, 0, 0), _points(0, 0, 1, 0), _points(0, 0, 0, 1)),
    (_points(1, 1, 0, 0), _points(0, 1, 1, 0), _points(0, 1, 0, 1)),
    (_points(1, 1, 0, 1), _points(1, 1, 1, 0)),
    (_points(1, 2, 0, 1), _points(1, 1, 1, 1)),
)
"""Where 1, 2, ... inserted points and that of an approximated vertex may start: beside the vertex, in parts of
``BESIDE`` of its approximation, or beside the end of the ramp, in parts of the shortest motion."""

CLOSE_STARTS: tuple[tuple[Words, float], ...] = (
    (_points(1, 1, 1, 1), 1.02),
    (_points(1, 2, 1, 1), 1.02),
    (_points(3, 3, 3, 3), 1.0),
)
"""Where points start that are fitted closely, as near to each other as the shortest motion lets them, and by which
factor lines are longer than that.  Of the last ones those beside each turn are fitted alone first."""

ALONE = ((1.0, 0.0), (1.0, 1.0), (1.08, 0.5))
"""Lines are longer by such factors where the points beside a turn start alone, and the points are off the curve by such
parts of ``SIDES``."""

SIDES = np.array([-0.10, 0.07, -0.06, 0.06])
"""Where a curve turns by k, its point and those beside it are off the curve by k times the shortest motion times this:
of the points nearest to a bent line, of which none are closer to each other."""

ON = 1e-5
"""[m] The next point is farther on by so much at least."""

BESIDE = 0.75
"""Share of the approximation."""

SPARE = 1.02
"""A line is longer by this factor than the shortest, where points start: they are to move."""


def _starts(ramps: FittedRamps, curves: Curves, count: int) -> tuple[Floats, Ints]:
    """(T, G, n) [m] from the vertex, and (T,) which of them is the vertex (the ramp's end where that is exact)."""
    beside = np.maximum(BESIDE * ramps.reach[:, :1], ramps.spacing)
    starts = [_apart(ramps, curves, words, beside) for words in STARTS[count - 1]]
    return np.stack(starts), np.array([words.index((_V, 0.0)) for words in STARTS[count - 1]])


def _exact_starts(ramps: FittedRamps, curves: Curves, count: int) -> tuple[Floats, Ints]:
    """As ``_starts``, of ramps that start at an exact vertex: it stays where it is."""
    steps: tuple[tuple[float, ...], ...] = {
        1: ((0.0,),),
        2: ((0.0, 1.0), (-1.0, 0.0)),
        3: ((-1.0, 0.0, 1.0),),
    }.get(count, ())
    starts = [_apart(ramps, curves, tuple((_E, k) for k in each), ramps.spacing) for each in steps]
    return np.array(starts), np.array([each.index(0.0) for each in steps], np.int64)


def _apart(
    ramps: FittedRamps, curves: Curves, words: Words, beside: Floats | None, spare: float = SPARE
) -> Floats:
    """(G, n) [m] from the vertex, where the points ``words`` lie on the curves: ``beside`` (G, 2) [m] before and after
    the vertex, the shortest motion before and after the end of the ramp, or farther, until no line is too short; None:
    as near to each other as that lets them, with lines ``spare`` times as long as the shortest."""
    found = np.empty((len(ramps.row), len(words)))
    for at, centre in ((_V, np.zeros(len(ramps.row))), (_E, ramps.end)):
        for way in (-1, 1):
            step = beside[:, max(way, 0)] if at == _V and beside is not None else ramps.spacing[:, 1]
            least = ramps.spacing[:, max(way, 0)] if at == _V else ramps.spacing[:, 1]
            last = centre
            mine = [n for n, (other, k) in enumerate(words) if other == at and k * way >= 0]
            for n in sorted(mine, key=lambda n: abs(words[n][1])):
                if words[n][1]:
                    first = last + way * ON if beside is None else centre + words[n][1] * step
                    last = curves.away(last, first, spare * least, way)
                found[:, n] = last
    return found


def fit_ramps(
    ramps: FittedRamps, curves: Curves, count: int, allowed: float, names: Ints
) -> dict[int, FittedPoints]:
    """The points of ramps with ``count`` inserted ones that are within ``allowed`` [m], or come nearest to it, by
    ``names`` (G,)."""
    found: dict[int, FittedPoints] = {}
    for exact in (False, True):
        some = np.flatnonzero(ramps.exact == exact)
        if not len(some):
            continue
        starts, own = (_exact_starts if exact else _starts)(ramps[some], curves[some], count)
        left = np.arange(len(some))
        for start, place in zip(starts, own.tolist(), strict=True):
            part, curve = ramps[some[left]], curves[some[left]]
            parameter, reach, shortest, vertex = _polygons(part, curve, start[left], place, exact)
            points, largest = fit_points(curve, parameter, reach, shortest, ENOUGH * allowed, vertex)
            along = curve.nearest(points, parameter)[:, 1:-1]
            for k, size in enumerate(largest.tolist()):
                name = int(names[some[left[k]]])
                if name not in found or size < found[name].largest:
                    found[name] = FittedPoints(points[k, 1:-1], along[k], place, size)
            left = left[largest > allowed]
            if not len(left):
                break
    return found


def _polygons(
    ramps: FittedRamps, curves: Curves, start: Floats, place: int, exact: bool
) -> tuple[Floats, Floats, Floats, int]:
    """Parameters [m], reaches [m] (G, n + 2), shortest lines (G, n + 1) [m] of polygons from ``start`` (G, n) [m] on,
    of which the point ``place`` is the vertex or, where that is exact, the end of the ramp; and which is the vertex."""
    first = curves.first if exact else curves.ends[:, 0]
    parameter = np.column_stack([first, start, curves.ends[:, 1]])
    width, vertex = parameter.shape[1], 0 if exact else place + 1
    before = np.arange(width) <= (-1 if exact else vertex)
    reach = np.where(before, ramps.reach[:, :1], ramps.reach[:, 1:])
    shortest = np.where(np.arange(width - 1) < vertex, ramps.spacing[:, :1], ramps.spacing[:, 1:])
    return parameter, reach, shortest, vertex


class CloseFits:
    """Close fits of ramps, which take their time: each is done once, however often the others change."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, int, bytes], FittedPoints | None] = {}
        self._curves: dict[bytes, Curves] = {}

    def curve(self, place: Floats, build: Callable[[], Curves]) -> Curves:
        """The close curve of a ramp whose curve has the places (N + 2, 3) [m]."""
        key = place.tobytes()
        if key not in self._curves:
            self._curves[key] = build()
        return self._curves[key]

    def fit(self, ramp: FittedRamps, curve: Curves, number: int, allowed: float) -> FittedPoints | None:
        """The points of one ramp, approximated at its vertex, from the start ``number`` on, until they are within
        ``allowed`` [m]; None where they have no room."""
        key = "start", number, curve.place.tobytes()
        if key not in self._known:
            words, spare = CLOSE_STARTS[number]
            if number + 1 < len(CLOSE_STARTS):
                start, own = _apart(ramp, curve, words, None, spare), words.index((_V, 0.0))
                self._known[key] = _closely_fitted(ramp, curve, start, own, allowed)
            else:
                self._known[key] = _fitted_by_turns(ramp, curve, words, allowed)
        return self._known[key]

    def go_on(self, ramp: FittedRamps, curve: Curves, points: FittedPoints, allowed: float) -> FittedPoints:
        """The points of one ramp, approximated at its vertex, from ``points`` on or from their places on the curve, or
        these where none come nearer."""
        key = "points", len(points.along), curve.place.tobytes()
        if key not in self._known:
            found = [
                _closely_fitted(ramp, curve, points.along[None], points.own, allowed, place)
                for place in (None, points.place[None])
            ]
            nearest = [one for one in found if one is not None]
            self._known[key] = min(nearest, key=lambda one: one.largest, default=None)
        best = self._known[key]
        return points if best is None or best.largest >= points.largest else best


def _fitted_by_turns(ramp: FittedRamps, curve: Curves, words: Words, allowed: float) -> FittedPoints | None:
    """The points ``words``, those beside each turn fitted alone first, from the best of some starts."""
    place = np.empty((1, len(words), 3))
    for turn, at in enumerate((_V, _E)):
        alone = tuple(word for word in words if word[0] == at or not word[1])
        own, nearest = alone.index((_V, 0.0)), np.inf
        for spare, share in ALONE:
            start = _apart(ramp, curve, alone, None, spare)
            parameter, reach, shortest, vertex = _polygons(ramp, curve, start, own, exact=False)
            if (np.diff(parameter) <= 0.0).any():
                continue
            points = curve.at(parameter)[0]
            points[:, 1:-1] += share * _on_both_sides(ramp, curve, alone, at)
            enough = CLOSE_ENOUGH * allowed
            points, largest = closest_to_turn(curve, points, parameter, reach, shortest, enough, vertex, turn)
            if largest < nearest:
                nearest = largest
                mine = [k for k, word in enumerate(alone, 1) if word[0] == at]
                place[:, [k for k, word in enumerate(words) if word[0] == at]] = points[:, mine]
            if largest <= enough:
                break
        if not np.isfinite(nearest):
            return None
    start = curve.nearest(place, _apart(ramp, curve, words, None, 1.0))
    return _closely_fitted(ramp, curve, start, words.index((_V, 0.0)), allowed, place, each_turn=True)


def _on_both_sides(ramp: FittedRamps, curve: Curves, words: Words, at: str) -> Floats:
    """(1, n, 3) [m] by how much the points ``words`` of one ramp are off the curve beside the turn ``at``: in turn on
    either side of it."""
    step, centre = ramp.spacing[0].max(), ramp.end[0] if at == _E else 0.0
    place, tangent, _ = (v[0] for v in curve.at(centre + step * np.array([[-1.0, 0.0, 1.0]])))
    turn = place[0] + place[2] - 2.0 * place[1]
    turn -= (turn @ tangent[1]) * tangent[1]
    size = [SIDES[abs(int(k))] if word == at else 0.0 for word, k in words]
    return np.asarray(np.array(size)[None, :, None] * turn)


def _closely_fitted(
    ramp: FittedRamps,
    curve: Curves,
    start: Floats,
    own: int,
    allowed: float,
    place: Floats | None = None,
    each_turn: bool = False,
) -> FittedPoints | None:
    """From ``start`` (1, n) [m] on, of which ``own`` is the motion that is there already; ``place`` (1, n, 3) [m]: from
    there on, off the curve; ``each_turn`` as of ``closest_points``."""
    parameter, reach, shortest, vertex = _polygons(ramp, curve, start, own, exact=False)
    if (np.diff(parameter) <= 0.0).any():
        return None
    first = None
    if place is not None:
        first = curve.at(parameter)[0]
        first[:, 1:-1] = place
    points, largest = closest_points(
        curve, parameter, reach, shortest, CLOSE_ENOUGH * allowed, vertex, first, each_turn
    )
    if not np.isfinite(largest):
        return None
    return FittedPoints(points[0, 1:-1], curve.nearest(points, parameter)[0, 1:-1], own, largest)
