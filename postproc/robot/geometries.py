"""The geometries of serial arms: each kind of description becomes joints and a flange for the chain.

Everywhere the value of a joint is the controller's.  How the controller counts (``Axis``: sign and offset) is folded
into the frames of the joints once, here, so that no other place has to know of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.geometry import Poses, rotation_from_vector

Limits = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Passive:
    """A joint without a motor, which a linkage or a gear turns or moves: by the sum of ratio * value over the joints
    that it ``follows``, by name [rad, m, each per that of the other].  ``placement`` and ``kind`` as of ``Joint``."""

    name: str
    placement: Poses
    follows: tuple[tuple[str, float], ...]
    kind: str = "revolute"


@dataclass(frozen=True)
class Joint:
    """A joint that turns about (``revolute``) or moves along (``prismatic``) the z axis of its own frame.

    ``placement``: that frame in the frame of the joint before (of the base for the first), at value zero.
    ``lower``, ``upper`` [rad, m].  ``passive``: joints without a motor between the joint before and this one, whose
    ``placement`` is then in the frame of the last of them.
    """

    name: str
    placement: Poses
    lower: float
    upper: float
    kind: str = "revolute"
    passive: tuple[Passive, ...] = ()

    @property
    def turns(self) -> bool:
        """It turns about its axis, and does not move along it."""
        return self.kind == "revolute"


@dataclass(frozen=True)
class Follower:
    """A joint of a geometry that has no motor: its value is the sum of ratio * value over the joints that it
    ``follows``, as their controller counts them, plus ``offset`` [rad, m]."""

    name: str
    follows: tuple[tuple[str, float], ...]
    offset: float = 0.0
    kind: str = "revolute"


@dataclass(frozen=True)
class Axis:
    """A joint as its controller counts it: sign * value + offset is the angle or the travel of the geometry [rad, m].
    ``speed`` [rad/s, m/s]: the fastest that it moves, None where the file does not state it.
    ``interaction``: column of the joint whose value programs leave out of that of this one: the value between the links
    is the programmed one plus that of that joint (J3 of a Fanuc, which counts from the level); None without.
    """

    name: str
    lower: float
    upper: float
    kind: str = "revolute"
    sign: float = 1.0
    offset: float = 0.0
    speed: float | None = None
    interaction: int | None = None


NO_FOLLOWERS: Mapping[int, Follower] = {}


@dataclass(frozen=True)
class Link:
    """What lies before and after the motion of a joint: ``before``, the frame that moves about or along its z axis, in
    the frame of the link before; ``after``, the link's own frame in the moved frame."""

    before: Poses
    after: Poses


@dataclass(frozen=True)
class KukaLengths:
    """Link lengths [m] of a KUKA-type arm with a spherical wrist.

    d1 floor to axis 2, a1 axis 1 to axis 2, a2 axis 2 to axis 3, a3 height of the wrist axis over axis 3 and
    d4 axis 3 to wrist centre with the forearm level, d6 wrist centre to flange.
    """

    kind: ClassVar[str] = "kuka"

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float

    def links(self) -> list[Link]:
        """Axis senses A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x; zero pose: arm stretched forward.

        The frames of the links lie on their axes and are parallel to the robot base in the zero pose.
        """
        axes = [(0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0)]
        origins = [
            (0.0, 0.0, 0.0),
            (self.a1, 0.0, self.d1),
            (self.a2, 0.0, 0.0),
            (self.d4, 0.0, self.a3),
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
        ]
        frames = [frame_with_z(np.array(axis, float)) for axis in axes]
        return [
            Link(Poses(frame, np.array(origin)), Poses(frame.T, np.zeros(3)))
            for frame, origin in zip(frames, origins, strict=True)
        ]

    def joints(self, names: Sequence[str], limits: Limits) -> tuple[Joint, ...]:
        axes = [Axis(name, *pair) for name, pair in zip(names, limits, strict=True)]
        return _folded(self.links(), axes)

    def link_frames(self) -> list[Poses]:
        """Each link's own frame in the frame that its joint moves."""
        return [link.after for link in self.links()]

    def flange(self) -> Poses:
        """The flange in the frame of A6: its z axis points out along the forearm (R = Ry(90 deg) at zero)."""
        at_zero = Poses(turn_about("y", np.pi / 2), np.array([self.d6, 0.0, 0.0]))
        return _frozen(self.links()[-1].after @ at_zero)


@dataclass(frozen=True, eq=False)
class KukaVariant:
    """A KUKA-type arm whose controller counts otherwise, or that is on a linear axis.

    ``axes``: of the rail, if there is one, and of the six joints; ``rail`` (3,): the path of the linear axis, a unit
    vector in the robot base.
    """

    kind: ClassVar[str] = "kuka"

    lengths: KukaLengths
    axes: tuple[Axis, ...]
    rail: Floats | None = None

    def links(self) -> list[Link]:
        if self.rail is None:
            return self.lengths.links()
        frame = frame_with_z(self.rail)
        return [Link(Poses(frame, np.zeros(3)), Poses(frame.T, np.zeros(3))), *self.lengths.links()]

    def joints(self, names: Sequence[str], limits: Limits) -> tuple[Joint, ...]:
        return _folded(self.links(), _renamed(self.axes, names, limits))

    def link_frames(self) -> list[Poses]:
        return _link_frames(self.links(), self.axes)

    def flange(self) -> Poses:
        return _frozen(_flip(self.axes[-1]) @ self.lengths.flange())

    @property
    def signs(self) -> Floats:
        """(n,) 1 or -1: how the controller counts."""
        return np.array([axis.sign for axis in self.axes])

    @property
    def offsets(self) -> Floats:
        """(n,) [rad, m] added to what the controller counts."""
        return np.array([axis.offset for axis in self.axes])


