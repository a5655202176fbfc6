"""How far the tool may turn about its spindle along a program: where not at all, and how fast elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import lengths, turn_between
from postproc.base.units import DEG, MM
from postproc.placement.part_motions import PartMotions
from postproc.placement.spin import SAME, WINDOWS, SpinScan, plan_spin
from postproc.toolpath import Kind, OrientationMode, OrientationPath
from postproc.workflows.preparation import Prepared

PER_LENGTH, PER_TIME, PER_MOTION = 0.5 * DEG / MM, 30 * DEG, 90 * DEG
"""How far the tool turns at most [rad] in a metre, in a second and in one motion."""

MOST_HELD = 4
"""Times that a turn is planned again without places that became worse."""


@dataclass(frozen=True, eq=False)
class SpinPath:
    """N motions of a program: step (N,) [rad] by which the tool may turn in each; locked (N,): at whose end it is as
    the program has it; length (N,) [m]; feed (N,) [m/s], NaN where it is not known."""

    step: Floats
    locked: Bools
    length: Floats
    feed: Floats


def spindle_axes(ready: Prepared) -> Floats:
    """(N, 3) the spindle axis of each motion's tool in the tool's axes, NaN where it is not known."""
    path = ready.task.toolpath
    axes = np.full((len(path.frames) + 1, 3), np.nan)
    for index, frame in enumerate(path.frames):
        tool = ready.cell.tools.get(frame.number or 0) if frame.pose is None else None
        if tool is not None:
            axes[index] = tool.axis
    return np.asarray(axes[path.tool])


def spin_path(ready: Prepared, axes: Floats) -> SpinPath:
    """How far a program's tool may turn; ``axes`` (N, 3) as of ``spindle_axes``."""
    path, desired = ready.task.toolpath, ready.task.desired_path
    control, fixed = path.orientation_control, path.constraints
    straight = np.isin(path.kind, (Kind.LIN, Kind.CIRC))
    locked = ~straight | ~path.known | ~fixed.orientation_programmed | ~np.isfinite(axes[:, 0])
    locked |= np.isfinite(control.redundant_axis[:, 0])
    locked[[*fixed.refused, *fixed.locked]] = True
    turn = _turns(ready)
    # a motion whose inner orientations would become others stays as it is from its start to its end
    words = (control.path == OrientationPath.ROTARY_AXES) & ~(turn < SAME)
    stiff = (
        path.keeps_orientation
        | (control.mode != OrientationMode.VAR)
        | words
        | ~desired.traceable
        | ~straight
    )
    locked |= stiff
    # a motion to axis angles starts wherever the tool is, and ends as it always did
    to_axes = (path.kind == Kind.AXIS) & path.on_axes
    locked[:-1] |= (stiff & ~to_axes)[1:] | (path.tool[1:] != path.tool[:-1])
    for row in np.flatnonzero(~path.continues).tolist():
        before = path.predecessors.get(row, (row - 1,))
        locked[[row, *(one for one in before if one >= 0)]] = True
    locked[-1:] = True
    length, feed = desired.length, np.where(path.feed > 0, path.feed, np.nan)
    step = np.fmin(PER_LENGTH * length, PER_TIME * length / feed)
    # turned evenly about two axes at once, the tool's axis leaves its path by an eighth of the product
    with np.errstate(divide="ignore"):
        beside = 8 * ready.cell.tolerance_angle / np.where(turn > SAME, turn, 0.0)
    beside = np.where(control.path == OrientationPath.GREAT_CIRCLE, np.inf, beside)
    step = np.minimum(np.minimum(step, 0.5 * beside), PER_MOTION)
    return SpinPath(np.where(to_axes, 2 * np.pi, np.where(stiff, 0.0, step)), locked, length, feed)


def _turns(ready: Prepared) -> Floats:
    """(N,) [rad] between the orientations at start and end of each motion, infinite where one is not known."""
    desired, n = ready.task.desired_path, len(ready.task.toolpath)
    rows = np.arange(n)
    start, end = desired.start[rows].rotation, desired.end[rows].rotation
    known = np.isfinite(start[:, 0, 0]) & np.isfinite(end[:, 0, 0])
    turn = np.full(n, np.inf)
    turn[known] = lengths(turn_between(start[known], end[known]))
    return turn


