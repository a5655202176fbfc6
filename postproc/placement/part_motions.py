"""The places that the motions of programs lead to, as they move with the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, product, rotation_from_vector, turned
from postproc.effects import Conditions
from postproc.placement.room import TOOL_TURN, TRACK, TURN

_CONDITIONS = tuple(field.name for field in fields(Conditions))


@dataclass(frozen=True, eq=False)
class PartMotions:
    """R places that the motions of programs lead to, with the part where it lies now.

    program, line, row (R,): whose they are; share (R,): of the motion's path, 1 at its end.
    target: TCP in $WORLD, ``moves`` (R,): with the part; tool: TCP on the flange;
    axis (R, 3): about which the tool is turned, tool axes, zero for a tool that is not; before: $WORLD in the robot's
    own base; track (3,): by how much that moves with each metre of a track that is not a joint.  branch (R,), q
    (R, n) [rad, m] joint values now.  head (R,): the place by which the turns of A1, A4 and A6 are chosen; anchor (R,
    n) [rad, m]: joint values before a head that goes on from axis positions, NaN where its T chooses; sign (R, n): of
    each axis as T states it, 0 without.  scored (R,): ends of motions under force, under_force (R,): places of such
    motions; force, moment (R, 3) [N, N m] there, tangent (R, 3): of the feed, world axes; start (R, 3) [m]: of a
    straight scored motion that does not start on the part, in the robot's own base, NaN elsewhere; world (R,): a force
    that does not turn with the part.  conditions (R).  origin (3,) [m]: of the base in $WORLD now.
    """

    program: Ints
    line: Ints
    row: Ints
    share: Floats
    target: Poses
    moves: Bools
    tool: Poses
    axis: Floats
    before: Poses
    branch: Ints
    q: Floats
    head: Ints
    anchor: Floats
    sign: Ints
    scored: Bools
    under_force: Bools
    force: Floats
    moment: Floats
    tangent: Floats
    start: Floats
    world: Bools
    conditions: Conditions
    origin: Floats
    track: Floats
    track_now: float = 0.0
    track_joint: int | None = None

    def __len__(self) -> int:
        return len(self.line)

    def take(self, rows: Ints) -> PartMotions:
        """The places ``rows`` (K,), which hold the head of each of them."""
        order = np.full(len(self), -1, np.int64)
        order[rows] = np.arange(len(rows))
        values = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "conditions":
                values[field.name] = value.part(rows)
            elif field.name not in ("origin", "track", "track_now", "track_joint"):
                values[field.name] = value[rows]
        values["head"] = order[self.head[rows]]
        return replace(self, **values)

    def with_heads(self, rows: Ints) -> Ints:
        """(K,) the places ``rows`` (M,) and their heads, ascending."""
        return np.union1d(rows, self.head[rows])

    def flanges(self, places: Floats) -> Poses:
        """Flange poses (P R) in the robot's own base with the part at ``places`` (P, 6), place by place."""
        count, rows = len(places), len(self)
        turns = np.unique(places[:, TOOL_TURN])
        if len(turns) == 1:
            flange = self._turned_tools(np.full(rows, turns[0]))
            rotation = np.broadcast_to(flange.rotation, (count, rows, 3, 3))
            position = np.broadcast_to(flange.position, (count, rows, 3))
        else:
            every = np.tile(np.arange(rows), count)
            flange = self._rows(every)._turned_tools(np.repeat(places[:, TOOL_TURN], rows))
            rotation = flange.rotation.reshape(count, rows, 3, 3)
            position = flange.position.reshape(count, rows, 3)
        cosine, sine = np.cos(places[:, TURN])[:, None], np.sin(places[:, TURN])[:, None]
        x, y, z = np.moveaxis(position - self.origin, -1, 0)
        placed = np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1) + places[:, None, :3]
        rotated = np.empty((count, rows, 3, 3))
        c, s = cosine[..., None], sine[..., None]
        rotated[:, :, 0] = c * rotation[:, :, 0] - s * rotation[:, :, 1]
        rotated[:, :, 1] = s * rotation[:, :, 0] + c * rotation[:, :, 1]
        rotated[:, :, 2] = rotation[:, :, 2]
        still = np.flatnonzero(~self.moves)
        placed[:, still], rotated[:, still] = position[:, still], rotation[:, still]
        back = self.before.rotation
        if not (back == np.eye(3)).all():
            every = np.tile(np.arange(rows), count)
            rotated = product(back[every], rotated.reshape(-1, 3, 3)).reshape(count, rows, 3, 3)
            placed = turned(back[every], placed.reshape(-1, 3)).reshape(count, rows, 3)
        placed = placed + self.before.position
        placed += ((places[:, TRACK] - self.track_now)[:, None] * self.track)[:, None]
        return Poses(rotated.reshape(-1, 3, 3), placed.reshape(-1, 3))

    def _rows(self, rows: Ints) -> _Tools:
        return _Tools(self.target[rows], self.tool[rows], self.axis[rows])

    def _turned_tools(self, angle: Floats) -> Poses:
        return self._rows(np.arange(len(self)))._turned_tools(angle)

    def positions(self, places: Floats, rows: Ints) -> Floats:
        """(P, K, 3) [m] the TCP in the robot's own base at the moving motions ``rows`` (K,), with the part at
        ``places`` (P, 6); a turn of the tool does not move it."""
        turned_about = self.in_robot(
            places, rows, self.target.position[rows] - self.origin, np.zeros(len(rows), np.bool_)
        )
        shift = np.einsum("rij,pj->pri", self.before.rotation[rows], places[:, :3])
        track = ((places[:, TRACK] - self.track_now)[:, None] * self.track)[:, None]
        return np.asarray(turned_about + shift + self.before.position[rows] + track)

    def in_robot(self, places: Floats, rows: Ints, vectors: Floats, fixed: Bools) -> Floats:
        """(P, K, 3) ``vectors`` (K, 3) of world axes at the motions ``rows`` (K,), which turn with the part at
        ``places`` (P, 6) but where ``fixed`` (K,), in axes of the robot's own base."""
        cosine, sine = np.cos(places[:, TURN])[:, None], np.sin(places[:, TURN])[:, None]
        cosine, sine = np.where(fixed, 1.0, cosine), np.where(fixed, 0.0, sine)
        x, y, z = vectors.T
        level = np.broadcast_to(z, cosine.shape)
        there = np.stack([cosine * x - sine * y, sine * x + cosine * y, level], axis=-1)
        back = self.before.rotation[rows]
        if (back == np.eye(3)).all():
            return there
        return np.asarray(np.einsum("rij,prj->pri", back, there))


