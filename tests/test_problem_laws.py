"""What a task asks for: where the tool is to be, what of an orientation can be corrected, and what of it shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import SOFTER
from test_mirror import CARRIES, TOOL, full, joints_only, task

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.correct import correct
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import pose_error, predict
from postproc.model import NOTHING
from postproc.process import Wrenches
from postproc.robot.axis_track import nominal_flange

ROWS = np.array([7, 1, 5])
NONE, Z, ACROSS = np.full(3, np.nan), np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])


def predicted(job, rows, command, wrench):
    tool = Poses(np.tile(TOOL.rotation, (len(rows), 1, 1)), np.tile(TOOL.position, (len(rows), 1)))
    return predict(
        job.model, command, LoadCase(tool, wrench, NOTHING, job.track.branch[rows], job.track.q[rows])
    )


def test_the_goal_is_the_wanted_pose_or_where_the_robot_takes_it_without_force():
    job = task(model=full(**SOFTER))
    wanted = job.wanted[ROWS]
    goal = job.goal(ROWS, wanted)
    still = predicted(job, ROWS, wanted, np.zeros((3, 6))).pose
    np.testing.assert_allclose(goal.position, still.position, atol=1e-9)
    np.testing.assert_allclose(goal.rotation, still.rotation, atol=1e-9)
    assert (np.linalg.norm(goal.position - wanted.position, axis=1) > 1e-4).all()
    absolute = replace(job, process=False).goal(ROWS, wanted)
    np.testing.assert_array_equal(absolute.position, wanted.position)
    np.testing.assert_array_equal(absolute.rotation, wanted.rotation)
    # a robot that nothing bends but the force stands where it is sent
    model = joints_only()
    assert model.zero_without_load
    slack = task(model=model).goal(ROWS, wanted)
    np.testing.assert_array_equal(slack.position, wanted.position)


@pytest.mark.parametrize("process", [True, False])
def test_the_command_brings_the_tool_to_its_goal_under_the_force(process):
    job = task(model=full(**SOFTER), process=process)
    wanted = job.wanted[ROWS]
    wrench = np.array([[100.0, 20, -300, 1, 2, 3], [-200.0, 0, 500, 0, 0, 0], [0.0, 0, 0, 0, 20, 0]])
    goal = job.goal(ROWS, wanted)
    done = job.command(ROWS, wanted, wrench, goal)
    assert done.converged.all()
    there = predicted(job, ROWS, done.command, wrench)
    for off in pose_error(there.pose, goal):
        assert np.linalg.norm(off, axis=1).max() <= 1.2e-8
    real = job.simulated(ROWS, done.command, wrench)
    np.testing.assert_allclose(real.pose.position, there.pose.position, atol=1e-9)
    np.testing.assert_allclose(real.q, there.q, atol=1e-12)


def test_joints_alone_are_corrected_in_one_step():
    """Where the goal's own joint angles tell how far the loaded joints are bent, nothing is left to iterate."""
    job = task(model=joints_only())
    result = correct(job)
    assert (result.before[CARRIES] > 1e-4).all()
    assert (result.iterations[CARRIES] == 1).all()
    assert (result.history[1][CARRIES] < 1e-8).all()
    # with a compensator the bending is a guess, but a good one
    result = correct(task())
    assert (result.iterations[CARRIES] <= 3).all()


SAID = {
    "all": (True, NONE),
    "nothing": (False, NONE),
    "about z": (True, Z),
    "about an axis across": (True, ACROSS),
    "nothing, about z": (False, Z),
}


def saying(*names):
    """A task of which motion k can say what ``names[k]`` says, the others all."""
    oriented, free = np.ones(9, bool), np.full((9, 3), np.nan)
    for row, name in enumerate(names):
        oriented[row], free[row] = SAID[name]
    return task(orientation_programmed=oriented, redundant_axis=free)


