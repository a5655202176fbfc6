"""Motions parted where a ramp of the force ends or an axis turns round."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.geometry import lengths
from postproc.compensation.divisible_motions import (
    SAME,
    DivisibleMotions,
)
from postproc.compensation.reversals import find_reversals

ROUNDED = 0.5
"""Share of the tolerance by which a controller may round an inserted point without another one near it."""


def split_at_knots(motions: DivisibleMotions) -> None:
    """Paths on which a ramp of the force ends are divided there, where one straight or round path would exceed the
    tolerance."""
    row, share = _knots(motions)
    if not len(row):
        return
    at = np.searchsorted(motions.rows, row)
    off = np.maximum(motions.errors_at(at, share), motions.largest_errors(at, motions.least[at]))
    np.maximum.at(motions.split_error, at, off)
    motions.split_error[motions.split_error <= 1.0] = 0.0
    chosen = motions.split_error[at] > 0.0
    _split_intervals(motions, *_with_companions(motions, at[chosen], share[chosen]))


def _with_companions(motions: DivisibleMotions, at: Ints, share: Floats) -> tuple[Ints, Floats]:
    """The places ``at`` (K,), ``share`` (K,), each with another as near after it (else before it) as may be where the
    controller would round it by more than ``ROUNDED``.

    Where the correction turns by k [m a m], a parabola from d before it to d after it passes it at d k / 4
    (``corners``); d is half of the shorter segment beside it at most.
    """
    if not len(at):
        return at, share
    path, rows = motions.task.toolpath, motions.rows[at]
    length, spacing = motions.task.desired_path.length[rows], motions.spacing(rows, motions.limits.ramp_end)
    blend = path.approximation[rows]
    # of an exact motion it is not known; where nothing is stated of an approximation, nothing is known of the path
    reach = np.where(blend == 0, 0.0 if path.constraints.exact_stays else np.inf, np.nan_to_num(blend))
    last = np.append(at[1:] != at[:-1], True)
    first = np.append(True, last[:-1])
    after = (np.where(last, 1.0, np.append(share[1:], 1.0)) - share) * length
    before = (share - np.where(first, 0.0, np.append(0.0, share[:-1]))) * length
    reach = np.minimum(reach, 0.5 * np.minimum(before, after))

    def kink(part: slice) -> Floats:
        shifts = []
        for side in (-1.0, 0.0, 1.0):
            place = share[part] + side * spacing[part] / length[part]
            wanted = motions.task.desired_path.at(rows[part], place)
            shifts.append(motions.commands(rows[part], place).position - wanted.position)
        return lengths(shifts[0] - 2.0 * shifts[1] + shifts[2]) / spacing[part]

    turned = np.concatenate([np.empty(0), *in_blocks(kink, len(at))])
    off = (0.25 * reach * turned > ROUNDED * motions.task.tolerance) & (reach > 0.5 * spacing)
    off &= ~motions.task.desired_path.arc[
        rows
    ]  # the points of so short an arc are on a line, in the digits of a program
    # a vertex of the program stays as round as it was
    corner = (
        np.nan_to_num(path.approximation[rows]),
        np.nan_to_num(path.approximation[np.maximum(rows - 1, 0)]),
    )
    room = np.maximum(spacing, np.where(last, 2.0 * corner[0], 0.0))
    sides = [off & (after >= spacing + room)]
    room = np.where(
        first, np.maximum(spacing, 2.0 * corner[1]), 2.0 * spacing
    )  # the one before may have its own
    sides.append(off & ~sides[0] & (before >= spacing + room))
    if sum(int(side.sum()) for side in sides) > (motions.limits.inserted(motions.n) - len(at)) // 2:
        return at, share  # the points themselves come first
    step = spacing / length
    at = np.concatenate([at, *(at[side] for side in sides)])
    share = np.concatenate([share, (share + step)[sides[0]], (share - step)[sides[1]]])
    order = np.lexsort((share, at))
    return at[order], share[order]


def _split_intervals(motions: DivisibleMotions, at: Ints, share: Floats) -> None:
    """Intervals of the paths ``at`` (K,) that end at the shares (K,), both ascending; of all others one."""
    number = np.arange(len(motions.rows))
    owner = np.concatenate([number, at])
    low = np.concatenate([np.zeros(len(motions.rows)), share])
    order = np.lexsort((low, owner))
    motions.owner, motions.low = owner[order].astype(np.int32), low[order]
    last = np.append(motions.owner[1:] != motions.owner[:-1], True)
    motions.high = np.where(last, 1.0, np.append(motions.low[1:], 1.0))
    motions.count = motions.least = motions.least_segments()
    motions.error = np.zeros(len(motions.owner))


def _knots(motions: DivisibleMotions) -> tuple[Ints, Floats]:
    """Rows (K,) and shares (K,) of their paths where ramps end or an axis crosses its gap, and a point may be inserted:
    on cuts alone, as in air nothing is cut between the points."""
    ramps = motions.task.force.ramps
    row, share = (np.empty(0, np.int64), np.empty(0)) if ramps is None else ramps.ends()
    if ramps is not None:
        # of a ramp that is shorter than any motion may be, nothing is behind the first point
        many = np.bincount(ramps.row, minlength=motions.n)
        single = ramps.row[(many[ramps.row] == 1) & (ramps.start <= 0.0) & ~ramps.before]
        nearest = motions.spacing(row, motions.limits.ramp_end)
        nearest /= np.maximum(motions.task.desired_path.length[row], SAME)
        share = np.where(np.isin(row, single), np.maximum(share, nearest), share)
    if motions.task.lost_motion is not None:
        every = np.arange(motions.n)
        crossed = find_reversals(motions.task, motions.spacing(every, motions.limits.min_segment))
        row, share = np.concatenate([row, crossed[0]]), np.concatenate([share, crossed[1]])
        order = np.lexsort((share, row))
        row, share = row[order], share[order]
    if not len(row):
        return row, share
    spacing = motions.spacing(row, motions.limits.ramp_end) / np.maximum(
        motions.task.desired_path.length[row], SAME
    )
    good = (
        motions.free[row]
        & motions.task.carries[row]
        & np.isin(row, motions.rows[~motions.spline])
        & (share >= spacing)
        & (share <= 1.0 - spacing + 1e-12)
    )
    row, share, spacing = row[good], share[good], spacing[good]
    while len(row):  # of those too near to each other the first stays
        near = np.append(False, (row[1:] == row[:-1]) & (np.diff(share) < spacing[1:]))
        first = near & ~np.append(False, near[:-1])
        if not first.any():
            break
        row, share, spacing = row[~first], share[~first], spacing[~first]
    return row, share
