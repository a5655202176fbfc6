"""What saves the distance to a sweep never passes over one that is near."""

import numpy as np
import pytest

pytest.importorskip("numba")

from stock_cases import BALL, BULL, CONE, FLAT, block, path_through, sweeps_of

from postproc.process.stock.bounds import (
    BOUND_COLUMNS,
    PLANE_COLUMNS,
    is_far,
    may_be_bounded,
    set_bound,
    set_plane,
)
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.cells import stock_distance
from postproc.process.stock.displaced import displaced_rows
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


def displaced_by(rng, slack, rows):
    """The sweeps ``rows`` with ends that are shifted and turned so that no point of the cutter moves by more than
    ``slack`` [m]."""
    first, last = rng.normal(0, 1, (2, len(rows), 6))
    far = BALL.numbers[2]
    for end in (first, last):
        end[:, 3:] /= far
        size = np.linalg.norm(end[:, :3], axis=1) + far * np.linalg.norm(end[:, 3:], axis=1)
        end *= (slack * rng.uniform(0.5, 1, len(rows)) / size)[:, None]
    return displaced_rows(rows, np.broadcast_to([0.0, 1.0], (len(rows), 2)), first, last, far)


@pytest.mark.parametrize("slack", [0.0, 0.3e-3])
@pytest.mark.parametrize("five", [False, True])
def test_a_plane_is_a_lower_bound_in_all_of_its_cell(five, slack):
    cutters, half = np.array([BALL.numbers]), 0.6e-3
    bounded, close = 0, 0
    for seed in range(6):
        path = path_through(*random_path(seed, five))
        rows = np.ascontiguousarray(sweeps_of(path, block([0, 0, -40], [100, 60, 0]), BALL)[0].rows)
        bounds, plane = np.zeros((len(rows), BOUND_COLUMNS)), np.zeros(PLANE_COLUMNS, np.float32)
        rng = np.random.default_rng(200 + seed)
        moved = displaced_by(rng, slack, rows) if slack else rows
        for j in range(len(rows)):
            set_bound(rows, cutters, j, bounds[j])
            for _ in range(6):
                tip = rows[j, :3] + rng.uniform() * rows[j, 3:6]
                middle = tip + rng.normal(0, 0.003, 3) + rng.uniform(-0.001, 0.006) * rows[j, 6:9]
                set_plane(bounds, cutters, j, tuple(middle), half, slack, plane)
                off = rng.normal(0, 1, 3)
                off *= half * rng.uniform() ** (1 / 3) / np.linalg.norm(off)
                x, y, z = middle + off
                least = min(
                    pose_distance(moved, cutters, j, share, x, y, z) for share in np.linspace(0, 1, 401)
                )
                bound = plane[0] + plane[1:] @ off
                if plane[0] > -0.1:
                    bounded += 1
                    assert bound < max(least, 0.0)
                    close += least < 0.0 or bound > least - 0.15e-3 - 2 * slack
    assert bounded > 100
    assert close > 0.7 * bounded


def test_the_stock_of_any_time_is_what_the_sweeps_before_it_left():
    """Against the least distance of all places of all sweeps before that time, whichever the stock asks first."""
    blank, cutters = block([30, 10, -40], [70, 50, 0]), np.array([BALL.numbers])
    rng = np.random.default_rng(7)
    cut = earlier = 0
    for seed in range(6):
        rows = np.ascontiguousarray(sweeps_of(path_through(*random_path(seed, True)), blank, BALL)[0].rows)
        stock, _ = build_stock(blank, rows, cutters)
        reach = stock.grid[1]
        for _ in range(60):
            j = rng.integers(len(rows))
            tip = rows[j, :3] + rng.uniform() * rows[j, 3:6]
            away = rng.normal(0, 1, 3)
            away -= 2 * max(away @ rows[j, 6:9], 0.0) * rows[j, 6:9]  # below the ball's middle
            x, y, z = (
                tip + 5e-3 * rows[j, 6:9] + (5e-3 + rng.uniform(-1, 1) * reach) * away / np.linalg.norm(away)
            )
            faces = min(x - 30e-3, 70e-3 - x, y - 10e-3, 50e-3 - y, z + 40e-3, -z)
            if faces <= 0.0:
                continue
            least = [
                min(pose_distance(rows, cutters, k, share, x, y, z) for share in np.linspace(0, 1, 101))
                for k in range(len(rows))
            ]
            for time in (int(j), int(j) + 1, len(rows)):
                found, true = stock_distance(stock, x, y, z, time), min([reach, faces, *least[:time]])
                if true > 1e-6:
                    assert found == pytest.approx(true, abs=2e-6)
                    cut += true < min(reach, faces)
                else:
                    assert found < 2e-6
            earlier += min([reach, *least[:j]]) > min(least[: j + 1])
    assert cut > 50
    assert earlier > 20
