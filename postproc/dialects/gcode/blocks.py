"""What every block asks for: its words in columns, whether it is a motion, what it does to the coordinates."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.control import Control, Group, Move, Once
from postproc.dialects.gcode.flow import Doubt
from postproc.dialects.gcode.modal import Modal
from postproc.dialects.gcode.places import COLUMNS
from postproc.dialects.gcode.positions import Course
from postproc.dialects.gcode.words import How, Text, key
from postproc.units import DEG, MM

INCH = 25.4 * MM
AXES = tuple(key(letter) for letter in "XYZABC")
THROUGH = tuple(key(letter, 1) for letter in "IJK")
"""The point between of an arc through three points."""

SECOND = tuple(key(letter) for letter in "UVW")
FRAMED = {
    Group.TURNED: "turned coordinates (G68)",
    Group.SCALED: "scaled coordinates (G51)",
    Group.MIRRORED: "mirrored coordinates (G51.1)",
    Group.POLAR: "polar coordinates (G16)",
    Group.DIAMETER: "diameters (G7)",
    Group.LENGTHS: "offset by what the program computes",
    Group.FOREIGN: "those of a mode that is not read",
}
"""Modes in which words are no coordinates of the base."""

CHANGES = (Once.SHIFT, Once.LOCAL, Once.UNSHIFT, Once.SUSPEND, Once.RESTORE, Once.FRAME)


class What:
    """What left a coordinate unknown."""

    REFERENCE = "the move to the reference point"
    MACHINE = "the move in machine coordinates"
    PROBE = "the probing"
    CODE = "a code that is not known"
    WORD = "a word that is no number"
    TWICE = "a word that stands twice"
    PARALLEL = "a word U, V or W"
    OTHER = "a motion whose end is not read"
    CYCLE = "the cycle"
    DOUBT = "a block that may not run"
    CALL = "code that was not read"
    TEXT = "text that is not understood"
    BASE = "the change of the offset"
    FRAME = "the change of coordinates"
    MODE = "absolute or incremental is not known"
    TIP = "the change of the TCP mode"
    ORIGIN = "G92 where the position is not known"


@dataclass(frozen=True, eq=False)
class Blocks:
    """The blocks with their words in columns: word (B, K) row in text.words, -1 where absent.

    length, length_of_integer (B,) [m]: a unit of a length word with and without a decimal point.
    """

    text: Text
    modal: Modal
    control: Control
    columns: tuple[int, ...]
    word: Ints
    twice: Bools
    length: Floats
    length_of_integer: Floats
    degrees_of_integer: float
    notes: dict[str, Bools]

    def __len__(self) -> int:
        return len(self.word)

    def noted(self, *kinds: str) -> Bools:
        """(B,) blocks with a note of one of these kinds."""
        result = np.zeros(len(self), np.bool_)
        for kind in kinds:
            if kind in self.notes:
                result |= self.notes[kind]
        return result

    def of(self, wanted: int) -> Ints:
        """(B,) row in text.words of the words with this key."""
        return self.word[:, self.columns.index(wanted)]

    def has(self, *wanted: int) -> Bools:
        return np.any(self.word[:, [self.columns.index(one) for one in wanted]] >= 0, axis=1)

    def number(self, wanted: int) -> Floats:
        """(B,) the numbers as written, NaN where absent."""
        rows = self.of(wanted)
        return np.where(rows >= 0, np.append(self.text.words.value, np.nan)[rows], np.nan)

    def lengths(self, wanted: int) -> Floats:
        """(B,) [m], NaN where absent."""
        rows = self.of(wanted)
        integer = np.append(self.text.words.how, 0)[rows] == How.INTEGER
        return self.number(wanted) * np.where(integer, self.length_of_integer, self.length)

    def angles(self, wanted: int) -> Floats:
        """(B,) [rad], NaN where absent."""
        integer = np.append(self.text.words.how, 0)[self.of(wanted)] == How.INTEGER
        return self.number(wanted) * np.where(integer, self.degrees_of_integer, DEG)

    def how(self, wanted: int) -> Ints:
        return np.append(self.text.words.how, -1)[self.of(wanted)]

    @cached_property
    def move(self) -> Ints:
        return self.modal.force[Group.MOTION]

    @cached_property
    def axis(self) -> Bools:
        """(B,) words of axes, or what stands for them."""
        second = () if self.control.further else SECOND
        return self.has(*AXES, *second) | self.noted("axis", "polar")

    @cached_property
    def motion(self) -> Bools:
        """(B,) the block moves the machine."""
        modal = self.modal
        silent = modal.has(Once.SETTING, Once.CALL, Once.OTHER, *CHANGES)
        # G4 X1.5 is a time; beside P, or with another axis, the words are a motion.
        moving = self.has(key("P"), *AXES[1:], *SECOND[1:])
        silent |= modal.has(Once.DWELL) & ~moving
        arc = np.isin(self.move, (Move.CLOCKWISE, Move.COUNTER, Move.THROUGH))
        centre = self.has(
            *(key(letter) for letter in "IJK"), *(one for one in THROUGH if one in self.columns)
        )
        arc &= centre | ((modal.verb >= 0) & self.has(key("R")))
        return modal.flow.tape & ((self.axis | arc) & ~silent | modal.has(Once.HOME))

    @cached_property
    def machine(self) -> Bools:
        """(B,) motions that are not to a place in the base."""
        return self.motion & self.modal.has(Once.HOME, Once.MACHINE, Once.PROBE)

    @cached_property
    def relative(self) -> Bools:
        """(B, 6) axis words that are differences."""
        hows = np.stack([self.how(axis) for axis in AXES], axis=1)
        incremental = (self.modal.force[Group.DISTANCE] == 1)[:, None]
        return (hows >= 0) & ((incremental & (hows != How.ABSOLUTE)) | (hows == How.INCREMENTAL))


def blocks(text: Text, modal: Modal, control: Control, increments: bool) -> Blocks:
    """``increments``: lengths without a decimal point count micrometres, or ten-thousandths of an inch."""
    columns = (*COLUMNS, *(key(letter) for letter in "STDHLQ"), *control.columns)
    known = text.words.key < 1 << 17
    lookup = np.full(1 << 17, -1)
    lookup[list(columns)] = np.arange(len(columns))
    column = np.where(known, lookup[np.where(known, text.words.key, 0)], -1)
    rows = np.flatnonzero(column >= 0)
    n, k = len(text.blocks), len(columns)
    word = np.full((n, k), -1, dtype=np.int64)
    word[text.words.block[rows], column[rows]] = rows
    many = np.bincount(text.words.block[rows] * k + column[rows], minlength=n * k).reshape(n, k) > 1
    inch = modal.force[Group.UNITS] == 1
    length = np.where(inch, INCH, MM)
    length[modal.force[Group.UNITS] < 0] = np.nan
    integer = length * np.where(inch, 1e-4, 1e-3) if increments else length
    return Blocks(
        text, modal, control, columns, word, np.any(many, axis=1), length, integer,
        DEG * (1e-3 if increments else 1.0), _noted(text),
    )  # fmt: skip


def _noted(text: Text) -> dict[str, Bools]:
    rows: defaultdict[str, list[int]] = defaultdict(list)
    for note in text.notes:
        rows[note.kind].append(note.block)
    found: dict[str, Bools] = {}
    for kind, blocks in rows.items():
        found[kind] = np.zeros(len(text.blocks), np.bool_)
        found[kind][blocks] = True
    return found


def course(given: Blocks, spoiled: Bools) -> tuple[Course, list[str], Ints]:
    """What the blocks do to the coordinates; the reasons why they leave them unknown, and which of them each block has.

    spoiled (B,): blocks before which the base became another one.
    """
    modal, n = given.modal, len(given)
    force, flow = modal.force, modal.flow
    present = np.stack([given.of(axis) >= 0 for axis in AXES], axis=1)
    value = np.stack(
        [given.lengths(axis) if i < 3 else given.angles(axis) for i, axis in enumerate(AXES)], axis=1
    )
    target = (given.motion & ~given.machine)[:, None] & present
    relative = given.relative
    lost, left = np.zeros((n, 6), np.bool_), np.zeros((n, 6), np.bool_)
    reasons: list[str] = []
    reason = np.full(n, -1)
    linear = np.arange(6) < 3

    def lose(where: Bools, rows: Bools, why: str) -> None:
        """Leaves coordinates unknown behind ``rows``: those of ``where`` (B, 6) or (6,)."""
        if rows.any():
            lost[rows] |= np.broadcast_to(where, (n, 6))[rows]
            reason[rows] = len(reasons)
            reasons.append(why)

    def leave(where: Bools, rows: Bools, why: str) -> None:
        """Leaves coordinates unknown before ``rows``, unless they set them."""
        if rows.any():
            left[rows] |= where
            reason[rows & (reason < 0)] = len(reasons)
            reasons.append(why)

    whole = np.ones(6, np.bool_)
    move, cycle = given.move, given.motion & (given.move == Move.CYCLE)
    unread = target & np.isnan(value)
    lose(unread, np.any(unread, axis=1), What.WORD)
    unclear = target & (force[Group.DISTANCE] < 0)[:, None]
    lose(unclear, np.any(unclear, axis=1), What.MODE)
    home, other = given.motion & modal.has(Once.HOME), np.isin(move, (Move.OTHER,)) & given.motion
    lose(present | ~np.any(present, axis=1)[:, None], home, What.REFERENCE)
    lose(present, given.motion & modal.has(Once.MACHINE), What.MACHINE)
    lose(whole, given.motion & modal.has(Once.PROBE), What.PROBE)
    lose(whole, given.axis & (modal.unknown >= 0), What.CODE)
    lose(whole, given.motion & given.twice, What.TWICE)
    parallel = np.stack([given.of(axis) >= 0 for axis in SECOND], axis=1)
    both = np.concatenate([parallel, np.zeros((n, 3), np.bool_)], axis=1)
    if not given.control.further:
        lose(both, parallel.any(axis=1) & given.motion & ~home, What.PARALLEL)
    lose(whole, other | (given.motion & (force[Group.MACRO] != 0)), What.OTHER)
    if cycle.any():
        # Words of a cycle give where it works; it ends at the depth that it began at, or at R.
        depth = np.array([2, 1, 0])[np.clip(force[Group.PLANE], 0, 2)]
        deep = np.zeros((n, 6), np.bool_)
        deep[np.arange(n), depth] = True
        target &= ~(cycle[:, None] & deep)
        repeats = given.has(key("L")) | given.has(key("K"))
        lose(deep, cycle & (force[Group.RETURN] != 0), What.CYCLE)
        lose(whole, cycle & repeats & (force[Group.DISTANCE] != 0), What.CYCLE)
    lose(present, given.motion & (flow.doubt != Doubt.NONE), What.DOUBT)
    lose(whole, given.noted("unknown"), What.TEXT)
    lose(whole, given.noted("corner", "axis", "polar"), What.OTHER)
    leave(whole, flow.forget, What.CALL)

    base = force[Group.OFFSET]
    changed = np.concatenate([[False], base[1:] != base[:-1]]) if n else np.zeros(0, np.bool_)
    leave(linear, changed | spoiled, What.BASE)
    for group in FRAMED:
        within = force[group] != 0
        lose(whole, within & given.motion, What.FRAME)
        leave(whole, np.concatenate([[False], within[1:] != within[:-1]]) if n else within, What.FRAME)
    tip = force[Group.TCP]
    if n and (tip != tip[0]).any():
        # With the rotary axes at 0 the words mean the same with and without a TCP mode.
        away = np.logical_or.accumulate(
            (target[:, 3:] & ((value[:, 3:] != 0) | relative[:, 3:])).any(axis=1) | home
        )
        leave(linear, np.concatenate([[False], tip[1:] != tip[:-1]]) & away, What.TIP)
    sets = target & ~relative
    adds = target & relative
    return Course(np.where(target, value, 0.0), sets, adds, lost, left), reasons, reason
