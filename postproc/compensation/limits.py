"""What a correction brings near to what the robot can do: axis limits, singular postures, speeds of axes, roundings."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.correct import Result
from postproc.compensation.division import Division
from postproc.compensation.task import Task
from postproc.findings import Finding
from postproc.robot.inverse import inverse
from postproc.robot.track import near_singular, singular_words
from postproc.units import DEG, MM

CLOSE = {"revolute": 1 * DEG, "prismatic": 5 * MM}
"""An axis this near to its limit deserves a look."""

FAST = 0.9
"""Share of an axis' fastest speed that deserves a look."""

_SHORT = 1e-6
"""[m] A motion that is not longer has no feed along a path."""


def limits(task: Task, result: Result, division: Division) -> tuple[list[Finding], dict[int, Finding]]:
    """What is to be told of the motions of ``division``; and the rows that can not be corrected, with the reason.

    Told is what the correction adds: what the program as it is does too is no news.
    """
    source, robot = division.source, task.model.robot
    rows = np.flatnonzero(division.moved & (task.track.status[source] >= 0))
    if not len(rows):
        return [], {}
    at = source[rows]
    flange = division.command[rows] @ task.tool[at].inverse()
    q = inverse(robot.nominal, flange, task.track.status[at], task.track.q[at]).q
    findings, held = _near(task, rows, at, q, division)
    findings += _singular(task, at, q)
    findings += _fast(task, division, rows, q)
    findings += _rounded(task, result)
    return findings, held


def _near(
    task: Task, rows: Ints, at: Ints, q: Floats, division: Division
) -> tuple[list[Finding], dict[int, Finding]]:
    """Axes that the correction brings near to a limit (told), and inserted motions beyond one (held)."""
    robot = task.model.robot
    low, high = robot.limits.T
    before, after = (np.minimum(v - low, high - v) for v in (task.track.q[at], q))
    held = {}
    beyond = (after < 0).any(axis=1)
    for place in np.flatnonzero(beyond).tolist():
        message = f"a motion inserted here brings {robot.joints[int(np.argmin(after[place]))].name} beyond its limit"
        held[int(at[place])] = _at(task, int(at[place]), "COR008", message)
    close = np.array([CLOSE[joint.kind] for joint in robot.joints])
    near = (after < close) & (before >= close) & ~beyond[:, None]
    if not near.any():
        return [], held
    place, axis = divmod(int(np.argmin(np.where(near, after, np.inf))), after.shape[1])
    joint = robot.joints[axis]
    unit, word = (DEG, "deg") if joint.kind == "revolute" else (MM, "mm")
    message = f"the correction brings {joint.name} to {after[place, axis] / unit:.2f} {word} from its limit"
    return [_at(task, int(at[place]), "KIN008", message + _more(near.any(axis=1)))], held


def _singular(task: Task, at: Ints, q: Floats) -> list[Finding]:
    robot = task.model.robot
    new = near_singular(robot, q) & ~near_singular(robot, task.track.q[at])
    if not new.any():
        return []
    message = f"the correction leads near to a singular posture ({singular_words(robot)})" + _more(new)
    return [_at(task, int(at[np.argmax(new)]), "KIN003", message)]


def _fast(task: Task, division: Division, rows: Ints, q: Floats) -> list[Finding]:
    """Axes that have to move faster than they can, at the programmed feed between consecutive commands."""
    speeds = task.model.robot.speeds
    pairs = np.flatnonzero(rows[1:] == rows[:-1] + 1)
    if not np.isfinite(speeds).any() or not len(pairs):
        return []
    first, last = rows[pairs], rows[pairs + 1]
    feed = task.toolpath.feed[division.source[last]]
    length = np.linalg.norm(division.command.position[last] - division.command.position[first], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        pace = np.abs(q[pairs + 1] - q[pairs]) / (length / feed)[:, None]
    share = np.where((length > _SHORT)[:, None] & np.isfinite(pace), pace / speeds, 0.0)
    share = np.nan_to_num(share)
    over = share.max(axis=1) > FAST
    if not over.any():
        return []
    place = int(np.argmax(share.max(axis=1)))
    axis = int(np.argmax(share[place]))
    joint = task.model.robot.joints[axis]
    unit, word = (DEG, "deg/s") if joint.kind == "revolute" else (MM, "mm/s")
    message = (
        f"{joint.name} has to move at {pace[place, axis] / unit:.1f} {word} at the programmed feed,"
        f" it can {speeds[axis] / unit:g} {word}"
    )
    return [_at(task, int(division.source[last[place]]), "KIN009", message + _more(over))]


def _rounded(task: Task, result: Result) -> list[Finding]:
    """Corrected points that the controller rounds off by more than they were moved."""
    path = task.toolpath
    size = np.linalg.norm(result.command.position - task.wanted.position, axis=1)
    rounds = result.corrected & ~(path.blend <= 0)
    more = rounds & ~(path.blend <= size)
    if not more.any():
        return []
    known = path.blend[more & np.isfinite(path.blend)]
    by = f"by up to {known.max() / MM:g} mm" if len(known) else "by a distance that is not known"
    message = (
        f"{int(more.sum())} corrected points are approximated {by}, more than they are moved: where the path turns"
        " there the controller passes beside them"
    )
    return [_at(task, int(np.argmax(more)), "COR015", message)]


def _more(mask: Bools) -> str:
    count = int(mask.sum())
    return "" if count == 1 else f" ({count} motions)"


def _at(task: Task, row: int, code: str, message: str) -> Finding:
    return Finding(code, message, task.file, int(task.toolpath.line[row]))
