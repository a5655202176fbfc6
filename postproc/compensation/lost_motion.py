"""The lost motion of a program: where its axes turn round, and on which side of its gap each of them then lies.

A joint lags after its motor by half the gap (see ``effects.play``).  For a joint that is to follow y the motor has to
be at y + (g/2) sign(dy): at a reversal it crosses the whole gap while the joint is at rest.  Motions of y of less than
a dead band are none, or the third decimal of a straight line would throw the motor to and fro.  The band is ``ROOM`` of
the tolerance at the tool, or what the last digit of the program moves the axis by, whichever is larger, and never more
than the gap.  By so much the tool is off where an axis has just turned round.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.units import DEG, MM
from postproc.compensation.gap_sides import GapSides, LostMotion, MotorPath, Reversals
from postproc.compensation.problem import CompensationProblem, rotate_wrench
from postproc.compensation.run_sides import axes_at

ROOM = 0.25
"""Share of the tolerance that the dead band of a reversal may take at the tool."""

SPACING, TURN, ARC = 25 * MM, 5 * DEG, 15 * DEG
"""Of stations on a path: along it, by axes, by the angle of an arc."""

SHORT = 2 * MM
"""A motion that is shorter, and turns its axes by less than ``LITTLE``, is monotone to less than a dead band."""

LITTLE = 0.5 * DEG

FINE = 0.2 * MM
"""How exactly the place of a reversal is found."""

CHANGE = 0.02
"""A share of the side that changes by less between two stations is no reversal to be evaluated."""

COARSE = 0.1
"""As much, where a motor crosses its gap: in between it is taken to go evenly."""

ROUNDS, PARTS = 5, 4
"""Times that the stations around reversals are made denser, and by how much."""

MOST = 100_000
"""Stations added to three of each motion at most."""

SAMPLES = 2000
"""Motions at which the dead band is found; between them it is interpolated."""

ANGLE_DIGIT = 1e-3 * DEG
"""Last digit of a program's angles."""

UNKNOWN_GAP = 1e-6
"""[rad, m] Gap of an axis that has none: its side is the sense in which it came."""


def add_lost_motion(task: CompensationProblem, start: Floats | None, spacing: Floats) -> CompensationProblem:
    """The task with the play of its axes, where the model asks for it; ``start`` (n,): axes before the first motion;
    ``spacing`` (N,) [m]: no motion is to be shorter, and so no change of side."""
    if not task.model.by_direction or not len(task.toolpath):
        return task
    axis_paths = _AxisPaths(task)
    stations = axis_paths.first(start)
    for _ in range(ROUNDS):
        coarse = stations.turning()
        if not len(coarse) or len(stations.row) + (PARTS - 1) * len(coarse) > 3 * len(task.toolpath) + MOST:
            break
        stations = stations.denser(coarse)
    line = MotorPath.of(task.desired_path.length)
    position = line.position(stations.row, stations.share)
    turns = Reversals.of(line, position, stations.within.shares, stations.restart, spacing)
    # where a change of side starts and ends there is a station
    row, along = line.place(np.concatenate([turns.since, turns.until]))
    inside = task.desired_path.traceable[row] & (along > 0.0) & (along < 1.0)
    stations = stations.joined(axis_paths.sample(row[inside], along[inside]))
    lost = LostMotion(
        stations.programmed,
        turns,
        stations.row,
        stations.share,
        stations.axes,
        stations.aim,
        stations.moved,
        stations.restart,
        task.model.gaps,
    )
    direction = lost.programmed.at(np.arange(len(task.toolpath)))
    return replace(task, conditions=replace(task.conditions, direction=direction), lost_motion=lost)


def dead_band(task: CompensationProblem) -> Floats:
    """(N, n) [rad, m] motion of each axis that shows by no more than ``ROOM`` of the tolerance at the tool; where that
    is more, what the last digits of a target move it by: |J^-1| times them."""
    n, joints = task.track.q.shape
    rows = np.flatnonzero(np.isfinite(task.track.q).all(axis=1))
    if not len(rows):
        return np.full((n, joints), UNKNOWN_GAP)
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, SAMPLES).round().astype(np.int64))]
    chain, programmed = task.model.robot.nominal_chain, task.model.robot.programmed
    columns = chain.jacobian(task.track.q[rows], task.tool[rows])[:, :, chain.motor_rows]
    lever = np.linalg.norm(columns[:, :3], axis=1)
    shows = ROOM * task.tolerance / np.maximum(lever, 1e-3)
    digits = np.full((len(rows), 6), position_digit(task.toolpath.position))
    rotation = task.toolpath.rotation
    turned = np.abs(rotation[rows] - rotation[np.maximum(rows - 1, 0)]).max(axis=(1, 2)) > 1e-12
    digits[:, 3:] = np.where(turned, ANGLE_DIGIT, 0.0)[:, None]
    back = np.abs(np.linalg.pinv(columns[:, :, programmed], rcond=1e-6))
    rounding = np.zeros_like(lever)
    rounding[:, programmed] = np.einsum("nij,nj->ni", back, digits)
    band, bands = np.maximum(shows, rounding), np.empty((n, joints))
    for joint in range(joints):
        bands[:, joint] = np.interp(np.arange(n), rows, band[:, joint])
    return bands


