"""Laws of lost motion along a program of several motions, walked place by place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import START, TOOL, task
from test_lost_motion import GAP, axes_along, lagging, lossy

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.lost_motion import dead_band
from postproc.robot.axis_track import follow_axes
from postproc.toolpath import Kind


def there_and_back(carries=(False, False, True, True, True, False), **words):
    """To and fro across A1, and away from it: A1 turns round at the corners, A2 and A3 inside of lines."""
    points = np.array(
        [
            [1.5, -0.3, 0.55],
            [1.5, -0.3, 0.5],
            [1.55, 0.25, 0.5],
            [1.5, 0.05, 0.5],
            [1.45, 0.35, 0.5],
            [1.45, 0.35, 0.6],
        ]
    )
    kinds = [Kind.PTP] + [Kind.LIN] * 5
    return task(points, carries, kind=kinds, wrench=np.array([20.0, 50.0, 90.0, 0, 0, 0]), **words)


@pytest.mark.parametrize("axes", [(1,), (2, 3)])
def test_the_sides_as_programmed_are_those_of_every_place(axes):
    job = lossy(there_and_back(), axes=axes)
    rows, along, joints = axes_along(job, 500)
    first = job.track.q[rows[0] - 1]
    sides = job.lost_motion.programmed
    begin = first - 0.5 * GAP * sides.at(np.array([rows[0] - 1]))[0]
    walked = lagging(joints, GAP, begin)
    some = [axis - 1 for axis in axes]
    found = sides.at(rows, along)
    assert np.abs(found - walked)[:, some].max() < 0.05
    assert np.ptp(walked[:, some[0]]) > 1.9
    # the others have no gap: their side is the sense in which they came
    ends = np.arange(1, len(job.toolpath))
    other = [axis for axis in range(3) if axis not in some]
    assert np.abs(sides.at(ends)[:, other]).max() <= 1.0


@pytest.mark.parametrize("process", [True, False])
def test_corrections_are_made_for_motions_that_are_to_be_corrected(process):
    """With a process for those that carry force; stations where they set in are there, and aim beside the axes."""
    carries = (False, False, False, True, True, False)
    job = replace(there_and_back(carries), process=process)
    lost = lossy(job, axes=(1,)).lost_motion
    moved = {int(row) for row in lost.row[lost.moved]}
    assert moved == ({3, 4} if process else set(range(0, 6)) - {0} | ({0} & moved))
    away = np.abs(lost.aim - lost.axes).max(axis=1)
    assert (away[~lost.moved] == 0).all()
    assert (away[lost.moved & np.isin(lost.row, [3, 4])] > 1e-5).all()
    assert ((lost.row == 3) & (lost.share == 0.0)).any()
    assert not ((lost.row == 4) & (lost.share == 0.0)).any()
    key = 2.0 * lost.row + lost.share
    assert (np.diff(key) >= 0).all()
    assert set(range(6)) <= set(lost.row[lost.share == 1.0].tolist())


def test_the_first_motion_turns_the_tool_against_none():
    """The dead band of angles is that of motions that turn it: whichever orientation the program ends with."""
    job = replace(there_and_back(), tolerance=1e-9)
    rotation = job.toolpath.rotation.copy()
    rotation[-1] = rotation_from_vector(np.array([[0.0, 0.1, 0.0]]))[0] @ rotation[-1]
    turned = replace(
        job, toolpath=replace(job.toolpath, targets=replace(job.toolpath.targets, rotation=rotation))
    )
    plain, other = dead_band(job), dead_band(turned)
    np.testing.assert_allclose(other[:-1], plain[:-1], rtol=1e-9)
    assert (other[-1] > 1.5 * plain[-1]).any()


def test_what_is_known_along_a_motion_is_known_of_its_places():
    """Uncorrected as it is programmed; at the ends of motions it is what it is without a share."""
    job = lossy(there_and_back(), axes=(2, 3))
    rows = np.repeat(np.arange(1, 6), 4)
    share = np.tile([0.1, 0.5, 0.9, 1.0], 5)
    found = job.conditions_at(rows, share).direction
    np.testing.assert_array_equal(found, job.lost_motion.programmed.at(rows, share))
    assert (np.abs(found - job.conditions_at(rows).direction)[:, 1:3] > 0.5).any()
    np.testing.assert_array_equal(found[3::4], job.conditions_at(rows[3::4]).direction)
    corrected = job.conditions_at(rows, share, corrected=True).direction
    np.testing.assert_allclose(corrected, job.lost_motion.run(1.0).at(rows, share), atol=1e-12)


@pytest.mark.parametrize("degrees", [0.2, 0.8, 7.0, 33.0])
@pytest.mark.parametrize("size", [0.0, 0.4, 30.0, 180.0])
def test_as_many_places_as_a_line_or_its_turn_asks_for(degrees, size):
    """One every 25 mm or every 5 deg of an axis, two of what is longer than 2 mm or turns by more than half a degree;
    of a turn in place as well."""
    points = np.array([[1.5, -0.1, 0.55], [1.5, -0.1, 0.5], [1.5, -0.1 + size * 1e-3, 0.5]])
    points = np.vstack([points, points[-1] + [0.0, 1e-4, 0.0]])
    plain = task(points, (False, False, True, True), kind=[Kind.PTP] + [Kind.LIN] * 3, wrench=np.zeros(6))
    rotation = plain.toolpath.rotation.copy()
    rotation[2:] = rotation[2:] @ rotation_from_vector(np.array([[0.0, 0.0, np.radians(degrees)]]))[0]
    wanted = Poses(rotation, plain.wanted.position)
    path = replace(plain.toolpath, targets=replace(plain.toolpath.targets, rotation=rotation))
    track = follow_axes(plain.model.robot, path, wanted @ TOOL.inverse(), START)
    job = lossy(replace(plain, toolpath=path, wanted=wanted, track=track), axes=(1,))
    turn = np.degrees(np.abs(np.diff(job.track.q, axis=0)).max(axis=1))
    lost = job.lost_motion
    for row, length in ((2, size), (3, 0.1)):
        count = max(int(np.ceil(max(length / 25.0, turn[row - 1] / 5.0))), 1)
        if length > 2.0 or turn[row - 1] > 0.5:
            count = max(count, 2)
        share = lost.share[(lost.row == row) & (lost.share > 0.0)]
        assert np.isin(np.round(np.arange(1, count + 1) / count, 9), np.round(share, 9)).all()