@dataclass(frozen=True, eq=False)
class _Tools:
    """TCP targets with their tools and the axes about which these turn."""

    target: Poses
    tool: Poses
    axis: Floats

    def _turned_tools(self, angle: Floats) -> Poses:
        """Flange poses with the tools turned by ``angle`` (N,) [rad]: target @ R(axis, -angle) @ tool^-1."""
        there = self.target
        if angle.any():
            there = Poses(
                product(there.rotation, rotation_from_vector(-angle[:, None] * self.axis)), there.position
            )
        return there @ self.tool.inverse()


def join_motions(parts: Sequence[PartMotions]) -> PartMotions:
    """The places of several programs of one cell in one table.  Raises ValueError where the robots are differently
    placed."""
    if len(parts) == 1:
        return parts[0]
    first, starts = parts[0], np.cumsum([0, *(len(part) for part in parts)])
    values: dict[str, object] = {}
    for name in (field.name for field in fields(first)):
        each = [getattr(part, name) for part in parts]
        if name in ("origin", "track", "track_now", "track_joint"):
            if any(not np.array_equal(one, each[0]) for one in each):
                raise ValueError(f"the programs have different values of {name}")
        elif name == "conditions":
            values[name] = _joined(each)
        elif name == "head":
            values[name] = np.concatenate([one + start for one, start in zip(each, starts, strict=False)])
        elif name == "program":
            values[name] = np.concatenate([np.full(len(one), k) for k, one in enumerate(each)])
        elif isinstance(each[0], Poses):
            values[name] = Poses(
                np.concatenate([one.rotation for one in each]), np.concatenate([one.position for one in each])
            )
        else:
            values[name] = np.concatenate(each)
    return replace(first, **values)  # type: ignore[arg-type]


def _joined(each: Sequence[Conditions]) -> Conditions:
    columns = {name: [getattr(one, name) for one in each] for name in _CONDITIONS}
    return Conditions(
        **{
            name: None if any(value is None for value in values) else np.concatenate(values)
            for name, values in columns.items()
        }
    )
