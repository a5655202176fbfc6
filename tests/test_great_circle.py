"""Orientations between two targets of which only the tool's axis is stated: by closed forms."""

import numpy as np
import pytest
from motions import motions

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.orientations import MotionParts, ProgrammedOrientations
from postproc.toolpath import OrientationPath


def random_rotations(count, seed):
    return rotation_from_vector(np.random.default_rng(seed).normal(size=(count, 3)))


def on_the_way(start, end, axis, share):
    n = len(start)
    target = Poses(end, np.zeros((n, 3)))
    laws = np.full(n, OrientationPath.GREAT_CIRCLE)
    path = motions(target, path=laws, redundant_axis=axis)
    base = Poses(np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)))
    parts = MotionParts(np.arange(n), np.zeros(n), np.ones(n), start, end)
    found = np.full((n, 3, 3), np.nan)
    ProgrammedOrientations(path, base, target).interpolate(parts, np.full(n, share), found)
    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 1.0])
def test_the_tool_axis_takes_the_shortest_way_and_the_rest_turns_evenly_about_it(seed, share):
    """Closed forms: start and end are met; the axis is on the great circle between its ends, at that share of the
    angle; whatever the start is turned by about the tool first, so is all between, at the share that is left."""
    n = 40
    start, end = random_rotations(n, seed), random_rotations(n, seed + 100)
    axis = np.random.default_rng(seed).normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    found = on_the_way(start, end, axis, share)
    one, two, here = (np.einsum("nij,nj->ni", part, axis) for part in (start, end, found))
    angle = np.arccos(np.clip((one * two).sum(axis=1), -1.0, 1.0))
    wanted = (np.sin((1 - share) * angle)[:, None] * one + np.sin(share * angle)[:, None] * two) / np.sin(
        angle
    )[:, None]
    np.testing.assert_allclose(here, wanted, atol=1e-9)
    if share in (0.0, 1.0):
        np.testing.assert_allclose(found, end if share else start, atol=1e-9)
    spun = end @ rotation_from_vector(0.02 * axis)
    # a turn about the tool at the end comes in evenly, but where the spin is near half a turn and changes its sign
    more = on_the_way(start, spun, axis, share)
    expected = found @ rotation_from_vector(0.02 * share * axis)
    off = np.abs(more - expected).max(axis=(1, 2))
    assert np.median(off) < 1e-9
    assert (off < 1e-9).mean() > 0.9
