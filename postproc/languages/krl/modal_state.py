"""What is known at one line of a program besides its variables: base, tool, feed, the last end point."""

from __future__ import annotations

from dataclasses import dataclass, field
from operator import attrgetter

import numpy as np

from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages.core.comments_in_force import VARYING, InForce, join_comments
from postproc.languages.core.field_joins import SOMETIMES, FieldJoins, either, is_same, lost
from postproc.languages.core.frame_table import FrameTable
from postproc.languages.core.motion_sources import ELSEWHERE, START, Source
from postproc.languages.krl.external_axes import ALL_LOST, UNSTATED, apart, six
from postproc.languages.krl.spatial import ZERO, Numbers
from postproc.languages.krl.statement_effects import Effect
from postproc.languages.krl.target import FrameEntry, KrlTarget, Six, UnknownValue, known
from postproc.toolpath import LOST, ArcFrame, FrameRef, OrientationMode

NOT_TO_TARGET = (OrientationMode.CONSTANT, OrientationMode.UNKNOWN)
"""Modes in which a path motion may end with another orientation than that of its target."""
NAN = float("nan")
Record = dict[bytes, bytes]
"""FDAT, LDAT or PDAT: key -> value, upper case."""


SetComponents = tuple[float | None, float | None, float | None]
NONE_SET: SetComponents = (None, None, None)
OTHERWISE = b""
"""In ``external_apart``: what no assignment of the program ends."""
TRIGGERED = "a TRIGGER before it refers to it"


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """A base or tool that is known: its index in the table of frames, and the line that set it."""

    index: int
    line: int = field(default=0, compare=False)


def _pose(values: Numbers) -> Poses:
    return Poses.from_abc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)


class FrameRegister(FrameTable):
    """The frames of a program, each once."""

    def __init__(self) -> None:
        super().__init__()
        self._values: list[Numbers | None] = []
        self._within: list[Numbers] = []
        self._components: list[SetComponents] = []

    def known(self, number: int | None, values: Numbers | None, line: int) -> FrameIndex:
        """The frame of this number and pose (X..C, mm and deg); number 0 is the identity."""
        if number == 0:
            values = ZERO
        found = self.index(
            (number, values, False), lambda: FrameRef(number, None if values is None else _pose(values), line)
        )
        return self._with(found, line, values, ZERO)

    def in_entry(self, entry: FrameEntry, line: int, components: SetComponents = NONE_SET) -> FrameIndex:
        """The frame that is, or is stated in, an entry whose pose the program does not state; components: X, Y, Z
        [mm] that are set of it afterwards."""
        if entry.within == ZERO and components == NONE_SET:
            return self.known(entry.number, None, line)
        x, y, z = (None if one is None else one * MM for one in components)
        found = self.index(
            (entry.number, entry.within, components, True),
            lambda: FrameRef(
                None, None, line, in_entry=(entry.number, _pose(entry.within)), components=(x, y, z)
            ),
        )
        return self._with(found, line, None, entry.within, components)

    def with_component(self, frame: FrameIndex, component: int, value: float, line: int) -> FrameIndex | None:
        """A frame of the controller whose X, Y or Z (``component`` 0, 1, 2) is set to a value [mm]; None for an angle,
        as which angles the controller has for it is not known, and where no entry has the frame."""
        number = self.refs[frame.index].entry
        if number is None or component > 2:
            return None
        x, y, z = (value if i == component else one for i, one in enumerate(self._components[frame.index]))
        return self.in_entry(FrameEntry("", "", b"", number, self._within[frame.index]), line, (x, y, z))

    def _with(
        self,
        index: int,
        line: int,
        values: Numbers | None,
        within: Numbers,
        components: SetComponents = NONE_SET,
    ) -> FrameIndex:
        if index == len(self._values):
            self._values.append(values)
            self._within.append(within)
            self._components.append(components)
        return FrameIndex(index, line)

    def values(self, frame: FrameIndex | UnknownValue) -> Numbers | None:
        return self._values[frame.index] if isinstance(frame, FrameIndex) else None

    def of_other(self, frame: FrameIndex, other: FrameRegister, line: int) -> FrameIndex:
        """The same frame as one of another register."""
        entry = other.refs[frame.index].in_entry
        if entry is not None:
            within, components = other._within[frame.index], other._components[frame.index]
            return self.in_entry(FrameEntry("", "", b"", entry[0], within), line, components)
        return self.known(other.refs[frame.index].number, other._values[frame.index], line)

    def copied(self, frame: FrameIndex | UnknownValue, table: bytes) -> KrlTarget | FrameEntry | None:
        """What a variable holds to which a frame of ``table``, BASE or TOOL, is assigned; None where it is unknown."""
        if not isinstance(frame, FrameIndex) or self._components[frame.index] != NONE_SET:
            return None
        values, entry = self._values[frame.index], self.refs[frame.index].entry
        if values is not None or entry is None:
            return known(values or ZERO)
        why = f"its value is {table.decode()}_DATA[{entry}], whose numbers no program states"
        return FrameEntry("KRL002", why, table, entry, self._within[frame.index])


