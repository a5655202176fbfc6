"""The kinematic chain, evaluated for whole batches in numpy.

A chain is a row of coordinates, each a turn about or a shift along the z axis of its own frame: the motors, and
between them the extra coordinates that a model asks for by name:

    base.x .y .z .rx .ry .rz         before the first joint, axes of the robot base
    A2.growth                        before joint A2, along the line from the joint before to it
    A2.x .y .z .rx .ry .rz           at joint A2 before its own motion, axes of its frame (z is the joint's axis)
    tool.x .y .z .rx .ry .rz         at the TCP, axes of the tool
    spindle.x .y .z                  at the TCP, z along the spindle, tip-ward

The evaluation works component-wise on arrays with the states in the last, contiguous axis.  The same chain as a model
of Pinocchio is the reference that it is held against; it is made where it is asked for, as Pinocchio takes longer to
load than most programs to compensate, and has no wheels for Windows.

A joint without a motor (``Passive``) is a coordinate too, with the same six before it.  A linkage or a gear makes it
move with the joints that it follows, whatever moves these: their motors or a load.  What pushes it therefore pushes
them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.robot.geometries import Joint

TOOL = Poses.identity()
"""A TCP on the flange itself."""

_SIX = ("x", "y", "z", "rx", "ry", "rz")
# Frames whose z axis is x, y, z of the site: rotations of zeros and ones.
_Z_ALONG = [np.roll(np.eye(3), shift, axis=1) for shift in (2, 1, 0)]


@dataclass(frozen=True)
class ChainKinematics:
    """The chain at N states, component first.

    axes, origins [m]: m times (3, N), of each of the m coordinates, in the robot base; turns (m,): a turn, or else a
    shift; apart (m,): it has another origin than the one before it; spindles: how many of them, the last ones, are the
    spindle's; position (3, N) [m] of the TCP; mount (3, N) [m]: the same without what the spindle's coordinates shift
    it, where the tool's body is; flange: three columns (3, N) and position (3, N) [m] of the flange; links: the three
    columns (3, N) of the frame after each motor; couplings: as of ``Chain``.
    """

    axes: tuple[Floats, ...]
    origins: tuple[Floats, ...]
    turns: Bools
    apart: Bools
    spindles: int
    position: Floats
    mount: Floats
    flange: tuple[tuple[Floats, ...], Floats]
    links: tuple[tuple[Floats, ...], ...]
    couplings: tuple[tuple[int, int, float], ...]
    _columns: tuple[Floats, ...]
    _tool: Floats | None

    @cached_property
    def tcp(self) -> tuple[Floats, ...]:
        """The three columns (3, N) of the TCP's rotation; few that evaluate a chain ask for them."""
        if self._tool is None:
            return self._columns
        return tuple(_combined(self._columns, self._tool[..., k]) for k in range(3))

    @property
    def pose(self) -> Poses:
        """The TCP (N) in the robot base."""
        return _poses(self.tcp, self.position)

    def first_order_update(self, step: Floats) -> ChainKinematics:
        """The TCP and the mount after a small ``step`` (m, N) [rad, m] of the coordinates; all else stays as it is.

        w = sum of s_i z_i over the turns; dp = sum of s_i z_i x (p - p_i) over the turns, and of s_i z_i over the
        shifts.  The error has the size of the step's square.
        """
        step = followed(step, self.couplings)
        turn, shift, spindle_shift = (np.zeros((3, step.shape[1])) for _ in range(3))
        mounted, at = len(self.axes) - self.spindles, 0
        while at < len(self.axes):
            about = np.zeros_like(turn)  # one origin
            origin = self.origins[at]
            while True:
                move = step[at] * self.axes[at]
                if self.turns[at]:
                    about += move
                elif at < mounted:
                    shift += move
                else:
                    spindle_shift += move
                at += 1
                if at == len(self.axes) or self.apart[at]:
                    break
            turn += about
            shift -= cross(about, origin)
        mount = self.mount + shift + cross(turn, self.mount)
        position = (
            self.position + shift + cross(turn, self.position) + spindle_shift if self.spindles else mount
        )
        tcp = tuple(column + cross(turn, column) for column in self.tcp)
        return replace(self, position=position, mount=mount, _columns=tcp, _tool=None)


