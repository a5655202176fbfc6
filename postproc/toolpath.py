"""The wanted motions of a program as read-only arrays, one row a motion.

This is where the text side (documents, dialects) and the physics side (robot, effects, forces) meet:
neither knows of the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, FewRows, Floats, Ints, LazyRows, frozen, shared
from postproc.findings import Finding
from postproc.geometry import Placed, Poses, abc_from_rotation, rotation_from_abc
from postproc.units import DEG, MM


class Kind(IntEnum):
    """What a motion statement does.  PTP and AXIS are air moves whatever the force."""

    PTP = 0  # point to point, to a Cartesian target
    AXIS = 1  # point to point, to axis angles
    LIN = 2  # straight line
    CIRC = 3  # circular arc, or a helix
    OTHER = 4  # a motion that is none of these
    SPL = 5  # a point of a spline: the way between is the controller's


@dataclass(frozen=True)
class FrameRef:
    """A base or tool frame as the program names it.

    ``pose`` is the frame where the program itself says it (in the world for a base, on the flange for
    a tool); None where only the controller knows it, that is entry ``number`` of BASE_DATA / TOOL_DATA.
    ``line`` is where it was set, for messages.
    """

    number: int | None
    pose: Poses | None
    line: int = 0


@dataclass(frozen=True)
class Annotation:
    """A comment, which stands before the motion ``row``; one that speaks to this tool (FORCE, COMPENSATE) holds from
    there on."""

    row: int
    text: str
    line: int


@dataclass(frozen=True)
class Toolpath:
    """N motions in the order of the text.

    kind (N,) Kind; position (N, 3) [m] and rotation (N, 3, 3): target of the TCP in the programmed base,
    NaN where the target is not known; axes (N, 6) [rad] for AXIS motions, NaN elsewhere; feed (N,) [m/s],
    NaN if unknown; base, tool (N,) index into ``frames``, -1 where unknown; status, turn (N,) KUKA's S and T
    as stated with the motion, -1 where not; line (N,) from 1.

    ``anchor`` (N,): the AXIS row whose end point gives the components that a partial target leaves out, -1 where
    none; ``given`` (N, 6) [m, rad] X, Y, Z, A, B, C of such a target, NaN where left out.  ``completed`` fills them in.

    ``refused``: row -> why that motion can not be corrected by an edit of its own (its target is not known, its
    text serves another motion too, ...).  ``pinned``: rows whose end point a later, refused motion builds on:
    moving them would move that one, so they can not be corrected either.

    Arcs (CIRC; NaN elsewhere), in the programmed base: ``centre`` (N, 3) [m], ``normal`` (N, 3) unit vector, ``sweep``
    (N,) > 0 [rad] counter-clockwise seen from the tip of the normal.  The way at the share t is the begin, turned
    about the centre by t * sweep, and moved along the normal by its share of what begin and end lie apart there.
    ``any_plane`` (N,): the text gives an arc by three points, which may lie in any plane but leave no advance; False:
    it lies in a plane that the program selects (its normal stays, an advance along it is possible).
    ``whole``: row -> why no motion can be inserted before it (a spline, a TRIGGER, a line that runs many times).
    ``blend`` (N,) [m]: the controller may leave the path that far before the end point (approximation); 0 where it
    stops or passes exactly, NaN where the distance is not known.
    ``oriented`` (N,): the text programs the orientation and it can be written; else it is given from outside and only
    the position can be corrected.  ``free_axis`` (N, 3): unit vector in tool axes about which the text does not say how
    the tool is turned (tool vectors, two rotary axes); NaN where it gives the whole orientation.
    ``runs`` (N,): the motion follows the one before it; False for motions of which it is not known whether, or where,
    they run: these come last.  ``timed`` (N,): the text gives the time that the motion takes: its feed follows from its
    length (G93).  ``branches``: a jump may lead into another configuration of the robot (KRL's S);
    without, no motion does.
    ``annotations``: comments that speak to this tool; ``comments``: all others that stand on a line of their own.
    """

    kind: Ints
    position: Floats
    rotation: Floats
    axes: FewRows | Floats
    feed: Floats
    base: Ints
    tool: Ints
    status: Ints
    turn: Ints
    line: Ints
    frames: tuple[FrameRef, ...]
    refused: Mapping[int, Finding] = field(default_factory=dict)
    pinned: Mapping[int, Finding] = field(default_factory=dict)
    annotations: tuple[Annotation, ...] = ()
    anchor: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    given: Floats = field(default_factory=lambda: np.empty((0, 6)))
    centre: Floats = field(default_factory=lambda: np.empty((0, 3)))
    normal: Floats = field(default_factory=lambda: np.empty((0, 3)))
    sweep: Floats = field(default_factory=lambda: np.empty(0))
    blend: Floats = field(default_factory=lambda: np.empty(0))
    oriented: Bools = field(default_factory=lambda: np.empty(0, np.bool_))
    free_axis: Floats = field(default_factory=lambda: np.empty((0, 3)))
    runs: Bools = field(default_factory=lambda: np.empty(0, np.bool_))
    any_plane: Bools = field(default_factory=lambda: np.empty(0, np.bool_))
    timed: Bools = field(default_factory=lambda: np.empty(0, np.bool_))
    branches: bool = True
    whole: Mapping[int, str] = field(default_factory=dict)
    comments: tuple[Annotation, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.kind)
        # (shape, type, what stands for all rows where nothing is given)
        columns: dict[str, tuple[tuple[int, ...], type[np.generic], float | None]] = {
            "kind": ((n,), np.int8, None),
            **dict.fromkeys(("base", "tool", "status", "turn", "line"), ((n,), np.int32, None)),
            "anchor": ((n,), np.int32, -1),
            "position": ((n, 3), np.float64, None),
            "rotation": ((n, 3, 3), np.float64, None),
            "feed": ((n,), np.float64, None),
            "given": ((n, 6), np.float64, np.nan),
            **dict.fromkeys(("centre", "normal", "free_axis"), ((n, 3), np.float64, np.nan)),
            "sweep": ((n,), np.float64, np.nan),
            "blend": ((n,), np.float64, 0.0),
            **dict.fromkeys(("oriented", "runs", "any_plane"), ((n,), np.bool_, True)),
            "timed": ((n,), np.bool_, False),
        }
        for name, (shape, dtype, default) in columns.items():
            values = getattr(self, name)
            if not len(values) and default is not None:
                values = np.broadcast_to(np.asarray(default, dtype), shape)
            object.__setattr__(self, name, shared(frozen(values, shape, dtype)))
        object.__setattr__(self, "axes", FewRows.of(self.axes))
        if self.axes.shape != (n, 6):
            raise ValueError(f"axes of shape {self.axes.shape}, {n} motions")

    def __len__(self) -> int:
        return len(self.kind)

    @cached_property
    def known(self) -> Bools:
        """(N,) the Cartesian target, its base and its tool are known; of an arc its way as well."""
        pose = np.isfinite(self.position).all(axis=1) & np.isfinite(self.rotation[:, 0, 0])
        way = (self.kind != Kind.CIRC) | np.isfinite(self.sweep)
        return np.asarray(pose & way & (self.base >= 0) & (self.tool >= 0))

    @cached_property
    def on_axes(self) -> Bools:
        """(N,) the target is stated by axis angles."""
        axes = FewRows.of(self.axes)
        stated = np.zeros(len(self), np.bool_)
        stated[axes.rows[np.isfinite(axes.values).all(axis=1)]] = True
        return stated

    @property
    def target_in_base(self) -> Poses:
        return Poses(self.rotation, self.position)

    def completed(self, reached: Placed) -> Toolpath:
        """The toolpath with its anchored targets known; ``reached`` (N): where the AXIS motion of ``anchor`` brings
        the TCP, in the base and with the tool of the row itself."""
        rows = np.flatnonzero(self.anchor >= 0)
        if not len(rows):
            return self
        end = reached[rows]
        there = np.concatenate([end.position, abc_from_rotation(end.rotation)], axis=1)
        values = np.where(np.isnan(self.given[rows]), there, self.given[rows])
        position, rotation = self.position.copy(), self.rotation.copy()
        position[rows], rotation[rows] = values[:, :3], rotation_from_abc(values[:, 3:])
        return replace(self, position=position, rotation=rotation)

    def dump(self) -> Iterator[str]:
        """The canonical list, one line a motion: line, kind, target (mm, deg), base, tool, feed, or the refusal."""
        abc = abc_from_rotation(np.nan_to_num(self.rotation)) / DEG
        for row in range(len(self)):
            kind = Kind(self.kind[row])
            words = [f"{self.line[row]}", kind.name]
            if self.on_axes[row]:
                words += [f"A{i + 1} {_number(a / DEG)}" for i, a in enumerate(self.axes[row])]
            elif self.anchor[row] >= 0:
                words += [
                    f"{k} {'?' if np.isnan(v) else _number(v / unit)}"
                    for k, v, unit in zip("XYZABC", self.given[row], [MM] * 3 + [DEG] * 3, strict=True)
                ]
                words.append(f"from line {self.line[self.anchor[row]]}")
            elif np.isfinite(self.position[row, 0]):
                words += [f"{k} {_number(v / MM)}" for k, v in zip("XYZ", self.position[row], strict=True)]
                if np.isfinite(self.rotation[row, 0, 0]):
                    words += [f"{k} {_number(v)}" for k, v in zip("ABC", abc[row], strict=True)]
                else:
                    words += ["A ?", "B ?", "C ?"]
            if np.isfinite(self.sweep[row]):
                for word, vector in (("centre", self.centre[row] / MM), ("normal", self.normal[row])):
                    words.append(word + " " + " ".join(_number(value) for value in vector))
                words.append(f"sweep {_number(self.sweep[row] / DEG)}")
            if self.status[row] >= 0:
                words.append(f"S {self.status[row]}")
            if self.turn[row] >= 0:
                words.append(f"T {self.turn[row]}")
            for word, index in (("base", self.base[row]), ("tool", self.tool[row])):
                words.append(f"{word} {self._frame_name(int(index))}")
            if np.isfinite(self.feed[row]):
                words.append(f"feed {_number(self.feed[row])} m/s")
            if row in self.refused:
                words.append(f"refused {self.refused[row].code}")
            yield " ".join(words)

    def _frame_name(self, index: int) -> str:
        if index < 0:
            return "?"
        frame = self.frames[index]
        if frame.pose is None:
            return f"[{frame.number}]"
        angles = abc_from_rotation(frame.pose.rotation) / DEG
        numbers = [*(frame.pose.position / MM), *angles]
        return "{" + " ".join(_number(value) for value in numbers) + "}"


class Role(IntEnum):
    """What a motion of the output is to the motion of the input that it stems from."""

    OWN = 0  # the last of them: it ends where that motion ends, and takes its text
    PIECE = 1  # an earlier part of its way, inserted before it
    LINK = 2  # a straight line to where its way begins, inserted before it


@dataclass(frozen=True, eq=False)
class Plan:
    """The motions that an output has to make, M >= N, all in the programmed base of their source.

    source (M,): row of the input, ascending; each has one OWN, last of its group.  role (M,) Role.
    position (M, 3) [m], rotation (M, 3, 3): targets, NaN where the input's is not known; a dialect asks for those of
    some rows at a time.
    centre, normal (M, 3), sweep (M,): way of arcs, as in a Toolpath; NaN for all others.
    """

    source: Ints
    role: Ints
    position: Floats | LazyRows
    rotation: Floats | LazyRows
    centre: Floats
    normal: Floats
    sweep: Floats

    def __post_init__(self) -> None:
        m = len(self.source)
        shapes = {
            "position": (m, 3),
            "rotation": (m, 3, 3),
            "centre": (m, 3),
            "normal": (m, 3),
            "sweep": (m,),
        }
        for name, shape in shapes.items():
            values = getattr(self, name)
            if not isinstance(values, LazyRows):
                object.__setattr__(self, name, frozen(values, shape))
        for name, dtype in (("source", np.int32), ("role", np.int8)):
            object.__setattr__(self, name, frozen(getattr(self, name), (m,), dtype))

    def __len__(self) -> int:
        return len(self.source)

    @property
    def own(self) -> Bools:
        """(M,) the motions that take the text of their source."""
        return np.asarray(self.role == Role.OWN)

    @staticmethod
    def of(path: Toolpath) -> Plan:
        """The plan that leaves everything as it is."""
        n = len(path)
        return Plan(
            np.arange(n),
            np.zeros(n, np.int64),
            path.position,
            path.rotation,
            path.centre,
            path.normal,
            path.sweep,
        )


def _number(value: float) -> str:
    """Six decimals at most, no trailing zeros, no minus zero."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
