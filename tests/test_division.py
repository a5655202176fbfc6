"""The way between corrected points: links, points on lines and arcs, and what limits them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ways_at_work import circle, corner, line
from ways_at_work import task as task_to

import postproc.compensation.division as division_module
from postproc.compensation.between import Pieces, errors_between
from postproc.compensation.correct import correct
from postproc.compensation.division import ROOM, STEP, Limits, _Search, divide, made
from postproc.toolpath import Role
from postproc.units import MM

FREE = Limits(max_growth=100.0)


def divided(task, limits=FREE):
    result = correct(task)
    return result, divide(task, result, limits)


def dense(task, division, samples=41):
    """(M,) [m] the largest distance from the wanted way inside of each motion, at ``samples`` shares of each."""
    pieces = made(task, division, np.arange(len(division)))
    chosen = np.flatnonzero(~division.links & np.isin(division.source, np.flatnonzero(task.carries)))
    worst = np.zeros(len(division))
    for share in np.linspace(0, 1, samples):
        part = pieces[chosen]
        along = part.first + share * (part.last - part.first)
        wanted = task.ways.at(part.rows, along)
        here = part.at(np.full(len(chosen), share))
        real = task.real(part.rows, here, task.force.along(part.rows, along)).pose
        shift = real.position - task.goal(part.rows, wanted).position
        along = task.ways.tangent(part.rows, along)
        shift -= np.sum(shift * along, axis=1, keepdims=True) * along
        worst[chosen] = np.maximum(worst[chosen], np.linalg.norm(shift, axis=1))
    return worst


def planar_only(task):
    """The same task where arcs lie in a plane that the program selects."""
    n = len(task.toolpath)
    return replace(task, toolpath=replace(task.toolpath, any_plane=np.zeros(n, bool)))


def in_even_pieces(task, count):
    """The error of a way in ``count`` even pieces, whatever it is."""
    result = correct(task)
    search = _Search(task, result, FREE)
    search.link()
    pieces, _ = search._pieces(np.arange(1), np.array([count]))
    return errors_between(task, pieces)[0].max()


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("build", [line, circle], ids=["800 mm line", "600 mm circle"])
def test_points_are_inserted_where_the_ends_are_not_enough(build, planar, capsys):
    task = planar_only(build()) if planar else build()
    least = 1 if build is line else 2
    ends_only = in_even_pieces(task, least)
    assert ends_only > 0.05 * MM
    _, division = divided(task)
    ours = int(np.sum((division.source == 2) & ~division.links))
    assert dense(task, division).max() <= task.tolerance

    # two others: halving, and a fixed distance that suffices wherever the same force may act
    halved = least
    while in_even_pieces(task, halved) > ROOM * task.tolerance:
        halved *= 2
    length = task.ways.length[2]
    fixed = next(
        step for step in (100, 50, 40, 30, 25, 20, 15, 10, 5, 2, 1)
        if in_even_pieces(task, int(np.ceil(length / (step * MM)))) <= ROOM * task.tolerance
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
    assert ours == least or in_even_pieces(task, ours - 1) > ROOM * task.tolerance


def test_error_falls_with_the_square_of_the_length_on_lines():
    task = line()
    errors = [in_even_pieces(task, count) for count in (4, 8, 16)]
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
    (link,) = np.flatnonzero(division.links)
    assert division.source[link] == 2
    assert division.role[link + 1] != Role.LINK
    # the tool is at the begin of the way when the force is on, and where it was programmed when it is off
    row = np.array([2])
    real = task.real(row, division.command[[link]], task.force.along(row, np.zeros(1))).pose.position
    goal = task.goal(row, task.ways.begin[row]).position
    assert np.linalg.norm(real - goal) < 1e-7
    assert np.array_equal(division.command.position[link - 1], task.wanted.position[1])
    assert np.array_equal(division.command.position[-1], task.wanted.position[3])
    own = np.flatnonzero(division.own)[2]
    np.testing.assert_array_equal(division.command.position[own], result.command.position[2])


def test_a_corner_gets_a_point_for_each_side():
    task = corner()
    _, division = divided(task)
    assert division.source[division.links].tolist() == [2, 3]
    assert dense(task, division).max() <= task.tolerance
    _, without = divided(task, replace(FREE, keep=True))
    assert without.inserted == 0
    assert dense(task, without).max() > 0.1 * MM


def test_where_nothing_may_be_inserted_nothing_is():
    task = corner(whole={3: "a TRIGGER"})
    _, division = divided(task)
    assert division.source[division.links].tolist() == [2]
    assert np.sum(division.source == 3) == 1


def test_no_piece_is_shorter_than_the_shortest():
    task = line()
    _, division = divided(task, replace(FREE, min_segment=0.3))
    assert np.sum((division.source == 2) & ~division.links) == 2
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
    ways = full.ways.at(whole.source[1:], whole.share[1:]).position
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
    pieces = made(task, division, np.flatnonzero(arcs))
    out = [np.linalg.norm((p.position - pieces.centre)[:, :2], axis=1) for p in (pieces.begin, pieces.end)]
    np.testing.assert_allclose(out[0], out[1], atol=1e-12)


def test_an_arc_in_air_begins_where_it_was_programmed():
    task = circle(sweep=1.0)
    carries = np.array([False, True, False, False])
    wrench = np.where(carries[:, None], [300.0, 300.0, 300.0, 0.0, 0.0, 0.0], 0.0)
    force = replace(task.force, carries=carries, values=wrench, start=wrench)
    task = replace(task, force=force)
    _, division = divided(task)
    back = np.flatnonzero(division.links & (division.source == 2))
    assert len(back) == 1
    np.testing.assert_array_equal(division.command.position[back[0]], task.wanted.position[1])
    assert np.isnan(division.sweep).all()


def test_a_nearly_full_circle_that_can_not_be_divided_is_held():
    task = circle(whole={2: "runs many times"})
    _, division = divided(task)
    assert [finding.code for finding in division.held.values()] == ["COR013"]


def test_pieces_of_a_straight_way_are_where_they_are_asked_for():
    task = line()
    rows, zero = np.array([2]), np.zeros(1)
    half = Pieces.straight(rows, zero, zero + 1, task.ways.begin[rows], task.ways.end[rows]).at(zero + 0.5)
    np.testing.assert_allclose(half.position[0], [1.6, 0.0, 0.5], atol=1e-12)


# ways that need no look


def looked_at(task, monkeypatch):
    """How many pieces the search looks at, for the motions of the input."""
    seen = []
    errors = division_module.errors_between
    monkeypatch.setattr(
        division_module,
        "errors_between",
        lambda task, pieces, *more: seen.append(len(pieces)) or errors(task, pieces, *more),
    )
    _, division = divided(task)
    return sum(seen), division


def in_steps(points, length=0.8, **words):
    """A straight cut across the workspace by ``points`` that follow one another."""
    along = np.linspace(-0.5, 0.5, points) * length
    places = np.stack([np.full(points, 1.6), along, np.full(points, 0.5)], axis=1)
    return task_to(places, np.arange(points) > 0, **words)


def test_ways_on_which_the_correction_hardly_changes_are_not_looked_at(monkeypatch):
    seen, division = looked_at(in_steps(1601, 0.4), monkeypatch)
    # the first one begins where nothing is corrected
    assert seen <= 2
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


def test_a_long_way_is_looked_at_even_if_the_correction_is_the_same_at_both_ends():
    task = in_steps(3)
    full = correct(task)
    alike = replace(full, correction=np.full((3, 3), 1e-3), turn=np.full((3, 3), 1e-3))
    search = _Search(task, replace(alike, state=full.state), FREE)
    search.start_at[:] = -1
    assert not search._even().any()


@pytest.mark.parametrize(
    "change",
    [
        lambda task: replace(task, tolerance=1e-7),
        lambda task: replace(task, tolerance_angle=1e-9),
        lambda task: replace(task, toolpath=replace(task.toolpath, tool=np.arange(401) % 2)),
        lambda task: replace(task, track=replace(task.track, q=task.track.q * 1000.0)),
    ],
    ids=["position", "angle", "tool", "axes"],
)
def test_each_condition_of_an_even_way_counts(change):
    task = in_steps(401, 0.1)
    result = correct(task)
    search = _Search(task, result, FREE)
    search.start_at[:] = -1
    assert search._even()[1:].all()
    assert not search._even()[0]
    other = _Search(change(task), result, FREE)
    other.start_at[:] = -1
    assert not other._even()[200:].any()


def test_a_way_that_begins_with_a_step_is_not_even():
    task = in_steps(401, 0.1)
    search = _Search(task, correct(task), FREE)
    search.start_at[:] = -1
    search.start_at[[7, 9]] = 0, 3
    assert np.flatnonzero(~search._even()).tolist() == [0, 7, 9]
