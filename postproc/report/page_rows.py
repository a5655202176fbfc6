"""Which motions a page shows: the worst of them in a table, and as many in its figures as a browser draws at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.correct import CorrectionResult

PLACES = 12
"""Worst places on the page, with their text."""

SHOWN = 50_000
"""Motions that the figures of a page show at most."""


def worst_rows(
    result: CorrectionResult, scope: Bools, between: Floats, corrected: bool
) -> list[tuple[int, str]]:
    """Rows of the largest errors in ``scope`` (N,) and why: before, after, ``between`` points (N,) [m]; the largest of
    each cut; then the next."""
    before = np.where(scope & np.isfinite(result.before), result.before, -1.0)
    if before.max(initial=-1.0) < 0:
        return []
    reasons = {int(np.argmax(before)): "largest before"}
    after = (("largest after", result.after), ("largest path error between points after", between))
    for why, values in after if corrected else ():
        error = np.where(scope & np.isfinite(values), values, -1.0)
        if error.max() > 0:
            row = int(np.argmax(error))
            reasons[row] = f"{reasons[row]}, {why}" if row in reasons else why
    for row in _largest_of_each(before, result.cut)[:PLACES].tolist():
        reasons.setdefault(row, f"largest of cut {result.cut[row] + 1}" if result.cut[row] >= 0 else "")
    for row in _largest(before, 2 * PLACES).tolist():
        reasons.setdefault(row, "")
    return list(reasons.items())[:PLACES]


def _largest(values: Floats, count: int) -> Ints:
    """Rows of so many of the largest ``values`` (N,) from 0, in falling order, the first of those alike."""
    least = np.partition(values, -count)[-count] if len(values) > count else 0.0
    rows = np.flatnonzero(values >= max(least, 0.0))
    return rows[np.argsort(-values[rows], kind="stable")][:count]


def _largest_of_each(values: Floats, group: Ints) -> Ints:
    """Rows of the largest of the ``values`` (N,) from 0 of each ``group`` (N,) from -1, in falling order."""
    largest = np.full(int(group.max()) + 2, -1.0)
    np.maximum.at(largest, group.astype(np.intp) + 1, values)
    rows = np.flatnonzero((values == largest[group.astype(np.intp) + 1]) & (values >= 0))
    _, first = np.unique(group[rows], return_index=True)
    rows = rows[np.sort(first)]
    return rows[np.argsort(-values[rows], kind="stable")]


def rows_to_draw(
    n: int, must: Sequence[int], turns: Bools, quantities: Sequence[tuple[int, Floats]], limit: int = SHOWN
) -> Ints:
    """Rows of ``n`` that figures show: all, or at most ``limit`` of many.

    Half of them lie evenly along the program, for its shape.  Of each of many stretches of the program the row with the
    largest of each of the ``quantities`` is shown, (sign, (N,) values, NaN where not known): no extreme is lost.  First
    and last row and those of ``must`` are shown, and where something ``turns`` (N - 1,) from one row to the next, as
    long as there is room.
    """
    if n <= limit:
        return np.arange(n)
    turn = np.flatnonzero(turns)
    if 2 * len(turn) > limit // 4:
        turn = turn[:0]
    required = np.unique(np.concatenate([[0, n - 1], must, turn, turn + 1])).astype(np.int64)
    room = limit - len(required)
    stretches = room // 2 // len(quantities)
    starts = -(-np.arange(stretches) * n // stretches)
    chosen = [required, np.linspace(0, n - 1, room // 2).astype(np.int64)]
    for sign, values in quantities:
        chosen.append(_last_largest(np.where(np.isnan(values), -np.inf, sign * values), starts))
    return np.unique(np.concatenate(chosen))


def _last_largest(values: Floats, starts: Ints) -> Ints:
    """The last row with the largest of the ``values`` (N,) of each stretch (K,)."""
    largest = np.repeat(np.maximum.reduceat(values, starts), np.diff(starts, append=len(values)))
    rows = np.flatnonzero(values == largest)
    stretch = np.searchsorted(starts, rows, side="right")
    return np.asarray(rows[np.append(stretch[1:] != stretch[:-1], True)])
