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

from postproc.base.arrays import Bools, FewRows, Floats, Ints, frozen, shared
from postproc.base.findings import Finding
from postproc.base.geometry import Placed, Poses, abc_from_rotation, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.toolpath.arcs import ArcFrame, Arcs
from postproc.toolpath.columns import MotionColumns, column, not_given
from postproc.toolpath.configuration import Configuration
from postproc.toolpath.edit_constraints import EditConstraints
from postproc.toolpath.orientation_control import OrientationControl, OrientationMode
from postproc.toolpath.partial_targets import PartialTargets

COMPUTED, LOST = np.inf, -np.inf
"""An external axis whose value is an expression that is not constant; one that something else may have moved."""


class Kind(IntEnum):
    """What a motion statement does.  Point-to-point motions (PTP, AXIS) are air moves whatever the force."""

    PTP = 0  # point to point, to a Cartesian target
    AXIS = 1  # point to point, to axis angles
    LIN = 2  # straight line
    CIRC = 3  # circular arc, or a helix
    OTHER = 4  # a motion that is none of these
    SPL = 5  # a point of a spline: the path between is the controller's


@dataclass(frozen=True)
class FrameRef:
    """A base or tool frame as the program names it.

    ``pose`` is the frame where the program itself states it (in the world for a base, on the flange for
    a tool); None where only the controller knows it, that is entry ``number`` of BASE_DATA / TOOL_DATA.
    ``line`` is where it was set, for messages.  ``declared``: what the controller's own file states of a frame whose
    ``pose`` the program does not state; the cell's base or tool of that number comes first.
    ``in_entry``: (number, pose) of a frame that the program states in such an entry (``BASE_DATA[2]:{X 10 ...}``):
    ``number`` and ``pose`` are None then, and ``declared`` is that of the entry.
    """

    number: int | None
    pose: Poses | None
    line: int = 0
    declared: Poses | None = None
    in_entry: tuple[int, Poses] | None = None

    @property
    def entry(self) -> int | None:
        """The number of the entry that it is, or in which it is stated; None without one."""
        return self.number if self.in_entry is None else self.in_entry[0]


@dataclass(frozen=True)
class Annotation:
    """A comment before the motion ``row``; one that speaks to this tool (FORCE, COMPENSATE) holds from there on."""

    row: int
    text: str
    line: int


