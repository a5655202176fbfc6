"""The play operator: a joint behind a gap, in the order of the path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.effects.play import play_output, share

GAP = np.array([0.3, 1.0, 2.5])


def walk(count, seed):
    return np.cumsum(np.random.default_rng(seed).normal(size=(count, 3)), axis=0)


def one_by_one(motor, gap, anew):
    """The definition, sample by sample."""
    gap, joint = np.broadcast_to(gap, motor.shape), np.empty_like(motor)
    here = motor[0]
    for k, (x, g) in enumerate(zip(motor, gap, strict=True)):
        here = x if anew[k] else np.minimum(np.maximum(here, x - g / 2), x + g / 2)
        joint[k] = here
    return joint


@given(st.integers(1, 400), st.integers(0, 2**32 - 1), st.booleans())
@settings(deadline=None, max_examples=examples(60))
def test_it_is_the_recursion_that_defines_it(count, seed, varying):
    rng = np.random.default_rng(seed)
    motor, anew = walk(count, seed), rng.random(count) < 0.05
    gap = rng.uniform(0.2, 2.0, (count, 3)) if varying else GAP
    assert np.array_equal(play_output(motor, gap, anew), one_by_one(motor, gap, anew))


def test_of_nothing():
    assert play_output(np.empty((0, 3)), GAP, np.empty(0, bool)).shape == (0, 3)


def test_places_on_the_way_change_nothing():
    motor = walk(200, 1)
    part = np.linspace(0, 1, 5)[1:, None, None]
    dense = (motor[:-1] + part * np.diff(motor, axis=0)).swapaxes(0, 1).reshape(-1, 3)
    dense = np.concatenate([motor[:1], dense])
    none = np.zeros(len(dense), bool)
    np.testing.assert_allclose(
        play_output(dense, GAP, none)[::4], play_output(motor, GAP, none[:200]), atol=1e-12
    )


def test_gaps_in_series_are_one_gap():
    motor, none = walk(500, 2), np.zeros(500, bool)
    twice = play_output(play_output(motor, 0.4 * GAP, none), 0.6 * GAP, none)
    np.testing.assert_allclose(twice, play_output(motor, GAP, none), atol=1e-12)


def test_the_joint_stands_until_the_gap_is_crossed():
    motor = np.array([0.0, 1.0, 0.7, 0.4, 0.2, 0.0, -1.0])[:, None]
    joint = play_output(motor, np.array([0.6]), np.zeros(7, bool))
    np.testing.assert_allclose(joint[:, 0], [0.0, 0.7, 0.7, 0.7, 0.5, 0.3, -0.7])
    np.testing.assert_allclose(
        share(motor, joint, np.array([0.6]))[:, 0], [0, 1, 0, -1, -1, -1, -1], atol=1e-12
    )


@pytest.mark.parametrize("size", [1e-3, 1e-2, 0.1])
def test_a_step_moves_the_share_by_twice_its_part_of_the_gap(size):
    """Rounding of a thousandth of the gap moves the side by two thousandths, and does not throw it over."""
    motor = np.concatenate([[0.0, 5.0], 5.0 + size * np.where(np.arange(100) % 2, 0.0, -1.0)])[:, None]
    side = share(motor, play_output(motor, np.array([1.0]), np.zeros(102, bool)), np.array([1.0]))
    assert np.abs(np.diff(side[1:, 0])).max() == pytest.approx(2 * size)
    assert side[1:].min() == pytest.approx(1 - 2 * size)


def test_where_nothing_is_known_it_begins_in_the_middle():
    motor = np.array([0.0, 5.0, 6.0, 6.1])[:, None]
    joint = play_output(motor, np.array([1.0]), np.array([False, False, True, False]))
    np.testing.assert_allclose(share(motor, joint, np.array([1.0]))[:, 0], [0.0, 1.0, 0.0, 0.2])
