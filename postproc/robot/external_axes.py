"""External axes: tracks that carry the robot, positioners that carry the part.

The poses of a motion are handled in its *path axes*: the robot base for external axes at zero, turning with the part
where a positioner carries that.  A straight motion in its programmed base is straight there whatever the external axes
do; what they do is that the robot is elsewhere:

    robot_from_path(E) = T(E)^-1 C(E),    T = sum of E_k d_k over the tracks,    C = product of exp(E_k a_k) over the
                                          positioners that carry the base, the lowest first

with d_k and a_k (a line in space) given for all axes at zero.  Along the path of a motion E goes evenly from where the
one before it ends to where its own ends, as a controller takes synchronous axes along.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, is_shared
from postproc.base.geometry import Poses, rotation_from_vector, turned
from postproc.base.units import DEG, MM
from postproc.robot.description import Robot
from postproc.toolpath import FrameRef, Toolpath, external_at

NAMES = ("E1", "E2", "E3", "E4", "E5", "E6")

TRACK, POSITIONER, FIXED = "track", "positioner", "fixed"

FAR_MM, FAR_DEG = 30.0, 3.0
"""What an external axis may move on a motion without its path being looked at more closely."""


@dataclass(frozen=True, eq=False)
class ExternalAxis:
    """One external axis of a cell.

    kind: TRACK (E moves the robot along ``direction``), POSITIONER (E turns the part about the line through ``point``
    along ``direction``) or FIXED (it moves neither).  direction (3,): unit vector, point (3,) [m], both in the world
    with all external axes at zero.  lower, upper, start [mm or deg]; start: where the axis is before a program
    states it, None where nothing states it.  bases: numbers of those that are on a positioner; on: the positioner on
    which this one is mounted.  line: of the cell file.  word: the address that programs in G-code have for it (Y2, U),
    "" for its name.
    """

    name: str
    kind: str
    direction: Floats
    point: Floats
    lower: float
    upper: float
    start: float | None = None
    bases: tuple[int, ...] = ()
    on: str | None = None
    line: int = 0
    word: str = ""

    @property
    def column(self) -> int:
        return NAMES.index(self.name)


@dataclass(frozen=True, eq=False)
class _PositionerAxis:
    """A turning axis of a positioner in path axes: its column of E, unit vector (3,) and a point of it (3,) [m]."""

    column: int
    axis: Floats
    point: Floats


def own_column(robot: Robot) -> int | None:
    """The column of E1..E6 that moves the robot's own external joint: that of its name."""
    if robot.external is None:
        return None
    name = robot.joints[robot.external].name.upper()
    return NAMES.index(name) if name in NAMES else None


def joint_unit(robot: Robot) -> float:
    """SI units in one unit of the text, of the robot's own external joint."""
    assert robot.external is not None
    return DEG if robot.joints[robot.external].kind == "revolute" else MM


