"""Hand-made motions for tests: a Toolpath from TCP poses, without a program's text."""

from dataclasses import fields

import numpy as np

from postproc.base.geometry import Poses
from postproc.effects import ChainState, Conditions
from postproc.robot.chain import Chain
from postproc.toolpath import (
    Configuration,
    EditConstraints,
    FrameRef,
    Kind,
    MotionSequence,
    MotionSpeeds,
    OrientationControl,
    ProgramComments,
    Targets,
    Toolpath,
)

PARTS = {
    "targets": Targets,
    "speeds": MotionSpeeds,
    "sequence": MotionSequence,
    "constraints": EditConstraints,
    "orientation_control": OrientationControl,
    "remarks": ProgramComments,
}


def toolpath_of(**columns) -> Toolpath:
    """A toolpath of its own fields and of those of its ``PARTS``."""
    for part, type_ in PARTS.items():
        own = {one.name: columns.pop(one.name) for one in fields(type_) if one.name in columns}
        if own:
            columns[part] = type_(**own)
    return Toolpath(**columns)


def milling_angles(count, rng):
    """(N, 6) [rad] where a heavy arm mills: in front of itself, well inside of the limits, away from singularities."""
    centre = np.radians([0.0, -55.0, 80.0, 0.0, 60.0, 0.0])
    spread = np.radians([60.0, 25.0, 30.0, 80.0, 30.0, 150.0])
    return centre + spread * rng.uniform(-1.0, 1.0, (count, 6))


def motions(target: Poses, kind=Kind.LIN, axes=None, status=-1, turn=-1, **more) -> Toolpath:
    """One motion per pose of ``target`` (N), base and tool known; line 10 is the first.  ``more``: fields of a Toolpath
    and of its ``PARTS``.

    ``axes``: row -> (6,) [rad]; those rows become AXIS motions.  ``status``, ``turn``, ``kind``: for all, or (N,).
    """
    n = len(target)
    kinds, joint = np.broadcast_to(kind, n).copy(), np.full((n, 6), np.nan)
    position, rotation = target.position.copy(), target.rotation.copy()
    for row, angles in (axes or {}).items():
        kinds[row], joint[row], position[row], rotation[row] = Kind.AXIS, angles, np.nan, np.nan
    world = Poses.identity()
    return toolpath_of(
        kind=kinds,
        position=position,
        rotation=rotation,
        axes=joint,
        feed=np.full(n, 0.05),
        base=np.zeros(n),
        tool=np.ones(n),
        configuration=Configuration({"status": np.broadcast_to(status, n), "turn": np.broadcast_to(turn, n)}),
        line=np.arange(10, 10 + n),
        frames=(FrameRef(1, world), FrameRef(1, world)),
        **more,
    )


def load_of(effect, values, robot, coordinates, motors):
    """Force and slope (n, N) of a load at displaced ``coordinates`` (n, N) of a robot with ``motors`` at (n, N)."""
    chain = Chain(robot.joints, robot.flange)
    state = ChainState(
        chain=chain,
        gravity=np.array([0.0, 0.0, -9.81]),
        motors=motors,
        rest=motors,
        coordinates=coordinates,
        swept=chain.evaluate(coordinates, Poses.identity()),
        wrench=np.zeros((6, motors.shape[1])),
        conditions=Conditions(),
    )
    force, slope = np.zeros_like(coordinates), np.zeros_like(coordinates)
    effect.add_force(values, state, force, slope)
    return force, slope
