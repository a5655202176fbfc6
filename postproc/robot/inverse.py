"""Inverse kinematics as the controller does it: closed form for a spherical wrist, Newton's for any other arm.

An arm with a spherical wrist has eight branches (see ``BranchBit``); that of another arm is the one that leads on from
the angles before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, wrapped
from postproc.robot.branches import BranchBit
from postproc.robot.chain import sine_and_cosine
from postproc.robot.geometries import Geometry, KukaLengths, KukaVariant, SerialArm
from postproc.robot.newton import solve_near

_SINGULAR = 1e-9


@dataclass(frozen=True)
class Inverse:
    """Solutions: ``q`` (N, n) [rad, m], NaN where out of reach; ``reachable`` (N,)."""

    q: Floats
    reachable: Bools


def inverse(arm: Geometry, flange: Poses, branch: Ints, near: Floats) -> Inverse:
    """Joint values that bring the flange to poses in the robot base; FK(inverse(x)) = x to rounding.

    ``near`` (N, n) [rad, m]: each axis is given the multiple of a turn nearest to it, and its value where an axis is
    not defined or is the external one.  Arms of closed form take ``branch`` (N,), others that of ``near`` (see
    ``newton.solve_near``).
    """
    if isinstance(arm, SerialArm):
        return Inverse(*solve_near(arm, flange, near))
    if isinstance(arm, KukaLengths):
        return _closed_form(arm, flange, branch, near)
    if arm.rail is not None:
        travel = arm.signs[0] * near[:, 0] + arm.offsets[0]
        flange = Poses(flange.rotation, flange.position - travel[:, None] * arm.rail)
    solution = _closed_form(arm.lengths, flange, branch, kuka_angles(arm, near))
    return Inverse(controller_values(arm, solution.q, near), solution.reachable)


def kuka_angles(arm: KukaLengths | KukaVariant, q: Floats) -> Floats:
    """(N, 6) [rad] angles of a KUKA-type arm from the values (N, n) of its controller."""
    if isinstance(arm, KukaLengths):
        return q
    return np.asarray(arm.signs[-6:] * q[:, -6:] + arm.offsets[-6:])


def controller_values(arm: KukaLengths | KukaVariant, angles: Floats, like: Floats) -> Floats:
    """(N, n) [rad, m] the inverse of that, of ``angles`` (N, n): A2, A3 and A5 within half a turn of the middle of
    their limits; a linear axis keeps its value of ``like`` (N, n)."""
    if isinstance(arm, KukaLengths):
        return angles
    values = like.copy()
    values[:, -6:] = arm.signs[-6:] * (angles - arm.offsets[-6:])
    for i in (-5, -4, -2):
        middle = (arm.axes[i].lower + arm.axes[i].upper) / 2
        values[:, i] += 2 * np.pi * np.round((middle - values[:, i]) / (2 * np.pi))
    return values


def _closed_form(arm: KukaLengths, flange: Poses, branch: Ints, near: Floats) -> Inverse:
    """Angles (N, 6) of a KUKA-type arm.

    A1 is that of ``near`` with the wrist over axis 1, A4 with A5 = 0.
    """
    # columns (3, N) of the flange; its z points along the forearm where the wrist is straight
    fx, fy, fz = np.ascontiguousarray(np.moveaxis(flange.rotation, (-2, -1), (1, 0)))
    x, y, z = np.ascontiguousarray(flange.position.T) - arm.d6 * fz
    overhead, elbow, flipped = (branch & bit != 0 for bit in BranchBit)
    across = np.sqrt(x * x + y * y)
    a1 = -np.arctan2(y, x) + np.where(overhead, np.pi, 0.0)
    above = np.flatnonzero(across < _SINGULAR)
    a1[above] = near[above, 0]
    forward = np.where(overhead, -across, across) - arm.a1
    up = z - arm.d1

    second = np.hypot(arm.d4, arm.a3)
    cosine = (forward**2 + up**2 - arm.a2**2 - second**2) / (2 * arm.a2 * second)
    reachable = np.abs(cosine) <= 1.0
    cosine = np.where(reachable, cosine, np.nan)
    sine = np.where(elbow, 1.0, -1.0) * np.sqrt((1 - cosine) * (1 + cosine))
    a2 = np.arctan2(-up, forward) - np.arctan2(second * sine, arm.a2 + second * cosine)
    a3 = np.arctan2(sine, cosine) - forearm_tilt(arm)

    # Wrist: M = Rx(-A4) Ry(A5) Rx(-A6), the remaining rotation past the forearm; of its rows what is needed.
    (s1, c1), (s23, c23) = sine_and_cosine(a1), sine_and_cosine(a2 + a3)
    level = c1 * fz[0] - s1 * fz[1]
    m00, m10, m20 = c23 * level - s23 * fz[2], s1 * fz[0] + c1 * fz[1], s23 * level + c23 * fz[2]
    m01 = c23 * (c1 * fy[0] - s1 * fy[1]) - s23 * fy[2]
    m02 = s23 * fx[2] - c23 * (c1 * fx[0] - s1 * fx[1])
    slant = np.sqrt(m01 * m01 + m02 * m02)
    sign = np.where(flipped, -1.0, 1.0)
    a4 = -np.arctan2(sign * m10, -sign * m20)
    a5 = sign * np.arctan2(slant, m00)
    a6 = -np.arctan2(sign * m01, sign * m02)
    straight = np.flatnonzero(slant < _SINGULAR)
    if len(straight):
        at = near[straight, 3]
        m11, m12 = ((s1 * axis[0] + c1 * axis[1])[straight] for axis in (fy, fx))
        a4[straight], a6[straight] = at, np.arctan2(-m12, m11) - at
    q = np.empty((len(a1), 6))
    for axis, angle in ((0, a1), (3, a4), (5, a6)):
        q[:, axis] = near[:, axis] + wrapped(angle - near[:, axis])
    q[:, 1], q[:, 2], q[:, 4] = wrapped(a2), wrapped(a3), a5
    return Inverse(q, reachable & np.isfinite(q).all(axis=1))


def forearm_tilt(arm: KukaLengths) -> float:
    """Angle [rad] of the line axis 3 to wrist centre below the forearm's own axis; A3 = -tilt is stretched."""
    return float(np.arctan2(-arm.a3, arm.d4))


def branch_of(arm: Geometry, q: Floats) -> Ints:
    """(N,) the branch of joint values (N, n) [rad, m]; 0 for an arm without closed form."""
    if isinstance(arm, SerialArm):
        return np.zeros(len(q), np.int64)
    lengths = arm if isinstance(arm, KukaLengths) else arm.lengths
    q = kuka_angles(arm, q)
    tilt = forearm_tilt(lengths)
    wrist = lengths.a1 + lengths.a2 * np.cos(q[:, 1])
    wrist = wrist + np.hypot(lengths.d4, lengths.a3) * np.cos(q[:, 1] + q[:, 2] + tilt)
    behind, elbow, flipped = wrist < 0, wrapped(q[:, 2] + tilt) > 0, q[:, 4] < 0
    return np.asarray(
        BranchBit.WRIST_BEHIND * behind.astype(np.int64)
        + BranchBit.ELBOW * elbow
        + BranchBit.FLIPPED * flipped
    )
