"""The choice of groups where each of two large ones is scatter for the other, on drawn arrays."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnosis.selection import basis_of, problem, selected

POSES, GROUPS, WIDTH = 15, 20, 2
FREE = np.array([[-np.inf, np.inf]] * WIDTH)


def drawn(seed, sizes, known=True):
    """The problem of readings in 15 poses, of three coordinates each, with the given sizes [standard deviations] of the
    first groups in them."""
    rng = np.random.default_rng(seed)
    columns = [rng.normal(size=(3 * POSES, WIDTH)) for _ in range(GROUPS)]
    residual = rng.normal(size=3 * POSES)
    for own, size in zip(columns, sizes, strict=False):
        residual = residual + size * own @ np.array([1.0, -0.7])
    nothing = basis_of(np.ones((3 * POSES, 1)))
    return problem(residual, nothing, [(own, FREE) for own in columns], 3 * POSES, known, POSES)


def chosen(seed, sizes, known=True):
    return set(selected(drawn(seed, sizes, known), range(GROUPS)).groups)


@pytest.mark.parametrize("known", [True, False])
def test_two_large_groups_are_chosen_where_neither_counts_alone(known):
    """At 15 poses one of two equal ones leaves as much as it explains."""
    found = [chosen(seed, (5.0, 5.0), known) for seed in range(40)]
    assert sum(one >= {0, 1} for one in found) >= 39
    assert sum(one == {0, 1} for one in found) >= 38


@pytest.mark.parametrize("known", [True, False])
def test_of_scatter_alone_no_two_are_chosen(known):
    assert [chosen(seed, (), known) for seed in range(300)].count(set()) >= 298


@pytest.mark.parametrize("known", [True, False])
def test_beside_one_large_group_none_is_chosen_by_chance(known):
    found = [chosen(seed, (5.0,), known) for seed in range(100)]
    assert sum(one == {0} for one in found) >= 98


def test_what_no_group_explains_gets_no_two():
    """Ten times the scatter, of no group: by chance some pair explains a part of it."""
    count = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        columns = [rng.normal(size=(3 * POSES, WIDTH)) for _ in range(GROUPS)]
        residual = 10.0 * rng.normal(size=3 * POSES)
        nothing = basis_of(np.ones((3 * POSES, 1)))
        one = problem(residual, nothing, [(own, FREE) for own in columns], 3 * POSES, True, POSES)
        count += bool(selected(one, range(GROUPS)).groups)
    assert count <= 2


@pytest.mark.parametrize(("gain", "count"), [(45.0, 0), (150.0, 2)])
def test_two_count_among_all_pairs(gain, count):
    """Two groups that differ by a little, which alone explains: each counts beside the other from 33 variances on, but
    there are 190 pairs, the best of which counts from 65 on.  The other groups explain nothing."""
    rng = np.random.default_rng(3)
    q = np.linalg.qr(rng.normal(size=(3 * POSES, GROUPS + 2)))[0]
    noise = rng.normal(size=3 * POSES)
    noise -= q @ (q.T @ noise)
    variance = noise @ noise / (3 * POSES - 3)
    columns = [q[:, :1], q[:, :1] + 0.05 * q[:, 1:2], *(q[:, k : k + 1] for k in range(2, GROUPS))]
    residual = np.sqrt(gain * variance) * q[:, 1] + noise
    groups = [(own, FREE[:1]) for own in columns]
    one = problem(residual, np.ones((3 * POSES, 1)) / np.sqrt(3 * POSES), groups, 3 * POSES, False, POSES)
    assert len(selected(one, range(GROUPS)).groups) == count
