"""A tool that cuts elsewhere than its radius and length say: by closed forms, on a line and round a circle."""

import numpy as np
import pytest
from path_cases import circle, line, task

from postproc.compensation.tool_displacement import ToolDisplacement
from postproc.process.operation_names import OperationNames

TIP_WARD = np.array([0.0, 0.0, 1.0])
"""In tool axes; the tool of these cases points down: -Z of the base."""


def displacement(job, tool, **words):
    n = len(job.toolpath)
    names = OperationNames(("ROUGH", "FINISH"), np.arange(n) % 2)
    return ToolDisplacement(job.desired_path, np.tile(TIP_WARD, (n, 1)), tool, names, **words)


def test_a_longer_tool_cuts_deeper_along_its_spindle_and_only_that_tool():
    job = line()
    rows = np.arange(len(job.toolpath))
    tool = rows % 3
    found = displacement(job, tool, length={1: 2e-4, 2: -1e-4}).at(rows, job.wanted[rows])
    size = np.array([0.0, 2e-4, -1e-4])[tool]
    np.testing.assert_allclose(found, size[:, None] * [0.0, 0.0, -1.0], atol=1e-15)


@pytest.mark.parametrize("share", [0.25, 1.0])
@pytest.mark.parametrize("side", [1, -1, 0])
def test_a_larger_radius_lies_nearer_to_the_wall_on_its_side_of_the_feed(side, share):
    job = circle()
    rows = np.flatnonzero(job.desired_path.traceable & job.desired_path.arc)
    tool = np.ones(len(job.toolpath), np.int64)
    assert (rows % 2 == 0).all()
    shift = displacement(job, tool, radius={1: 3e-4}, side={(1, "ROUGH"): side, (1, "FINISH"): -side})
    along = np.full(len(rows), share)
    found = shift.at(rows, job.desired_path.at(rows, along), along)
    right = np.cross([0.0, 0.0, -1.0], job.desired_path.tangent(rows, along))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    np.testing.assert_allclose(found, side * 3e-4 * right, atol=1e-12)
    assert np.abs(found).max() > 2e-4 or side == 0
    if share == 1.0:  # which is where a motion ends
        np.testing.assert_array_equal(shift.at(rows, job.desired_path.at(rows, along)), found)
    # another tool, or this one in an operation of which no side is known, lies nowhere else
    for other in (
        displacement(job, tool, radius={2: 3e-4}, side={(2, "ROUGH"): 1}),
        displacement(job, tool, radius={1: 3e-4}, side={(1, "FINISH"): 1, (2, "ROUGH"): 1}),
    ):
        assert (other.at(rows, job.desired_path.at(rows, along), along) == 0).all()


def test_where_the_feed_is_along_the_spindle_no_wall_is_beside_it():
    job = line()
    rows = np.flatnonzero(job.desired_path.traceable)
    tangent = job.desired_path.tangent(rows, np.ones(len(rows)))
    n = len(job.toolpath)
    names = OperationNames(("ROUGH",), np.zeros(n, np.int64))
    spindle = np.zeros((n, 3))
    spindle[rows] = np.einsum("nij,ni->nj", job.wanted.rotation[rows], tangent)
    tool = np.ones(n, np.int64)
    shift = ToolDisplacement(job.desired_path, spindle, tool, names, radius={1: 1e-3}, side={(1, "ROUGH"): 1})
    assert np.abs(shift.at(rows, job.wanted[rows])).max() == 0.0


def around(points, cutting, sides, radius=3e-4, cuts=True):
    """A path of straight motions with a tool that points down, whose walls are on the ``sides`` of its motions."""
    job = task(points, cutting, wrench=np.zeros(6))
    n = len(job.toolpath)
    names = OperationNames(("LEFT", "NONE", "RIGHT"), np.array(sides) + 1)
    known = {(1, "LEFT"): -1, (1, "RIGHT"): 1}
    spindle, tool = np.tile(TIP_WARD, (n, 1)), np.ones(n, np.int64)
    limits = {"radius": {1: radius}, "side": known}
    return job, ToolDisplacement(
        job.desired_path, spindle, tool, names, **limits, cuts=np.array(cutting) if cuts else None
    )


def shifted(job, shift, row, share):
    rows, along = np.full(len(share), row), np.asarray(share, float)
    poses = job.desired_path.at(rows, along)
    return poses.position, shift.at(rows, poses, along)


@pytest.mark.parametrize("angle", [-110, -90, -30, 1e-6, 45, 90, 118])
@pytest.mark.parametrize("side", [1, -1])
def test_parallels_of_two_walls_meet_in_one_vertex(angle, side):
    """Of an inner and of an outer corner: the displaced motions are parallel to the walls at the radius, and share
    their vertex, which is where the two parallels cross."""
    turn = np.radians(angle)
    corner = np.array([1.6, 0.0, 0.5])
    ways = np.array([[0.0, 1.0, 0.0], [-np.sin(turn), np.cos(turn), 0.0]])
    points = [corner - 0.1 * ways[0] + [0, 0, 0.1], corner - 0.1 * ways[0], corner, corner + 0.1 * ways[1]]
    job, shift = around(points, [False, False, True, True], [side] * 4)
    right = [np.cross([0, 0, -1.0], way) for way in ways]
    for row, way, normal in zip((2, 3), ways, right, strict=True):
        place, moved = shifted(job, shift, row, np.linspace(0, 1, 7))
        np.testing.assert_allclose(moved @ normal, side * 3e-4, atol=1e-9)
        np.testing.assert_allclose(moved[:, 2], 0.0, atol=1e-9)
        line = place + moved
        np.testing.assert_allclose(np.cross(line - line[:1], way), 0.0, atol=1e-9)
    ends = [shifted(job, shift, row, [share])[1][0] for row, share in ((2, 1.0), (3, 0.0))]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    other = around(points, [False, False, True, True], [side] * 4, cuts=False)[1]
    apart = shifted(job, other, 2, [1.0])[1] - shifted(job, other, 3, [0.0])[1]
    assert np.linalg.norm(apart) == pytest.approx(6e-4 * abs(np.sin(turn / 2)), abs=1e-9)


def test_a_plunge_and_a_retract_go_beside_the_wall_that_they_belong_to():
    points = [[1.6, -0.1, 0.6], [1.6, -0.1, 0.55], [1.6, -0.1, 0.5], [1.6, 0.1, 0.5], [1.6, 0.1, 0.55]]
    job, shift = around(points, [False, False, True, True, True], [1] * 5)
    right = np.cross([0, 0, -1.0], [0, 1.0, 0])
    for row in (2, 3, 4):
        _, moved = shifted(job, shift, row, np.linspace(0, 1, 5))
        np.testing.assert_allclose(moved, np.tile(3e-4 * right, (5, 1)), atol=1e-9)


@pytest.mark.parametrize("angle", [150, 180])
def test_walls_of_a_sharp_corner_and_without_a_side_have_no_common_vertex(angle):
    turn = np.radians(angle)
    corner = np.array([1.6, 0.0, 0.5])
    way = np.array([-np.sin(turn), np.cos(turn), 0.0])
    points = [[1.6, -0.1, 0.6], [1.6, -0.1, 0.5], corner, corner + 0.1 * way]
    for sides in ([1, 1, 1, 1], [1, 1, 1, 0]):
        job, shift = around(points, [False, False, True, True], sides)
        _, moved = shifted(job, shift, 2, np.linspace(0, 1, 4))
        np.testing.assert_allclose(moved, np.tile([3e-4, 0.0, 0.0], (4, 1)), atol=1e-9)
    assert not shifted(job, shift, 3, [0.0, 0.5])[1].any()
