"""The axis angles of a program, motion by motion, as its controller would take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block, in_blocks
from postproc.base.findings import Topic
from postproc.base.geometry import Placed, Poses, wrapped
from postproc.robot.description import Robot
from postproc.robot.external_axes import joint_unit, own_column
from postproc.robot.geometries import KukaLengths, SerialArm
from postproc.robot.half_turns import (
    EVEN,
    HALF,
    LARGE,
    TURNING,
    WIDE,
    HalfTurns,
    PathMotions,
    TurnChoices,
    choose_senses,
    signed,
    turn_senses,
)
from postproc.robot.inverse import branch_of, controller_values, inverse, kuka_angles
from postproc.robot.makers import SIGN_MARGIN, maker_of
from postproc.robot.newton import follow_rows, weakest
from postproc.toolpath import Kind, Toolpath

WEAK = 0.004
"""Smallest singular value of a general arm's Jacobian (lengths as parts of its size) below which axes turn far.  It
marks about as many states of a KR 270 as the places of its closed form do."""


@dataclass(frozen=True)
class AxisTrack:
    """q (N, n) [rad, m], NaN where unknown or out of reach; branch (N,) that is taken (see ``BranchBit``),
    -1 where nothing states it; reachable (N,); within (N,) inside of the axis limits; turn_matches (N,) the stated
    turns are those of ``q``; half_turns: path motions that turn the tool by half a turn, and in which sense."""

    q: Floats
    branch: Ints
    reachable: Bools
    within: Bools
    turn_matches: Bools
    half_turns: HalfTurns = field(default_factory=HalfTurns)


def follow_axes(
    robot: Robot,
    toolpath: Toolpath,
    flange: Placed,
    start: Floats | None,
    base: Poses | None = None,
    tool: Poses | None = None,
) -> AxisTrack:
    """Joint values of all motions.  ``flange`` (N): targets of the flange in the robot base; ``start`` (n,) [rad, m]:
    values before the first motion, if known.  An external joint is where the program has it (see ``external_joint``).
    ``base``, ``tool`` (N): frames of the motions, in the robot base and on the flange, where there are any.

    Arms of closed form: a PTP takes the branch and the turns that it states; without them the branch stays and each
    axis takes the shorter turn.  On path motions the branch stays and the axes follow the path (see ``HalfTurns``).
    After a PTP to an unknown target the branch is unknown until something states it.

    Other arms have no branches.  Each motion is solved from the one before it (see ``newton.follow_rows``), so branch
    and turns are those that lead on from ``start`` or from the last axis motion; only a PTP may take others, where
    these have no path to its target within the limits.  A motion that cannot be reached is passed over.
    """
    n = len(toolpath)
    rows = np.flatnonzero(toolpath.on_axes)
    external = external_joint(robot, toolpath, np.arange(n), start)
    axes = all_axes(robot, toolpath.axes[rows], external[rows])
    on_axes = np.zeros(n, bool)
    on_axes[rows] = np.isfinite(axes).all(axis=1)
    axes = axes[on_axes[rows]]
    placed = in_blocks(lambda part: np.isfinite(flange[part].position).all(axis=1), n)
    cartesian = np.concatenate([np.empty(0, bool), *placed]) & toolpath.known & ~toolpath.on_axes
    branch = _branches(robot, toolpath, axes, on_axes, cartesian, start)
    if robot.external is not None:
        branch = np.where(np.isnan(external), -1, branch)  # nothing states where it is

    q = np.full((n, len(robot.joints)), np.nan)
    q[on_axes] = axes
    solve = np.flatnonzero(cartesian & (branch >= 0))
    reachable = ~cartesian | (branch < 0)
    turn_holds, half_turns = np.ones(n, bool), HalfTurns()
    if isinstance(robot.nominal, SerialArm):
        _follow_on(robot, toolpath, flange, on_axes, solve, start, external, q)
        reachable[solve] = np.isfinite(q[solve]).all(axis=1)
    else:

        def solve_block(part: slice) -> None:
            rows = solve[part]
            near = np.zeros((len(rows), q.shape[1]))
            if robot.external is not None:
                near[:, robot.external] = external[rows]
            solution = inverse(robot.nominal, flange[rows], branch[rows], near)
            q[rows], reachable[rows] = solution.q, solution.reachable

        each_block(solve_block, len(solve))
        half_turns = _settle(robot, q, branch, toolpath, on_axes, start, base, tool)
        stated = np.flatnonzero(toolpath.configuration.stated & cartesian)
        maker = maker_of(toolpath.configuration)
        turn_holds[stated] = maker.turns_match(toolpath.configuration.of(stated), q[stated])

    low, high = robot.limits.T
    margin = 1e-9
    within = ~((q < low - margin) | (q > high + margin)).any(axis=1)
    return AxisTrack(q, branch, reachable, within, turn_holds, half_turns)


def branch_matches(toolpath: Toolpath, track: AxisTrack) -> Bools:
    """(N,) the stated branch, if there is one, is that taken."""
    stated = maker_of(toolpath.configuration).branches(toolpath.configuration)
    return np.asarray((stated < 0) | (track.branch < 0) | (stated == track.branch))


def external_joint(robot: Robot, toolpath: Toolpath, rows: Ints, start: Floats | None) -> Floats:
    """(K,) [rad, m] the robot's own external joint at the end of motions ``rows`` (K,): as the program has the axis of
    its name (E1..E6), and where that has not stated it, as ``start`` (n,) has it; NaN where nothing states it."""
    begun = np.nan if start is None or robot.external is None else start[robot.external]
    column = own_column(robot)
    if column is None:
        return np.broadcast_to(begun, rows.shape)
    values = toolpath.external[rows, column] * joint_unit(robot)
    return np.where(np.isnan(values), begun, np.where(np.isinf(values), np.nan, values))


def all_axes(robot: Robot, axes: Floats, external: Floats) -> Floats:
    """(N, n) values of all joints from the six (N, 6) that a program states and ``external`` (N,), that of the external
    joint."""
    if robot.external is None:
        return robot.joint_values(axes)
    values = np.full((len(axes), len(robot.joints)), np.nan)
    values[:, robot.programmed] = axes
    values[:, robot.external] = external
    return robot.joint_values(values)


def _follow_on(
    robot: Robot,
    toolpath: Toolpath,
    flange: Placed,
    on_axes: Bools,
    solve: Ints,
    start: Floats | None,
    external: Floats,
    q: Floats,
) -> None:
    """Fill in q of the rows ``solve``, each from the row before it or from the axis motion between them."""
    if not len(solve):
        return
    assert isinstance(robot.nominal, SerialArm)
    anchor = np.where(on_axes, np.arange(len(toolpath)), -1)
    home = home_rows(toolpath)
    anchor[home] = -2  # where the program starts
    # the last anchor before each row; -2 as well before the first one
    place = np.maximum.accumulate(np.where(anchor != -1, np.arange(len(toolpath)), -1))
    last = np.where(place >= 0, anchor[place], -2)[solve]
    where = place[solve]
    is_start = np.concatenate([[True], where[1:] != where[:-1]])
    program_start = np.full(q.shape[1], np.nan) if start is None else start
    starts = np.where((last >= 0)[:, None], q[np.maximum(last, 0)], program_start)
    jumps = np.asarray(toolpath.kind[solve] == Kind.PTP)
    fixed_values = None if robot.external is None else external[solve]
    q[solve], _ = follow_rows(robot.nominal, flange[solve], is_start, starts, jumps, fixed_values)


def home_rows(toolpath: Toolpath) -> Ints:
    """Rows (K,) that go to the controller's HOME, which is where a program starts."""
    return np.array(
        [row for row, finding in toolpath.constraints.refused.items() if finding.topic is Topic.HOME],
        np.int64,
    )


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
    branch = maker_of(toolpath.configuration).branches(toolpath.configuration)
    stated = jump & cartesian & (branch >= 0)
    if isinstance(robot.nominal, SerialArm):
        stated = np.zeros_like(stated)
    # A path motion keeps its branch wherever it leads; only a jump to an unknown place loses it.
    lost = (
        toolpath.constraints.ptp_may_change_configuration
        & (jump | (toolpath.kind == Kind.OTHER))
        & ~on_axes
        & ~cartesian
    )
    home = home_rows(toolpath)
    value = np.full(len(toolpath) + 1, -1, np.int8)
    value[0] = -1 if start is None else branch_of(robot.nominal, start[None])[0]
    value[1:][on_axes] = branch_of(robot.nominal, axes)
    value[1:][stated] = branch[stated]
    value[1:][home] = value[0]
    sets = np.concatenate([[True], on_axes | stated | lost])
    meets = np.flatnonzero(toolpath.paths_meet & ~sets[1:])
    sets[meets + 1] = True
    source = np.maximum.accumulate(np.where(sets, np.arange(len(sets)), 0))
    _join_branches(value, source, meets, toolpath.predecessors, isinstance(robot.nominal, SerialArm))
    return np.asarray(value[source][1:])


