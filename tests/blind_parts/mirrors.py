"""What others do: the measured deviation itself, turned round, interpolated between the points."""

from __future__ import annotations

import numpy as np


def interpolated(
    place: np.ndarray, normal: np.ndarray, deviation: np.ndarray, at: np.ndarray, out: np.ndarray
) -> np.ndarray:
    """(M,) [m] at points ``at`` (M, 3) [mm] with normals ``out`` (M, 3): by the inverse square of the distance to the
    four nearest measured points (J, 3) of the same normal, none where there is none."""
    found = np.zeros(len(at))
    for i, (point, direction) in enumerate(zip(at, out, strict=True)):
        same = np.flatnonzero(normal @ direction > 0.9)
        if not len(same):
            continue
        distance = np.linalg.norm(place[same] - point, axis=1)
        near = np.argsort(distance)[:4]
        weight = 1 / np.maximum(distance[near], 1.0) ** 2
        found[i] = float(weight @ deviation[same[near]] / weight.sum())
    return found


def smoothed(
    place: np.ndarray,
    normal: np.ndarray,
    deviation: np.ndarray,
    at: np.ndarray,
    out: np.ndarray,
    noise: float,
) -> np.ndarray:
    """The same by a Gaussian process of displacements, its size and length by the evidence."""
    facing, across = normal @ normal.T, out @ normal.T
    square = ((place[:, None] - place[None]) ** 2).sum(axis=2)
    other = ((at[:, None] - place[None]) ** 2).sum(axis=2)
    best, answer = -np.inf, np.zeros(len(at))
    for size in (1e-5, 3e-5, 1e-4, 3e-4):
        for length in (30.0, 60.0, 120.0, 300.0):
            kernel = size**2 * np.exp(-square / (2 * length**2)) * facing + noise**2 * np.eye(len(place))
            solved = np.linalg.solve(kernel, deviation)
            evidence = -0.5 * deviation @ solved - 0.5 * np.linalg.slogdet(kernel)[1]
            if evidence > best:
                best = evidence
                answer = (size**2 * np.exp(-other / (2 * length**2)) * across) @ solved
    return answer