@dataclass(frozen=True, eq=False)
class SerialArm:
    """Any other arm; of seven joints one is ``fixed`` (its column) and the others place the flange.

    ``axes``: as the controller counts them; ``chain``: the frames of these and of joints without a motor; ``tip``: the
    flange in the last link's frame; ``followers``: the joints without a motor, by their place in ``chain``.
    """

    kind: str
    axes: tuple[Axis, ...]
    chain: tuple[Link, ...]
    tip: Poses
    fixed: int | None = None
    followers: Mapping[int, Follower] = field(default_factory=dict)

    def links(self) -> list[Link]:
        return list(self.chain)

    def joints(self, names: Sequence[str], limits: Limits) -> tuple[Joint, ...]:
        return _folded(self.links(), _renamed(self.axes, names, limits), self.followers)

    def link_frames(self) -> list[Poses]:
        driven = [link for k, link in enumerate(self.chain) if k not in self.followers]
        return _link_frames(driven, self.axes)

    def flange(self) -> Poses:
        return _frozen(_flip(self.axes[-1]) @ self.chain[-1].after @ self.tip)

    @property
    def limits(self) -> Floats:
        """(n, 2) [rad, m]"""
        return np.array([(axis.lower, axis.upper) for axis in self.axes])


Geometry = KukaLengths | KukaVariant | SerialArm


@dataclass(frozen=True)
class DhRow:
    """One row of a Denavit-Hartenberg table [m, rad]; ``theta`` or ``d`` is the constant part beside the motion."""

    a: float
    alpha: float
    d: float
    theta: float = 0.0


def standard_dh(rows: Sequence[DhRow]) -> list[Link]:
    """Rz(theta) Tz(d) Tx(a) Rx(alpha): the joint moves about or along the z axis of the link before."""
    links = []
    for row in rows:
        before = Poses(turn_about("z", row.theta), np.array([0.0, 0.0, row.d]))
        links.append(Link(before, Poses(turn_about("x", row.alpha), np.array([row.a, 0.0, 0.0]))))
    return links


def modified_dh(rows: Sequence[DhRow]) -> list[Link]:
    """Rx(alpha) Tx(a) Rz(theta) Tz(d), alpha and a of the link before (Craig): it moves about or along its own z."""
    links = []
    for row in rows:
        across = Poses(turn_about("x", row.alpha), np.array([row.a, 0.0, 0.0]))
        along = Poses(turn_about("z", row.theta), np.array([0.0, 0.0, row.d]))
        links.append(Link(across @ along, Poses.identity()))
    return links


def based(links: Sequence[Link], base: Poses) -> tuple[Link, ...]:
    """The links on a ``base``: the frame of their first one in the robot base."""
    first, *rest = links
    return (Link(base @ first.before, first.after), *rest)


def turn_about(axis: str, angle: float) -> Floats:
    """Rotation (3, 3) by ``angle`` [rad] about a coordinate axis; quarter turns consist of zeros and ones."""
    quarters = angle / (np.pi / 2)
    rotation = rotation_from_vector(angle * np.eye(3)["xyz".index(axis)])
    return np.round(rotation) if abs(quarters - round(quarters)) < 1e-12 else np.asarray(rotation)


def _folded(
    links: Sequence[Link], axes: Sequence[Axis], followers: Mapping[int, Follower] = NO_FOLLOWERS
) -> tuple[Joint, ...]:
    """Joints whose values are the controller's: offset and sense become part of the frames."""
    joints, at = [], Poses.identity()
    passive: list[Passive] = []
    driven = iter(axes)
    for k, link in enumerate(links):
        one = followers[k] if k in followers else next(driven)
        if one.kind == "prismatic":
            zero = Poses(np.eye(3), np.array([0.0, 0.0, one.offset]))
        else:
            zero = Poses(turn_about("z", one.offset), np.zeros(3))
        if isinstance(one, Follower):
            passive.append(Passive(one.name, _frozen(at @ link.before @ zero), one.follows, one.kind))
            at = link.after
            continue
        flip = _flip(one)
        placement = _frozen(at @ link.before @ zero @ flip)
        joints.append(Joint(one.name, placement, one.lower, one.upper, one.kind, tuple(passive)))
        at, passive = flip @ link.after, []
    return tuple(joints)


def _link_frames(links: Sequence[Link], axes: Sequence[Axis]) -> list[Poses]:
    return [_flip(axis) @ link.after for link, axis in zip(links, axes, strict=True)]


def _flip(axis: Axis) -> Poses:
    """Half a turn about x, its own inverse, where the controller counts in the opposite sense: F Rz(q) F = Rz(-q)."""
    return Poses(np.diag([1.0, -1.0, -1.0]) if axis.sign < 0 else np.eye(3), np.zeros(3))


def _renamed(axes: Sequence[Axis], names: Sequence[str], limits: Limits) -> list[Axis]:
    return [
        Axis(name, lower, upper, axis.kind, axis.sign, axis.offset)
        for axis, name, (lower, upper) in zip(axes, names, limits, strict=True)
    ]


def _frozen(pose: Poses) -> Poses:
    return Poses(frozen(pose.rotation), frozen(pose.position))


def frame_with_z(axis: Floats) -> Floats:
    """A rotation (3, 3) whose z column is the unit vector ``axis`` (3,), of zeros and ones only where the axis is."""
    z = np.asarray(axis, dtype=float)
    x = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.5 else np.array([1.0, 0.0, 0.0])
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
