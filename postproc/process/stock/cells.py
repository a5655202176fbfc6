"""Which sweeps come near each cell of the blank: no map of heights, only lists of what to ask.

A point of the blank is stock until a sweep contains it.  The distance of the point to what is left is asked of the
sweeps that come near its cell; those after the first that covers the whole cell need not be asked.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.blank import Blank, blank_distance, lent_blank
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.bounds import (
    Singles,
    is_far,
)
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import (
    STEP,
    TIP_POINT,
    line_distance,
    swept_distance,
)

_DEEP = 0.125
"""Of the reach: a point that one sweep holds so deep needs no deeper one; lines through shallower points cross zero."""


class Stock(NamedTuple):
    """A blank with all that is removed from it.

    blank: see ``Blank``; sweeps (M, ROW), cutters (T, 6): see ``distance``; grid (5,): size [m] of the cells, how far
    distances are known [m], and the numbers of cells from the blank's lowest corner; first (C + 1,) and near
    (E,): the sweeps that come that near to each cell, ascending; stop (E,): the last of the sweeps from that of
    ``near`` on that go on in one line and are near.  bounds (M, B): of the sweeps, B columns, or of none; whoever
    changes a sweep sets its bound again.  planes (4, E): of the entries of ``near``, or of none without bounds.
    """

    blank: Blank
    sweeps: Floats
    bounds: Floats
    cutters: Floats
    grid: Floats
    first: Ints
    near: Ints
    stop: Ints
    planes: Singles


@compiled
def lent_stock(stock: Stock) -> Stock:
    """The same stock, for compiled code that does not count references to it."""
    return Stock(
        lent_blank(stock.blank),
        borrowed(stock.sweeps),
        borrowed(stock.bounds),
        borrowed(stock.cutters),
        borrowed(stock.grid),
        borrowed(stock.first),
        borrowed(stock.near),
        borrowed(stock.stop),
        borrowed(stock.planes),
    )


@compiled
def stock_distance(stock: Stock, x: float, y: float, z: float, time: int) -> float:
    """Of a point [m] to what is left of the blank before the sweep ``time``, positive inside, up to ``reach``."""
    return nearest_line(stock, x, y, z, time, 0.0)[0]


@compiled
def nearest_sweep(stock: Stock, x: float, y: float, z: float, time: int, depth: float) -> tuple[float, int]:
    """As ``stock_distance``, and the sweep whose surface is that near; -1 where it is that of the blank, or none is.

    Below zero it is no more than a bound, but down to ``depth`` [m] how far the point is in the sweep it is most in.
    """
    d, low, high = nearest_line(stock, x, y, z, time, depth)
    sweeps = stock.sweeps
    while low < high:  # of a line the sweep beside the point
        middle = (low + high + 1) // 2
        ahead = 0.0
        for k, at in enumerate((x, y, z)):
            ahead += (at - sweeps[middle, TIP_POINT + k]) * sweeps[middle, STEP + k]
        if ahead >= 0.0:
            low = middle
        else:
            high = middle - 1
    return d, low


@compiled
def nearest_line(
    stock: Stock, x: float, y: float, z: float, time: int, depth: float
) -> tuple[float, int, int]:
    """As ``nearest_sweep``, with the first and the last sweep of the line that is that near."""
    grid = stock.grid
    size, reach = grid[0], grid[1]
    owner, end = -1, -1
    best = blank_distance(stock.blank, x, y, z)
    if best <= 0.0:
        return max(best, -reach), owner, end
    best = min(best, reach)
    frame = stock.blank.frame
    i = min(int((x - frame[1]) / size), int(grid[2]) - 1)
    j = min(int((y - frame[2]) / size), int(grid[3]) - 1)
    k = min(int((z - frame[3]) / size), int(grid[4]) - 1)
    cell = (i * int(grid[3]) + j) * int(grid[4]) + k
    low, high = stock.first[cell], stock.first[cell + 1]
    start = low
    while low < high:  # the first that is not before ``time``
        middle = (low + high) // 2
        if stock.near[middle] < time:
            low = middle + 1
        else:
            high = middle
    near, stop, planes = stock.near[start:low], stock.stop[start:low], stock.planes
    bounded = planes.shape[1] > 0
    # views and single precision, which processors run faster along
    least, ux = planes[0, start:low], planes[1, start:low]
    uy, uz = planes[2, start:low], planes[3, start:low]
    dx = np.float32(x - frame[1] - (i + 0.5) * size)
    dy = np.float32(y - frame[2] - (j + 0.5) * size)
    dz = np.float32(z - frame[3] - (k + 0.5) * size)
    likely, lowest = -1, np.float32(np.inf)
    for entry in range(len(least)):
        at = least[entry] + ux[entry] * dx + uy[entry] * dy + uz[entry] * dz
        if at <= lowest:
            likely, lowest = entry, at
    if likely >= 0:  # most others are farther than the likely one, whose distance is asked first
        first, last = int(near[likely]), min(int(stop[likely]), time - 1)
        d = _distance(stock, first, last, x, y, z, max(best, depth))
        if d < best:
            best, owner, end = d, first, last
            if best <= -reach or (depth == 0.0 and best < -_DEEP * reach):
                return max(best, -reach), owner, end
        close, enough_single = 0, np.float32(max(best, depth))
        for entry in range(len(least)):
            close += least[entry] + ux[entry] * dx + uy[entry] * dy + uz[entry] * dz <= enough_single
        if close <= 1:
            return best, owner, end
    for entry in range(len(near) - 1, -1, -1):
        # on the positive side only a smaller distance counts
        enough = max(best, depth)
        if entry == likely or (
            bounded and least[entry] + ux[entry] * dx + uy[entry] * dy + uz[entry] * dz > enough
        ):
            continue
        first, last = int(near[entry]), min(int(stop[entry]), time - 1)
        if first == last and is_far(stock.bounds, stock.cutters, last, x, y, z, enough):
            continue
        d = _distance(stock, first, last, x, y, z, enough)
        if d < best:
            best, owner, end = d, first, last
            if best <= -reach:
                return -reach, owner, end
    return best, owner, end


@compiled
def _distance(stock: Stock, first: int, last: int, x: float, y: float, z: float, enough: float) -> float:
    """``swept_distance`` of a line of sweeps."""
    if first != last:
        return line_distance(stock.sweeps, stock.cutters, first, last, x, y, z, enough)
    return swept_distance(stock.sweeps, stock.cutters, last, x, y, z, enough)