class Chain:
    """A serial chain of ``joints`` with a ``flange``, and the extra coordinates named in ``extras``.

    names (m,): of the coordinates; motors: where the joints are among them (a slice without extras); couplings: (row of
    a joint without a motor, row of a joint that it follows, ratio).  Raises ValueError where ``extras`` names a
    coordinate that is not there.
    """

    def __init__(self, joints: Sequence[Joint], flange: Poses, extras: Iterable[str] = ()) -> None:
        wanted = set(extras)
        self._at = Poses.identity()
        self._arm: list[tuple[Floats, Floats, bool]] = []
        names: list[str] = []
        motors: list[int] = []
        names += self._site("base", wanted)
        followers: list[tuple[int, tuple[tuple[str, float], ...]]] = []
        for joint in joints:
            for passive in joint.passive:
                self._at = self._at @ passive.placement
                names += self._site(passive.name, wanted)
                followers.append((len(names), passive.follows))
                names.append(passive.name)
                self._add(np.eye(3), passive.kind == "revolute")
            if f"{joint.name}.growth" in wanted:
                self._add(_z_along(joint.placement.position), turns=False)
                names.append(f"{joint.name}.growth")
            self._at = self._at @ joint.placement
            names += self._site(joint.name, wanted)
            motors.append(len(names))
            names.append(joint.name)
            self._add(np.eye(3), joint.kind == "revolute")
        self._tip = self._at @ flange
        placements = [*self._arm, (self._tip.rotation, self._tip.position, False)]
        self._steps = [([_terms(column) for column in r.T], _terms(p), turns) for r, p, turns in placements]
        self._tool = [name for name in (f"tool.{axis}" for axis in _SIX) if name in wanted]
        self._spindle = [name for name in ("spindle.x", "spindle.y", "spindle.z") if name in wanted]
        self.names = (*names, *self._tool, *self._spindle)
        unknown = wanted.difference(self.names)
        if unknown:
            raise ValueError(f"a chain has no coordinates {sorted(unknown)}")
        self.index = {name: i for i, name in enumerate(self.names)}
        self.couplings = tuple(
            (row, self.index[name], ratio) for row, follows in followers for name, ratio in follows
        )
        self.motors = slice(0, len(motors)) if motors == list(range(len(motors))) else np.array(motors)
        self.motor_rows = np.array(motors)
        turns = [*(turns for *_, turns in self._arm), *(name[5] == "r" for name in self._tool)]
        self.turns = np.array([*turns, *(False for _ in self._spindle)])
        near = [self.turns[i - 1] and not self._arm[i][1].any() for i in range(1, len(self._arm))]
        self.apart = np.ones(self.size, bool)
        self.apart[1 : len(self._arm)] = ~np.array(near, bool)

    @property
    def size(self) -> int:
        """Number of coordinates, m."""
        return len(self.names)

    def _site(self, site: str, wanted: set[str]) -> list[str]:
        """Add the wanted ones of the six coordinates at the place where the chain ends now; their names."""
        names = []
        for axis, word in enumerate(_SIX):
            if f"{site}.{word}" in wanted:
                self._add(_Z_ALONG[axis % 3], turns=axis >= 3)
                names.append(f"{site}.{word}")
        return names

    def _add(self, axes: Floats, turns: bool) -> None:
        """A coordinate about or along the z column of ``axes``; what follows is in the axes before it."""
        placement = self._at @ Poses(axes, np.zeros(3))
        self._arm.append((placement.rotation.copy(), placement.position.copy(), turns))
        self._at = Poses(axes.T, np.zeros(3))

    @cached_property
    def model(self) -> Any:
        """Pinocchio's model of the coordinates up to the frame ``flange``.  Raises ImportError without Pinocchio."""
        import pinocchio as pin

        model, parent = pin.Model(), 0
        for name, (rotation, translation, turns) in zip(self.names, self._arm, strict=False):
            joint = pin.JointModelRZ() if turns else pin.JointModelPZ()
            parent = model.addJoint(parent, joint, pin.SE3(rotation, translation), name)
        tip = pin.SE3(np.array(self._tip.rotation), np.array(self._tip.position))
        model.addFrame(pin.Frame("flange", parent, 0, tip, pin.FrameType.OP_FRAME))
        return model

    def evaluate(self, coordinates: Floats, tool: Poses, spindle: Floats | None = None) -> ChainKinematics:
        """Evaluate at ``coordinates`` (m, N) [rad, m].

        ``tool``: TCP on the flange, one pose or N; ``spindle`` (N, 3): unit vector of the spindle, tip-ward, in tool
        axes (tool z without it).
        """
        count = coordinates.shape[1]
        coordinates = followed(coordinates, self.couplings)
        axes: list[Floats] = []
        origins: list[Floats] = []
        # what all states share has one column until a coordinate differs between them
        columns: list[Floats] = list(np.eye(3)[:, :, None])
        position = np.zeros((3, 1))
        links = []
        motors = set(self.motor_rows.tolist())
        for i, (rotation, translation, turns) in enumerate(self._steps[:-1]):
            position = _along(columns, translation, position)
            columns = [_along(columns, column) for column in rotation]
            axes.append(columns[2])
            origins.append(position)
            if turns:
                columns[:2] = _turned(columns[0], columns[1], coordinates[i])
            else:
                position = position + coordinates[i] * columns[2]
            if i in motors:
                links.append(_of_all(columns, count))
        rotation, translation, _ = self._steps[-1]
        position = _along(columns, translation, position)
        columns = [_along(columns, column) for column in rotation]
        flange = _of_all(columns, count), _of_all([position], count)[0]
        position = position + _combined(columns, tool.position)
        beyond: Floats | None = tool.rotation
        if self._tool or self._spindle:
            columns, beyond = [_combined(columns, tool.rotation[..., k]) for k in range(3)], None
        i = len(self._arm)
        for name in self._tool:
            k = "xyz".index(name[-1])
            axes.append(columns[k])
            origins.append(position)
            if self.turns[i]:
                a, b = (k + 1) % 3, (k + 2) % 3
                columns[a], columns[b] = _turned(columns[a], columns[b], coordinates[i])
            else:
                position = position + coordinates[i] * columns[k]
            i += 1
        (mount,) = _of_all([position], count)
        if self._spindle:
            for name, direction in zip(self._spindle, self._spindle_axes(columns, spindle), strict=True):
                axes.append(direction)
                origins.append(position)
                position = position + coordinates[self.index[name]] * direction
        return ChainKinematics(
            _of_all(axes, count),
            _of_all(origins, count),
            self.turns,
            self.apart,
            len(self._spindle),
            position if self._spindle else mount,
            mount,
            flange,
            tuple(links),
            self.couplings,
            _of_all(columns, count),
            beyond,
        )

    def _spindle_axes(self, columns: list[Floats], spindle: Floats | None) -> list[Floats]:
        """Directions (3, N) of the spindle coordinates: two across the spindle, one along it."""
        if spindle is None:
            three = columns
        else:
            along = _combined(columns, spindle)
            # The tool axis least along the spindle, made square to it; across the spindle all directions are alike.
            least = np.argmin(np.abs(spindle), axis=1)
            guide = np.choose(least, columns)
            across = guide - np.sum(guide * along, axis=0) * along
            across = across / np.sqrt(np.sum(across * across, axis=0))
            three = [across, np.cross(along, across, axis=0), along]
        return [three["xyz".index(name[-1])] for name in self._spindle]

    def base(self, coordinates: Floats) -> Poses:
        """Where the robot base is (N) at ``coordinates`` (m, N) [rad, m], in the frame that it has at zero."""
        count = coordinates.shape[1]
        rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        for name in self.names:
            if not name.startswith("base."):
                break
            axis, value = "xyz".index(name[-1]), coordinates[self.index[name]]
            if name[5] == "r":
                rotation = rotation @ rotation_from_vector(value[:, None] * np.eye(3)[axis])
            else:
                position = position + value[:, None] * rotation[:, :, axis]
        return Poses(rotation, position)

    def placed(self, q: Floats) -> Floats:
        """Coordinates (m, N) of a rigid robot with its motors at ``q`` (N, n) [rad]."""
        coordinates = np.zeros((self.size, len(q)))
        coordinates[self.motors] = q.T
        return coordinates

    def flange(self, q: Floats) -> Poses:
        """Flange poses (N) of the rigid robot at ``q`` (N, n) [rad], in the robot base."""
        return _poses(*self.evaluate(self.placed(q), TOOL).flange)

    def jacobian(self, q: Floats, tool: Poses) -> Floats:
        """Geometric Jacobians (N, 6, m) of the TCP at ``q`` (N, n): linear part first, axes of the robot base."""
        return jacobian(self.evaluate(self.placed(q), tool))