def position_digit(position: Floats) -> float:
    """[m] Last digit of targets (N, 3) [m]: the first of 0.01 .. 0.000001 mm of which all are multiples.  Those of
    hand-written programs (whole millimetres) are taken as 0.001 mm."""
    known = position[np.isfinite(position)] / MM
    for decimals in range(1, 7):
        if (np.abs(known - np.round(known, decimals)) < 1e-8 * np.maximum(1.0, np.abs(known))).all():
            return (1e-3 if decimals == 1 else 10.0**-decimals) * MM
    return 1e-6 * MM


class _AxisPaths:
    """The paths of a task's motions: moved (N,) those that are to be corrected; gap (n,), band (N, n) of each axis,
    more than 0; rigid: the model without gaps."""

    def __init__(self, task: CompensationProblem) -> None:
        self.task = task
        path, model = task.toolpath, task.model
        self.moved: Bools = path.known & ~path.on_axes
        if task.process:
            self.moved &= task.carries
        self.lossy = model.gaps > 0
        self.gap = np.where(self.lossy, model.gaps, UNKNOWN_GAP)
        self.band = np.where(self.lossy, np.minimum(dead_band(task), self.gap), UNKNOWN_GAP)
        self.rigid = model.without_effects(
            {term.effect.name for term in model.terms if term.effect.by_direction}
        )

    def first(self, start: Floats | None) -> _Samples:
        """The ends of all motions whose axes are known, evenly spaced places on their paths, and where a force or a
        correction sets in."""
        task, q, desired_path = self.task, self.task.track.q, self.task.desired_path
        known = np.asarray(np.isfinite(q).all(axis=1))
        rows = np.flatnonzero(known)
        came = rows[(rows > 0) & known[rows - 1] & desired_path.traceable[rows]]
        turn = np.abs(q[came] - q[came - 1]).max(axis=1, initial=0.0)
        length, sweep = desired_path.length[came], np.nan_to_num(desired_path.sweep[came])
        count = np.ceil(np.maximum(np.maximum(length / SPACING, turn / TURN), sweep / ARC)).astype(np.int64)
        count = np.clip(count, np.where((length > SHORT) | (turn > LITTLE), 2, 1), 1000)
        inner = np.repeat(came, count - 1)
        number = np.arange(len(inner)) - np.repeat(np.cumsum(count - 1) - (count - 1), count - 1) + 1
        steps = (task.force.along(came, np.zeros(len(came))) != task.wrench[came - 1]).any(axis=1)
        sets_in = came[self.moved[came] & (steps | ~self.moved[came - 1])]
        row = np.concatenate([rows, inner, sets_in])
        along = np.concatenate(
            [np.ones(len(rows)), number / np.repeat(count, count - 1), np.zeros(len(sets_in))]
        )
        samples = self.sample(row, along)
        start_axes = (
            np.empty((0, q.shape[1])) if start is None or not np.isfinite(start).all() else start[None]
        )
        before = _Samples(
            self, np.full(len(start_axes), -1), np.ones(len(start_axes)), start_axes, start_axes
        )
        return before.joined(samples)

    def sample(self, row: Ints, along: Floats) -> _Samples:
        """Stations at the shares ``along`` (S,) of the paths of ``row`` (S,), without those that are out of reach."""
        axes = np.empty((len(row), self.gap.size))
        aim = np.empty_like(axes)

        def compute(part: slice) -> None:
            axes[part] = self._axes(row[part], along[part])
            aim[part] = self._aim(row[part], along[part], axes[part])

        each_block(compute, len(row))
        good = np.isfinite(axes).all(axis=1) & np.isfinite(aim).all(axis=1)
        return _Samples(self, row[good], along[good], axes[good], aim[good])

    def _axes(self, row: Ints, along: Floats) -> Floats:
        """(S, n) axes at the shares ``along`` (S,) of the paths of ``row`` (S,), as the controller interpolates
        them."""
        task, q = self.task, self.task.track.q
        axes = np.where((along == 1.0)[:, None], q[row], q[np.maximum(row - 1, 0)])
        inner = np.flatnonzero((along > 0.0) & (along < 1.0))
        if len(inner):
            at, part = row[inner], along[inner]
            near = q[at - 1] + part[:, None] * (q[at] - q[at - 1])
            axes[inner] = axes_at(task, at, part, task.desired_path.at(at, part), near)
        return axes

    def _aim(self, row: Ints, along: Floats, axes: Floats) -> Floats:
        """(S, n) ``axes``, less what the load of a corrected motion deflects them by without its gaps."""
        task, aim = self.task, axes.copy()
        some = np.flatnonzero(self.moved[row] & np.isfinite(axes).all(axis=1))
        if not len(some):
            return aim
        at = row[some]
        given, tool = task.conditions.part(at), task.tool.shared(at)
        wrench = rotate_wrench(task.robot_from_path(at, along[some]), task.force.along(at, along[some]))
        aim[some] = self.rigid.inverse_equilibrium(axes[some], wrench, tool, given)[0]
        if task.process:
            aim[some] += axes[some] - self.rigid.inverse_equilibrium(axes[some], 0.0 * wrench, tool, given)[0]
        return aim


