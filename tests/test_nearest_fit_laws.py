"""Corners and ramps that no points hold, or whose points take away less than is expected: what is taken then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import AT, MM, largest_error, spring
from test_ramp_fit_laws import FREE, MORE, REVERSED, TURNED, fitted, two_motions

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation import corner_fit
from postproc.compensation.corner_fit import corners_not_improved, fit_corners
from postproc.compensation.corner_points import PointChooser
from postproc.compensation.corners import rounded_errors
from postproc.compensation.correct import correct
from postproc.compensation.path_error import PathSegments, path_errors
from postproc.compensation.rounded_path import RoundedOutput
from postproc.compensation.subdivide import subdivide
from postproc.toolpath import Role


@pytest.mark.parametrize(
    ("angle", "second", "distance", "shortest", "tolerance", "nearer"),
    [
        (np.pi / 2, TURNED, 0.5, 0.6, 2.0, False),
        (0.0, REVERSED, 2.0, 0.6, 4.0, True),
        (0.0, MORE, 2.0, 1.0, 3.5, True),
    ],
)
def test_of_ramps_that_no_points_hold_the_nearest_are_taken_where_they_are_clearly_nearer(
    angle, second, distance, shortest, tolerance, nearer, monkeypatch
):  # type: ignore[no-untyped-def]
    """By a tenth at least, by brute force; else those of the corners alone.  As they are written they may be worse by a
    twentieth."""
    job, blend = two_motions(angle, second, distance)
    job, limits = replace(job, tolerance=tolerance * 1e-6), replace(FREE, ramp_end=shortest * MM)
    _, _, fit, division = fitted(job, limits)
    with monkeypatch.context() as without:
        without.setattr(
            corner_fit, "choose_ramp_points", lambda task, result, part, *_: (part, None, np.empty(0, int))
        )
        alone = fitted(job, limits)[3]
    true = [largest_error(job, one, [2, 3], blend, 12 * MM) for one in (division, alone)]
    assert true[0] > job.tolerance
    assert (true[0] < 0.95 * true[1]) is nearer
    assert division.fits is not None
    on_ramp = division.fits.inserted > 0
    assert on_ramp.all() == nearer
    if not nearer:
        np.testing.assert_array_equal(division.share, alone.share)
        return
    largest = rounded_errors(job, fit, division)[1].max() / (0.9 * job.tolerance)
    np.testing.assert_allclose(division.fits.before, 1.05 * largest, rtol=5e-3)
    written = replace(division, blend=np.where(division.share < 1.0, blend[3], blend[division.source]))
    assert corners_not_improved(job, written) == {}


def bending(distance: float, tolerance: float, **words):  # type: ignore[no-untyped-def]
    """Straight on; the force goes over evenly on the second line: the correction turns at the vertex."""
    force, start = np.zeros((4, 6)), np.zeros((4, 6))
    force[2:, 0], start[2:, 0] = [100.0, 900.0], [100.0, 100.0]
    points = np.array([[-60.0, 0, 20], [-60.0, 0, 0], [0, 0, 0], [60.0, 0, 0]]) * MM
    across = np.array([[0.0, 0.0, 0.0], [2e-6, 0.0, 0.0], [0.0, 0.0, 0.0]])
    blend = np.array([0.0, 0.0, distance, distance]) * MM
    job = spring(points, [False, False, True, True], across, force[:, :3], start=start, approximation=blend)
    return replace(job, tolerance=tolerance), blend


@pytest.mark.parametrize("part", [2.3, 2.4, 2.5])
@pytest.mark.parametrize("expected", [1.0, 0.45])
def test_corners_that_were_thought_smaller_get_points_beside_their_own(part, expected, monkeypatch):  # type: ignore[no-untyped-def]
    """Where a parabola from d before to d after a vertex passes it by k d / 4, its own point takes half of it away."""
    job, blend = bending(4.0, 1.0)
    turn = 2e-6 * 800.0 / 60e-3
    job = replace(job, tolerance=turn * 4e-3 / 4 / part / 0.9)  # the error is so many times what is allowed
    if expected < 1.0:
        monkeypatch.setattr(
            corner_fit,
            "PointChooser",
            lambda task, division, limits, free, corners, before: PointChooser(
                task, division, limits, free, corners, expected * before
            ),
        )
    result = correct(job)
    plain = subdivide(job, result, FREE)
    assert largest_error(job, plain, [2, 3], blend, 9 * MM) == pytest.approx(
        part * 0.9 * job.tolerance, rel=0.02
    )
    division = fit_corners(job, result, plain, FREE)[1]
    assert division.inserted == plain.inserted + 2
    assert largest_error(job, division, [2, 3], blend, 9 * MM) < 0.9 * job.tolerance


@pytest.mark.parametrize(("share", "is_taken"), [(1.05, False), (1.2, True), (2.5, True)])
def test_a_fit_is_taken_where_it_takes_a_tenth_away(share, is_taken, monkeypatch):  # type: ignore[no-untyped-def]
    """``share``: the error before, in parts of what is left."""
    job, _ = bending(4.0, 1.0)
    turn = 2e-6 * 800.0 / 60e-3
    job = replace(job, tolerance=turn * 4e-3 / 4 / 1.5 / 0.9)  # its own point is enough
    left = 0.75

    class Known(PointChooser):
        def choose(self, remaining=0.0):  # type: ignore[no-untyped-def]
            points = super().choose(remaining)
            return replace(points, before=np.full(len(points.corner), share * left))

    monkeypatch.setattr(corner_fit, "PointChooser", Known)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    division = fit_corners(job, result, plain, FREE)[1]
    assert (division is not plain) is is_taken


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_a_corner_of_the_orientation_is_fitted_as_one_of_the_place_is(axis) -> None:  # type: ignore[no-untyped-def]
    """A tool that the force turns, evenly more from the vertex on: the parabola passes the turn there by k d / 4, of
    which its own point takes half away."""
    per_newton, axis = 2e-6, np.array(axis)
    straight, _ = bending(4.0, 1.0)

    class Turned(type(straight)):  # type: ignore[misc]
        def simulated(self, rows, command, wrench, *more, **words):  # type: ignore[no-untyped-def]
            found = super().simulated(rows, command, wrench, *more, **words)
            turn = rotation_from_vector(per_newton * wrench[:, :1] * axis)
            return replace(found, pose=Poses(turn @ command.rotation, found.pose.position))

        def command(self, rows, wanted, wrench, goal, *more, **words):  # type: ignore[no-untyped-def]
            found = super().command(rows, wanted, wrench, goal, *more, **words)
            turn = rotation_from_vector(-per_newton * wrench[:, :1] * axis)
            return replace(found, command=Poses(turn @ goal.rotation, found.command.position))

    kept = {name: getattr(straight, name) for name in straight.__dataclass_fields__}
    missed = per_newton * 800.0 / 60e-3 * 4e-3 / 4
    # the place is off by as many metres, which is half of what is allowed
    job = Turned(**{**kept, "tolerance": missed / 0.5 / 0.9, "tolerance_angle": missed / 1.5 / 0.9})
    result = correct(job)
    plain = subdivide(job, result, FREE)
    division = fit_corners(job, result, plain, FREE)[1]
    angles = [
        RoundedOutput(job, one, np.array([2, 3])).largest(np.array([2, 3]))[1].max()
        for one in (plain, division)
    ]
    assert angles[0] == pytest.approx(missed, rel=0.02)
    assert angles[1] == pytest.approx(0.5 * missed, rel=0.05)


@pytest.mark.parametrize("better", [0, 1])
def test_of_two_corners_that_keeps_its_fit_that_takes_a_tenth_away(better, monkeypatch):  # type: ignore[no-untyped-def]
    """The other one, and its motions, are as they were without a fit."""
    force, start = np.zeros((5, 6)), np.zeros((5, 6))
    force[2:, 0], start[2:, 0] = [100.0, 900.0, 900.0], [100.0, 100.0, 900.0]
    points = np.array([[-60.0, 0, 20], [-60.0, 0, 0], [0, 0, 0], [60.0, 0, 0], [120.0, 0, 0]]) * MM
    across = np.array([[0.0, 0.0, 0.0], [2e-6, 0.0, 0.0], [0.0, 0.0, 0.0]])
    blend = np.array([0.0, 0.0, 4.0, 4.0, 4.0]) * MM
    job = spring(
        points, [False, False, True, True, True], across, force[:, :3], start=start, approximation=blend
    )
    turn = 2e-6 * 800.0 / 60e-3
    job = replace(job, tolerance=turn * 4e-3 / 4 / 1.5 / 0.9)
    before = np.where(np.arange(2) == better, 2.5, 1.05) * 0.75

    class Known(PointChooser):
        def choose(self, remaining=0.0):  # type: ignore[no-untyped-def]
            return replace(super().choose(remaining), before=before)

    monkeypatch.setattr(corner_fit, "PointChooser", Known)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    division = fit_corners(job, result, plain, FREE)[1]
    assert division.fits is not None
    assert np.unique(division.source[division.fits.corner]).tolist() == [2 + better]
    other = 3 - better
    places = [
        one.command[np.flatnonzero((one.source == other) & (one.share == 1.0))] for one in (plain, division)
    ]
    np.testing.assert_array_equal(*(one.position for one in places))


@pytest.mark.parametrize("known", [True, False])
def test_inserted_points_before_an_exact_end_go_by_the_motion_before(known):  # type: ignore[no-untyped-def]
    """They are approximated as that is: where its distance is not known they stay where they are."""
    job, _ = two_motions(0.0, REVERSED, 2.0)
    blend = np.array([0.0, 0.0, 2.0 if known else np.nan, 0.0]) * MM
    path = job.toolpath.with_columns(approximation=blend)
    constraints = replace(path.constraints, inserted_approximation=np.full(4, 2.0) * MM, exact_stays=False)
    job = replace(job, toolpath=replace(path, constraints=constraints))
    _, plain, _, division = fitted(job, replace(FREE, max_growth=1.0, least=1))  # none to keep it short
    assert ((plain.role == Role.INTERMEDIATE) & (plain.source == 3)).sum() == 1
    if known:
        assert division.fits is not None
        assert (division.source[division.fits.point] == 3).any()
        return
    fits = division.fits
    assert fits is None or not (division.source[fits.point] == 3).any()
    np.testing.assert_allclose(
        division.command[np.arange(len(division))].position[division.source == 3],
        plain.command[np.arange(len(plain))].position[plain.source == 3],
        atol=1e-12,
    )


def test_an_angle_that_no_words_take_away_shows_all_the_same() -> None:
    """Of the angle by which a tool is off further points count what other words would make up for, the part all."""
    job = spring([[0.0, 0, 0.02], [0.0, 0, 0], [0.05, 0, 0]], [False, False, True], None, (100.0, 0, 0))

    class AtPole(type(job)):  # type: ignore[misc]
        def correctable(self, rows, share, command, turn):  # type: ignore[no-untyped-def]
            return 0.25 * turn

    kept = {name: getattr(job, name) for name in job.__dataclass_fields__}
    start, end = (Poses(np.eye(3)[None], AT[None] + np.array([x, 0.0, 0.0])) for x in (0.0, 0.05))
    wanted = job.desired_path.at(np.array([2]), np.array([0.5])).rotation
    turned = rotation_from_vector(np.array([[0.0, 0.02, 0.0]])) @ wanted
    piece = PathSegments.straight(
        np.array([2]), np.zeros(1), np.ones(1), Poses(turned, start.position), Poses(turned, end.position)
    )
    for shown, angle in ((True, 0.02), (False, 0.005)):
        found = path_errors(AtPole(**kept), piece, shown=shown)
        assert found[1][0] == pytest.approx(angle, rel=1e-6)
        assert found[0][0] < 1e-12
