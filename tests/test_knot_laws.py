"""Where a ramp of the force ends a motion is parted: where that is needed, and with a second point where the controller
would round the first one off by too much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, spring, with_ramp

from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.toolpath import EditConstraints, Role

ACROSS, TOLERANCE = 2e-6, 2e-5
COMPLIANCE = np.zeros((3, 3))
COMPLIANCE[1, 0] = ACROSS
FREE = Limits(max_growth=100.0, ramp_end=0.5 * MM)


def ramped(kinks, ends, lengths, approximation, carries=None, **words):
    """A line of motions of ``lengths`` (N - 1,) [mm]; from the start of the rows of ``kinks`` on, up to their
    ``ends`` [mm], the correction changes by ``kinks`` [m a m]."""
    x = np.concatenate([[0.0], np.cumsum(lengths)]) - 0.5 * np.sum(lengths)
    points = np.stack([x, 0 * x, 0 * x], axis=1) * MM
    n = len(points)
    force = np.zeros((n, 3))
    for row, kink in kinks.items():
        force[row:, 0] += kink * ends[row] * MM / ACROSS
    carries = [False] + [True] * (n - 1) if carries is None else carries
    job = spring(
        points, carries, COMPLIANCE, force, approximation=np.broadcast_to(approximation, n) * MM, **words
    )
    steps = [[kink * ends[row] * MM / ACROSS, 0, 0] for row, kink in kinks.items()]
    return with_ramp(job, list(kinks), steps, [ends[row] * MM for row in kinks])


def inserted(job, limits=FREE, row=None):
    """(K, 2) rows and [mm] from their start of the points that are inserted, but for transitions."""
    division = subdivide(job, correct(job), limits)
    some = np.flatnonzero(division.role == Role.INTERMEDIATE)
    places = division.share[some] * job.desired_path.length[division.source[some]] / MM
    found = np.stack([division.source[some], places], axis=1)
    return found if row is None else found[found[:, 0] == row, 1]


@pytest.mark.parametrize("end", [5.0, 20.0])
@pytest.mark.parametrize("parts", [0.5, 1.1])
def test_a_motion_is_parted_at_the_end_of_a_ramp_where_one_line_exceeds_the_tolerance(end, parts):
    """What is off there without is the tip of a triangle: k e (1 - e / L)."""
    kink = parts * TOLERANCE / (end * MM * (1.0 - end / 100.0))
    job = ramped({2: kink}, {2: end}, [50, 100, 50], 0.0)
    constraints = EditConstraints(exact_stays=True)
    job = replace(job, toolpath=replace(job.toolpath, constraints=constraints))
    found = inserted(job, row=2)
    np.testing.assert_allclose(found, [end] if parts > 1 else [], rtol=1e-9)
    assert len(inserted(job)) == len(found)


@pytest.mark.parametrize(
    ("kink", "blend", "spacing", "second"),
    [
        (0.03, 2.0, 0.5, True),  # 2 mm x 0.03 / 4: 15 um
        (0.03, 1.2, 0.5, False),  # 9 um
        (0.03, 1.4, 0.5, True),  # 10.5 um
        (0.02, 10.0, 0.5, True),  # half of 5 mm x 0.02 / 4: 12.5 um
        (0.015, 10.0, 0.5, False),  # 9.4 um
        (0.06, 0.3, 0.5, False),
        (0.3, 0.24, 0.5, False),  # 18 um, but a point at 0.5 mm would not make it shorter
        (0.3, 0.26, 0.5, True),
        (0.3, 0.26, 0.6, False),
        (0.03, 2.0, 1.2, True),
    ],
)
def test_a_second_point_follows_where_the_first_is_rounded_off_by_half_of_the_tolerance(
    kink, blend, spacing, second
):
    """A parabola from d before it to d after it leaves d k / 4, with d half of the shorter line beside it at most."""
    job = ramped({2: kink}, {2: 5.0}, [50, 100, 50], blend)
    found = inserted(job, replace(FREE, ramp_end=spacing * MM), row=2)
    np.testing.assert_allclose(found, [5.0, 5.0 + spacing] if second else [5.0], rtol=1e-9)


def test_where_there_is_no_room_after_it_the_second_point_is_before():
    """The next vertex keeps what it is rounded off by: 2 x 2 mm; before it there is as much room, after the vertex."""
    for end, length, places in (
        (5.0, 10.0, [5.0, 5.5]),
        (10.0, 14.0, [9.5, 10.0]),
        (10.0, 14.6, [10.0, 10.5]),
        (4.4, 8.0, [4.4]),
        (4.6, 8.0, [4.1, 4.6]),
    ):
        job = ramped({2: 0.06}, {2: end}, [50, length, 50], 2.0)
        np.testing.assert_allclose(inserted(job, row=2), places, rtol=1e-9)


def test_exact_motions_get_a_second_point_but_where_points_stay_exact():
    """Of what is inserted into an exact motion it is not known how it is rounded off: half of the shorter line."""
    job = ramped({2: 0.03}, {2: 5.0}, [50, 100, 50], 0.0)
    np.testing.assert_allclose(inserted(job, row=2), [5.0, 5.5], rtol=1e-9)
    stays = replace(job, toolpath=replace(job.toolpath, constraints=EditConstraints(exact_stays=True)))
    np.testing.assert_allclose(inserted(stays, row=2), [5.0], rtol=1e-9)
    unknown = ramped({2: 0.03}, {2: 5.0}, [50, 100, 50], np.nan)
    np.testing.assert_allclose(inserted(unknown, row=2), [5.0], rtol=1e-9)


def test_points_keep_the_shortest_motion_from_each_other_and_from_the_ends():
    for end, parted in ((0.4, False), (0.6, True), (59.6, False), (59.4, True)):
        found = inserted(ramped({2: 0.3}, {2: end}, [50, 60, 50], 0.2), row=2)
        assert (np.abs(found - end) < 1e-9).any() == parted
        assert (np.minimum(found, 60.0 - found) > 0.499).all()
    # ramps that set in one motion after the other end in the same one: the first of two that are too near stays
    for first, second, places in (
        (20.4, 10.3, [0.4 + 10, 10.3]),
        (21.2, 10.6, [10.6, 11.2]),
        (20.9, 10.6, [10.6]),
    ):
        job = ramped({2: 0.05, 3: 0.07}, {2: first, 3: second}, [50, 10, 100, 50], 0.0)
        job = replace(job, toolpath=replace(job.toolpath, constraints=EditConstraints(exact_stays=True)))
        got = inserted(job, replace(FREE, ramp_end=0.5 * MM), row=3)
        kept = sorted(places) if abs(places[0] - places[-1]) >= 0.5 or len(places) == 1 else [min(places)]
        np.testing.assert_allclose(got, kept, rtol=1e-9)


@pytest.mark.parametrize("approximation", [0.0, 0.2, np.nan])
def test_behind_a_ramp_that_is_shorter_than_any_motion_nothing_is_divided(approximation):
    """Off is nothing but the first 0.5 mm, so that one point is all that helps, at the distance that it may have."""
    for end in (0.1, 0.3, 0.45):
        job = ramped({2: 2.0}, {2: end}, [50, 60, 50], approximation)
        found = inserted(job, row=2)
        assert found[0] == pytest.approx(0.5)
        assert found[-1] < 3.0
        assert len(found) <= 3


def test_nothing_is_inserted_where_nothing_may_be():
    job = ramped({2: 0.3}, {2: 5.0}, [50, 100, 50], 2.0)
    assert len(inserted(job)) > 0
    assert len(inserted(job, replace(FREE, no_insert=True))) == 0
    locked = replace(
        job, toolpath=replace(job.toolpath, constraints=EditConstraints(no_insert_before={2: ""}))
    )
    assert len(inserted(locked, row=2)) == 0
    # the points themselves come before second ones
    few = inserted(job, replace(FREE, max_growth=1.25), row=2)
    np.testing.assert_allclose(few, [5.0], rtol=1e-9)
    two = inserted(job, replace(FREE, max_growth=1.5), row=2)
    assert len(two) <= 2


@pytest.mark.parametrize(("kink", "second"), [(0.03, True), (0.015, False)])
@pytest.mark.parametrize("slope", [-0.05, 0.04])
def test_only_the_turn_of_the_correction_counts_not_its_slope(kink, second, slope):
    """The force goes over evenly along the motion as well: before and after the end of the ramp the same slope more."""
    job = ramped({2: kink}, {2: 5.0}, [50, 100, 50], 10.0)
    values, start = (np.array(some) for some in (job.force.values, job.force.start[np.arange(4)]))
    more = slope * 0.1 / ACROSS
    values[2:, 0] += more
    start[2, 0] = values[2, 0] - more
    start[3, 0] = values[2, 0]
    job = replace(job, force=replace(job.force, values=values, start=start))
    found = inserted(job, row=2)
    near = found[found < 8.0]
    np.testing.assert_allclose(near, [5.0, 5.5] if second else [5.0], rtol=1e-9)


def test_each_of_two_ramps_that_end_in_one_motion_has_its_second_point():
    """The first has room until the second, whatever the vertex at the end of the motion is rounded off by."""
    job = ramped({2: 0.03, 3: 0.03}, {2: 15.0, 3: 40.0}, [50, 10, 100, 50], 2.0)
    np.testing.assert_allclose(inserted(job, row=3), [5.0, 5.5, 40.0, 40.5], rtol=1e-9)
    near = ramped({2: 0.03, 3: 0.03}, {2: 15.0, 3: 5.9}, [50, 10, 100, 50], 2.0)
    found = inserted(near, row=3)
    assert np.isclose(found, 5.0).any()
    assert (np.diff(found) > 0.499).all()
