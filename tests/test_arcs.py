"""Arcs: the way between, and the circle through three points."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.base.geometry import arc_in_plane, arc_through, on_arc, rotation_from_vector

COUNT = 500


@pytest.fixture
def arcs():
    """begin, end, centre, normal, sweep of arcs of every size."""
    rng = np.random.default_rng(3)
    centre, normal = rng.normal(size=(COUNT, 3)), rng.normal(size=(COUNT, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    begin = centre + np.cross(normal, rng.normal(size=(COUNT, 3)))
    sweep = rng.uniform(0.01, 6.27, COUNT)
    end = centre + (rotation_from_vector(sweep[:, None] * normal) @ (begin - centre)[..., None])[..., 0]
    return begin, end, centre, normal, sweep


def test_the_way_keeps_its_distance_and_its_pace(arcs):
    begin, end, centre, normal, sweep = arcs
    np.testing.assert_allclose(on_arc(*arcs, np.zeros(COUNT)), begin, atol=1e-12)
    np.testing.assert_allclose(on_arc(*arcs, np.ones(COUNT)), end, atol=1e-12)
    third = on_arc(*arcs, np.full(COUNT, 1 / 3))
    radius = np.linalg.norm(begin - centre, axis=1)
    np.testing.assert_allclose(np.linalg.norm(third - centre, axis=1), radius, atol=1e-12)
    turned = np.einsum("ni,ni->n", np.cross(begin - centre, third - centre), normal)
    np.testing.assert_allclose(turned, radius**2 * np.sin(sweep / 3), atol=1e-12)


def test_a_helix_advances_evenly(arcs):
    begin, end, centre, normal, sweep = arcs
    height = np.linspace(-1, 1, COUNT)
    raised = end + height[:, None] * normal
    middle = on_arc(begin, raised, centre, normal, sweep, np.full(COUNT, 0.25))
    np.testing.assert_allclose(np.sum((middle - begin) * normal, axis=1), height / 4, atol=1e-12)


def test_the_circle_through_three_points_is_that_of_the_arc(arcs):
    begin, end, centre, normal, sweep = arcs
    via = on_arc(*arcs, np.full(COUNT, 0.4))
    c, n, s = arc_through(begin, via, end)
    np.testing.assert_allclose(s, sweep, atol=1e-6)
    np.testing.assert_allclose(n, normal, atol=1e-6)
    np.testing.assert_allclose(c, centre, atol=1e-4)  # short arcs say little of their centre


def test_in_a_plane_only_what_is_seen_along_the_normal_counts(arcs):
    begin, end, _, normal, sweep = arcs
    via = on_arc(*arcs, np.full(COUNT, 0.6))
    flat = arc_in_plane(begin, via, end, normal)
    high = arc_in_plane(begin, via + 0.2 * normal, end - 0.7 * normal, normal)
    for one, other in zip(flat, high, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-4)
    np.testing.assert_allclose(flat[2], sweep, atol=1e-6)
    assert np.isnan(arc_in_plane(begin, via, end, -normal)[0]).all()  # clockwise


def test_points_on_a_line_have_no_circle():
    line = np.array([[0.0, 0, 0], [1, 2, 3], [2, 4, 6]])[:, None]
    centre, normal, sweep = arc_through(*line)
    assert np.isnan(centre).all()
    assert np.isnan(normal).all()
    assert sweep.shape == (1,)