@dataclass(frozen=True, eq=False)
class _Samples:
    """row, share (S,): places on the paths of motions, in order (row -1: before the first one); axes, aim (S, n): as of
    ``LostMotion``."""

    axis_paths: _AxisPaths
    row: Ints
    share: Floats
    axes: Floats
    aim: Floats

    @property
    def key(self) -> Floats:
        return 2.0 * self.row + self.share

    @cached_property
    def restart(self) -> Bools:
        """(S,) it is not known how the axes came here: from an unknown place, or along several paths."""
        step, runs = np.diff(self.row, prepend=-2), self.axis_paths.task.toolpath.continues
        return np.asarray((step > 1) | ((step > 0) & (self.row >= 0) & ~runs[self.row]))

    @cached_property
    def moved(self) -> Bools:
        """(S,) of motions that are to be corrected."""
        return self.axis_paths.moved[self.row] & (self.row >= 0)

    @cached_property
    def programmed(self) -> GapSides:
        return GapSides.of(self.key, self.axes, self.axis_paths.gap, self.restart)

    @cached_property
    def within(self) -> GapSides:
        """The play of the dead bands."""
        # a correction sets out from where the joint really lies
        joint = np.where(self.moved[:, None], self.aim, self.programmed.joint)
        return GapSides.of(self.key, joint, self.axis_paths.band[np.maximum(self.row, 0)], self.restart)

    def turning(self) -> Ints:
        """Stations that end a part of a path in which an axis turns round, and that is long."""
        lossy, desired_path = self.axis_paths.lossy, self.axis_paths.task.desired_path

        def changes(sides: GapSides, least: float) -> Bools:
            side = sides.shares[:, lossy]
            return np.asarray(
                np.abs(np.diff(side, axis=0, prepend=side[:1])).max(axis=1, initial=0.0) > least
            )

        turns = changes(self.within, CHANGE)
        turns[:-1] |= turns[1:].copy()  # the place itself may lie before that
        turns |= changes(self.programmed, COARSE)
        turns |= self._bulges(lossy)
        turns &= ~self.restart & (self.row >= 0)
        turns &= desired_path.traceable[self.row]
        some = np.flatnonzero(turns)
        return some[self._span(some) * desired_path.length[self.row[some]] > FINE]

    def _bulges(self, lossy: Bools) -> Bools:
        """(S,) parts of paths in which a parabola through three stations turns round by more than half a dead band."""
        band, aim = self.within.gap[:, lossy], self.aim[:, lossy]
        step = np.diff(aim, axis=0, prepend=aim[:1])
        bulges = np.zeros(len(step), bool)
        inside = np.flatnonzero(self.row[1:-1] == self.row[2:]) + 1
        bend = np.abs(step[inside + 1] - step[inside])
        for one in (inside, inside + 1):
            turned = np.any((np.abs(step[one]) < bend) & (bend > 0.5 * band[one]), axis=1)
            bulges[one[turned]] = True
        return bulges

    def _span(self, chosen: Ints) -> Floats:
        """(A,) share of its path between each station and the one before it."""
        before = np.maximum(chosen - 1, 0)
        since = np.where(self.row[before] == self.row[chosen], self.share[before], 0.0)
        return np.asarray(self.share[chosen] - since)

    def denser(self, chosen: Ints) -> _Samples:
        """With more stations before each of ``chosen``."""
        part = np.arange(1, PARTS) / PARTS
        added = self.share[chosen, None] - self._span(chosen)[:, None] * part
        return self.joined(self.axis_paths.sample(np.repeat(self.row[chosen], PARTS - 1), added.ravel()))

    def joined(self, other: _Samples) -> _Samples:
        row, share = np.concatenate([self.row, other.row]), np.concatenate([self.share, other.share])
        axes, aim = np.concatenate([self.axes, other.axes]), np.concatenate([self.aim, other.aim])
        order = np.argsort(2.0 * row + share, kind="stable")
        return _Samples(self.axis_paths, row[order], share[order], axes[order], aim[order])