def jacobian(swept: ChainKinematics) -> Floats:
    """Geometric Jacobians (N, 6, m) of the TCP: column [z x (p - p_i); z] of a turn, [z; 0] of a shift; of a joint
    that others follow, the sum with theirs."""
    turns, axes = swept.turns[:, None, None], np.array(swept.axes)
    lever = np.cross(axes, swept.position[None] - np.array(swept.origins), axis=1)
    linear, angular = np.where(turns, lever, axes), np.where(turns, axes, 0.0)
    for row, leader, ratio in swept.couplings:
        linear[leader] += ratio * linear[row]
        angular[leader] += ratio * angular[row]
    return np.moveaxis(np.concatenate([linear, angular], axis=1), (0, 1, 2), (2, 1, 0))


def generalized_force(swept: ChainKinematics, point: Floats, wrench: Floats) -> Floats:
    """J^T w (m, N) [N m, N] of a wrench (6, N) [N, N m] that acts at ``point`` (3, N) [m]; robot base axes.

    tau_i = z_i . (m + (p - p_i) x f) for a turn, z_i . f for a shift.
    """
    force = np.empty((len(swept.axes), wrench.shape[1]))
    fx, fy, fz = wrench[:3]
    mx, my, mz = wrench[3:] + cross(point, wrench[:3])
    about: tuple[Floats, ...] = ()
    # coordinate by coordinate: what is in the making stays in the cache
    for own, (zx, zy, zz), (px, py, pz), turns, apart in zip(
        force, swept.axes, swept.origins, swept.turns.tolist(), swept.apart.tolist(), strict=True
    ):
        if apart:  # the moment about its origin
            about = mx - (py * fz - pz * fy), my - (pz * fx - px * fz), mz - (px * fy - py * fx)
        if turns:
            np.multiply(zx, about[0], out=own)
            own += zy * about[1]
            own += zz * about[2]
        else:
            np.multiply(zx, fx, out=own)
            own += zy * fy
            own += zz * fz
    add_to_leaders(force, swept.couplings)
    return force


