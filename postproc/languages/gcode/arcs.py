"""Arcs: centre and sweep from I J K, from R, or from a point between.

In the plane, with u, v the first and second axis of G17 (X, Y), G18 (Z, X), G19 (Y, Z) and w the third:
centre c = start + (i, j), or (i, j) where they are absolute.  With R: c = m + n sqrt(R^2 - d^2/4), m the middle between
start and end, d their distance, n the normal of the chord on the side that the sense and the sign of R choose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import arc_through

PLANES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])
"""Axes u, v, w of G17, G18, G19."""

SAME = 1e-9
"""[m] an arc whose end is as near to its start is a full circle."""

ABSOLUTE, RELATIVE, MOST = 1e-5, 1e-3, 1e-4
"""[m, 1, m] radii at start and end may differ by ABSOLUTE, or what the control allows instead, or by RELATIVE of the
radius, but by no more than MOST."""


@dataclass(frozen=True, eq=False)
class ArcGeometry:
    """centre (N, 3) [m], normal (N, 3), sweep (N,) > 0 [rad], in the frame of the program; wrong (N,): 0, or why there
    is none: 1 start or end not known, 2 no centre, 3 radii differ, 4 R too short or a full circle, 5 no plane,
    6 three points on a line."""

    centre: Floats
    normal: Floats
    sweep: Floats
    wrong: Ints


class ArcWords(NamedTuple):
    """What the words of N arcs state.

    counter (N,): G3; ijk (N, 3) [m], NaN where absent; absolute (N,) or (N, 3): of ijk; radius (N,) [m], NaN where
    absent; turns (N,) whole turns beyond the first.
    """

    counter: Bools
    ijk: Floats
    absolute: Bools
    radius: Floats
    turns: Floats


def arcs(
    start: Floats, end: Floats, plane: Ints, words: ArcWords, gap: Floats | float = ABSOLUTE
) -> ArcGeometry:
    """The arcs of N blocks.

    start, end (N, 3) [m]; plane (N,) 0, 1, 2, -1 not known; gap (N,) [m]: what the control allows the radii at start
    and end to differ by, whatever their size.
    """
    n = len(start)
    counter, ijk, absolute, radius, turns = words
    wrong = np.zeros(n, np.int64)
    rows = np.arange(n)
    axes = PLANES[np.maximum(plane, 0)]
    u, v, w = axes.T
    b = np.stack([start[rows, u], start[rows, v]], 1)
    e = np.stack([end[rows, u], end[rows, v]], 1)
    sense = np.where(counter, 1.0, -1.0)

    absolute = np.broadcast_to(absolute[:, None] if absolute.ndim == 1 else absolute, (n, 3))
    offset = np.stack([ijk[rows, u], ijk[rows, v]], 1)
    coordinate = np.stack([absolute[rows, u], absolute[rows, v]], 1)
    by_centre = np.isfinite(offset).any(axis=1)
    full = np.isnan(offset) & coordinate
    given = np.where(np.isnan(offset), 0.0, offset)
    centre = np.where(coordinate, given, b + given)

    chord = e - b
    d = np.hypot(chord[:, 0], chord[:, 1])
    by_radius = np.isfinite(radius) & ~by_centre
    with np.errstate(invalid="ignore", divide="ignore"):
        height = np.sqrt(np.maximum(radius**2 - d**2 / 4, 0.0))
        side = np.stack([-chord[:, 1], chord[:, 0]], 1) / d[:, None]
        apex = b + chord / 2 + side * (height * sense * np.sign(radius))[:, None]
        centre = np.where(by_radius[:, None], apex, centre)
        near = np.hypot(*(b - centre).T)
        far = np.hypot(*(e - centre).T)
        apart = np.abs(near - far) > np.minimum(np.maximum(gap, RELATIVE * np.maximum(near, far)), MOST)
        short = (np.abs(radius) < d / 2 - ABSOLUTE) | (d < SAME)

    angle = np.arctan2(b[:, 1] - centre[:, 1], b[:, 0] - centre[:, 0])
    stop = np.arctan2(e[:, 1] - centre[:, 1], e[:, 0] - centre[:, 0])
    sweep = np.mod(sense * (stop - angle), 2 * np.pi)
    sweep = np.where(d < SAME, 2 * np.pi, sweep) + 2 * np.pi * turns

    third = ijk[rows, w]
    wrong[~(by_centre | by_radius) | (full.any(axis=1) & by_centre) | (np.nan_to_num(third) != 0)] = 2
    wrong[by_centre & np.isfinite(radius)] = 2
    wrong[(wrong == 0) & by_radius & short] = 4
    wrong[(wrong == 0) & by_centre & (apart | (near < SAME))] = 3
    wrong[~np.isfinite(sweep) | (turns < 0)] = np.where(wrong == 0, 2, wrong)[
        ~np.isfinite(sweep) | (turns < 0)
    ]
    wrong[plane < 0] = 5
    unknown = ~(np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1))
    wrong[unknown & (wrong != 5) & (by_centre | by_radius)] = 1

    place = np.array(start)
    place[rows, u], place[rows, v] = centre.T
    normal = np.zeros((n, 3))
    normal[rows, w] = sense
    bad = wrong > 0
    place[bad], normal[bad], sweep[bad] = np.nan, np.nan, np.nan
    return ArcGeometry(place, normal, sweep, wrong)


def through(start: Floats, via: Floats, end: Floats, turns: Floats) -> ArcGeometry:
    """The arcs through ``start``, ``via`` and ``end`` (N, 3) [m], with ``turns`` (N,) full turns more."""
    centre, normal, sweep = arc_through(start, via, end)
    unknown = ~np.isfinite(np.concatenate([start, via, end], axis=1)).all(axis=1)
    wrong = np.where(unknown, 1, np.where(np.isnan(sweep) | ~(turns >= 0), 6, 0))
    bad = wrong > 0
    centre[bad], normal[bad] = np.nan, np.nan
    return ArcGeometry(centre, normal, np.where(bad, np.nan, sweep + 2 * np.pi * turns), wrong)
