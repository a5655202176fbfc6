"""What is told of a correction that comes near to what the robot can do, and what is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import START, TOOL, corner, line

from postproc.base import batches
from postproc.compensation.axis_limits import check_limits
from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.robot.axis_track import follow_axes, is_near_singular
from postproc.robot.description import find_robot, load_robot


def judged(task):
    result = correct(task)
    return check_limits(task, subdivide(task, result, Limits(max_growth=100.0)))


def codes(task):
    found, held = judged(task)
    return [finding.code for finding in found], {finding.code for finding in held.values()}


def with_limits(task, low, high):
    """The same task on a robot whose axes end at ``low`` and ``high`` (6,) [rad]."""
    robot = task.model.robot
    joints = tuple(
        replace(joint, lower=a, upper=b) for joint, a, b in zip(robot.joints, low, high, strict=True)
    )
    return replace(task, model=replace(task.model, robot=replace(robot, joints=joints)))


def test_nothing_is_told_where_nothing_is_near():
    assert codes(line()) == ([], set())


def test_an_axis_that_the_correction_brings_near_to_its_limit():
    task = line()
    turned = {}
    for side in (0, 1):  # a wall 1.05 deg away, on either side of A1 where the cut ends
        bounds = [limit.copy() for limit in task.model.robot.limits.T]
        bounds[side][0] = task.track.q[2, 0] + (-1, 1)[side] * np.radians(1.05)
        bounds[1 - side][0] = (1, -1)[side] * np.pi
        turned[side] = "KIN008" in codes(with_limits(task, *bounds))[0]
    # the correction turns A1 to one side: only the wall there comes nearer
    assert sorted(turned.values()) == [False, True]


def test_an_inserted_motion_beyond_a_limit_is_held():
    task = line()
    low, high = task.model.robot.limits.T.copy()
    high[0] = task.track.q[1, 0] - 5e-3  # where the cut begins A1 stands beyond it
    assert "COR008" in codes(with_limits(task, low, high))[1]


def test_axes_that_are_too_slow_for_the_feed():
    task = line()
    robot = task.model.robot
    axes = tuple(replace(axis, speed=np.radians(0.5)) for axis in robot.axes)
    slow = replace(task, model=replace(task.model, robot=replace(robot, axes=axes)))
    found, _ = judged(slow)
    assert [finding.code for finding in found] == ["KIN009"]
    assert "its speed limit is 0.5 deg/s" in found[0].message
    quick = replace(task, toolpath=task.toolpath.with_columns(feed=np.full(4, 1e-3)))
    quick = replace(quick, model=slow.model)
    assert codes(quick)[0] == []


def test_the_motion_that_is_too_fast_is_the_one_that_is_told():
    """The axes turn on the way to its end: its own feed counts, and its own line is told."""
    task = corner()
    robot, path = task.model.robot, task.toolpath
    axes = tuple(replace(axis, speed=np.radians(0.5)) for axis in robot.axes)
    feed = np.where(np.arange(len(path)) == 3, 0.1, 1e-5)
    slow = replace(task, model=replace(task.model, robot=replace(robot, axes=axes)))
    slow = replace(slow, toolpath=path.with_columns(feed=feed))
    result = correct(slow)
    found, _ = check_limits(slow, subdivide(slow, result, Limits(no_insert=True)))
    assert [(finding.code, finding.line) for finding in found] == [("KIN009", path.line[3])]


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_the_worst_of_all_motions_is_found_in_whatever_blocks_they_are(rows, monkeypatch):
    """The nearest to a limit and the fastest, of motions that differ in their feed."""
    task = corner()
    robot, path = task.model.robot, task.toolpath
    axes = tuple(replace(axis, speed=np.radians(0.05 * (k + 1))) for k, axis in enumerate(robot.axes))
    task = replace(task, model=replace(task.model, robot=replace(robot, axes=axes)))
    division = subdivide(task, correct(task), Limits(max_growth=100.0))
    low, high = task.model.robot.limits.T.copy()
    high[0] = task.track.q[:, 0].max() + np.radians(0.5)
    low[0] = task.track.q[:, 0].min() - np.radians(0.5)
    told = []
    for sense in (1, -1):
        feed = 0.01 + 1e-4 * sense * np.arange(len(path))
        job = with_limits(replace(task, toolpath=path.with_columns(feed=feed)), low, high)
        whole = check_limits(job, division)
        with monkeypatch.context() as patch:
            patch.setattr(batches, "ROWS", rows)
            assert check_limits(job, division) == whole
        told += [finding.code for finding in whole[0]]
    assert told.count("KIN009") == 2


def test_a_posture_that_only_the_correction_makes_singular():
    """A5 stands just outside of what counts as singular; one sense of the force leads it in, the other one away."""
    task = line()
    model = task.model
    q = np.radians([[a1, -60.0, 90.0, 0.0, 0.0, 0.0] for a1 in (-1.0, -1.0, 0.0, 0.0)])
    q[:, 4] = np.arcsin(0.02) + 1e-5
    wanted = model.chain.flange(q) @ TOOL
    path = task.toolpath.with_columns(position=wanted.position, rotation=wanted.rotation)
    track = follow_axes(model.robot, path, wanted @ TOOL.inverse(), START)
    assert not is_near_singular(model.robot, track.q).any()
    found = {}
    for sense in (1, -1):
        force = replace(task.force, values=sense * task.force.values, start=sense * task.force.start[:])
        near = replace(task, wanted=wanted, toolpath=path, track=track, force=force)
        found[sense] = "KIN003" in codes(near)[0]
    assert sorted(found.values()) == [False, True]


def test_speeds_are_read_from_the_robot_file(tmp_path):
    text = (
        find_robot("kuka_kr270")
        .read_text()
        .replace("A1: [-185, 185]", "A1: {limits: [-185, 185], speed: 105}")
    )
    path = tmp_path / "fast.yaml"
    path.write_text(text)
    speeds = load_robot(path).speeds
    assert speeds[0] == pytest.approx(np.radians(105))
    assert np.isnan(speeds[1:]).all()
