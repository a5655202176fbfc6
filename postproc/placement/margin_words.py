"""Which limit of the robot a posture is nearest to, and by how much a place is out of reach, in words."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.robot.axis_track import singular_words
from postproc.robot.description import Robot
from postproc.robot.geometries import KukaLengths, SerialArm


def margin_words(robot: Robot, q: Floats, singular: float, margins: tuple[float, float]) -> str:
    """What is wrong with the posture ``q`` (n,) [rad, m]: which axis is how far from which limit, or how far the
    posture is from a singularity, ``singular`` [rad]; "" where it keeps both ``margins`` [deg]."""
    low, high = robot.limits.T
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    # an axis that turns less than once is as far beyond its limit as on the shorter way round
    round_ = np.where(turns & (high - low < 2 * np.pi), 2 * np.pi * np.array([[-1.0], [0.0], [1.0]]), 0.0)
    each = np.minimum(q + round_ - low, high - q - round_)
    q, room = q + np.take_along_axis(round_, each.argmax(axis=0)[None], axis=0)[0], each.max(axis=0)
    # a linear axis may use all of its travel
    axis = int(np.where(turns | (room < -1e-9), room, np.inf).argmin())
    if room[axis] < margins[0] * DEG and (turns[axis] or room[axis] < -1e-9):
        unit, word = (DEG, "deg") if turns[axis] else (MM, "mm")
        end = low[axis] if q[axis] - low[axis] < high[axis] - q[axis] else high[axis]
        side = "from" if room[axis] >= 0 else "beyond"
        where = f"{abs(room[axis]) / unit:.1f} {word} {side} its limit of {end / unit + 0.0:g} {word}"
        margin = f" (margin {margins[0]:g} deg)" if turns[axis] else ""
        return f"{robot.joints[axis].name} is {where}{margin}"
    if singular < margins[1] * DEG:
        kinds = singular_words(robot)
        return f"the arm is {singular / DEG:.1f} deg from a singularity (margin {margins[1]:g} deg; {kinds})"
    return ""


def reach_words(shortfall: float) -> str:
    """Of a target that the arm is too short or too long for, by ``shortfall`` [m], NaN where that is not known; 0 where
    it is within reach in another configuration."""
    if shortfall == 0:
        return "the target is out of reach in this configuration"
    return "the target is out of reach" + (f" by {shortfall / MM:.0f} mm" if shortfall > 0 else "")


def reach_shortfall(robot: Robot, flange: Poses) -> Floats:
    """(N,) [m] by how much the wrist centre of ``flange`` (N) in the robot's own base is farther than a KUKA-type arm
    reaches, or nearer than it folds, on the side that is nearer; 0 within, NaN for other arms and for one on a rail."""
    arm = robot.nominal
    if isinstance(arm, SerialArm) or (not isinstance(arm, KukaLengths) and arm.rail is not None):
        return np.full(len(flange), np.nan)
    lengths = arm if isinstance(arm, KukaLengths) else arm.lengths
    x, y, z = (flange.position - lengths.d6 * flange.rotation[:, :, 2]).T
    across, up, second = np.hypot(x, y), z - lengths.d1, np.hypot(lengths.d4, lengths.a3)
    short = np.full(len(flange), np.inf)
    for forward in (across - lengths.a1, -across - lengths.a1):
        distance = np.hypot(forward, up)
        beyond = np.maximum(distance - (lengths.a2 + second), abs(lengths.a2 - second) - distance)
        short = np.minimum(short, np.maximum(beyond, 0.0))
    return short