@dataclass(frozen=True)
class Toolpath(MotionColumns):
    """N motions in the order of the text.

    What every motion states:

    ``kind`` (N,): Kind.
    ``position`` (N, 3) [m], ``rotation`` (N, 3, 3): target of the TCP in the programmed base, NaN where it is not
    known; the rotation is the one that the controller runs (see ``programmed_rotation``).
    ``axes`` (N, 6) [rad]: target of AXIS motions, NaN for others.
    ``external`` (N, 6) [mm or deg, as in the text]: external axes E1..E6 at the end of each motion; NaN where nothing
    has stated them yet, ``COMPUTED`` or ``LOST`` where they are not known.
    ``feed`` (N,) [m/s]: NaN where it is not known.
    ``spindle`` (N,) [rad/s]: the speed of the spindle, as the program states it: below zero where it turns
    counter-clockwise (-inf at a speed that is not known), 0 where it is stopped; NaN where nothing is stated, or it
    varies.
    ``inverse_time_feed`` (N,): the text gives the time that the motion takes, its feed follows from its length (G93).
    ``base``, ``tool`` (N,): index into ``frames``, -1 where it is not known.
    ``line`` (N,): from 1.
    ``approximation`` (N,) [m]: the controller may depart from the path that far before the end point; 0 where it stops
    or passes exactly, NaN where the distance is not known.
    ``stops`` (N,): the controller comes to rest at the end point: it is not approximated (``approximation`` is 0), and
    is no inner point of a spline block; without it wherever ``approximation`` is 0.
    ``continues`` (N,): in every execution the motion starts where the row before it ends, and no other motion starts
    there; the first one starts where the program does.  False where paths of the program meet or part, and for motions
    that never run: where such a motion starts is not known.

    ``drills`` (N,): the motion is a drill cycle, and its target the bottom of the hole: the tool comes down to it from
    above and goes back up.  Neither it nor the motion behind it ``continues``, although no other motion is between.

    What few motions state, and what holds of a dialect, is in types of its own.

    ``predecessors``: row that does not continue the row before it -> the rows whose ends may be its start, -1 for the
    start of the program, -2 for what the program does not contain.
    ``annotations``: comments that speak to this tool; ``comments``: all others that are alone on their line.
    """

    kind: Ints = field(metadata=column(dtype=np.int8))
    position: Floats = field(metadata=column(3))
    rotation: Floats = field(metadata=column(3, 3))
    axes: FewRows | Floats
    feed: Floats = field(metadata=column())
    base: Ints = field(metadata=column(dtype=np.int32))
    tool: Ints = field(metadata=column(dtype=np.int32))
    line: Ints = field(metadata=column(dtype=np.int32))
    frames: tuple[FrameRef, ...]
    arcs: Arcs = field(default_factory=Arcs)
    constraints: EditConstraints = field(default_factory=EditConstraints)
    partial_targets: PartialTargets = field(default_factory=PartialTargets)
    orientation_control: OrientationControl = field(default_factory=OrientationControl)
    configuration: Configuration = field(default_factory=Configuration)
    external: Floats = field(default_factory=not_given, metadata=column(6, default=np.nan))
    approximation: Floats = field(default_factory=not_given, metadata=column(default=0.0))
    stops: Bools = field(default_factory=not_given)
    continues: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=True))
    spindle: Floats = field(default_factory=not_given, metadata=column(default=np.nan))
    drills: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=False))
    inverse_time_feed: Bools = field(
        default_factory=not_given, metadata=column(dtype=np.bool_, default=False)
    )
    predecessors: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    annotations: tuple[Annotation, ...] = ()
    comments: tuple[Annotation, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.kind)
        self._fill(n)
        stops = self.stops if len(self.stops) else self.approximation == 0.0
        object.__setattr__(self, "stops", shared(frozen(stops, (n,), np.bool_)))
        for part in ("arcs", "constraints", "partial_targets", "orientation_control", "configuration"):
            object.__setattr__(self, part, getattr(self, part).for_motions(n))
        object.__setattr__(self, "axes", FewRows.of(self.axes))
        if self.axes.shape != (n, 6):
            raise ValueError(f"axes have the shape {self.axes.shape} for {n} motions")

    def __len__(self) -> int:
        return len(self.kind)

    @cached_property
    def known(self) -> Bools:
        """(N,) the Cartesian target, its base and its tool are known; of an arc its path as well."""
        pose = np.isfinite(self.position).all(axis=1) & np.isfinite(self.rotation[:, 0, 0])
        path = (self.kind != Kind.CIRC) | np.isfinite(self.arcs.sweep)
        return np.asarray(pose & path & (self.base >= 0) & (self.tool >= 0))

    @cached_property
    def on_axes(self) -> Bools:
        """(N,) the target is stated by axis angles."""
        axes = FewRows.of(self.axes)
        stated = np.zeros(len(self), np.bool_)
        stated[axes.rows[np.isfinite(axes.values).all(axis=1)]] = True
        return stated

    @cached_property
    def paths_meet(self) -> Bools:
        """(N,) motions that do not continue the one before, as other motions may precede them."""
        beside_hole = self.drills | np.append(False, self.drills[:-1])[: len(self)]
        return np.asarray(~self.continues & ~beside_hole)

    @cached_property
    def keeps_orientation(self) -> Bools:
        """(N,) path motions that end with the orientation with which they start, on arcs maybe turned with the arc."""
        on_path = np.isin(self.kind, (Kind.LIN, Kind.CIRC, Kind.SPL))
        return np.asarray(on_path & (self.orientation_control.mode == OrientationMode.CONSTANT))

    @property
    def programmed_rotation(self) -> Floats:
        """(N, 3, 3) the orientations of the text."""
        programmed = self.orientation_control.programmed
        return self.rotation if programmed is None else programmed

    @cached_property
    def inserted_before(self) -> Ints:
        """(N,) line before which is written what is inserted before each motion."""
        headers = self.constraints.spline_headers
        if not headers:
            return self.line
        line = self.line.copy()
        line[list(headers)] = list(headers.values())
        return line

    @cached_property
    def moves_external(self) -> Bools:
        """(6,) the text states the external axis, and not only as zero."""
        if not self.external.strides[0]:
            return np.asarray(_stated(self.external[:1]).any(axis=0))
        return np.asarray(_stated(self.external).any(axis=0))

    @property
    def target_in_base(self) -> Poses:
        return Poses(self.rotation, self.position)

    def with_refused(self, refused: Mapping[int, Finding]) -> Toolpath:
        """The toolpath with these rows refused instead: row -> why."""
        return replace(self, constraints=replace(self.constraints, refused=refused))

    def completed(self, reached: Placed) -> Toolpath:
        """The toolpath with its partial targets known; ``reached`` (N): where the AXIS motion of
        ``partial_targets`` brings the TCP, in the base and with the tool of the row itself."""
        rows = np.flatnonzero(self.partial_targets.inherits_from_row >= 0)
        if not len(rows):
            return self
        end = reached[rows]
        there = np.concatenate([end.position, abc_from_rotation(end.rotation)], axis=1)
        values = np.where(
            np.isnan(self.partial_targets.coordinates[rows]), there, self.partial_targets.coordinates[rows]
        )
        position, rotation = self.position.copy(), self.rotation.copy()
        position[rows], rotation[rows] = values[:, :3], rotation_from_abc(values[:, 3:])
        return replace(self, position=position, rotation=rotation)

    def dump(self) -> Iterator[str]:
        """The canonical list, one line a motion: line, kind, target (mm, deg), base, tool, feed, or the refusal."""
        abc = abc_from_rotation(np.nan_to_num(self.rotation)) / DEG
        shown = np.flatnonzero(self.moves_external).tolist()
        for row in range(len(self)):
            kind = Kind(self.kind[row])
            words = [f"{self.line[row]}", kind.name]
            if self.on_axes[row]:
                words += [f"A{i + 1} {_number(a / DEG)}" for i, a in enumerate(self.axes[row])]
            elif self.partial_targets.inherits_from_row[row] >= 0:
                words += [
                    f"{k} {'?' if np.isnan(v) else _number(v / unit)}"
                    for k, v, unit in zip(
                        "XYZABC", self.partial_targets.coordinates[row], [MM] * 3 + [DEG] * 3, strict=True
                    )
                ]
                words.append(f"from line {self.line[self.partial_targets.inherits_from_row[row]]}")
            elif np.isfinite(self.position[row, 0]):
                words += [f"{k} {_number(v / MM)}" for k, v in zip("XYZ", self.position[row], strict=True)]
                if np.isfinite(self.rotation[row, 0, 0]):
                    words += [f"{k} {_number(v)}" for k, v in zip("ABC", abc[row], strict=True)]
                else:
                    words += ["A ?", "B ?", "C ?"]
            if np.isfinite(self.arcs.sweep[row]):
                for word, vector in (
                    ("centre", self.arcs.centre[row] / MM),
                    ("normal", self.arcs.normal[row]),
                ):
                    words.append(word + " " + " ".join(_number(value) for value in vector))
                words.append(f"sweep {_number(self.arcs.sweep[row] / DEG)}")
            for axis in shown:
                value = self.external[row, axis]
                if value == value:
                    words.append(f"E{axis + 1} {_number(value) if np.isfinite(value) else '?'}")
            for name, numbers in self.configuration.numbers.items():
                if numbers[row] >= 0:
                    words.append(f"{name[0].upper()} {numbers[row]}")
            for word, index in (("base", self.base[row]), ("tool", self.tool[row])):
                words.append(f"{word} {self._frame_name(int(index))}")
            if np.isfinite(self.feed[row]):
                words.append(f"feed {_number(self.feed[row])} m/s")
            if self.orientation_control.mode[row] and kind in (Kind.LIN, Kind.CIRC, Kind.SPL):
                words.append(f"orientation {OrientationMode(self.orientation_control.mode[row]).name}")
            if self.arcs.frame[row] and kind == Kind.CIRC:
                words.append(f"arc {ArcFrame(self.arcs.frame[row]).name}")
            if self.drills[row]:
                words.append("drills")
            if row in self.constraints.refused:
                words.append(f"refused {self.constraints.refused[row].code}")
            yield " ".join(words)

    def _frame_name(self, index: int) -> str:
        if index < 0:
            return "?"
        frame = self.frames[index]
        pose = frame.pose if frame.in_entry is None else frame.in_entry[1]
        entry = "" if frame.pose is not None else f"[{frame.entry}]"
        if pose is None:
            return entry
        angles = abc_from_rotation(pose.rotation) / DEG
        numbers = [*(pose.position / MM), *angles]
        return f"{entry}{{{' '.join(_number(value) for value in numbers)}}}"


def external_at(path: Toolpath, rows: Ints, share: Floats | None = None) -> Floats:
    """(K, 6) [mm or deg] E1..E6 at the shares (K,) of motions ``rows`` (K,), without at their ends: an axis goes evenly
    from the end of the motion before, and one that does not move keeps its very number."""
    end = path.external[rows]
    if share is None or not path.external.strides[0]:
        return end
    follows = (rows > 0) & path.continues[rows]
    start = np.where(follows[:, None], path.external[np.maximum(rows - 1, 0)], end)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(start == end, end, start + share[:, None] * (end - start)))


def _stated(external: Floats) -> Bools:
    """(N, 6) external axes that are stated somewhere else than at zero."""
    return np.asarray((external > 0) | ((external < 0) & (external != LOST)))


def _number(value: float) -> str:
    """Six decimals at most, no trailing zeros, no minus zero."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
