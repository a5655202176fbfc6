"""Points with normals on the surface that undeflected tools leave, and a mesh of the part.

The signed distance to what is left of the blank is known at any point; its zeros on the edges of a grid are the points.
They are exact (1e-10 m) whatever the grid: it only chooses where on the surface they are.  The mesh has a vertex in
every cell through which the surface goes, where the tangent planes of its points meet.  Source: T. Ju, F. Losasso, S.
Schaefer, J. Warren, Dual contouring of Hermite data, SIGGRAPH 2002, doi:10.1145/566654.566586.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import each_block
from postproc.base.units import MM
from postproc.part.part_figures import Surface
from postproc.process.stock.blank import corners_of
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.cells import Stock, lent_stock, nearest_sweep, stock_distance
from postproc.process.stock.compiled import compiled

POINTS, MOST_NODES, FINEST = 60_000, 6_000_000, 0.05 * MM
"""Points in all, about; nodes of the grid at most; its finest spacing [m]."""

_COARSE = 40_000  # nodes of the grid that estimates the area
_SHIFT = 0.37  # of the grid against the faces of the blank: no plane of it lies on a surface by its numbers
_EXACT, _AROUND = 1e-10, 1e-6  # m
_SMOOTH = 0.99  # slope of the distance, which is 1 but on edges
_FLATTEN = 0.05  # weight of the middle of the points against their planes


def find_surface(stock: Stock, count: int = POINTS) -> Surface:
    """About ``count`` points on the surface of what all sweeps of ``stock`` leave, and its mesh."""
    low, high = corners_of(stock.blank)
    span = high - low
    coarse = float(np.cbrt(np.prod(span) / _COARSE))
    crossed, _ = _crossings(stock, low, span, coarse)
    spacing = coarse * np.sqrt(max(len(crossed), 1) / count)
    spacing = float(max(spacing, np.cbrt(np.prod(span + spacing) / MOST_NODES), FINEST))
    edges, shape = _crossings(stock, low, span, spacing)
    origin = low - _SHIFT * spacing
    points, normals = np.empty((len(edges), 3)), np.empty((len(edges), 3))
    sweep = np.empty(len(edges), np.int64)

    def cross(part: slice) -> None:
        _cross(stock, origin, spacing, edges[part], points[part], normals[part], sweep[part])

    each_block(cross, len(edges), 2048)
    area = spacing**2 / np.maximum(np.abs(normals).sum(axis=1), 1.0)
    mesh = _mesh(edges, points, normals, origin, spacing, shape)
    return Surface(points, normals, sweep, area, spacing, *mesh)


def _crossings(stock: Stock, low: Floats, span: Floats, spacing: float) -> tuple[Ints, Ints]:
    """(K, 5) nodes i, j, k, axis of the edge from there, and whether the node is inside; the shape (3,) of the grid."""
    shape = np.ceil(span / spacing).astype(np.int64) + 2
    values = np.empty(tuple(shape))
    origin = low - _SHIFT * spacing

    def fill(part: slice) -> None:
        _fill(stock, origin, spacing, part.start, part.stop, values)

    each_block(fill, int(shape[0]), 2)
    inside = values > 0.0
    found = []
    for axis in range(3):
        one, other = np.split(inside, [-1], axis)[0], np.split(inside, [1], axis)[1]
        nodes = np.argwhere(one != other)
        found.append(np.column_stack([nodes, np.full(len(nodes), axis), one[tuple(nodes.T)]]))
    return np.concatenate(found).astype(np.int64), shape


@compiled
def _fill(stock: Stock, origin: Floats, spacing: float, first: int, last: int, values: Floats) -> None:
    """``values`` (I, J, K) of the layers from ``first`` to ``last``: the sign of the distance at every node."""
    stock, origin, values = lent_stock(stock), borrowed(origin), borrowed(values)
    count = values.shape[2]
    time = len(stock.sweeps)
    for i in range(first, last):
        for j in range(values.shape[1]):
            k = 0
            while k < count:
                d = stock_distance(
                    stock,
                    origin[0] + i * spacing,
                    origin[1] + j * spacing,
                    origin[2] + k * spacing,
                    time,
                )
                sign = 1.0 if d > 0.0 else -1.0
                stop = min(count, k + 1 + int(0.999 * abs(d) / spacing))
                while k < stop:  # nearer than the surface can be
                    values[i, j, k] = sign
                    k += 1


@compiled
def _cross(
    stock: Stock, origin: Floats, spacing: float, edges: Ints, points: Floats, normals: Floats, sweep: Ints
) -> None:
    """The zero on each of the ``edges`` (K, 5) put into ``points`` (K, 3), with normal and sweep."""
    stock, origin, edges = lent_stock(stock), borrowed(origin), borrowed(edges)
    points, normals, sweep = borrowed(points), borrowed(normals), borrowed(sweep)
    time = len(stock.sweeps)
    at, to = np.zeros(3), np.zeros(3)
    for e in range(len(edges)):
        axis = edges[e, 3]
        for k in range(3):
            at[k] = origin[k] + edges[e, k] * spacing
        a, b = 0.0, spacing
        fa = stock_distance(stock, at[0], at[1], at[2], time)
        to[:] = at
        to[axis] += b
        fb = stock_distance(stock, to[0], to[1], to[2], time)
        middle, f = 0.5 * spacing, 1.0
        for step in range(80):
            # of the secant that keeps both ends moving (Illinois); every third step halves
            middle = 0.5 * (a + b) if step % 3 == 2 or fa == fb else a - fa * (b - a) / (fb - fa)
            to[axis] = at[axis] + middle
            f = stock_distance(stock, to[0], to[1], to[2], time)
            if abs(f) < 0.1 * _EXACT or b - a < _EXACT:
                break
            if (f > 0.0) == (fa > 0.0):
                a, fa = middle, f
                fb *= 0.5
            else:
                b, fb = middle, f
                fa *= 0.5
        points[e] = to
        owner = nearest_sweep(stock, to[0], to[1], to[2], time, 0.0)[1]
        sweep[e] = owner if outward(stock, to, normals[e]) else -1


@compiled
def outward(stock: Stock, at: Floats, normal: Floats) -> bool:
    """The unit ``normal`` (3,) out of the material at the point ``at`` (3,) [m]; False on an edge, which has none."""
    time = len(stock.sweeps)
    to = at.copy()
    size = 0.0
    for k in range(3):
        to[k] = at[k] - _AROUND
        inner = stock_distance(stock, to[0], to[1], to[2], time)
        to[k] = at[k] + _AROUND
        normal[k] = inner - stock_distance(stock, to[0], to[1], to[2], time)
        to[k] = at[k]
        size += normal[k] * normal[k]
    size = np.sqrt(size)
    for k in range(3):
        normal[k] = normal[k] / size if size > 0.0 else 0.0
    return bool(size > 2.0 * _AROUND * _SMOOTH)


def _mesh(
    edges: Ints, points: Floats, normals: Floats, origin: Floats, spacing: float, shape: Ints
) -> tuple[Floats, Ints, Ints]:
    """Vertices (V, 3), triangles (F, 3), and the vertices (K, 4) of the cells around each of the ``edges`` (K, 5)."""
    axis = edges[:, 3]
    second, third = np.eye(3, dtype=np.int64)[(axis + 1) % 3], np.eye(3, dtype=np.int64)[(axis + 2) % 3]
    around = np.stack(
        [edges[:, :3], edges[:, :3] - second, edges[:, :3] - second - third, edges[:, :3] - third]
    )
    number = (around[..., 0] * shape[1] + around[..., 1]) * shape[2] + around[..., 2]
    cells, vertex = np.unique(number.T, return_inverse=True)
    vertex = vertex.reshape(-1, 4)
    count = len(cells)
    owner, each = vertex.ravel(), np.repeat(np.arange(len(edges)), 4)
    share = np.bincount(owner, minlength=count)
    middle = np.stack([np.bincount(owner, points[each, k], count) / share for k in range(3)], axis=1)
    n, off = normals[each], np.einsum("ki,ki->k", normals[each], points[each] - middle[owner])
    planes = np.empty((count, 3, 3))
    aim = np.empty((count, 3))
    for i in range(3):
        aim[:, i] = np.bincount(owner, n[:, i] * off, count)
        for j in range(3):
            planes[:, i, j] = np.bincount(owner, n[:, i] * n[:, j], count)
    planes += (_FLATTEN * share)[:, None, None] * np.eye(3)
    moved = np.linalg.solve(planes, aim[..., None])[..., 0]
    place = np.stack([cells // (shape[1] * shape[2]), cells // shape[2] % shape[1], cells % shape[2]], axis=1)
    corner = origin + place * spacing
    vertices = np.clip(middle + moved, corner, corner + spacing)
    inward = edges[:, 4] == 0  # the edge leads into the material
    quads = np.where(inward[:, None], vertex[:, ::-1], vertex)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return vertices, faces.astype(np.int32), vertex