@dataclass(frozen=True, slots=True)
class Anchor:
    """An end point of which ``given`` is known, and the rest is where the axis motion of ``row`` leads."""

    row: int
    partial_target: Six = (None,) * 6


PointFrames = tuple["FrameIndex | UnknownValue", "FrameIndex | UnknownValue"]

OVERRIDES = frozenset([b"$OV_PRO", b"$OV_ROB", b"$OV_APPL", b"$RED_VEL"])
NO_BASE = UnknownValue("KRL005", "no $BASE is set before it")
NO_TOOL = UnknownValue("KRL005", "no $TOOL is set before it")


@dataclass(frozen=True, slots=True)
class InlineFormState:
    """The start of the last inline form: base and tool that are in force there."""

    frames: tuple[FrameIndex | UnknownValue, FrameIndex | UnknownValue]


@dataclass
class ModalState:
    """Everything that a motion's meaning depends on besides variables.

    orientation, arc_frame: $ORI_TYPE and $CIRC_TYPE, modes of OrientationControl and frames of Arcs;
    feed [m/s], blend [mm] ($APO.CDIS): NaN where not known; point: X..C of the last end point [mm, deg], stated in
    ``point_frames``, by the motion in ``point_line``; axes [deg]: those of the last end point, where it was
    programmed so; form: the inline form that was entered last; external [mm, deg]: E1..E6; external_apart: what the
    program has set so that motions do not take them along; no_insert: why nothing can be inserted before the next
    motion, "" where it can; root_set: the line, if any, from which on the program itself states where the robot is in
    the world; later_since: the line, if any, from which on an interrupt or a trigger may change base or tool;
    later_speed: which of "feed" and "apo" one may change; moved_later, ended_later: the line, if any, from which on one
    may move the robot, or end what a call runs (RESUME); stop: whether the advance run stops before the next motion,
    no_advance: before every one: 2 where it does, 1 where it may; overridden: speed overrides that may not be 100 %;
    force, switch: the FORCE and COMPENSATE comments in force; later_comments: which of these an interrupt
    or a trigger may change.
    """

    base: FrameIndex | UnknownValue = NO_BASE
    tool: FrameIndex | UnknownValue = NO_TOOL
    feed: float = NAN
    blend: float = NAN
    tool_known: bool = False
    point: Numbers | None = None
    point_frames: PointFrames | None = None
    anchor: Anchor | None = None
    point_unknown: str = "no motion precedes it"
    point_line: int = 0
    axes: Numbers | None = None
    sources: frozenset[Source] = frozenset([START])
    frames_record: Record | None = None
    path_record: Record | None = None
    axis_record: Record | None = None
    form: InlineFormState | None = None
    orientation: int = OrientationMode.VAR
    arc_frame: int = ArcFrame.BASE
    external: Numbers = UNSTATED
    external_apart: frozenset[bytes] = frozenset()
    no_insert: str = ""
    root_set: int = 0
    later_since: int = 0
    later_speed: frozenset[Effect] = frozenset()
    stop: int = 0
    no_advance: int = 0
    moved_later: int = 0
    ended_later: int = 0
    overridden: frozenset[bytes] = frozenset()
    force: InForce = None
    switch: InForce = None
    later_comments: frozenset[Effect] = frozenset()

    @property
    def comments(self) -> tuple[InForce, InForce]:
        """The FORCE and COMPENSATE comments in force, whatever an interrupt or a trigger may run."""
        force, switch = (VARYING if name in self.later_comments else None for name in ("force", "switch"))
        return self.force if force is None else force, self.switch if switch is None else switch

    @property
    def steady_feed(self) -> float:
        """[m/s] the feed that no interrupt, trigger or override changes; NaN where one may, or is not known."""
        return NAN if self.overridden or "feed" in self.later_speed else self.feed

    @property
    def steady_blend(self) -> float:
        """[mm] the same of $APO.CDIS; 0 where no motion is planned ahead."""
        if self.no_advance:
            return 0.0 if self.no_advance == 2 and "apo" not in self.later_speed else NAN
        return NAN if "apo" in self.later_speed else self.blend

    def copy(self) -> ModalState:
        other = object.__new__(ModalState)
        other.__dict__ = self.__dict__.copy()  # there are many, and __init__ takes several times as long
        return other

    def changed(self, **values: object) -> ModalState:
        """The same with other values."""
        other = self.copy()
        other.__dict__.update(values)
        return other

    def lose_point(self, why: str) -> None:
        self.point = self.axes = self.point_frames = self.anchor = None
        self.point_unknown = why

    def set_apart(self, is_apart: bool) -> None:
        """Takes up, where it is so, that external axes may not take part in motions."""
        if is_apart:
            self.external_apart |= {OTHERWISE}
            self.external = apart(self.external)

    def unsettle(self, has_tcp_mode: bool, has_turning: bool) -> None:
        """Where an interrupt or a trigger may have moved the robot nothing is known of where it is."""
        if self.moved_later:
            why = f"as the interrupt or trigger of line {self.moved_later} may move the robot at any time"
            self.forget({"point"}, why, has_tcp_mode, has_turning)
            self.sources = self.sources | {ELSEWHERE}

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
        if "force" in words:
            self.force = VARYING
        if "switch" in words:
            self.switch = VARYING
        if "record" in words:
            self.frames_record = self.path_record = self.axis_record = None


