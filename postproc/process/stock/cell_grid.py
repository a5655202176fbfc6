"""Where the cells of a stock lie: around all that its sweeps may be near to, whatever the size of the blank."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.blank import Blank, corners_of
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import (
    ANGLE,
    CUTTER,
    LENGTH,
    RADIUS,
    arc_of,
    axis_at,
    tip_at,
    turn_of,
)

MOST_CELLS = 4_000_000
_MARGIN = 3.0  # cells: more than half a diagonal, the reach and the slack, each at most a cell
_COARSER = 1.02
_DIGITS = 1e-9  # cells: a point on the last face is in the last cell


def grid_around(blank: Blank, sweeps: Floats, cutters: Floats, size: float) -> tuple[Floats, Ints, float]:
    """Lowest corner (3,) [m], numbers (3,) and size [m] of the cells around what the sweeps may be near to in the
    blank, each at least ``size`` [m]: a blank that is larger than that costs nothing."""
    lowest, highest = corners_of(blank)
    around = np.array([[np.inf] * 3, [-np.inf] * 3])
    _box_around(sweeps, cutters, around)
    while True:
        low = np.clip(around[0] - _MARGIN * size, lowest, highest)
        high = np.clip(around[1] + _MARGIN * size, lowest, highest)
        shape = np.maximum(np.ceil((high - low) / size + _DIGITS), 1.0)
        if np.prod(shape) <= MOST_CELLS:
            return low, shape.astype(np.int64), size
        size *= _COARSER


@compiled
def _box_around(sweeps: Floats, cutters: Floats, around: Floats) -> None:
    """The corners of a box around all sweeps put into ``around`` (2, 3)."""
    sweeps, cutters = borrowed(sweeps), borrowed(cutters)
    box = np.zeros((2, 3))
    for j in range(len(sweeps)):
        sweep_box(sweeps, cutters, j, box)
        for k in range(3):
            around[0, k], around[1, k] = min(around[0, k], box[0, k]), max(around[1, k], box[1, k])


@compiled
def sweep_box(sweeps: Floats, cutters: Floats, j: int, box: Floats) -> None:
    """The corners [m] of a box around sweep ``j`` put into ``box`` (2, 3).  sweeps (M, 22), cutters (T, 6)."""
    c = int(sweeps[j, CUTTER])
    radius, length = cutters[c, RADIUS], cutters[c, LENGTH]
    box[0, :], box[1, :] = np.inf, -np.inf
    turn = turn_of(sweeps, j)
    parts = 1 if turn == 0.0 and sweeps[j, ANGLE] == 0.0 else 8
    for step in range(parts + 1):
        tip, axis = tip_at(sweeps, j, step / parts), axis_at(sweeps, j, step / parts)
        for k in range(3):
            disc = radius * np.sqrt(max(1.0 - axis[k] ** 2, 0.0))
            box[0, k] = min(box[0, k], tip[k] + min(length * axis[k], 0.0) - disc)
            box[1, k] = max(box[1, k], tip[k] + max(length * axis[k], 0.0) + disc)
    if parts > 1:  # what an arc rises above its chords
        bulge = length * (1.0 - np.cos(0.5 * turn / parts))
        if sweeps[j, ANGLE] != 0.0:
            bulge += arc_of(sweeps, j)[0] * (1.0 - np.cos(0.5 * sweeps[j, ANGLE] / parts))
        box[0, :] -= bulge
        box[1, :] += bulge
