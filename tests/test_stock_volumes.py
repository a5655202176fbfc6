"""Removed volumes of random programs against solids of another make: unions of convex hulls by manifold3d."""

from itertools import pairwise

import numpy as np
import pytest
from stock_cases import BALL, BULL, CONE, FLAT, MM, block, path_through, run

from postproc.toolpath import Arcs, Kind

manifold3d = pytest.importorskip("manifold3d")

LOW, HIGH = np.array([0, 0, -20.0]), np.array([60, 40, 0.0])
SIDES = 256


def outline(cutter, tip, axis, rings=24):
    """Points (K, 3) mm on the cutter at a place; the hull of those of two places is what it sweeps between them."""
    if cutter.taper is not None:
        rise = (cutter.radius - cutter.tip) / np.tan(cutter.taper)
        profile = [(cutter.tip, 0.0), (cutter.radius, rise)]
    else:
        k = np.linspace(0, np.pi / 2, rings if cutter.corner else 1)
        flat = cutter.radius - cutter.corner
        profile = list(zip(flat + cutter.corner * np.sin(k), cutter.corner * (1 - np.cos(k)), strict=True))
        profile = profile if cutter.corner else [(cutter.radius, 0.0)]
    profile.append((cutter.radius, cutter.length))
    phi = np.arange(SIDES) / SIDES * 2 * np.pi
    x = np.cross(axis, [0.3, 0.8, 0.52])
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    # a polygon of the same area as its circle
    even = np.sqrt(2 * np.pi / SIDES / np.sin(2 * np.pi / SIDES))
    around = even * (np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * y)
    return np.concatenate([tip + z / MM * axis + r / MM * around for r, z in profile])


def volume_by_solids(points, axes, cutter):
    """mm3 that the cutter removes from where it stands first: the first place counts as gone before."""
    stock = manifold3d.Manifold.cube(HIGH - LOW).translate(LOW)
    ends = [outline(cutter, point, axis) for point, axis in zip(points, axes, strict=True)]
    stock = stock - manifold3d.Manifold.hull_points(ends[0])
    before = stock.volume()
    for one, two in pairwise(ends):
        stock = stock - manifold3d.Manifold.hull_points(np.concatenate([one, two]))
    return before - stock.volume()


@pytest.mark.slow
@pytest.mark.parametrize("cutter", [FLAT, BALL, BULL, CONE], ids=lambda cutter: cutter.shape)
@pytest.mark.parametrize("seed", [1, 2])
def test_random_programs_remove_what_the_solids_say(cutter, seed):
    """Long and short motions, across, inclined, with a spindle that leans: within 1 %."""
    random = np.random.default_rng(seed)
    points = random.uniform([-5, -5, -8], [65, 45, 2], (8, 3))
    points[1::3, 2] = points[0:-1:3, 2][: len(points[1::3])]
    lean = random.normal(0, 0.15, 2)
    axis = np.array([*lean, 1.0]) / np.linalg.norm([*lean, 1.0])
    axes = np.broadcast_to(axis if seed == 2 else [0.0, 0, 1], (8, 3))
    cut = run(path_through(points, axes, [Kind.PTP] + [Kind.LIN] * 7), block(LOW, HIGH), cutter)
    assert cut.volume.sum() / MM**3 == pytest.approx(volume_by_solids(points, axes, cutter), rel=0.01)


def five_axis(seed, cutter):
    """Removed volumes [mm3] of 8 random motions that turn the spindle: by the simulation, and by solids of 10 steps."""
    random = np.random.default_rng(seed)
    points = random.uniform([5, 5, -8], [55, 35, 0], (9, 3))
    points[1:] = points[:-1] + np.clip(points[1:] - points[:-1], -15, 15)
    lean = np.clip(np.cumsum(random.normal(0, 0.06, (9, 2)), axis=0), -0.4, 0.4)
    axes = np.column_stack([lean, np.ones(9)])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    cut = run(path_through(points, axes, [Kind.PTP] + [Kind.LIN] * 8), block(LOW, HIGH), cutter)
    fine, turned = [points[0]], [axes[0]]
    for k in range(8):
        angle = np.arccos(np.clip(axes[k] @ axes[k + 1], -1, 1))
        for share in np.arange(1, 11) / 10:
            fine.append(points[k] + share * (points[k + 1] - points[k]))
            spread = np.array([np.sin((1 - share) * angle), np.sin(share * angle)]) / np.sin(angle)
            turned.append(spread @ axes[k : k + 2])
    return cut.volume.sum() / MM**3, volume_by_solids(fine, turned, cutter)


