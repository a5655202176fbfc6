"""The taught sample cannot grow by less than its ramps of the force need."""

from __future__ import annotations

import numpy as np
import pytest
from least_points import TAUGHT, curve, least_points, off_line

from postproc.workflows.preparation import Request, prepare

MM = 1e-3


@pytest.fixture(scope="module")
def task():
    return prepare(Request(TAUGHT, force="")).task


def test_no_straight_line_follows_a_ramp(task):
    """Of three places by their definition: moved by the error that is found, and no less, they lie on a line."""
    away = np.array([6.0, 8.0, 80.0]) * MM
    error, place = off_line(task, 13, away), curve(task, 13, away)
    turn = np.array([0.5, -0.5, 0.5])[:, None] * 2
    share = (away[1] - away[0]) / (away[2] - away[0])
    bend = place[1] - (1 - share) * place[0] - share * place[2]
    moved = place + turn * 0.5 * bend
    assert np.linalg.norm(0.5 * bend) == pytest.approx(error)
    assert np.linalg.norm(moved[1] - (1 - share) * moved[0] - share * moved[2]) < 1e-12
    assert error > 3 * task.tolerance


@pytest.mark.slow
def test_the_taught_sample_needs_more_points_than_a_tenth_of_its_motions(task):
    found = least_points(task)
    assert len(found) == 10
    assert all(none > 3 * task.tolerance for _, none, _ in found.values())
    least = sum(count for count, _, _ in found.values())
    motions = len(task.toolpath)
    assert least == 16
    assert (motions + least) / motions == pytest.approx(1.615, abs=1e-3)
    # 1.1 times the motions would leave two of them
    assert 1.1 * motions < motions + 3
