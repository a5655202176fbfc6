"""Which motion leaves a point of the part's surface: the last one whose tool touches it.

A tool touches a point X with outward normal n where X lies on its surface (distance d of X to the cutter about zero)
and the surface of the cutter looks against n there: its outward normal is -n, or, at an edge, -n lies between the
normals of its faces, so that the tangent plane of X supports the cutter.  A cutter is convex: on a straight motion d
is a convex function of the place, and has one minimum.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import turned
from postproc.base.units import DEG, MM
from postproc.compensation.desired_path import DesiredPath
from postproc.process.stock.cutters import Cutter

TOUCH = 0.06 * MM
"""Distance of a point to the cutter up to which it touches: chords and roundings of a program are below it."""

_SLOPE = 12 * DEG
_NEAR = 3 * MM
_BLOCK, _PAIRS = 64, 1 << 21
_SHARES, _ROUNDS = 9, 9
_EDGE = 60 * MM  # of a cutter for which no length of the edges is stated


class Visit(NamedTuple):
    """Of K points: ``row`` (K,) of the motion, -1 without one; ``share`` (K,) of its path; ``distance`` (K,) [m] to the
    cutter."""

    row: Ints
    share: Floats
    distance: Floats


@dataclass(frozen=True, eq=False)
class Contacts:
    """Of K points: ``last``, the last visit of a tool; ``before``, the one before it."""

    last: Visit
    before: Visit

    @property
    def touched(self) -> Bools:
        """(K,) some tool touches the point."""
        return np.asarray(self.last.row >= 0)


@dataclass(frozen=True, eq=False)
class CuttingMotions:
    """Motions that may leave a surface.

    path: of all N motions; rows (M,): those that cut, and that are known from their start; spindle (M, 3): unit vector,
    tip-ward, in tool axes; cutter (M,): index into ``cutters``.
    """

    path: DesiredPath
    rows: Ints
    spindle: Floats
    cutter: Ints
    cutters: tuple[Cutter, ...]

    def part(self, which: Ints | Bools) -> CuttingMotions:
        """Some of them (J,), by number or mask."""
        return CuttingMotions(
            self.path, self.rows[which], self.spindle[which], self.cutter[which], self.cutters
        )


def find_contacts(
    motions: CuttingMotions,
    point: Floats,
    normal: Floats,
    only: Mapping[int, Ints] | None = None,
    touch: float = TOUCH,
) -> Contacts:
    """The last visits of tools to points (K, 3) [m] with outward normals (K, 3), in the axes of the path.

    ``only``: number of a point -> rows (J,) of the motions that may have left it; ``touch`` [m]: distance up to which
    a tool touches.
    """
    which, at = _near_pairs(motions, point, max(_NEAR, touch))
    if only:
        keep = np.ones(len(which), bool)
        for number, rows in only.items():
            own = np.flatnonzero(which == number)
            keep[own] = np.isin(motions.rows[at[own]], rows)
        which, at = which[keep], at[keep]
    near = _may_touch(motions, point, which, at, max(10 * TOUCH, touch))
    which, at = which[near], at[near]
    share, distance, supports, aside = _closest(motions, point[which], normal[which], at)
    good = (np.abs(distance) <= touch) & supports
    which, row, share = which[good], motions.rows[at[good]], share[good]
    distance, aside = distance[good], aside[good]
    count = len(point)
    last = _last_visit(count, which, row, share, distance, aside, np.full(count, np.iinfo(np.int64).max))
    first = _first_row_of_visit(count, which, row, last.row)
    return Contacts(last, _last_visit(count, which, row, share, distance, aside, first))


def _near_pairs(motions: CuttingMotions, point: Floats, distance: float) -> tuple[Ints, Ints]:
    """(P,) numbers of points and (P,) of motions that may come as near to each other as ``distance`` [m].

    First blocks of motions by their boxes, then the motions of these by their chords.
    """
    empty = np.zeros(0, np.int64)
    count = len(motions.rows)
    if not count or not len(point):
        return empty, empty
    start, end = motions.path.start[motions.rows], motions.path.end[motions.rows]
    sagitta = np.zeros(count)
    arcs = np.flatnonzero(motions.path.arc[motions.rows])
    if len(arcs):
        sagitta[arcs] = motions.path.length[motions.rows[arcs]]
    high = np.array([min(cutter.edge_length, _EDGE) for cutter in motions.cutters])[motions.cutter]
    wide = np.array([cutter.radius for cutter in motions.cutters])[motions.cutter]
    reach = np.hypot(wide, high) + sagitta + distance
    low, top = np.minimum(start.position, end.position), np.maximum(start.position, end.position)
    edges = np.arange(0, count, _BLOCK)
    box_low = np.minimum.reduceat(low - reach[:, None], edges)
    box_top = np.maximum.reduceat(top + reach[:, None], edges)
    turn = np.nan_to_num(motions.path.angle[motions.rows], posinf=0.5)
    slack = sagitta + high * np.minimum(turn, 0.5) + distance
    pairs: list[tuple[Ints, Ints]] = []
    for block, (least, most) in enumerate(zip(box_low, box_top, strict=True)):
        inside = np.flatnonzero(((point >= least) & (point <= most)).all(axis=1))
        if not len(inside):
            continue
        at = np.arange(edges[block], min(edges[block] + _BLOCK, count))
        axis = -turned(end.rotation[at], motions.spindle[at])
        from_start = point[inside][:, None, :] - start.position[at][None]
        height = np.einsum("kmi,mi->km", from_start, axis)
        step = end.position[at] - start.position[at]
        rise = np.sum(step * axis, axis=1)
        # across the spindle no point of a cutter is farther than its radius
        out, aside = from_start - height[..., None] * axis, step - rise[:, None] * axis
        along = np.einsum("kmi,mi->km", out, aside) / np.maximum(np.sum(aside * aside, axis=1), 1e-18)
        out -= np.clip(along, 0.0, 1.0)[..., None] * aside
        near = np.einsum("kmi,kmi->km", out, out) <= (wide[at] + slack[at]) ** 2
        near &= np.maximum(height, height - rise) >= -slack[at]
        near &= np.minimum(height, height - rise) <= high[at] + slack[at]
        number, motion = np.nonzero(near)
        pairs.append((inside[number], at[motion]))
    if not pairs:
        return empty, empty
    return np.concatenate([one for one, _ in pairs]), np.concatenate([other for _, other in pairs])


def _may_touch(motions: CuttingMotions, point: Floats, which: Ints, at: Ints, touch: float) -> Bools:
    """(P,) pairs whose cutter comes as near as ``touch`` [m], by three places; a cutter is 1-Lipschitz."""
    near = np.zeros(len(which), bool)
    for first in range(0, len(which), _PAIRS // 8):
        part = slice(first, first + _PAIRS // 8)
        number, motion = which[part], at[part]
        length = motions.path.length[motions.rows[motion]]
        least = np.full(len(number), np.inf)
        for share in (1 / 6, 0.5, 5 / 6):
            distance, _ = _distances(motions, point[number], motion, np.full(len(number), share))
            least = np.minimum(least, distance)
        angle = np.nan_to_num(motions.path.angle[motions.rows[motion]], posinf=0.5)
        near[part] = least <= (length + angle * _EDGE) / 6 + touch
    return near


def _closest(
    motions: CuttingMotions, point: Floats, normal: Floats, at: Ints
) -> tuple[Floats, Floats, Bools, Floats]:
    """Of P pairs: share (P,) at which the cutter is closest, distance (P,) [m] there, whether it can touch there with
    this normal, and the distance (P,) [m] of the point to the spindle axis."""
    count = len(at)
    share, distance = np.zeros(count), np.full(count, np.inf)
    supports, aside = np.zeros(count, bool), np.full(count, np.inf)
    for first in range(0, count, _PAIRS // _SHARES):
        part = slice(first, first + _PAIRS // _SHARES)
        share[part], distance[part], supports[part], aside[part] = _closest_part(
            motions, point[part], normal[part], at[part]
        )
    return share, distance, supports, aside


def _closest_part(
    motions: CuttingMotions, point: Floats, normal: Floats, at: Ints
) -> tuple[Floats, Floats, Bools, Floats]:
    low, high = np.zeros(len(at)), np.ones(len(at))
    rows = motions.rows[at]
    kept, size = np.arange(len(at)), motions.path.length[rows]
    share, value = np.full(len(at), 0.5), np.full(len(at), np.inf)
    aside = np.full(len(at), np.inf)
    for _ in range(_ROUNDS):
        steps = np.linspace(0.0, 1.0, _SHARES)[:, None]
        places = low[kept] + steps * (high[kept] - low[kept])
        many = np.tile(kept, _SHARES)
        found, across = _distances(motions, point[many], at[many], places.ravel())
        # of places that are as close, as under a flat end, the one nearest to the axis
        found, across = found.reshape(_SHARES, -1), across.reshape(_SHARES, -1)
        best = np.argmin(found + 1e-3 * across, axis=0)
        column = np.arange(len(kept))
        share[kept], value[kept] = places[best, column], found[best, column]
        aside[kept] = across[best, column]
        width = (high[kept] - low[kept]) / (_SHARES - 1)
        # what is too far away at all places cannot come near between them
        may = found[best, column] - 2 * width * size[kept] <= TOUCH * 10
        low[kept] = np.maximum(share[kept] - width, 0.0)
        high[kept] = np.minimum(share[kept] + width, 1.0)
        kept = kept[may & (width * size[kept] > 1e-6)]
        if not len(kept):
            break
    near = np.flatnonzero(np.abs(value) <= 20 * TOUCH)
    supports = np.zeros(len(at), bool)
    supports[near] = _can_touch(motions, point[near], normal[near], at[near], share[near])
    return share, value, supports, aside


def _distances(motions: CuttingMotions, point: Floats, at: Ints, share: Floats) -> tuple[Floats, Floats]:
    """(P,) [m] of the points (P, 3) to the cutters, and to their axes, of motions ``at`` (P,) at ``share`` (P,)."""
    height, across, _, _ = _in_cutter(motions, point, at, share)
    return cutter_distances(_shapes(motions)[motions.cutter[at]], across, height), across


def _in_cutter(
    motions: CuttingMotions, point: Floats, at: Ints, share: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Height (P,) over the tip and distance (P,) from the axis [m], unit vectors (P, 3) to the spindle and outwards."""
    pose = motions.path.at(motions.rows[at], share)
    axis = -turned(pose.rotation, motions.spindle[at])
    from_tip = point - pose.position
    height = np.sum(from_tip * axis, axis=1)
    out = from_tip - height[:, None] * axis
    across = np.linalg.norm(out, axis=1)
    return height, across, axis, out / np.maximum(across, 1e-12)[:, None]


