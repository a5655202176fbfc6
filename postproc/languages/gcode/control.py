"""What differs between controls, as data: which code means what, which words there are, how a line is taken apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.languages.gcode.expression_values import ExpressionLanguage
from postproc.languages.gcode.words import Note, key


class Group(IntEnum):
    """Modal groups, of which one code is in force at a time; ONCE holds in its block only."""

    MOTION = 0  # Move
    PLANE = 1  # 0 XY, 1 ZX, 2 YZ
    DISTANCE = 2  # 0 absolute, 1 incremental
    ARCS = 3  # centre: 0 from the start, 1 absolute
    UNITS = 4  # 0 mm, 1 inch
    FEED = 5  # Feed
    OFFSET = 6  # number of the base
    PATH = 7  # 0 exact, 1 may be left
    TCP = 8  # 0 rotary axes are the machine's, 1 they orient the tool
    RETURN = 9  # of cycles: 0 to where they started, 1 to R
    LENGTH = 10  # tool length offset: 0 off, 1 on: it lies in the cell's tool, either way
    RADIUS = 11  # 0 off; else contours: not compensated
    LENGTHS = 12  # 0; else offsets that the program itself computes (G43.1)
    TURNED = 13  # 0; else rotated coordinates (G68)
    SCALED = 14  # 0; else scaled or mirrored coordinates
    MIRRORED = 15  # READ where the frame has it
    POLAR = 16  # 0; else polar coordinates
    DIAMETER = 17  # 0; else X is a diameter
    SPINDLE = 18  # 0 speed, 1 constant surface speed: F per revolution is then unknown
    MACRO = 19  # 0; 1 every block calls a macro (G66), 2 a drilling cycle (MCALL CYCLE81)
    FEED_UNITS = 24  # 0 mm, 1 inch: of F, where a control distinguishes it from that of coordinates
    FOREIGN = 20  # 0; else words are no coordinates of the base in this mode (#MCS ON, TRANSMIT)
    AXIAL = 21  # 0; else targets are axis positions, or reached as the axes go (PTP)
    ONCE = 22  # Once
    NONE = 23  # known, states nothing about the path
    CARRIER = 25  # 0; else the control turns the tool's offsets (TCARR)
    ROUNDING = 26  # 0; else the control rounds corners (RNDM)
    OFFSETS = 27  # 0; else an offset of the tool's length that the program adds (TOFFL)
    OVERRIDE = 28  # 0; else F is not the feed (OVR)
    FEED_AXES = 29  # 0 F is that of X, Y, Z; else of other axes too, or not of all (FGROUP)
    PLACED = 30  # 0; else coordinates are those of a plane that the program states (G68, G68.2 of a Fanuc)
    FACE = 31  # 0; else polar coordinate interpolation (G12.1)
    SPLINE = 34  # 0; else a spline leads through the targets, or near them (G151, #SPLINE ON)
    FIXTURE = 33  # 0; else coordinates are those of a clamped part whose place the program states (#ACS ON)
    BENT = 32  # 0; else of a mode whose end is not read (G7.1, G54.2, GEOAX): no code of another one ends it
    ORIENTED = 41  # tool vectors are in the coordinates of 0 the part, 1 the machine (ORIMKS)
    EULER = 40  # what A2= B2= C2= are: 0 Euler angles (Z X' Z''), 1 RPY angles (Z Y' X'')


class Move(IntEnum):
    """What the words of a block do."""

    RAPID = 0
    LINE = 1
    CLOCKWISE = 2
    COUNTER = 3
    THROUGH = 4  # an arc through a point
    NOTHING = 5  # G80: no motion is in force
    CYCLE = 6  # a canned cycle: the motion is hidden in the block
    SPLINE = 7
    THREAD = 8
    OTHER = 9  # a motion of this control that is not read


class Feed(IntEnum):
    PER_MINUTE = 0
    INVERSE_TIME = 1
    PER_TURN = 2


class Once(IntEnum):
    """Codes that hold in their block."""

    DWELL = 1  # the words are times
    HOME = 2  # reference point, perhaps by way of a point
    MACHINE = 3  # machine coordinates
    SHIFT = 4  # G92: here is ...
    LOCAL = 5  # G52: the origin is moved to ...
    UNSHIFT = 6  # G92.1
    SUSPEND = 7  # G92.2
    RESTORE = 8  # G92.3
    SETTING = 9  # G10
    CALL = 10  # G65: the words are arguments
    PROBE = 11
    OTHER = 12  # its words are no targets of a motion
    STORE = 14  # G28.1: stores the reference point, or seeks it with the axes that it names
    FRAME = 13  # a frame of this control (TRANS, ROT): Control.frame gives it


class ModalCode(NamedTuple):
    group: Group
    value: int


UNKNOWN = -1
"""Value of a group that cannot be determined."""
READ = 2
"""Value of a group of modes in which words are no coordinates of the base, where the frame states what they are."""


FIRST_NAME = 1000
"""Codes of names are numbers from here on."""


def modal_codes(entries: Iterable[tuple[Group, int, Iterable[float]]]) -> dict[int, ModalCode]:
    """Number of a code times ten -> what it says; of several entries the last holds."""
    return {
        round(number * 10): ModalCode(group, int(value))
        for group, value, numbers in entries
        for number in numbers
    }


def named_codes(
    entries: Iterable[tuple[Group, int, str]], separator: str | None = None
) -> tuple[dict[bytes, tuple[float, ...]], dict[int, ModalCode]]:
    """Name -> the numbers of its codes, and what these say; ``separator``: between the names of an entry."""
    names: dict[bytes, tuple[float, ...]] = {}
    codes: dict[int, ModalCode] = {}
    for group, value, said in entries:
        for name in said.split(separator):
            number = float(FIRST_NAME + len(codes))
            codes[round(number * 10)] = ModalCode(group, int(value))
            names[name.encode()] = (*names.get(name.encode(), ()), number)
    return names, codes


class LexedLine(NamedTuple):
    """A line that is not plain words: its words (address offset, key, number's start and stop or -1, value, How), the
    kinds and texts of what else it says, whether it starts with a slash."""

    words: list[tuple[int, int, int, int, float, int]]
    notes: list[tuple[str, str]]
    deleted: bool


class ToolAxis(IntEnum):
    """Where the tool points in a frame, outside of TCP modes."""

    STATED = 0  # as the cell and the words of rotary axes state it
    NORMAL = 1  # along the z axis of the frame
    UNKNOWN = 2  # along a frame that is no longer in force, unless words of rotary axes state it


@dataclass(frozen=True, eq=False)
class ProgrammedFrame:
    """Programmed coordinates in the base: base = turn @ xyz + shift[:3], and abc + shift[3:] for the rotary axes.

    turn (3, 3): a rotation, also scaled or mirrored; shift (6,) [m, rad], NaN where not known; memory: what the
    control itself remembers.  rotary (3,) [rad]: where the block that starts it leaves the rotary axes, NaN where not
    known; None where they stay.  reflection (3, 3): of what ``turn`` does the mirroring, in the axes of the base, after
    its rotations.
    """

    turn: Floats
    shift: Floats
    memory: Any = None
    tool: ToolAxis = ToolAxis.STATED
    rotary: Floats | None = None
    reflection: Floats = field(default_factory=lambda: np.eye(3))

    def mirrored(self, factors: Floats) -> ProgrammedFrame:
        """With the coordinates of some axes reversed: ``factors`` (3,), 1 or -1, in this frame."""
        axes = self.reflection.T @ self.turn
        axes = axes / np.linalg.norm(axes, axis=0)  # they may be scaled
        reflection = self.reflection @ (axes @ np.diag(factors) @ axes.T)
        return replace(self, turn=self.turn @ np.diag(factors), reflection=reflection)

    def to_base(self, programmed: Floats) -> Floats:
        """(..., 6) [m, rad] of ``programmed`` (..., 6) in the base."""
        return (
            np.concatenate([self._turned(programmed[..., :3], self.turn), programmed[..., 3:]], -1)
            + self.shift
        )

    def from_base(self, position: Floats) -> Floats:
        """(..., 6) [m, rad]: a ``position`` (..., 6) in the base as it would be programmed."""
        moved = position - self.shift
        back: Floats = self.turn.T if self.rigid else np.asarray(np.linalg.inv(self.turn), np.float64)
        return np.concatenate([self._turned(moved[..., :3], back), moved[..., 3:]], -1)

    @property
    def rigid(self) -> bool:
        """Coordinates are neither scaled nor mirrored."""
        return bool(np.abs(self.turn @ self.turn.T - np.eye(3)).max() < 1e-9 and np.linalg.det(self.turn) > 0)

    @staticmethod
    def _turned(vector: Floats, turn: Floats) -> Floats:
        # Without a rotation an axis that is not known states nothing about the others.
        along = np.diagonal(turn)
        return vector * along if np.array_equal(turn, np.diag(along)) else vector @ turn.T


def either_frame(one: ProgrammedFrame, other: ProgrammedFrame) -> ProgrammedFrame:
    """What is known where one of two frames is in force, ``other`` after a block that may run: what both have."""
    alike = np.array_equal(one.turn, other.turn) and np.array_equal(one.reflection, other.reflection)
    same = (one.shift == other.shift) & alike
    memory = _either_memory(one.memory, other.memory)
    tool = one.tool if one.tool == other.tool else ToolAxis.UNKNOWN
    rotary = None if other.rotary is None else np.full(3, np.nan)
    shift = np.where(same, one.shift, np.nan)
    return ProgrammedFrame(other.turn, shift, memory, tool, rotary, other.reflection)


def _either_memory(one: Any, other: Any) -> Any:
    if isinstance(other, dict):
        before = one or {}
        return {name: value if before.get(name) == value else (np.nan,) * 6 for name, value in other.items()}
    if isinstance(other, np.ndarray):
        return np.where(other == (one if isinstance(one, np.ndarray) else np.nan), other, np.nan)
    return one if other is None else other


@dataclass(frozen=True, eq=False)
class Event:
    """A block that changes the frame: its words (key -> value as written, NaN if UNREAD), its Once bits, its notes.

    plane: 0, 1, 2 for G17, G18, G19; absolute: under G90; scale [m]: one unit of length; frame: before the block;
    position (6,) [m, rad]: where the tool is, in the base.
    """

    words: Mapping[int, float]
    once: int
    notes: tuple[Note, ...]
    codes: tuple[float, ...]
    plane: int
    scale: float
    frame: ProgrammedFrame
    position: Floats
    absolute: bool = True


def keep_frame(event: Event) -> ProgrammedFrame:
    """The frame as it was: of a control without codes that change it."""
    return event.frame


@dataclass(frozen=True)
class Control:
    """One dialect of G-code.

    codes: G number times ten -> what it says; also: what else some of them say; named: a word that is alone ->
    the same; names: addresses of more than a letter -> their key; comment: pattern of comments (and of strings,
    group 1, which are none); line: takes a line apart that is not plain words; start: what is in force before
    anything is stated. endings: M codes after which nothing is read; cycle_apart: G80 goes back to the move that was
    in force before the cycle; increments: a length without a decimal point may count increments; turns: key of the
    word that gives the turns of an arc, and how many of them an arc without the word has. frame: the frame after a
    block with G52, G92 ... or Once.FRAME; columns: keys of further words of motions. angles: what A, B, C do where
    a program uses all three, see ``orientation.Angles.sequence``; whole: they then give the orientation of the tool
    itself, not what turns it from where it is in the cell; vector, euler: keys of the words of a tool vector
    and of angles that say where it points. calls: keys of words that call a subprogram in a block without G and M;
    feed_units: the group that says the unit of F;
    further: U, V, W are axes beside X, Y, Z, and leave these as they are; offsets: key of the word that selects the
    tool's offsets, of which 0 switches them off (D); feed_before_units: F in a block with G20 or G21 is in the unit
    from before it; retract: key of what says where a cycle that a block calls by its name retracts to;
    parameter: the letter that is no address with digits and an equals sign but a variable (R1=2); iso: every
    word belongs to a code of its block or to its motion; expressions: the language of its variables and
    expressions, None where these are not read; radius_gap [m]: by how much the radii of an arc at its start and end may
    differ where mm and where inch are in force; drills: codes of the cycles that go to R, to the depth that the axis
    normal to the plane states, and back.  states_tool: the M code whose Q is the number of the tool that is loaded;
    saves_modes: M70 to M73 save and restore what is in force; keeps_length: M6 with the tool that is loaded already
    changes no coordinate; longest_line: bytes of a line with its end that the control reads, None where its manuals
    state none; increments_by_setting: whether an increment after a change of the frame starts at the place of the tool
    or at its coordinates from before it, is a setting; layered_offsets: a work offset is one of the coordinate system
    in which it is selected, as ``frame`` follows.
    """

    name: str
    codes: Mapping[int, ModalCode]
    also: Mapping[int, tuple[ModalCode, ...]] = field(default_factory=dict, kw_only=True)
    line: Callable[[bytes], LexedLine]
    comment: bytes
    named: Mapping[bytes, ModalCode] = field(default_factory=dict)
    names: Mapping[bytes, int] = field(default_factory=dict)
    start: Mapping[Group, int] = field(default_factory=dict)
    endings: frozenset[int] = frozenset((2, 30))
    cycle_apart: bool = False
    increments: bool = False
    turns: tuple[int, int] = (key("P"), 1)
    frame: Callable[[Event], ProgrammedFrame] = keep_frame
    columns: tuple[int, ...] = ()
    angles: tuple[tuple[int, int], ...] = ((2, 2), (1, 1), (0, 0))
    whole: bool = False
    vector: tuple[int, ...] = ()
    euler: tuple[int, ...] = ()
    calls: frozenset[int] = frozenset()
    feed_units: Group = Group.UNITS
    further: bool = False
    offsets: int | None = None
    feed_before_units: bool = False
    retract: int | None = None
    parameter: str = ""
    iso: bool = False
    expressions: ExpressionLanguage | None = None
    radius_gap: tuple[float, float] = (1e-5, 1e-5)
    drills: frozenset[int] = frozenset()
    states_tool: int | None = None
    keeps_length: bool = False
    saves_modes: bool = False
    longest_line: int | None = None
    increments_by_setting: bool = False
    layered_offsets: bool = False
