"""What an output does where its correction changes, and which cuts are no better than before: by closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, corrected, output, spring, with_ramp

from postproc.compensation.path_comparison import (
    across_feed,
    along_and_across,
    cuts_not_improved,
    errors_between_as_programmed,
    errors_inside,
    evaluate_transitions,
)
from postproc.toolpath import EditConstraints, Role

ACROSS = 1e-6
COMPLIANCE = np.zeros((3, 3))
COMPLIANCE[1, 0] = ACROSS


def line(lengths, **words):
    x = np.concatenate([[0.0], np.cumsum(lengths)]) - 0.5 * np.sum(lengths)
    points = np.stack([x, 0 * x, 0 * x], axis=1) * MM
    words = {"approximation": np.zeros(len(x))} | words
    return spring(points, [False] + [True] * len(lengths), **words)


def test_the_rate_of_a_correction_is_its_change_over_the_path():
    """Of each motion by itself, inserted points included, and at the feed of that motion; the largest at its line."""
    job = line([10, 40, 20, 30])
    job = replace(job, toolpath=job.toolpath.with_columns(feed=np.array([0.1, 0.1, 0.1, 0.02, 0.3])))
    shifts = np.array([[0, 0, 0], [0, 0, 0], [0, 0.4, 0.3], [0, 0.4, -0.1], [0, 0.1, -0.1]]) * MM
    found = evaluate_transitions(job, corrected(job, shifts), output(job, shifts))
    rates = np.array([0.5 / 40, 0.4 / 20, 0.3 / 30])
    assert found.rate == pytest.approx(rates.max())
    assert found.rate_line == job.toolpath.line[3]
    assert found.speed == pytest.approx((rates * [0.1, 0.02, 0.3]).max())
    assert (found.backwards, found.stops, found.lead_ins) == (0, 0, 0)
    division = output(job, shifts, [(3, 0.9, [0, 0.4 * MM, 0.2 * MM], 0.0)])
    more = evaluate_transitions(job, corrected(job, shifts), division)
    assert more.rate == pytest.approx(0.3 / 2)
    assert more.speed == pytest.approx(0.3 / 2 * 0.02)
    # what is not corrected does not count, nor does a motion that is not known
    state = corrected(job, shifts).state
    state[3] = 2
    less = evaluate_transitions(job, replace(corrected(job, shifts), state=state), output(job, shifts))
    assert less.rate == pytest.approx(0.5 / 40)
    assert less.rate_line == job.toolpath.line[2]
    none = evaluate_transitions(job, replace(corrected(job, shifts), state=0 * state), output(job, shifts))
    assert (none.rate, none.backwards) == (0.0, 0)
    assert np.isnan(none.speed)
    unknown = replace(
        job, toolpath=job.toolpath.with_columns(feed=np.array([np.nan, 0.1, np.nan, np.nan, 0.3]))
    )
    assert evaluate_transitions(unknown, corrected(job, shifts), output(job, shifts)).speed == pytest.approx(
        0.3 * 0.01
    )


def test_motions_that_lead_back_against_the_feed_are_counted():
    """A point that is moved beyond the one after it makes one; that it comes too far before makes none."""
    job = line([10, 5, 1, 5, 20])
    none = np.zeros((6, 3))
    for along, backwards in ((0.9, 0), (1.1, 1), (-4.9, 0), (-5.1, 1)):
        shifts = none.copy()
        shifts[2, 0] = along * MM
        assert evaluate_transitions(job, corrected(job, shifts), output(job, shifts)).backwards == backwards


def test_stops_are_transition_moves_inside_of_cuts_and_exact_inserted_points():
    job = line([10, 20, 20, 20])
    none = np.zeros((5, 3))
    division = output(job, none, [(2, 0.5, [0, 0, 0], 0.0), (3, 0.5, [0, 0, 0], 0.0)])
    result = corrected(job, none)
    assert evaluate_transitions(job, result, division).stops == 0  # of exact motions nothing is stated
    stays = replace(job, toolpath=replace(job.toolpath, constraints=EditConstraints(exact_stays=True)))
    assert evaluate_transitions(stays, result, division).stops == 2
    flows = line([10, 20, 20, 20], approximation=np.full(5, 1 * MM))
    assert evaluate_transitions(flows, result, division).stops == 0
    inserted = np.full(5, np.nan)
    inserted[3] = 0.0
    stated = replace(
        job, toolpath=replace(job.toolpath, constraints=EditConstraints(inserted_approximation=inserted))
    )
    assert evaluate_transitions(stated, result, division).stops == 1
    role = division.role.copy()
    role[np.flatnonzero(division.share < 1.0)] = Role.TRANSITION
    moves = replace(division, role=role)
    assert evaluate_transitions(flows, result, moves).stops == 2
    cut = np.array([-1, 0, 0, 1, 1])  # the second one leads into a cut
    assert evaluate_transitions(flows, replace(result, cut=cut), moves).stops == 1
    cut = np.array([-1, -1, -1, 0, 0])
    assert evaluate_transitions(flows, replace(result, cut=cut), moves).stops == 0
    assert evaluate_transitions(flows, result, replace(moves, lead_ins=np.array([0, 2]))).lead_ins == 2


def test_errors_have_a_part_along_the_feed_and_one_across():
    job = line([10, 40, 20, 30])
    error = np.array([[0.3, 0.4, 0.0], [-0.5, 0.0, 1.2], [0.0, 0.0, 0.0]])
    along, across = across_feed(job, np.array([1, 2, 4]), error)
    np.testing.assert_allclose(along, [0.3, -0.5, 0.0])
    np.testing.assert_allclose(across, [0.4, 1.2, 0.0])
    turns = spring(np.array([[0, 0, 0], [10, 0, 0], [10, 0, 0]]) * MM, [False, True, True])
    along, across = across_feed(turns, np.array([2]), error[:1])
    assert (along[0], across[0]) == (0.0, pytest.approx(0.5))
    deflection = np.full((5, 3), np.nan)
    deflection[[1, 2, 4]] = error
    result = replace(corrected(job, np.zeros((5, 3))), deflection=deflection)
    found = along_and_across(job, result)
    np.testing.assert_allclose(found[0], [np.nan, 0.3, -0.5, np.nan, 0.0], rtol=1e-6)
    np.testing.assert_allclose(found[1], [np.nan, 0.4, 1.2, np.nan, 0.0], rtol=1e-6)


def two_cuts(job, **values):
    """Results of the cuts 0 (rows 1, 2) and 1 (rows 3, 4); numbers (5,) [um], [urad]."""
    result = corrected(job, np.zeros((5, 3)))
    plain = {
        "before": np.full(5, 100.0),
        "after": np.full(5, 5.0),
        "before_angle": np.zeros(5),
        "after_angle": np.zeros(5),
    }
    plain["across_after"] = plain["after"]
    for name, some in values.items():
        plain[name] = plain[name].copy()
        for row, value in some.items():
            plain[name][row] = value
    return replace(
        result, cut=np.array([-1, 0, 0, 1, 1]), **{name: 1e-6 * value for name, value in plain.items()}
    )


def worse(job, between=(5.0,) * 5, before=(100.0,) * 5, division=None, **values):
    result = two_cuts(job, **values)
    division = output(job, np.zeros((5, 3))) if division is None else division
    return cuts_not_improved(job, result, division, 1e-6 * np.array(between), 1e-6 * np.array(before))


def test_a_cut_is_worse_that_is_farther_off_than_before():
    """By more than the digits of a program, 1 um; at its points or between them; it alone, at its first row."""
    job = line([10, 20, 30, 40])
    assert worse(job) == {}
    for row, first in ((1, 1), (2, 1), (3, 3), (4, 3)):
        for size, told in ((100.5, False), (101.5, True)):
            between = np.full(5, 5.0)
            between[row] = size
            found = worse(job, between)
            assert list(found) == ([first] if told else [])
            if told:
                assert found[first].line == job.toolpath.line[first]
                assert "0.1015 mm off and 0.1000 without" in found[first].message
            at_points = worse(job, across_after={row: size})
            assert list(at_points) == ([first] if told else [])
    # before it was as far off at any of its points
    between = np.array([5.0, 150.0, 5.0, 5.0, 5.0])
    assert worse(job, between, before=[0.0, 100.0, 160.0, 100.0, 100.0]) == {}
    assert list(worse(job, between, before=[900.0, 100.0, 100.0, 160.0, 160.0])) == [1]
    # a transition move leads there, it is no part of the cut
    division = output(job, np.zeros((5, 3)), [(1, 0.5, [0, 0, 0], 0.0)])
    role = division.role.copy()
    role[1] = Role.TRANSITION
    assert worse(job, [5.0, 500.0, 5.0, 5.0, 5.0, 5.0], division=replace(division, role=role)) == {}
    assert list(worse(job, [5.0, 500.0, 5.0, 5.0, 5.0, 5.0], division=division)) == [1]
    # what is in air, or not corrected, leaves nothing to compare
    state = two_cuts(job).state
    state[3:] = 2
    only = cuts_not_improved(job, replace(two_cuts(job, after={1: 300.0, 2: 300.0, 3: 300.0}), state=state),
                             output(job, np.zeros((5, 3))), np.zeros(5), np.full(5, 1e-4))  # fmt: skip
    assert list(only) == [1]


def test_a_cut_is_worse_whose_points_are_on_the_whole_no_nearer():
    """By the mean square of all its points: one may be worse where others are better."""
    job = line([10, 20, 30, 40])
    assert worse(job, after={3: 120.0, 4: 60.0}) == {}
    assert list(worse(job, after={3: 120.0, 4: 90.0})) == [3]
    assert list(worse(job, after={1: 101.0, 2: 100.0})) == [1]
    assert list(worse(job, after={1: 100.0, 2: 100.0})) == [1]  # no better is worse
    assert worse(job, after={1: 99.9, 2: 100.0}) == {}


def test_a_cut_is_worse_that_is_turned_more_than_before():
    job = line([10, 20, 30, 40])
    allowed = 1e6 * job.tolerance_angle
    for row, first in ((1, 1), (4, 3)):
        assert worse(job, after_angle={row: 0.99 * allowed}) == {}
        found = worse(job, after_angle={row: 1.01 * allowed})
        assert list(found) == [first]
        assert "orientation" in found[first].message
        assert worse(job, after_angle={row: 1.01 * allowed}, before_angle={row: 0.02 * allowed}) == {}


def test_a_path_that_was_worse_between_its_points_is_compared_with_that():
    """The force is that of the motion after its first 2 mm: at the points before the correction nothing is off."""
    job = line([10, 20, 30, 40], compliance=COMPLIANCE, force=np.array([[0.0] * 3] * 3 + [[200.0, 0, 0]] * 2))
    job = with_ramp(job, [3], [[200.0, 0, 0]], [2 * MM])
    np.testing.assert_allclose(
        errors_between_as_programmed(job, np.array([1, 2, 3, 4])), [0, 0, 2e-4, 2e-4], atol=1e-12
    )
    between = [5.0, 5.0, 5.0, 150.0, 5.0]
    assert worse(job, between) == {}
    found = worse(job, [5.0, 5.0, 5.0, 250.0, 5.0])
    assert list(found) == [3]
    assert "0.2500 mm off and 0.2000 without" in found[3].message
    assert "force_ramp" in found[3].help
    early = worse(job, [5.0, 250.0, 5.0, 5.0, 5.0])
    assert list(early) == [1]
    assert "force_ramp" not in early[1].help
    rows, errors = errors_inside(job)
    assert len(rows) == len(errors) == 0  # a step that goes over is no profile of its motion
    ramps = replace(job.force.ramps, inside=np.ones(len(job.force.ramps.row), bool))
    profiled = replace(job, force=replace(job.force, ramps=ramps))
    rows, errors = errors_inside(profiled)
    assert rows.tolist() == [3]
    np.testing.assert_allclose(errors, [2e-4], atol=1e-12)
    # of a force between the points alone these say nothing, where the path itself is nearer
    two = two_cuts(profiled, before={3: 1.0, 4: 1.0})
    args = output(profiled, np.zeros((5, 3))), np.full(5, 5e-6), np.full(5, 1e-4)
    assert cuts_not_improved(profiled, two, *args) == {}
    assert list(cuts_not_improved(job, two_cuts(job, before={3: 1.0, 4: 1.0}), *args)) == [3]
    # nor where the path is as far off as it was, to the digits of a program
    as_far = (
        output(profiled, np.zeros((5, 3))),
        np.array([5.0, 5.0, 5.0, 200.5, 5.0]) * 1e-6,
        np.full(5, 1e-4),
    )
    assert list(cuts_not_improved(profiled, two, *as_far)) == [3]
