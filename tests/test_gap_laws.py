"""Laws of gaps and of what is shared out: sides that hold, and budgets that are spent on the largest needs."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensation.gap_sides import GapSides, MotorPath, Reversals
from postproc.compensation.refinement import allocate


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("spacing", [1e-6, 0.02, 0.4])
def test_a_side_holds_until_the_band_is_crossed_in_the_other_sense(seed, spacing):
    """Walked by hand: far from every change the side is that which was crossed last, before all the first one."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.5, 1.5, 6)
    line = MotorPath.of(lengths)
    position = np.sort(rng.uniform(0.0, lengths.sum(), 60))
    shares = np.clip(1.6 * np.sin(3.0 * position[:, None] + rng.uniform(0, 6, 3)), -1.0, 1.0)
    shares[:, 2] = 0.3 * shares[:, 2]  # never crosses its band
    turns = Reversals.of(line, position, shares, np.arange(60) == 0, np.full(6, spacing))
    assert (np.diff(turns.axis) >= 0).all()
    for axis in range(3):
        own = turns.axis == axis
        since, until = turns.since[own], turns.until[own]
        assert (until > since - 1e-12).all()
        assert (until[:-1] <= since[1:] + 1e-12).all()
        np.testing.assert_array_equal(turns.old[own], -turns.new[own])
        np.testing.assert_array_equal(turns.old[own][1:], turns.new[own][:-1])
        crossed = np.flatnonzero(np.abs(shares[:, axis]) > 1.0 - 1e-9)
        if axis == 2:
            assert not own.any()
            assert turns.first[2] == 0.0
            continue
        side = np.sign(shares[crossed, axis])
        assert turns.first[axis] == side[0]
        rows, along = line.place(position)
        found = turns.at(rows, along)[:, axis]
        before = np.searchsorted(crossed, np.arange(60), "right") - 1
        expected = side[np.maximum(before, 0)]
        near = np.abs(
            position[:, None] - np.concatenate([since, until, position[crossed[1:][side[1:] != side[:-1]]]])
        )
        clear = near.min(axis=1, initial=np.inf) > 2.0 * spacing + 1e-9
        inside = ((position[:, None] >= since) & (position[:, None] <= until)).any(axis=1)
        agree = found[clear & ~inside] == expected[clear & ~inside]
        assert agree.all()
        end = turns.at(np.array([5]))[0, axis]
        assert end == side[-1] or (until > lengths.sum() - 2 * spacing).any()


@pytest.mark.parametrize("times", [1, 2, 3, 4, 5])
def test_to_and_fro_within_the_spacing_counts_by_its_parity(times):
    line = MotorPath.of(np.full(3, 1.0))
    position = np.array([0.5, *(2.0 + 1e-5 * np.arange(times + 1)), 2.6])
    side = np.array([1.0, *((-1.0) ** np.arange(times + 1)), 0.0])
    side[-1] = side[-2]
    turns = Reversals.of(line, position, side[:, None], np.arange(len(side)) == 0, np.full(3, 0.1))
    assert turns.at(np.array([2]))[0, 0] == side[-1]
    assert turns.at(np.array([0]))[0, 0] == 1.0
    if times % 2 == 0:
        assert not len(turns.axis)


def walked(motors, gap):
    joint, found = motors[0], []
    for motor in motors:
        joint = min(max(joint, motor - gap / 2), motor + gap / 2)
        found.append((motor - joint) / (gap / 2))
    return np.array(found)


@pytest.mark.parametrize("seed", range(4))
def test_between_two_stations_a_motor_goes_evenly(seed):
    """Anywhere on three motions: the walk over many places of the line through the stations."""
    rng = np.random.default_rng(seed)
    share = np.sort(rng.uniform(0.05, 0.95, (3, 3)), axis=1)
    share[:, -1] = 1.0
    key = (2.0 * np.arange(3)[:, None] + share).ravel()
    motor = np.cumsum(rng.normal(size=9))
    gap = np.array([0.8])
    sides = GapSides.of(key, motor[:, None], gap, np.arange(9) == 0)
    places = np.linspace(0.0, 1.0, 401)[1:]
    rows, along = np.repeat(np.arange(3), 400), np.tile(places, 3)
    # a motion starts where the one before it ended
    line = np.repeat(np.arange(3), 3) + share.ravel()
    at = np.interp(rows + along, line, motor)
    first = rows + along >= line[0]
    expected = walked(np.concatenate([motor[:1], at[first]]), 0.8)[1:]
    np.testing.assert_allclose(sides.at(rows[first], along[first])[:, 0], expected, atol=0.03)
    np.testing.assert_allclose(sides.at(np.arange(3))[:, 0], sides.shares[[2, 5, 8], 0], atol=1e-12)
    inside = np.unique(np.repeat(np.arange(3), 3)[np.abs(sides.shares[:, 0]) < 1 - 1e-6])
    np.testing.assert_array_equal(sides.inside(np.array([True])), inside)
    assert len(sides.inside(np.array([False]))) == 0
    # of a motion behind the last station nothing is known
    assert (sides.at(np.array([3]), np.array([0.5])) == 0).all()


@pytest.mark.parametrize("seed", range(6))
def test_what_is_shared_out_goes_to_the_largest_needs_first(seed):
    rng = np.random.default_rng(seed)
    wanted, need = rng.integers(0, 5, 12), rng.permutation(12).astype(float)
    for spare in (0, 1, 7, int(wanted.sum()), 100):
        given = allocate(wanted, need, spare)
        assert given.sum() == min(spare, wanted.sum())
        assert ((given >= 0) & (given <= wanted)).all()
        left = spare
        for k in np.argsort(-need):
            assert given[k] == min(wanted[k], left)
            left -= given[k]
