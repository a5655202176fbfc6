"""Hand-made tasks with a way: a line, a circle, a corner, under a force, on the KR 270 with its compensator."""

import numpy as np
from motions import motions
from plant import kr270, with_compensator

from postproc.base.geometry import Poses, rotation_from_abc
from postproc.compensation.path_error import PathSegments
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import subdivided_motions
from postproc.model import NOTHING, StiffnessModel
from postproc.process import Wrenches
from postproc.robot.axis_track import follow_axes
from postproc.toolpath import Arcs, Kind, Role

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
    # what comes before a cut is a jump, unless a test asks for more: it can not lead in
    kinds = np.where(carries, kind, Kind.PTP) if np.ndim(kind) == 0 else kind
    path = motions(wanted, kinds, **words)
    model = with_compensator(StiffnessModel.from_robot(kr270()))
    values = np.where(carries[:, None], wrench, 0.0)
    begin = values if start is None else np.where(carries[:, None], start, 0.0)
    return CompensationProblem(
        file="part.src",
        toolpath=path,
        model=model,
        track=follow_axes(model.robot, path, wanted @ TOOL.inverse(), START),
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


def in_even_pieces(task, division, row, count):
    """(count,) pieces of the way of a motion of a division, if that had so many even ones, begun as it is there."""
    first = np.flatnonzero((division.source == row) & (division.role != Role.TRANSITION))[:1]
    rows, share = np.full(count, row), np.arange(1, count + 1) / count
    end = commands(task, rows, share)
    begin = end[np.arange(count) - 1]
    begin.put(np.array([0]), subdivided_motions(task, division, first).start)
    if task.toolpath.kind[row] != Kind.CIRC:
        return PathSegments.straight(rows, share - 1 / count, share, begin, end)
    via = commands(task, rows, share - 0.5 / count)
    free = task.toolpath.arcs.plane_free[rows, None]
    normal = np.where(free, np.nan, task.desired_path.circles(rows)[1])
    return PathSegments.round(rows, share - 1 / count, share, begin, via, end, normal)


def commands(task, rows, share):
    """Where the controller has to be sent so that the tool is at the shares of the wanted ways."""
    wanted = task.desired_path.at(rows, share)
    return task.command(rows, wanted, task.force.along(rows, share), task.goal(rows, wanted)).command


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
        kind=[Kind.PTP, Kind.PTP, Kind.CIRC, Kind.LIN],
        arcs=Arcs(
            centre=np.array([none, none, centre, none]),
            normal=np.array([none, none, [0.0, 0.0, 1.0], none]),
            sweep=np.array([np.nan, np.nan, sweep, np.nan]),
        ),
        **words,
    )


def corner(**words):
    """Two cuts that meet at a right angle; the force turns with them."""
    points = [[1.5, 0, 0.6], [1.5, 0, 0.5], [1.6, 0, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.6]]
    wrench = np.array(
        [[0.0] * 6, [0.0] * 6, [-300.0, 100, 200, 0, 0, 0], [100.0, 300, 200, 0, 0, 0], [0.0] * 6]
    )
    return task(points, [False, False, True, True, False], wrench=wrench, **words)
