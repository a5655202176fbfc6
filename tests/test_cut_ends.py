"""Cuts that are entered from the air, and left, without a stop: the parabola there is half in the cut."""

from __future__ import annotations

import numpy as np
import pytest
from path_cases import task

from postproc.compensation.corner_fit import fit_corners
from postproc.compensation.corner_points import PointChooser
from postproc.compensation.corners import Corners, compare_corners
from postproc.compensation.correct import correct
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, Subdivision
from postproc.toolpath import Kind

FREE = Limits(max_growth=100.0, ramp_end=0.5e-3)
START, APPROACH, LEAVE = (
    np.array([1.6, -0.1, 0.5]),
    np.array([-0.02, -0.03, 0.03]),
    np.array([0.0, 0.03, 0.02]),
)


def one_side(entry: float, exit_: float) -> CompensationProblem:
    """One straight motion under force, entered from the air and left with approximations [m]."""
    end = START + np.array([0.1, 0.0, 0.0])
    points = [START + APPROACH, START, end, end + LEAVE]
    return task(
        points,
        [False, False, True, False],
        wrench=np.array([[0.0] * 6, [0.0] * 6, [100.0, 250.0, 50.0, 0, 0, 0], [0.0] * 6]),
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN],
        approximation=np.array([0.0, entry, exit_, 0.0]),
    )


def run(job: CompensationProblem, fitted: bool) -> tuple[Subdivision, Corners]:
    result = correct(job)
    division = subdivide(job, result, FREE)
    if fitted:
        result, division = fit_corners(job, result, division, FREE)
    return division, compare_corners(job, result, division)


@pytest.mark.parametrize("entry", [0.0, 6e-3])
@pytest.mark.parametrize("exit_", [0.0, 6e-3])
def test_where_a_cut_is_entered_or_left_without_a_stop_there_is_a_corner(entry: float, exit_: float) -> None:
    """The motion in air runs c beside where it ran, over its length L: in the middle of its parabola the tool is off by
    d / 4 of the difference between the unit vectors."""
    job = one_side(entry, exit_)
    division, found = run(job, fitted=False)
    own = np.flatnonzero(division.original)
    assert found.motion.tolist() == [int(own[row]) for row, d in ((1, entry), (2, exit_)) if d]
    points = division.command[own].position
    points[0] = START + APPROACH
    for motion, row, away in ((own[1], 1, -1), (own[2], 2, 1)):
        if motion not in found.motion:
            continue
        before, after = (path[row + away] - path[row] for path in (job.wanted[np.arange(4)].position, points))
        unit = [v / np.linalg.norm(v) for v in (before, after)]
        expected = 0.25 * 6e-3 * np.linalg.norm(unit[1] - unit[0])
        assert found.difference[found.motion == motion][0] == pytest.approx(expected, rel=0.05)


def test_what_is_off_where_a_cut_is_entered_and_left_is_taken_away() -> None:
    job = one_side(5e-3, 5e-3)
    _, before = run(job, fitted=False)
    division, after = run(job, fitted=True)
    assert before.difference.min() > 1.5 * job.tolerance
    assert after.difference.max() < job.tolerance
    assert division.lead_ins.tolist() == [1]
    air = division.command[np.flatnonzero(division.original)[[0, 3]]].position
    assert np.abs(air - job.wanted[np.array([0, 3])].position).max() < 1e-12  # nothing else moves in air


@pytest.mark.parametrize(("rounding", "inside"), [(4.5e-3, True), (1e-3, False)])
def test_what_is_rounded_off_on_less_than_a_motion_gets_its_points_outside(
    rounding: float, inside: bool
) -> None:
    """Where points alone have left more than there was; else they follow the parabola of the original."""
    job, shortest = one_side(rounding, rounding), 2.5e-3
    division, corners = run(job, fitted=False)
    before = corners.difference / job.tolerance
    limits = Limits(max_growth=100.0, ramp_end=shortest)
    chooser = PointChooser(job, division, limits, np.ones(4, bool), corners, before)
    chosen = chooser.choose(100.0 * before)
    assert chosen.inner.tolist() == [inside, inside]
    away = np.minimum(chosen.share, 1.0 - chosen.share) * job.desired_path.length[chosen.row]
    assert len(away) > 1
    assert (away > shortest - 1e-9).all()
    assert (away < rounding).any() == inside
