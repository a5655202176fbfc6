"""Volumes of motions that meet material at once, somewhere between two places that are looked at."""

import numpy as np
import pytest

pytest.importorskip("numba")

from stock_cases import FLAT, MM, block, path_through, run

BLOCK = block([0, -60, -40], [200, 60, 0])


@pytest.mark.parametrize("above", [5.0, 3.17, 0.4])
@pytest.mark.parametrize("depth", [3.0, 0.7])
def test_a_plunge_from_above_removes_the_disc(above, depth):
    """Half a pace of such a plunge is a tenth of its volume."""
    cut = run(path_through([[100, 0, above], [100, 0, -depth]]), BLOCK, FLAT)
    assert cut.volume[1] / MM**3 == pytest.approx(np.pi * 64 * depth, rel=0.01)


def test_a_cut_that_ends_at_a_wall_of_air():
    """Out of the block sideways: what the front half of the disc leaves."""
    cut = run(path_through([[170, 0, -4], [230, 0, -4]]), BLOCK, FLAT)
    assert cut.volume[1] / MM**3 == pytest.approx(4 * (16 * 30 - np.pi * 32), rel=0.005)
