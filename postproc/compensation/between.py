"""What a correction of end points leaves over in the middle of straight motions."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Floats
from postproc.compensation.correct import Result, Task
from postproc.compensation.mirror import partly, predict
from postproc.toolpath import Kind


def midway_errors(task: Task, result: Result) -> Floats:
    """Distance (N,) [m] of the predicted tool from the wanted line, half way along each corrected straight motion.

    The controller runs straight from command to command and turns evenly; the wrench is half way between its values
    at both ends.  NaN where there is no such middle: other motions, and a start that is not known.
    """
    path = task.toolpath
    errors = np.full(len(path), np.nan)
    rows = np.flatnonzero(result.corrected & (path.kind == Kind.LIN))
    rows = rows[rows > 0]
    begins = path.known[rows - 1] & (path.tool[rows] == path.tool[rows - 1])
    rows = rows[begins & np.isfinite(result.command.position[rows - 1, 0])]
    along = task.wanted.position[rows] - task.wanted.position[rows - 1]
    length = np.linalg.norm(along, axis=1)
    rows, along = rows[length > 0], along[length > 0] / length[length > 0, None]
    if not len(rows):
        return errors
    wanted = partly(task.wanted[rows - 1], task.wanted[rows], 0.5)
    command = partly(result.command[rows - 1], result.command[rows], 0.5)
    wrench = 0.5 * (task.wrench_start[rows] + task.wrench[rows])
    tool, conditions = task.tool[rows], task.conditions.part(rows)
    status, near = task.track.status[rows], task.track.q[rows]
    real = predict(task.model, command, tool, wrench, conditions, status, near).pose.position
    goal = wanted.position
    if task.process:
        goal = predict(
            task.model, wanted, tool, np.zeros_like(wrench), conditions, status, near
        ).pose.position
    off = real - goal
    errors[rows] = np.linalg.norm(off - np.sum(off * along, axis=1, keepdims=True) * along, axis=1)
    return errors