@pytest.mark.slow
@pytest.mark.parametrize("cutter", [FLAT, BALL, BULL], ids=lambda cutter: cutter.shape)
def test_turning_motions_remove_what_the_solids_say(cutter):
    found, solid = five_axis(1, cutter)
    assert found == pytest.approx(solid, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("cutter", [FLAT, BALL], ids=lambda cutter: cutter.shape)
@pytest.mark.parametrize("leans", [((0.25, 0.0), (-0.2, 0.15)), ((0.3, 0.0), (-0.3, 0.0))])
def test_an_arc_along_which_the_tool_tilts_removes_what_the_solids_say(cutter, leans):
    """Half a circle while the spindle turns over some 25 to 33 deg: within 1 %, by solids of 60 steps."""
    middle, radius, steps = np.array([30.0, 20.0, -5.0]), 13.0, 60
    ends = middle + radius * np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    axes = np.column_stack([leans, np.ones(2)])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    none = np.full((2, 3), np.nan)
    centre, normal, sweep = none.copy(), none.copy(), none[:, 0].copy()
    centre[1], normal[1], sweep[1] = middle * MM, [0.0, 0.0, 1.0], np.pi
    arcs = Arcs(centre=centre, normal=normal, sweep=sweep)
    cut = run(path_through(ends, axes, [Kind.PTP, Kind.CIRC], arcs), block(LOW, HIGH), cutter)
    share = np.linspace(0, 1, steps + 1)[:, None]
    round_ = middle + radius * np.column_stack(
        [np.cos(np.pi * share[:, 0]), np.sin(np.pi * share[:, 0]), 0 * share[:, 0]]
    )
    angle = np.arccos(axes[0] @ axes[1])
    turned = (np.sin((1 - share) * angle) * axes[0] + np.sin(share * angle) * axes[1]) / np.sin(angle)
    solid = volume_by_solids(round_, turned, cutter)
    upright = run(path_through(ends, None, [Kind.PTP, Kind.CIRC], arcs), block(LOW, HIGH), cutter)
    assert cut.volume[1] / MM**3 == pytest.approx(solid, rel=0.01)
    if cutter is FLAT:  # the tilt counts
        assert abs(upright.volume[1] / MM**3 / solid - 1) > 0.05


@pytest.mark.parametrize("cutter", [BALL, FLAT, BULL], ids=lambda cutter: cutter.shape)
def test_the_distance_to_a_motion_that_turns_is_the_least_of_its_places(cutter):
    """Random short motions with turns up to 5 deg, points near their surface: against 2001 places of each."""
    from stock_cases import sweeps_of

    from postproc.process.stock.distance import pose_distance, swept_distance

    random = np.random.default_rng(5)
    near = 0
    for _ in range(12):
        lean = random.normal(0, 0.1, 2)
        axes = np.array([[*lean, 1.0], [*(lean + random.normal(0, 0.04, 2)), 1.0]])
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        start = np.array([30.0, 20.0, -6.0])
        points = np.array([start, start + random.uniform(-1.5, 1.5, 3)])
        sweeps, _ = sweeps_of(path_through(points, axes), block(LOW, HIGH), cutter)
        numbers = np.array([one.numbers for one in sweeps.cutters])
        for point in points[0] + random.uniform(-9, 9, (25, 3)):
            x, y, z = point * MM
            for j in range(len(sweeps.rows)):
                true = min(
                    pose_distance(sweeps.rows, numbers, j, t, x, y, z) for t in np.linspace(0, 1, 2001)
                )
                found = swept_distance(sweeps.rows, numbers, j, x, y, z, 0.01)
                if abs(true) < 0.01:
                    near += 1
                    assert -1e-9 < true - found < 2e-9 + 1e-6 * (cutter is not BALL)
                bound = swept_distance(sweeps.rows, numbers, j, x, y, z, 1e-4)
                assert (bound > 1e-4 and true > 1e-4 - 1e-9) or bound <= max(found, -1e-4) + 1e-9
    assert near > 200


def main():
    """Prints the volumes of 200 random five-axis motions, 8 each."""
    worst = 0.0
    for seed in range(25):
        cutter = (FLAT, BALL, BULL)[seed % 3]
        found, solid = five_axis(seed, cutter)
        worst = max(worst, abs(found / solid - 1))
        print(
            f"{cutter.shape:5} {found:9.1f} {solid:9.1f} mm3  {100 * (found / solid - 1):+.3f} %", flush=True
        )
    print(f"200 motions, largest difference {100 * worst:.3f} %")


if __name__ == "__main__":
    main()
