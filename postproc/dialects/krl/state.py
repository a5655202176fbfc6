"""What is known at one line of a program: base, tool, feed, the last end point, variables."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from postproc.dialects.krl.survey import Effects
from postproc.dialects.krl.target import NOWHERE, Six, Target, Unclear, six
from postproc.geometry import Poses
from postproc.toolpath import FrameRef
from postproc.units import DEG, MM

Numbers = tuple[float, float, float, float, float, float]
ZERO: Numbers = (0.0,) * 6
Source = int | bytes
"""A row after which the robot may stand here, or the mark of a label or routine from where it may come."""


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


@dataclass(eq=False)
class Point:
    """A variable's value from one assignment (or its declaration) on, and the rows that it serves.

    ``blocked``: why its numbers must not be changed, although its value is known.
    """

    target: Target | Unclear
    blocked: Unclear | None = None
    origin: Point | None = None
    rows: list[int] = field(default_factory=list)

    def serve(self, row: int) -> None:
        """Notes a motion to it; an instance that this one was made from serves that motion too."""
        point: Point | None = self
        while point is not None:
            point.rows.append(row)
            point = point.origin

    def changed(self, index: int, value: float) -> Point:
        """The value after one component was assigned a number."""
        if isinstance(self.target, Unclear) or self.target.axes is not None:
            return Point(Unclear("KRL002", "one of its components is assigned"), origin=self)
        before = self.target.values
        values = (*before[:index], value, *before[index + 1 :])
        target = replace(self.target, values=six(values), file=-1, start=NOWHERE, stop=NOWHERE)
        return Point(target, Unclear("KRL007", "a component of it is assigned apart"), self)

    def with_external(self, key: bytes, value: float | None) -> Point:
        """The same numbers, with an external axis somewhere else (None: not known)."""
        if isinstance(self.target, Unclear):
            return self
        external = (*(item for item in self.target.external if item[0] != key), (key, value))
        return Point(replace(self.target, external=external), self.blocked, self)

    def with_state(self, key: bytes, value: float | None) -> Point:
        """The same numbers, with another S or T (None: not known)."""
        if isinstance(self.target, Unclear):
            return self
        bits = int(value) if value is not None and 0 <= value < 2**31 else -1
        target = replace(self.target, status=bits) if key == b"S" else replace(self.target, turn=bits)
        return Point(target, self.blocked, self)


@dataclass(frozen=True, slots=True)
class Anchor:
    """An end point of which ``given`` is known, and the rest is where the axis motion of ``row`` leads."""

    row: int
    given: Six = (None,) * 6


NO_BASE = Unclear("KRL005", "no $BASE was set before it")
NO_TOOL = Unclear("KRL005", "no $TOOL was set before it")


@dataclass
class State:
    """Everything that a motion's meaning depends on; ``data``: BASE_DATA and TOOL_DATA as assigned here."""

    base: Frame | Unclear = NO_BASE
    tool: Frame | Unclear = NO_TOOL
    feed: float = float("nan")
    tool_stands: bool = False
    point: Numbers | None = None
    point_frames: tuple[Frame | Unclear, Frame | Unclear] | None = None
    anchor: Anchor | None = None
    point_lost: str = "no motion stands before it"
    axes: Numbers | None = None
    sources: frozenset[Source] = frozenset()
    variables: dict[bytes, Point] = field(default_factory=dict)
    data: dict[tuple[bytes, int], Numbers | None] = field(default_factory=dict)
    data_lost: bool = False
    frames_record: dict[bytes, bytes] | None = None
    path_record: dict[bytes, bytes] | None = None

    def copy(self) -> State:
        return replace(self, variables=dict(self.variables), data=dict(self.data))

    def lose_point(self, why: str) -> None:
        self.point = self.axes = self.point_frames = self.anchor = None
        self.point_lost = why

    def forget(self, effects: Effects, why: str, has_tcp_mode: bool) -> set[bytes]:
        """Makes unknown what ``effects`` name; gives the variables that were forgotten."""
        if "point" in effects:
            self.lose_point(why)
        if "base" in effects:
            self.base = Unclear("KRL005", f"$BASE is not known {why}")
        if "tool" in effects:
            self.tool = Unclear("KRL005", f"$TOOL is not known {why}")
        if "feed" in effects:
            self.feed = float("nan")
        if "mode" in effects and has_tcp_mode:
            self.tool_stands = True
        if "data" in effects:
            self.data, self.data_lost = {}, True
        if "record" in effects:
            self.frames_record = self.path_record = None
        lost = {key for key in self.variables if key.split(b"[")[0] in effects}
        for key in lost:
            self.variables[key] = Point(Unclear("KRL002", f"its value is not known {why}"))
        return {key.split(b"[")[0] for key in lost}
