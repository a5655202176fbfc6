"""How far joint values are from the places in which axes turn far for a small step."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.robot.axis_track import WEAK
from postproc.robot.description import Robot
from postproc.robot.geometries import KukaLengths, SerialArm
from postproc.robot.inverse import forearm_tilt, kuka_angles
from postproc.robot.newton import weakest

SINE, ACROSS = 0.02, 0.03
"""Sine of A5 and of the stretched arm, and distance [m] of the wrist from axis 1, at which a posture is reported as
near to a singularity (``axis_track.is_near_singular``): each counts as the same angle of asin(0.02)."""


def singularity_angle(robot: Robot, q: Floats) -> Floats:
    """(N,) [rad] distance of ``q`` (N, n) [rad, m] from the nearest singularity, as an angle of A5.

    KUKA-type arms: the least of A5 from 0, of A3 from the stretched arm, and of the wrist centre from axis 1, of which
    30 mm count as 1.15 deg.  Others: of the smallest singular value of the Jacobian ``WEAK`` counts as 1.15 deg.
    """
    if isinstance(robot.nominal, SerialArm):
        sine = SINE * weakest(robot.nominal, q) / WEAK
    else:
        arm = robot.nominal if isinstance(robot.nominal, KukaLengths) else robot.nominal.lengths
        angles = kuka_angles(robot.nominal, q)
        stretched = angles[:, 2] + forearm_tilt(arm)
        wrist = arm.a1 + arm.a2 * np.cos(angles[:, 1])
        wrist = wrist + np.hypot(arm.d4, arm.a3) * np.cos(angles[:, 1] + stretched)
        sine = np.minimum(np.abs(np.sin(angles[:, 4])), np.abs(np.sin(stretched)))
        sine = np.minimum(sine, SINE / ACROSS * np.abs(wrist))
    return np.asarray(np.arcsin(np.minimum(sine, 1.0)))
