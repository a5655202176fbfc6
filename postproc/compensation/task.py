"""All that a correction needs of a program: poses, forces, model, and what is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.mirror import Correction, Prediction, beginning, difference, mirror, predict
from postproc.compensation.ways import Ways
from postproc.effects import Conditions
from postproc.forces import Wrenches
from postproc.geometry import Placed, Poses
from postproc.model import StiffnessModel
from postproc.robot.track import Track
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

    def real(
        self,
        rows: Ints,
        command: Poses,
        wrench: Floats,
        start: Floats | None = None,
        q: Floats | None = None,
    ) -> Prediction:
        """Where the tool comes when the controller is sent to ``command`` (K) in motions ``rows`` (K,) under
        ``wrench`` (K, 6).  ``start`` (K, m): displacement of a state nearby; ``q`` (K, n): motors at ``command``, where
        they are known."""
        return predict(
            self.model,
            command,
            self.tool.shared(rows),
            wrench,
            self.conditions.part(rows),
            self.track.status[rows],
            self.track.q[rows],
            start,
            q,
        )

    def goal(self, rows: Ints, wanted: Poses) -> Poses:
        """Where the tool is to be: the wanted poses (K), or where the robot without force takes it."""
        if not self.process or self.model.slack:
            return wanted
        return self.real(rows, wanted, np.zeros((len(rows), 6))).pose

    def command(
        self,
        rows: Ints,
        wanted: Poses,
        wrench: Floats,
        goal: Poses,
        begin: tuple[Poses, Floats] | None = None,
    ) -> Correction:
        """The commands (K) that bring the tool to ``goal`` (K) in motions ``rows`` (K,).  ``begin``: as ``begin`` gives
        it, where it is known."""
        turns = self.turns(rows, goal.rotation)
        if turns is None and begin is None:
            begin = self.begin(rows, wanted, wrench, goal)
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
            begin if turns is None else None,
        )

    def begin(
        self, rows: Ints, wanted: Poses, wrench: Floats, goal: Poses, q: Floats | None = None
    ) -> tuple[Poses, Floats]:
        """Commands and displacements with which a correction begins (see ``beginning``)."""
        return beginning(
            self.model,
            wanted,
            goal,
            self.tool.shared(rows),
            wrench,
            self.conditions.part(rows),
            self.track.status[rows],
            self.track.q[rows],
            self.max_correction,
            q,
        )

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
