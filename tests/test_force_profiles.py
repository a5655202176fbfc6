"""The force inside of a motion, where the tool enters, leaves or turns: against sums over the angles of its circle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import line, task

from postproc.compensation.ramped_forces import STEEPEST, add_force_ramps
from postproc.process import Wrenches
from postproc.process.force_factors import ForceFactors
from postproc.process.force_profiles import NEAR, ForceProfiles, reduce_profiles
from postproc.process.force_ramps import Ramps
from postproc.process.operation_names import OperationNames


def drawn(seed: int, count: int = 6):
    """Places of motions 3, 5, ..., ascending, with 0 and 1 among them, and wrenches that vanish there."""
    rng = np.random.default_rng(seed)
    motion, share, wrench = [], [], []
    for number in range(count):
        inner = np.sort(rng.uniform(0.05, 0.95, rng.integers(1, 6)))
        motion += [3 + 2 * number] * (len(inner) + 2)
        share += [0.0, *inner, 1.0]
        wrench += [np.zeros(6), *rng.normal(size=(len(inner), 6)), np.zeros(6)]
    return np.array(motion), np.array(share), np.array(wrench), rng


@pytest.mark.parametrize("seed", range(5))
def test_ramps_of_a_profile_add_up_to_it(seed):
    motion, share, wrench, rng = drawn(seed)
    extent = rng.uniform(0.01, 0.3, 20)
    ramps = Ramps.profile(motion, share, wrench, extent)
    for row in np.unique(motion):
        own = motion == row
        at = np.linspace(0, 1, 101)
        expected = [np.interp(at, share[own], wrench[own, k]) for k in range(6)]
        np.testing.assert_allclose(ramps.at(np.full(101, row), at), np.array(expected).T, atol=1e-9)
    assert not ramps.at(np.arange(0, 20, 2), np.full(10, 0.4)).any()
    back = ramps.places()
    assert back[0].tolist() == motion.tolist()
    np.testing.assert_allclose(back[1], share, atol=1e-12)
    np.testing.assert_allclose(back[2], wrench, atol=1e-9)


def test_profiles_and_ramps_of_steps_add_up():
    motion, share, wrench, _ = drawn(1)
    extent = np.full(20, 0.1)
    profile = Ramps.profile(motion, share, wrench, extent)
    steps = Ramps.of(np.array([4]), np.ones((1, 6)), np.array([0.25]), extent, np.ones(20, bool))
    both = profile.joined(steps)
    rows, at = np.repeat(np.arange(20), 11), np.tile(np.linspace(0, 1, 11), 20)
    total, *parts = (ramps.at(rows, at) for ramps in (both, profile, steps))
    np.testing.assert_allclose(total, np.sum(parts, axis=0), atol=1e-12)
    assert (np.diff(both.row) >= 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_a_reduced_profile_passes_all_places_but_those_too_near_to_others(seed):
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, 201)
    size = np.clip(np.interp(share, [0, 0.2, 0.3, 0.7, 0.75, 1.0], [0, 0, 1, 1, 0.2, 0.2]), 0, None) ** 0.7
    wrench = size[:, None] * rng.normal(size=6)
    motion, apart = np.repeat([4, 9], 201), 0.02
    found = reduce_profiles(motion, np.tile(share, 2), np.tile(wrench, (2, 1)), np.full(402, apart))
    for row in (4, 9):
        at = found.motion == row
        assert found.share[at][[0, -1]].tolist() == [0.0, 1.0]
        assert np.diff(found.share[at]).min() >= apart - 1e-12
        off = [np.interp(share, found.share[at], found.wrench[at, k]) - wrench[:, k] for k in range(3)]
        most = np.linalg.norm(wrench[:, :3], axis=1).max()
        far = np.abs(share[:, None] - found.share[at]).min(axis=1) >= apart
        assert np.linalg.norm(off, axis=0)[far].max() <= NEAR * most
        assert at.sum() < 20


def test_an_even_force_has_no_profile():
    share = np.linspace(0, 1, 50)
    even = np.outer(1 + 0.1 * share, np.arange(6.0))
    found = reduce_profiles(np.full(50, 7), share, even, np.full(50, 0.01))
    assert found.share.tolist() == [0.0, 1.0]
    assert not len(found.piecewise().motion)


def test_a_profile_of_an_arc_has_places_all_along_it():
    profile = ForceProfiles(
        np.array([1, 1, 1, 2, 2]), np.array([0, 0.1, 1, 0, 1.0]), np.arange(30.0).reshape(5, 6)
    )
    found = profile.divided(np.array([0.0, np.pi, 0.0]), np.radians(15))
    arc = found.motion == 1
    assert np.diff(found.share[arc]).max() <= 15 / 180 + 1e-9
    for k in range(6):
        expected = np.interp(found.share[arc], [0, 0.1, 1], profile.wrench[:3, k])
        np.testing.assert_allclose(found.wrench[arc, k], expected)
    assert found.share[~arc].tolist() == [0.0, 1.0]


def test_the_factors_of_a_cell_act_on_profiles_and_ramps_too():
    """A factor of 2, and a turn by 90 deg about the vertical: what lies in the plane turns as a whole."""
    motion, share, rest, rng = drawn(2)
    n, extent = 20, np.full(20, 0.1)
    rest[:, 2:] = 0.0
    values = np.column_stack([rng.normal(size=(n, 2)), np.zeros((n, 4))])
    carries = np.ones(n, bool)
    forces = Wrenches(values, values, carries, "test", (), np.zeros(n, bool))
    forces = replace(forces, ramps=Ramps.profile(motion, share, rest, extent))
    forces = forces.ramped(
        np.array([3, 11]), np.array([0.03, 0.25]), extent, np.array([0.0, 0.4])
    )  # one goes over motions beside it
    names = OperationNames(("TOOL 1",), np.zeros(n, int))
    base = np.tile(np.eye(3), (n, 1, 1))
    rows, at = np.repeat(np.arange(n), 7), np.tile(np.linspace(0, 1, 7), n)
    before = forces.along(rows, at)
    doubled = ForceFactors({"TOOL 1": 2.0}, {}).acting(forces, names, base)
    np.testing.assert_allclose(doubled.along(rows, at), 2 * before, atol=1e-9)
    forces = replace(forces, ramps=forces.ramps.only(forces.ramps.inside))
    places = forces.ramps.places()[:2]
    turned = ForceFactors({}, {"TOOL 1": (0.0, np.pi / 2)}).acting(forces, names, base).along(*places)
    old = forces.along(*places)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(old, axis=1), atol=1e-9)
    assert np.abs(np.sum(turned * old, axis=1)).max() < 1e-9


def ahead_of(task, row, share):
    """(K,) [m] how far along the feed the commands for the shares (K,) of a motion are."""
    rows = np.full(len(share), row)
    wanted = task.desired_path.at(rows, share)
    made = task.command(rows, wanted, task.force.along(rows, share), task.goal(rows, wanted, share))
    return made.command.position @ task.desired_path.tangent(rows[:1], np.zeros(1))[0]


def slanting():
    """A cut whose feed lies along no axis."""
    start, end = np.array([1.45, -0.3, 0.45]), np.array([1.7, 0.25, 0.55])
    up = np.array([0, 0, 0.1])
    return task([start + up, start, end, end + up], [False, False, True, False])


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("path", [line, slanting])
def test_no_correction_goes_back_where_a_force_along_the_feed_changes_at_once(sign, path):
    task = path()
    row = int(np.flatnonzero(task.carries)[-1])
    length = task.desired_path.length[row]
    share = np.array([0.0, 0.3, 0.5, 0.5 + 1e-3 / length, 0.9, 1.0])
    feed = task.desired_path.tangent(np.array([row]), np.zeros(1))[0]
    rest = np.zeros((6, 6))
    rest[1:3, :3] = sign * 4000 * feed
    ramps = Ramps.profile(np.full(6, row), share, rest, task.desired_path.length)
    sharp = replace(task, force=replace(task.force, ramps=ramps))
    at = np.linspace(0, 1, 2001)
    # against the feed the force holds the tool back, and the correction lies ahead
    assert (np.diff(ahead_of(sharp, row, at)).min() < 0) == (sign < 0)
    limited = add_force_ramps(sharp, 5e-3)
    assert np.diff(ahead_of(limited, row, at)).min() > 0.9 * (1 - STEEPEST) * length / 2000
    # the rest of the profile is as it was
    before = np.full(20, row), np.linspace(0, 0.3, 20)
    np.testing.assert_allclose(limited.force.along(*before), sharp.force.along(*before), atol=1e-9)
