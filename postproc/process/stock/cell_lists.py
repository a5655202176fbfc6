"""The lists of the sweeps that come near each cell of the blank, from what each sweep is near to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.process.stock.blank import Blank, blank_distance, corners_of
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.bounds import (
    BOUND_COLUMNS,
    PLANE_COLUMNS,
    Singles,
    is_far,
    may_be_bounded,
    set_bound,
    set_plane,
)
from postproc.process.stock.cells import Stock, lent_stock
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import (
    ACROSS,
    ANGLE,
    AXIS,
    CUTTER,
    LENGTH,
    MODE,
    RADIUS,
    REMOVES,
    STEP,
    TIP_POINT,
    arc_of,
    axis_at,
    cutter_distance,
    swept_distance,
    tip_at,
    turn_of,
)
from postproc.process.stock.memory_need import check_memory

CELL = 0.125  # radii of the smallest cutter
MOST_CELLS = 4_000_000
LARGEST_CELL, SMALLEST_CELL = 4e-3, 0.25e-3  # m
_SAME = 1e-12  # m, and of unit vectors
_RUN = 4.0  # radii: of the part of a line whose sweeps are listed together
_THREADS = 4
"""More than processors only share what they do."""


def build_stock(
    blank: Blank, sweeps: Floats, cutters: Floats, reach: float = 0.0, slack: float = 0.0
) -> tuple[Stock, Floats]:
    """The stock of sweeps (M, 22) by cutters (T, 6), and heights (M, 2) [m] for each sweep.

    The heights are the lowest and highest above its tip at which it may meet stock, inf and -inf where it meets none.
    ``reach`` [m]: distances are known so far at least.  ``slack`` [m]: by so much the sweeps may still be displaced,
    each by another shift, without being listed again.  Refusal STK031: more memory is needed than is free.
    """
    low, high = corners_of(blank)
    span = high - low
    radius = float(cutters[:, RADIUS].min()) if len(cutters) else LARGEST_CELL
    size = min(max(CELL * radius, SMALLEST_CELL), LARGEST_CELL)
    size = max(size, reach, slack, float(np.cbrt(np.prod(span) / MOST_CELLS)))
    while np.prod(np.ceil(span / size)) > 2 * MOST_CELLS:  # thin blanks
        size *= 1.2
    shape = np.maximum(np.ceil(span / size).astype(np.int64), 1)
    cells = int(np.prod(shape))
    none, plain = np.zeros(1, np.int32), np.zeros((PLANE_COLUMNS, 0), np.float32)
    grid = np.array([size, max(0.5 * size, reach), *shape], float)
    bounds = np.zeros((len(sweeps) if may_be_bounded(sweeps) else 0, BOUND_COLUMNS))
    _set_bounds(sweeps, cutters, bounds)
    stock = Stock(blank, sweeps, bounds, cutters, grid, np.zeros(1, np.int64), none, none, plain)
    count, covered = np.zeros(cells, np.int64), np.full(cells, np.iinfo(np.int32).max, np.int32)
    _mark_outside(stock, covered)
    live = np.full((_THREADS, len(sweeps), 2), [np.inf, -np.inf])
    marks = [np.zeros(1 << 16, np.uint8) for _ in range(_THREADS)]
    joins, empty = _go_on(sweeps), np.zeros(0, np.int32)

    def list_all(lists: tuple[Ints, Ints, Ints, Singles]) -> None:
        def each(part: slice) -> None:
            k = part.start
            marks[k] = _list(stock, joins, lists, covered, live[k], (_THREADS, k), slack, marks[k])

        each_block(each, _THREADS, 1)

    list_all((count, empty, empty, plain))
    first = np.zeros(cells + 1, np.int64)
    np.cumsum(count, out=first[1:])
    entries = max(int(first[-1]), 1)
    bounded = entries if len(bounds) else 0
    check_memory(len(sweeps), cells, entries, bounded)
    near, stop = (np.zeros(entries, np.int32) for _ in range(2))
    planes = np.zeros((PLANE_COLUMNS, bounded), np.float32)
    list_all((first[:-1].copy(), near, stop, planes))
    ends = np.column_stack([live[:, :, 0].min(axis=0), live[:, :, 1].max(axis=0)])
    return stock._replace(first=first, near=near, stop=stop, planes=planes), ends


def _go_on(sweeps: Floats) -> Bools:
    """(M,) sweeps that go on along the line of the one before, with the same cutter, across the spindle."""
    joins = np.zeros(len(sweeps), bool)
    step, tip = sweeps[:, STEP : STEP + 3], sweeps[:, TIP_POINT : TIP_POINT + 3]
    size = np.linalg.norm(step, axis=1)
    across = np.linalg.norm(np.cross(step[1:], step[:-1]), axis=1)
    joins[1:] = (
        np.all(sweeps[1:, [MODE, CUTTER, REMOVES]] == sweeps[:-1, [MODE, CUTTER, REMOVES]], axis=1)
        & np.all(np.abs(sweeps[1:, AXIS : AXIS + 3] - sweeps[:-1, AXIS : AXIS + 3]) < _SAME, axis=1)
        & np.all(np.abs(tip[1:] - tip[:-1] - step[:-1]) < _SAME, axis=1)
        & (across <= 1e-9 * size[1:] * size[:-1])
        & (np.einsum("mi,mi->m", step[1:], step[:-1]) > 0.0)
    )
    return joins & (sweeps[:, MODE] == ACROSS)


@compiled
def _set_bounds(sweeps: Floats, cutters: Floats, bounds: Floats) -> None:
    sweeps, cutters, bounds = borrowed(sweeps), borrowed(cutters), borrowed(bounds)
    for j in range(len(bounds)):
        set_bound(sweeps, cutters, j, bounds[j])


@compiled
def _mark_outside(stock: Stock, covered: Ints) -> None:
    stock = lent_stock(stock)
    blank, size = stock.blank, stock.grid[0]
    low = blank.frame[1:4]
    shape = stock.grid[2:].astype(np.int64)
    half = size * np.sqrt(0.75)
    for i in range(shape[0]):
        for j in range(shape[1]):
            for k in range(shape[2]):
                x = low[0] + (i + 0.5) * size
                y = low[1] + (j + 0.5) * size
                z = low[2] + (k + 0.5) * size
                # of a mesh distances are known up to its reach only
                if blank_distance(blank, x, y, z) < -half:
                    covered[(i * shape[1] + j) * shape[2] + k] = -1


@compiled
def _sweep_box(sweeps: Floats, cutters: Floats, j: int, box: Floats) -> None:
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


@compiled
def _widest(cutters: Floats, c: int, height: float, limit: float, outer: bool) -> float:
    """[m] The largest distance from the axis at which a point at ``height`` [m] is within ``limit`` [m] of the cutter,
    to 1e-9 m from above with ``outer``, else from below; -1 where there is none."""
    low, high = 0.0, cutters[c, RADIUS] + limit
    if high < 0.0 or cutter_distance(cutters, c, 0.0, height) > limit:
        return -1.0
    if cutter_distance(cutters, c, high, height) <= limit:
        return high
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        if cutter_distance(cutters, c, middle, height) <= limit:
            low = middle
        else:
            high = middle
    return high if outer else low


@compiled
def _run_end(sweeps: Floats, cutters: Floats, joins: Bools, s: int) -> int:
    """The last sweep of the part of a line that starts with ``s``, some radii long."""
    e, long, most = s, 0.0, _RUN * cutters[int(sweeps[s, CUTTER]), RADIUS]
    while e + 1 < len(sweeps) and joins[e + 1] and long < most:
        e += 1
        long += np.sqrt(sweeps[e, STEP] ** 2 + sweeps[e, STEP + 1] ** 2 + sweeps[e, STEP + 2] ** 2)
    return e


@compiled
def _list(
    stock: Stock,
    joins: Bools,
    lists: tuple[Ints, Ints, Ints, Singles],
    covered: Ints,
    live: Floats,
    turn: tuple[int, int],
    slack: float,
    marks: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """What is listed of each cell counted, or put into its place where ``near`` has room for it.

    lists: numbers (C,) of each cell, or where its own start, and ``near``, ``stop`` and ``planes``.  The sweeps of a
    line, of which each ``joins`` (M,) the one before it, are looked at together: which of them are near a cell, and
    which covers it first, follows from where the cell is along the line.  With a ``slack`` each is listed for itself.
    turn: of so many threads that of this one; each has other cells, and live (M, 2) of its own.  marks (K,): a bit for
    each cell that was looked at, whether a sweep of no line is near; counting writes them, and returns them.
    """
    stock, joins, live, covered = lent_stock(stock), borrowed(joins), borrowed(live), borrowed(covered)
    count, near, stop = borrowed(lists[0]), borrowed(lists[1]), borrowed(lists[2])
    planes = borrowed(lists[3])
    sweeps, cutters, size, fill = stock.sweeps, stock.cutters, stock.grid[0], len(near) > 0
    low = stock.blank.frame[1:4]
    shape = stock.grid[2:].astype(np.int64)
    half = size * np.sqrt(0.75)
    limit = half + stock.grid[1] + slack
    box, other = np.zeros((2, 3)), np.zeros((2, 3))
    first, last = np.zeros(3, np.int64), np.zeros(3, np.int64)
    ends, way, layers = np.zeros(len(sweeps) + 1), np.zeros(3), np.zeros((2, shape[2]))
    e, mark = -1, 0
    while e + 1 < len(sweeps):
        s = e + 1
        e = _run_end(sweeps, cutters, joins, s)
        _sweep_box(sweeps, cutters, s, box)
        if e > s:
            _sweep_box(sweeps, cutters, e, other)
            for k in range(3):
                box[0, k], box[1, k] = min(box[0, k], other[0, k]), max(box[1, k], other[1, k])
        outside = False
        for k in range(3):
            below, above = (box[0, k] - limit - low[k]) / size, (box[1, k] + limit - low[k]) / size
            outside = outside or above < 0.0 or below > shape[k]
            first[k], last[k] = int(max(below, 0.0)), int(min(above, shape[k] - 1.0))
        if outside:
            continue
        removes = sweeps[s, REMOVES] > 0.0
        line = e > s
        if line:  # where its sweeps end along it
            way[:] = sweeps[e, TIP_POINT : TIP_POINT + 3] + sweeps[e, STEP : STEP + 3]
            way -= sweeps[s, TIP_POINT : TIP_POINT + 3]
            way /= np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
            for m in range(s, e + 1):
                ends[m - s + 1] = ends[m - s] + (
                    sweeps[m, STEP] * way[0] + sweeps[m, STEP + 1] * way[1] + sweeps[m, STEP + 2] * way[2]
                )
        tip0, tip1 = tip_at(sweeps, s, 0.0), tip_at(sweeps, s, 1.0)
        axis0, axis1 = axis_at(sweeps, s, 0.0), axis_at(sweeps, s, 1.0)
        c = int(sweeps[s, CUTTER])
        upright = line and abs(axis0[2]) > 1.0 - 1e-15
        if upright:  # then the height is that of the layer
            for k in range(first[2], last[2] + 1):
                h0 = (low[2] + (k + 0.5) * size - tip0[2]) * axis0[2]
                layers[0, k] = _widest(cutters, c, h0, limit, True)
                layers[1, k] = _widest(cutters, c, h0, -half - slack, False)
        start = first[0] + (turn[1] - first[0]) % turn[0]
        for i in range(start, last[0] + 1, turn[0]):
            x = low[0] + (i + 0.5) * size
            for j in range(first[1], last[1] + 1):
                y = low[1] + (j + 0.5) * size
                for k in range(first[2], last[2] + 1):
                    cell = (i * shape[1] + j) * shape[2] + k
                    if covered[cell] < s:
                        continue
                    z = low[2] + (k + 0.5) * size
                    if fill and not line:
                        mark += 1
                        if marks[(mark - 1) >> 3] >> ((mark - 1) & 7) & 1 == 0:
                            continue
                    # near is enough: the list of a sweep that is close but does not touch must not stay empty
                    h0 = (x - tip0[0]) * axis0[0] + (y - tip0[1]) * axis0[1] + (z - tip0[2]) * axis0[2]
                    h1 = (x - tip1[0]) * axis1[0] + (y - tip1[1]) * axis1[1] + (z - tip1[2]) * axis1[2]
                    near_first, near_last, covers = s, s, -1
                    if line:
                        outer = layers[0, k] if upright else _widest(cutters, c, h0, limit, True)
                        if outer < 0.0:
                            continue
                        inner = layers[1, k] if upright else _widest(cutters, c, h0, -half - slack, False)
                        ux = x - tip0[0] - h0 * axis0[0]
                        uy = y - tip0[1] - h0 * axis0[1]
                        uz = z - tip0[2] - h0 * axis0[2]
                        along = ux * way[0] + uy * way[1] + uz * way[2]
                        beside = ux * ux + uy * uy + uz * uz - along * along
                        wide = outer * outer - beside
                        if wide < 0.0:
                            continue
                        wide = np.sqrt(wide)
                        if along + wide < 0.0 or along - wide > ends[e - s + 1]:
                            continue
                        near_first = s + _place_of(ends, e - s + 1, along - wide)
                        near_last = s + _place_of(ends, e - s + 1, along + wide)
                        if inner >= 0.0 and inner * inner >= beside:
                            wide = np.sqrt(inner * inner - beside)
                            if along + wide >= 0.0 and along - wide <= ends[e - s + 1]:
                                covers = s + _place_of(ends, e - s + 1, along - wide)
                    elif not fill:
                        d = 2.0 * limit
                        if not is_far(stock.bounds, cutters, s, x, y, z, limit):
                            d = swept_distance(sweeps, cutters, s, x, y, z, limit)
                        if mark >> 3 >= len(marks):
                            marks = np.concatenate((marks, np.zeros(len(marks), np.uint8)))
                        mark += 1
                        if d > limit:
                            continue
                        marks[(mark - 1) >> 3] |= np.uint8(1 << ((mark - 1) & 7))
                        covers = s if d <= -half - slack else -1
                    near_last = min(near_last, covered[cell])
                    if covers >= 0 and removes:
                        near_last = min(near_last, covers)
                    if fill:
                        for m in range(near_first, near_last + 1 if removes else near_first):
                            if slack == 0.0 and m > near_first:
                                break
                            near[count[cell]] = m
                            stop[count[cell]] = near_last if slack == 0.0 else m
                            if planes.shape[1]:
                                plane = planes[:, count[cell]]
                                set_plane(stock.bounds, cutters, m, (x, y, z), half, slack, plane)
                            count[cell] += 1
                        continue
                    for m in range(near_first, near_last + 1):
                        live[m, 0] = min(live[m, 0], min(h0, h1) - half - slack)
                        live[m, 1] = max(live[m, 1], max(h0, h1) + half + slack)
                    if removes:
                        many = max(near_last + 1 - near_first, 0)
                        count[cell] += many if slack > 0.0 else min(many, 1)
                        if covers >= 0:
                            covered[cell] = min(covers, covered[cell])
    return marks


@compiled
def _place_of(ends: Floats, count: int, along: float) -> int:
    """Which of ``count`` sweeps of a line that end at ``ends`` (count + 1,) [m] holds the place ``along`` [m]."""
    low, high = 0, count - 1
    while low < high:
        middle = (low + high) // 2
        if ends[middle + 1] < along:
            low = middle + 1
        else:
            high = middle
    return low
