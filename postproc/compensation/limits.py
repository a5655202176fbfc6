"""What a correction brings near to what the robot can do: axis limits, singular postures, speeds of axes, roundings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import in_blocks
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
    rows = np.flatnonzero(division.moved & (task.track.status[division.source] >= 0))
    if not len(rows):
        return [], {}
    found = _Found(task, division)
    for block in in_blocks(lambda part: _looked(task, division, rows, part), len(rows)):
        found.put(block)
    return [*found.findings(), *_rounded(task, result)], found.held


class _Block(NamedTuple):
    """What is found of the motions ``rows`` (K,) of a division.  beyond (K,): an axis is, the number of which is axis
    (K,); near (K, n) [rad, m]: what is left to a limit that the correction brings an axis close to, infinite elsewhere;
    singular (K,): newly so; share (K, n): of the speed that an axis can have."""

    rows: Ints
    beyond: Bools
    axis: Ints
    near: Floats
    singular: Bools
    share: Floats


def _looked(task: Task, division: Division, rows: Ints, part: slice) -> _Block:
    """The motions ``rows[part]``; speeds need the one before them too."""
    robot = task.model.robot
    more = part.start > 0
    motions = rows[part.start - more : part.stop]
    at, command = division.source[motions], division.command[motions]
    flange = command @ task.tool.shared(at).inverse()
    q = inverse(robot.nominal, flange, task.track.status[at], task.track.q[at]).q
    share = _shares(task, division, motions, command.position, q)[int(more) :]
    motions, at, q = motions[int(more) :], at[int(more) :], q[int(more) :]
    low, high = robot.limits.T
    before, after = (np.minimum(v - low, high - v) for v in (task.track.q[at], q))
    beyond = (after < 0).any(axis=1)
    close = np.array([CLOSE[joint.kind] for joint in robot.joints])
    near = (after < close) & (before >= close) & ~beyond[:, None]
    return _Block(
        motions,
        beyond,
        np.argmin(after, axis=1),
        np.where(near, after, np.inf),
        near_singular(robot, q) & ~near_singular(robot, task.track.q[at]),
        share,
    )


def _shares(task: Task, division: Division, motions: Ints, place: Floats, q: Floats) -> Floats:
    """(K, n) speeds that the axes ``q`` (K, n) need on the way from the command before, at the programmed feed, over
    those that they can have; 0 where that is not known.  ``place`` (K, 3) [m] of the commands."""
    speeds, share = task.model.robot.speeds, np.zeros(q.shape)
    if not np.isfinite(speeds).any():
        return share
    feed = task.toolpath.feed[division.source[motions[1:]]]
    length = np.linalg.norm(np.diff(place, axis=0), axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        pace = np.abs(np.diff(q, axis=0)) / (length / feed)[:, None]
    sound = (np.diff(motions) == 1) & (length > _SHORT)
    share[1:] = np.nan_to_num(np.where(sound[:, None] & np.isfinite(pace), pace / speeds, 0.0))
    return share


class _Found:
    """What is told of all blocks: how many motions, and the worst of them."""

    def __init__(self, task: Task, division: Division) -> None:
        self.task, self.division = task, division
        self.held: dict[int, Finding] = {}
        self.near, self.singular, self.over = 0, 0, 0
        # of each block: what is left to a limit and the share of a speed, with motion and axis
        self.nearest: list[tuple[float, int, int]] = []
        self.fastest: list[tuple[float, int, int]] = []
        self.first: list[int] = []

    def put(self, block: _Block) -> None:
        joints, source = self.task.model.robot.joints, self.division.source
        for k in np.flatnonzero(block.beyond).tolist():
            message = f"a motion inserted here brings {joints[int(block.axis[k])].name} beyond its limit"
            row = int(source[block.rows[k]])
            self.held[row] = _at(self.task, row, "COR008", message)
        k, axis = divmod(int(np.argmin(block.near)), block.near.shape[1])
        self.near += int(np.isfinite(block.near).any(axis=1).sum())
        self.nearest.append((float(block.near[k, axis]), int(block.rows[k]), axis))
        self.singular += int(block.singular.sum())
        self.first += block.rows[block.singular][:1].tolist()
        k, axis = divmod(int(np.argmax(block.share)), block.share.shape[1])
        self.over += int((block.share.max(axis=1) > FAST).sum())
        self.fastest.append((float(block.share[k, axis]), int(block.rows[k]), axis))

    def findings(self) -> list[Finding]:
        robot, told = self.task.model.robot, []
        if self.near:
            left, motion, axis = min(self.nearest)
            joint = robot.joints[axis]
            unit, word = (DEG, "deg") if joint.kind == "revolute" else (MM, "mm")
            message = f"the correction brings {joint.name} to {left / unit:.2f} {word} from its limit"
            told.append(self._told("KIN008", motion, message, self.near))
        if self.singular:
            message = f"the correction leads near to a singular posture ({singular_words(robot)})"
            told.append(self._told("KIN003", self.first[0], message, self.singular))
        if self.over:
            share, motion, axis = max(self.fastest, key=lambda one: one[0])
            joint, speed = robot.joints[axis], robot.speeds[axis]
            unit, word = (DEG, "deg/s") if joint.kind == "revolute" else (MM, "mm/s")
            message = (
                f"{joint.name} has to move at {share * speed / unit:.1f} {word} at the programmed feed,"
                f" it can {speed / unit:g} {word}"
            )
            told.append(self._told("KIN009", motion, message, self.over))
        return told

    def _told(self, code: str, motion: int, message: str, count: int) -> Finding:
        more = "" if count == 1 else f" ({count} motions)"
        return _at(self.task, int(self.division.source[motion]), code, message + more)


def _rounded(task: Task, result: Result) -> list[Finding]:
    """Corrected points that the controller rounds off by more than they were moved."""
    path = task.toolpath
    size = np.linalg.norm(result.correction, axis=1)
    more = result.corrected & ~(path.blend <= size)
    if not more.any():
        return []
    known = path.blend[more & np.isfinite(path.blend)]
    by = f"by up to {known.max() / MM:g} mm" if len(known) else "by a distance that is not known"
    message = (
        f"{int(more.sum())} corrected points are approximated {by}, more than they are moved: where the path turns"
        " there the controller passes beside them"
    )
    return [_at(task, int(np.argmax(more)), "COR015", message)]


def _at(task: Task, row: int, code: str, message: str) -> Finding:
    return Finding(code, message, task.file, int(task.toolpath.line[row]))
