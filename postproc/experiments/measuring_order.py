"""The order in which poses are measured."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints


def measuring_order(q: Floats, spacing: Floats) -> Ints:
    """(C,) an order of poses q (C, n) in which the robot travels little: always on to the nearest, from the start that
    makes the total travel shortest.  ``spacing`` (n,) [rad, m]: travels of the axes that take equally long."""
    travel = np.abs((q[:, None] - q[None]) / spacing).max(axis=2)
    count = len(q)
    orders = np.zeros((count, count), np.int64)
    orders[:, 0] = range(count)
    total, unvisited = np.zeros(count), ~np.eye(count, dtype=bool)
    for step in range(1, count):
        here = np.where(unvisited, travel[orders[:, step - 1]], np.inf)
        orders[:, step] = here.argmin(axis=1)
        total += here.min(axis=1)
        unvisited[range(count), orders[:, step]] = False
    return np.asarray(orders[total.argmin()])
