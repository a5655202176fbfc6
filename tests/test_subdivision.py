"""The way between corrected points: links, points on lines and arcs, and what limits them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import FORCE, circle, corner, in_even_pieces, line
from path_cases import task as task_to

import postproc.compensation.divisible_motions as divisible_motions
from postproc.base.units import MM
from postproc.compensation.correct import correct
from postproc.compensation.divisible_motions import ROOM, STEP
from postproc.compensation.path_error import PathSegments, path_errors
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, subdivided_motions
from postproc.toolpath import Role

FREE = Limits(max_growth=100.0)


def divided(task, limits=FREE):
    result = correct(task)
    return result, subdivide(task, result, limits)


def dense(task, division, samples=41):
    """(M,) [m] the largest distance from the wanted way inside of each motion, at ``samples`` shares of each."""
    pieces = subdivided_motions(task, division, np.arange(len(division)))
    chosen = np.flatnonzero(~division.transitions & np.isin(division.source, np.flatnonzero(task.carries)))
    worst = np.zeros(len(division))
    for share in np.linspace(0, 1, samples):
        part = pieces[chosen]
        along = part.first + share * (part.last - part.first)
        wanted = task.desired_path.at(part.rows, along)
        here = part.at(np.full(len(chosen), share))
        real = task.simulated(part.rows, here, task.force.along(part.rows, along)).pose
        shift = real.position - task.goal(part.rows, wanted).position
        along = task.desired_path.tangent(part.rows, along)
        shift -= np.sum(shift * along, axis=1, keepdims=True) * along
        worst[chosen] = np.maximum(worst[chosen], np.linalg.norm(shift, axis=1))
    return worst


def planar_only(task):
    """The same task where arcs lie in a plane that the program selects."""
    n = len(task.toolpath)
    return replace(
        task, toolpath=replace(task.toolpath, arcs=replace(task.toolpath.arcs, plane_free=np.zeros(n, bool)))
    )


def error_in_even_pieces(task, division, count):
    """The error of the one cut in ``count`` even pieces, whatever it is."""
    return path_errors(task, in_even_pieces(task, division, 2, count))[0].max()


@pytest.mark.sample(2)
@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("build", [line, circle], ids=["800 mm line", "600 mm circle"])
def test_points_are_inserted_where_the_ends_are_not_enough(build, planar, capsys):
    task = planar_only(build()) if planar else build()
    least = 1 if build is line else 2
    _, division = divided(task)
    ends_only = error_in_even_pieces(task, division, least)
    assert ends_only > 0.05 * MM
    ours = int(np.sum((division.source == 2) & ~division.transitions))
    assert dense(task, division).max() <= task.tolerance

    # two others: halving, and a fixed distance that suffices wherever the same force may act
    halved = least
    while error_in_even_pieces(task, division, halved) > ROOM * task.tolerance:
        halved *= 2
    length = task.desired_path.length[2]
    fixed = next(
        step for step in (100, 50, 40, 30, 25, 20, 15, 10, 5, 2, 1)
        if error_in_even_pieces(task, division, int(np.ceil(length / (step * MM)))) <= ROOM * task.tolerance
    )  # fmt: skip
    stepped = int(np.ceil(length / (fixed * MM)))
    with capsys.disabled():
        print(
            f"\n{build.__name__}, arcs {'in their plane' if planar else 'free'}: end points alone"
            f" {ends_only / MM:.4f} mm; pieces: {ours} (smallest number), {halved} (halving),"
            f" {stepped} (every {fixed} mm)"
        )
    assert ours <= halved
    assert ours <= stepped
    assert ours == least or error_in_even_pieces(task, division, ours - 1) > ROOM * task.tolerance


def test_error_falls_with_the_square_of_the_length_on_lines():
    task = line()
    _, division = divided(task)
    errors = [error_in_even_pieces(task, division, count) for count in (4, 8, 16)]
    rate = np.log2(errors[0] / errors[1]), np.log2(errors[1] / errors[2])
    assert rate == pytest.approx((2.0, 2.0), abs=0.1)


def test_a_loose_tolerance_inserts_nothing():
    task = replace(line(tolerance=10e-3), tolerance_angle=0.1)
    _, division = divided(task)
    assert division.inserted == 0
    assert np.array_equal(division.source, np.arange(4))


def test_a_cut_begins_and_ends_with_its_own_correction():
    task = line()
    result, division = divided(task)
    (link,) = np.flatnonzero(division.transitions)
    assert division.source[link] == 2
    assert division.role[link + 1] != Role.TRANSITION
    # the tool is at the begin of the way when the force is on, and where it was programmed when it is off
    row = np.array([2])
    real = task.simulated(row, division.command[[link]], task.force.along(row, np.zeros(1))).pose.position
    goal = task.goal(row, task.desired_path.start[row]).position
    assert np.linalg.norm(real - goal) < 1e-7
    assert np.array_equal(division.command.position[link - 1], task.wanted.position[1])
    assert np.array_equal(division.command.position[-1], task.wanted.position[3])
    own = np.flatnonzero(division.original)[2]
    np.testing.assert_array_equal(division.command.position[own], result.command.position[2])


def test_a_corner_gets_a_point_for_each_side():
    task = corner()
    _, division = divided(task)
    assert division.source[division.transitions].tolist() == [2, 3]
    assert dense(task, division).max() <= task.tolerance
    _, without = divided(task, replace(FREE, no_insert=True))
    assert without.inserted == 0
    assert dense(task, without).max() > 0.1 * MM


def test_where_nothing_may_be_inserted_nothing_is():
    task = corner(no_insert_before={3: "a TRIGGER"})
    _, division = divided(task)
    assert division.source[division.transitions].tolist() == [2]
    assert np.sum(division.source == 3) == 1


def test_no_piece_is_shorter_than_the_shortest():
    task = line()
    _, division = divided(task, replace(FREE, min_segment=0.3))
    assert np.sum((division.source == 2) & ~division.transitions) == 2
    assert dense(task, division).max() > task.tolerance


def test_the_limit_of_growth_is_told():
    task = line()
    _, division = divided(task, replace(FREE, max_growth=1.5))
    assert len(division) <= 6
    assert [finding.code for finding in division.findings] == ["COR014"]


def test_half_a_correction_has_the_points_of_the_whole():
    full, half = circle(), circle(gain=0.5)
    whole, part = divided(full)[1], divided(half)[1]
    np.testing.assert_array_equal(whole.source, part.source)
    np.testing.assert_array_equal(whole.role, part.role)
    ways = full.desired_path.at(whole.source[1:], whole.share[1:]).position
    away = whole.command.position[1:] - ways
    np.testing.assert_allclose(part.command.position[1:] - ways, 0.5 * away, atol=1e-12)
    arcs = np.isfinite(whole.sweep)
    assert np.array_equal(np.isfinite(part.sweep), arcs)
    assert np.all(np.abs(part.sweep[arcs] - whole.sweep[arcs]) < 0.05)


def test_arcs_in_their_plane_keep_their_normal_and_advance():
    task = planar_only(circle(sweep=4.0, rise=0.05))
    _, division = divided(task)
    arcs = np.isfinite(division.sweep)
    assert arcs.sum() >= 1
    np.testing.assert_array_equal(division.normal[arcs], np.tile([0.0, 0.0, 1.0], (arcs.sum(), 1)))
    assert dense(task, division).max() <= task.tolerance
    # begin, end and centre are those of one circle, seen along the normal
    pieces = subdivided_motions(task, division, np.flatnonzero(arcs))
    out = [np.linalg.norm((p.position - pieces.centre)[:, :2], axis=1) for p in (pieces.start, pieces.end)]
    np.testing.assert_allclose(out[0], out[1], atol=1e-12)


def test_an_arc_in_air_begins_where_it_was_programmed():
    task = circle(sweep=1.0)
    carries = np.array([False, True, False, False])
    wrench = np.where(carries[:, None], [300.0, 300.0, 300.0, 0.0, 0.0, 0.0], 0.0)
    force = replace(task.force, carries=carries, values=wrench, start=wrench)
    task = replace(task, force=force)
    _, division = divided(task)
    back = np.flatnonzero(division.transitions & (division.source == 2))
    assert len(back) == 1
    np.testing.assert_array_equal(division.command.position[back[0]], task.wanted.position[1])
    assert np.isnan(division.sweep).all()


def test_a_nearly_full_circle_that_can_not_be_divided_is_held():
    task = circle(no_insert_before={2: "runs many times"})
    _, division = divided(task)
    assert [finding.code for finding in division.not_refined.values()] == ["COR013"]


def test_pieces_of_a_straight_way_are_where_they_are_asked_for():
    task = line()
    rows, zero = np.array([2]), np.zeros(1)
    half = PathSegments.straight(
        rows, zero, zero + 1, task.desired_path.start[rows], task.desired_path.end[rows]
    ).at(zero + 0.5)
    np.testing.assert_allclose(half.position[0], [1.6, 0.0, 0.5], atol=1e-12)


# ways that need no look


def looked_at(task, result, monkeypatch):
    """The rows of all pieces at whose errors a division looks, and the division."""
    seen = []
    errors = divisible_motions.path_errors
    with monkeypatch.context() as watched:
        watched.setattr(
            divisible_motions,
            "path_errors",
            lambda task, pieces, *more: seen.extend(pieces.rows.tolist()) or errors(task, pieces, *more),
        )
        division = subdivide(task, result, FREE)
    return seen, division


def in_steps(points, length=0.8, **words):
    """A straight cut across the workspace by ``points`` that follow one another."""
    along = np.linspace(-0.5, 0.5, points) * length
    places = np.stack([np.full(points, 1.6), along, np.full(points, 0.5)], axis=1)
    return task_to(places, np.arange(points) > 0, **words)


def test_ways_on_which_the_correction_hardly_changes_are_not_looked_at(monkeypatch):
    task = in_steps(1601, 0.4)
    seen, division = looked_at(task, correct(task), monkeypatch)
    # the first one begins where nothing is corrected
    assert len(seen) <= 2
    assert division.inserted <= 1


@pytest.mark.parametrize("points", [801, 3201])
def test_what_is_not_looked_at_is_within_the_tolerance(points):
    task = in_steps(points)
    result, division = divided(task)
    changed = np.linalg.norm(np.diff(result.correction, axis=0), axis=1)[1:]
    worst = dense(task, division, 5)
    skipped = np.flatnonzero(changed <= STEP * task.tolerance) + 2
    assert len(skipped) > 0.2 * points
    own = np.isin(division.source, skipped)
    assert worst[own].max() < STEP * task.tolerance


def test_a_long_way_is_looked_at_even_if_the_correction_is_the_same_at_both_ends(monkeypatch):
    task = in_steps(3)
    alike = replace(correct(task), correction=np.full((3, 3), 1e-3), turn=np.full((3, 3), 1e-3))
    assert set(looked_at(task, alike, monkeypatch)[0]) == {1, 2}


@pytest.mark.parametrize(
    "change",
    [
        lambda task: replace(task, tolerance=1e-7),
        lambda task: replace(task, tolerance_angle=1e-9),
        lambda task: replace(task, toolpath=task.toolpath.with_columns(tool=np.arange(401) % 2)),
        lambda task: replace(task, track=replace(task.track, q=task.track.q * 1000.0)),
    ],
    ids=["position", "angle", "tool", "axes"],
)
def test_each_condition_of_an_even_way_counts(change, monkeypatch):
    task = in_steps(401, 0.1)
    result = correct(task)
    assert set(looked_at(task, result, monkeypatch)[0]) == {1}
    assert set(looked_at(change(task), result, monkeypatch)[0]) >= set(range(201, 401))


def test_a_way_that_begins_with_a_step_is_looked_at(monkeypatch):
    start = np.tile(FORCE, (401, 1))
    start[[8, 10]] *= 0.5
    task = in_steps(401, 0.1, start=start)
    assert set(looked_at(task, correct(task), monkeypatch)[0]) == {1, 8, 10}
