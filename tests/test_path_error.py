"""What is told of the way between corrected end points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import JUMPED_LINES
from path_cases import corner
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation, Slerp

from postproc.base.geometry import Poses
from postproc.compensation.correct import correct
from postproc.compensation.path_error import ON_RAMPS, SHARES, path_errors, path_errors_at, programmed
from postproc.compensation.ramped_forces import add_force_ramps
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, subdivided_motions
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
    q = inverse(task.model.robot.nominal, flange, task.track.branch[[row]], task.track.q[[row]]).q
    return task.model.equilibrium(q, wrench[None], tool).pose.position[0]


@pytest.fixture
def corrected(job):
    lines = list(JUMPED_LINES)
    # turned on the way, so that the orientation in the middle counts
    lines[11] = "LIN {X 200.000,Y 150.000,Z -2.000,A 25.000,B 4.000,C 176.000} C_DIS"
    job.write(lines)
    ready = prepare(Request(program=job.program, force=""))
    return ready.task, correct(ready.task)


def left_between(task, result):
    """(N,) [m] what is left on the way of each corrected motion where nothing is inserted, NaN for others."""
    rows = np.flatnonzero(result.corrected)
    found = np.full(len(task.toolpath), np.nan)
    found[rows], _ = path_errors(
        task, subdivided_motions(task, subdivide(task, result, Limits(no_insert=True)), rows)
    )
    return found


def test_a_motion_as_programmed_is_the_whole_of_its_path(corrected):
    task, result = corrected
    rows = np.flatnonzero(result.corrected)
    segments = programmed(task, rows)
    assert (segments.first == 0.0).all()
    assert (segments.last == 1.0).all()
    np.testing.assert_array_equal(segments.end.position, task.wanted[rows].position)


@pytest.mark.parametrize("length", [2e-3, 5e-3])
def test_where_a_force_goes_over_the_path_is_looked_at_closely(length):
    """The error of a motion with a ramp is the largest of those at all places."""
    task = corner()
    steps = np.array([False, False, True, True, False])
    task = add_force_ramps(replace(task, force=replace(task.force, steps=steps)), length)
    rows = np.array([3, 4])
    segments = programmed(task, rows)
    found, _ = path_errors(task, segments)
    each = {share: path_errors_at(task, segments, np.full(2, share))[0] for share in (*SHARES, *ON_RAMPS)}
    largest = np.max(list(each.values()), axis=0)
    ramped = np.isin(rows, task.force.ramps.row)
    np.testing.assert_array_equal(found[ramped], largest[ramped])
    closely = np.max([each[share] for share in ON_RAMPS], axis=0)
    assert (closely > np.max([each[share] for share in SHARES], axis=0))[ramped].any()


def test_between_is_where_the_controller_passes(corrected):
    task, result = corrected
    found = left_between(task, result)
    command = subdivide(task, result, Limits(no_insert=True)).original_command[
        :
    ]  # with what leads into the second cut
    for row in np.flatnonzero(result.corrected):
        along = task.wanted.position[row] - task.wanted.position[row - 1]
        off = []
        for share in SHARES:
            wrench = (1 - share) * task.force.start[row] + share * task.force.values[row]
            real = reached(task, row, passed(command, row, share), wrench)
            goal = reached(task, row, passed(task.wanted[:], row, share), np.zeros(6))
            off.append(np.linalg.norm(np.cross(real - goal, along)) / np.linalg.norm(along))
        assert found[row] == pytest.approx(max(off), rel=1e-6, abs=1e-9)  # a nanometre: where equilibria end


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
    job.write(JUMPED_LINES)
    done = compensate(job.program, "--force", "--no-insert", "--json", "-")
    assert done.code == 3
    finding, turned = [f for f in done.json["findings"] if f["code"] == "COR006"]
    assert finding["line"] == 10  # the first motion of the cut that nothing can lead into
    assert "the path error between points is up to" in finding["message"]
    assert turned["line"] == 10
    assert "the orientation error between points is up to" in turned["message"]
    assert f"up to {done.json['angle_way_after_deg']['max']:.4f} deg" in turned["message"]


TURNING_ARC = [
    "LIN {X 100,Y 0,Z 0,A 0,B 0,C 180}",
    "CIRC {X 142.426,Y 17.574,Z 0},{X 160,Y 60,Z 0,A 40,B 0,C 180}",
    "LIN {X 160,Y 160,Z 0,A 40,B 0,C 180}",
]


@pytest.fixture
def turning(job):
    """A tool that turns along an arc, 0.4 deg a millimetre."""
    job.write(
        [*JUMPED_LINES[:8], "LIN {X 0,Y 0,Z 0,A 0,B 0,C 180}", ";FORCE -150 260 -60 @feed", *TURNING_ARC, ";FORCE OFF",
         "LIN {X 160,Y 160,Z 50,A 40,B 0,C 180}", "END"]
    )  # fmt: skip
    return job


def test_the_orientation_is_that_of_the_place_where_the_tool_is(turning):
    """A tool that is early where the path turns it is held against the path's orientation there: nearest by search."""
    ready = prepare(Request(program=turning.program, force=""))
    task, result = ready.task, correct(ready.task)
    arc = np.array([np.flatnonzero(task.desired_path.arc)[0]])
    pieces = subdivided_motions(task, subdivide(task, result, Limits(no_insert=True)), arc)
    _, angle = path_errors(task, pieces, shown=True)
    apart = []
    for share in SHARES:
        real = task.simulated(
            arc,
            pieces.at(np.array([share])),
            task.force.along(arc, np.array([share])),
            share=np.array([share]),
        )

        def wanted(at):
            there = np.array([at])
            return task.goal(arc, task.desired_path.at(arc, there), there)

        def away(at):
            return np.linalg.norm(real.pose.position - wanted(at).position)  # noqa: B023

        nearest = minimize_scalar(
            away, bounds=(share - 0.1, share + 0.1), method="bounded", options={"xatol": 1e-9}
        ).x
        turn = real.pose.rotation[0] @ wanted(nearest).rotation[0].T
        apart.append(np.linalg.norm(Rotation.from_matrix(turn).as_rotvec()))
    assert max(apart) > 5 * task.tolerance_angle
    assert angle[0] == pytest.approx(max(apart), rel=0.02)


