"""Laws of approximated corners: which are looked at, how far they are off, and where points are inserted for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import circle
from spring_cases import AT, MM, corrected, output, spring, with_ramp

from postproc.compensation.corner_points import PointChooser, shortest_arc
from postproc.compensation.corners import (
    Corners,
    compare_corners,
    compare_corners_at,
    find_corners,
    rounded_errors,
    suspect_corners,
)
from postproc.compensation.subdivision import Limits
from postproc.toolpath import Arcs, Kind

D, TOLERANCE = 2.0 * MM, 2e-5
"""[m] Approximation of all corners here, and what a corner may be off."""

RIGHT = np.array([[-60, 0, 0], [-50, 0, 0], [0, 0, 0], [0, 60, 0], [0, 70, 0]]) * MM
"""A right angle between two motions of 50 and 60 mm; before and after them others of 10 mm."""


def turned(angles, length=50.0):
    """A path of K + 3 motions of ``length`` [mm] that turns by ``angles`` (K,) [rad] about z at the ends of the third
    and those after it, but for the last."""
    heading = np.cumsum([0.0, 0.0, *angles])
    steps = length * MM * np.stack([np.cos(heading), np.sin(heading), 0.0 * heading], axis=1)
    return np.concatenate([[[0.0, 0.0, 0.0]], np.cumsum(steps, axis=0)]) - [0.1, 0.0, 0.0]


def path(points, carries=None, approximation=D, **words):
    n = len(points)
    carries = [False] + [True] * (n - 1) if carries is None else carries
    return spring(points, carries, approximation=np.broadcast_to(approximation, n).copy(), **words)


def angle_of(parts):
    """[rad] of a corner that is rounded off by so many parts of the tolerance: d/4 of the turn of unit vectors."""
    return 2.0 * np.arcsin(0.5 * np.asarray(parts) * TOLERANCE / (0.25 * D))


def rows_found(job, result, division):
    return division.source[find_corners(job, result, division)].tolist()


# which corners are looked at


def test_corners_that_the_program_rounds_off_by_a_tenth_of_the_tolerance_are_looked_at():
    parts = [0.08, 0.12, 0.0, -0.5, 0.05, -0.11]
    job = path(turned(angle_of(parts)))
    n = len(job.toolpath)
    none = np.zeros((n, 3))
    wanted = [2 + k for k, part in enumerate(parts) if abs(part) > 0.1]
    assert rows_found(job, corrected(job, none), output(job, none)) == wanted


def test_corners_that_corrections_make_are_looked_at():
    """Of a straight path: a vertex moved by v aside turns both its motions, by v / L each."""
    parts = np.array([0.0, 0.08, 0.0, 0.0, 0.13, 0.0, 0.0, 0.0])
    job = path(turned(np.zeros(5)))
    shifts = np.zeros((8, 3))
    # a kink of 2 v / L at the vertex, half of it and reversed at its neighbours: these are not to count
    shifts[:, 1] = parts * TOLERANCE / (0.25 * D) * 50 * MM / 2
    found = rows_found(job, corrected(job, shifts), output(job, shifts))
    assert found == [4]
    # where it takes the turn of the program away, that of the program still counts
    angles = np.zeros(5)
    angles[2] = angle_of(0.3)
    job = path(turned(angles))
    shifts = np.zeros((8, 3))
    on = job.wanted.position
    shifts[4] = 0.5 * (on[3] + on[5]) - on[4]  # on the line between its neighbours
    found = rows_found(job, corrected(job, shifts), output(job, shifts))
    assert 4 in found


@pytest.mark.parametrize("parts", [0.07, 0.13])
def test_points_that_are_inserted_are_corners_where_they_turn_the_path(parts):
    """At 0.2 of 50 mm: a point that lies v aside turns the path there by v / 10 mm + v / 40 mm."""
    job = path(turned(np.zeros(2)))
    kink = parts * TOLERANCE / (0.25 * D)
    v = kink / (1 / (10 * MM) + 1 / (40 * MM))
    none = np.zeros((5, 3))
    division = output(job, none, [(3, 0.2, [0.0, 0.0, v], 0.0)])
    motion = find_corners(job, corrected(job, none), division)
    inserted = np.flatnonzero(division.share < 1.0)
    assert np.isin(inserted, motion).all() == (parts > 0.1)


def test_no_corner_is_where_the_path_stops_or_goes_on_otherwise():
    """Exact points, other tools, other cuts, motions that are not corrected, or that come from elsewhere."""
    job = path(turned([0.3] * 6))
    n = len(job.toolpath)
    none = np.zeros((n, 3))
    result, division = corrected(job, none), output(job, none)
    all_rows = list(range(2, n - 1))
    assert rows_found(job, result, division) == all_rows
    approximation = np.full(n, D)
    approximation[3] = 0.0
    exact = path(turned([0.3] * 6), approximation=approximation)
    assert rows_found(exact, result, division) == [row for row in all_rows if row != 3]
    for tools in (np.where(np.arange(n) < 5, 1, 2), np.where(np.arange(n) < 5, 2, 1)):
        toolpath = job.toolpath.with_columns(tool=tools, frames=job.toolpath.frames * 2)
        assert rows_found(replace(job, toolpath=toolpath), result, division) == [
            r for r in all_rows if r != 4
        ]
    for cut in (np.where(np.arange(n) < 4, 0, 1), np.where(np.arange(n) < 4, 1, 0)):
        cut = np.where(job.carries, cut, -1)
        assert rows_found(job, replace(result, cut=cut), division) == [r for r in all_rows if r != 3]
    state = result.state.copy()
    state[4] = 2
    assert rows_found(job, replace(result, state=state), division) == [r for r in all_rows if r not in (3, 4)]


@pytest.mark.parametrize("entry", [0.07, 0.13])
@pytest.mark.parametrize("leave", [0.07, 0.13])
def test_ends_of_cuts_are_corners_where_they_are_passed_without_a_stop(entry, leave):
    """The turns are at the ends of the motions 2 and 4; under force are 3 and 4."""
    carries, ends = [False, False, False, True, True, False, False], [2, 4]
    job = path(turned([angle_of(entry), 0.0, angle_of(leave), 0.0]), carries)
    none = np.zeros((7, 3))
    found = rows_found(job, corrected(job, none), output(job, none))
    assert found == [row for row, parts in zip(ends, (entry, leave), strict=True) if parts > 0.1]
    stops = replace(
        job, toolpath=job.toolpath.with_columns(approximation=np.where(np.isin(np.arange(7), ends), 0.0, D))
    )
    assert rows_found(stops, corrected(job, none), output(job, none)) == []


# by how much they are off


def bending(force, angles, across=2e-6, **words):
    """A path on which the force goes over evenly from end to end of each motion, ``force`` (N,) [N] at their ends: the
    tool yields by ``across`` [m/N] of it, in z; corrected at the ends of motions."""
    compliance = np.zeros((3, 3))
    compliance[2, 0] = across
    n = len(force)
    values, start = np.zeros((n, 6)), np.zeros((n, 6))
    values[:, 0] = force
    start[1:, 0] = force[:-1]
    job = path(turned(angles), compliance=compliance, force=values[:, :3], start=start, **words)
    shifts = np.zeros((n, 3))
    shifts[:, 2] = -across * np.asarray(force) * job.carries
    return job, shifts


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_where_the_deflection_bends_a_corner_is_off_by_a_quarter_of_its_reach(angle):
    """Where it changes by k more [m a m] after the vertex than before: d k / 4 in the middle of the parabola."""
    force = np.array([0.0, 0.0, 0.0, 400.0, 250.0, 250.0])
    job, shifts = bending(force, [0.0, angle, 0.0])
    result, division = corrected(job, shifts), output(job, shifts)
    slope = np.diff(2e-6 * force, prepend=0.0) / (50 * MM)
    found = compare_corners_at(job, division, np.array([2, 3, 4]))
    expected = 0.25 * D * np.abs(slope[3:] - slope[2:-1])
    np.testing.assert_allclose(found.difference, expected, rtol=0.02)
    np.testing.assert_allclose(found.distance, D, rtol=1e-3)
    assert not found.unknown.any()
    assert (found.angle < 1e-9).all()
    np.testing.assert_array_equal(found.row, [2, 3, 4])
    assert set(compare_corners(job, result, division).row.tolist()) == {2, 3, 4}
    # in two parts it is the same
    parts = [compare_corners_at(job, division, np.array([k])).difference[0] for k in (2, 3, 4)]
    np.testing.assert_allclose(parts, found.difference, rtol=1e-9)


def test_an_unknown_distance_beside_stated_ones_is_taken_for_the_largest():
    """What is stated stays what it is: only the corner of which nothing is stated has half of its motion."""
    force = np.array([0.0, 0.0, 0.0, 400.0, 250.0, 250.0])
    approximation = np.full(6, D)
    approximation[3] = np.nan
    job, shifts = bending(force, np.zeros(3), approximation=approximation)
    division = output(job, shifts)
    slope = np.abs(np.diff(np.diff(2e-6 * force, prepend=0.0) / (50 * MM)))
    found = compare_corners_at(job, division, np.array([2, 3, 4]))
    np.testing.assert_array_equal(found.unknown, [False, True, False])
    np.testing.assert_allclose(found.distance, [D, 25 * MM, D], rtol=1e-3)
    np.testing.assert_allclose(found.difference[[0, 2]], 0.25 * D * slope[[2, 4]], rtol=0.02)
    # of an unknown one the largest parabola is compared with an original that is not rounded off
    assert found.difference[1] == pytest.approx(0.25 * 25 * MM * slope[3], rel=0.05)
    every = compare_corners_at(replace(job, toolpath=job.toolpath.with_columns(approximation=np.full(6, np.nan))),
                               division, np.array([2, 3, 4]))  # fmt: skip
    assert every.unknown.all()


def test_errors_of_motions_on_ramps_are_those_of_the_rounded_path():
    """A force that goes over on 5 mm of 50, one motion for both: the tip of the triangle, where the ramp ends."""
    across, step = 2e-6, 60.0
    compliance = np.zeros((3, 3))
    compliance[1, 0] = across
    force = np.zeros((5, 3))
    force[3:, 0] = step
    job = path(turned(np.zeros(2)), compliance=compliance, force=force, approximation=0.0)
    job = with_ramp(job, [3], [[step, 0, 0]], [5 * MM])
    shifts = np.zeros((5, 3))
    shifts[3:, 1] = -across * step
    motion, off, angle = rounded_errors(job, corrected(job, shifts), output(job, shifts))
    assert motion.tolist() == [3]
    assert off[0] == pytest.approx(across * step * 0.9, rel=1e-4)
    assert angle[0] < 1e-9


@pytest.mark.parametrize("parts", [0.2, 0.3])
@pytest.mark.parametrize("angle", [0.0, 1.1])
def test_corners_are_suspect_that_are_rounded_off_otherwise_by_a_quarter_of_the_tolerance(parts, angle):
    """However much the program itself turns there."""
    kink = parts * TOLERANCE / (0.25 * D)
    force = np.array(
        [0.0, 0.0, 0.0, kink * 50 * MM / 2e-6, 2 * kink * 50 * MM / 2e-6, 3 * kink * 50 * MM / 2e-6]
    )
    job, shifts = bending(force, [angle, 0.0, 0.0])
    result, division = corrected(job, shifts), output(job, shifts)
    assert suspect_corners(job, result, division, np.array([2, 3])).tolist() == [2] * (parts > 0.25)
    del angle


@pytest.mark.parametrize("parts", [0.2, 0.3])
def test_corners_are_suspect_at_which_the_correction_turns_otherwise(parts):
    job = path(turned(np.zeros(3)))
    kink = parts * job.tolerance_angle / (0.25 * D)
    none, turns = np.zeros((6, 3)), np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0]) * kink * 50 * MM
    result = corrected(job, none, turns)
    division = output(job, none, (), turns)
    assert suspect_corners(job, result, division, np.array([2, 3])).tolist() == [2] * (parts > 0.25)


def test_corners_beside_ramps_arcs_air_and_at_inserted_points_are_suspect_anyway():
    job = path(turned(np.zeros(3)))
    none = np.zeros((6, 3))
    result, division = corrected(job, none), output(job, none, [(3, 0.5, [0.0, 0.0, 0.0], 0.0)])
    corner = np.array([2, 3, 4, 5])
    assert suspect_corners(job, result, division, corner).tolist() == [3]
    plain = output(job, none)
    corner = np.array([2, 3, 4])
    assert suspect_corners(job, result, plain, corner).tolist() == []
    ramped = with_ramp(job, [4], [[10.0, 0, 0]], [5 * MM])
    assert suspect_corners(ramped, result, plain, corner).tolist() == [3, 4]
    carries = np.array([False, True, True, True, False, False])
    air = replace(job, force=replace(job.force, carries=carries))
    assert suspect_corners(air, result, plain, corner).tolist() == [3, 4]


# where points are inserted


def chosen_points(job, division, errors, spare=100, free=None, spacing=0.5 * MM, cycle=0.0, remaining=0.0):
    """(distance from the corner [m], its group) of all points, before it less than 0; and the choice."""
    errors = np.asarray(errors, float)
    n, motion = len(job.toolpath), np.arange(2, 2 + len(errors))
    zero = np.zeros(len(errors))
    corners = Corners(motion, division.source[motion], zero, zero > 0, zero, zero)
    limits = Limits(ramp_end=spacing, cycle=cycle, max_growth=1.0, least=spare)
    free = np.ones(n, bool) if free is None else free
    found = PointChooser(job, division, limits, free, corners, errors).choose(remaining)
    row = division.source[motion][found.group]
    length = job.desired_path.length[found.row]
    away = np.where(found.row == row, found.share - 1.0, found.share) * length
    assert ((found.row == row) | (found.row == row + 1)).all()
    assert ((found.share > 0) & (found.share < 1)).all()
    return away, found


def of_group(away, found, group):
    return np.sort(away[found.group == group])


@pytest.mark.parametrize("error", [1.7, 1.9, 2.2, 4.0, 9.0])
def test_straight_on_one_point_is_inserted_on_each_side(error):
    """Its own point leaves half of an error of its own; two others, as far away as it is rounded twice, 0.375 of it,
    and nearer ones in proportion: nine tenths of what is allowed are to be left."""
    job = path(turned(np.zeros(1)))
    away, found = chosen_points(job, output(job, np.zeros((4, 3))), [error])
    assert not found.inner.any()
    if 0.5 * error <= 0.9:
        assert len(away) == 0
        return
    step = np.max(away)
    np.testing.assert_allclose(np.sort(away), [-step, step], rtol=1e-9)
    left = 0.375 * error * step / (2 * D)
    assert left == pytest.approx(0.9) if error > 2.4 else step == pytest.approx(2 * D)
    np.testing.assert_allclose(found.before, [error])
    np.testing.assert_array_equal(found.corner, [2])


def test_points_are_no_nearer_than_a_cycle_at_the_feed_or_the_shortest_motion():
    """The wanted distance is 2 D 0.9 / (0.375 * 12) = 0.8 mm; the feed is 50 mm/s."""
    job = path(turned(np.zeros(1)))
    division = output(job, np.zeros((4, 3)))
    for spacing, cycle, least in ((0.5, 0.0, 0.8), (1.1, 0.0, 1.1), (0.5, 0.03, 1.5), (0.5, 0.004, 0.8)):
        away, _ = chosen_points(job, division, [12.0], spacing=spacing * MM, cycle=cycle)
        np.testing.assert_allclose(np.sort(away), [-least * MM, least * MM], rtol=1e-9)
    job = replace(job, toolpath=job.toolpath.with_columns(feed=np.full(4, np.nan)))
    away, _ = chosen_points(job, division, [12.0], spacing=0.9 * MM, cycle=0.03)
    np.testing.assert_allclose(np.sort(away), [-0.9 * MM, 0.9 * MM], rtol=1e-9)


@pytest.mark.parametrize("error", [2.0, 3.0, 6.0, 9.0, 20.0])
def test_around_a_corner_of_the_program_points_part_its_parabola_evenly(error):
    """Into an odd number of pieces, as few as are short enough; the outermost points are outside of it."""
    job = path(RIGHT)
    away, found = chosen_points(job, output(job, np.zeros((5, 3))), [error], spacing=0.1 * MM)
    wanted = 2 * D * min(1.0, 0.9 / (0.375 * error))
    after, before = np.sort(away[away > 0]), np.sort(-away[away < 0])
    np.testing.assert_allclose(after, before, rtol=1e-9)
    step = after[0]
    np.testing.assert_allclose(after, step * np.arange(1, len(after) + 1), rtol=1e-9)
    pieces = 2 * D / step
    assert pieces == pytest.approx(2 * len(after) - 1)
    assert step <= wanted * (1 + 1e-9)
    if len(after) > 1:
        assert 2 * D / (pieces - 2) > wanted
        assert after[-2] < D
    assert after[-1] > D
    assert found.inner.tolist() == [len(after) > 1]


def test_around_a_corner_pieces_stay_as_long_as_the_shortest_motion():
    """At 20 times what is allowed pieces of 0.24 mm were wanted: of 4 mm those of 1 mm and more are three."""
    job = path(RIGHT)
    division = output(job, np.zeros((5, 3)))
    for spacing, step in ((1.0, 4 / 3), (0.79, 0.8), (0.81, 4 / 3), (1.4, 4.0), (3.9, 4.0)):
        away, _ = chosen_points(job, division, [20.0], spacing=spacing * MM)
        assert np.abs(away).min() == pytest.approx(step * MM)
    away, _ = chosen_points(job, division, [20.0], spacing=4.1 * MM)
    assert len(away) == 0  # nor is there room for one inside


@pytest.mark.parametrize("parts", [0.08, 0.12])
def test_a_turn_that_is_not_seen_is_straight_on(parts):
    angle = float(angle_of(parts))
    job = path(turned([angle]))
    away, _ = chosen_points(job, output(job, np.zeros((4, 3))), [6.0])
    assert len(away) == (4 if parts > 0.1 else 2)


def test_without_room_on_one_side_points_are_on_the_other():
    """On motions of 8 mm there is room for 2 x 0.9 mm of a corner, beside what the next one takes."""
    job = path(turned(np.zeros(3)))
    division = output(job, np.zeros((6, 3)))
    for free, sides in (([1, 1, 1, 1, 1, 1], (True, True)), ([1, 1, 0, 1, 1, 1], (False, True)),
                        ([1, 1, 1, 0, 1, 1], (True, False)), ([1, 1, 0, 0, 1, 1], (False, False))):  # fmt: skip
        away, found = chosen_points(job, division, [6.0], free=np.array(free, bool))
        assert ((away < 0).any(), (away > 0).any()) == sides
        assert not found.inner.any()


@pytest.mark.parametrize("length", [4.0, 5.0, 6.0, 7.0, 9.0, 12.0, 20.0])
@pytest.mark.parametrize("errors", [[6.0, 6.0, 6.0], [3.0, 9.0, 2.0], [2.0, 1.0, 9.0]])
def test_points_of_corners_that_share_a_motion_leave_each_other_room(length, errors):
    """No motion becomes shorter than may be, those between points of two corners included; and those of one that is
    not touched yet keep what its parabola takes."""
    spacing = 0.5 * MM
    for points in (turned(np.zeros(3), length), turned([0.6, 0.6, 0.6], length)):
        job = path(points)
        division = output(job, np.zeros((6, 3)))
        away, found = chosen_points(job, division, errors, spacing=spacing)
        for row in range(1, 6):
            share = np.sort(np.concatenate([[0.0, 1.0], found.share[found.row == row]]))
            assert np.diff(share).min() * length * MM > spacing - 1e-9
        far = np.abs(away).max(initial=0.0)
        assert far < length * MM - spacing


def test_when_few_may_be_inserted_the_worst_corner_gets_its_points():
    job = path(turned(np.zeros(4)))
    division = output(job, np.zeros((7, 3)))
    errors = [3.0, 7.0, 1.0, 5.0]
    for spare, groups in (
        (0, []),
        (1, []),
        (2, [1]),
        (3, [1]),
        (4, [1, 3]),
        (5, [1, 3]),
        (6, [0, 1, 3]),
        (9, [0, 1, 3]),
    ):
        _, found = chosen_points(job, division, errors, spare=spare)
        assert sorted(set(found.group.tolist())) == groups
        assert len(found.group) == 2 * len(groups)
    # with one place left after the worst, one that needs one point alone still gets it
    free = np.ones(7, bool)
    free[2] = False
    _, found = chosen_points(job, division, errors, spare=3, free=free)
    assert sorted(found.group.tolist()) == [0, 1, 1]
    # what is inserted already counts
    more = output(job, np.zeros((7, 3)), [(6, 0.5, [0.0, 0.0, 0.0], 0.0)])
    _, found = chosen_points(job, more, errors, spare=5)
    assert sorted(set(found.group.tolist())) == [1, 3]


def test_where_points_left_more_than_there_was_they_are_chosen_for_that():
    """An error of 3 of which 8 remained gets the points of 8; one of 3 alone those of 3."""
    job = path(turned(np.zeros(2)))
    division = output(job, np.zeros((5, 3)))
    away, found = chosen_points(job, division, [3.0, 3.0], remaining=np.array([8.0, 0.0]))
    for group, error in ((0, 8.0), (1, 3.0)):
        step = 2 * D * 0.9 / (0.375 * error)
        np.testing.assert_allclose(of_group(away, found, group), [-step, step], rtol=1e-9)
    np.testing.assert_array_equal(found.before, [3.0, 3.0])


def test_the_shortest_arc_leaves_its_chord_by_a_tenth_of_the_tolerance():
    for diameter in (0.05, 0.6):
        job = circle(diameter=diameter)
        length = shortest_arc(job, np.array([2]))[0]
        radius = diameter / 2
        assert radius * (1.0 - np.cos(length / (2 * radius))) == pytest.approx(0.1 * job.tolerance, rel=1e-4)


@pytest.mark.parametrize("arc_first", [True, False])
def test_a_corner_between_a_line_and_an_arc_is_found_by_the_tangents(arc_first):
    """The chord of the arc goes on as the line does, the arc itself turns by half of its sweep: that is rounded off."""
    sweep, chord = 0.2, 60.0
    x = np.array([-200.0, -150.0, -chord, 0.0, chord, 150.0])
    points = np.stack([x, 0 * x, 0 * x], axis=1) * MM
    row, middle = (3, -0.5 * chord) if arc_first else (4, 0.5 * chord)
    none, sweeps = np.full((6, 3), np.nan), np.full(6, np.nan)
    centre, normal = none.copy(), none.copy()
    centre[row] = AT + np.array([middle, 0.5 * chord / np.tan(0.5 * sweep), 0.0]) * MM
    normal[row], sweeps[row] = [0.0, 0.0, 1.0], sweep
    kinds = [Kind.PTP] + [Kind.LIN] * 5
    kinds[row] = Kind.CIRC
    job = path(points, kind=kinds, arcs=Arcs(centre=centre, normal=normal, sweep=sweeps))
    none = np.zeros((6, 3))
    division = output(job, none)
    circles = job.desired_path.circles(np.arange(6))
    division = replace(division, centre=circles[0], normal=circles[1], sweep=circles[2])
    found = rows_found(job, corrected(job, none), division)
    assert found == [row - 1, row]
    suspect = suspect_corners(job, corrected(job, none), division, np.array([2, 3, 4]))
    assert {row - 1, row} <= set(suspect.tolist())
