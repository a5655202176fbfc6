"""All that a correction needs of a program: poses, forces, model, and what is asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Placed, Poses, product, rotation_from_vector, turned
from postproc.compensation import orientations
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.gap_sides import GapSides, LostMotion, Reversals
from postproc.compensation.known_error import KnownError
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import Correction, Prediction, initial_guess, mirror, pose_error, predict
from postproc.compensation.touched_off import TouchedOff
from postproc.effects import Conditions
from postproc.model import StiffnessModel
from postproc.process import Wrenches
from postproc.robot.axis_track import AxisTrack
from postproc.robot.external_axes import External
from postproc.toolpath import Toolpath


@dataclass(frozen=True)
class CompensationProblem:
    """All that a correction needs, N motions.  Poses are in the robot base; NaN where a target is not known.

    Where external axes move in the program they are in path axes (see ``robot.external``), the robot base for all of
    them at zero; only what is asked of the model itself goes to the robot's own base and back.

    wanted (N): TCP targets; base, tool (N): the programmed base in the robot base, the TCP on the flange; force: the
    wrench along the path of each motion; conditions (N): what else is known, at their ends and as they are programmed;
    ``process``: correct what the force does and not what the robot does without it (a base that was touched off
    contains that, but for the lost motion of its gears: no base can lie on both sides of a gap); else everything is
    corrected, but for the rigid motion that ``touched_off`` bases contain.  ``max_correction``, ``tolerance`` [m],
    ``tolerance_angle`` [rad].  ``ramp`` [m]: over which a force that steps inside a cut goes over at least.
    ``lost_motion``: on which side of its gap each axis lies, None where the model does not ask.  ``known_error``: what
    is known of the error beside the model.

    Wherever something is asked for along the path of motions ``rows`` (K,), ``share`` (K,) states where: 0 at their
    start, 1 at their end, which is what it is without.
    """

    file: str
    toolpath: Toolpath
    model: StiffnessModel
    track: AxisTrack
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
    ramp: float = 0.0
    touched_off: TouchedOff | None = None
    lost_motion: LostMotion | None = None
    external: External | None = None
    known_error: KnownError | None = None

    @property
    def wrench(self) -> Floats:
        """(N, 6) at the end of each motion, robot base axes."""
        return self.force.at_end

    @property
    def deflects(self) -> bool:
        """Whether anything that is to be corrected can move the tool."""
        model = self.model
        return not self.process or model.is_compliant or model.by_direction or self.known_error is not None

    @property
    def carries(self) -> Bools:
        """(N,) the motion has a force."""
        return self.force.carries

    @cached_property
    def desired_path(self) -> DesiredPath:
        robot, track = self.model.robot, self.track
        return DesiredPath.of(self.toolpath, self.wanted, self.base, self.tool, robot, track, self.external)

    def robot_from_path(self, rows: Ints, share: Floats | None = None) -> Poses | None:
        """Path axes of motions ``rows`` (K,) at the shares (K,) of their paths (their ends without) in the robot's own
        base; None where they are the same."""
        return None if self.external is None else self.external.robot_from_path(rows, share)

    def q_reference(self, rows: Ints, share: Floats | None = None) -> Floats:
        """(K, n) joint values at the ends of motions ``rows`` (K,), by which their branches and turns are chosen; the
        external joint at the shares (K,) of their paths."""
        q = self.track.q[rows]
        return q if self.external is None else self.external.joint_values(q, rows, share)

    def _load_case(
        self, rows: Ints, wrench: Floats, conditions: Conditions, share: Floats | None
    ) -> LoadCase:
        """Motions ``rows`` (K,) at the shares (K,) of their paths; ``wrench`` (K, 6) in the robot's own axes."""
        return LoadCase(
            self.tool.shared(rows), wrench, conditions, self.track.branch[rows], self.q_reference(rows, share)
        )

    @cached_property
    def _sides(self) -> GapSides | None:
        """On which side of its gap each axis lies as the program runs corrected."""
        return None if self.lost_motion is None else self.lost_motion.run(self.gain)

    def conditions_at(self, rows: Ints, share: Floats | None = None, corrected: bool = False) -> Conditions:
        """What else is known of motions ``rows`` (K,) at ``share`` (K,) of their paths, their ends without: as the
        program runs uncorrected, or ``corrected``."""
        if self.lost_motion is None or (share is None and not corrected):
            return self.conditions.part(rows)
        return self._on(self._sides if corrected else self.lost_motion.programmed, rows, share)

    def _on(self, sides: GapSides | Reversals | None, rows: Ints, share: Floats | None) -> Conditions:
        given = self.conditions.part(rows)
        return given if sides is None else replace(given, direction=sides.at(rows, share))

    def _to_be(self, rows: Ints, share: Floats | None) -> Conditions:
        """As ``given``, with the sides that a correction is made for."""
        return self._on(None if self.lost_motion is None else self.lost_motion.wanted, rows, share)

    def between_sides(self, rows: Ints) -> Conditions:
        """What else is known of motions ``rows`` (K,) with every joint in the middle of its gap."""
        given = self.conditions.part(rows)
        if not self.model.by_direction:
            return given
        return replace(given, direction=np.zeros((len(rows), len(self.model.robot.joints))))

    def simulated(
        self,
        rows: Ints,
        command: Poses,
        wrench: Floats,
        start: Floats | None = None,
        q: Floats | None = None,
        share: Floats | None = None,
        corrected: bool = False,
        came: Floats | None = None,
    ) -> Prediction:
        """Where the tool comes when the controller is sent to ``command`` (K) in motions ``rows`` (K,) under ``wrench``
        (K, 6) [N, N m], at ``share`` (K,) of their paths, their ends without.  ``start`` (K, m) [rad, m]: displacement
        of a state nearby; ``q`` (K, n) [rad, m]: motors at ``command``, where they are known; ``corrected`` as of
        ``given``; ``came`` (K, n): the sides of another program."""
        if self.lost_motion is not None:
            start = None  # it may lie on the other side of a gap
        given = self.conditions_at(rows, share, corrected)
        if came is not None:
            given = replace(given, direction=came)
        return self._predicted(rows, command, wrench, given, start, q, share)

    def _predicted(
        self,
        rows: Ints,
        command: Poses,
        wrench: Floats,
        conditions: Conditions,
        start: Floats | None = None,
        q: Floats | None = None,
        share: Floats | None = None,
    ) -> Prediction:
        placed = self.robot_from_path(rows, share)
        prediction = predict(
            self.model,
            command if placed is None else placed @ command,
            self._load_case(rows, rotate_wrench(placed, wrench), conditions, share),
            start,
            q,
        )
        return prediction if placed is None else replace(prediction, pose=placed.inverse() @ prediction.pose)

    def goal(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Poses:
        """Where the tool is to be in motions ``rows`` (K,), at ``share`` (K,) of their paths or at their ends: the
        wanted poses (K), or where the robot without force takes it in the middle of its gaps, or where a base that was
        touched off puts them; before what is known of the error beside the model."""
        goal = self._goal_of_model(rows, wanted, share)
        if self.known_error is None:
            return goal
        return Poses(goal.rotation, goal.position - self.known_error.at(rows, wanted, share))

    def _goal_of_model(self, rows: Ints, wanted: Poses, share: Floats | None) -> Poses:
        if self.model.zero_without_load or (not self.process and self.touched_off is None):
            return wanted
        if self.process or self.touched_off is None:
            return self.unloaded(rows, wanted, share).pose
        frame = self.toolpath.base[rows]
        goal = self.touched_off.goal(frame, wanted)
        other = np.flatnonzero(~self.touched_off.known[frame])
        if len(other):  # air, in a base of which nothing is known
            at = None if share is None else share[other]
            goal.put(other, self.unloaded(rows[other], wanted[other], at).pose)
        return goal

    def unloaded(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Prediction:
        """Where the robot without force takes the tool in motions ``rows`` (K,), at ``share`` (K,) of their paths or at
        their ends, in the middle of its gaps."""
        none = np.zeros((len(rows), 6))
        return self._predicted(rows, wanted, none, self.between_sides(rows), share=share)

    def command(
        self,
        rows: Ints,
        wanted: Poses,
        wrench: Floats,
        goal: Poses,
        start: tuple[Poses, Floats] | None = None,
        share: Floats | None = None,
    ) -> Correction:
        """The commands (K) that bring the tool to ``goal`` (K) in motions ``rows`` (K,) under ``wrench`` (K, 6) [N, N
        m], at ``share`` (K,) of their paths or at their ends.  ``start``: poses (K) and displacements (K, m) [rad, m]
        as ``start_command`` gives them, where they are known."""
        if start is None:
            start = self.start_command(rows, wanted, wrench, goal, share=share)
        placed = self.robot_from_path(rows, share)
        if placed is not None:
            wanted, goal, wrench = placed @ wanted, placed @ goal, rotate_wrench(placed, wrench)
            start = None if start is None else (placed @ start[0], start[1])
        turns = self.orientation_projection(rows, goal.rotation)
        done = mirror(
            self.model,
            wanted,
            goal,
            self._load_case(rows, wrench, self._to_be(rows, share), share),
            turns,
            start,
        )
        pairs = orientations.pairs(self.toolpath, rows)
        if len(pairs):
            done = self._in_words(rows, goal, wrench, share, done, pairs)
        if placed is None:
            return done
        back = placed.inverse()
        return replace(done, command=back @ done.command, turn=turned(back.rotation, done.turn))

    def _in_words(
        self, rows: Ints, goal: Poses, wrench: Floats, share: Floats | None, done: Correction, pairs: Ints
    ) -> Correction:
        """``done`` with the orientations that two rotary axes can express in its rows ``pairs`` (P,), and the places
        that go with them; all in the robot's own base."""
        at = rows[pairs]
        place = np.ones(len(at)) if share is None else share[pairs]
        here, placed = done.command.rotation[pairs], self.robot_from_path(at, place)
        if placed is None:
            expressible = self.expressible_orientations(at, place, here)
        else:
            expressible = product(
                placed.rotation,
                self.expressible_orientations(at, place, product(placed.inverse().rotation, here)),
            )
        again = mirror(
            self.model,
            Poses(expressible, done.command.position[pairs]),
            goal[pairs],
            self._load_case(at, wrench[pairs], self._to_be(at, place), place),
            np.zeros((len(at), 3, 3)),
        )
        command, parts = done.command.copy(), {}
        command.put(pairs, again.command)
        for name in ("q", "error", "turn", "reachable", "settled", "converged"):
            values, new = getattr(done, name).copy(), getattr(again, name)
            values[pairs] = values[pairs] & new if new.dtype == np.bool_ else new
            parts[name] = values
        iterations = done.iterations.copy()
        iterations[pairs] += again.iterations
        return replace(done, command=command, iterations=iterations, **parts)

    def expressible_orientations(self, rows: Ints, share: Floats, rotation: Floats) -> Floats:
        """(K, 3, 3) orientations nearest to ``rotation`` (K, 3, 3) that the words of motions ``rows`` (K,) express at
        the shares (K,) of their paths, without a swing of an axis that hardly turns the tool."""
        pairs = orientations.pairs(self.toolpath, rows)
        if not len(pairs):
            return rotation
        nearest, at = rotation.copy(), rows[pairs]
        law = self.desired_path.orientations
        nearest[pairs] = law.nearest_expressible(at, share[pairs], rotation[pairs])
        return nearest

    def correctable(self, rows: Ints, share: Floats, command: Poses, turn: Floats) -> Floats:
        """(K, 3) [rad] of ``turn`` (K, 3), by which the tool is off at ``command`` (K), what other words at the shares
        (K,) of the paths of ``rows`` (K,) would make up for: near the pole of two rotary axes not all of it."""
        pairs = orientations.pairs(self.toolpath, rows)
        if not len(pairs):
            return turn
        correctable, at = turn.copy(), rows[pairs]
        here, tool = command.rotation[pairs], self.toolpath.orientation_control.redundant_axis[at]
        better = self.expressible_orientations(
            at, share[pairs], product(rotation_from_vector(-turn[pairs]), here)
        )
        correctable[pairs] = np.cross(turned(better, tool), turned(here, tool))
        return correctable

    def start_command(
        self,
        rows: Ints,
        wanted: Poses,
        wrench: Floats,
        goal: Poses,
        q: Floats | None = None,
        share: Floats | None = None,
    ) -> tuple[Poses, Floats]:
        """Commands (K) and displacements (K, m) [rad, m] with which a correction of motions ``rows`` (K,) under
        ``wrench`` (K, 6) [N, N m] starts (see ``initial_guess``); ``q`` (K, n) [rad, m] and ``share`` (K,) where they
        are known."""
        placed = self.robot_from_path(rows, share)
        if placed is not None:
            wanted, goal = placed @ wanted, placed @ goal
        command, displacement = initial_guess(
            self.model,
            wanted,
            goal,
            self._load_case(rows, rotate_wrench(placed, wrench), self._to_be(rows, share), share),
            self.max_correction,
            q,
        )
        return (command if placed is None else placed.inverse() @ command), displacement

    def turn_freely(self, rows: Ints) -> bool:
        """Whether the texts of all motions ``rows`` (K,) can express any orientation."""
        path = self.toolpath
        return (
            bool(path.constraints.orientation_programmed[rows].all())
            and not np.isfinite(path.orientation_control.redundant_axis[rows]).any()
        )

    def orientation_projection(self, rows: Ints, rotation: Floats) -> Floats | None:
        """(K, 3, 3) projection onto the rotation vectors, robot base axes, that the texts of motions ``rows`` (K,) at
        the orientations ``rotation`` (K, 3, 3) can express: none, those across the free axis, all; None if all can."""
        path = self.toolpath
        if self.turn_freely(rows):
            return None
        axis = (rotation @ np.nan_to_num(path.orientation_control.redundant_axis[rows])[..., None])[..., 0]
        across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
        return np.where(path.constraints.orientation_programmed[rows][:, None, None], across, 0.0)

    def pose_errors(self, rows: Ints, real: Poses, goal: Poses) -> tuple[Floats, Floats]:
        """real (-) goal (K, 3) [m], [rad] of motions ``rows`` (K,), without rotations that cannot be corrected."""
        shift, turn = pose_error(real, goal)
        turns = self.orientation_projection(rows, goal.rotation)
        return shift, turn if turns is None else (turns @ turn[..., None])[..., 0]

    def visible_errors(self, rows: Ints, real: Poses, goal: Poses) -> tuple[Floats, Floats]:
        """real (-) goal, (K, 3) [m] and (K, 3) [rad], of motions ``rows`` (K,) as it shows on the part: a turn about a
        free axis does not."""
        shift, turn = pose_error(real, goal)
        return shift, self.visible_turn(rows, goal, turn)

    def visible_turn(self, rows: Ints, goal: Poses, turn: Floats) -> Floats:
        """(K, 3) [rad] of ``turn`` (K, 3) against ``goal`` (K), in motions ``rows`` (K,), what shows on the part."""
        free = np.nan_to_num(self.toolpath.orientation_control.redundant_axis[rows])
        if not free.any():
            return turn
        axis = (goal.rotation @ free[..., None])[..., 0]
        return np.asarray(turn - np.sum(turn * axis, axis=1, keepdims=True) * axis)

    def steps(self, rows: Ints, corrected: Bools) -> Bools:
        """(K,) whether the correction of motions ``rows`` (K,) starts again, and does not go on from the one before:
        that one is not ``corrected`` (N,), has another tool, or ends under another force."""
        before, path = np.maximum(rows - 1, 0), self.toolpath
        start = self.force.along(rows, np.zeros(len(rows)))
        away = np.abs(start - self.force.at_end[before]) > 1e-9 * max(1.0, self.force.max_force)
        other = path.tool[rows] != path.tool[before]
        return np.asarray((rows == 0) | ~corrected[before] | other | away.any(axis=1))


def rotate_wrench(placed: Poses | None, wrench: Floats) -> Floats:
    """Wrenches (K, 6) [N, N m] at the TCP, from ``wrench`` (K, 6) in path axes to those of the robot's own base."""
    if placed is None:
        return wrench
    return np.asarray((wrench.reshape(-1, 2, 3) @ np.swapaxes(placed.rotation, -1, -2)).reshape(-1, 6))
