"""How many even segments each interval gets: as few as the tolerance needs, and no more than are allowed."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import lengths
from postproc.base.units import DEG
from postproc.compensation.divisible_motions import (
    ROOM,
    STEP,
    DivisibleMotions,
)
from postproc.compensation.orientations import shortest

MOST = 5_000_000
"""Motions of one output at most: half a gigabyte of program, which no controller loads, and some of memory."""

LITTLE = 3 * DEG
"""Axes that turn by less do not change a robot's compliance: what changes with its square is a thousandth."""

WIDE = 30 * DEG
"""An arc that turns further is evaluated between its points, whatever its correction."""

_ORDER = {False: 2.0, True: 3.0}
"""The error between points of a straight segment falls with the square of its length, that of an arc through three
points with the third power at least; where to look first for the number that is enough."""


def refine(motions: DivisibleMotions) -> None:
    """The smallest number of even segments with which each interval is within the tolerance, or the most that may
    be.

    Raises Refusal COR022, before they are computed, where these are more than ``MOST``.
    """
    desired_path, rows = motions.task.desired_path, motions.rows[motions.owner]
    arc = desired_path.arc[rows]
    motions.least = least = motions.least_segments()
    # A path that starts beside its place stays beside it, in however many segments.
    entered = motions.needs_transition | motions.has_lead_in | (motions.step <= ROOM)
    cutting = motions.task.carries[rows]
    can = motions.free[rows] & (entered[motions.owner] | ~cutting)
    if not motions.limits.no_insert:
        lost = rows[(least > 1) & ~can]
        half = np.isin(lost, motions.task.track.half_turns.rows)
        motions.leave_undivided(lost[~half], "COR013", "an arc of nearly a full turn cannot be divided here")
        motions.leave_undivided(
            lost[half], "COR013", "a rotation of the tool by 180 deg cannot be divided here"
        )
    can &= cutting  # in air nothing is cut between the points
    # A motion that only turns the tool has no length to divide.
    length = desired_path.length[rows] * (motions.high - motions.low)
    length *= shortest(motions.task.toolpath, rows, motions.low, motions.high)
    most = np.floor(length / motions.spacing(rows, motions.limits.min_segment))
    growth = int(min(motions.limits.max_growth * motions.n, MOST))
    most = np.minimum(most, max(1, growth, motions.limits.least) + least)
    most = np.where(can, np.maximum(least, most), least).astype(np.int32)
    fails, holds = least - 1, np.zeros(len(rows), np.int32)
    ratio = np.zeros(len(rows))
    motions.count, active = least.copy(), np.flatnonzero(~_even_motions(motions))
    while len(active):
        errors = motions.largest_errors(active, motions.count[active])
        motions.error[active] = np.where(
            motions.count[active] == least[active], errors, motions.error[active]
        )
        good = errors <= 1.0
        won, lost = active[good], active[~good]
        holds[won] = motions.count[won]
        fails[lost], ratio[lost] = motions.count[lost], errors[~good]
        going = np.where(holds[active] > 0, holds[active] - fails[active] > 1, fails[active] < most[active])
        motions.count[active] = np.where(holds[active] > 0, holds[active], most[active])
        active = active[going]
        power = 1.0 / np.where(arc[active], _ORDER[True], _ORDER[False])
        guess = np.ceil(np.maximum(fails[active], 1) * np.minimum(ratio[active], 1e6) ** power)
        top = np.where(holds[active] > 0, holds[active] - 1, most[active])
        motions.count[active] = np.clip(guess, fails[active] + 1, top).astype(np.int32)
        _refuse_too_many(motions)


def _refuse_too_many(motions: DivisibleMotions) -> None:
    wanted = motions.n + int(motions.count.sum(dtype=np.int64)) - len(motions.count)
    if wanted > max(MOST, 2 * motions.n):
        message = f"about {wanted} motions would be needed for this tolerance; {MOST} are possible"
        help = "use a larger tolerance or min_segment, or a smaller max_growth in the cell"
        raise Refusal(Finding("COR022", message, motions.task.file, help=help))