def plan_turns(ready: Prepared, motions: PartMotions, scan: SpinScan, path: SpinPath) -> Floats | None:
    """(N,) [rad] by how much the tool is turned at the end of each motion; None where it is not to turn at all.
    ``motions``, ``scan``: of this program alone."""
    task, n = ready.task, len(path.step)
    missing = np.setdiff1d(np.arange(n), motions.row[motions.share == 1.0])
    rows = np.concatenate([motions.row, missing])
    share = np.concatenate([motions.share, np.ones(len(missing))])
    order = np.lexsort((share, rows))
    rows, share = rows[order], share[order]
    still = len(scan.angle) // 2
    blank = np.zeros((len(scan.angle), len(missing)), np.float32)
    only = np.zeros(blank.shape, np.bool_)
    only[still] = True
    error, size, feasible = (
        np.concatenate([known, more], axis=1)[:, order]
        for known, more in ((scan.error, blank), (scan.size, blank), (scan.feasible, only))
    )
    reached = np.cumsum(path.step)
    allowance = reached[rows] - (1.0 - share) * path.step[rows]
    locked = path.locked[rows] & (share == 1.0)
    most, most_size = (_largest_of_cut(task.carries, rows, part[still]) for part in (error, size))
    whole = SpinScan(scan.angle, error, size, feasible & (size <= most_size))
    best, least = None, np.inf
    for window, spread in WINDOWS:
        held = locked
        for _ in range(MOST_HELD):
            turn = plan_spin(whole, allowance, held, most, window, spread)
            if turn is None:
                break
            value, extent, fits = whole.at(turn)
            worse = (value > most * (1 + 1e-6)) | (extent > most_size * (1 + 1e-6))
            if not worse.any():
                largest = float(value.max())
                if fits and largest < least * (1 - 1e-3):
                    best, least = turn, largest
                break
            held = held | worse  # the average made them worse: there the tool stays as it is
    if best is None or not np.abs(best).max() > SAME:
        return None
    turns = np.zeros(n)
    ends = share == 1.0
    turns[rows[ends]] = best[ends]
    return turns


def _largest_of_cut(carries: Bools, rows: Ints, error: Floats) -> Floats:
    """(M,) [m] the largest of the errors (M,) of the cut that each place is in."""
    cut = np.cumsum(np.append(True, carries[1:] != carries[:-1]))[rows] - 1
    largest = np.zeros(int(cut.max()) + 1 if len(cut) else 1)
    np.maximum.at(largest, cut, error)
    return np.where(carries[rows], largest[cut], np.inf)


def refuse_unturnable(ready: Prepared, path: SpinPath) -> None:
    """Raises Refusal PLC013 where the text can turn the tool at no motion under force, with the reason of the first."""
    task, fixed = ready.task, ready.task.toolpath.constraints
    cut = np.flatnonzero(task.carries)
    if not path.locked[cut].all():
        return
    row = int(cut[0])
    control = task.toolpath.orientation_control
    if row in fixed.refused or row in fixed.locked:
        reason = "the text of this motion is not edited"
    elif not fixed.orientation_programmed[row]:
        reason = "the program states no orientation of the tool"
    elif np.isfinite(control.redundant_axis[row, 0]):
        reason = "the words of the program state the tool's direction, and not its turn about it"
    elif task.toolpath.keeps_orientation[row] or control.mode[row] != OrientationMode.VAR:
        reason = "this motion does not turn to the orientation that it states"
    elif control.path[row] == OrientationPath.ROTARY_AXES:
        reason = "its rotary words turn the tool on a path that another turn would change"
    else:
        reason = "this motion has no path on which the tool may turn"
    help = "omit --spin, or use --tool-turn: a constant turn needs no edit of the program"
    message = f"the tool cannot be turned along this program: {reason}"
    raise Refusal(Finding("PLC013", message, task.file, int(task.toolpath.line[row]), help=help))