def followed(coordinates: Floats, couplings: Sequence[tuple[int, int, float]]) -> Floats:
    """(m, N) [rad, m] where joints without a motor are, with the ``coordinates`` (m, N) of those that they follow."""
    if not couplings:
        return coordinates
    coordinates = coordinates.copy()
    for row, leader, ratio in couplings:
        coordinates[row] += ratio * coordinates[leader]
    return coordinates


def add_to_leaders(force: Floats, couplings: Sequence[tuple[int, int, float]]) -> None:
    """Add to ``force`` (m, N) [N m, N], in place, on each joint what pushes those that follow it (virtual work)."""
    for row, leader, ratio in couplings:
        force[leader] += ratio * force[row]


def cross(a: Floats, b: Floats) -> Floats:
    """a x b (3, N) of ``a``, ``b`` (3, N)."""
    vectors = np.empty(a.shape if a.shape == b.shape else np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=vectors[i])
        vectors[i] -= a[k] * b[j]
    return vectors


def weight_about(axis: Floats, moment: Floats, gravity: Floats) -> tuple[Floats, Floats]:
    """Torque (N,) [N m] about ``axis`` (3, N) of a weight whose first moment from the axis is ``moment`` (3, N) [kg m],
    under ``gravity`` (3,) [m/s2], and its derivative by the turn: a . (M x g) and a . ((a x M) x g) = (a . M)(a . g) -
    M . g."""
    (ax, ay, az), (mx, my, mz), (gx, gy, gz) = axis, moment, gravity.tolist()
    if gx == 0.0 and gy == 0.0:  # the robot is upright
        return gz * (ax * my - ay * mx), gz * ((ax * mx + ay * my + az * mz) * az - mz)
    torque = ax * (my * gz - mz * gy) + ay * (mz * gx - mx * gz) + az * (mx * gy - my * gx)
    slope = (ax * mx + ay * my + az * mz) * (gx * ax + gy * ay + gz * az) - (gx * mx + gy * my + gz * mz)
    return torque, slope


