"""The wanted motions of a program as read-only arrays, one row a motion.

This is where the text side (documents, dialects) and the physics side (robot, effects, forces) meet:
neither knows of the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, FewRows, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import Placed, Poses, abc_from_rotation, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.toolpath.arcs import ArcFrame, Arcs
from postproc.toolpath.columns import MotionColumns, column
from postproc.toolpath.configuration import Configuration
from postproc.toolpath.edit_constraints import EditConstraints
from postproc.toolpath.motion_sequence import MotionSequence
from postproc.toolpath.motion_speeds import MotionSpeeds
from postproc.toolpath.orientation_control import OrientationControl, OrientationMode
from postproc.toolpath.partial_targets import PartialTargets
from postproc.toolpath.program_comments import Annotation, ProgramComments
from postproc.toolpath.reflections import Reflections
from postproc.toolpath.stated_loads import StatedLoad
from postproc.toolpath.targets import LOST, FrameRef, Kind, Targets

STATED_BY_ALL = ("targets", "speeds", "sequence", "remarks")
"""The parts of a toolpath whose fields can be asked for at the toolpath itself."""


@dataclass(frozen=True)
class Toolpath(MotionColumns):
    """N motions in the order of the text.

    ``line`` (N,): from 1.  ``stated_loads``: what the program states of the load.  All else is in parts; the columns
    that every motion states can be asked for here, too.
    """

    targets: Targets
    line: Ints = field(metadata=column(dtype=np.int32))
    speeds: MotionSpeeds
    sequence: MotionSequence = field(default_factory=MotionSequence)
    arcs: Arcs = field(default_factory=Arcs)
    constraints: EditConstraints = field(default_factory=EditConstraints)
    partial_targets: PartialTargets = field(default_factory=PartialTargets)
    orientation_control: OrientationControl = field(default_factory=OrientationControl)
    configuration: Configuration = field(default_factory=Configuration)
    remarks: ProgramComments = field(default_factory=ProgramComments)
    reflections: Reflections = field(default_factory=Reflections)
    stated_loads: tuple[StatedLoad, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.targets.kind)
        self._fill(n)
        for name, part in list(vars(self).items()):
            if isinstance(part, MotionColumns | Configuration):
                object.__setattr__(self, name, part.for_motions(n))

    def __len__(self) -> int:
        return len(self.targets.kind)

    @property
    def kind(self) -> Ints:
        """(N,) Kind: see ``Targets``."""
        return self.targets.kind

    @property
    def position(self) -> Floats:
        """(N, 3) [m] targets of the TCP: see ``Targets``."""
        return self.targets.position

    @property
    def rotation(self) -> Floats:
        """(N, 3, 3) orientations of the targets: see ``Targets``."""
        return self.targets.rotation

    @property
    def axes(self) -> FewRows | Floats:
        """(N, 6) [rad] targets of AXIS motions: see ``Targets``."""
        return self.targets.axes

    @property
    def base(self) -> Ints:
        """(N,) base of each motion, index into ``frames``: see ``Targets``."""
        return self.targets.base

    @property
    def tool(self) -> Ints:
        """(N,) tool of each motion, index into ``frames``: see ``Targets``."""
        return self.targets.tool

    @property
    def frames(self) -> tuple[FrameRef, ...]:
        """Bases and tools: see ``Targets``."""
        return self.targets.frames

    @property
    def external(self) -> Floats:
        """(N, 6) [mm or deg] external axes E1..E6: see ``Targets``."""
        return self.targets.external

    @property
    def feed(self) -> Floats:
        """(N,) [m/s]: see ``MotionSpeeds``."""
        return self.speeds.feed

    @property
    def spindle(self) -> Floats:
        """(N,) [rad/s] speed of the spindle: see ``MotionSpeeds``."""
        return self.speeds.spindle

    @property
    def inverse_time_feed(self) -> Bools:
        """(N,) the text gives the time of the motion: see ``MotionSpeeds``."""
        return self.speeds.inverse_time_feed

    @property
    def approximation(self) -> Floats:
        """(N,) [m] how far before its end point the path may be left: see ``MotionSequence``."""
        return self.sequence.approximation

    @property
    def stops(self) -> Bools:
        """(N,) the controller comes to rest at the end point: see ``MotionSequence``."""
        return self.sequence.stops

    @property
    def continues(self) -> Bools:
        """(N,) the motion starts where the row before it ends: see ``MotionSequence``."""
        return self.sequence.continues

    @property
    def predecessors(self) -> Mapping[int, tuple[int, ...]]:
        """Row -> rows whose ends may be its start: see ``MotionSequence``."""
        return self.sequence.predecessors

    @property
    def drills(self) -> Bools:
        """(N,) drill cycles: see ``MotionSequence``."""
        return self.sequence.drills

    @property
    def annotations(self) -> tuple[Annotation, ...]:
        """Comments that speak to this tool: see ``ProgramComments``."""
        return self.remarks.annotations

    @property
    def comments(self) -> tuple[Annotation, ...]:
        """All other comments that are alone on their line: see ``ProgramComments``."""
        return self.remarks.comments

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

    def with_columns(self, **columns: Any) -> Toolpath:
        """The toolpath with these columns (N, ...) instead: fields of ``Targets``, ``MotionSpeeds``,
        ``MotionSequence`` or ``ProgramComments``, or its own.

        Raises TypeError for a name that none of them has.
        """
        own: dict[str, Any] = {}
        for name, part in vars(self).items():
            if name in STATED_BY_ALL:
                its = {one.name: columns.pop(one.name) for one in fields(part) if one.name in columns}
                own |= {name: replace(part, **its)} if its else {}
        return replace(self, **own, **columns)

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
        return self.with_columns(position=position, rotation=rotation)

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
        set_later = zip("XYZ", frame.components, strict=True)
        changes = "".join(f".{key}={_number(value / MM)}" for key, value in set_later if value is not None)
        if pose is None:
            return entry + changes
        angles = abc_from_rotation(pose.rotation) / DEG
        numbers = [*(pose.position / MM), *angles]
        return f"{entry}{{{' '.join(_number(value) for value in numbers)}}}{changes}"


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