def _even_motions(motions: DivisibleMotions) -> Bools:
    """(I,) paths on which the correction hardly changes and the axes hardly turn: it lies on a line from start to end,
    and between them nothing is off by more than a part of that change.

    With an arc the force may turn by its sweep: a correction c that turns with it lies c sweep^2 / 8 beside that line.
    """
    task, full, path = motions.task, motions.full, motions.task.toolpath

    def even(part: slice) -> Bools:
        rows = motions.rows[part]
        before = np.maximum(rows - 1, 0)
        alike = full.corrected[before] & (rows > 0) & (motions.start_at[part] < 0)
        alike &= path.tool[rows] == path.tool[before]
        at = np.flatnonzero(task.desired_path.arc[rows])
        sweep, size = task.desired_path.sweep[rows[at]], lengths(full.correction[rows[at]])
        alike[at] &= (size * sweep**2 / 8 <= STEP * task.tolerance) & (sweep <= WIDE)
        alike[at] &= ~path.arcs.turns_along[rows[at]]
        if task.external is not None:
            alike &= ~task.external.moves(rows)
        for change, most in ((full.correction, task.tolerance), (full.turn, task.tolerance_angle)):
            alike &= lengths(change[rows] - change[before]) <= STEP * most
        return alike & (np.abs(task.track.q[rows] - task.track.q[before]) <= LITTLE).all(axis=1)

    is_even = np.concatenate([np.empty(0, bool), *in_blocks(even, len(motions.rows))]) | motions.spline
    if task.force.ramps is not None:
        is_even[np.isin(motions.rows, task.force.ramps.row)] = False
    return is_even if len(motions.owner) == len(motions.rows) else is_even[motions.owner]


def enforce_budget(motions: DivisibleMotions) -> None:
    """Where all together are more than may be inserted: transition moves and parts first, then points, the largest
    errors before."""
    parts = np.bincount(motions.owner, minlength=len(motions.rows)) - 1
    wanted = (
        int(motions.needs_transition.sum()) + int(parts.sum()) + int((motions.count - motions.least).sum())
    )
    spare = motions.limits.inserted(motions.n) - int(motions.returns.sum()) - int((motions.least - 1).sum())
    if wanted <= spare:
        return
    most = max(spare, 0)
    cost, need = (
        motions.needs_transition + parts,
        np.maximum(motions.step * motions.needs_transition, motions.split_error),
    )
    paid = allocate(cost, need, most) == cost
    motions.needs_transition &= paid
    _join_intervals(motions, ~paid)
    points = motions.count - motions.least
    gets = allocate(points, motions.error, most - int(cost[paid].sum()))
    motions.count = motions.least + gets
    # of each path the error that remains on it
    np.maximum.at(need, motions.owner[gets < points], motions.error[gets < points])
    short = ~paid
    short[motions.owner[gets < points]] = True
    first = int(motions.rows[np.argmax(np.where(short, need, -1.0))])
    motions.findings.append(
        Finding(
            "COR014",
            f"{wanted} motions are needed, max_growth ({motions.limits.max_growth:g}) allows"
            f" {most}: {int(short.sum())} motions get fewer than they need; the largest error is here",
            motions.task.file,
            int(motions.task.toolpath.line[first]),
            help="raise max_growth or tolerance in the cell",
        )
    )


def _join_intervals(motions: DivisibleMotions, chosen: Bools) -> None:
    """Makes the paths ``chosen`` (R,) one interval each."""
    retained = ~chosen[motions.owner] | (motions.low == 0.0)
    motions.owner, motions.low, motions.high = (
        motions.owner[retained],
        motions.low[retained],
        motions.high[retained].copy(),
    )
    joined = chosen[motions.owner] & (motions.high < 1.0)
    motions.high[joined] = 1.0
    motions.least = motions.least_segments()
    motions.count = np.where(joined, motions.least, motions.count[retained])
    motions.error = np.where(joined, motions.split_error[motions.owner], motions.error[retained])


def allocate(wanted: Ints, need: Floats, spare: int) -> Ints:
    """(R,) how many of ``wanted`` (R,) each gets of ``spare``, those with the largest ``need`` (R,) first."""
    order = np.argsort(-need, kind="stable")
    before = np.cumsum(wanted[order]) - wanted[order]
    given = np.zeros_like(wanted)
    given[order] = np.clip(spare - before, 0, wanted[order])
    return given
