"""The states in which the robot left the measured points, and the errors that a model predicts of them.

The point of the tool that touched the part is taken as the tool centre point, so a turn of the tool counts with its
lever.  The error along the outward normal is positive where material is left:

    e = n . (x_real(q, w) - x_goal)

q are the motors as they were commanded when the part was cut; x_goal is the wanted place, or, where the base was
touched off with this robot (``correct: process``), where the robot without force takes it there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector, turned
from postproc.compensation.problem import CompensationProblem
from postproc.effects import Conditions
from postproc.effects.play import play_output, share
from postproc.model import StiffnessModel
from postproc.robot.inverse import inverse

LITTLE_GAP, WIDE_GAP = 5e-5, 2e-4
"""[rad, m] Gaps by which the side of an axis is found: of a new gear, and of a worn one, which short reversals do not
cross."""


@dataclass(frozen=True, eq=False)
class TouchedPoints:
    """K points.  row (K,), share (K,): motion of the program and place on its path; point (K, 3) [m], normal (K, 3) in
    the robot base; q (K, n) [rad, m]: motors as commanded; q_goal (K, n): of the wanted pose; tool (K): contact point
    on the flange; wrench (K, 6) [N, N m] at the TCP and to_contact (K, 3) [m] from there, in the robot base; axes (K,
    3, 3) of the base; conditions (K) loaded, at_rest (K) without force; spindle (K, 3): unit vector, tip-ward, in the
    robot base; process: of the cell's ``correct``; direction (K, n): side of each axis by the order of the motions;
    wide_direction (K, n): the same in a wide gap; good (K,): in reach."""

    row: Ints
    share: Floats
    point: Floats
    normal: Floats
    q: Floats
    q_goal: Floats
    wanted: Floats
    tool: Poses
    wrench: Floats
    to_contact: Floats
    axes: Floats
    conditions: Conditions
    at_rest: Conditions
    spindle: Floats
    process: bool
    direction: Floats
    wide_direction: Floats
    good: Bools

    def __len__(self) -> int:
        return len(self.row)

    def with_wide_gaps(self) -> TouchedPoints:
        """The same with the sides that the axes have in wide gaps."""
        return replace(self, direction=self.wide_direction)

    def part(self, rows: Ints | Bools) -> TouchedPoints:
        """Some of them (J,)."""
        names = ("row", "share", "point", "normal", "q", "q_goal", "wanted", "wrench", "to_contact", "axes")
        more = ("spindle", "direction", "wide_direction", "good")
        arrays = {name: getattr(self, name)[rows] for name in (*names, *more)}
        return replace(
            self,
            tool=self.tool[rows],
            conditions=self.conditions.part(rows),
            at_rest=self.at_rest.part(rows),
            **arrays,
        )

    def loads(self, scale: Floats | float = 1.0, turn: Floats | None = None) -> Floats:
        """(K, 6) [N, N m] wrenches at the contact point: those of the program times ``scale`` (K,), the forces turned
        by the rotation vectors ``turn`` (K, 3) [rad]."""
        wrench = self.wrench * np.broadcast_to(scale, (len(self),))[:, None]
        if turn is not None:
            wrench[:, :3] = turned(rotation_from_vector(turn), wrench[:, :3])
        wrench[:, 3:] -= np.cross(self.to_contact, wrench[:, :3])
        return np.asarray(wrench)

    def errors(
        self,
        model: StiffnessModel,
        scale: Floats | float = 1.0,
        turn: Floats | None = None,
        sides: bool = False,
    ) -> Floats:
        """(K,) [m] errors along the normals that ``model`` predicts; ``scale`` (K,) and ``turn`` (K, 3) [rad] of the
        forces; ``sides``: with the sides of the axes by the order
        of the motions, for effects that ask for them.  NaN without an equilibrium."""
        given = replace(self.conditions, direction=self.direction) if sides else self.conditions
        rest = model.equilibrium(self.q, self.loads(scale, turn), self.tool, given)
        real = np.where(rest.converged[:, None], rest.pose.position, np.nan)
        return np.asarray(np.sum((real - self.goals(model, sides)) * self.normal, axis=1))

    def goals(self, model: StiffnessModel, sides: bool = False) -> Floats:
        """(K, 3) [m] where the contact points are to be."""
        if not self.process or (model.zero_without_load and not sides):
            return self.wanted
        given = self.at_rest
        if sides or model.by_direction:
            given = replace(given, direction=np.zeros_like(self.direction))
        none = np.zeros((len(self), 6))
        return np.asarray(model.equilibrium(self.q_goal, none, self.tool, given).pose.position)


def touched_points(
    task: CompensationProblem,
    spindle: Floats,
    place: tuple[Ints, Floats],
    surface: tuple[Floats, Floats],
    command: Poses | None = None,
) -> TouchedPoints:
    """The states of K points.

    place: motion (K,) and share (K,) of its path; surface: points (K, 3) [m] and normals (K, 3) in the robot base;
    spindle (N, 3): unit vectors, tip-ward, in tool axes; command: poses (K) that the controller was sent to, the wanted
    ones without.
    """
    row, along = place
    point, normal = surface
    wanted = task.desired_path.at(row, along)
    sent = wanted if command is None else command
    tool = task.tool[row]
    lever = turned(np.swapaxes(wanted.rotation, 1, 2), point - wanted.position)
    contact = Poses(tool.rotation, tool.position + turned(tool.rotation, lever))
    reference, branch = task.q_reference(row, along), task.track.branch[row]
    nominal, back = task.model.robot.nominal, tool.inverse()
    found = inverse(nominal, sent @ back, branch, reference)
    goal = found if command is None else inverse(nominal, wanted @ back, branch, reference)
    return TouchedPoints(
        row=row,
        share=along,
        point=point,
        normal=normal,
        q=found.q,
        q_goal=goal.q,
        wanted=point,
        tool=contact,
        wrench=task.force.along(row, along),
        to_contact=point - wanted.position,
        axes=task.base[row].rotation,
        conditions=task.conditions_at(row, along, corrected=command is not None),
        at_rest=task.between_sides(row),
        spindle=turned(wanted.rotation, spindle[row]),
        process=task.process,
        direction=_sides(task, row, along, LITTLE_GAP),
        wide_direction=_sides(task, row, along, WIDE_GAP),
        good=np.asarray(found.reachable & goal.reachable),
    )


def _sides(task: CompensationProblem, row: Ints, along: Floats, gap: float) -> Floats:
    """(K, n) -1..1 side of each axis on its ``gap`` [rad], by the joint values at the ends of the motions in their
    order."""
    q = task.track.q
    known = np.asarray(np.isfinite(q).all(axis=1))
    restart = ~known | ~task.toolpath.continues
    filled = np.where(known[:, None], q, 0.0)
    output = play_output(filled, np.full(q.shape[1], gap), restart)
    before = np.maximum(row - 1, 0)
    motor = filled[before] + along[:, None] * (filled[row] - filled[before])
    behind = np.clip(output[before], motor - 0.5 * gap, motor + 0.5 * gap)
    side = share(motor, behind, np.full(q.shape[1], gap))
    side[~known[row] | ~known[before]] = 0.0
    return side
