"""Fitted corners and ramps of the force, of a tool that yields in proportion to the force: by brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, largest_error, spring, with_ramp

from postproc.compensation.corner_fit import fit_corners
from postproc.compensation.corners import rounded_errors
from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.toolpath import Arcs, EditConstraints, Kind, Role

COMPLIANCE = np.diag([2e-6, 3e-6, 1e-6])
FIRST, TURNED = np.array([100.0, 250.0, 50.0]), np.array([-250.0, 100.0, 50.0])
REVERSED, MORE = -FIRST, 1.5 * FIRST
FREE = Limits(max_growth=100.0, ramp_end=0.5 * MM)


def two_motions(angle, second, distance, ramp=5.0, size=100.0, **words):
    """Two motions of ``size`` [mm] under ``angle`` [rad], after one in air; the force goes over from FIRST to
    ``second`` on ``ramp`` [mm]; all points approximated from ``distance`` [mm] on."""
    force = np.zeros((4, 3))
    force[2], force[3] = FIRST, second
    points = np.array(
        [[-size, 0, 20], [-size, 0, 0], [0, 0, 0], [size * np.cos(angle), size * np.sin(angle), 0]]
    )
    blend = np.array([0.0, 0.0, distance, distance]) * MM
    job = spring(points * MM, [False, False, True, True], COMPLIANCE, force, approximation=blend, **words)
    return with_ramp(job, [3], [second - FIRST], [ramp * MM]), blend


def fitted(job, limits=FREE):
    result = correct(job)
    plain = subdivide(job, result, limits)
    return result, plain, *fit_corners(job, result, plain, limits)


def agrees(true, found, rel=0.05):
    """Samples miss a peak; what is said of it is never less."""
    assert (1.0 - rel) * found - 0.3e-6 < true < 1.01 * found + 0.1e-6


def is_in_order(job, plain, division, limits):
    """Places ascend, lines are no shorter than may be, the ends of motions in air and the last one stay."""
    own = job.carries[division.source]
    place = division.source + division.share
    assert (np.diff(place) > 0).all()
    command = division.command[np.arange(len(division))].position
    inserted = np.flatnonzero(division.role == Role.INTERMEDIATE)
    for side in (-1, 0):
        size = np.linalg.norm(command[inserted + side + 1] - command[inserted + side], axis=1)
        assert size.min(initial=1.0) > limits.ramp_end - 0.3e-6
    before = plain.command[np.flatnonzero(plain.original)].position
    after = command[np.flatnonzero(division.original)]
    for row in [*np.flatnonzero(~job.carries).tolist(), len(job.toolpath) - 1]:
        np.testing.assert_allclose(after[row], before[row], atol=1e-9)
    assert own.any()


CASES = [
    (np.pi / 2, TURNED, 0.5, 1),
    (np.pi / 2, TURNED, 2.0, 2),
    (-2.0, MORE, 1.0, 2),
    (0.0, REVERSED, 2.0, 3),
    (0.0, REVERSED, 0.5, 2),
    (0.0, MORE, 2.0, 2),
]


@pytest.mark.parametrize(("angle", "second", "distance", "most"), CASES)
def test_fitted_points_keep_the_tolerance_by_brute_force(angle, second, distance, most):
    """And what is said to be off is so, before and after; with few points."""
    job, blend = two_motions(angle, second, distance)
    result, plain, fit, division = fitted(job)
    before = rounded_errors(job, result, plain)[1].max()
    agrees(largest_error(job, plain, [2, 3], blend, 12 * MM), before)
    after = rounded_errors(job, fit, division)[1].max()
    true = largest_error(job, division, [2, 3], blend, 12 * MM)
    agrees(true, after)
    assert true < job.tolerance
    assert division.inserted <= most
    is_in_order(job, plain, division, FREE)


@pytest.mark.parametrize("distance", [0.5, 2.0])
def test_the_result_has_the_points_of_the_division(distance):
    """What is fitted is in both."""
    job, _ = two_motions(np.pi / 2, TURNED, distance)
    _, _, fit, division = fitted(job)
    own = np.flatnonzero(division.original)
    command = division.command[np.arange(len(division))]
    np.testing.assert_allclose(fit.command[np.array([2, 3])].position, command.position[own[2:]], atol=1e-15)
    np.testing.assert_allclose(
        fit.correction[2:], command.position[own[2:]] - job.wanted.position[2:], atol=1e-12
    )
    assert fit.rounded.tolist() == [2]
    assert division.fits is not None
    assert np.isin(division.fits.point, [*np.flatnonzero(division.share < 1.0).tolist(), own[2]]).all()
    assert (np.diff(division.fits.point) > 0).all()


def test_a_mirrored_program_is_fitted_to_mirrored_points():
    job, _ = two_motions(np.pi / 2, TURNED, 2.0)
    other, _ = two_motions(-np.pi / 2, TURNED * [1, -1, 1], 2.0)
    force = other.force.values.copy()
    force[2, 1] = -FIRST[1]
    values = replace(other.force, values=force, start=force, ramps=None)
    other = with_ramp(replace(other, force=values), [3], [(TURNED - FIRST) * [1, -1, 1]], [5 * MM])
    one, two = fitted(job)[3], fitted(other)[3]
    np.testing.assert_allclose(two.share, one.share, atol=2e-5)
    places = (d.command[np.arange(len(d))].position for d in (one, two))
    np.testing.assert_allclose(next(places), next(places) * [1, -1, 1], atol=1e-6)


@pytest.mark.parametrize("ramp", [3.0, 5.0, 9.0])
def test_a_ramp_after_an_exact_point_keeps_its_place(ramp):
    """Nothing is rounded off there: a point where the ramp ends, and another that keeps its parabola short."""
    job, blend = two_motions(0.0, REVERSED, 2.0, ramp)
    path = job.toolpath.with_columns(approximation=np.array([0.0, 0.0, 0.0, 2.0 * MM]))
    job, blend = replace(job, toolpath=path), np.array([0.0, 0.0, 0.0, 2.0 * MM])
    result, plain, fit, division = fitted(job)
    own = np.flatnonzero(division.original)
    before = plain.command[np.flatnonzero(plain.original)]
    np.testing.assert_allclose(division.command[own].position[:3], before.position[:3], atol=1e-9)
    true = largest_error(job, division, [2, 3], blend, (ramp + 4) * MM)
    assert true < job.tolerance
    motion, off, _ = rounded_errors(job, fit, division)
    agrees(true, off.max())
    assert motion.min() == own[3] - division.inserted
    before = rounded_errors(job, result, plain)[1].max()
    if before > 0.945 * job.tolerance:
        assert division.inserted <= plain.inserted + 1
    is_in_order(job, plain, division, FREE)


def test_without_room_for_points_nothing_is_inserted():
    """None may be, none before this line, or the budget is spent."""
    job, _ = two_motions(np.pi / 2, TURNED, 2.0)
    locked = replace(
        job, toolpath=replace(job.toolpath, constraints=EditConstraints(no_insert_before={2: "", 3: ""}))
    )
    for task, limits in (
        (job, replace(FREE, no_insert=True)),
        (locked, FREE),
        (job, replace(FREE, max_growth=1.0)),
    ):
        result, plain, fit, division = fitted(task, limits)
        assert len(division) == len(task.toolpath)
        errors = [rounded_errors(task, some, d)[1].max() for some, d in ((result, plain), (fit, division))]
        assert errors[1] < 1.001 * errors[0]
    for growth in (1.25, 1.5):
        limits = replace(FREE, max_growth=growth)
        division = fitted(job, limits)[3]
        assert division.inserted <= 4 * growth - 4


@pytest.mark.parametrize("ramp_end", [0.3, 1.0])
def test_lines_are_no_shorter_than_may_be(ramp_end):
    """Even where no points hold the tolerance then: those are taken that come nearest, never worse ones."""
    job, blend = two_motions(0.0, REVERSED, 3.0)
    limits = replace(FREE, ramp_end=ramp_end * MM)
    result, plain, fit, division = fitted(job, limits)
    is_in_order(job, plain, division, limits)
    before = rounded_errors(job, result, plain)[1].max()
    after = rounded_errors(job, fit, division)[1].max()
    assert after < 1.001 * before
    agrees(largest_error(job, division, [2, 3], blend, 12 * MM), after)


def arc_then_line(radius, distance, second):
    """A quarter of a circle that ends where a line goes on, and the force goes over to ``second`` on 5 mm."""
    force = np.zeros((4, 3))
    force[2], force[3] = FIRST, second
    points = np.array([[0, -radius, 20], [0, -radius, 0], [radius, 0, 0], [radius, 100, 0]]) * MM
    none = np.full(3, np.nan)
    centre = np.array([1.6, 0.0, 0.5])
    blend = np.array([0.0, 0.0, distance, distance]) * MM
    job = spring(
        points,
        [False, False, True, True],
        COMPLIANCE,
        force,
        kind=[Kind.PTP, Kind.LIN, Kind.CIRC, Kind.LIN],
        approximation=blend,
        arcs=Arcs(
            centre=np.array([none, none, centre, none]),
            normal=np.array([none, none, [0.0, 0.0, 1.0], none]),
            sweep=np.array([np.nan, np.nan, np.pi / 2, np.nan]),
        ),
    )
    return with_ramp(job, [3], [second - FIRST], [5 * MM]), blend


@pytest.mark.parametrize("distance", [0.5, 1.5])
@pytest.mark.parametrize("second", [REVERSED, MORE])
def test_points_after_an_arc_keep_the_tolerance(distance, second):
    """The arc goes on as round as it was: its middle moves by half of what its end does."""
    job, blend = arc_then_line(60.0, distance, second)
    result, plain, fit, division = fitted(job)
    before = rounded_errors(job, result, plain)[1].max()
    after = rounded_errors(job, fit, division)[1].max()
    true = [largest_error(job, d, [2, 3], blend, 12 * MM) for d in (plain, division)]
    agrees(true[0], before)
    agrees(true[1], after)
    assert true[1] < job.tolerance
    is_in_order(job, plain, division, FREE)
    arcs = np.flatnonzero(np.isfinite(division.sweep))
    assert np.isin(division.source[arcs], [2]).all()
    assert division.sweep[arcs].sum() == pytest.approx(np.pi / 2, abs=0.05)


@pytest.mark.parametrize("angle", [0.5, -1.0])
@pytest.mark.parametrize("distance", [1.0, 4.0])
def test_corners_where_the_deflection_bends_without_a_ramp(angle, distance):
    """The force goes over evenly along each motion: at the vertex the correction turns; its own point is moved, or
    others are inserted beside it."""
    force = np.zeros((5, 6))
    force[2:, :3] = [[100.0, 20.0, 0.0], [900.0, 20.0, 80.0], [100.0, 20.0, 900.0]]
    start = np.zeros((5, 6))
    start[2:, :3] = [[100.0, 20.0, 0.0], [100.0, 20.0, 0.0], [900.0, 20.0, 80.0]]
    size = 60.0
    end = np.array([size, 0, 0])
    points = np.array(
        [
            [-size, 0, 20],
            [-size, 0, 0],
            [0, 0, 0],
            end,
            end + size * np.array([np.cos(angle), np.sin(angle), 0]),
        ]
    )
    blend = np.array([0.0, 0.0, distance, distance, distance]) * MM
    stiff = np.array([[0.0, 0.0, 0.0], [2e-6, 3e-6, 0.0], [0.0, 0.0, 2e-6]])
    job = spring(
        points * MM, [False, False, True, True, True], stiff, force[:, :3], start=start, approximation=blend
    )
    result, plain, fit, division = fitted(job, replace(FREE, ramp_end=0.2 * MM))
    true = [
        max(largest_error(job, d, rows, blend, 10 * MM) for rows in ([2, 3], [3, 4]))
        for d in (plain, division)
    ]
    assert true[1] < job.tolerance
    if true[0] > job.tolerance:
        assert division.fits is not None
        own = np.flatnonzero(division.original)
        assert np.isin(division.fits.corner, own).all()
    else:
        assert division is plain
    del result, fit
