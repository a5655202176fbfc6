"""The part of the benchmark: a plate with pockets, walls and floors, its program, cell and points of its surface."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

RADIUS = 8.0
"""[mm] of the cutter, a flat end."""

POCKETS = {
    "A": (60.0, 50.0, 160.0, 120.0),
    "B": (300.0, 60.0, 180.0, 100.0),
    "C": (120.0, 240.0, 260.0, 110.0),
    "D": (100.0, 80.0, 220.0, 90.0),
    "E": (200.0, 230.0, 150.0, 140.0),
}
"""Corner and size [mm]."""

FORCES = {"FLOOR": (-30.0, 62.0, -18.0), "WALL": (48.0, 55.0, -8.0)}
"""[N] in the feed frame."""

DEPTH = 12.0
NEAREST = 9.0
"""[mm] of a point of a wall from the corner, which the cutter rounds."""

CELL = """\
robot: kuka_kr270
robot_base: {x: 0, y: 0, z: 0, a: 0, b: 0, c: 0}
tools:
  1: {x: 300, y: 0, z: 180, a: 0, b: 90, c: 0, axis: +z, diameter: 16, mass: 42, com: [50, 0, 160]}
bases:
  1: {x: BASE_X, y: BASE_Y, z: 800, a: -90, b: 0, c: 0}
correct: process
start: [0, -90, 90, 0, 90, 0]
tolerance: 0.004
max_growth: 8
"""
HOME = (1350.0, 350.0)
AWAY = (1650.0, -100.0)
"""[mm] x and y of the base at two places."""


def write_shop(folder: Path, base: tuple[float, float] = HOME, pockets: str = "ABC") -> Path:
    """Program and cell in ``folder``; the program's path."""
    folder.mkdir(parents=True, exist_ok=True)
    cell = CELL.replace("BASE_X", f"{base[0]:g}").replace("BASE_Y", f"{base[1]:g}")
    (folder / "cell.yaml").write_text(cell)
    program = folder / "part.src"
    program.write_text(_program(pockets))
    return program


def _program(pockets: str) -> str:
    lines = ["DEF part()", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]", "$APO.CDIS=0"]
    lines += ["PTP {A1 0,A2 -90,A3 100,A4 0,A5 80,A6 0}"]
    for name in pockets:
        x, y, wide, high = POCKETS[name]
        low = (x + RADIUS, y + RADIUS)
        top = (x + wide - RADIUS, y + high - RADIUS)
        lines += _operation(f"FLOOR {name}", FORCES["FLOOR"], _zigzag(low, top), [-DEPTH])
        lines += _operation(f"WALL {name}", FORCES["WALL"], _ring(low, top), [-0.5 * DEPTH, -DEPTH])
    return "\n".join([*lines, "END", ""])


def _operation(
    name: str, force: tuple[float, float, float], path: np.ndarray, depths: list[float]
) -> list[str]:
    lines = [";FORCE OFF", f";OPERATION {name}", "$VEL.CP=0.2"]
    for depth in depths:
        lines += [
            ";FORCE OFF",
            _lin(path[0], 20.0),
            _lin(path[0], depth + 0.2 if depth == depths[0] else depth + 1.0),
        ]
        lines += ["$VEL.CP=0.03", f";FORCE {force[0]:g} {force[1]:g} {force[2]:g} @feed"]
        lines += [_lin(point, depth) for point in path[1:]]
        lines += [";FORCE OFF", "$VEL.CP=0.2", _lin(path[-1], 20.0)]
    return lines


def _lin(point: np.ndarray, z: float) -> str:
    return f"LIN {{X {point[0]:.3f},Y {point[1]:.3f},Z {z:.3f},A -45.000,B 0.000,C 180.000}}"


def _ring(low: tuple[float, float], top: tuple[float, float]) -> np.ndarray:
    """Around the pocket, anticlockwise: the material is on the right."""
    middle = 0.5 * (low[0] + top[0])
    corners = [
        (middle, low[1]), (top[0], low[1]), (top[0], top[1]), (low[0], top[1]), (low[0], low[1]), (middle, low[1]),
    ]  # fmt: skip
    return _divided(np.array(corners), 30.0)


def _zigzag(low: tuple[float, float], top: tuple[float, float]) -> np.ndarray:
    """Over the floor in one sense, by rows that are a millimetre less than the cutter apart, inside of the walls."""
    inner = 1.0
    rows = np.arange(low[1] + inner, top[1] - inner, 2 * RADIUS - 1.0)
    points = []
    for number, y in enumerate(rows):
        ends = [low[0] + inner, top[0] - inner]
        points += [(end, y) for end in (ends if number % 2 == 0 else ends[::-1])]
    return _divided(np.array(points), 40.0)


def _divided(corners: np.ndarray, longest: float) -> np.ndarray:
    points = [corners[0]]
    for start, end in pairwise(corners):
        parts = max(1, int(np.ceil(np.linalg.norm(end - start) / longest)))
        points += [start + (end - start) * (i + 1) / parts for i in range(parts)]
    return np.array(points)


def surface_points(
    count: int, rng: np.random.Generator, pockets: str = "ABC"
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Points (K, 3) [mm] of walls and floors, outward normals (K, 3) and features, evenly drawn; in the base."""
    points, normals, features = [], [], []
    weights = np.array([POCKETS[name][2] * POCKETS[name][3] for name in pockets])
    for _ in range(count):
        name = pockets[rng.choice(len(pockets), p=weights / weights.sum())]
        x, y, wide, high = POCKETS[name]
        if rng.random() < 0.35:
            points.append([x + rng.uniform(20, wide - 20), y + rng.uniform(20, high - 20), -DEPTH])
            normals.append([0.0, 0.0, 1.0])
            features.append(f"FLOOR {name}")
            continue
        z = rng.uniform(-DEPTH + 1.0, -1.0)
        side, along = rng.integers(4), rng.random()
        right = x + NEAREST + along * (wide - 2 * NEAREST)
        up = y + NEAREST + along * (high - 2 * NEAREST)
        place = [(right, y), (x + wide, up), (right, y + high), (x, up)]
        normal = [(0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)]
        points.append([*place[side], z])
        normals.append([*normal[side], 0.0])
        features.append(f"WALL {name}")
    return np.array(points), np.array(normals), features