_OF_POINT = ("point", "point_frames", "anchor", "point_unknown")
_POINT_OF = attrgetter(*_OF_POINT)


def joined(one: ModalState, other: ModalState) -> ModalState:
    """What holds where two paths meet, but for ``sources``; ``one`` itself where the other path adds nothing."""
    changed = _JOINS.changes(one, other)
    point = _joined_points(one, other)
    if not is_same(point, _POINT_OF(one)):
        changed |= zip(_OF_POINT, point, strict=True)
    return one.changed(**changed) if changed else one


def _joined_frames(
    one: FrameIndex | UnknownValue, other: FrameIndex | UnknownValue, name: str
) -> FrameIndex | UnknownValue:
    if isinstance(one, UnknownValue):
        return one
    if isinstance(other, UnknownValue):
        return other
    return UnknownValue("KRL005", f"{name} varies: line {one.line} or line {other.line}")


def _varies(one: ModalState, other: ModalState) -> str:
    """Why a point is not known that two paths leave differently."""
    if not (one.point_line and other.point_line) or one.point_line == other.point_line:
        return "it varies with the path that leads here"
    return f"it varies: line {one.point_line} or line {other.point_line}"


def _joined_points(
    one: ModalState, other: ModalState
) -> tuple[Numbers | None, PointFrames | None, Anchor | None, str]:
    """Point, its frames, what an axis motion gives of it, and why it is not known: component by component, NaN where
    two paths differ."""
    own = _POINT_OF(one)
    same = one.point_frames == other.point_frames and one.anchor == other.anchor
    if same and is_same(one.point, other.point):
        return own
    if not (one.point or one.anchor):
        return own if one.point_frames is None else (None, None, None, one.point_unknown)
    if not (other.point or other.anchor):
        return None, None, None, other.point_unknown
    if same and one.point is not None and other.point is not None:
        pairs = zip(one.point, other.point, strict=True)
        point = six([a if is_same(a, b) else NAN for a, b in pairs])
        why = one.point_unknown if point == one.point else _varies(one, other)
        return (
            point,
            one.point_frames,
            one.anchor,
            why,
        )  # with a constant orientation a point may need no more
    return None, None, None, _varies(one, other)


_JOINS = FieldJoins(
    {
        "base": lambda one, other: _joined_frames(one, other, "$BASE"),
        "tool": lambda one, other: _joined_frames(one, other, "$TOOL"),
        "feed": lost(NAN),
        "blend": lost(NAN),
        "tool_known": either,
        "axes": lost(None),
        "frames_record": lost(None),
        "path_record": lost(None),
        "axis_record": lost(None),
        "form": lost(None),
        "orientation": lost(OrientationMode.UNKNOWN),
        "arc_frame": lost(ArcFrame.UNKNOWN),
        "external": lambda one, other: six(
            [a if is_same(a, b) else LOST for a, b in zip(one, other, strict=True)]
        ),
        "external_apart": frozenset.union,
        "no_insert": either,
        "root_set": either,
        "later_since": either,
        "later_speed": frozenset.union,
        "overridden": frozenset.union,
        "stop": SOMETIMES,
        "no_advance": SOMETIMES,
        "moved_later": either,
        "ended_later": either,
        "point_line": lambda one, other: one,
        "later_comments": frozenset.union,
        "force": join_comments,
        "switch": join_comments,
    }
)
