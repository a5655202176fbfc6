"""What a measured part promises of the next one."""

import numpy as np
import pytest

from postproc.learning.covariance import Explanation, Layout, SmoothField
from postproc.learning.promise import Promise, held_out_variance


def explained(rng, count, free):
    """A plate with normals of all directions, three causes, a smooth field and an alignment."""
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    place = rng.uniform(0, 0.3, (count, 3))
    layout = Layout(place, normal, np.full(count, 1e-5), 5e-3 * free, np.arange(count) % 3)
    columns = 3e-5 * rng.normal(size=(count, 3))
    return Explanation(
        layout, SmoothField(2e-5, 0.06), 3e-5 * rng.normal(size=count), columns, 1e-4 * rng.normal(size=count)
    )


@pytest.mark.parametrize("freedoms", [0, 2])
def test_what_remains_is_that_of_a_place_that_was_not_measured(freedoms):
    """Each point in turn leaves the covariance, which is inverted anew; the alignment is projected out by itself."""
    rng = np.random.default_rng(11)
    count = 14
    free = rng.normal(size=(count, freedoms))
    whole = explained(rng, count, free)
    taken = np.linalg.qr(free)[0]
    field = whole.columns @ whole.columns.T + whole.layout.field(whole.surface)
    every = whole.layout.covariance(whole.surface, whole.by_force) + whole.columns @ whole.columns.T
    project = np.eye(count) - taken @ taken.T
    expected = []
    for out in range(count):
        rest = np.delete(np.arange(count), out)
        left = field - field[:, rest] @ np.linalg.solve(every[np.ix_(rest, rest)], field[rest])
        expected.append((project @ left @ project)[out, out])
    found = held_out_variance(whole, np.arange(count), taken)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_few_points_promise_less_than_they_know_of_themselves():
    """The fewer points, the further what remains beside them exceeds what remains at them."""
    ratios = []
    for count in (8, 60):
        whole = explained(np.random.default_rng(2), count, np.zeros((count, 0)))
        field = whole.columns @ whole.columns.T + whole.layout.field(whole.surface)
        at_them = np.diag(field - field @ whole.inverse @ field)
        beside = held_out_variance(whole, np.arange(count), np.zeros((count, 0)))
        assert (beside > at_them).all()
        ratios.append(np.sqrt(beside.mean() / at_them.mean()))
    assert ratios[0] > 1.5 * ratios[1]


def test_what_is_not_corrected_stays():
    """9 of 12 places are corrected; an alignment along the first column takes its share of what stays out."""
    rng = np.random.default_rng(4)
    error, free = 1e-4 * rng.normal(size=12), rng.normal(size=(12, 1))
    corrected = np.arange(12) >= 3
    found = Promise(2e-4, 1e-5, 4e-6, 3e-5).with_uncorrected(error, corrected, free)
    stays = np.append(error[:3], np.zeros(9))
    stays = stays - free[:, 0] * (free[:, 0] @ stays) / (free[:, 0] @ free[:, 0])
    left = np.sum(stays**2) / 12
    assert found.after == pytest.approx(np.sqrt(0.75 * 1e-5**2 + left))
    assert found.lower < np.sqrt(left) < found.upper
    assert found.before == 2e-4
    assert Promise(2e-4, 1e-5, 4e-6, 3e-5).with_uncorrected(error, corrected | True, free).after == 1e-5
