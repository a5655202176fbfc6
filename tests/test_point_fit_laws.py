"""Laws of points on rounded polygons: slopes are finite differences, places lie on the drawn path, and nothing depends
on the direction in which a curve is gone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import linprog

from postproc.compensation.closest_points import closest_points
from postproc.compensation.point_fit import (
    Curves,
    evaluate_polygons,
    fit_points,
    least_largest,
    long_enough,
    moved_apart,
)

MM = 1e-3
TURN = np.array([[0.0, 8.0], [2.0, 6.0]]) * MM


def curves(place, tangent, first, step, ends, *, turn=TURN, count=81, arc=(False, False)) -> Curves:
    """Curves of which ``place`` and ``tangent`` give (S, 3) at the parameters (S,), of each of the groups."""
    places, tangents = [], []
    for group in range(len(first)):
        inner = first[group] + step[group] * np.arange(count)
        along = np.concatenate([[ends[group][0]], inner, [ends[group][1]]])
        places.append(place(along, group))
        tangents.append(tangent(along, group))
    arcs = np.tile(arc, (len(first), 1))
    return Curves(np.array(first), np.array(step), np.array(ends), turn[: len(first)], np.array(places),
                  np.array(tangents), arcs, np.array(places))  # fmt: skip


def straight(group_slopes=((0.3, -0.2), (-0.5, 0.1))) -> Curves:
    """Lines whose y and z rise evenly with x, the parameter; distances are measured square to x."""

    def place(x, group):
        y, z = group_slopes[group]
        return np.stack([x, y * x, z * x], axis=1)

    return curves(
        place,
        lambda x, _: np.tile([1.0, 0.0, 0.0], (len(x), 1)),
        [-8.0 * MM, -6.0 * MM],
        [0.25 * MM, 0.3 * MM],
        [[-30.0 * MM, 40.0 * MM], [-20.0 * MM, 35.0 * MM]],
    )


def points_near(chosen: Curves, seed: int, count: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (G, K) and points (G, K, 3) some tenths of a millimetre beside them; the ends on the curves."""
    rng = np.random.default_rng(seed)
    inner = np.sort(rng.uniform(-5.0, 12.0, (len(chosen.first), count - 2)), axis=1) * MM
    inner += np.arange(count - 2) * 0.8 * MM
    parameter = np.column_stack([chosen.ends[:, 0], inner, chosen.ends[:, 1]])
    points = chosen.at(parameter)[0]
    points[:, 1:-1] += rng.uniform(-0.3, 0.3, points[:, 1:-1].shape) * MM
    return parameter, points


