"""Readings of an arm that warms up, from the dimensions of its robot file by products of plain matrices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from postproc.robot.description import find_robot

LENGTHS = {"d1": 0.75, "a1": 0.35, "a2": 1.25, "a3": -0.055, "d4": 1.1, "d6": 0.23}
"""[m] of the KR 270."""
AXES = ((2, -1), (1, 1), (1, 1), (0, -1), (1, 1), (0, -1))
TARGETS = {"M1": (0.1, 0.0, 0.1), "M2": (-0.1, 0.08, 0.1)}
TRUE = 60e-6
"""[m/K] growth of the link before A2."""
CALIBRATED = 20.0
SIGMA = 1e-5


def turn(axis: int, angle: float) -> np.ndarray:
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    rotation = np.eye(3)
    rotation[i, i] = rotation[j, j] = np.cos(angle)
    rotation[i, j], rotation[j, i] = -np.sin(angle), np.sin(angle)
    return rotation


def flange(q: np.ndarray, growth: float) -> tuple[np.ndarray, np.ndarray]:
    """Place (3,) [m] and rotation (3, 3) of the flange at ``q`` (6,) [rad], the link to A2 longer by ``growth`` [m]."""
    k = LENGTHS
    first = np.array([k["a1"], 0.0, k["d1"]])
    links = [np.zeros(3), first * (1.0 + growth / np.linalg.norm(first)), np.array([k["a2"], 0.0, 0.0])]
    links += [np.array([k["d4"], 0.0, k["a3"]]), np.zeros(3), np.zeros(3)]
    place, rotation = np.zeros(3), np.eye(3)
    for link, (axis, sign), angle in zip(links, AXES, q, strict=True):
        place = place + rotation @ link
        rotation = rotation @ turn(axis, sign * angle)
    rotation = rotation @ turn(1, np.pi / 2)
    return place + rotation @ np.array([0.0, 0.0, k["d6"]]), rotation


def written(
    path: Path,
    start: float,
    seed: int,
    column: str = "TEMP",
    lag: float = 0.0,
    frame: str = "robot",
    shift: float = 0.0,
) -> Path:
    """Readings at 25 poses of an arm that warms up from ``start`` [degC]; A2 lags by ``lag`` [rad] in the order of the
    rows, and each pose is off by ``shift`` [m] one sigma."""
    rng = np.random.default_rng(seed)
    low, high = np.radians([[-90, -120, 20, -100, -90, -100], [90, -30, 130, 100, 90, 100]])
    rows = [f"# robot: kuka_kr270\n# frame: {frame}\n# sigma_mm: {SIGMA * 1e3:g}"]
    rows += [f"# target {name}: {' '.join(f'{1e3 * x:g}' for x in at)}" for name, at in TARGETS.items()]
    rows.append("A1,A2,A3,A4,A5,A6,TARGET,X,Y,Z" + (f",{column}" if column else ""))
    before = None
    for k in range(25):
        q = np.radians(np.degrees(rng.uniform(low, high)).round(4))
        sense = 0.0 if before is None else np.sign(q[1] - before[1])
        before = q
        warm = round(start + 0.4 * k, 2)
        place, rotation = flange(
            q - np.array([0, 0.5 * lag * sense, 0, 0, 0, 0]), TRUE * (warm - CALIBRATED) * (not lag)
        )
        place = place + shift * np.random.default_rng([seed, k]).normal(size=3)
        for name, at in TARGETS.items():
            seen = place + rotation @ np.array(at) + SIGMA * rng.normal(size=3)
            numbers = [*(f"{x:.4f}" for x in np.degrees(q)), name, *(f"{1e3 * x:.5f}" for x in seen)]
            rows.append(",".join([*numbers, *([f"{warm:.2f}"] if column else [])]))
    path.write_text("\n".join(rows) + "\n")
    return path


def robot(folder: Path, options: str, growth: str = "") -> str:
    """The KR 270 without its compliances, with thermal growth of the link before A2."""
    text = find_robot("kuka_kr270").read_text()
    given = f"\n    parameters: {{g2: {growth}}}" if growth else ""
    head = text[: text.index("effects:")]
    path = folder / "robot.yaml"
    path.write_text(f"{head}effects:\n  - effect: thermal_growth\n    options: {options}{given}\n")
    return str(path)


REFERENCE = "{variable: temperature, reference: 20}"
STATED = "{value: 50.0e-6, unit: m/K, ci95: 30.0e-6, source: another arm}"
