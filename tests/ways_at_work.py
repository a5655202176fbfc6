"""Hand-made tasks with a way: a line, a circle, a corner, under a force, on the KR 270 with its compensator."""

import numpy as np
from motions import motions
from plant import kr270, with_compensator

from postproc.compensation.task import Task
from postproc.forces import Wrenches
from postproc.geometry import Poses, rotation_from_abc
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.track import follow
from postproc.toolpath import Kind

TOOL = Poses(np.eye(3), np.array([0.0, 0.0, 0.3]))
DOWN = rotation_from_abc(np.array([0.0, 0.0, np.pi]))
START = np.radians([0.0, -90.0, 90.0, 0.0, 45.0, 0.0])
FORCE = np.array([-200.0, 300.0, 560.0, 0.0, 0.0, 0.0])


def task(points, carries, kind=Kind.LIN, wrench=FORCE, start=None, tolerance=2e-5, gain=1.0, **words):
    """A task to ``points`` (N, 3) [m] in the robot base, tool down; ``carries`` (N,) motions with force."""
    points = np.asarray(points, float)
    n = len(points)
    carries = np.asarray(carries, bool)
    wanted = Poses(np.tile(DOWN, (n, 1, 1)), points)
    tool = Poses(np.tile(TOOL.rotation, (n, 1, 1)), np.tile(TOOL.position, (n, 1)))
    path = motions(wanted, kind, **words)
    model = with_compensator(StiffnessModel.from_robot(kr270()))
    values = np.where(carries[:, None], wrench, 0.0)
    begin = values if start is None else np.where(carries[:, None], start, 0.0)
    return Task(
        file="part.src",
        toolpath=path,
        model=model,
        track=follow(model.robot, path, wanted @ TOOL.inverse(), START),
        wanted=wanted,
        base=Poses(np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))),
        tool=tool,
        force=Wrenches(values, begin, carries, "test", (), np.zeros(n, bool)),
        conditions=NOTHING,
        process=True,
        gain=gain,
        max_correction=0.02,
        tolerance=tolerance,
        tolerance_angle=np.radians(0.01),
    )


def line(length=0.8, **words):
    """A cut straight across the workspace, between two moves in air."""
    half = length / 2
    points = [[1.6, -half, 0.6], [1.6, -half, 0.5], [1.6, half, 0.5], [1.6, half, 0.6]]
    return task(points, [False, False, True, False], **words)


def circle(diameter=0.6, sweep=2 * np.pi, rise=0.0, **words):
    """A cut around (all of it, or a part), between two moves in air."""
    radius, centre = diameter / 2, np.array([1.6, 0.0, 0.5])
    begin = centre + np.array([radius, 0.0, 0.0])
    end = centre + np.array([radius * np.cos(sweep), radius * np.sin(sweep), rise])
    up = np.array([0.0, 0.0, 0.1])
    none = np.full(3, np.nan)
    return task(
        [begin + up, begin, end, end + up],
        [False, False, True, False],
        kind=[Kind.LIN, Kind.LIN, Kind.CIRC, Kind.LIN],
        centre=np.array([none, none, centre, none]),
        normal=np.array([none, none, [0.0, 0.0, 1.0], none]),
        sweep=np.array([np.nan, np.nan, sweep, np.nan]),
        **words,
    )


def corner(**words):
    """Two cuts that meet at a right angle; the force turns with them."""
    points = [[1.5, 0, 0.6], [1.5, 0, 0.5], [1.6, 0, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.6]]
    wrench = np.array(
        [[0.0] * 6, [0.0] * 6, [-300.0, 100, 200, 0, 0, 0], [100.0, 300, 200, 0, 0, 0], [0.0] * 6]
    )
    return task(points, [False, False, True, True, False], wrench=wrench, **words)
