"""Inverse kinematics of an arm with a spherical wrist, in closed form, as its controller does it.

A configuration (branch) is written as KUKA's status S: bit 0 wrist root in the overhead area, bit 1 elbow
(A3 beyond the stretched arm), bit 2 A5 < 0.  The turn T has bit i set where axis i + 1 is negative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.geometry import Poses, rotation_from_vector, wrapped
from postproc.robot.description import KukaLengths

_UNTURN_FLANGE = np.round(rotation_from_vector([0.0, -np.pi / 2, 0.0]))
_SINGULAR = 1e-9


@dataclass(frozen=True)
class Inverse:
    """Solutions: ``q`` (N, 6) [rad], NaN where out of reach; ``reachable`` (N,)."""

    q: Floats
    reachable: Bools


def inverse(arm: KukaLengths, flange: Poses, status: Ints, near: Floats) -> Inverse:
    """Axis angles that bring the flange to poses in the robot base.

    ``status`` (N,): the branch to take.  ``near`` (N, 6) [rad]: each axis is given the multiple of a turn
    nearest to it, and its value where an axis is not defined (A1 with the wrist over axis 1, A4 at A5 = 0).
    FK(inverse(x)) = x to rounding wherever the pose is in reach.
    """
    rotation = flange.rotation @ _UNTURN_FLANGE
    centre = flange.position - arm.d6 * rotation[..., 0]
    overhead, elbow, flipped = ((status >> bit) & 1 == 1 for bit in range(3))
    x, y = centre[:, 0], centre[:, 1]
    across = np.hypot(x, y)
    a1 = np.where(across < _SINGULAR, near[:, 0], -np.arctan2(y, x) + np.where(overhead, np.pi, 0.0))
    forward = np.where(overhead, -across, across) - arm.a1
    up = centre[:, 2] - arm.d1

    second = np.hypot(arm.d4, arm.a3)
    cosine = (forward**2 + up**2 - arm.a2**2 - second**2) / (2 * arm.a2 * second)
    reachable = np.abs(cosine) <= 1.0
    cosine = np.where(reachable, cosine, np.nan)
    bend = np.where(elbow, 1.0, -1.0) * np.arctan2(np.sqrt((1 - cosine) * (1 + cosine)), cosine)
    a2 = np.arctan2(-up, forward) - np.arctan2(second * np.sin(bend), arm.a2 + second * np.cos(bend))
    a3 = bend - forearm_tilt(arm)

    # Wrist: M = Rx(-A4) Ry(A5) Rx(-A6), what is left of the rotation past the forearm.
    s1, c1, s23, c23 = np.sin(a1), np.cos(a1), np.sin(a2 + a3), np.cos(a2 + a3)
    r0, r1, r2 = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    level = c1[:, None] * r0 - s1[:, None] * r1
    m0 = c23[:, None] * level - s23[:, None] * r2
    m1 = s1[:, None] * r0 + c1[:, None] * r1
    m2 = s23[:, None] * level + c23[:, None] * r2
    sine = np.hypot(m0[:, 1], m0[:, 2])
    sign = np.where(flipped, -1.0, 1.0)
    a5 = sign * np.arctan2(sine, m0[:, 0])
    straight = sine < _SINGULAR
    a4 = np.where(straight, near[:, 3], -np.arctan2(sign * m1[:, 0], -sign * m2[:, 0]))
    a6 = np.where(
        straight,
        np.arctan2(m1[:, 2], m1[:, 1]) - near[:, 3],
        -np.arctan2(sign * m0[:, 1], sign * m0[:, 2]),
    )
    q = np.stack([a1, a2, a3, a4, a5, a6], axis=1)
    q[:, [0, 3, 5]] = near[:, [0, 3, 5]] + wrapped(q[:, [0, 3, 5]] - near[:, [0, 3, 5]])
    q[:, [1, 2]] = wrapped(q[:, [1, 2]])
    return Inverse(q, reachable & np.isfinite(q).all(axis=1))


def forearm_tilt(arm: KukaLengths) -> float:
    """Angle [rad] of the line axis 3 to wrist centre below the forearm's own axis; A3 = -tilt is stretched."""
    return float(np.arctan2(-arm.a3, arm.d4))


def status_of(arm: KukaLengths, q: Floats) -> Ints:
    """S (N,) of axis angles (N, 6) [rad]."""
    wrist = arm.a1 + arm.a2 * np.cos(q[:, 1])
    wrist = wrist + np.hypot(arm.d4, arm.a3) * np.cos(q[:, 1] + q[:, 2] + forearm_tilt(arm))
    bits = [wrist < 0, wrapped(q[:, 2] + forearm_tilt(arm)) > 0, q[:, 4] < 0]
    return sum((bit.astype(np.int64) << i for i, bit in enumerate(bits)), np.zeros(len(q), np.int64))


def turn_of(q: Floats) -> Ints:
    """T (N,) of axis angles (N, 6) [rad]: bit i is set where axis i + 1 is negative."""
    return ((q < 0).astype(np.int64) << np.arange(q.shape[1])).sum(axis=1)
