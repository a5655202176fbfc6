"""The force along motions that enter, leave and turn in stock, against sums over the angles of the cutter's circle."""

import numpy as np
import pytest
from stock_cases import ALLOY, BALL, CHIP, FLAT, block, path_through, run

RADIUS, DEPTH = 8.0, 3.0
ANGLES = (np.arange(20_000) + 0.5) * np.pi / 20_000


def force(engaged):
    """(3,) [N] of a flat end mill in feed axes, x ahead, z up, where the angles ANGLES from y to x are ``engaged``."""
    cut, edge = ALLOY.coefficients.cutting, ALLOY.coefficients.edge
    t, r, a = (k * CHIP * np.sin(ANGLES) + e for k, e in zip(cut, edge, strict=True))
    sine, cosine = np.sin(ANGLES), np.cos(ANGLES)
    parts = np.stack([-t * cosine - r * sine, t * sine - r * cosine, -a])
    return (parts * engaged).sum(axis=1) * (ANGLES[1] - ANGLES[0]) * FLAT.teeth / (2 * np.pi) * DEPTH * 1e-3


def profile_of(cut, motion, at):
    """(K, 3) [N] the force that is found at the shares ``at`` (K,) of a motion."""
    profile, own = cut.profiles, cut.profiles.motion == motion
    assert own.any()
    return np.stack([np.interp(at, profile.share[own], profile.wrench[own, k]) for k in range(3)], axis=1)


def compare(cut, motion, length, stock):
    """The largest difference at dense places of a motion, as a share of the largest force; stock: of (place, x, y) in
    mm along and across the feed, whether there is material."""
    at = np.linspace(0.004, 1, 250)
    true = []
    for place in at * length:
        x, y = place + RADIUS * np.sin(ANGLES), RADIUS * np.cos(ANGLES)
        true.append(force(stock(place, x, y)))
    true = np.array(true)
    off = np.linalg.norm(profile_of(cut, motion, at) - true, axis=1)
    most = np.linalg.norm(true, axis=1).max()
    return off / most


def test_a_slot_from_air_to_air():
    """In through one side of the block, out through the other: no step, and nothing but the slot in between."""
    path = path_through([[-30, 0, 10], [-30, 0, -DEPTH], [90, 0, -DEPTH]])
    cut = run(path, block([0, -40, -20], [60, 40, 0]), FLAT)
    off = compare(cut, 2, 120.0, lambda place, x, y: (x > 30) & (x < 90))
    assert off.max() < 0.08  # the first millimetre of the circle goes in steeply
    assert np.mean(off) < 0.005
    ends = cut.along[2, :, :3]
    assert not ends.any()


def test_a_corner_of_a_pocket_meets_full_stock_on_one_side_at_once():
    path = path_through([[-30, 0, 10], [-30, 0, -DEPTH], [40, 0, -DEPTH], [40, 30, -DEPTH]])
    cut = run(path, block([0, -40, -20], [60, 60, 0]), FLAT)

    def stock(place, x, y):
        """The feed goes along y of the block, so that what is left of it was cut by the slot."""
        slot = (y > 0) & (x < RADIUS)  # y of the feed is -x of the block
        return ~slot & (np.hypot(x, y) > RADIUS)

    off = compare(cut, 3, 30.0, stock)
    assert off.max() < 0.1
    assert np.mean(off) < 0.01


def test_a_wall_pass_that_leaves_on_an_arc_in_a_corner_is_followed():
    """A thin pass into a full corner: from a narrow angle to half of the circle within a radius."""
    path = path_through([[-30, 0, 10], [-30, 0, -DEPTH], [70, 0, -DEPTH]])
    low = block([0, 7, -20], [100, 60, 0])
    assert len(run(path, low, FLAT).profiles.motion)  # it enters
    cut = run(path, low, FLAT)
    off = compare(cut, 2, 100.0, lambda place, x, y: (x > 30) & (y > 7))
    assert off.max() < 0.05
    assert np.mean(off) < 0.005


@pytest.mark.parametrize("cutter", [FLAT, BALL])
def test_an_even_cut_has_no_profile(cutter):
    points = [[-30, 0, 10], [-30, 0, -DEPTH], *([x, 0, -DEPTH] for x in range(-20, 61, 10)), [60, 0, 20]]
    cut = run(path_through(points), block([0, -40, -20], [100, 40, 0]), cutter)
    x = np.array(points)[:, 0]
    inside = np.flatnonzero((x[:-1] >= 10) & (x[1:] > x[:-1])) + 1
    assert len(inside) > 3
    assert not np.isin(inside, cut.profiles.motion).any()
