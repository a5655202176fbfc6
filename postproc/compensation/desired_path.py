"""The wanted path of each motion in the robot base, between its start and its end."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import (
    UNKNOWN,
    Placed,
    PoseRows,
    Poses,
    lengths,
    on_arc,
    turn_beside,
    turn_between,
    turned,
    turning,
)
from postproc.compensation.mirror import interpolate_pose
from postproc.compensation.orientations import MotionParts, ProgrammedOrientations
from postproc.robot.axis_track import AxisTrack, nominal_flange
from postproc.robot.description import Robot
from postproc.robot.external_axes import External
from postproc.robot.half_turns import HalfTurns
from postproc.toolpath import Kind, OrientationPath, Toolpath

_NO_MOVE = 1e-7
"""[m], [rad]: a motion that is not longer leads nowhere."""


@dataclass(frozen=True, eq=False)
class DesiredPath:
    """N motions.  start, end: TCP poses, NaN where unknown; sweep (N,) of arcs, NaN elsewhere; traceable (N,): LIN and
    CIRC whose path is known from start to end; length (N,) [m], 0 where it is not; angle (N,) [rad]: between the
    orientations at start and end, infinite where the tool turns otherwise than evenly about one axis, NaN where it is
    not known; half_turns: in which sense they turn."""

    path: Toolpath
    start: PoseRows
    end: Placed
    base: Poses
    traceable: Bools
    length: Floats
    angle: Floats
    half_turns: HalfTurns = field(default_factory=HalfTurns)

    @staticmethod
    def of(
        path: Toolpath,
        wanted: Placed,
        base: Poses,
        tool: Poses,
        robot: Robot,
        track: AxisTrack,
        external: External | None = None,
    ) -> DesiredPath:
        """``wanted`` (N): targets in the robot base; ``base``, ``tool`` (N): frames of each motion."""
        n = len(path)
        starts = start_poses(wanted, path, tool, robot, track, external).remembered()
        known = np.isin(path.kind, (Kind.LIN, Kind.CIRC)) & path.known
        length, angle = np.zeros(n), np.full(n, np.nan)
        desired_path = DesiredPath(path, starts, wanted, base, known, length, angle, track.half_turns)
        unlike = path.arcs.turns_along | (path.orientation_control.path != OrientationPath.SINGLE_AXIS)

        def measured(block: slice) -> None:
            rows = np.arange(block.start, block.stop)
            start, target = starts[rows], wanted[rows]
            end = target.position
            distance = np.linalg.norm(end - start.position, axis=1)
            known[block] &= np.isfinite(distance) & np.isfinite(start.rotation[:, 0, 0])
            at = np.flatnonzero(known[block])
            angle[rows[at]] = lengths(turn_between(start.rotation[at], target.rotation[at]))
            angle[rows[unlike[rows]]] = np.inf
            arcs = np.flatnonzero(desired_path.arc[rows])
            if len(arcs):
                centre, normal, sweep = desired_path.circles(rows[arcs])
                radius = np.linalg.norm(start.position[arcs] - centre, axis=1)
                rise = np.sum((end[arcs] - start.position[arcs]) * normal, axis=1)
                distance[arcs] = np.hypot(radius * sweep, rise)
            length[block] = np.where(known[block], distance, 0.0)

        each_block(measured, n)
        return desired_path

    @property
    def sweep(self) -> Floats:
        """(N,) [rad] of arcs, NaN elsewhere."""
        return self.path.arcs.sweep

    @cached_property
    def arc(self) -> Bools:
        """(N,) the motion is an arc."""
        return np.asarray(np.isfinite(self.path.arcs.sweep))

    def circles(self, rows: Ints) -> tuple[Floats, Floats, Floats]:
        """Centre (K, 3) [m], normal (K, 3) and sweep (K,) of the arcs ``rows`` (K,), in the robot base."""
        base = self.base[rows]
        centre = base.position + turned(base.rotation, self.path.arcs.centre[rows])
        return centre, turned(base.rotation, self.path.arcs.normal[rows]), self.path.arcs.sweep[rows]

    def at(self, rows: Ints, share: Floats) -> Poses:
        """Poses (K) at the shares (K,) of the paths of ``rows`` (K,): straight or round, turning as the program
        states."""
        start, end = self.start[rows], self.end[rows]
        poses = interpolate_poses(start, end, share)
        self._turn(rows, start, end, share, poses)
        whole = MotionParts(rows, np.zeros(len(rows)), np.ones(len(rows)), start.rotation, end.rotation)
        self.turn(whole, share, poses)
        arcs = np.flatnonzero(np.isfinite(self.sweep[rows]))
        if len(arcs):
            poses.position[arcs] = on_arc(
                start.position[arcs], end.position[arcs], *self.circles(rows[arcs]), share[arcs]
            )
        return poses

    def _turn(self, rows: Ints, start: Poses, end: Poses, share: Floats, poses: Poses) -> None:
        """Puts the orientations of the motions that do not turn in the shorter sense into ``poses`` (K)."""
        half = self.half_turns.rows
        if not len(half) and not self._along:
            return
        other = np.flatnonzero(self.path.arcs.turns_along[rows] | np.isin(rows, half))
        if len(other):
            at = rows[other]
            along = self.path.arcs.turn(at, self.base[at].rotation)
            turn = turn_beside(start.rotation[other], end.rotation[other], along)
            self.half_turns.put(at, turn)
            poses.rotation[other] = turning(start.rotation[other], turn, along, share[other])

    @cached_property
    def _along(self) -> bool:
        return bool(self.path.arcs.turns_along.any())

    def turn(self, parts: MotionParts, share: Floats, poses: Poses) -> None:
        """Turns ``poses`` (K), at the shares (K,) of the parts (K) of motions, as the controller does
        (``OrientationPath``)."""
        self.orientations.interpolate(parts, share, poses.rotation)

    @property
    def orientations(self) -> ProgrammedOrientations:
        """How the motions turn the tool."""
        return ProgrammedOrientations(self.path, self.base, self.end)

    def tangent(self, rows: Ints, share: Floats) -> Floats:
        """(K, 3) unit vectors along the paths of ``rows`` (K,) at the shares (K,); zero where a motion only turns the
        tool."""
        start, end = self.start[rows].position, self.end[rows].position
        step = end - start
        arcs = np.flatnonzero(np.isfinite(self.sweep[rows]))
        if len(arcs):
            centre, normal, sweep = self.circles(rows[arcs])
            here = on_arc(start[arcs], end[arcs], centre, normal, sweep, share[arcs])
            rise = np.sum(step[arcs] * normal, axis=1)[:, None]
            step[arcs] = sweep[:, None] * np.cross(normal, here - centre) + rise * normal
        length = np.linalg.norm(step, axis=1, keepdims=True)
        return np.where(length > _NO_MOVE, step / np.maximum(length, _NO_MOVE), 0.0)


def start_poses(
    end: Placed, path: Toolpath, tool: Poses, robot: Robot, track: AxisTrack, external: External | None = None
) -> PoseRows:
    """Where each motion starts (N): the end pose of the one before it, with the tool of its own; NaN for the first one,
    after a motion to an unknown place, and where several motions may precede it.  ``external``: in whose path axes
    ``end`` is, each in those of its own."""

    def build(rows: Ints) -> Poses:
        before = np.maximum(rows - 1, 0)
        poses = end[before].copy()
        other = np.flatnonzero((path.tool[rows] != path.tool[before]) & path.known[before])
        if len(other):
            poses.put(other, poses[other] @ tool[before[other]].inverse() @ tool[rows[other]])
        if external is not None and (moved := np.flatnonzero(external.changes_carrier[rows])).size:
            poses.put(moved, external.start_from_end(rows[moved]) @ poses[moved])
        after_axes = np.flatnonzero(~path.known[before])
        after_axes = after_axes[np.isfinite(track.q[before[after_axes]]).all(axis=1)]
        if len(after_axes):
            flange = nominal_flange(robot, track.q[before[after_axes]])
            if external is not None:
                flange = external.in_path(rows[after_axes], np.zeros(len(after_axes)), flange)
            poses.put(after_axes, flange @ tool[rows[after_axes]])
        poses.put((rows == 0) | ~path.continues[rows], UNKNOWN)
        return poses

    return PoseRows(len(path), build)


def interpolate_poses(start: Poses, end: Poses, share: Floats) -> Poses:
    """Straight from ``start`` to ``end`` (K), turning evenly about one axis, at the shares (K,)."""
    return interpolate_pose(start, end, share[:, None])
