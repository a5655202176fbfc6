"""The blank: signed distances of a point to a box, a cylinder or a closed mesh, positive inside."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.compiled import compiled

BOX, CYLINDER, MESH = 0, 1, 2


class Blank(NamedTuple):
    """A blank in its own axes.

    frame (14,): kind (BOX, CYLINDER or MESH), lowest and highest corner [m] of the box around it, axis (0, 1, 2) of a
    cylinder; of a mesh the size [m] of a grid of cells from the lowest corner, how far distances are known [m], the
    numbers of cells, and where in ``lists`` the columns start.
    corners (F, 9) [m]: triangles of a mesh.  lists: of a mesh, where the triangles near each cell start (C + 1),
    whether the middle of each cell is inside (C), and those triangles; then where those above and below each
    column start (K + 1), and those triangles.
    """

    frame: Floats
    corners: Floats
    lists: Ints


_KIND, _LOW, _HIGH, _LENGTHWISE, _SIZE, _REACH, _SHAPE, _COLUMNS = 0, 1, 4, 7, 8, 9, 10, 13


def corners_of(blank: Blank) -> tuple[Floats, Floats]:
    """The lowest and the highest corner (3,) [m] of the box around the blank."""
    return blank.frame[_LOW:_HIGH], blank.frame[_HIGH:_LENGTHWISE]


def _simple(kind: int, low: Floats, high: Floats, lengthwise: int = 2) -> Blank:
    frame = np.array([kind, *low, *high, lengthwise, 1.0, 1.0, 1, 1, 1, 0], float)
    return Blank(frame, np.zeros((0, 9)), np.zeros(1, np.int64))


def box_blank(low: Floats, high: Floats) -> Blank:
    """A box between the corners low and high (3,) [m]."""
    return _simple(BOX, low, high)


def cylinder_blank(centre: Floats, diameter: float, height: float, lengthwise: int = 2) -> Blank:
    """A cylinder [m] with the middle of its foot on ``centre`` (3,), along axis 0, 1 or 2."""
    low, high = np.array(centre) - 0.5 * diameter, np.array(centre) + 0.5 * diameter
    low[lengthwise] = centre[lengthwise]
    high[lengthwise] = centre[lengthwise] + height
    return _simple(CYLINDER, low, high, lengthwise)


def mesh_blank(corners: Floats, cells: int = 500_000) -> Blank:
    """A blank of closed triangles, corners (F, 3, 3) [m], in a grid of about so many ``cells``."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size = float(max(np.cbrt(np.prod(high - low) / cells), np.max(high - low) / 1000.0))
    shape = np.maximum(np.ceil((high - low) / size).astype(np.int64), 1)
    frame = np.array([MESH, *low, *high, 2, size, size, *shape, 0], float)
    start = Blank(frame, np.ascontiguousarray(corners.reshape(-1, 9), float), np.zeros(1, np.int64))
    count, columns = int(np.prod(shape)), int(shape[0] * shape[1])
    near_first, near = _lists(*_near_pairs(start), count)
    over_first, over = _lists(*_over_pairs(start), columns)
    head = near_first + 2 * count + 1
    lists = np.concatenate([head, np.zeros(count, np.int64), near])
    frame[_COLUMNS] = len(lists)
    lists = np.concatenate([lists, over_first + len(lists) + columns + 1, over])
    blank = Blank(frame, start.corners, lists)
    _mark_solid(blank, lists[count + 1 : 2 * count + 1])
    return blank


def _lists(cell: Ints, triangle: Ints, count: int) -> tuple[Ints, Ints]:
    order = np.argsort(cell, kind="stable")
    first = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(cell, minlength=count), out=first[1:])
    return first, np.ascontiguousarray(triangle[order]) if len(order) else np.zeros(1, np.int64)


