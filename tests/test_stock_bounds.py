"""The bound by which a sweep counts as far never passes over one that is near."""

import numpy as np
import pytest

pytest.importorskip("numba")

from stock_cases import BALL, BULL, CONE, FLAT, block, path_through, sweeps_of

from postproc.process.stock.bounds import BOUND_COLUMNS, is_far, may_be_bounded, set_bound
from postproc.process.stock.distance import pose_distance


def random_path(seed, five):
    """Tips (30, 3) [mm] and spindle axes (30, 3): short and long motions, level and inclined, a spindle that turns."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0, [3, 3, 1 + 2 * (seed % 2)], (30, 3)), axis=0) + np.array([50, 30, -10])
    points[::5, 2] = points[1::5, 2]
    lean = np.cumsum(rng.normal(0, 0.03 * five, (30, 2)), axis=0)
    axes = np.column_stack([lean, np.ones(30)])
    return points, axes / np.linalg.norm(axes, axis=1)[:, None]


@pytest.mark.parametrize("cutter", [BALL, BULL, CONE, FLAT], ids=lambda one: one.shape)
@pytest.mark.parametrize("five", [False, True])
def test_what_is_far_by_its_bound_is_far(cutter, five):
    cutters = np.array([cutter.numbers])
    far = seen = tight = 0
    for seed in range(6):
        path = path_through(*random_path(seed, five))
        rows = np.ascontiguousarray(sweeps_of(path, block([0, 0, -40], [100, 60, 0]), cutter)[0].rows)
        assert may_be_bounded(rows)
        bounds = np.zeros((len(rows), BOUND_COLUMNS))
        rng = np.random.default_rng(100 + seed)
        for j in range(len(rows)):
            set_bound(rows, cutters, j, bounds[j])
            for _ in range(12):
                t = rng.uniform()
                tip = rows[j, :3] + t * rows[j, 3:6]
                x, y, z = tip + rng.normal(0, 0.007, 3) + rng.uniform(0, 0.012) * rows[j, 6:9]
                least = min(
                    pose_distance(rows, cutters, j, share, x, y, z) for share in np.linspace(0, 1, 101)
                )
                for enough in (0.0, 0.2e-3, 1e-3):
                    seen += 1
                    if is_far(bounds, cutters, j, x, y, z, enough):
                        far += 1
                        assert least > enough
                    elif least > enough + 0.5e-3:
                        tight += 1
    assert far > 0.1 * seen
    assert tight < 0.5 * seen