def _shapes(motions: CuttingMotions) -> Floats:
    return np.array([cutter.numbers for cutter in motions.cutters])


def _can_touch(motions: CuttingMotions, point: Floats, normal: Floats, at: Ints, share: Floats) -> Bools:
    """(P,) whether the surface of the cutter there looks against the normal."""
    height, across, axis, out = _in_cutter(motions, point, at, share)
    shapes = _shapes(motions)[motions.cutter[at]]
    step = 0.01 * MM
    slopes = [
        cutter_distances(shapes, across + step * r, height + step * h)
        - cutter_distances(shapes, across - step * r, height - step * h)
        for r, h in ((1.0, 0.0), (0.0, 1.0))
    ]
    # seen from the axis of a flat end there is no outward direction, and no slope across either
    surface = slopes[0][:, None] * out + slopes[1][:, None] * axis
    surface /= np.maximum(np.linalg.norm(surface, axis=1), 1e-12)[:, None]
    along = -np.sum(surface * normal, axis=1) >= np.cos(_SLOPE)
    # the tangent plane against the farthest that the cutter reaches in its direction
    up = -np.sum(normal * axis, axis=1)
    side = np.sqrt(np.maximum(1.0 - up * up, 0.0))
    reach = support(shapes, side, up)
    place = height * up - across * np.sum(out * normal, axis=1)
    return np.asarray(along | (place - reach >= -TOUCH))


