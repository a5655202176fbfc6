"""What a correction brings near to what the robot can do: axis limits, singular postures, speeds of axes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.robot.axis_track import is_near_singular, singular_words
from postproc.robot.inverse import inverse

CLOSE = {"revolute": 1 * DEG, "prismatic": 5 * MM}
"""An axis this near to its limit needs review."""

FAST = 0.9
"""Share of an axis' fastest speed that needs review."""

_SHORT = 1e-6
"""[m] A motion that is not longer has no feed along a path."""


def check_limits(
    task: CompensationProblem, division: Subdivision
) -> tuple[list[Finding], dict[int, Finding]]:
    """What is to be reported of the motions of ``division``; and the rows that cannot be corrected, with the reason.

    Reported is only what the correction adds, not what the uncorrected program does too.
    """
    rows = np.flatnonzero(division.moved & (task.track.branch[division.source] >= 0))
    if not len(rows):
        return [], {}
    collector = _LimitFindings(task, division)
    for block in in_blocks(lambda part: _looked(task, division, rows, part), len(rows)):
        collector.put(block)
    return collector.findings(), collector.uncorrectable


class _LimitBlock(NamedTuple):
    """What is found of the motions ``rows`` (K,) of a division.  beyond (K,): an axis is, the number of which is axis
    (K,); near (K, n) [rad, m]: the distance to a limit that the correction brings an axis close to, infinite elsewhere;
    singular (K,): newly so; share (K, n): of the speed that an axis can have."""

    rows: Ints
    beyond: Bools
    axis: Ints
    near: Floats
    singular: Bools
    share: Floats


def _looked(task: CompensationProblem, division: Subdivision, rows: Ints, part: slice) -> _LimitBlock:
    """The motions ``rows[part]``; speeds need the one before them too."""
    robot = task.model.robot
    more = part.start > 0
    motions = rows[part.start - more : part.stop]
    at, command = division.source[motions], division.command[motions]
    flange = command @ task.tool.shared(at).inverse()
    share = division.share[motions]
    if (placed := task.robot_from_path(at, share)) is not None:
        flange = placed @ flange
    q = inverse(robot.nominal, flange, task.track.branch[at], task.q_reference(at, share)).q
    speeds = _shares(task, division, motions, command.position, q)[int(more) :]
    motions, at, q = motions[int(more) :], at[int(more) :], q[int(more) :]
    low, high = robot.limits.T
    before, after = (np.minimum(v - low, high - v) for v in (task.track.q[at], q))
    beyond = (after < 0).any(axis=1)
    close = np.array([CLOSE[joint.kind] for joint in robot.joints])
    near = (after < close) & (before >= close) & ~beyond[:, None]
    return _LimitBlock(
        motions,
        beyond,
        np.argmin(after, axis=1),
        np.where(near, after, np.inf),
        is_near_singular(robot, q) & ~is_near_singular(robot, task.track.q[at]),
        speeds,
    )


def _shares(
    task: CompensationProblem, division: Subdivision, motions: Ints, place: Floats, q: Floats
) -> Floats:
    """(K, n) speeds that the axes ``q`` (K, n) need on the path from the command before, at the programmed feed, over
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


class _LimitFindings:
    """What is reported of all blocks: how many motions, and the worst of them."""

    def __init__(self, task: CompensationProblem, division: Subdivision) -> None:
        self.task, self.division = task, division
        self.uncorrectable: dict[int, Finding] = {}
        self.near, self.singular, self.over = 0, 0, 0
        # of each block: the distance to a limit and the share of a speed, with motion and axis
        self.nearest: list[tuple[float, int, int]] = []
        self.fastest: list[tuple[float, int, int]] = []
        self.first: list[int] = []

    def put(self, block: _LimitBlock) -> None:
        joints, source = self.task.model.robot.joints, self.division.source
        for k in np.flatnonzero(block.beyond).tolist():
            message = f"an inserted motion moves {joints[int(block.axis[k])].name} beyond its limit"
            row = int(source[block.rows[k]])
            self.uncorrectable[row] = _at(self.task, row, "COR008", message)
        k, axis = divmod(int(np.argmin(block.near)), block.near.shape[1])
        self.near += int(np.isfinite(block.near).any(axis=1).sum())
        self.nearest.append((float(block.near[k, axis]), int(block.rows[k]), axis))
        self.singular += int(block.singular.sum())
        self.first += block.rows[block.singular][:1].tolist()
        k, axis = divmod(int(np.argmax(block.share)), block.share.shape[1])
        self.over += int((block.share.max(axis=1) > FAST).sum())
        self.fastest.append((float(block.share[k, axis]), int(block.rows[k]), axis))

    def findings(self) -> list[Finding]:
        robot, findings = self.task.model.robot, []
        if self.near:
            margin, motion, axis = min(self.nearest)
            joint = robot.joints[axis]
            unit, word = (DEG, "deg") if joint.turns else (MM, "mm")
            message = f"the correction moves {joint.name} to {margin / unit:.2f} {word} from its limit"
            findings.append(self._finding("KIN008", motion, message, self.near))
        if self.singular:
            message = f"the corrected pose is close to a singularity ({singular_words(robot)})"
            findings.append(self._finding("KIN003", self.first[0], message, self.singular))
        if self.over:
            share, motion, axis = max(self.fastest, key=lambda one: one[0])
            joint, speed = robot.joints[axis], robot.speeds[axis]
            unit, word = (DEG, "deg/s") if joint.turns else (MM, "mm/s")
            message = (
                f"{joint.name} needs {share * speed / unit:.1f} {word} at the programmed feed,"
                f" its speed limit is {speed / unit:g} {word}"
            )
            findings.append(self._finding("KIN009", motion, message, self.over))
        return findings

    def _finding(self, code: str, motion: int, message: str, count: int) -> Finding:
        more = "" if count == 1 else f" ({count} motions)"
        return _at(self.task, int(self.division.source[motion]), code, message + more)


def _at(task: CompensationProblem, row: int, code: str, message: str) -> Finding:
    return Finding(code, message, task.file, int(task.toolpath.line[row]))