_UNSEEN = -2


def _join_branches(
    value: Ints, source: Ints, meets: Ints, predecessors: Mapping[int, tuple[int, ...]], serial: bool
) -> None:
    """Puts in the branch in force at the motions ``meets`` (M,), which several may precede: the one that all of these
    have, else -1.  value (N + 1,): that of the start and of the motions that set it; source (N + 1,): which of these
    is in force after each.  An arm that is followed motion by motion has none there."""
    value[meets + 1] = -1 if serial else _UNSEEN
    changed = not serial
    while changed:
        changed = False
        for row in meets.tolist():
            before = predecessors.get(row, ())
            found = {int(value[source[one + 1]]) for one in before if one >= -1} - {_UNSEEN}
            if not before or before[0] < -1 or len(found) > 1:
                found = {-1}
            new = found.pop() if found else _UNSEEN
            changed |= new != value[row + 1]
            value[row + 1] = new
    value[value == _UNSEEN] = -1


def _settle(
    robot: Robot,
    q: Floats,
    branch: Ints,
    toolpath: Toolpath,
    on_axes: Bools,
    start: Floats | None,
    base: Poses | None,
    tool: Poses | None,
) -> HalfTurns:
    """Choose the turns of A1, A4, A6 in place, and A4 where A5 = 0 does not determine it; gives the half turns among
    them."""
    arm = robot.nominal
    assert not isinstance(arm, SerialArm)
    rows = np.flatnonzero(np.isfinite(q).all(axis=1))
    if not len(rows):
        return HalfTurns()
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

    turn = np.where(
        rows >= 0, maker_of(toolpath.configuration).negative_axes(toolpath.configuration)[rows], -1
    )
    stated = (turn >= 0) & (np.where(rows >= 0, toolpath.kind[rows], -1) == Kind.PTP)
    reset = given | stated
    reset |= toolpath.paths_meet[np.maximum(rows, 0)]  # several motions may precede it
    reset[0] = True
    starts, since = np.flatnonzero(reset), np.cumsum(reset) - 1
    large = _large(robot, values, rows, reset, branch, toolpath, base, tool)

    def turned(axis: int, step: Floats) -> tuple[Floats, Floats]:
        """(R,) the values of an axis that goes on from the first, and by how much they are beside those stated."""
        value = values[:, axis - 6]
        by = wrapped(np.diff(value))
        by[large.place - 1] = step
        smooth = np.concatenate([[value[0]], value[0] + np.cumsum(by)])
        own = value[starts]
        signed = np.where(
            (turn[starts] >> axis) & 1 == 1,
            np.where(own > SIGN_MARGIN, own - 2 * np.pi, own),
            np.where(own < -SIGN_MARGIN, own + 2 * np.pi, own),
        )
        wish = np.where((given | ~stated)[starts], own, signed)
        return smooth, (wish - smooth[starts])[since]

    other = np.zeros(len(large.place), np.bool_)
    either = np.flatnonzero(large.either)
    if len(either):
        axes = [sum(turned(axis, large.step[:, k])) for k, axis in enumerate(TURNING)]
        low, high = robot.limits[[axis - 6 for axis in TURNING]].T
        choices = TurnChoices(large.place[either], large.more[either])
        other[either] = choose_senses(np.stack(axes, axis=1), starts, choices, low, high)
    step = large.step + np.where(other[:, None], large.more, 0.0)
    for k, axis in enumerate(TURNING):
        smooth, beside = turned(axis, step[:, k])
        values[:, axis - 6] += 2 * np.pi * np.round((smooth + beside - values[:, axis - 6]) / (2 * np.pi))
    keep = rows >= 0
    q[rows[keep]] = values[keep]
    half = np.flatnonzero(large.either & np.isfinite(large.vector[:, 0, 0]))
    return HalfTurns(rows[large.place[half]], large.vector[half, other[half].astype(np.int64)])


