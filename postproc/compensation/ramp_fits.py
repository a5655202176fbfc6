"""Points on ramps of the force, fitted from where they may start: few first, and closely where that is not enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.closest_points import closest_points
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


def _both(vertex: range, end: range) -> Words:
    return (*((_V, float(k)) for k in vertex), *((_E, float(k)) for k in end))


STARTS: tuple[tuple[Words, ...], ...] = (
    (((_V, 0.0), (_E, 0.0)),),
    (
        ((_V, 0.0), (_V, 1.0), (_E, 0.0)),
        ((_V, -1.0), (_V, 0.0), (_E, 0.0)),
        ((_V, 0.0), (_E, -1.0), (_E, 0.0)),
        ((_V, 0.0), (_E, 0.0), (_E, 1.0)),
    ),
    (
        ((_V, -1.0), (_V, 0.0), (_V, 1.0), (_E, 0.0)),
        ((_V, 0.0), (_V, 1.0), (_E, -1.0), (_E, 0.0)),
        ((_V, 0.0), (_V, 1.0), (_E, 0.0), (_E, 1.0)),
    ),
    (
        ((_V, -1.0), (_V, 0.0), (_V, 1.0), (_E, 0.0), (_E, 1.0)),
        ((_V, -1.0), (_V, 0.0), (_V, 1.0), (_E, -1.0), (_E, 0.0)),
    ),
    (
        ((_V, -1.0), (_V, 0.0), (_V, 1.0), (_V, 2.0), (_E, 0.0), (_E, 1.0)),
        ((_V, -1.0), (_V, 0.0), (_V, 1.0), (_E, -1.0), (_E, 0.0), (_E, 1.0)),
    ),
)
"""Where 1, 2, ... inserted points and that of an approximated vertex may start: beside the vertex, in parts of
``BESIDE`` of its approximation, or beside the end of the ramp, in parts of the shortest motion."""

CLOSE_STARTS: tuple[tuple[Words, float, bool], ...] = (
    (_both(range(-1, 2), range(-1, 2)), 1.02, False),
    (_both(range(-1, 3), range(-1, 2)), 1.02, False),
    (_both(range(-3, 4), range(-3, 4)), 1.0, False),
    (_both(range(-3, 4), range(-3, 4)), 1.0, True),
)
"""Where points start that are fitted closely, as near to each other as the shortest motion lets them; by which factor
lines are longer than that; and whether the points beside the end of the ramp start on both sides of the curve."""

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
            words, spare, both_sides = CLOSE_STARTS[number]
            start, own = _apart(ramp, curve, words, None, spare), words.index((_V, 0.0))
            aside = _on_both_sides(ramp, curve, words, both_sides)
            self._known[key] = _closely_fitted(ramp, curve, start, own, allowed, aside)
        return self._known[key]

    def go_on(self, ramp: FittedRamps, curve: Curves, points: FittedPoints, allowed: float) -> FittedPoints:
        """The points of one ramp, approximated at its vertex, from ``points`` on, or these where none come nearer."""
        key = "points", len(points.along), curve.place.tobytes()
        if key not in self._known:
            self._known[key] = _closely_fitted(ramp, curve, points.along[None], points.own, allowed)
        found = self._known[key]
        return points if found is None or found.largest >= points.largest else found


def _on_both_sides(ramp: FittedRamps, curve: Curves, words: Words, both: bool) -> Floats:
    """(1, n + 2, 3) [m] by how much the points ``words`` of one ramp, and those before and after them, are off the
    curve where they start: on its ``both`` sides beside the end of the ramp, or not at all."""
    found = np.zeros((1, len(words) + 2, 3))
    if both:
        step = ramp.spacing[0, 1]
        place, tangent, _ = (v[0] for v in curve.at(ramp.end[0] + step * np.array([[-1.0, 0.0, 1.0]])))
        turn = place[0] + place[2] - 2.0 * place[1]
        turn -= (turn @ tangent[1]) * tangent[1]
        for number, (at, k) in enumerate(words, 1):
            if at == _E:
                found[0, number] = SIDES[abs(int(k))] * turn
    return found


def _closely_fitted(
    ramp: FittedRamps, curve: Curves, start: Floats, own: int, allowed: float, aside: Floats | None = None
) -> FittedPoints | None:
    """From ``start`` (1, n) [m] on, of which ``own`` is the motion that is there already; ``aside`` (1, n + 2, 3) [m]
    as of ``closest_points``."""
    parameter, reach, shortest, vertex = _polygons(ramp, curve, start, own, exact=False)
    if (np.diff(parameter) <= 0.0).any():
        return None
    points, largest = closest_points(
        curve, parameter, reach, shortest, CLOSE_ENOUGH * allowed, vertex, aside
    )
    if not np.isfinite(largest):
        return None
    return FittedPoints(points[0, 1:-1], curve.nearest(points, parameter)[0, 1:-1], own, largest)
