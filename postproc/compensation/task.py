"""All that a correction needs of a program: poses, forces, model, and what is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.mirror import REST, Correction, Prediction, difference, mirror, predict
from postproc.compensation.ways import Ways
from postproc.effects import Conditions
from postproc.forces import Wrenches
from postproc.geometry import Placed, Poses
from postproc.model import StiffnessModel
from postproc.robot.inverse import inverse
from postproc.robot.track import Track, nominal_flange
from postproc.toolpath import Toolpath


@dataclass(frozen=True)
class Task:
    """All that a correction needs, N motions.  Poses are in the robot base; NaN where a target is not known.

    wanted (N): TCP targets; base, tool (N): the programmed base in the robot base, the TCP on the flange; force: the
    wrench on the way of each motion; conditions (N): what else is known; ``process``: correct what the force does and
    leave what the robot does without it (a base that was touched off contains that); else everything is corrected.
    ``max_correction``, ``tolerance`` [m], ``tolerance_angle`` [rad].
    """

    file: str
    toolpath: Toolpath
    model: StiffnessModel
    track: Track
    wanted: Placed
    base: Poses
    tool: Poses
    force: Wrenches
    conditions: Conditions
    process: bool
    gain: float
    max_correction: float
    tolerance: float
    tolerance_angle: float

    @property
    def wrench(self) -> Floats:
        """(N, 6) at the end of each motion, robot base axes."""
        return self.force.values

    @property
    def carries(self) -> Bools:
        """(N,) the motion has a force."""
        return self.force.carries

    @cached_property
    def ways(self) -> Ways:
        return Ways.of(self.toolpath, self.wanted, self.base, self.tool, self.model.robot, self.track)

    def real(self, rows: Ints, command: Poses, wrench: Floats, tolerance: float = REST) -> Prediction:
        """Where the tool comes when the controller is sent to ``command`` (K) in motions ``rows`` (K,) under
        ``wrench`` (K, 6).  ``tolerance`` [rad, m]: last step of the equilibrium."""
        return predict(
            self.model,
            command,
            self.tool.shared(rows),
            wrench,
            self.conditions.part(rows),
            self.track.status[rows],
            self.track.q[rows],
            tolerance=tolerance,
        )

    def goal(self, rows: Ints, wanted: Poses, tolerance: float = REST) -> Poses:
        """Where the tool is to be: the wanted poses (K), or where the robot without force takes it."""
        if not self.process or self.model.slack:
            return wanted
        return self.real(rows, wanted, np.zeros((len(rows), 6)), tolerance).pose

    def command(self, rows: Ints, wanted: Poses, wrench: Floats, goal: Poses) -> Correction:
        """The commands (K) that bring the tool to ``goal`` (K) in motions ``rows`` (K,)."""
        turns = self.turns(rows, goal.rotation)
        return mirror(
            self.model,
            wanted,
            goal,
            self.tool.shared(rows),
            wrench,
            self.conditions.part(rows),
            self.track.status[rows],
            self.track.q[rows],
            turns,
            self._begin(rows, wanted, wrench, goal) if turns is None else None,
        )

    def _begin(self, rows: Ints, wanted: Poses, wrench: Floats, goal: Poses) -> tuple[Poses, Floats]:
        """Commands whose loaded joints stand where the goal is, and how far they are bent there; the wanted pose where
        that is out of reach, or far away."""
        model, tool = self.model, self.tool.shared(rows)
        near, status, given = self.track.q[rows], self.track.status[rows], self.conditions.part(rows)
        there = inverse(model.robot.nominal, goal @ tool.inverse(), status, near)
        motors, bent = model.motors_at(np.where(there.reachable[:, None], there.q, near), wrench, tool, given)
        begin = nominal_flange(model.robot, motors) @ tool
        away = np.linalg.norm(begin.position - wanted.position, axis=1)
        good = there.reachable & (away <= self.max_correction) & np.isfinite(bent).all(axis=1)
        if good.all():
            return begin, bent
        return Poses(
            np.where(good[:, None, None], begin.rotation, wanted.rotation),
            np.where(good[:, None], begin.position, wanted.position),
        ), np.where(good[:, None], bent, 0.0)

    def turn_freely(self, rows: Ints) -> bool:
        """Whether the texts of all motions ``rows`` (K,) can express any orientation."""
        path = self.toolpath
        return bool(path.oriented[rows].all()) and not np.isfinite(path.free_axis[rows, 0]).any()

    def turns(self, rows: Ints, rotation: Floats) -> Floats | None:
        """(K, 3, 3) projection onto the rotation vectors, robot base axes, that the texts of motions ``rows`` (K,) at
        the orientations ``rotation`` (K, 3, 3) can express: none, those across the free axis, all; None if all can."""
        path = self.toolpath
        if self.turn_freely(rows):
            return None
        axis = (rotation @ np.nan_to_num(path.free_axis[rows])[..., None])[..., 0]
        across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
        return np.where(path.oriented[rows][:, None, None], across, 0.0)

    def off(self, rows: Ints, real: Poses, goal: Poses) -> tuple[Floats, Floats]:
        """real (-) goal (K, 3) [m], [rad] of motions ``rows`` (K,), without rotations that can not be corrected."""
        shift, turn = difference(real, goal)
        turns = self.turns(rows, goal.rotation)
        return shift, turn if turns is None else (turns @ turn[..., None])[..., 0]

    def seen(self, rows: Ints, real: Poses, goal: Poses) -> tuple[Floats, Floats]:
        """real (-) goal (K, 3) [m], [rad] as it shows on the part: a turn about a free axis does not."""
        shift, turn = difference(real, goal)
        free = np.nan_to_num(self.toolpath.free_axis[rows])
        if not free.any():
            return shift, turn
        axis = (goal.rotation @ free[..., None])[..., 0]
        return shift, turn - np.sum(turn * axis, axis=1, keepdims=True) * axis

    def steps(self, rows: Ints, corrected: Bools) -> Bools:
        """(K,) whether the correction of motions ``rows`` (K,) begins anew, and does not go on from the one before:
        that one is not ``corrected`` (N,), has another tool, or ends under another force."""
        before, path = np.maximum(rows - 1, 0), self.toolpath
        begin = self.force.along(rows, np.zeros(len(rows)))
        away = np.abs(begin - self.wrench[before]) > 1e-9 * max(1.0, self.force.max_force)
        other = path.tool[rows] != path.tool[before]
        return np.asarray((rows == 0) | ~corrected[before] | other | away.any(axis=1))
