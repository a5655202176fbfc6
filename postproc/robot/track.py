"""The axis angles of a program, motion by motion, as its controller would take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.geometry import Poses, wrapped
from postproc.robot.chain import Chain
from postproc.robot.description import Robot
from postproc.robot.inverse import inverse, status_of, turn_of
from postproc.toolpath import Kind, Toolpath
from postproc.units import DEG

_TURNING = [0, 3, 5]
"""Axes that can make more than half a turn to either side: A1, A4, A6."""

SIGN_MARGIN = 0.01 * DEG
"""An axis nearer to zero than this satisfies either sign of T: taught values are rounded."""


@dataclass(frozen=True)
class Track:
    """q (N, 6) [rad], NaN where unknown or out of reach; status (N,) branch taken, -1 where nothing says it;
    reachable (N,); within (N,) inside of the axis limits; turn_holds (N,) the stated T is that of ``q``."""

    q: Floats
    status: Ints
    reachable: Bools
    within: Bools
    turn_holds: Bools


def follow(robot: Robot, toolpath: Toolpath, flange: Poses, start: Floats | None) -> Track:
    """Axis angles of all motions.  ``flange`` (N): targets of the flange in the robot base; ``start`` (6,) [rad]: axes
    before the first motion, if known.

    A PTP takes the branch of its S and the turns of its T; without them, and on every path motion, the branch stays
    and each axis goes the short way.  After a PTP to an unknown target the branch is unknown until something says it.
    """
    n = len(toolpath)
    on_axes = np.asarray(np.isfinite(toolpath.axes).all(axis=1))
    cartesian = np.asarray(toolpath.known & np.isfinite(flange.position).all(axis=1) & ~on_axes)
    status = _branches(robot, toolpath, on_axes, cartesian, start)

    q = np.full((n, 6), np.nan)
    q[on_axes] = toolpath.axes[on_axes]
    solve = np.flatnonzero(cartesian & (status >= 0))
    found = inverse(robot.nominal, flange[solve], status[solve], np.zeros((len(solve), 6)))
    q[solve] = found.q
    reachable = ~cartesian | (status < 0)
    reachable[solve] = found.reachable
    _settle(q, toolpath, start)

    low, high = robot.limits.T
    margin = 1e-9
    within = ~((q < low - margin) | (q > high + margin)).any(axis=1)
    stated = toolpath.turn >= 0
    bits = (toolpath.turn[:, None] >> np.arange(6)) & 1 == 1
    wrong = (bits != (q < 0)) & (np.abs(q) > SIGN_MARGIN) & np.isfinite(q)
    return Track(q, status, reachable, within, ~(stated & cartesian & wrong.any(axis=1)))


def _branches(
    robot: Robot, toolpath: Toolpath, on_axes: Bools, cartesian: Bools, start: Floats | None
) -> Ints:
    """(N,) the branch in force at each motion."""
    jump = np.isin(toolpath.kind, (Kind.PTP, Kind.AXIS))
    stated = jump & cartesian & (toolpath.status >= 0)
    lost = (jump & ~on_axes & ~cartesian) | (toolpath.kind == Kind.OTHER)
    home = np.array([row for row, finding in toolpath.refused.items() if finding.code == "KRL016"], np.int64)
    value = np.full(len(toolpath) + 1, -1)
    value[0] = -1 if start is None else status_of(robot.nominal, start[None])[0]
    value[1:][on_axes] = status_of(robot.nominal, toolpath.axes[on_axes])
    value[1:][stated] = toolpath.status[stated] & 7
    value[1:][home] = value[0]  # the controller's HOME is where a program starts
    sets = np.concatenate([[True], on_axes | stated | lost])
    return np.asarray(value[np.maximum.accumulate(np.where(sets, np.arange(len(sets)), 0))][1:])


def _settle(q: Floats, toolpath: Toolpath, start: Floats | None) -> None:
    """Choose the turns of A1, A4, A6 in place, and A4 where A5 = 0 leaves it open."""
    rows = np.flatnonzero(np.isfinite(q).all(axis=1))
    if not len(rows):
        return
    given = np.isfinite(toolpath.axes[rows]).all(axis=1)
    values = q[rows]
    if start is not None:
        rows, given = np.concatenate([[-1], rows]), np.concatenate([[True], given])
        values = np.concatenate([start[None], values])
    order = np.arange(len(rows))
    straight = (np.abs(np.sin(values[:, 4])) < 1e-9) & ~given
    source = np.maximum.accumulate(np.where(straight, 0, order))
    total = values[:, 3] + values[:, 5]
    values[:, 3] = values[source, 3]
    values[:, 5] = np.where(straight, wrapped(total - values[:, 3]), values[:, 5])

    turn = np.where(rows >= 0, toolpath.turn[rows], -1)
    stated = (turn >= 0) & (np.where(rows >= 0, toolpath.kind[rows], -1) == Kind.PTP)
    for axis in _TURNING:
        value = values[:, axis]
        signed = np.where(
            (turn >> axis) & 1 == 1,
            np.where(value > SIGN_MARGIN, value - 2 * np.pi, value),
            np.where(value < -SIGN_MARGIN, value + 2 * np.pi, value),
        )
        reset = given | stated
        reset[0] = True
        wish = np.where(given | ~stated, value, signed)
        smooth = np.concatenate([[value[0]], value[0] + np.cumsum(wrapped(np.diff(value)))])
        last = np.maximum.accumulate(np.where(reset, order, 0))
        turns = np.round((smooth + (wish - smooth)[last] - value) / (2 * np.pi))
        values[:, axis] = value + 2 * np.pi * turns
    keep = rows >= 0
    q[rows[keep]] = values[keep]


def nominal_flange(robot: Robot, q: Floats) -> Poses:
    """Flange poses (N) that the controller computes from axis angles (N, 6) [rad]."""
    limits = [(joint.lower, joint.upper) for joint in robot.joints]
    joints = robot.nominal.joints([joint.name for joint in robot.joints], limits)
    return Chain(joints, robot.nominal.flange()).flange(q)


def sides(robot: Robot, q: Floats) -> tuple[Ints, Ints]:
    """S and T (N,) of axis angles, as the program would state them."""
    return status_of(robot.nominal, q), turn_of(q)


def near_singular(robot: Robot, q: Floats) -> Bools:
    """(N,) close to a place where axes turn far for a small step: A5 near 0, wrist over axis 1, arm stretched.

    Within about 1.1 deg of A5 = 0 or of the stretched arm (sine 0.02), or the wrist centre within 30 mm of axis 1.
    """
    arm = robot.nominal
    tilt = float(np.arctan2(-arm.a3, arm.d4))
    reach = np.hypot(arm.d4, arm.a3)
    across = arm.a1 + arm.a2 * np.cos(q[:, 1]) + reach * np.cos(q[:, 1] + q[:, 2] + tilt)
    close = [np.abs(np.sin(q[:, 4])) < 0.02, np.abs(across) < 0.03, np.abs(np.sin(q[:, 2] + tilt)) < 0.02]
    return np.asarray(np.any(close, axis=0))
