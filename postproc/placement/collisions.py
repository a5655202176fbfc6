"""Collisions of the arm with itself and with what is fixed in the cell, by the collision shapes of a URDF.

Pinocchio places the shapes (frames of their links), coal finds whether two of them overlap (Pan et al. 2012,
doi:10.1109/ICRA.2012.6225337).  A URDF does not state how a controller counts its axes: it is taken only where its
joints bring the last link to where the robot file brings the flange, up to one constant frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.base.read_files import read_file
from postproc.base.units import DEG, MM
from postproc.model import StiffnessModel
from postproc.placement.part_motions import PartMotions
from postproc.placement.score_places import joint_margins
from postproc.robot.axis_track import nominal_flange
from postproc.robot.description import Robot

THREADS = 2

POSES = 50_000
"""Looked at at once."""

SAME, SAME_ANGLE = 1.0 * MM, 0.1 * DEG
"""By so much the flange of the URDF may be elsewhere than that of the robot file."""

PROBES = 12


@dataclass(frozen=True, eq=False)
class CollisionShapes:
    """The shapes of a URDF on a robot.  model, geometry: Pinocchio's; joints (n,): numbers of the robot's joints in it;
    signs, offsets (n,): its value of a joint is sign q + offset; fixed: names of the links that stand still, moving: of
    those that do not; ignored: pairs of links that touch before the program starts, and are not checked."""

    file: str
    model: Any
    geometry: Any
    joints: tuple[int, ...]
    signs: Floats
    offsets: Floats
    fixed: tuple[str, ...]
    moving: tuple[str, ...]
    ignored: tuple[tuple[str, str], ...] = ()

    def configurations(self, q: Floats) -> Floats:
        """(M, C) Pinocchio's C coordinates of the joint values ``q`` (M, n) [rad, m]; joints that the robot does not
        have stay at zero."""
        import pinocchio as pin

        whole = np.tile(pin.neutral(self.model), (len(q), 1))
        for k, joint in enumerate(self.joints):
            at, value = self.model.idx_qs[joint], self.signs[k] * q[:, k] + self.offsets[k]
            if self.model.nqs[joint] == 2:
                whole[:, at], whole[:, at + 1] = np.cos(value), np.sin(value)
            else:
                whole[:, at] = value
        return np.asarray(whole.T)

    def colliding(self, q: Floats) -> Bools:
        """(M,) whether two shapes overlap at the joint values ``q`` (M, n) [rad, m]."""
        import pinocchio as pin

        if not len(q):
            return np.zeros(0, np.bool_)
        pool = pin.GeometryPool(self.model, self.geometry, THREADS)
        configurations = np.asfortranarray(self.configurations(q))
        return np.asarray(pin.computeCollisionsInParallel(THREADS, pool, configurations, True), np.bool_)

    def touching(self, q: Floats) -> tuple[tuple[str, str], ...]:
        """The pairs of links that overlap at one set of joint values ``q`` (n,) [rad, m]."""
        pairs = [
            (self.geometry.collisionPairs[k].first, self.geometry.collisionPairs[k].second)
            for k in self._at(q)
        ]
        links = [tuple(_link(self.model, self.geometry, one) for one in pair) for pair in pairs]
        return tuple(dict.fromkeys((one, other) for one, other in links))

    def _at(self, q: Floats) -> list[int]:
        import pinocchio as pin

        data, shapes = self.model.createData(), self.geometry.createData()
        pin.computeCollisions(
            self.model, data, self.geometry, shapes, self.configurations(q[None])[:, 0], False
        )
        return [k for k, result in enumerate(shapes.collisionResults) if result.isCollision()]


def collisions_available() -> bool:
    """Whether Pinocchio is installed with coal."""
    return find_spec("pinocchio") is not None and find_spec("coal") is not None


def read_collision_shapes(path: Path, robot: Robot, start: Floats | None) -> CollisionShapes | Finding:
    """The collision shapes of a URDF; ``start`` (n,) [rad, m]: joint values before the program, at which pairs that
    touch are not checked further.  A Finding PLC018 says why there are none.  Raises Refusal FIL001."""
    raw = read_file(path)
    if not collisions_available():
        return _none(path, "Pinocchio is not installed with coal")
    try:
        ElementTree.fromstring(raw)
    except ElementTree.ParseError as error:
        return _none(path, f"the URDF cannot be read: {error}")
    import pinocchio as pin

    try:
        model = pin.buildModelFromUrdf(str(path))
        folders = [str(path.parent), str(path.parent.parent)]
        geometry = pin.buildGeomFromUrdf(model, str(path), pin.COLLISION, package_dirs=folders)
    except (ValueError, RuntimeError) as error:
        return _none(
            path, f"the URDF or one of its meshes cannot be read: {' '.join(str(error).split())[:200]}"
        )
    if not geometry.ngeoms:
        return _none(path, "the URDF has no collision shapes")
    chain = _chain(model, len(robot.joints))
    if chain is None:
        return _none(path, f"the URDF has not one chain of {len(robot.joints)} joints, as {robot.name} has")
    axes = robot.axes
    counted = [(np.ones(len(chain)), np.zeros(len(chain)))]
    if len(axes) == len(chain):
        counted.append((np.array([axis.sign for axis in axes]), np.array([axis.offset for axis in axes])))
    for signs, offsets in counted:
        shapes = _paired(path, model, geometry, (chain, signs, offsets))
        if _same_arm(shapes, robot):
            break
    else:
        return _none(path, f"its joints do not bring the flange to where {robot.name} has it")
    if not len(geometry.collisionPairs):
        return _none(path, "no two shapes of the URDF can meet")
    if start is None:
        return shapes
    touching = shapes._at(start)
    if not touching:
        return shapes
    ignored = shapes.touching(start)
    for k in reversed(touching):
        geometry.removeCollisionPair(geometry.collisionPairs[k])
    return CollisionShapes(
        shapes.file,
        model,
        geometry,
        chain,
        shapes.signs,
        shapes.offsets,
        shapes.fixed,
        shapes.moving,
        ignored,
    )


def first_collision(shapes: CollisionShapes, q: Floats) -> tuple[int, tuple[str, str]] | None:
    """The first of ``q`` (M, n) at which two links overlap, and their names."""
    hits = np.flatnonzero(shapes.colliding(q))
    return None if not len(hits) else (int(hits[0]), shapes.touching(q[hits[0]])[0])


def _none(path: Path, reason: str) -> Finding:
    return Finding("PLC018", f"collisions are not checked: {reason}", str(path))


def _chain(model: Any, count: int) -> tuple[int, ...] | None:
    """The joints of the one chain of so many from the root to a joint that no other follows."""
    parents = set(model.parents[1:])
    ends = [joint for joint in range(1, model.njoints) if joint not in parents]
    chains = [tuple(model.supports[joint])[1:] for joint in ends]
    fitting = [chain for chain in chains if len(chain) == count]
    return fitting[0] if len(fitting) == 1 else None


def _paired(
    path: Path, model: Any, geometry: Any, counted: tuple[tuple[int, ...], Floats, Floats]
) -> CollisionShapes:
    """The shapes with all pairs of links that can meet: neither side by side, nor fixed to each other."""
    import pinocchio as pin

    chain, signs, offsets = counted
    geometry.removeAllCollisionPairs()
    objects = geometry.geometryObjects
    links = [_link(model, geometry, k) for k in range(geometry.ngeoms)]
    joints = [one.parentJoint for one in objects]
    before = {link: _link_before(model, link) for link in links}
    for one in range(geometry.ngeoms):
        for other in range(one + 1, geometry.ngeoms):
            beside = before[links[one]] == links[other] or before[links[other]] == links[one]
            if joints[one] != joints[other] and not beside:
                geometry.addCollisionPair(pin.CollisionPair(one, other))
    fixed, moving = (
        tuple(dict.fromkeys(link for link, joint in zip(links, joints, strict=True) if (joint == 0) == still))
        for still in (True, False)
    )
    return CollisionShapes(str(path), model, geometry, chain, signs, offsets, fixed, moving)


def _link(model: Any, geometry: Any, shape: int) -> str:
    return str(model.frames[geometry.geometryObjects[shape].parentFrame].name)


def _link_before(model: Any, link: str) -> str:
    """The link that carries the one named, over its joint; "" for the root."""
    joint = model.frames[model.getBodyId(link)].parentFrame
    return str(model.frames[model.frames[joint].parentFrame].name) if joint else ""


def _same_arm(shapes: CollisionShapes, robot: Robot) -> bool:
    """Whether the last link goes where the flange of the robot file goes, up to a constant frame."""
    import pinocchio as pin

    low, high = robot.limits.T
    low, high = np.maximum(np.nan_to_num(low), -3.0), np.minimum(np.nan_to_num(high), 3.0)
    q = np.random.default_rng(0).uniform(low, high, (PROBES, len(low)))
    flange = nominal_flange(robot, q)
    data, last = shapes.model.createData(), shapes.joints[-1]
    rotation, position = np.empty((PROBES, 3, 3)), np.empty((PROBES, 3))
    for k, one in enumerate(shapes.configurations(q).T):
        pin.forwardKinematics(shapes.model, data, one)
        rotation[k], position[k] = data.oMi[last].rotation, data.oMi[last].translation
    there = Poses(rotation, position)
    constant = there.inverse() @ flange
    shift = np.linalg.norm(constant.position - constant.position[0], axis=1)
    turn = lengths(turn_between(constant.rotation, np.broadcast_to(constant.rotation[0], (PROBES, 3, 3))))
    return bool(shift.max() <= SAME and turn.max() <= SAME_ANGLE)


def colliding_rows(
    shapes: CollisionShapes, model: StiffnessModel, motions: PartMotions, places: Floats
) -> Ints:
    """(P,) the first of ``motions`` at which two links overlap with the part at ``places`` (P, 6), -1 where none."""
    found = np.full(len(places), -1)
    each = max(1, POSES // max(len(motions), 1))
    for start in range(0, len(places), each):
        part = places[start : start + each]
        q, _, _ = joint_margins(model, motions, part)
        hits = shapes.colliding(q.reshape(-1, q.shape[-1])).reshape(len(part), -1)
        found[start : start + each] = np.where(hits.any(axis=1), hits.argmax(axis=1), -1)
    return found


def between_postures(before: Floats, after: Floats, step: float) -> tuple[Floats, Ints]:
    """(K, n) joint values between those of ``before`` and ``after`` (M, n), none farther than ``step`` from the next,
    ends left out, and the motion (K,) of each: where motions go straight in the joint values."""
    parts = np.ceil(np.abs(after - before).max(axis=1, initial=0.0) / step).astype(np.int64)
    inner = np.maximum(parts - 1, 0)
    motion = np.repeat(np.arange(len(before)), inner)
    at = np.arange(len(motion)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
    share = (at / np.repeat(np.maximum(parts, 1), inner))[:, None]
    return before[motion] + share * (after[motion] - before[motion]), motion