@pytest.mark.slow
def test_an_arc_on_which_the_tool_turns_is_divided_until_it_turns_in_its_place(compensate, turning):
    done = compensate(turning.program, "--force", "--json", "-")
    assert done.json["angle_way_after_deg"]["max"] < 0.01
    checked = compensate("verify", turning.program, turning.output, "--force", "--json", "-")
    assert "deg turned" not in " ".join(f["message"] for f in checked.json["findings"])


def spline(job, frame, step):
    """Points of a spline along a half circle of 60 mm, ``step`` deg apart."""
    angles = np.radians(np.arange(-90 + step, 90 + step / 2, step))
    points = [f"SPL {{X {60 * np.cos(a):.4f},Y {60 * np.sin(a):.4f},Z 0,A 0,B 0,C 180}}" for a in angles]
    job.write(
        [*JUMPED_LINES[:8], "LIN {X 0,Y -60,Z 0,A 0,B 0,C 180}", f";FORCE -150 260 -60 @{frame}", "SPLINE", *points,
         "ENDSPLINE", ";FORCE OFF", "LIN {X 0,Y 60,Z 50,A 0,B 0,C 180}", "END"]
    )  # fmt: skip
    return job


@pytest.mark.parametrize(
    ("frame", "step", "told"), [("feed", 20, True), ("feed", 0.25, False), ("base", 20, False)]
)
def test_a_force_that_turns_with_a_spline_is_told_where_its_points_are_far_apart(
    compensate, job, frame, step, told
):
    done = compensate(spline(job, frame, step).program, "--force", "--json", "-")
    found = [f for f in done.json["findings"] if f["code"] == "COR018"]
    assert bool(found) == told
    if told:
        assert done.code == 3
        # at the ends of the spline the feed is 10 deg beside its chord
        off = float(found[0]["message"].split("off by ")[1].split(" mm")[0])
        assert off == pytest.approx(2 * np.sin(np.radians(5)) * done.json["error_before_mm"]["max"], rel=0.5)
