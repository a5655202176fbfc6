"""What a force in corners, as it was learnt, does along a program."""

from __future__ import annotations

import numpy as np

from postproc.learning.attribution import Attribution
from postproc.learning.next_program import CornerError, corner_size
from postproc.process import Wrenches
from postproc.workflows.learn_points import CutProgram

PROBE = np.array([100.0, 100.0, 100.0, 20.0, 20.0, 20.0])
"""[N, N m] Loads by which the compliance is found."""


def corner_error(job: CutProgram, result: Attribution, force: Wrenches) -> CornerError | None:
    """The further displacement in corners with the learnt robot and ``force`` (N); None where none was learnt."""
    size = corner_size(result)
    if size == 0.0:
        return None
    task = job.ready.task
    q, carries = task.track.q, np.flatnonzero(task.carries)
    model = result.prediction.model_at(result.x)
    ends = []
    for back in (1, 0):  # where a motion starts, and where it ends
        at = np.maximum(carries - back, 0)
        known = np.isfinite(q[at]).all(axis=1)
        rows, motors = carries[known], q[at[known]]
        tool = task.tool[rows]
        still = model.equilibrium(motors, np.zeros((len(rows), 6)), tool).pose.position
        compliance = np.zeros((len(q), 3, 6))
        for column, load in enumerate(np.diag(PROBE)):
            wrench = np.broadcast_to(load, (len(rows), 6))
            moved = model.equilibrium(motors, wrench, tool).pose.position - still
            compliance[rows, :, column] = np.nan_to_num(moved) / load[column]
        ends.append(compliance)
    return CornerError(size, job.corners, job.radius, force, *ends)
