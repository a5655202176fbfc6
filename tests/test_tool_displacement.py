"""A tool that cuts elsewhere than its radius and length say: by closed forms, on a line and round a circle."""

import numpy as np
import pytest
from path_cases import circle, line

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
