"""Laws of orientations that two rotary axes make: by Euler angles of another library, and by many small segments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from spring_cases import MM, spring

from postproc.base.geometry import Poses
from postproc.compensation.orientations import pairs, shares_between, shortest
from postproc.toolpath import OrientationPath

LINE = np.array([[-150, 0, 0], [-50, 0, 0], [50, 0, 0], [150, 0, 0]]) * MM
BASE, TOOL = Rotation.from_rotvec([0.2, -0.1, 0.3]), Rotation.from_rotvec([0.1, 0.4, -0.2])


def by_words(words, law=OrientationPath.ROTARY_AXES, base=BASE, tool=TOOL):
    """A line of four targets with the ``words`` (4, 3) [deg] of A, B, C, NaN where a word is not used."""
    job = spring(LINE, [False, True, True, True])
    words = np.radians(np.asarray(words, float))
    rotation = (base * Rotation.from_euler("ZYX", np.nan_to_num(words[:, ::-1])) * tool).as_matrix()
    control = replace(
        job.toolpath.orientation_control,
        path=np.full(4, law, np.int8),
        rotary_from=np.concatenate([np.full((1, 3), np.nan), words[:-1]]),
        rotary_to=words,
        redundant_axis=np.tile(tool.inv().apply([0.0, 0.0, 1.0]), (4, 1)),
    )
    path = replace(job.toolpath, orientation_control=control).with_columns(rotation=rotation)
    bases = Poses(np.tile(base.as_matrix(), (4, 1, 1)), np.zeros((4, 3)))
    return replace(job, toolpath=path, wanted=Poses(rotation, job.wanted.position), base=bases), words


WORDS = {
    "B and C": [[np.nan, 10, 20], [np.nan, 40, -30], [np.nan, 35, 100], [np.nan, -20, 95]],
    "A and C": [[10, np.nan, 20], [40, np.nan, -30], [35, np.nan, 100], [-20, np.nan, 95]],
    "A and B": [[10, 20, np.nan], [40, -30, np.nan], [35, 60, np.nan], [-20, 55, np.nan]],
}


@pytest.mark.parametrize("name", WORDS)
def test_two_rotary_axes_turn_evenly_each(name):
    job, words = by_words(WORDS[name])
    rows = np.array([1, 1, 2, 3, 3])
    share = np.array([0.25, 0.9, 0.5, 0.1, 1.0])
    angles = np.nan_to_num(words[rows - 1] + share[:, None] * (words[rows] - words[rows - 1]))
    expected = (BASE * Rotation.from_euler("ZYX", angles[:, ::-1]) * TOOL).as_matrix()
    np.testing.assert_allclose(job.desired_path.at(rows, share).rotation, expected, atol=1e-9)
    np.testing.assert_array_equal(pairs(job.toolpath, rows), np.arange(5))
    # what they express already is nearest to itself
    law = job.desired_path.orientations
    np.testing.assert_allclose(law.nearest_expressible(rows, share, expected), expected, atol=1e-9)
    # of another orientation the direction of the tool
    other = (
        Rotation.from_matrix(expected) * TOOL.inv() * Rotation.from_rotvec([0.02, -0.01, 0.3]) * TOOL
    ).as_matrix()
    found = law.nearest_expressible(rows, share, other)
    axis = TOOL.inv().apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(found @ axis, other @ axis, atol=1e-6)


def test_motions_with_three_words_or_none_are_no_pair():
    for words in ([[10, 20, 30]] * 4, [[np.nan, 20, np.nan]] * 4):
        job, _ = by_words(words)
        assert len(pairs(job.toolpath, np.array([1, 2]))) == 0
    job, _ = by_words(WORDS["B and C"], law=OrientationPath.SINGLE_AXIS)
    assert len(pairs(job.toolpath, np.array([1, 2]))) == 0
    job, _ = by_words(WORDS["B and C"])
    programmed = np.array([True, False, True, True])
    constraints = replace(job.toolpath.constraints, orientation_programmed=programmed)
    locked = replace(job.toolpath, constraints=constraints)
    np.testing.assert_array_equal(pairs(locked, np.array([1, 2, 3, 1])), [1, 2])
    # without a pair all goes evenly
    rows, low, high = np.array([1, 1]), np.array([0.2, 0.4]), np.array([0.6, 1.0])
    np.testing.assert_allclose(shares_between(locked, rows, low, high, np.array([0.5, 0.25])), [0.4, 0.55])
    np.testing.assert_array_equal(shortest(locked, rows, low, high), [1.0, 1.0])


@pytest.mark.parametrize(
    "leans",
    [
        *((0.0, 8.0), (6.0, -4.0), (-0.5, 5.0), (20.0, 30.0), (5.0, 5.0), (179.0, 172.0), (-3.0, -0.1)),
        *((30.0, 100.0), (100.0, 30.0), (150.0, 85.0)),
    ],
)
@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.3, 0.8)])
def test_near_their_pole_shares_are_even_in_the_turn_of_the_outer_axis(leans, low, high):
    """In asinh(lean / 1 deg), from the pole on that lies nearest; one that does not lean otherwise goes evenly."""
    words = [[np.nan, leans[0], 0], [np.nan, leans[0], 0], [np.nan, leans[1], 40], [np.nan, leans[1], 40]]
    job, _ = by_words(words)
    count = 400
    rows, part = np.full(count + 1, 2), np.linspace(0.0, 1.0, count + 1)
    lows, highs = np.full(count + 1, low), np.full(count + 1, high)
    share = shares_between(job.toolpath, rows, lows, highs, part)
    assert share[0] == pytest.approx(low)
    assert share[-1] == high
    steps = np.diff(share)
    assert (steps > 0).all()
    pole = 180.0 if sum(leans) > 180.0 else 0.0
    even = np.arcsinh(leans[0] + share * (leans[1] - leans[0]) - pole) if leans[0] != leans[1] else share
    assert np.ptp(np.diff(even)) < 1e-9
    factor = shortest(job.toolpath, rows[:1], lows[:1], highs[:1])[0]
    assert 0.0 < factor <= 1.0
    assert steps.min() * count / (high - low) == pytest.approx(factor, rel=0.02)