@pytest.mark.parametrize("name", SAID)
@pytest.mark.parametrize("row", [0, 1, 2])
def test_what_a_text_can_say_of_an_orientation(name, row):
    names = ["all"] * 3
    names[row] = name
    job = saying(*names)
    rows, turns = (
        np.array([0, 1, 2]),
        rotation_from_vector(np.array([[0.3, -0.2, 0.5], [1.0, 0, 0], [0, 2.0, 0.1]])),
    )
    assert job.turn_freely(rows) == (name == "all")
    assert job.turn_freely(np.array([3, 4]))
    found = job.orientation_projection(rows, turns)
    if name == "all":
        assert found is None
        return
    oriented, free = SAID[name]
    axis = turns[row] @ np.nan_to_num(free)
    expected = np.tile(np.eye(3), (3, 1, 1))
    expected[row] = (np.eye(3) - np.outer(axis, axis)) if oriented else 0.0
    np.testing.assert_allclose(found, expected, atol=1e-15)
    assert job.orientation_projection(np.array([3, 8]), turns[:2]) is None


def test_what_is_off_is_what_can_be_corrected_and_what_shows_is_what_the_part_sees():
    """A turn about a free axis is neither; an orientation that the text can not say shows all the same."""
    names = list(SAID)
    job = saying(*names)
    rng = np.random.default_rng(12)
    rows = np.array([3, 0, 4, 2, 1, 6])
    goal = Poses(rotation_from_vector(rng.normal(size=(6, 3))), rng.normal(size=(6, 3)))
    shift, turn = rng.normal(size=(6, 3)) * 1e-3, rng.normal(size=(6, 3)) * 1e-2
    real = Poses(rotation_from_vector(turn) @ goal.rotation, goal.position + shift)
    off, seen = job.pose_errors(rows, real, goal), job.visible_errors(rows, real, goal)
    for k, row in enumerate(rows):
        oriented, free = SAID[names[row]] if row < len(names) else SAID["all"]
        axis = goal.rotation[k] @ np.nan_to_num(free)
        shows = turn[k] - (turn[k] @ axis) * axis
        np.testing.assert_allclose(off[0][k], shift[k], atol=1e-12)
        np.testing.assert_allclose(seen[0][k], shift[k], atol=1e-12)
        np.testing.assert_allclose(seen[1][k], shows, atol=1e-12)
        np.testing.assert_allclose(off[1][k], shows if oriented else np.zeros(3), atol=1e-12)
    free = np.array([5, 6])
    for off in (job.pose_errors, job.visible_errors):
        np.testing.assert_allclose(off(free, real[:2], goal[:2])[1], turn[:2], atol=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("column", [0, 2, 5])
def test_a_correction_begins_anew_where_the_force_jumps_in_any_component(scale, column):
    """By more than its digits: a part in a billion of the largest force, of a newton where there is less."""
    values = np.where(CARRIES[:, None], scale * np.array([1.0, 0.5, 0.3, 0.1, 0.2, 0.4]), 0.0)
    largest = max(1.0, np.linalg.norm(values[:, :3], axis=1).max())
    job, corrected, rows = task(), CARRIES.copy(), np.array([2, 6, 7])
    for jump, anew in ((0.5e-9, False), (2e-9, True), (-2e-9, True), (1.0, True)):
        begin = values.copy()
        begin[[2, 6, 7]] = values[[1, 5, 6]]
        begin[6, column] += jump * largest
        forced = replace(job, force=Wrenches(values, begin, CARRIES, "test", (), np.zeros(9, bool)))
        assert forced.steps(rows, corrected).tolist() == [False, anew, False]
    corrected[[1, 6]] = False
    assert forced.steps(rows, corrected).tolist() == [True, True, True]
    for every in (np.ones(9, bool), np.zeros(9, bool)):
        assert forced.steps(np.array([0]), every).tolist() == [True]
    # with another tool as well
    path = job.toolpath.with_columns(tool=np.arange(9) % 2)
    assert replace(forced, toolpath=path).steps(rows, np.ones(9, bool)).all()
    assert replace(forced, toolpath=path).steps(rows, np.zeros(9, bool)).all()


def test_a_correction_goes_on_along_the_joints_of_the_track():
    """Of a motion that the program takes with a turn more of A6 so does the correction."""
    job = task()
    q = job.track.q.copy()
    q[5:8, 5] += 2 * np.pi
    job = replace(job, track=replace(job.track, q=q))
    result = correct(job)
    rows = np.flatnonzero(result.corrected)
    done = predicted(job, rows, result.command[rows], job.wrench[rows])
    assert np.abs(done.q - q[rows]).max() < np.radians(1.0)
    flange = nominal_flange(job.model.robot, q[rows])
    np.testing.assert_allclose((flange @ TOOL).position, job.wanted.position[rows], atol=1e-12)