class _Large(NamedTuple):
    """Motions on which axes turn far: place (K,) among all, ascending; step (K, 3) [rad] by which A1, A4, A6 turn; and
    of those that may turn in ``either`` (K,) sense what the other one adds, more (K, 3), and the rotation vectors of
    the tool in both senses, vector (K, 2, 3), NaN for a PTP."""

    place: Ints
    step: Floats
    more: Floats
    vector: Floats
    either: Bools


def _large(
    robot: Robot,
    values: Floats,
    rows: Ints,
    reset: Bools,
    branch: Ints,
    toolpath: Toolpath,
    base: Poses | None,
    tool: Poses | None,
) -> _Large:
    """The motions that do not simply take the shorter turn.  values (R, n): joint values of ``rows`` (R,)."""
    arm = values[:, -6:]
    far = np.zeros(len(rows), np.bool_)
    for axis in range(6):
        far[1:] |= np.abs(np.diff(arm[:, axis])) > LARGE
    arcs = np.flatnonzero(toolpath.kind == Kind.CIRC)
    far[np.isin(rows, arcs[_winds(toolpath, arcs)])] = True
    far &= ~reset
    far[1:] &= np.diff(rows) == 1
    place = np.flatnonzero(far)
    kind, short = toolpath.kind[rows[place]], wrapped(arm[place] - arm[place - 1])
    step, more = short[:, TURNING], np.zeros((len(place), 3))
    vector, either = np.full((len(place), 2, 3), np.nan), np.zeros(len(place), np.bool_)

    # a PTP in which an axis turns by half a turn, alone
    half = (np.abs(step) > np.pi - HALF) & (kind == Kind.PTP)[:, None]
    alone = half & (half.sum(axis=1) == 1)[:, None]
    through = signed(arm[place])[:, TURNING] - signed(arm[place - 1])[:, TURNING]
    step[alone] = np.where(np.abs(step[alone]) > np.pi - EVEN, through[alone], step[alone])
    more[alone] = -np.sign(step[alone]) * 2 * np.pi
    either |= alone.any(axis=1)

    on_path = np.flatnonzero((kind == Kind.LIN) | (kind == Kind.CIRC))
    if len(on_path):
        motions = _motions(robot, values, rows, place[on_path], toolpath, base, tool)
        wide = (
            (np.abs(step[on_path]) > WIDE).any(axis=1) | motions.half | _winds(toolpath, rows[place[on_path]])
        )
        on_path, motions = on_path[wide], motions[np.flatnonzero(wide)]
        at = place[on_path]

        def solve(owner: Ints, flange: Poses) -> Floats:
            near = values[at[owner] - 1]
            return inverse(robot.nominal, flange, branch[rows[at[owner]]], near).q[:, -6:]

        step[on_path], more[on_path], vector[on_path], either[on_path] = turn_senses(
            motions, arm[at - 1], arm[at], solve
        )
    return _Large(place, step, more, vector, either)