def rounded(points: np.ndarray, reach: np.ndarray, count: int = 2001) -> np.ndarray:
    """The polygon (K, 3), each inner point rounded from its reach (K,) on, no farther than half of either line."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    d = np.zeros(len(points))
    d[1:-1] = np.minimum(reach[1:-1], 0.5 * np.minimum(length[:-1], length[1:]))
    t = np.linspace(0.0, 1.0, count)[:, None]
    parts = []
    for k, size in enumerate(length):
        unit = (points[k + 1] - points[k]) / size
        start, end = points[k] + d[k] * unit, points[k + 1] - d[k + 1] * unit
        parts.append(start + t * (end - start))
        if k + 2 < len(points):
            after = points[k + 1] + d[k + 1] * (points[k + 2] - points[k + 1]) / length[k + 1]
            parts.append((1 - t) ** 2 * end + 2 * t * (1 - t) * points[k + 1] + t**2 * after)
    return np.concatenate(parts)


@pytest.mark.parametrize("reach", [0.2 * MM, 1.0 * MM, 50.0 * MM])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_places_lie_on_the_drawn_path_and_find_its_largest_error(reach: float, seed: int) -> None:
    """Where the distance is measured square to x, a place is at its parameter, off by so much."""
    chosen = straight()
    parameter, points = points_near(chosen, seed)
    reaches = np.full(parameter.shape, reach) * np.linspace(0.7, 1.3, parameter.shape[1])
    found = evaluate_polygons(chosen, points, reaches, None, parameter, 2)
    for group in range(2):
        drawn = rounded(points[group], reaches[group])
        on = chosen.at(drawn[None, :, 0].repeat(2, axis=0))[0][group]
        off = drawn - on
        order = np.argsort(drawn[:, 0])
        x = found.parameter[group]
        for axis in (1, 2):
            there = np.interp(x, drawn[order, 0], off[order, axis])
            np.testing.assert_allclose(found.off[group, :-2, axis], there[:-2], atol=2e-9)
            # between two places of the polygon: of a parabola the chord
            np.testing.assert_allclose(found.off[group, -2:, axis], there[-2:], atol=5e-7)
        assert np.abs(found.off[group, :, 0]).max() < 1e-12
        within = (x.min() - 1e-9 <= drawn[:, 0]) & (drawn[:, 0] <= x.max() + 1e-9)
        most = np.linalg.norm(off[within], axis=1).max()
        assert found.largest[group] == pytest.approx(most, rel=0.03)
        # as far as the curves are known to bend, and where each of them turns
        assert x.min() < points[group, 1, 0] - 5 * MM
        assert x.max() > points[group, -2, 0] + 5 * MM
        inside = np.sort(x[(x > points[group, 1, 0]) & (x < points[group, -2, 0])])
        assert np.diff(inside).max() < 0.12 * np.diff(points[group, :, 0]).max() + 0.05 * MM
        np.testing.assert_allclose(x[-2:], TURN[group], atol=1e-6)


@pytest.mark.parametrize("reach", [0.2 * MM, 1.0 * MM, 50.0 * MM])
@pytest.mark.parametrize("seed", [3, 4])
def test_a_slope_is_a_finite_difference(reach: float, seed: int) -> None:
    """Of every coordinate of every inner point.  On a line a place is (1 - s) p + s q; on a parabola a difference
    tells, what the coordinate does to its reach included."""
    chosen = straight()
    parameter, points = points_near(chosen, seed)
    reaches = np.full(parameter.shape, reach)
    found = evaluate_polygons(chosen, points, reaches, None, parameter, 2)
    count, step = parameter.shape[1], 1e-8
    assert found.slope.shape == (*found.off.shape, 3 * (count - 2))
    x = found.parameter[:, :-2]  # but where a curve turns: there another place of the polygon is taken
    line, length = np.zeros(x.shape, int), np.linalg.norm(np.diff(points, axis=1), axis=2)
    round_, edge = np.zeros(x.shape, bool), np.zeros(x.shape, bool)  # there it belongs to both
    for group in range(2):
        line[group] = np.clip(np.searchsorted(points[group, :, 0], x[group]) - 1, 0, count - 2)
        for k in range(1, count - 1):
            d = min(reach, 0.5 * length[group, k - 1], 0.5 * length[group, k])
            low = points[group, k] - d * (points[group, k] - points[group, k - 1]) / length[group, k - 1]
            high = points[group, k] + d * (points[group, k + 1] - points[group, k]) / length[group, k]
            round_[group] |= (x[group] > low[0] + 1e-9) & (x[group] < high[0] - 1e-9)
            edge[group] |= (np.abs(x[group] - low[0]) < 1e-9) | (np.abs(x[group] - high[0]) < 1e-9)
    assert 60 < round_.sum() / 2 < 150
    one = np.arange(2)[:, None]
    share = (x - points[one, line, 0]) / (points[one, line + 1, 0] - points[one, line, 0])
    along = chosen.at(found.parameter)[2][:, :-2]
    for k in range(count - 2):
        weight = np.where(line == k, share, 0.0) + np.where(line == k + 1, 1.0 - share, 0.0)
        for axis in range(3):
            moved = []
            for sense in (1, -1):
                other = points.copy()
                other[:, 1 + k, axis] += sense * step
                moved.append(evaluate_polygons(chosen, other, reaches, None, parameter, 2).off)
            differences = (moved[0] - moved[1])[:, :-2] / (2 * step)
            on_line = weight[..., None] * (np.eye(3)[axis] - along * (axis == 0))
            expected = np.where(round_[..., None], differences, on_line)
            here = found.slope[:, :-2, :, 3 * k + axis]
            np.testing.assert_allclose(here[~edge], expected[~edge], atol=3e-5)


def test_from_near_places_the_same_is_found() -> None:
    chosen = straight()
    parameter, points = points_near(chosen, 5)
    reaches = np.full(parameter.shape, 0.7 * MM)
    found = evaluate_polygons(chosen, points, reaches, None, parameter, 2)
    again = evaluate_polygons(chosen, points, reaches, found.parameter, found.label, 2)
    np.testing.assert_allclose(again.off, found.off, atol=1e-12)
    np.testing.assert_allclose(again.parameter, found.parameter, atol=1e-12)


def test_a_curve_that_is_affine_in_its_parameter_is_so_everywhere() -> None:
    """Between its places, before and after them up to its ends; each of the groups by its own steps."""
    start = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 2.0]]) * MM
    ahead = np.array([[0.8, 0.6, 0.0], [0.0, 0.28, 0.96]])
    turns = np.array([[10.0, 0.0, -5.0], [3.0, 7.0, 0.0]])
    chosen = curves(
        lambda s, g: start[g] + s[:, None] * ahead[g],
        lambda s, g: ahead[g] + s[:, None] * turns[g],
        [-8.0 * MM, -3.0 * MM],
        [0.25 * MM, 0.1 * MM],
        [[-30.0 * MM, 40.0 * MM], [-20.0 * MM, 35.0 * MM]],
    )
    at = np.array([[-29.9, -20.0, -8.1, -8.0, -7.9, 0.0, 0.13, 11.9, 12.0, 12.1, 25.0, 39.9],
                   [-19.9, -12.0, -3.1, -3.0, -2.9, 0.0, 0.13, 4.9, 5.0, 5.1, 20.0, 34.9]]) * MM  # fmt: skip
    place, tangent, along = chosen.at(at)
    np.testing.assert_allclose(place, start[:, None] + at[..., None] * ahead[:, None], atol=1e-15)
    np.testing.assert_allclose(tangent, ahead[:, None] + at[..., None] * turns[:, None], atol=1e-13)
    np.testing.assert_allclose(along, np.broadcast_to(ahead[:, None], along.shape), atol=1e-10)
    one = chosen[np.array([1])].at(at[1:])
    np.testing.assert_array_equal(one[0][0], place[1])
    # what is nearest to a place beside the line, square to it, is its own parameter, from anywhere within reach
    plain = curves(
        lambda s, g: start[g] + s[:, None] * ahead[g],
        lambda s, g: np.tile(ahead[g], (len(s), 1)),
        [-8.0 * MM, -3.0 * MM],
        [0.25 * MM, 0.1 * MM],
        [[-30.0 * MM, 40.0 * MM], [-20.0 * MM, 35.0 * MM]],
    )
    aside = np.cross(ahead, [0.0, 0.6, 0.8])[:, None]
    for off in (-5.0 * MM, -1.0 * MM, 0.0, 4.0 * MM):
        found = plain.nearest(place + 0.4 * MM * aside, at + off)
        np.testing.assert_allclose(found[:, 1:-1], at[:, 1:-1], atol=1e-12)
    # a step is of 2 mm at most: from far away it is not there yet
    assert np.abs(plain.nearest(place, at + 5.0 * MM, 1) - (at + 3.0 * MM))[:, :-1].max() < 1e-12


@pytest.mark.parametrize("direction", [1, -1])
def test_the_first_place_that_is_far_enough_away(direction: int) -> None:
    """On a line the place at that distance, up to a step of the curve; where the first is far enough, it."""
    chosen = straight(((0.75, 0.0), (0.0, 0.0)))
    stretch = np.array([1.25, 1.0])  # of y = 0.75 x
    start = np.array([1.0, 1.0]) * MM
    first = start + direction * np.array([0.1, 0.1]) * MM
    for distance in (0.5 * MM, 2.0 * MM):
        found = chosen.away(start, first, np.full(2, distance), direction)
        exact = distance / stretch
        past = direction * (found - start) - exact
        assert (past > -1e-12).all()
        assert (past < chosen.step).all()
    near = chosen.away(start, first, np.full(2, 0.05 * MM), direction)
    np.testing.assert_array_equal(near, first)
    far = chosen.away(start, first, np.full(2, 1.0), direction)
    np.testing.assert_array_equal(far, first)


def round_a_circle(radius: float, before: bool, count: int = 1201) -> Curves:
    """Before 0 round a circle and along x from there on, or the other way round."""

    def place(s, _):
        angle = (np.minimum(s, 0.0) if before else np.maximum(s, 0.0)) / radius
        along = np.maximum(s, 0.0) if before else np.minimum(s, 0.0)
        return np.stack([radius * np.sin(angle) + along, radius * (1.0 - np.cos(angle)), 0.0 * s], axis=1)

    def tangent(s, _):
        angle = (np.minimum(s, 0.0) if before else np.maximum(s, 0.0)) / radius
        return np.stack([np.cos(angle), np.sin(angle), 0.0 * s], axis=1)

    return curves(place, tangent, [-6.0 * MM], [0.01 * MM], [[-7.0 * MM, 7.0 * MM]],
                  turn=np.array([[0.0, 3.0 * MM]]), count=count, arc=(before, not before))  # fmt: skip


@pytest.mark.parametrize("before", [True, False])
def test_a_piece_of_an_arc_bends_away_from_its_chord_as_a_circle_does(before: bool) -> None:
    """R (1 - cos(s / 2R)) in its middle, 0 at its ends, nothing on the other side."""
    radius, size = 10.0 * MM, 2.0 * MM
    chosen = round_a_circle(radius, before)
    low = np.array([-4.0 * MM if before else 2.0 * MM])
    share = np.array([[0.0, 0.25, 0.5, 1.0]])
    side = 0 if before else 1
    bend = np.linalg.norm(chosen.bends(low, low + size, share, side)[0], axis=1)
    np.testing.assert_allclose(bend[[0, 3]], 0.0, atol=1e-12)
    assert bend[2] == pytest.approx(radius * (1.0 - np.cos(size / (2 * radius))), rel=1e-4)
    assert bend[1] == pytest.approx(0.75 * bend[2], rel=1e-2)  # a parabola, but for the fourth power
    assert (chosen.bends(low, low + size, share, 1 - side) == 0).all()


@pytest.mark.parametrize("before", [True, False])
def test_points_on_a_path_that_rounds_off_nothing_are_off_nowhere(before: bool) -> None:
    """However many there are on its arc; and moved together, they are off by what that is across the path."""
    chosen = round_a_circle(10.0 * MM, before)
    parameter = np.array([[-7.0, -4.4, -2.9, -1.0, 0.0, 0.7, 2.0, 3.1, 7.0]]) * MM
    reach = np.zeros(parameter.shape)
    points = chosen.at(parameter)[0]
    found = evaluate_polygons(chosen, points, reach, None, parameter, 4)
    assert found.largest[0] < 2e-8
    np.testing.assert_allclose(found.label, parameter, atol=1e-8)
    shift = np.array([0.03, -0.05, 0.04]) * MM
    moved = evaluate_polygons(chosen, points + shift, reach, None, parameter, 4)
    tangent = chosen.at(moved.parameter)[1]
    across = shift - np.sum(shift * tangent, axis=2)[..., None] * tangent
    inner = (moved.parameter[0] > -4.3 * MM) & (moved.parameter[0] < 3.0 * MM)
    np.testing.assert_allclose(moved.off[0, inner], across[0, inner], atol=1e-6)


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("reach", [0.4 * MM, 0.7 * MM, 5.0 * MM])
def test_points_that_are_rounded_off_between_two_arcs_are_off_as_the_blend_of_both_is(
    reach: float, before: bool
) -> None:
    """From d before a point of a circle to d after it the place is (1 - u) of the one arc and u of the other: at the
    parts 1 - u and u of d from the point, d no more than half of the shorter chord."""
    radius = 10.0 * MM
    chosen = round_a_circle(radius, before)
    own = np.array([-6.0, -4.4, -2.0, 0.0, 1.0, 2.0, 6.0]) * MM
    parameter, inner, vertex = (own, 2, 3) if before else (-own[::-1], 4, 3)
    reaches = np.zeros((1, 7))
    reaches[0, inner] = reach
    found = evaluate_polygons(chosen, chosen.at(parameter[None])[0], reaches, None, parameter[None], vertex)
    turns = np.diff(parameter)[[inner - 1, inner]] / radius
    chords = 2.0 * radius * np.sin(0.5 * turns)
    distance = min(reach, 0.5 * chords.min())
    u = np.linspace(0.0, 1.0, 1001)
    turned = [-(1.0 - u) * turns[0] * distance / chords[0], u * turns[1] * distance / chords[1]]
    blend = (1.0 - u) * np.exp(1j * turned[0]) + u * np.exp(1j * turned[1])
    off = radius * (1.0 - np.abs(blend))
    assert found.largest[0] == pytest.approx(off.max(), rel=2e-2)
    from_point = (found.parameter[0] - parameter[inner]) / radius
    some = np.abs(from_point) < 0.99 * distance / radius
    expected = np.interp(from_point[some], np.angle(blend), off)
    np.testing.assert_allclose(np.linalg.norm(found.off[0, some], axis=1), expected, atol=1e-2 * off.max())


def test_parameters_of_points_ascend_and_the_vertex_keeps_its_own() -> None:
    """Where a point has gone beyond its neighbour they have one place; none goes beyond the ends."""
    chosen = round_a_circle(10.0 * MM, True)
    parameter = np.array([[-5.0, -3.0, -2.0, 0.0, 1.0, 2.0, 5.0]]) * MM
    there = np.array([[-5.0, -2.0, -3.0, 0.4, 2.0, 1.0, 5.0]]) * MM
    found = evaluate_polygons(chosen, chosen.at(there)[0], np.zeros((1, 7)), None, parameter, 3).label
    np.testing.assert_allclose(found, np.array([[-5.0, -3.0, -3.0, 0.0, 2.0, 2.0, 5.0]]) * MM, atol=1e-8)
    outside = np.array([[-5.0, -5.8, -3.0, 0.0, 1.0, 5.9, 5.0]]) * MM
    found = evaluate_polygons(chosen, chosen.at(outside)[0], np.zeros((1, 7)), None, parameter, 3).label
    np.testing.assert_allclose(found, np.array([[-5.0, -5.0, -3.0, 0.0, 1.0, 5.0, 5.0]]) * MM, atol=1e-8)


def test_too_short_lines_are_parted_from_both_sides_evenly() -> None:
    """The middle of two inner points stays; beside an end the inner one goes alone; what is long enough stays."""
    x = (
        np.array([[0.0, 3.0, 3.4, 9.0], [0.0, 0.4, 5.0, 9.0], [0.0, 3.0, 6.0, 9.0], [0.0, 4.0, 8.8, 9.0]])
        * MM
    )
    points = np.stack([x, 0.5 * x, 0.0 * x], axis=2)
    stretch = np.hypot(1.0, 0.5)
    shortest = np.full((4, 3), stretch) * MM
    before = points.copy()
    found = moved_apart(points, shortest)
    np.testing.assert_array_equal(points, before)  # of the caller
    expected = (
        np.array([[0.0, 2.7, 3.7, 9.0], [0.0, 1.0, 5.0, 9.0], [0.0, 3.0, 6.0, 9.0], [0.0, 4.0, 8.0, 9.0]])
        * MM
    )
    np.testing.assert_allclose(found[..., 0], expected, atol=1e-12)
    np.testing.assert_allclose(found[..., 1], 0.5 * expected, atol=1e-12)
    assert long_enough(found, shortest).all()
    np.testing.assert_array_equal(long_enough(points, shortest), [False, False, True, False])
    # no room for all: the ends stay even so
    crowded = moved_apart(points[:1], np.full((1, 3), 4.0 * stretch) * MM)
    np.testing.assert_array_equal(crowded[:, [0, -1]], points[:1, [0, -1]])


@pytest.mark.parametrize("seed", range(4))
def test_the_step_makes_the_largest_error_nearly_as_small_as_a_linear_programme_can(seed: int) -> None:
    rng = np.random.default_rng(seed)
    groups, samples, free = 2, 30, 4
    off, slope = np.zeros((groups, samples, 3)), np.zeros((groups, samples, 3, free))
    off[:, :, 1] = rng.normal(size=(groups, samples))
    slope[:, :, 1] = rng.normal(size=(groups, samples, free))
    step = least_largest(off, slope, np.full(groups, 1e-9))
    assert step.shape == (groups, free)
    for group in range(groups):
        now, by = off[group, :, 1], slope[group, :, 1]
        both = np.vstack([np.hstack([by, -np.ones((samples, 1))]), np.hstack([-by, -np.ones((samples, 1))])])
        best = linprog(np.append(np.zeros(free), 1.0), both, np.append(-now, now), bounds=(None, None)).fun
        squares = np.abs(now + by @ np.linalg.lstsq(by, -now, rcond=None)[0]).max()
        largest = np.abs(now + by @ step[group]).max()
        assert best - 1e-9 <= largest < best + 0.6 * (squares - best) + 1e-9
    # of one number, the middle between the two farthest ones
    heights = np.array([-3.0, 1.0, 5.0, 0.0])
    off, slope = np.zeros((1, 4, 3)), np.zeros((1, 4, 3, 1))
    off[0, :, 0], slope[0, :, 0, 0] = heights, 1.0
    assert least_largest(off, slope, np.full(1, 1e-9))[0, 0] == pytest.approx(-1.0, abs=0.15)
    # a large damping keeps it where it is
    assert abs(least_largest(off, slope, np.full(1, 1e6))[0, 0]) < 1e-4


def bent(slope: float) -> Curves:
    """Along x; y rises by ``slope`` from 0 to 8 mm; the ends are as far from there on both sides."""

    def place(x, _):
        return np.stack([x, slope * np.clip(x, 0.0, 8.0 * MM), 0.0 * x], axis=1)

    return curves(place, lambda x, _: np.tile([1.0, 0.0, 0.0], (len(x), 1)), [-10.0 * MM], [0.05 * MM],
                  [[-30.0 * MM, 38.0 * MM]], count=561)  # fmt: skip


START = (-1.0, 0.0, 1.2, 6.9, 8.0)


@pytest.mark.parametrize("slope", [0.2, -0.9])
def test_a_fit_is_as_near_as_its_path_is_when_drawn(slope: float) -> None:
    """And nearer than its start; no line is too short, and what is near enough from the start stays."""
    plain, parameter = bent(slope), np.array([[-30.0, *START, 38.0]]) * MM
    words = np.full((1, 7), 0.6 * MM), np.full((1, 6), 0.3 * MM)
    points, largest = fit_points(plain, parameter, *words, 0.0, 2)
    np.testing.assert_allclose(points[0, [0, -1]], plain.place[0, [0, -1]], atol=0)
    assert long_enough(points, words[1]).all()
    drawn = rounded(points[0], words[0][0])
    true = np.abs(drawn[:, 1] - slope * np.clip(drawn[:, 0], 0.0, 8.0 * MM)).max()
    assert largest[0] == pytest.approx(true, rel=0.03)
    start = evaluate_polygons(plain, plain.at(parameter)[0], words[0], None, parameter, 2)
    assert largest[0] < 0.7 * start.largest[0]
    # what is near enough stays where it starts
    kept, most = fit_points(plain, parameter, *words, 1.01 * float(start.largest[0]), 2)
    np.testing.assert_array_equal(kept, plain.at(parameter)[0])
    np.testing.assert_array_equal(most, start.largest)


@pytest.mark.parametrize("slope", [0.2, -0.9])
def test_a_fit_of_two_points_does_not_depend_on_the_axes(slope: float) -> None:
    """In another order of them, mirrored, or from the other end: a turn by k, rounded from d on, leaves k d / 8."""
    plain = bent(slope)
    parameter = np.array([[-30.0, 0.0, 8.0, 38.0]]) * MM
    words = np.full((1, 4), 0.6 * MM), np.full((1, 3), 0.3 * MM)
    points, largest = fit_points(plain, parameter, *words, 0.0, 1)
    assert largest[0] == pytest.approx(abs(slope) * 0.6 * MM / 8, rel=0.2)
    for axes, sign in (([2, 0, 1], [1, 1, 1]), ([0, 1, 2], [1, -1, 1]), ([0, 1, 2], [-1, 1, 1])):
        same = [getattr(plain, name) for name in ("first", "step", "ends", "turn")]
        place, tangent = (sign * a[..., axes] for a in (plain.place, plain.tangent))
        found, most = fit_points(Curves(*same, place, tangent, plain.arc, place), parameter, *words, 0.0, 1)
        assert most[0] == pytest.approx(largest[0], rel=5e-3)
        np.testing.assert_allclose(found[0], sign * points[0][:, axes], atol=1e-5)
    end = 8.0 * MM
    last = plain.first + (plain.place.shape[1] - 3) * plain.step
    back = Curves(end - last, plain.step, end - plain.ends[:, ::-1], end - plain.turn[:, ::-1],
                  plain.place[:, ::-1], -plain.tangent[:, ::-1], plain.arc, plain.place[:, ::-1])  # fmt: skip
    found, most = fit_points(back, end - parameter[:, ::-1], *words, 0.0, 1)
    assert most[0] == pytest.approx(largest[0], rel=0.05)
    np.testing.assert_allclose(found[0, ::-1], points[0], atol=2e-5)


def test_one_of_two_groups_does_not_change_the_other() -> None:
    one, two = bent(0.2), bent(-0.9)
    both = Curves(
        *(np.concatenate([getattr(c, name) for c in (one, two)]) for name in one.__dataclass_fields__)
    )
    parameter = np.array([[-30.0, *START, 38.0]]) * MM
    words = np.full((2, 7), 0.6 * MM), np.full((2, 6), 0.3 * MM)
    together = fit_points(both, np.repeat(parameter, 2, axis=0), *words, 0.0, 2)
    for group, curve in enumerate((one, two)):
        alone = fit_points(curve, parameter, words[0][:1], words[1][:1], 0.0, 2)
        assert together[1][group] == pytest.approx(alone[1][0], rel=1e-6)
        np.testing.assert_allclose(together[0][group], alone[0][0], atol=1e-9)


def test_a_close_fit_is_much_nearer_than_its_start() -> None:
    """Between lines that must be long; its error is that of the drawn path, and no line is shorter."""
    slope = 0.9
    chosen, parameter = bent(slope), np.array([[-30.0, *START, 38.0]]) * MM
    words = np.full((1, 7), 0.5 * MM), np.full((1, 6), 0.6 * MM)
    points, largest = closest_points(chosen, parameter, *words, 0.0, 2)
    start = moved_apart(chosen.at(parameter)[0], words[1])
    assert largest < 0.5 * evaluate_polygons(chosen, start, words[0], None, parameter, 2).largest[0]
    assert long_enough(points, words[1]).all()
    drawn = rounded(points[0], words[0][0])
    true = np.abs(drawn[:, 1] - slope * np.clip(drawn[:, 0], 0.0, 8.0 * MM)).max()
    assert largest == pytest.approx(true, rel=0.03)


def test_beside_each_turn_errors_are_least_together() -> None:
    """Of drawn paths round two turns: where one of them has to be far off, the other one need not be as well."""
    words = np.full((1, 7), 0.5 * MM), np.full((1, 6), 0.6 * MM)
    parameter, shares = np.array([[-30.0, *START, 38.0]]) * MM, []
    for first, second in ((0.1, 0.9), (0.2, -0.9), (0.9, 0.1), (-0.1, 0.5)):

        def height(x: np.ndarray, one: float = first, two: float = second) -> np.ndarray:
            return one * np.maximum(x, 0.0) + two * np.maximum(x - 8.0 * MM, 0.0)

        def place(x: np.ndarray, _: int, y: Callable[[np.ndarray], np.ndarray] = height) -> np.ndarray:
            return np.stack([x, y(x), 0.0 * x], axis=1)

        chosen = curves(place, lambda x, _: np.tile([1.0, 0.0, 0.0], (len(x), 1)), [-10.0 * MM], [0.05 * MM],
                        [[-30.0 * MM, 38.0 * MM]], count=561)  # fmt: skip
        together = []
        for each_turn in (False, True):
            points, _ = closest_points(chosen, parameter, *words, 0.0, 2, each_turn=each_turn)
            drawn = rounded(points[0], words[0][0])
            off, before = np.abs(drawn[:, 1] - height(drawn[:, 0])), drawn[:, 0] < 4.0 * MM
            together.append(off[before].max() + off[~before].max())
        shares.append(together[1] / together[0])
    assert max(shares) < 1.05
    assert min(shares) < 0.6


@pytest.mark.parametrize("slope", [0.9, -0.4])
def test_where_a_curve_turns_the_place_of_a_polygon_moves_along_the_polygon(slope: float) -> None:
    """The error there is that of the drawn path where x is that of the turn, however the points move."""
    chosen, parameter = bent(slope), np.array([[-30.0, *START, 38.0]]) * MM
    reach, numbers = np.full((1, 7), 0.5 * MM), np.random.default_rng(3)
    points = moved_apart(chosen.at(parameter)[0], np.full((1, 6), 0.6 * MM))
    points[0, 1:-1, :2] += numbers.uniform(-0.05, 0.05, (5, 2)) * MM
    turns, tiny = chosen.turn[0], 1e-4 * MM

    def at_turns(some: np.ndarray) -> np.ndarray:
        drawn = rounded(some[0], reach[0])
        return np.interp(turns, drawn[:, 0], drawn[:, 1]) - slope * np.clip(turns, 0.0, 8.0 * MM)

    polygon = evaluate_polygons(chosen, points, reach, None, parameter, 2, True)
    np.testing.assert_allclose(polygon.off[0, -2:, 1], at_turns(points), atol=1e-6)
    by_points = polygon.slope[0, -2:, 1].reshape(2, 5, 3)
    for point in range(5):
        for axis in (0, 1):
            moved = points.copy()
            moved[0, 1 + point, axis] += tiny
            change = (at_turns(moved) - at_turns(points)) / tiny
            np.testing.assert_allclose(by_points[:, point, axis], change, atol=0.03)