@dataclass(frozen=True, eq=False)
class External:
    """Where external axes bring robot and part along the path of N motions.

    path: the motions, with E at the end of each, NaN where it is not known; joint: column of E, column of the
    robot's joints and unit of the robot's own external joint, None where that is still; tracks: column of E and
    direction (3,) of each; positioners: their turning axes, from the lowest to the one that carries the part; carriers:
    number of a base -> the positioner that it is on; carrier (N,): that of each motion's base, -1 for none.
    constant: ``robot_from_path`` without a positioner and with each of them, where no track or positioner moves: then
    the base of a motion is taken as if it were there, and path axes are those of the robot base.
    """

    path: Toolpath
    joint: tuple[int, int, float] | None
    tracks: tuple[tuple[int, Floats], ...]
    positioners: tuple[tuple[_PositionerAxis, ...], ...]
    carriers: dict[int, int]
    carrier: Ints
    constant: tuple[Poses, ...] | None = None

    @staticmethod
    def of(path: Toolpath, axes: Sequence[ExternalAxis], robot: Robot, robot_base: Poses) -> External | None:
        """``path``: with its external axes filled in; ``axes``: of the cell; ``robot_base``: in the world.  None where
        no external axis moves robot or part."""
        own = own_column(robot)
        axes = [axis for axis in axes if axis.kind != FIXED]
        if own is None and not axes:
            return None
        to_root = robot_base.inverse()
        needed = needed_rows(path)
        changes = _changes(path.external, needed)
        joint = None
        if own is not None and robot.external is not None and changes[own]:
            joint = own, robot.external, joint_unit(robot)
        holders = [axis for axis in axes if axis.bases]
        carriers = {base: i for i, axis in enumerate(holders) for base in axis.bases}
        of_frame = np.array([*(carriers.get(frame.entry or 0, -1) for frame in path.frames), -1], np.int8)
        external = External(
            path,
            joint,
            tuple((a.column, turned(to_root.rotation, a.direction)) for a in axes if a.kind == TRACK),
            tuple(_stack(axis, axes, to_root) for axis in holders),
            carriers,
            of_frame[path.base],
        )
        if any(changes[axis.column] for axis in axes):
            return external
        first = np.nan_to_num(_first(path.external, needed))
        which = np.arange(-1, len(holders))
        placed = external.placed(np.tile(first, (len(which), 1)), which)
        return replace(external, constant=tuple(placed[i] for i in range(len(which))))

    def base_moved(self, frame: FrameRef) -> Poses:
        """By how much a base is elsewhere in the robot base than with all external axes at zero, where none moves."""
        if self.constant is None:
            return Poses.identity()
        return self.constant[1 + self.carriers.get(frame.entry or 0, -1)]

    @cached_property
    def turns_part(self) -> Bools:
        """(N,) the base of the motion is on a positioner, and external axes move in this program."""
        return np.asarray((self.carrier >= 0) & (self.constant is None))

    @cached_property
    def changes_carrier(self) -> Bools:
        """(N,) the base of the motion is on another thing than that of the motion before it, and axes move."""
        other = np.append(False, self.carrier[1:] != self.carrier[:-1])[: len(self.carrier)]
        return np.asarray(other & (self.constant is None))

    def at(self, rows: Ints, share: Floats | None = None) -> Floats:
        """(K, 6) [mm or deg] E at the shares (K,) of the paths of motions ``rows`` (K,); without, at their ends."""
        return external_at(self.path, rows, share)

    def moves(self, rows: Ints) -> Bools:
        """(K,) an external axis moves so far on the motion of ``rows`` (K,) that its middle does not represent the
        rest."""
        with np.errstate(invalid="ignore"):  # axes that are not known
            travel = np.abs(self.at(rows) - self.at(rows, np.zeros(len(rows))))
        far = np.zeros(len(rows), np.bool_)
        for column, _ in self.tracks:
            far |= travel[:, column] > FAR_MM
        for column in {turn.column for stack in self.positioners for turn in stack}:
            far |= travel[:, column] > FAR_DEG
        if self.joint is not None:
            column, _, unit = self.joint
            far |= travel[:, column] > (FAR_DEG if unit == DEG else FAR_MM)
        return far

    def robot_from_path(self, rows: Ints, share: Floats | None = None) -> Poses | None:
        """Path axes of motions ``rows`` (K,) in the robot base at the shares (K,) of their paths, without at their
        ends; None where they are the robot base."""
        if self.constant is not None:
            return None
        return self.placed(self.at(rows, share), self.carrier[rows])

    def in_path(self, rows: Ints, share: Floats | None, pose: Poses) -> Poses:
        """``pose`` (K) in the robot's own base, in path axes of ``rows`` (K,) at the shares (K,) of their paths."""
        placed = self.robot_from_path(rows, share)
        return pose if placed is None else placed.inverse() @ pose

    def start_from_end(self, rows: Ints) -> Poses:
        """(K) path axes of the motions before ``rows`` (K,) in those of ``rows``, where these start."""
        values = self.at(rows, np.zeros(len(rows)))
        before = self.carrier[np.maximum(rows - 1, 0)]
        return self.placed(values, self.carrier[rows]).inverse() @ self.placed(values, before)

    def placed(self, values: Floats, carrier: Ints) -> Poses:
        """(K) path axes in the robot base with the external axes at ``values`` (K, 6), on ``carrier`` (K,)."""
        shift = np.zeros((len(values), 3))
        for column, direction in self.tracks:
            shift -= (values[:, column] * MM)[:, None] * direction
        poses = Poses(np.broadcast_to(np.eye(3), (len(values), 3, 3)), shift)
        for number, stack in enumerate(self.positioners):
            rows = np.flatnonzero(carrier == number)
            if not len(rows):
                continue
            poses = poses.copy()
            there = poses[rows]
            for turn in stack:
                there = there @ _turned(turn, values[rows, turn.column] * DEG)
            poses.put(rows, there)
        return poses

    def joint_values(self, q: Floats, rows: Ints, share: Floats | None) -> Floats:
        """(K, n) [rad, m]: ``q`` (K, n) of motions ``rows`` (K,) with the robot's own external joint where it is at the
        shares (K,) of their paths."""
        if self.joint is None or share is None:
            return q
        column, joint, unit = self.joint
        q = q.copy()
        q[:, joint] = self.at(rows, share)[:, column] * unit
        return q