def cutter_distances(shapes: Floats, across: Floats, height: Floats) -> Floats:
    """(P,) [m] signed distances of points ``across`` (P,) from the axis and ``height`` (P,) over the tip to cutters;
    shapes (P, 6): as of ``Cutter.numbers``."""
    radius, corner, length, tip, tangent, cosine = shapes.T
    out, below = across - (radius - corner), corner - height
    face = np.maximum(out, below)
    round_edge = (out > 0.0) & (below > 0.0)
    distance = np.where(round_edge, np.hypot(out, below), face) - corner
    distance = np.where(
        tangent >= 0.0, np.maximum(distance, (across - tip - height * tangent) * cosine), distance
    )
    return np.asarray(np.maximum(distance, height - np.minimum(length, _EDGE)))


def support(shapes: Floats, side: Floats, up: Floats) -> Floats:
    """(P,) [m] how far cutters reach from the tip in a direction with the parts ``side`` (P,) across and ``up`` (P,)
    along the axis; shapes (P, 6)."""
    radius, corner, length, tip, tangent, _ = shapes.T
    high = np.minimum(length, _EDGE)
    rounded = (radius - corner) * side + corner + corner * up
    taper = np.where(tangent > 0.0, (radius - tip) / np.where(tangent > 0.0, tangent, 1.0), 0.0)
    cone = np.maximum(tip * side, radius * side + np.minimum(taper, high) * up)
    body = radius * side + high * up
    return np.asarray(np.maximum(np.where(tangent >= 0.0, cone, rounded), body))


