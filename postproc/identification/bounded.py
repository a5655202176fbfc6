"""Linear least squares between bounds."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats

ROUNDING = 1e-10
"""Share of a column's and the target's length below which a slope is rounding."""


def bounded_least_squares(matrix: Floats, target: Floats, low: Floats, high: Floats) -> Floats:
    """(k,) x that makes ``matrix`` (n, k) @ x - ``target`` (n,) smallest between ``low`` <= 0 <= ``high`` (k,).

    Active sets from x = 0 (Stark and Parker, Computational Statistics 10 (1995)): the free coordinates go towards
    their least squares until the first one meets a bound and stays there; one at a bound that pulls inwards is freed.
    A few columns only: importing an optimizer takes longer than all such problems of a diagnosis.
    """
    count = matrix.shape[1]
    x, free = np.zeros(count), np.ones(count, bool)
    size = np.linalg.norm(matrix, axis=0) * max(float(np.linalg.norm(target)), 1e-300)
    for _ in range(10 * count):
        aim = x.copy()
        if free.any():
            rest = target - matrix[:, ~free] @ x[~free]
            aim[free] = np.linalg.lstsq(matrix[:, free], rest, rcond=None)[0]
        way = aim - x
        room = np.where(way > 0, high - x, low - x)
        share = np.ones(count)
        np.divide(room, way, out=share, where=free & (way != 0) & (np.abs(way) > np.abs(room)))
        least = float(share.min(initial=1.0))
        x = np.clip(x + least * way, low, high)
        if least < 1.0:
            met = free & (share <= least)
            x[met] = np.where(way > 0, high, low)[met]
            free &= ~met
            continue
        slope = matrix.T @ (target - matrix @ x)
        inwards = np.where(x >= high, -slope, slope) / np.maximum(size, 1e-300)
        inwards[free] = -np.inf
        if not (inwards > ROUNDING).any():
            break
        free[int(np.argmax(inwards))] = True
    return np.asarray(x)