def _over_pairs(blank: Blank) -> tuple[Ints, Ints]:
    """Columns (P,) and the triangles (P,) whose box is over them."""
    corners, size = blank.corners.reshape(-1, 3, 3), blank.frame[_SIZE]
    shape = blank.frame[_SHAPE:_COLUMNS].astype(np.int64)
    ends = np.stack([corners.min(axis=1), corners.max(axis=1)])[:, :, :2] - blank.frame[_LOW : _LOW + 2]
    first, last = np.clip(np.floor(ends / size).astype(np.int64), 0, shape[:2] - 1)
    wide = last - first + 1
    counts = wide[:, 0] * wide[:, 1]
    triangle = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(counts) - counts, counts)
    column = (first[triangle, 0] + place // wide[triangle, 1]) * shape[1]
    return column + first[triangle, 1] + place % wide[triangle, 1], triangle


def _near_pairs(blank: Blank) -> tuple[Ints, Ints]:
    count = _near(blank, np.zeros(0, np.int64), np.zeros(0, np.int64))
    cell, triangle = np.zeros(count, np.int64), np.zeros(count, np.int64)
    _near(blank, cell, triangle)
    return cell, triangle


@compiled
def lent_blank(blank: Blank) -> Blank:
    """The same blank, for compiled code that does not count references to it."""
    return Blank(borrowed(blank.frame), borrowed(blank.corners), borrowed(blank.lists))


@compiled
def _near(blank: Blank, cell: Ints, triangle: Ints) -> int:
    """The cells to which each triangle is near, and that triangle, put into arrays that have room; their number."""
    count = 0
    blank, cell, triangle = lent_blank(blank), borrowed(cell), borrowed(triangle)
    frame, corners = blank.frame, blank.corners
    size, reach = frame[_SIZE], frame[_REACH]
    limit = reach + size * np.sqrt(0.75)
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    ny, nz = int(frame[_SHAPE + 1]), int(frame[_SHAPE + 2])
    for f in range(len(corners)):
        for k in range(3):
            low = min(corners[f, k], min(corners[f, k + 3], corners[f, k + 6])) - frame[_LOW + k] - reach
            high = max(corners[f, k], max(corners[f, k + 3], corners[f, k + 6])) - frame[_LOW + k] + reach
            first[k] = max(int(low / size), 0)
            last[k] = min(int(high / size), int(frame[_SHAPE + k]) - 1)
        for i in range(first[0], last[0] + 1):
            x = frame[_LOW] + (i + 0.5) * size
            for j in range(first[1], last[1] + 1):
                y = frame[_LOW + 1] + (j + 0.5) * size
                for k in range(first[2], last[2] + 1):
                    if _to_triangle(corners, f, x, y, frame[_LOW + 2] + (k + 0.5) * size) <= limit:
                        if len(cell):
                            cell[count], triangle[count] = (i * ny + j) * nz + k, f
                        count += 1
    return count


@compiled
def _mark_solid(blank: Blank, solid: Ints) -> None:
    blank = lent_blank(blank)
    frame = blank.frame
    nx, ny, nz = int(frame[_SHAPE]), int(frame[_SHAPE + 1]), int(frame[_SHAPE + 2])
    size = frame[_SIZE]
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                cell = (i * ny + j) * nz + k
                if blank.lists[cell] == blank.lists[cell + 1]:
                    x, y = frame[_LOW] + (i + 0.5) * size, frame[_LOW + 1] + (j + 0.5) * size
                    solid[cell] = _inside(blank, x, y, frame[_LOW + 2] + (k + 0.5) * size)


@compiled
def _inside(blank: Blank, x: float, y: float, z: float) -> bool:
    """Whether a ray upward leaves bodies of the mesh more or less often than it enters: bodies may overlap.

    An edge that two triangles share is seen by both as from the same end, so a ray meets exactly one of them.
    """
    frame, t = blank.frame, blank.corners
    i = min(max(int((x - frame[_LOW]) / frame[_SIZE]), 0), int(frame[_SHAPE]) - 1)
    j = min(max(int((y - frame[_LOW + 1]) / frame[_SIZE]), 0), int(frame[_SHAPE + 1]) - 1)
    column = int(frame[_COLUMNS]) + i * int(frame[_SHAPE + 1]) + j
    winds = 0
    for place in range(blank.lists[column], blank.lists[column + 1]):
        f = blank.lists[place]
        over = False
        for e in range(3):
            a, b = 3 * e, 3 * ((e + 1) % 3)
            if (t[f, a + 1] > y) != (t[f, b + 1] > y):
                if t[f, a + 1] > t[f, b + 1]:
                    a, b = b, a
                share = (y - t[f, a + 1]) / (t[f, b + 1] - t[f, a + 1])
                if x < t[f, a] + share * (t[f, b] - t[f, a]):
                    over = not over
        if over:
            ux, uy, uz = t[f, 3] - t[f, 0], t[f, 4] - t[f, 1], t[f, 5] - t[f, 2]
            vx, vy, vz = t[f, 6] - t[f, 0], t[f, 7] - t[f, 1], t[f, 8] - t[f, 2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            if nz != 0.0 and t[f, 2] - (nx * (x - t[f, 0]) + ny * (y - t[f, 1])) / nz > z:
                winds += 1 if nz > 0.0 else -1
    return winds != 0


@compiled
def _to_triangle(t: Floats, f: int, x: float, y: float, z: float) -> float:
    """Distance of a point to the triangle ``f`` of t (F, 9).  Source: C. Ericson, Real-Time Collision Detection,
    5.1.5."""
    ax, ay, az = t[f, 0], t[f, 1], t[f, 2]
    ux, uy, uz = t[f, 3] - ax, t[f, 4] - ay, t[f, 5] - az
    vx, vy, vz = t[f, 6] - ax, t[f, 7] - ay, t[f, 8] - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, r = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, r = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, r = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, r = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, r = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        r = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - r
    else:
        s, r = vb / (va + vb + vc), vc / (va + vb + vc)
    return np.sqrt((px - s * ux - r * vx) ** 2 + (py - s * uy - r * vy) ** 2 + (pz - s * uz - r * vz) ** 2)


@compiled
def blank_distance(blank: Blank, x: float, y: float, z: float) -> float:
    """Of a point [m], positive inside; of a mesh as far as its distances are known."""
    f = blank.frame
    in_box = min(min(x - f[1], f[4] - x), min(y - f[2], f[5] - y), min(z - f[3], f[6] - z))
    if f[_KIND] == BOX or in_box < 0.0:
        return in_box
    if f[_KIND] == CYLINDER:
        if f[_LENGTHWISE] == 0.0:
            u, v, k = y - 0.5 * (f[2] + f[5]), z - 0.5 * (f[3] + f[6]), 1
        elif f[_LENGTHWISE] == 1.0:
            u, v, k = z - 0.5 * (f[3] + f[6]), x - 0.5 * (f[1] + f[4]), 2
        else:
            u, v, k = x - 0.5 * (f[1] + f[4]), y - 0.5 * (f[2] + f[5]), 0
        return min(in_box, 0.5 * (f[_HIGH + k] - f[_LOW + k]) - np.sqrt(u * u + v * v))
    i = min(int((x - f[1]) / f[_SIZE]), int(f[_SHAPE]) - 1)
    j = min(int((y - f[2]) / f[_SIZE]), int(f[_SHAPE + 1]) - 1)
    k = min(int((z - f[3]) / f[_SIZE]), int(f[_SHAPE + 2]) - 1)
    cells = int(f[_SHAPE]) * int(f[_SHAPE + 1]) * int(f[_SHAPE + 2])
    cell = (i * int(f[_SHAPE + 1]) + j) * int(f[_SHAPE + 2]) + k
    best = f[_REACH]
    if blank.lists[cell] == blank.lists[cell + 1]:
        return best if blank.lists[cells + 1 + cell] else -best
    for place in range(blank.lists[cell], blank.lists[cell + 1]):
        best = min(best, _to_triangle(blank.corners, blank.lists[place], x, y, z))
    return best if _inside(blank, x, y, z) else -best


@compiled
def half_space(blank: Blank, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """An offset [m] and a unit normal so that offset + normal . p is nowhere less than the distance of a point p, and
    below zero at the point [m], which is outside: a side of the box around the blank, or a plane along a cylinder; the
    normal is 0 where there is none."""
    f = blank.frame
    best, axis, sign = np.inf, 0, 1.0
    for k, at in enumerate((x, y, z)):
        below, above = at - f[_LOW + k], f[_HIGH + k] - at
        if below < best:
            best, axis, sign = below, k, 1.0
        if above < best:
            best, axis, sign = above, k, -1.0
    if best <= 0.0:
        side = -f[_LOW + axis] if sign > 0.0 else f[_HIGH + axis]
        return (
            side,
            sign if axis == 0 else 0.0,
            sign if axis == 1 else 0.0,
            sign if axis == 2 else 0.0,
        )
    if f[_KIND] != CYLINDER:
        return 0.0, 0.0, 0.0, 0.0
    u = x - 0.5 * (f[_LOW] + f[_HIGH])
    v = y - 0.5 * (f[_LOW + 1] + f[_HIGH + 1])
    w = z - 0.5 * (f[_LOW + 2] + f[_HIGH + 2])
    lengthwise = int(f[_LENGTHWISE])
    u, v, w = (
        (0.0 if lengthwise == 0 else u),
        (0.0 if lengthwise == 1 else v),
        (0.0 if lengthwise == 2 else w),
    )
    size = np.sqrt(u * u + v * v + w * w)
    across = 1 if lengthwise == 0 else 0
    radius = 0.5 * (f[_HIGH + across] - f[_LOW + across])
    if size <= radius or size == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    u, v, w = u / size, v / size, w / size
    return radius + u * (x - size * u) + v * (y - size * v) + w * (z - size * w), -u, -v, -w
