"""Corners for which a program states no approximation distance, and ramps of the force in such programs."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from path_cases import task
from scipy.spatial.transform import Rotation

from postproc.compensation import unknown_distance
from postproc.compensation.approximations import with_distance
from postproc.compensation.corner_fit import fit_corners
from postproc.compensation.corners import compare_corners, compare_corners_at
from postproc.compensation.correct import correct
from postproc.compensation.path_error import path_errors
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramped_forces import add_force_ramps
from postproc.compensation.rounded_path import RoundedOutput
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, subdivided_motions
from postproc.compensation.unknown_distance import largest_distance
from postproc.toolpath import Kind

FREE = Limits(max_growth=100.0, ramp_end=0.5e-3)
ALONG = np.array([100.0, 250.0, 50.0])


def square(distance: float) -> CompensationProblem:
    """Two motions under force that meet under a right angle, after one in air; the force turns with them."""
    corner = np.array([1.6, -0.1, 0.5])
    points = [
        corner - [0.1, 0.0, -0.05],
        corner - [0.1, 0.0, 0.0],
        corner,
        corner + np.array([0.0, 0.1, 0.0]),
    ]
    wrench = np.zeros((4, 6))
    wrench[2, :3], wrench[3, :3] = ALONG, Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).apply(ALONG)
    job = task(
        points,
        [False, False, True, True],
        wrench=wrench,
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN],
        approximation=np.array([0.0, 0.0, distance, 0.0]),
    )
    stepped = replace(job, force=replace(job.force, steps=np.array([False, False, True, True])))
    return add_force_ramps(stepped, 5e-3)


@pytest.mark.slow
def test_up_to_the_distance_that_is_found_all_corners_hold_the_tolerance_and_beyond_it_not() -> None:
    job = square(np.nan)
    division = subdivide(job, correct(job), FREE)
    corners = compare_corners(job, correct(job), division)
    assert corners.unknown.any()
    assert corners.difference.max() > 2 * job.tolerance
    found = largest_distance(job, division, corners)
    assert 0 < found < corners.distance.max()
    for factor, holds in ((1.0, True), (1.1, False)):
        other = compare_corners_at(*with_distance(job, division, factor * found), corners.motion)
        assert bool((other.difference <= job.tolerance).all()) == holds


@pytest.mark.parametrize("many", [3, 200])
def test_the_largest_distance_is_the_one_with_which_the_worst_corner_has_the_tolerance(
    many: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of corners that are off by their own share of the distance, plus what one of them is off by from 1 mm on."""
    job = square(np.nan)
    division = subdivide(job, correct(job), FREE)
    share = np.random.default_rng(many).uniform(0.001, 0.01, many)
    late = np.where(np.arange(many) == 1, 1.0, 0.0)
    distance = np.full(many, 50e-3)

    tried = []

    def compared(words: float, motion: np.ndarray) -> SimpleNamespace:
        tried.append(words)
        return SimpleNamespace(difference=words * share[motion] + late[motion] * max(words - 1e-3, 0.0))

    monkeypatch.setattr(unknown_distance, "with_distance", lambda task, division, distance: (distance,))
    monkeypatch.setattr(unknown_distance, "compare_corners_at", compared)
    corners = SimpleNamespace(motion=np.arange(many), unknown=np.ones(many, bool), distance=distance)
    exact = min(job.tolerance / share.max(), (job.tolerance + 1e-3) / (share[1] + 1.0))
    found = largest_distance(job, division, corners)  # type: ignore[arg-type]
    assert 0.96 * exact < found <= exact
    late[:] = 0.0
    tried.clear()
    found = largest_distance(job, division, corners)  # type: ignore[arg-type]
    assert 0.96 < found / (job.tolerance / share.max()) <= 1
    assert len(tried) <= 4
    share[:] = 1e-5
    assert largest_distance(job, division, corners) == 50e-3  # type: ignore[arg-type]
    share[many - 1] = np.inf
    assert largest_distance(job, division, corners) == 0.0  # type: ignore[arg-type]


def test_nothing_is_fitted_to_a_distance_that_is_not_known() -> None:
    job = square(np.nan)
    result = correct(job)
    division = subdivide(job, result, FREE)
    fitted = fit_corners(job, result, division, FREE)[1]
    assert len(fitted) == len(division)
    every = np.arange(len(division))
    assert fitted.command[every].position == pytest.approx(division.command[every].position, abs=1e-12)


def test_on_a_ramp_the_force_is_that_of_the_place_which_the_tool_is_nearest_to() -> None:
    """The error of points that are far apart, by another part of the program, which follows the path as a whole."""
    job = square(np.nan)
    division = subdivide(job, correct(job), FREE)
    motions = np.flatnonzero(division.source == 3)
    whole = RoundedOutput(*with_distance(job, division, 0.0), motions)
    segments = subdivided_motions(job, division, motions)
    off = path_errors(job, segments)[0]
    shares = np.array([0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875])
    at = np.repeat(whole.place(motions), len(shares))
    there = whole.deviations(at, np.tile(shares, len(motions))).shift
    expected = np.linalg.norm(there, axis=1).reshape(len(motions), -1).max(axis=1)
    assert off == pytest.approx(expected, rel=0.05, abs=5e-7)
    assert off.max() > 1e-6
