"""The largest error between samples of a path, of errors that are drawn by a closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from postproc.compensation.rounded_path import RoundedOutput

SAMPLES = 17
FINEST = 2.5e-3
"""The last places that are looked at are a ninth of the distance of samples apart: 1 - exp(-(1 / 18 / 1.2)^2) = 0.0021;
errors may be too small by as much."""


class Drawn(RoundedOutput):
    """Errors with two hills in each motion, along X and turned about Z, of the given heights (K, 2), at the places
    (K, 2); the force turns nowhere."""

    def __init__(self, height, place, width):
        self.height, self.place_of, self.width = height, place, width

    def error(self, at, share):
        hills = np.exp(-(((share[:, None] - self.place_of[at]) / self.width) ** 2))
        return (self.height[at] * hills).sum(axis=1)

    def deviations(self, at, share):
        zero = np.zeros(len(at))
        size = self.error(at, share)
        return SimpleNamespace(
            shift=np.stack([size, zero, zero], axis=1), turn=np.stack([zero, zero, 0.5 * size], axis=1)
        )

    def where_force_turns(self, at, share, found):
        return iter(())


def largest(drawn, count):
    at = np.repeat(np.arange(count)[:, None], SAMPLES, axis=1)
    return drawn.peaks(at, np.tile(np.linspace(0.0, 1.0, SAMPLES), (count, 1)))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_higher_of_two_hills_between_samples_is_found(seed):
    """The top of one lies on a sample, that of the other in the middle between two, which are higher than the first."""
    rng = np.random.default_rng(seed)
    count = 60
    spacing = 1.0 / (SAMPLES - 1)
    one = rng.integers(2, 6, count) * spacing
    two = (rng.integers(10, 14, count) + 0.5) * spacing
    height = np.stack([np.ones(count), rng.uniform(1.25, 1.5, count)], axis=1) * 1e-4
    place = np.stack([one, two], axis=1)
    mirrored = rng.random(count) < 0.5
    place[mirrored] = 1.0 - place[mirrored]
    drawn = Drawn(height, place, 1.2 * spacing)
    off, angle = largest(drawn, count)
    np.testing.assert_allclose(off, height[:, 1], rtol=FINEST)
    np.testing.assert_allclose(angle, 0.5 * height[:, 1], rtol=FINEST)


@pytest.mark.parametrize("top", [0.0, 1.0, 0.02, 0.98, 0.47])
def test_a_hill_is_found_wherever_its_top_is(top):
    count = 3
    drawn = Drawn(np.tile([2e-4, 0.0], (count, 1)), np.full((count, 2), top), 0.08)
    off, _ = largest(drawn, count)
    np.testing.assert_allclose(off, 2e-4, rtol=2e-3)


@pytest.mark.parametrize("top", [1.05, -0.05])
def test_no_place_outside_of_the_motion_counts(top):
    """The hill's top lies behind an end: the error at the end is the largest."""
    drawn = Drawn(np.array([[1e-4, 0.0]]), np.array([[top, 0.5]]), 0.2)
    off, _ = largest(drawn, 1)
    assert off[0] == pytest.approx(1e-4 * np.exp(-((0.05 / 0.2) ** 2)), rel=1e-9)
