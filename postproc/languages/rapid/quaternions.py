"""Quaternions q1..q4 (scalar first) of RAPID and rotations.

R = I + 2 q1 [v] + 2 [v]^2 with v = (q2, q3, q4) and [v] its cross product, of unit quaternions; q and -q are the same.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import skew

WORST = 0.01
"""By how much the length of a quaternion may differ from 1; it is then taken as of length 1, as the controller does."""


def rotation_from_quaternion(quaternion: Floats) -> Floats:
    """Rotations (N, 3, 3) of quaternions (N, 4), made of length 1; NaN where the length is off by more than ``WORST``
    or is not known."""
    size = np.linalg.norm(quaternion, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where((np.abs(size - 1.0) <= WORST)[:, None], quaternion / size[:, None], np.nan)
    cross = skew(unit[:, 1:])
    return np.asarray(np.eye(3) + 2.0 * unit[:, :1, None] * cross + 2.0 * cross @ cross)


def quaternion_from_rotation(rotation: Floats, near: Floats) -> Floats:
    """Unit quaternions (N, 4) of rotations (N, 3, 3), of the two signs the one nearer to ``near`` (N, 4).

    The row of 4 q q^T with the largest diagonal gives q without a loss of digits (Shepperd 1978,
    doi:10.2514/3.55767b).
    """
    r = rotation
    trace = np.trace(r, axis1=1, axis2=2)
    outer = np.empty((len(r), 4, 4))
    outer[:, 0, 0] = 1.0 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        outer[:, i + 1, i + 1] = 1.0 + 2.0 * r[:, i, i] - trace
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = r[:, k, j] - r[:, j, k]
        outer[:, j + 1, k + 1] = outer[:, k + 1, j + 1] = r[:, k, j] + r[:, j, k]
    best = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    q = outer[np.arange(len(r)), best]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.asarray(np.where(np.sum(q * near, axis=1, keepdims=True) < 0, -q, q))
