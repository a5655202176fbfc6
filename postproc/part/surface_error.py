"""How far the surface that deflected tools leave is from the one that is meant, along its normals.

At a point p with the outward normal n of the meant surface the error is the s at which p + s n lies on the surface that
is left: above zero where material remains, below where too much is gone.  The distance to what is left is exact at any
point, so the error is too.  Near an edge the normal may not meet that surface at all, but another one; there the error
is the distance to what is nearest.  Neither exceeds what the tool was displaced by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.part.surface import outward
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.cells import Stock, lent_stock, nearest_sweep
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import pose_distance

_EXACT = 1e-10  # m
_STEEP = 1.2
"""A normal that is longer than this many distances to the surface does not meet it where it belongs, unless the surface
there faces as the one that is meant: their normals have the inverse as the least cosine."""

_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class SurfaceError:
    """Of K points: error (K,) [m]; sweep (K,): which one left the surface there, -1 for the blank's own; share (K,):
    where along it, NaN for none; along_normal (K,): the normal meets that surface, which is not only the nearest."""

    error: Floats
    sweep: Ints
    share: Floats
    along_normal: Bools


def find_errors(nominal: Stock, rows: Floats, reach: float, points: Floats, normals: Floats) -> SurfaceError:
    """The errors at ``points`` (K, 3) with ``normals`` (K, 3) of what the sweeps ``rows`` (M, ROW) leave of the blank
    of ``nominal``; reach [m]: the largest displacement."""
    stock, _ = build_stock(nominal.blank, np.ascontiguousarray(rows), nominal.cutters, reach)
    error, share = np.empty(len(points)), np.empty(len(points))
    sweep, along_normal = np.empty(len(points), np.int64), np.empty(len(points), np.bool_)

    def look(part: slice) -> None:
        _errors(stock, points[part], normals[part], error[part], sweep[part], share[part], along_normal[part])

    each_block(look, len(points), 1024)
    return SurfaceError(error, sweep, share, along_normal)


@compiled
def _errors(
    stock: Stock,
    points: Floats,
    normals: Floats,
    error: Floats,
    sweep: Ints,
    share: Floats,
    along_normal: Bools,
) -> None:
    stock, points, normals = lent_stock(stock), borrowed(points), borrowed(normals)
    error, sweep, share = borrowed(error), borrowed(sweep), borrowed(share)
    along_normal = borrowed(along_normal)
    time, reach = len(stock.sweeps), stock.grid[1]
    at, there = np.zeros(3), np.zeros(3)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        f, owner = nearest_sweep(stock, x, y, z, time, reach)
        nearest, first = f, owner
        s, meets = 0.0, True
        for _ in range(60):
            if abs(f) < _EXACT or abs(s) > reach:
                break
            s += f  # never beyond the surface: the distance changes by at most the step
            f, owner = nearest_sweep(stock, x + s * nx, y + s * ny, z + s * nz, time, reach)
        if abs(s) > reach or abs(f) >= _EXACT:
            s, owner, meets = nearest, first, False
        elif abs(s) > _STEEP * abs(nearest) + _EXACT:
            at[0], at[1], at[2] = x + s * nx, y + s * ny, z + s * nz
            smooth = outward(stock, at, there)
            if not smooth or there[0] * nx + there[1] * ny + there[2] * nz < 1.0 / _STEEP:
                s, owner, meets = nearest, first, False
        error[i], sweep[i], along_normal[i] = s, owner, meets
        share[i] = np.nan if owner < 0 else nearest_share(stock, owner, x + s * nx, y + s * ny, z + s * nz)


@compiled
def nearest_share(stock: Stock, j: int, x: float, y: float, z: float) -> float:
    """The share of sweep ``j`` at which its cutter comes nearest to the point [m]."""
    sweeps, cutters = stock.sweeps, stock.cutters
    low, high = 0.0, 1.0
    t1, t2 = 1.0 - _GOLDEN, _GOLDEN
    f1, f2 = pose_distance(sweeps, cutters, j, t1, x, y, z), pose_distance(sweeps, cutters, j, t2, x, y, z)
    for _ in range(24):
        if f1 < f2:
            high, t2, f2 = t2, t1, f1
            t1 = high - _GOLDEN * (high - low)
            f1 = pose_distance(sweeps, cutters, j, t1, x, y, z)
        else:
            low, t1, f1 = t1, t2, f2
            t2 = low + _GOLDEN * (high - low)
            f2 = pose_distance(sweeps, cutters, j, t2, x, y, z)
    return 0.5 * (low + high)
