"""Proofs that a part of a cutter's surface touches no stock, from a few places of it.

What a convex cutter sweeps along a line is convex, and the distance to it a convex function: in the hull of some points
it is nowhere above the largest of theirs.  An arc lies in the triangle of its ends and of where its tangents there
meet; a patch of the cutter's surface, between two circles and two angles, in the hull of nine such points: three at the
ends and the tangents of its profile, each for the ends and the tangents around the axis.  So one sweep that holds these
has taken all of the patch away.  Where none is found the patch is halved.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.process.stock.blank import half_space
from postproc.process.stock.borrowed import borrowed, keep_alive
from postproc.process.stock.bounds import convex_distance
from postproc.process.stock.cells import Stock, nearest_line
from postproc.process.stock.compiled import compiled
from postproc.process.stock.cutter_circles import chip_of, circle_at, on_circle
from postproc.process.stock.distance import line_distance

_MOST_LOOKS = 64
_WIDEST = 30.0 * np.pi / 180
"""Of a patch at first: the sagitta of a wider one is seldom less than the depth of a sweep."""


@compiled
def touches_none(
    stock: Stock, pose: Floats, element: Floats, low: float, high: float, margin: float, gap: float, time: int
) -> bool:
    """Whether it is known that between the lengths ``low`` and ``high`` [m] of an ``element`` (8,) of a profile no edge
    cuts stock that is there before the sweep ``time``, but for what is thinner than ``margin`` or smaller than ``gap``
    [m].  pose (6, 3): of ``set_pose``."""
    first, last = _angles(pose, element, low, high)
    if last <= first:
        return False
    own = np.empty((_MOST_LOOKS + 16, 4))
    patches = borrowed(own)
    many = int(np.ceil((last - first) / _WIDEST))
    for k in range(many):
        patches[k, 0], patches[k, 1] = low, high
        patches[k, 2] = first + (last - first) * k / many
        patches[k, 3] = first + (last - first) * (k + 1) / many
    waiting, looks, proven = many, 0, True
    while waiting > 0:
        waiting -= 1
        patch = patches[waiting]
        looks += 1
        found = _is_gone(stock, pose, element, patch, margin, time)
        if found > 0 or (found == 0 and _is_small(element, patch, gap)):
            continue
        if found < 0 or looks + waiting >= _MOST_LOOKS:
            proven = False
            break
        _halve(element, patches, waiting)
        waiting += 2
    keep_alive(own)
    return proven


@compiled
def _angles(pose: Floats, element: Floats, low: float, high: float) -> tuple[float, float]:
    """Between which angles [rad] edges cut on the circles from ``low`` to ``high``; equal where nowhere."""
    first, last = np.inf, -np.inf
    for part in range(3):
        r, height, sine, cosine = circle_at(element, low + 0.5 * part * (high - low))
        _, _, _, middle, half = chip_of(pose, r, height, sine, cosine)
        if half < 0.0:
            continue
        if first < last:  # the same turn
            middle -= 2.0 * np.pi * np.round((middle - 0.5 * (first + last)) / (2.0 * np.pi))
        first, last = min(first, middle - half), max(last, middle + half)
    if first > last:
        return 0.0, 0.0
    return first, min(last, first + 2.0 * np.pi)


@compiled
def _is_gone(stock: Stock, pose: Floats, element: Floats, patch: Floats, margin: float, time: int) -> int:
    """1 where a ``patch`` (4,), lengths of profile [m] and angles [rad], touches no stock; -1 where its middle does, 0
    where neither is known."""
    low, high, first, last = patch[0], patch[1], patch[2], patch[3]
    r, height, _, _ = circle_at(element, 0.5 * (low + high))
    x, y, z = on_circle(pose, r, height, 0.5 * (first + last))
    d, owner, end = nearest_line(stock, x, y, z, time, 0.0)
    if d > margin:
        return -1
    widest = max(r, max(circle_at(element, low)[0], circle_at(element, high)[0]))
    if d + 0.5 * (high - low + widest * (last - first)) <= margin:
        return 1
    for attempt in range(2):
        piece = _taken_away(stock, x, y, z, owner, end)
        inside = True
        for k in range(9 if element[1] != 0.0 else 6):
            r, height = _hull_circle(element, low, high, k // 3)
            x, y, z = _hull_point(pose, r, height, first, last, k % 3)
            if _outside_of(stock, piece, x, y, z) > margin:
                inside = False
                break
        if inside:
            return 1
        if attempt == 0:  # what has taken away that corner may have taken the others, too
            d, owner, end = nearest_line(stock, x, y, z, time, 0.0)
    return 0


@compiled
def arc_bound(
    stock: Stock, pose: Floats, r: float, height: float, first: float, last: float, line: tuple[int, int]
) -> float:
    """[m] What the distance to the stock does not exceed on the arc from ``first`` to ``last`` [rad], less than half a
    turn, of the circle with the radius ``r`` at ``height`` [m]; inf where it may be above zero.

    line: the sweeps that are nearest at ``first``, of ``nearest_line``; pose (6, 3): of ``set_pose``.
    """
    x, y, z = on_circle(pose, r, height, first)
    piece = _taken_away(stock, x, y, z, line[0], line[1])
    most = _outside_of(stock, piece, x, y, z)
    for k in range(1, 3):
        if most > 0.0:
            return np.inf
        x, y, z = _hull_point(pose, r, height, first, last, k)
        most = max(most, _outside_of(stock, piece, x, y, z))
    return most if most <= 0.0 else np.inf


@compiled
def _hull_circle(element: Floats, low: float, high: float, k: int) -> tuple[float, float]:
    """Radius and height [m] of a circle: at the ``low`` and the ``high`` end of a part of a profile, and where its
    tangents there meet."""
    if k < 2:
        return circle_at(element, low if k == 0 else high)[:2]
    half = 0.5 * (high - low) / element[4]
    far = element[4] / np.cos(half)
    slope = low / element[4] + half
    return element[2] + far * np.sin(slope), element[3] - far * np.cos(slope)


@compiled
def _hull_point(
    pose: Floats, r: float, height: float, first: float, last: float, k: int
) -> tuple[float, float, float]:
    """[m] Of a circle: at the ``first`` and the ``last`` angle [rad], and where its tangents there meet."""
    if k == 2:
        return on_circle(pose, r / np.cos(0.5 * (last - first)), height, 0.5 * (first + last))
    return on_circle(pose, r, height, first if k == 0 else last)


@compiled
def _taken_away(
    stock: Stock, x: float, y: float, z: float, first: int, last: int
) -> tuple[int, int, float, float, float, float]:
    """A convex space without stock, about the point [m] if there is one: a line of sweeps, or a half space beside the
    blank."""
    if first >= 0:
        return first, last, 0.0, 0.0, 0.0, 0.0
    offset, nx, ny, nz = half_space(stock.blank, x, y, z)
    return -1, -1, offset, nx, ny, nz


@compiled
def _outside_of(
    stock: Stock, piece: tuple[int, int, float, float, float, float], x: float, y: float, z: float
) -> float:
    """[m] A convex function of the point that is nowhere less than its distance to a convex space without stock."""
    first, last, offset, nx, ny, nz = piece
    if first < 0:
        return offset + nx * x + ny * y + nz * z if nx * nx + ny * ny + nz * nz > 0.0 else np.inf
    if last > first:
        return line_distance(stock.sweeps, stock.cutters, first, last, x, y, z, 0.0)
    return convex_distance(stock.sweeps, stock.cutters, stock.bounds, first, x, y, z)


@compiled
def _is_small(element: Floats, patch: Floats, gap: float) -> bool:
    low, high = patch[0], patch[1]
    return bool(high - low < gap and circle_at(element, high)[0] * (patch[3] - patch[2]) < gap)


@compiled
def _halve(element: Floats, patches: Floats, k: int) -> None:
    """The patch ``k`` of ``patches`` (K, 4) replaced by its halves, across its longer side; the second comes next."""
    low, high, first, last = patches[k, 0], patches[k, 1], patches[k, 2], patches[k, 3]
    patches[k + 1, :] = patches[k]
    r = circle_at(element, 0.5 * (low + high))[0]
    if r * (last - first) > high - low:
        patches[k, 3] = patches[k + 1, 2] = 0.5 * (first + last)
    else:
        patches[k, 1] = patches[k + 1, 0] = 0.5 * (low + high)
