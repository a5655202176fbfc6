"""What is known at one line of a program besides its variables: base, tool, feed, the last end point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.dialects.krl.spatial import Numbers
from postproc.dialects.krl.target import Six, Unclear
from postproc.geometry import Poses
from postproc.toolpath import FrameRef
from postproc.units import DEG, MM

ZERO: Numbers = (0.0,) * 6
NAN = float("nan")
Source = int | bytes
"""A row after which the robot may stand here, or the mark of a label or routine from where it may come."""

Record = dict[bytes, bytes]
"""FDAT, LDAT or PDAT: key -> value, upper case."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A base or tool that is known: its index in the table of frames."""

    index: int


class Frames:
    """The frames of a program, each once."""

    def __init__(self) -> None:
        self._index: dict[tuple[int | None, Numbers | None], int] = {}
        self._values: list[Numbers | None] = []
        self._refs: list[FrameRef] = []

    def known(self, number: int | None, values: Numbers | None, line: int) -> Frame:
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
        return Frame(self._index[key])

    def values(self, frame: Frame | Unclear) -> Numbers | None:
        return self._values[frame.index] if isinstance(frame, Frame) else None

    def refs(self) -> tuple[FrameRef, ...]:
        return tuple(self._refs)


@dataclass(frozen=True, slots=True)
class Anchor:
    """An end point of which ``given`` is known, and the rest is where the axis motion of ``row`` leads."""

    row: int
    given: Six = (None,) * 6


NO_BASE = Unclear("KRL005", "no $BASE was set before it")
NO_TOOL = Unclear("KRL005", "no $TOOL was set before it")


@dataclass(frozen=True, slots=True)
class Form:
    """The begin of the last inline form: where its fold stands, and base, tool and feed that are in force there."""

    at: int
    frames: tuple[Frame | Unclear, Frame | Unclear]
    feed: float


@dataclass(slots=True)
class State:
    """Everything that a motion's meaning depends on besides variables.

    feed [m/s], blend [mm] ($APO.CDIS): NaN where not known; point: X..C of the last end point [mm, deg], stated in
    ``point_frames``; axes [deg]: those of the last end point, where it was programmed so; form: the inline form that
    was entered last.
    """

    base: Frame | Unclear = NO_BASE
    tool: Frame | Unclear = NO_TOOL
    feed: float = NAN
    blend: float = NAN
    tool_stands: bool = False
    point: Numbers | None = None
    point_frames: tuple[Frame | Unclear, Frame | Unclear] | None = None
    anchor: Anchor | None = None
    point_lost: str = "no motion stands before it"
    axes: Numbers | None = None
    sources: frozenset[Source] = frozenset()
    frames_record: Record | None = None
    path_record: Record | None = None
    axis_record: Record | None = None
    form: Form | None = None

    def copy(self) -> State:
        return replace(self)

    def lose_point(self, why: str) -> None:
        self.point = self.axes = self.point_frames = self.anchor = None
        self.point_lost = why

    def forget(self, words: set[str], why: str, has_tcp_mode: bool) -> None:
        """Makes unknown what ``words`` name."""
        if "point" in words:
            self.lose_point(why)
        if "base" in words:
            self.base = Unclear("KRL005", f"$BASE is not known {why}")
        if "tool" in words:
            self.tool = Unclear("KRL005", f"$TOOL is not known {why}")
        if "feed" in words:
            self.feed = NAN
        if "apo" in words:
            self.blend = NAN
        if "mode" in words and has_tcp_mode:
            self.tool_stands = True
        if "record" in words:
            self.frames_record = self.path_record = self.axis_record = None
