"""What the next program is given of what was learnt, and what of a tool's radius it cannot correct."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.learning.attribution import Attribution
from postproc.learning.measured_walls import MeasuredWalls, measured_walls
from postproc.learning.next_program import LearnedError, force_factors, learned_error
from postproc.learning.promise import Promise
from postproc.learning.surface_displacement import SurfaceDisplacement
from postproc.process import Wrenches
from postproc.workflows.cell_tool_errors import tool_displacement
from postproc.workflows.learn_corners import corner_error
from postproc.workflows.learn_points import CutProgram, Matched
from postproc.workflows.learn_tool import tool_errors
from postproc.workflows.preparation import LearnedInputs

_MATTERS = 0.5
"""Share of what the promise is without it from which an error that stays is reported."""


def walls_of(result: Attribution, job: CutProgram) -> MeasuredWalls:
    """Where the measured walls of an attribution lie."""
    task, path = job.ready.task, job.ready.task.toolpath
    hand = path.reflections.sides(path.rotation, job.spindle)
    straight = [cutter.number for cutter in job.motions.cutters if cutter.taper is None]
    points = result.prediction.points
    return measured_walls(points, task.desired_path, job.operations, job.tool, straight, hand, task.carries)


def learned_inputs(job: CutProgram, matched: Matched, result: Attribution) -> LearnedInputs:
    """What the main job is given beside the robot file."""
    task, factors = job.ready.task, force_factors(result)
    base = task.base[np.arange(len(task.toolpath))].rotation

    def forces(stated: Wrenches) -> Wrenches:
        return factors.acting(stated, job.operations, base)

    return LearnedInputs(forces, _error(job, matched, result, forces(task.force)))


def _error(job: CutProgram, matched: Matched, result: Attribution, force: Wrenches) -> LearnedError:
    rigid = matched.centre, matched.axes
    walls = walls_of(result, job)
    errors = tool_errors(result, job.ready.cell, walls)
    leaning = [index for index, name in enumerate(job.operations.names) if name in walls.leaning]
    acts = np.isin(job.tool, job.ball) | np.isin(job.operations.which, leaning)
    none = dict.fromkeys(walls.leaning, 0)
    beside = {
        number: replace(one, radius=0.0) if number in job.ball else replace(one, walls={**one.walls, **none})
        for number, one in errors.items()
    }
    displaced = tool_displacement(beside, job.ready.task, job.spindle, job.tool, job.operations)
    tool = replace(displaced, motion_side=walls.motion_side)
    radius = {number: one.radius for number, one in errors.items() if one.radius}
    points = result.prediction.points
    surface = SurfaceDisplacement(radius, job.ball, job.tool, job.operations.which, acts, points)
    corners = corner_error(job, result, force)
    return learned_error(result, (tool, surface), rigid, job.time, corners)


def tool_remains(
    job: CutProgram, matched: Matched, result: Attribution, last: Bools, promised: Promise
) -> tuple[Promise, list[Finding]]:
    """``promised`` with what the next program leaves of the tools' errors at the points ``last`` (K,), the part that
    was cut last, and LRN024 where that matters."""
    own = np.flatnonzero(result.kept & last)
    stays = _tool_error(job, matched, result)[own]
    remaining = promised.with_remaining(stays, result.layout.free[own])
    if remaining.after**2 - promised.after**2 <= (_MATTERS * promised.after) ** 2:
        return remaining, []
    size = float(np.sqrt(np.mean(stays**2)))
    worst = int(own[np.argmax(np.abs(stays))])
    tool = int(job.tool[matched.points.row[worst]])
    message = (
        f"{size / MM:.3f} mm RMS of the learnt radius of tool {tool} stay at the measured points: this motion leaves"
        " surfaces on both sides of it, or their side is not known; the promise includes them"
    )
    line = int(job.ready.task.toolpath.line[matched.points.row[worst]])
    help = "set the radius of the tool in control and CAM, or use a tool of the programmed size"
    return remaining, [Finding("LRN024", message, job.ready.task.file, line, help=help)]


def _tool_error(job: CutProgram, matched: Matched, result: Attribution) -> Floats:
    """(K,) [m] along the normals of the points: what the tools' errors do, less what the next program corrects."""
    points = result.prediction.points
    stays = np.zeros(len(points))
    for cause, value in zip(result.causes, result.x.tolist(), strict=True):
        if cause.group == "tool":
            stays += cause.weight * (cause.value + value)
    error = _error(job, matched, result, job.ready.task.force)
    wanted = job.ready.task.desired_path.at(points.row, points.share)
    moved = error.tool.at(points.row, wanted, points.share) + error.surface.at(points.row, wanted)
    return np.asarray(stays - np.sum(moved * points.normal, axis=1))
