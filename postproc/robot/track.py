"""The axis angles of a program, motion by motion, as its controller would take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import each_block, in_blocks
from postproc.geometry import Placed, Poses, wrapped
from postproc.robot.description import Robot
from postproc.robot.geometries import KukaLengths, KukaVariant, SerialArm
from postproc.robot.inverse import controller_values, inverse, kuka_angles, status_of, turn_of
from postproc.robot.newton import follow_rows, weakest
from postproc.toolpath import Kind, Toolpath
from postproc.units import DEG

_TURNING = [0, 3, 5]
"""Axes of a KUKA-type arm that can make more than half a turn to either side: A1, A4, A6."""

SIGN_MARGIN = 0.01 * DEG
"""An axis nearer to zero than this satisfies either sign of T: taught values are rounded."""

WEAK = 0.004
"""Smallest singular value of a general arm's Jacobian (lengths as parts of its size) below which axes turn far.  It
marks about as many states of a KR 270 as the places of its closed form do."""


@dataclass(frozen=True)
class Track:
    """q (N, n) [rad, m], NaN where unknown or out of reach; status (N,) branch taken (0 for an arm that is not KUKA's),
    -1 where nothing says it; reachable (N,); within (N,) inside of the axis limits; turn_holds (N,) the stated T is
    that of ``q``."""

    q: Floats
    status: Ints
    reachable: Bools
    within: Bools
    turn_holds: Bools


def follow(robot: Robot, toolpath: Toolpath, flange: Placed, start: Floats | None) -> Track:
    """Joint values of all motions.  ``flange`` (N): targets of the flange in the robot base; ``start`` (n,) [rad, m]:
    values before the first motion, if known; they give an external joint, which a program does not state, its value.

    KUKA-type arms: a PTP takes the branch of its S and the turns of its T; without them, and on every path motion, the
    branch stays and each axis goes the short way.  After a PTP to an unknown target the branch is unknown until
    something says it.

    Other arms have no S and T.  Each motion is solved from the one before it (see ``newton.follow_rows``), so branch
    and turns are those that lead on from ``start`` or from the last axis motion; only a PTP may take others, where
    these have no way to its target within the limits.  A motion that can not be reached is passed over.
    """
    n = len(toolpath)
    rows = np.flatnonzero(toolpath.on_axes)
    axes = all_axes(robot, toolpath.axes[rows], start)
    on_axes = np.zeros(n, bool)
    on_axes[rows] = np.isfinite(axes).all(axis=1)
    axes = axes[on_axes[rows]]
    placed = in_blocks(lambda part: np.isfinite(flange[part].position).all(axis=1), n)
    cartesian = np.concatenate([np.empty(0, bool), *placed]) & toolpath.known & ~toolpath.on_axes
    status = _branches(robot, toolpath, axes, on_axes, cartesian, start)

    q = np.full((n, len(robot.joints)), np.nan)
    q[on_axes] = axes
    solve = np.flatnonzero(cartesian & (status >= 0))
    reachable = ~cartesian | (status < 0)
    turn_holds = np.ones(n, bool)
    if isinstance(robot.nominal, SerialArm):
        _follow_on(robot, toolpath, flange, on_axes, solve, start, q)
        reachable[solve] = np.isfinite(q[solve]).all(axis=1)
    else:
        near = np.zeros(q.shape[1])
        if robot.external is not None and start is not None:
            near[robot.external] = start[robot.external]

        def solved(part: slice) -> None:
            rows = solve[part]
            found = inverse(robot.nominal, flange[rows], status[rows], np.tile(near, (len(rows), 1)))
            q[rows], reachable[rows] = found.q, found.reachable

        each_block(solved, len(solve))
        _settle(robot.nominal, q, toolpath, on_axes, start)
        stated = np.flatnonzero((toolpath.turn >= 0) & cartesian)
        bits = (toolpath.turn[stated, None] >> np.arange(6)) & 1 == 1
        arm = q[stated, -6:]
        wrong = (bits != (arm < 0)) & (np.abs(arm) > SIGN_MARGIN) & np.isfinite(arm)
        turn_holds[stated] = ~wrong.any(axis=1)

    low, high = robot.limits.T
    margin = 1e-9
    within = ~((q < low - margin) | (q > high + margin)).any(axis=1)
    return Track(q, status, reachable, within, turn_holds)


def all_axes(robot: Robot, axes: Floats, start: Floats | None) -> Floats:
    """(N, n) values of all joints from the six (N, 6) that a program states; the external one is that of ``start``."""
    if robot.external is None:
        return axes
    values = np.full((len(axes), len(robot.joints)), np.nan)
    values[:, robot.programmed] = axes
    if start is not None:
        values[:, robot.external] = start[robot.external]
    return values


def _follow_on(
    robot: Robot,
    toolpath: Toolpath,
    flange: Placed,
    on_axes: Bools,
    solve: Ints,
    start: Floats | None,
    q: Floats,
) -> None:
    """Fill in q of the rows ``solve``, each from the row before it or from the axis motion between them."""
    if not len(solve):
        return
    assert isinstance(robot.nominal, SerialArm)
    anchor = np.where(on_axes, np.arange(len(toolpath)), -1)
    home = _home(toolpath)
    anchor[home] = -2  # where the program starts
    # the last anchor before each row; -2 as well before the first one
    place = np.maximum.accumulate(np.where(anchor != -1, np.arange(len(toolpath)), -1))
    last = np.where(place >= 0, anchor[place], -2)[solve]
    where = place[solve]
    begins = np.concatenate([[True], where[1:] != where[:-1]])
    begun = np.full(q.shape[1], np.nan) if start is None else start
    starts = np.where((last >= 0)[:, None], q[np.maximum(last, 0)], begun)
    jumps = np.asarray(toolpath.kind[solve] == Kind.PTP)
    q[solve], _ = follow_rows(robot.nominal, flange[solve], begins, starts, jumps)


def _home(toolpath: Toolpath) -> Ints:
    """Rows that go to the controller's HOME, which is where a program starts."""
    return np.array([row for row, finding in toolpath.refused.items() if finding.code == "KRL016"], np.int64)


def _branches(
    robot: Robot,
    toolpath: Toolpath,
    axes: Floats,
    on_axes: Bools,
    cartesian: Bools,
    start: Floats | None,
) -> Ints:
    """(N,) the branch in force at each motion; ``axes`` (R, n): of the motions ``on_axes``."""
    jump = np.isin(toolpath.kind, (Kind.PTP, Kind.AXIS))
    stated = jump & cartesian & (toolpath.status >= 0)
    if isinstance(robot.nominal, SerialArm):
        stated = np.zeros_like(stated)
    # A path motion keeps its branch wherever it leads; only a jump to an unknown place loses it.
    lost = toolpath.branches & (jump | (toolpath.kind == Kind.OTHER)) & ~on_axes & ~cartesian
    home = _home(toolpath)
    value = np.full(len(toolpath) + 1, -1, np.int8)
    value[0] = -1 if start is None else status_of(robot.nominal, start[None])[0]
    value[1:][on_axes] = status_of(robot.nominal, axes)
    value[1:][stated] = toolpath.status[stated] & 7
    value[1:][home] = value[0]
    if robot.external is not None and start is None:
        value[:] = -1  # nothing says where the external joint stands
    sets = np.concatenate([[True], on_axes | stated | lost])
    return np.asarray(value[np.maximum.accumulate(np.where(sets, np.arange(len(sets)), 0))][1:])


def _settle(
    arm: KukaLengths | KukaVariant, q: Floats, toolpath: Toolpath, on_axes: Bools, start: Floats | None
) -> None:
    """Choose the turns of A1, A4, A6 in place, and A4 where A5 = 0 leaves it open."""
    rows = np.flatnonzero(np.isfinite(q).all(axis=1))
    if not len(rows):
        return
    given = on_axes[rows]
    values = q[rows]
    if start is not None:
        rows, given = np.concatenate([[-1], rows]), np.concatenate([[True], given])
        values = np.concatenate([start[None], values])
    order = np.arange(len(rows))
    angles = kuka_angles(arm, values)
    straight = (np.abs(np.sin(angles[:, 4])) < 1e-9) & ~given
    if straight.any():
        source = np.maximum.accumulate(np.where(straight, 0, order))
        total = angles[:, 3] + angles[:, 5]
        angles[:, 3] = angles[source, 3]
        angles[:, 5] = np.where(straight, wrapped(total - angles[:, 3]), angles[:, 5])
        values[straight] = controller_values(arm, angles, values)[straight]

    turn = np.where(rows >= 0, toolpath.turn[rows], -1)
    stated = (turn >= 0) & (np.where(rows >= 0, toolpath.kind[rows], -1) == Kind.PTP)
    for axis in _TURNING:
        value = values[:, axis - 6]
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
        values[:, axis - 6] = value + 2 * np.pi * turns
    keep = rows >= 0
    q[rows[keep]] = values[keep]


def nominal_flange(robot: Robot, q: Floats) -> Poses:
    """Flange poses (N) that the controller computes from joint values (N, n) [rad, m]."""
    return robot.nominal_chain.flange(q)


def sides(robot: Robot, q: Floats) -> tuple[Ints, Ints]:
    """S and T (N,) of joint values, as the program would state them; both 0 for an arm that is not KUKA's."""
    if isinstance(robot.nominal, SerialArm):
        return np.zeros(len(q), np.int64), np.zeros(len(q), np.int64)
    return status_of(robot.nominal, q), turn_of(q[:, -6:])


def near_singular(robot: Robot, q: Floats) -> Bools:
    """(N,) close to a place where axes turn far for a small step.

    KUKA-type arms: A5 near 0, wrist over axis 1, arm stretched, that is within about 1.1 deg of A5 = 0 or of the
    stretched arm (sine 0.02), or the wrist centre within 30 mm of axis 1.  Others: the smallest singular value of the
    Jacobian is below ``WEAK``.
    """
    if isinstance(robot.nominal, SerialArm):
        return np.asarray(weakest(robot.nominal, q) < WEAK)
    arm = robot.nominal if isinstance(robot.nominal, KukaLengths) else robot.nominal.lengths
    q = kuka_angles(robot.nominal, q)
    tilt = float(np.arctan2(-arm.a3, arm.d4))
    reach = np.hypot(arm.d4, arm.a3)
    across = arm.a1 + arm.a2 * np.cos(q[:, 1]) + reach * np.cos(q[:, 1] + q[:, 2] + tilt)
    close = [np.abs(np.sin(q[:, 4])) < 0.02, np.abs(across) < 0.03, np.abs(np.sin(q[:, 2] + tilt)) < 0.02]
    return np.asarray(np.any(close, axis=0))


def singular_words(robot: Robot) -> str:
    """What ``near_singular`` means on this robot."""
    if isinstance(robot.nominal, SerialArm):
        return "a posture in which axes turn far for a small step"
    names = [joint.name for joint in robot.joints[-6:]]
    return f"{names[4]} near 0, the wrist over axis 1, or the arm stretched"
