"""The largest distance of points from their part of a polygon: as if every segment were looked at."""

import numpy as np
import pytest

from postproc.verification import nearest_segments
from postproc.verification.nearest_segments import largest_of_nearest


def every_segment(corners, last, point, first, stop):
    """The same, one by one."""
    farthest = 0.0
    for place, low, high in zip(point, first, stop, strict=True):
        nearest = np.inf
        for k in range(low, max(high, low + 1)):
            one = min(max(k, 0), len(corners) - 1)
            path = corners[min(one + 1, last[one])] - corners[one]
            out = place - corners[one]
            share = np.clip(np.sum(out * path) / max(np.sum(path**2), 1e-24), 0.0, 1.0)
            rest = out - share * path
            nearest = min(nearest, float(np.sqrt(np.einsum("i,i->", rest, rest))))
        farthest = max(farthest, nearest)
    return farthest


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("scatter", [0.0, 1e-6, 0.3, 50.0])
def test_no_segment_is_left_out_that_counts(monkeypatch, seed, scatter):
    """Points beside a path of two lines that goes to and fro, with guesses that are far off."""
    monkeypatch.setattr(nearest_segments, "FIRST", 3)
    rng = np.random.default_rng(seed)
    corners = np.cumsum(rng.normal(size=(60, 3)), axis=0)
    corners[10:13] = corners[10]  # segments without length
    last = np.repeat([24, 59], [25, 35])
    at = rng.integers(0, 60, 40)
    point = corners[at] + scatter * rng.normal(size=(40, 3))
    first = at - rng.integers(0, 12, 40)
    stop = at + 1 + rng.integers(0, 12, 40)
    guess = rng.integers(-5, 70, 40)
    found = largest_of_nearest(corners, last, point, (guess, first, stop))
    assert found == pytest.approx(every_segment(corners, last, point, first, stop), rel=1e-14, abs=0)


def test_what_is_not_known_is_not_left_out():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    point = np.array([[0.5, 3.0, 0.0], [np.nan, 0.0, 0.0]])
    ends = np.zeros(2, int), np.zeros(2, int), np.full(2, 2)
    assert np.isnan(largest_of_nearest(corners, np.full(3, 2), point, ends))
    assert largest_of_nearest(corners, np.full(3, 2), np.zeros((0, 3)), (ends[0][:0],) * 3) == 0.0
