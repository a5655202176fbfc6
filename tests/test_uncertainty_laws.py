"""Laws of how uncertainties are carried into errors: exact quantiles, shares that sum to one, draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from postproc.compensation.uncertainty_propagation import (
    covariances,
    expanded_uncertainty,
    expanded_uncertainty_of_largest,
    length_quantile,
    variance_shares,
)


@pytest.mark.parametrize("directions", [1, 2, 3])
def test_the_quantile_of_so_many_directions_alike_is_that_of_chi_square(directions):
    scale = np.array([1e-6, 3e-5, 1.0])
    spread = np.zeros((3, 3, 3))
    for k in range(directions):
        spread[:, k, k] = scale**2
    expected = scale * np.sqrt(chi2.ppf(0.95, directions))
    np.testing.assert_allclose(length_quantile(spread), expected, rtol=2e-5)
    assert (length_quantile(0.0 * spread) == 0).all()


@pytest.mark.parametrize("freedom", [1.1, 1.25, 1.4, 1.5, 1.75, 2.0, 2.25, 2.5, 2.75, 3.0])
def test_between_them_it_is_that_of_as_many_degrees_of_freedom(freedom):
    """Two or three eigenvalues of which (sum)^2 / sum of squares is ``freedom``."""
    whole, rest = int(freedom - 1e-9), None
    low, high = 0.0, 1.0
    for _ in range(80):  # the last eigenvalue beside ``whole`` of 1
        rest = 0.5 * (low + high)
        low, high = (rest, high) if (whole + rest) ** 2 / (whole + rest**2) < freedom else (low, rest)
    values = np.array([1.0] * whole + [rest] + [0.0] * (2 - whole))
    total, squares = values.sum(), (values**2).sum()
    assert total**2 / squares == pytest.approx(freedom)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    found = length_quantile((turn @ np.diag(values) @ turn.T)[None])[0]
    assert found == pytest.approx(np.sqrt(squares / total * chi2.ppf(0.95, freedom)), rel=2e-3)


def test_shares_of_the_variance_sum_to_one_and_are_those_of_each_figure_alone():
    rng = np.random.default_rng(4)
    moves, sizes = rng.normal(size=(3, 4)), np.array([0.5, 2.0, 0.0, 1.0])
    share = variance_shares(moves, np.diag(sizes**2))
    assert share.sum() == pytest.approx(1.0)
    alone = (np.linalg.norm(moves, axis=0) * sizes) ** 2
    np.testing.assert_allclose(share, alone / alone.sum(), rtol=1e-12)
    assert 0.0 < share[0] < 1.0
    assert (variance_shares(moves, np.zeros((4, 4))) == 0).all()
    root = rng.normal(size=(4, 4))
    assert variance_shares(moves, root @ root.T).sum() == pytest.approx(1.0)


def test_a_covariance_is_carried_along_by_the_sensitivities():
    rng = np.random.default_rng(5)
    moves, root = rng.normal(size=(2, 3, 4)), rng.normal(size=(4, 4))
    found = covariances(moves, root @ root.T)
    for motion in range(2):
        drawn = moves[motion] @ root
        np.testing.assert_allclose(found[motion], drawn @ drawn.T, rtol=1e-12)
    error = np.array([[100.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    half = expanded_uncertainty(error, found)
    assert half[0] == pytest.approx(1.959964 * np.sqrt(found[0, 0, 0]), rel=1e-4)
    assert half[1] == pytest.approx(length_quantile(found[1:])[0])


def test_of_one_motion_and_one_figure_the_largest_error_is_exact():
    """Far from nothing it is normal along the error; from nothing on it is half of that distribution."""
    moves, sigma = np.array([[[2e-6], [0.0], [0.0]]]), 3.0
    far = expanded_uncertainty_of_largest(np.array([[1.0, 0.0, 0.0]]), moves, np.array([[sigma**2]]))
    assert far == pytest.approx(1.959964 * 6e-6, rel=2e-3)
    near = expanded_uncertainty_of_largest(np.zeros((1, 3)), moves, np.array([[sigma**2]]))
    assert near == pytest.approx(1.959964 * 6e-6, rel=2e-3)
    across = np.array([[[0.0], [2e-6], [0.0]]])
    beside = expanded_uncertainty_of_largest(np.array([[1.0, 0.0, 0.0]]), across, np.array([[sigma**2]]))
    assert beside < 1e-9
    assert expanded_uncertainty_of_largest(np.zeros((1, 3)), 0.0 * moves, np.array([[1.0]])) == 0.0
    assert expanded_uncertainty_of_largest(np.zeros((1, 3)), moves, np.array([[0.0]])) == 0.0


@pytest.mark.parametrize("count", [1, 5, 20])
def test_of_many_motions_alike_and_independent_figures_the_largest_has_a_closed_form(count):
    """Each moved in three directions by figures of its own: below x with P(chi^2_3 < x^2)^count."""
    moves = np.zeros((count, 3, 3 * count))
    for k in range(count):
        moves[k, :, 3 * k : 3 * k + 3] = 1e-6 * np.eye(3)
    found = expanded_uncertainty_of_largest(np.zeros((count, 3)), moves, np.eye(3 * count))
    assert found == pytest.approx(1e-6 * np.sqrt(chi2.ppf(0.95 ** (1.0 / count), 3)), rel=0.02)
    scaled = expanded_uncertainty_of_largest(np.zeros((count, 3)), 7.0 * moves, np.eye(3 * count))
    assert scaled == pytest.approx(7.0 * found, rel=1e-9)
    one = expanded_uncertainty_of_largest(np.zeros((count, 3)), moves, 4.0 * np.eye(3 * count))
    assert one == pytest.approx(2.0 * found, rel=1e-9)


def test_motions_that_move_together_are_as_one():
    """One figure that moves a thousand motions alike: as of one; those that it hardly moves add nothing."""
    moves = np.tile([[[1e-6], [0.0], [0.0]]], (1000, 1, 1))
    moves[500:] *= 1e-3
    many = expanded_uncertainty_of_largest(np.zeros((1000, 3)), moves, np.eye(1))
    one = expanded_uncertainty_of_largest(np.zeros((1, 3)), moves[:1], np.eye(1))
    assert many == pytest.approx(one, rel=1e-9)