def _winds(toolpath: Toolpath, rows: Ints) -> Bools:
    """(K,) arcs on which an axis may turn far and end near its start: long ones, and those that turn the tool."""
    return np.asarray((toolpath.arcs.sweep[rows] > np.pi) | toolpath.arcs.turns_along[rows])


def _motions(
    robot: Robot,
    values: Floats,
    rows: Ints,
    place: Ints,
    toolpath: Toolpath,
    base: Poses | None,
    tool: Poses | None,
) -> PathMotions:
    """The path motions at ``place`` (K,) among ``rows`` (R,), which start where the one before them ends."""
    at, same = rows[place], np.tile(np.eye(3), (len(place), 1, 1))
    nowhere = Poses(same, np.zeros((len(place), 3)))
    frame = nowhere if base is None else base[at]
    return PathMotions(
        nominal_flange(robot, values[place - 1]),
        nominal_flange(robot, values[place]),
        nowhere if tool is None else tool[at],
        (frame @ Poses(same, toolpath.arcs.centre[at])).position,
        (frame.rotation @ toolpath.arcs.normal[at][..., None])[..., 0],
        toolpath.arcs.sweep[at],
        toolpath.arcs.turn(at, frame.rotation),
    )


def nominal_flange(robot: Robot, q: Floats) -> Poses:
    """Flange poses (N) that the controller computes from joint values (N, n) [rad, m]."""
    return robot.nominal_chain.flange(q)


def is_near_singular(robot: Robot, q: Floats) -> Bools:
    """(N,) ``q`` (N, n) [rad, m] is close to a place where axes turn far for a small step.

    Arms of closed form: A5 near 0, wrist over axis 1, arm stretched, that is within about 1.1 deg of A5 = 0 or of the
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
    """What ``is_near_singular`` means on this robot."""
    if isinstance(robot.nominal, SerialArm):
        return "a configuration in which axes move far for a small step"
    names = [joint.name for joint in robot.joints[-6:]]
    return f"{names[4]} near 0, the wrist over axis 1, or the arm stretched"
