"""What is told of the way between corrected end points."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import LINES
from scipy.spatial.transform import Rotation, Slerp

from postproc.compensation.between import SHARES, errors_between
from postproc.compensation.correct import correct
from postproc.compensation.division import Limits, divide, made
from postproc.geometry import Poses
from postproc.robot.inverse import inverse
from postproc.workflows.preparation import Request, prepare


def passed(poses, row, share):
    """Straight and evenly turned, by scipy."""
    turn = Slerp([0, 1], Rotation.from_matrix(poses.rotation[row - 1 : row + 1]))(share).as_matrix()
    return turn, (1 - share) * poses.position[row - 1] + share * poses.position[row]


def reached(task, row, pose, wrench):
    """Where the tool comes when it is sent to ``pose``, by the model alone."""
    tool = task.tool[row]
    rotation, position = pose
    flange_turn = rotation @ tool.rotation.T
    flange = Poses(flange_turn[None], (position - flange_turn @ tool.position)[None])
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


def left_between(task, result):
    """(N,) [m] what is left on the way of each corrected motion where nothing is inserted, NaN for others."""
    rows = np.flatnonzero(result.corrected)
    found = np.full(len(task.toolpath), np.nan)
    found[rows], _ = errors_between(task, made(task, divide(task, result, Limits(keep=True)), rows))
    return found


def test_between_is_where_the_controller_passes(corrected):
    task, result = corrected
    found = left_between(task, result)
    for row in np.flatnonzero(result.corrected):
        along = task.wanted.position[row] - task.wanted.position[row - 1]
        off = []
        for share in SHARES:
            wrench = (1 - share) * task.force.start[row] + share * task.force.values[row]
            real = reached(task, row, passed(result.command[:], row, share), wrench)
            goal = reached(task, row, passed(task.wanted[:], row, share), np.zeros(6))
            off.append(np.linalg.norm(np.cross(real - goal, along)) / np.linalg.norm(along))
        assert found[row] == pytest.approx(max(off), rel=1e-6, abs=1e-12)


def test_without_a_link_the_correction_fades_in_along_the_first_motion_of_a_cut(corrected):
    """At a quarter of its way a quarter of the correction is there, so about three quarters of the error are left."""
    task, result = corrected
    found = left_between(task, result)
    first = int(np.flatnonzero(result.corrected)[0])
    along = task.wanted.position[first] - task.wanted.position[first - 1]
    across = np.linalg.norm(np.cross(result.deflection[first], along)) / np.linalg.norm(along)
    assert found[first] == pytest.approx(0.75 * across, rel=0.25)
    assert found[first + 1] < 0.1 * found[first]


def test_it_is_told_where_it_is_worst(compensate, job):
    done = compensate(job.program, "--force", "--keep-points", "--json", "-")
    assert done.code == 3
    (finding,) = [f for f in done.json["findings"] if f["code"] == "COR006"]
    assert finding["line"] in (10, 19)  # the first motions of the two cuts
    assert "mm from the wanted way" in finding["message"]