def needed_rows(path: Toolpath) -> Bools:
    """(N,) motions of which it matters where the external axes are: those that lead to a place that is known."""
    needed = (
        path.known
        | path.on_axes
        | ((path.partial_targets.inherits_from_row >= 0) & (path.base >= 0) & (path.tool >= 0))
    )
    if path.constraints.refused:
        needed = needed.copy()
        needed[list(path.constraints.refused)] = False
    return np.asarray(needed)


def _changes(values: Floats, needed: Bools) -> Bools:
    """(6,) axes that are not at one place in all ``needed`` (N,) of ``values`` (N, 6)."""
    if is_shared(values):
        return np.zeros(6, np.bool_)
    seen = needed[:, None] & np.isfinite(values)
    low = np.where(seen, values, np.inf).min(axis=0, initial=np.inf)
    high = np.where(seen, values, -np.inf).max(axis=0, initial=-np.inf)
    return np.asarray(high > low)


def _first(values: Floats, needed: Bools) -> Floats:
    """(6,) the first number of each axis among the ``needed`` (N,) of ``values`` (N, 6), NaN where there is none."""
    if not len(values):
        return np.full(6, np.nan)
    seen = needed[:, None] & np.isfinite(values)
    at = np.argmax(seen, axis=0)
    return np.where(seen.any(axis=0), values[at, np.arange(6)], np.nan)


def _stack(top: ExternalAxis, axes: Sequence[ExternalAxis], to_root: Poses) -> tuple[_PositionerAxis, ...]:
    """The turning axes that carry what is on ``top``, the lowest first, in the robot base with all at zero."""
    named, stack = {axis.name: axis for axis in axes}, [top]
    while (below := stack[-1].on) is not None:
        stack.append(named[below])
    return tuple(
        _PositionerAxis(
            axis.column,
            turned(to_root.rotation, axis.direction),
            to_root.position + turned(to_root.rotation, axis.point),
        )
        for axis in reversed(stack)
    )


def _turned(turn: _PositionerAxis, angle: Floats) -> Poses:
    """(K) the motion of space by ``angle`` (K,) [rad] about the axis: x -> p + R (x - p)."""
    rotation = rotation_from_vector(angle[:, None] * turn.axis)
    return Poses(rotation, turn.point - turned(rotation, np.broadcast_to(turn.point, (len(angle), 3))))
