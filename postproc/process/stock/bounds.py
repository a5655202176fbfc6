"""Lower bounds of the distance to a sweep that cost a fraction of the distance itself.

Of a query's sweeps nearly all are farther away than the nearest.  Let the tool go from t = 0 to 1 along a line and its
axis turn by theta about its middle direction a.  Of a ball's round end, with the radius R, the middle stays within
R theta^2 / 8 of the chord of its way: the distance is at least that to the chord, less both.  Of any cutter the
distance at t is at least that of the cutter upright along a at the height of the middle of the line, less half of what
it rises along a, and less half of theta times the distance of the point from the tip.

The distance to a chord is convex, so around a place it is at least linear: of a ball four numbers bound the distance to
a sweep in all of a cell that lies below its middle.

The same two hold from above, with what is less added: convex functions that are nowhere less than the distance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Floats
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import (
    ACROSS,
    ANGLE,
    CORNER,
    CUTTER,
    MODE,
    RADIUS,
    ROUND,
    STRAIGHT,
    TAPER,
    Triple,
    axis_at,
    cutter_distance,
    swept_distance,
    tip_at,
    turn_of,
)

_KIND, _START, _CHORD, _INVERSE, _ALONG, _OFF, _HALF_TURN, _RISE, _CUTTER = 0, 1, 4, 7, 8, 11, 12, 13, 14
BOUND_COLUMNS = 15
"""Columns of a bound: 0 none, 1 of a ball, 2 of any cutter; start (3,) and chord (3,) [m] of the ball's middle, or of
the tip across the axis; inverse of the chord's square [1/m2], 0 of none; axis (3,) in the middle; distance [m] by which
it is less; half of the turn [rad]; how far [m] the ball's middle rises at most on either side, or the tip is from the
start at most; row of the cutter."""

Singles = NDArray[np.float32]
PLANE_COLUMNS = 4
"""Columns of a plane, in single precision: least distance [m] at the middle of a cell, and its gradient (3,)."""

NO_PLANE = -1.0  # m: a bound that nothing exceeds

_DIGITS = 1e-12  # m
_SINGLE = 1e-9  # m: more than the digits of a plane, and of a sum of them
_BULGE = 0.126  # of R theta^2: an arc above its chord, 1/8 and what follows up to half a rad
_LARGEST_TURN = 0.5


def may_be_bounded(sweeps: Floats) -> bool:
    """Whether any of sweeps (M, 22) has a bound: those straight across the spindle have a cheap distance, and arcs have
    none."""
    return bool(np.any((sweeps[:, MODE] != ACROSS) & (sweeps[:, MODE] != ROUND)))


@compiled
def set_bound(sweeps: Floats, cutters: Floats, j: int, bound: Floats) -> None:
    """``bound`` (BOUND_COLUMNS,) of sweep ``j``; sweeps (M, 22), cutters (T, 6)."""
    bound[:] = 0.0
    turn = turn_of(sweeps, j)
    mode = sweeps[j, MODE]
    if mode == ACROSS or sweeps[j, ANGLE] != 0.0 or turn > _LARGEST_TURN:
        return
    c = int(sweeps[j, CUTTER])
    radius, corner = cutters[c, RADIUS], cutters[c, CORNER]
    first, last = tip_at(sweeps, j, 0.0), tip_at(sweeps, j, 1.0)
    axis, start, end = axis_at(sweeps, j, 0.5), axis_at(sweeps, j, 0.0), axis_at(sweeps, j, 1.0)
    ball = cutters[c, TAPER] < 0.0 and radius <= corner
    rise = 0.0
    for k in range(3):
        bound[_ALONG + k] = axis[k]
        bound[_START + k] = first[k] + (corner * start[k] if ball else 0.0)
        bound[_CHORD + k] = last[k] - first[k] + (corner * (end[k] - start[k]) if ball else 0.0)
        rise += bound[_CHORD + k] * axis[k]
    square = 0.0
    for k in range(3):
        if not ball:  # across the axis, at the height of the middle
            bound[_CHORD + k] -= rise * axis[k]
            bound[_START + k] += 0.5 * rise * axis[k]
        square += bound[_CHORD + k] ** 2
    bound[_INVERSE] = 1.0 / square if square > 1e-20 else 0.0
    bound[_HALF_TURN] = 0.5 * turn
    bound[_CUTTER] = c
    if ball:
        bound[_KIND] = 1.0
        bound[_OFF] = _BULGE * radius * turn * turn + _DIGITS
        bound[_RISE] = 0.5 * abs(rise) + 0.25 * np.sqrt(square) * turn + 2.0 * bound[_OFF]
    else:
        bound[_KIND] = 2.0
        bound[_OFF] = 0.5 * abs(rise) + _DIGITS
        bound[_RISE] = np.sqrt(square) + 0.5 * abs(rise)


@compiled
def is_far(bounds: Floats, cutters: Floats, j: int, x: float, y: float, z: float, enough: float) -> bool:
    """Whether the bound alone says that the point [m] is farther than ``enough`` [m], which is not negative, from sweep
    ``j``.  bounds (M, BOUND_COLUMNS), cutters (T, 6)."""
    if len(bounds) == 0:
        return False
    kind = bounds[j, _KIND]
    if kind == 0.0:
        return False
    wx, wy, wz = x - bounds[j, _START], y - bounds[j, _START + 1], z - bounds[j, _START + 2]
    dx, dy, dz = bounds[j, _CHORD], bounds[j, _CHORD + 1], bounds[j, _CHORD + 2]
    ax, ay, az = bounds[j, _ALONG], bounds[j, _ALONG + 1], bounds[j, _ALONG + 2]
    t = (wx * dx + wy * dy + wz * dz) * bounds[j, _INVERSE]
    if kind == 1.0:
        t = min(max(t, 0.0), 1.0)
        ux, uy, uz = wx - t * dx, wy - t * dy, wz - t * dz
        least = enough + cutters[int(bounds[j, _CUTTER]), RADIUS] + bounds[j, _OFF]
        if ux * ux + uy * uy + uz * uz <= least * least:
            return False
        # above its middle the ball goes on as a cylinder
        wx, wy, wz = wx - 0.5 * dx, wy - 0.5 * dy, wz - 0.5 * dz
        above = wx * ax + wy * ay + wz * az + bounds[j, _RISE]
        return bool(
            above < 0.0 and above * above > (wx * wx + wy * wy + wz * wz) * bounds[j, _HALF_TURN] ** 2
        )
    away = np.sqrt(wx * wx + wy * wy + wz * wz) + bounds[j, _RISE]
    height = wx * ax + wy * ay + wz * az
    t = min(max(t, 0.0), 1.0)
    ux, uy, uz = wx - height * ax - t * dx, wy - height * ay - t * dy, wz - height * az - t * dz
    across = np.sqrt(ux * ux + uy * uy + uz * uz)
    d = cutter_distance(cutters, int(bounds[j, _CUTTER]), across, height)
    return bool(d - bounds[j, _OFF] - away * bounds[j, _HALF_TURN] > enough)


@compiled
def convex_distance(
    sweeps: Floats, cutters: Floats, bounds: Floats, j: int, x: float, y: float, z: float
) -> float:
    """A value that is nowhere less than a convex function of the point [m], which is nowhere less than the distance to
    sweep ``j``; inf where none is known.  sweeps (M, 22), cutters (T, 6), bounds (M, 15)."""
    mode = sweeps[j, MODE]
    if mode in (ACROSS, STRAIGHT):
        return swept_distance(sweeps, cutters, j, x, y, z, 0.0)
    if len(bounds) == 0 or bounds[j, _KIND] == 0.0:
        return np.inf
    wx, wy, wz = x - bounds[j, _START], y - bounds[j, _START + 1], z - bounds[j, _START + 2]
    dx, dy, dz = bounds[j, _CHORD], bounds[j, _CHORD + 1], bounds[j, _CHORD + 2]
    t = min(max((wx * dx + wy * dy + wz * dz) * bounds[j, _INVERSE], 0.0), 1.0)
    c = int(bounds[j, _CUTTER])
    if bounds[j, _KIND] == 1.0:
        ux, uy, uz = wx - t * dx, wy - t * dy, wz - t * dz
        return float(np.sqrt(ux * ux + uy * uy + uz * uz) - cutters[c, RADIUS] + bounds[j, _OFF])
    ax, ay, az = bounds[j, _ALONG], bounds[j, _ALONG + 1], bounds[j, _ALONG + 2]
    away = np.sqrt(wx * wx + wy * wy + wz * wz) + bounds[j, _RISE]
    height = wx * ax + wy * ay + wz * az
    ux, uy, uz = wx - height * ax - t * dx, wy - height * ay - t * dy, wz - height * az - t * dz
    d = cutter_distance(cutters, c, np.sqrt(ux * ux + uy * uy + uz * uz), height)
    return float(d + bounds[j, _OFF] + away * bounds[j, _HALF_TURN])


@compiled
def set_plane(
    bounds: Floats,
    cutters: Floats,
    j: int,
    point: Triple,
    half: float,
    slack: float,
    plane: Singles,
) -> None:
    """``plane`` (PLANE_COLUMNS,) of sweep ``j``, or of what it is where it is displaced by ``slack`` [m] at most,
    within ``half`` [m] of the middle ``point`` [m] of a cell; bounds (M, BOUND_COLUMNS), cutters (T, 6)."""
    x, y, z = point
    half += slack  # a point as far from a displaced sweep is within so much more of this one
    plane[:] = 0.0
    plane[0] = NO_PLANE
    if bounds[j, _KIND] != 1.0:
        return
    wx, wy, wz = x - bounds[j, _START], y - bounds[j, _START + 1], z - bounds[j, _START + 2]
    dx, dy, dz = bounds[j, _CHORD], bounds[j, _CHORD + 1], bounds[j, _CHORD + 2]
    t = min(max((wx * dx + wy * dy + wz * dz) * bounds[j, _INVERSE], 0.0), 1.0)
    ux, uy, uz = wx - t * dx, wy - t * dy, wz - t * dz
    wx, wy, wz = wx - 0.5 * dx, wy - 0.5 * dy, wz - 0.5 * dz
    above = wx * bounds[j, _ALONG] + wy * bounds[j, _ALONG + 1] + wz * bounds[j, _ALONG + 2]
    above += bounds[j, _RISE] + half
    far = np.sqrt(wx * wx + wy * wy + wz * wz) + half
    size = np.sqrt(ux * ux + uy * uy + uz * uz)
    if above >= 0.0 or -above <= far * bounds[j, _HALF_TURN] or size < half:
        return
    plane[0] = size - cutters[int(bounds[j, _CUTTER]), RADIUS] - bounds[j, _OFF] - slack - _SINGLE
    plane[1], plane[2], plane[3] = ux / size, uy / size, uz / size
