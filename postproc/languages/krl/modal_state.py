"""What is known at one line of a program besides its variables: base, tool, feed, the last end point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages.krl.external_axes import ALL_LOST, UNSTATED
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import Six, UnknownValue
from postproc.toolpath import ArcFrame, FrameRef, OrientationMode

ZERO: Numbers = (0.0,) * 6
NOT_TO_TARGET = (OrientationMode.CONSTANT, OrientationMode.UNKNOWN)
"""Modes in which a path motion may end with another orientation than that of its target."""
NAN = float("nan")
Source = int | bytes
"""A row after which the robot may be here, or the mark of a label or routine from where it may come."""

Record = dict[bytes, bytes]
"""FDAT, LDAT or PDAT: key -> value, upper case."""


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """A base or tool that is known: its index in the table of frames."""

    index: int


class FrameRegister:
    """The frames of a program, each once."""

    def __init__(self) -> None:
        self._index: dict[tuple[int | None, Numbers | None], int] = {}
        self._values: list[Numbers | None] = []
        self._refs: list[FrameRef] = []

    def known(self, number: int | None, values: Numbers | None, line: int) -> FrameIndex:
        """The frame of this number and pose (X..C, mm and deg); number 0 is the identity."""
        if number == 0:
            values = ZERO
        key = (number, values)
        if key not in self._index:
            pose = None
            if values is not None:
                pose = Poses.from_abc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)
            self._index[key] = len(self._refs)
            self._values.append(values)
            self._refs.append(FrameRef(number, pose, line))
        return FrameIndex(self._index[key])

    def values(self, frame: FrameIndex | UnknownValue) -> Numbers | None:
        return self._values[frame.index] if isinstance(frame, FrameIndex) else None

    def refs(self) -> tuple[FrameRef, ...]:
        return tuple(self._refs)


@dataclass(frozen=True, slots=True)
class Anchor:
    """An end point of which ``given`` is known, and the rest is where the axis motion of ``row`` leads."""

    row: int
    partial_target: Six = (None,) * 6


NO_BASE = UnknownValue("KRL005", "no $BASE is set before it")
NO_TOOL = UnknownValue("KRL005", "no $TOOL is set before it")


@dataclass(frozen=True, slots=True)
class InlineFormState:
    """The begin of the last inline form: where its fold stands, and base, tool and feed that are in force there."""

    at: int
    frames: tuple[FrameIndex | UnknownValue, FrameIndex | UnknownValue]
    feed: float


@dataclass(slots=True)
class ModalState:
    """Everything that a motion's meaning depends on besides variables.

    orientation, arc_frame: $ORI_TYPE and $CIRC_TYPE, modes of OrientationControl and frames of Arcs;
    feed [m/s], blend [mm] ($APO.CDIS): NaN where not known; point: X..C of the last end point [mm, deg], stated in
    ``point_frames``; axes [deg]: those of the last end point, where it was programmed so; form: the inline form that
    was entered last; external [mm, deg]: E1..E6; external_apart: what the
    program has set so that motions do not take them along.
    """

    base: FrameIndex | UnknownValue = NO_BASE
    tool: FrameIndex | UnknownValue = NO_TOOL
    feed: float = NAN
    blend: float = NAN
    tool_known: bool = False
    point: Numbers | None = None
    point_frames: tuple[FrameIndex | UnknownValue, FrameIndex | UnknownValue] | None = None
    anchor: Anchor | None = None
    point_unknown: str = "no motion precedes it"
    axes: Numbers | None = None
    sources: frozenset[Source] = frozenset()
    frames_record: Record | None = None
    path_record: Record | None = None
    axis_record: Record | None = None
    form: InlineFormState | None = None
    orientation: int = OrientationMode.VAR
    arc_frame: int = ArcFrame.BASE
    external: Numbers = UNSTATED
    external_apart: frozenset[bytes] = frozenset()

    def copy(self) -> ModalState:
        return replace(self)

    def lose_point(self, why: str) -> None:
        self.point = self.axes = self.point_frames = self.anchor = None
        self.point_unknown = why

    def forget(self, words: set[str], why: str, has_tcp_mode: bool, has_turning: bool) -> None:
        """Makes unknown what ``words`` name; the tool is on the flange, and turns evenly, in a program that nowhere
        says another thing."""
        if "point" in words:
            self.lose_point(why)
            self.external = ALL_LOST
        if "base" in words:
            self.base = UnknownValue("KRL005", f"$BASE is not known {why}")
        if "tool" in words:
            self.tool = UnknownValue("KRL005", f"$TOOL is not known {why}")
        if "feed" in words:
            self.feed = NAN
        if "apo" in words:
            self.blend = NAN
        if "mode" in words and has_tcp_mode:
            self.tool_known = True
        if "turning" in words and has_turning:
            self.orientation, self.arc_frame = OrientationMode.UNKNOWN, ArcFrame.UNKNOWN
        if "record" in words:
            self.frames_record = self.path_record = self.axis_record = None
