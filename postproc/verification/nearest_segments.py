"""How far points are from a polygon, each from the part of it near the point: the largest of these distances.

Only the largest counts, so most points are done with the segment at which they are passed: where that is nearer than
the largest distance that is known, all of the polygon cannot be farther.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import lengths

FIRST, MORE = 64, 8
"""Points whose distance is found first, those with the farthest segments; how many times as many then."""


def largest_of_nearest(corners: Floats, last: Ints, point: Floats, near: tuple[Ints, Ints, Ints]) -> float:
    """[m] the largest distance of points (K, 3) [m] from their segments, 0 without a point; NaN where one is not known.

    ``corners`` (S, 3) [m]: segment k leads from corner k to the next one, but from ``last`` (S,), the last corner of
    its line, nowhere.  ``near``: of each point a segment (K,) that is probably the nearest, and the first (K,) of all
    that count and the one behind the last (K,).
    """
    guess, first, stop = near
    guess = np.maximum(np.minimum(guess, stop - 1), first)
    bound = np.empty(len(point))

    def fill(rows: slice) -> None:
        bound[rows] = _distance(corners, last, point[rows], guess[rows])

    each_block(fill, len(point))
    if np.isnan(bound).any():
        return float("nan")
    order = np.argsort(-bound, kind="stable")
    known, done, count = 0.0, 0, FIRST
    while done < len(order) and bound[order[done]] > known:
        some = order[done : done + count]
        known = max(known, float(_nearest(corners, last, point[some], first[some], stop[some]).max()))
        done, count = done + count, MORE * count
    return known


def _nearest(corners: Floats, last: Ints, point: Floats, first: Ints, stop: Ints) -> Floats:
    """(K,) [m] from each point the nearest of its segments, ``first`` (K,) to before ``stop`` (K,)."""
    best, at = np.full(len(point), np.inf), first.copy()
    active = np.arange(len(point))
    while len(active):
        best[active] = np.minimum(best[active], _distance(corners, last, point[active], at[active]))
        at[active] += 1
        active = active[at[active] < stop[active]]
    return best


def _distance(corners: Floats, last: Ints, point: Floats, segment: Ints) -> Floats:
    """(K,) [m] of each point from one segment (K,)."""
    start = np.clip(segment, 0, len(corners) - 1)
    end = np.minimum(start + 1, last[start])
    path, out = corners[end] - corners[start], point - corners[start]
    share = np.clip(np.sum(out * path, axis=1) / np.maximum(np.sum(path**2, axis=1), 1e-24), 0.0, 1.0)
    return lengths(out - share[:, None] * path)
