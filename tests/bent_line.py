"""``python -m tests.bent_line [SLOPE ...]``: how near points that keep their distance come to a line with a turn.

In a plane, apart from all code of the package: the line y = max(slope x, 0), points at least 0.6 mm apart (50 mm/s and
a cycle of 12 ms), rounded off by parabolas from 0.5 mm on or from half of the shorter line beside them.  The largest
error square to x is made least from many starts, over both coordinates of all points (sequential linear programming):
the least that is found is no proof that none is less.  1.09 is the slope at which the correction turns where a force
turns round inside a cut (``steps of force`` of ``tests.judge``), 0.885 that at the end of the ramps of the lead-ins.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

DISTANCE, REACH = 0.6, 0.5
SLOPES = (0.885, 1.09)
STARTS, STEPS, SMALLEST = 14, 120, 1e-6
ON_PARABOLA, ON_LINE = np.linspace(0.0, 1.0, 41)[:, None], np.linspace(0.0, 1.0, 9)[:, None]


class Followed(NamedTuple):
    """Points (n, 2) [mm] and their largest error [mm]."""

    points: np.ndarray
    largest: float


def driven(points: np.ndarray) -> np.ndarray:
    """(B, S, 2) places of B rounded polygons (B, n, 2), from half of the first line on."""
    step = np.diff(points, axis=1)
    length = np.linalg.norm(step, axis=2)
    feed = step / length[..., None]
    reach = np.zeros(points.shape[:2])
    reach[:, 1:-1] = np.minimum(REACH, 0.5 * np.minimum(length[:, 1:], length[:, :-1]))
    parts = []
    for i in range(1, points.shape[1] - 1):
        vertex = points[:, None, i]
        before, after = (
            vertex + reach[:, i, None, None] * side for side in (-feed[:, None, i - 1], feed[:, None, i])
        )
        u = ON_PARABOLA
        parts.append((1 - u) ** 2 * before + 2 * u * (1 - u) * vertex + u**2 * after)
        if i < points.shape[1] - 2:
            last = points[:, None, i + 1] - reach[:, i + 1, None, None] * feed[:, None, i]
            parts.append(after + ON_LINE * (last - after))
    return np.concatenate(parts, axis=1)


def errors(points: np.ndarray, slope: float) -> np.ndarray:
    """(B, S + 1) [mm] of the polygons (B, n, 2); the last one where the line turns."""
    place = driven(points)
    off = place[..., 1] - slope * np.maximum(place[..., 0], 0.0)
    all_ = np.arange(len(place))
    last = np.clip((place[..., 0] < 0.0).sum(axis=1) - 1, 0, place.shape[1] - 2)
    one, two = place[all_, last], place[all_, last + 1]
    share = -one[:, 0] / (two[:, 0] - one[:, 0])
    at_bend = one[:, 1] + share * (two[:, 1] - one[:, 1])
    return np.concatenate([off, at_bend[:, None]], axis=1)


def distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(points, axis=-2), axis=-1)


def nearest(points: np.ndarray, slope: float) -> Followed:
    """From ``points`` (n, 2) [mm] on; the first and the last stay."""
    inner = 2 * (len(points) - 2)
    largest, box, tiny = float(np.abs(errors(points[None], slope)).max()), 0.1, 1e-6
    for _ in range(STEPS):
        moved = np.repeat(points[None], inner + 1, axis=0)
        moved[1:, 1:-1] += tiny * np.eye(inner).reshape(inner, -1, 2)
        off, far = errors(moved, slope), distances(moved)
        by_points, by_far = ((values[1:] - values[0]).T / tiny for values in (off, far))
        large = np.abs(off[0]) > 0.1 * largest
        now, change = off[0, large], by_points[large]
        ones, none = np.ones((len(now), 1)), np.zeros((len(by_far), 1))
        rows = np.block([[change, -ones], [-change, -ones], [-by_far, none]])
        most = np.concatenate([-now, now, far[0] - DISTANCE])
        cost = np.append(np.zeros(inner), 1.0)
        step = linprog(cost, rows, most, bounds=[(-box, box)] * inner + [(0.0, None)]).x
        if step is not None:
            found = points.copy()
            found[1:-1] += step[:-1].reshape(-1, 2)
            size = float(np.abs(errors(found[None], slope)).max())
            if size < largest - 1e-9 and distances(found).min() >= DISTANCE - 1e-9:
                points, largest, box = found, size, min(1.6 * box, 0.3)
                continue
        box *= 0.4
        if box < SMALLEST:
            break
    return Followed(points, largest)


def start(slope: float, numbers: np.random.Generator) -> np.ndarray:
    """(n, 2) [mm] points on the line, or a little off it: the first ones on each side of the bend as near to each other
    as may be or some farther, and one far before and behind them."""
    before, behind = numbers.integers(2, 5, 2)
    first = numbers.uniform(0.0, 0.45)
    right = first + np.arange(behind) * DISTANCE / np.hypot(1.0, slope) * numbers.uniform(1.0, 1.15)
    left = min(first - np.sqrt(max(DISTANCE**2 - (slope * first) ** 2, 0.0)), 0.0)
    x = np.append((left - np.arange(before) * DISTANCE * numbers.uniform(1.0, 1.15))[::-1], right)
    points = np.stack([x, slope * np.maximum(x, 0.0) + numbers.uniform(-0.02, 0.02, len(x))], axis=1)
    for i in np.repeat(np.arange(len(points) - 1)[None], 50, axis=0).ravel():
        way = points[i + 1] - points[i]
        lack = DISTANCE - np.linalg.norm(way)
        if lack > 0.0:
            points[i + 1 :] += (lack + 1e-9) * way / np.linalg.norm(way)
    end = points[-1, 0] + 4.0
    return np.vstack([[points[0, 0] - 5.0, 0.0], points, [end, slope * end]])


def search(slope: float, starts: int = STARTS, seed: int = 1) -> list[Followed]:
    """The nearest first."""
    numbers = np.random.default_rng(seed)
    return sorted((nearest(start(slope, numbers), slope) for _ in range(starts)), key=lambda one: one.largest)


def main(words: list[str]) -> int:
    print("slope  least error   of the starts, mm")
    for slope in [float(word) for word in words] or SLOPES:
        found = search(slope)
        print(f"{slope:5.3f} {found[0].largest:12.4f}  ", *(f"{one.largest:.4f}" for one in found))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
