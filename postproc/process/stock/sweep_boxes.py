"""Boxes around what a cutter sweeps: which cells of a blank are looked at for a sweep."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
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