def _last_visit(
    count: int, which: Ints, row: Ints, share: Floats, distance: Floats, aside: Floats, before: Ints
) -> Visit:
    """The last visit to each of ``count`` points of motions before ``before`` (count,); pairs (P,).

    Motions that follow each other are one visit: of these the one whose cutter comes closest.
    """
    ended = np.full(count, -1, np.int64)
    early = np.flatnonzero(row < before[which])
    np.maximum.at(ended, which[early], row[early])
    first = _first_row_of_visit(count, which[early], row[early], ended)
    inside = early[row[early] >= first[which[early]]]
    # as deep as another to a micrometre: the one nearest to the axis
    order = inside[
        np.lexsort((row[inside], aside[inside], np.round(np.abs(distance[inside]), 6), which[inside]))
    ]
    number, at = np.unique(which[order], return_index=True)
    visit = Visit(np.full(count, -1, np.int64), np.full(count, np.nan), np.full(count, np.nan))
    visit.row[number] = row[order[at]]
    visit.share[number], visit.distance[number] = share[order[at]], distance[order[at]]
    return visit


def _first_row_of_visit(count: int, which: Ints, row: Ints, last: Ints) -> Ints:
    """(count,) the first row of the run of rows without a gap that ends with ``last`` (count,)."""
    order = np.lexsort((row, which))
    which, row = which[order], row[order]
    first = last.copy()
    if not len(row):
        return first
    new = np.ones(len(row), bool)
    new[1:] = (which[1:] != which[:-1]) | (row[1:] > row[:-1] + 1)
    start = row[np.flatnonzero(new)]
    run = np.cumsum(new) - 1
    own = row == last[which]
    first[which[own]] = start[run[own]]
    return first
