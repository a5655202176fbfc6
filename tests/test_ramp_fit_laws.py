"""Fitted corners and ramps of the force, of a tool that yields in proportion to the force: by brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, largest_error, spring, with_ramp

from postproc.compensation.corner_fit import corners_not_improved, fit_corners
from postproc.compensation.corners import rounded_errors
from postproc.compensation.correct import correct
from postproc.compensation.ramp_points import NEVER
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


@pytest.mark.parametrize(("angle", "second", "distance"), [(np.pi / 2, TURNED, 0.5), (0.0, REVERSED, 2.0)])
def test_more_points_are_taken_where_so_many_are_asked_for(angle, second, distance):
    """As few as hold, at least as many as are asked for; and none on a ramp that is to stay as it is."""
    job, _ = two_motions(angle, second, distance)
    result, plain, _, division = fitted(job)
    free = division.inserted
    for least in (1, 2, 3, 4):
        fit, more = fit_corners(job, result, plain, FREE, {(2, 1.0): least})
        assert more.inserted == max(free, least)
        assert rounded_errors(job, fit, more)[1].max() < job.tolerance
        is_in_order(job, plain, more, FREE)
    # of another corner it says nothing
    assert fit_corners(job, result, plain, FREE, {(1, 1.0): 4, (3, 1.0): 4})[1].inserted == free
    # so many may be inserted, and one more is not needed
    exactly = replace(FREE, max_growth=1.0, least=max(free, plain.inserted))
    same = fit_corners(job, result, plain, exactly)[1]
    np.testing.assert_allclose(same.share, division.share, atol=1e-12)


def test_a_ramp_after_an_exact_point_gets_more_points_where_they_are_asked_for():
    """It is known by the place where it ends."""
    job, _ = two_motions(0.0, REVERSED, 2.0)
    job = replace(job, toolpath=job.toolpath.with_columns(approximation=np.array([0.0, 0.0, 0.0, 2.0 * MM])))
    result, plain, _, division = fitted(job)
    free = division.inserted
    assert division.fits is not None
    key = (3, float(plain.share[np.isclose(plain.share, 0.05)][0]))
    for least in (2, 3):
        more = fit_corners(job, result, plain, FREE, {key: least})[1]
        assert more.inserted == max(free, least)


def test_a_fit_that_is_worse_as_written_asks_for_one_point_more():
    """Of a ramp; a corner without one, or one of which the distance is not known as it was written, stays as it was."""
    job, blend = two_motions(np.pi / 2, TURNED, 2.0)
    _, _, _, division = fitted(job)
    assert division.fits is not None
    written = replace(division, blend=np.where(division.share < 1.0, blend[3], blend[division.source]))
    assert corners_not_improved(job, written) == {}
    command = division.command[np.arange(len(division))].copy()
    command.position[division.fits.point[0]] += [0.0, 0.1 * MM, 0.1 * MM]
    count = division.inserted
    assert corners_not_improved(job, replace(written, command=command)) == {(2, 1.0): count + 1}
    unknown = replace(division, blend=np.full(len(division), np.nan))
    assert corners_not_improved(job, unknown) == {(2, 1.0): count + 1}
    alone = replace(division.fits, inserted=np.zeros(len(division.fits.point), np.int64))
    assert corners_not_improved(job, replace(unknown, fits=alone)) == {(2, 1.0): NEVER}
    assert corners_not_improved(job, replace(unknown, fits=None)) == {}


@pytest.mark.parametrize("ramp_first", [True, False])
def test_a_ramp_and_a_corner_of_one_program_are_fitted_both(ramp_first):
    """At one vertex the force falls on a ramp, at another it goes over evenly, so that the correction turns there."""
    x = np.array([-120.0, -120.0, -60.0, 0.0, 60.0, 120.0])
    points = np.stack([x, 0 * x, [20, 0, 0, 0, 0, 0]], axis=1) * MM
    across = np.array([[0.0, 0.0, 0.0], [1e-6, 0.0, 0.0], [0.0, 0.0, 0.0]])
    force, start = np.zeros((6, 6)), np.zeros((6, 6))
    if ramp_first:  # after row 2, and the turn after row 4
        row, force[2:, 0], start[2:, 0] = 3, [900, 100, 100, 1500], [900, 100, 100, 100]
        blend = np.array([0.0, 0.0, 2.0, 2.0, 4.0, 2.0]) * MM
    else:  # turns after rows 2 and 3, the ramp after row 4
        row, force[2:, 0], start[2:, 0] = 5, [100, 1500, 900, 100], [100, 100, 1500, 100]
        blend = np.array([0.0, 0.0, 4.0, 4.0, 2.0, 2.0]) * MM
    job = spring(points, [False, False, *[True] * 4], across, force[:, :3], start=start, approximation=blend)
    job = with_ramp(job, [row], [[-800.0, 0, 0]], [5 * MM])
    _, plain, _, division = fitted(job)
    errors = [
        max(largest_error(job, some, rows, blend, 9 * MM) for rows in ([2, 3], [3, 4], [4, 5]))
        for some in (plain, division)
    ]
    assert errors[0] > job.tolerance > errors[1]
    fits = division.fits
    assert fits is not None
    assert len(set(division.source[fits.corner].tolist())) > 1
    assert (np.diff(fits.point) > 0).all()
    inserted = division.role[fits.point] == Role.INTERMEDIATE
    ramp = division.source[fits.corner] == row - 1
    assert (fits.inserted[ramp] == (ramp & inserted).sum()).all()
    assert (fits.inserted[~ramp] == 0).all()
    assert np.isin(division.source[fits.point[ramp]], [row - 1, row]).all()
    is_in_order(job, plain, division, FREE)
    own, before = np.flatnonzero(division.original), np.flatnonzero(plain.original)
    moved = np.linalg.norm(division.command[own].position - plain.command[before].position, axis=1)
    assert (moved[~np.isin(own, fits.point)] < 1e-9).all()
    assert (moved[np.isin(own, fits.corner)] > 1e-7).all()


def test_points_that_were_inserted_without_a_ramp_are_no_ramp():
    """Along an arc under a force that goes over evenly, no arc follows the corrected path: it is divided."""
    job, blend = arc_then_line(60.0, 1.0, MORE)
    start = np.zeros((4, 6))
    start[2, :3], start[3, :3] = FIRST, 3.0 * MORE
    values = start.copy()
    values[2, :3] = 3.0 * MORE
    job = replace(job, force=replace(job.force, values=values, start=start, ramps=None))
    result, plain, fit, division = fitted(job)
    assert plain.inserted > 0
    assert largest_error(job, division, [2, 3], blend, 9 * MM) < 1.05 * max(
        job.tolerance, largest_error(job, plain, [2, 3], blend, 9 * MM)
    )
    del result, fit
