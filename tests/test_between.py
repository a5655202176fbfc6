"""What is told of the way between corrected end points."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import LINES
from scipy.spatial.transform import Rotation, Slerp

from postproc.compensation.between import midway_errors
from postproc.compensation.correct import correct
from postproc.robot.inverse import inverse
from postproc.workflows.preparation import Request, prepare


def halfway(poses, row):
    """Straight and evenly turned, by scipy."""
    turn = Slerp([0, 1], Rotation.from_matrix(poses.rotation[row - 1 : row + 1]))(0.5).as_matrix()
    return turn, poses.position[row - 1 : row + 1].mean(axis=0)


def reached(task, row, pose, wrench):
    """Where the tool comes when it is sent to ``pose``, by the model alone."""
    tool = task.tool[row]
    rotation, position = pose
    flange_turn = rotation @ tool.rotation.T
    flange = type(task.wanted)(flange_turn[None], (position - flange_turn @ tool.position)[None])
    q = inverse(task.model.robot.nominal, flange, task.track.status[[row]], task.track.q[[row]]).q
    return task.model.equilibrium(q, wrench[None], tool).pose.position[0]


@pytest.fixture
def corrected(job):
    lines = list(LINES)
    # turned on the way, so that the orientation in the middle counts
    lines[11] = "LIN {X 200.000,Y 150.000,Z -2.000,A 25.000,B 4.000,C 176.000} C_DIS"
    job.write(lines)
    ready = prepare(Request(program=job.program, force=""))
    return ready.task, correct(ready.task)


def test_middle_is_where_the_controller_passes(corrected):
    task, result = corrected
    found = midway_errors(task, result)
    rows = np.flatnonzero(np.isfinite(found))
    assert rows.tolist() == np.flatnonzero(result.corrected).tolist()
    for row in rows:
        wrench = (task.wrench_start[row] + task.wrench[row]) / 2
        real = reached(task, row, halfway(result.command, row), wrench)
        goal = reached(task, row, halfway(task.wanted, row), np.zeros(6))
        along = task.wanted.position[row] - task.wanted.position[row - 1]
        off = np.linalg.norm(np.cross(real - goal, along)) / np.linalg.norm(along)
        assert found[row] == pytest.approx(off, rel=1e-6, abs=1e-12)


def test_correction_fades_in_along_the_first_motion_of_a_cut(corrected):
    """At its middle half of the correction is there, so about half of the error is left."""
    task, result = corrected
    found = midway_errors(task, result)
    first = int(np.flatnonzero(result.corrected)[0])
    along = task.wanted.position[first] - task.wanted.position[first - 1]
    across = np.linalg.norm(np.cross(result.deflection[first], along)) / np.linalg.norm(along)
    assert found[first] == pytest.approx(across / 2, rel=0.25)
    assert found[first + 1] < 0.1 * found[first]


def test_it_is_told_where_it_is_worst(compensate, job):
    done = compensate(job.program, "--force", "--json", "-")
    (finding,) = [f for f in done.json["findings"] if f["code"] == "COR006"]
    assert finding["line"] in (10, 19)  # the first motions of the two cuts
    assert "mm from the line" in finding["message"]
