"""What a path says of its turns, and touched-off frames of robots with lost motion, whatever the sense of approach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import circle, line
from test_lost_motion import lossy

from postproc.compensation.touched_off import TouchedOff
from postproc.toolpath.arcs import ArcFrame
from postproc.toolpath.orientation_control import OrientationPath


@pytest.mark.parametrize("along", [False, True])
@pytest.mark.parametrize("kind", list(OrientationPath))
def test_the_angle_of_a_motion_is_that_about_one_axis_where_it_turns_so(along, kind):  # type: ignore[no-untyped-def]
    """Of what turns along an arc, or by words, the ends alone say nothing."""
    job = circle(0.3, 2.0)
    path = job.toolpath
    n = len(path)
    frame = np.full(n, ArcFrame.BASE.value, np.int8)
    frame[2] = (ArcFrame.PATH if along else ArcFrame.BASE).value
    paths = np.full(n, OrientationPath.SINGLE_AXIS.value, np.int8)
    paths[2] = kind.value
    path = replace(
        path,
        arcs=replace(path.arcs, frame=frame),
        orientation_control=replace(path.orientation_control, path=paths),
    )
    angle = replace(job, toolpath=path).desired_path.angle
    plain = job.desired_path.angle
    single = not along and kind == OrientationPath.SINGLE_AXIS
    assert np.isfinite(plain[2])
    assert angle[2] == (plain[2] if single else np.inf)
    np.testing.assert_array_equal(np.delete(angle, 2), np.delete(plain, 2))


def test_a_place_is_touched_without_a_sense_of_approach() -> None:
    job = lossy(line(), axes=(1, 2))
    row = np.array([1, 2])
    found = []
    for side in (-1.0, 0.0, 1.0):
        given = replace(job.conditions, direction=np.full_like(job.track.q, side))
        frame = np.zeros(2, int)
        touched = TouchedOff.of(job.model, job.track, given, frame, row, job.wanted[row], job.tool[row], 1)
        found.append(touched.real.pose.position)
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[2], found[1])
    assert job.model.by_direction