def sine_and_cosine(angle: Floats) -> tuple[Floats, Floats]:
    """sin (...) and cos (...) of ``angle`` (...) [rad], to 1e-15, by t = tan(angle / 2): numpy's tan is several times
    as fast as the two."""
    t = np.tan(0.5 * angle)
    share = t * t
    share += 1.0
    np.divide(2.0, share, out=share)
    t *= share
    share -= 1.0
    return t, share


def _turned(first: Floats, second: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Two axes (3, N) turned by ``angle`` (N,) in their plane, from the first to the second."""
    sine, cosine = sine_and_cosine(angle)
    one, other = cosine * first, cosine * second
    one += sine * second
    other -= sine * first
    return one, other


def _of_all(columns: Sequence[Floats], count: int) -> tuple[Floats, ...]:
    """Columns (3, N) of all states."""
    return tuple(
        column if column.shape[1] == count else np.broadcast_to(column, (3, count)) for column in columns
    )


def _terms(weights: Floats) -> list[tuple[int, float]]:
    """Numbers of columns, and their weights: the many zeros of a robot's placements cost nothing."""
    return [(k, weight) for k, weight in enumerate(weights.tolist()) if weight != 0.0]


def _along(columns: Sequence[Floats], terms: list[tuple[int, float]], start: Floats | None = None) -> Floats:
    """start + sum of weight * column."""
    total = start
    for k, weight in terms:
        term = columns[k] if weight == 1.0 else weight * columns[k]
        total = term if total is None else total + term
    return np.zeros_like(columns[0]) if total is None else total


def _combined(columns: Sequence[Floats], weights: Floats) -> Floats:
    """Sum of weight * column (3, N); ``weights`` (3,) for all states or (N, 3)."""
    if weights.ndim == 1:
        return _along(columns, _terms(weights))
    return columns[0] * weights[:, 0] + columns[1] * weights[:, 1] + columns[2] * weights[:, 2]


def _poses(columns: Sequence[Floats], position: Floats) -> Poses:
    rotation = np.empty((position.shape[1], 3, 3))
    for k, column in enumerate(columns):
        rotation[:, :, k] = column.T
    return Poses(rotation, np.ascontiguousarray(position.T))


def _z_along(direction: Floats) -> Floats:
    """A rotation whose z column points along ``direction`` (any for a zero vector)."""
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return np.eye(3)
    z = direction / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
