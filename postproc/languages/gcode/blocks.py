"""What every block asks for: its words in columns, whether it is a motion, what it does to the coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints, is_shared
from postproc.base.units import DEG, MM
from postproc.languages.gcode.control import READ, Control, Group, Move, Once
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.integer_words import IntegerWords
from postproc.languages.gcode.modal import Modal
from postproc.languages.gcode.modal_fill import everywhere, lookup
from postproc.languages.gcode.positions import AxisWords, PolarTargets
from postproc.languages.gcode.source import Source, WordColumn
from postproc.languages.gcode.words import COLUMNS, How, key

INCH = 25.4 * MM
SMALL_ANGLE = 1e-3
"""[deg] what an angle without a decimal point counts where such words count increments."""
AXES = tuple(key(letter) for letter in "XYZABC")
THROUGH = tuple(key(letter, 1) for letter in "IJK")
"""The point between of an arc through three points."""

SECOND = tuple(key(letter) for letter in "UVW")
FRAMED = {
    Group.TURNED: "rotated coordinates (G68)",
    Group.SCALED: "scaled coordinates (G51)",
    Group.MIRRORED: "mirrored coordinates",
    Group.POLAR: "polar coordinates (G16)",
    Group.DIAMETER: "diameters (G7)",
    Group.LENGTHS: "an offset that the program computes",
    Group.FOREIGN: "those of an unknown mode",
    Group.FIXTURE: "those of a part's own system (#ACS ON)",
    Group.FACE: "those of polar interpolation (G12.1)",
    Group.BENT: "those of a mode that is not read (G7.1, G54.2, GEOAX)",
    Group.CARRIER: "those of a tool whose offsets the control turns (TCARR)",
    Group.OFFSETS: "those of a tool whose length the program adds to (TOFFL, DL)",
}
"""Modes in which words are no coordinates of the base."""

MIRRORING = (50.1, 51.1)
"""Codes that mirror axes, and end that."""


def framed(force: Ints) -> Bools:
    """(B,) blocks in which a mode of ``FRAMED``, in force (B,), holds that is not read."""
    return np.asarray((force != 0) & (force != READ))


CHANGES = (Once.SHIFT, Once.LOCAL, Once.UNSHIFT, Once.SUSPEND, Once.RESTORE, Once.FRAME)


class What:
    """What left a coordinate unknown."""

    REFERENCE = "the move to the reference point"
    MACHINE = "the move in machine coordinates"
    PROBE = "the probing"
    CODE = "a code that is not known"
    WORD = "a word that is no number"
    TWICE = "a word that occurs twice"
    UNUSED = "a word that belongs to no code"
    INTEGER = "a word without a decimal point"
    PARALLEL = "a word U, V or W"
    OTHER = "a motion whose end is not read"
    CYCLE = "the cycle"
    SWIVEL = "the change of the swivelled plane"
    UNCERTAIN = "a block that runs only sometimes"
    CALL = "code that is not read"
    TEXT = "text that is not understood"
    BASE = "the change of the offset"
    FRAME = "the change of coordinates"
    MODE = "absolute or incremental is not known"
    TIP = "the change of the TCP mode"
    LENGTH = "the change of the tool's length"
    INCREMENT = "an increment after a change of coordinates, of which a setting states where it starts"
    ORIGIN = "a new origin where the position is not known"


class Reasons:
    """What left coordinates unknown: numbers of texts, -1 for none; of every block the last one."""

    def __init__(self, count: int) -> None:
        self.texts: list[str] = []
        self.of = np.full(count, -1, np.int8)

    def number(self, why: str) -> int:
        if why not in self.texts:
            self.texts.append(why)
        return self.texts.index(why)


@dataclass(frozen=True, eq=False)
class BlockWords:
    """The blocks ``start`` .. ``stop`` - 1 of a program; all rows count from ``start``.

    columns: keys of words that say something of motions.  integers: what lengths without a decimal point mean.
    """

    source: Source
    modal: Modal
    control: Control
    columns: tuple[int, ...]
    integers: IntegerWords
    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    def with_absolute_centres(self) -> BlockWords | None:
        """The blocks with I J K as coordinates; None where a code says what they are."""
        codes = self.words(key("G")).value
        if np.isin(codes, (90.1, 91.1)).any():
            return None
        return replace(self, modal=self.modal.with_value(Group.ARCS, 1))

    def part(self, start: int, stop: int) -> BlockWords:
        """The blocks start .. stop - 1 of a whole program."""
        modal = self.modal.part(start, stop)
        return BlockWords(self.source, modal, self.control, self.columns, self.integers, start, stop)

    @cached_property
    def _whole(self) -> bool:
        return len(self) == len(self.source.blocks)

    def words(self, wanted: int) -> WordColumn:
        """All words with this key."""
        column = self.source.column(wanted)
        return column if self._whole else column.part(self.start, self.stop)

    def _dense(self, wanted: int, values: str, absent: float, dtype: Any) -> NDArray[Any]:
        column = self.words(wanted)
        if not len(column):
            return everywhere(absent, len(self), dtype)
        dense = np.full(len(self), absent, dtype)
        dense[column.block] = getattr(column, values)
        return dense

    def noted(self, *kinds: str) -> Bools:
        """(B,) blocks with a note of one of these kinds."""
        result = np.zeros(len(self), np.bool_)
        for kind in kinds:
            rows = self.source.noted.get(kind)
            if rows is not None:
                result[rows[(rows >= self.start) & (rows < self.stop)] - self.start] = True
        return result

    def has(self, *wanted: int) -> Bools:
        """(B,) blocks with a word of one of these keys."""
        mask = np.zeros(len(self), np.bool_)
        for one in wanted:
            mask[self.words(one).block] = True
        return mask

    def number(self, wanted: int) -> Floats:
        """(B,) the numbers as written, the last of a block; NaN where absent."""
        return self._dense(wanted, "value", np.nan, np.float64)

    def how(self, wanted: int) -> Ints:
        """(B,) How, -1 where absent."""
        return self._dense(wanted, "how", -1, np.int8)

    def _scaled(self, wanted: int, unit: Floats | float, integer: Floats | float) -> Floats:
        number = self.number(wanted)
        if is_shared(number):
            return number
        return number * np.where(self.how(wanted) == How.INTEGER, integer, unit)

    def lengths(self, wanted: int) -> Floats:
        """(B,) [m], NaN where absent."""
        return self._scaled(wanted, self.length, self.length_of_integer)

    def angles(self, wanted: int) -> Floats:
        """(B,) [rad], NaN where absent."""
        return self._scaled(wanted, DEG, DEG * (SMALL_ANGLE if self.integers.increments else 1.0))

    @cached_property
    def length(self) -> Floats:
        """(B,) [m]: a unit of a length word with a decimal point."""
        return lookup(self.modal.force[Group.UNITS], np.array([MM, INCH, np.nan]))

    @cached_property
    def length_of_integer(self) -> Floats:
        """(B,) [m]: a unit of a length word without."""
        small = (
            np.array([MM * 1e-3, INCH * 1e-4, np.nan])
            if self.integers.increments
            else np.array([MM, INCH, np.nan])
        )
        return lookup(self.modal.force[Group.UNITS], small)

    @cached_property
    def ambiguous(self) -> Bools:
        """(B,) blocks with a length of which it is not known what it means without a decimal point."""
        mask = np.zeros(len(self), np.bool_)
        for one in (*AXES[:3], *(key(letter) for letter in "IJKR")) if self.integers.ambiguous else ():
            column = self.words(one)
            mask[column.block[(column.how == How.INTEGER) & (column.value != 0)]] = True
        return mask

    @cached_property
    def twice(self) -> Bools:
        """(B,) blocks in which a word is repeated."""
        mask = np.zeros(len(self), np.bool_)
        for one in self.columns:
            block = self.words(one).block
            mask[block[1:][block[1:] == block[:-1]]] = True
        return mask

    @cached_property
    def move(self) -> Ints:
        """(B,) Move in force."""
        move, macro = self.modal.force[Group.MOTION], self.modal.force[Group.MACRO]
        called = macro == 2
        return np.where(called & self.has(*AXES), np.int8(Move.CYCLE), move) if called.any() else move

    @cached_property
    def axis(self) -> Bools:
        """(B,) words of axes, or what takes their place."""
        second = () if self.control.further else SECOND
        return self.has(*AXES, *second) | self.noted("axis", "polar")

    @cached_property
    def beside(self) -> Bools:
        """(B, 3) words U, V, W that may move something.

        Axes of their own or steps of X, Y, Z: before the first that is not 0, U0 moves nothing either way."""
        columns = [self.source.column(one) for one in SECOND]
        first = min(
            (int(one.block[one.value != 0][0]) for one in columns if (one.value != 0).any()), default=-1
        )
        if first < 0 or first >= self.stop:
            return everywhere(False, len(self) * 3).reshape(-1, 3)
        present = np.stack([self.how(axis) >= 0 for axis in SECOND], axis=1)
        return np.asarray(present & (np.arange(self.start, self.stop) >= first)[:, None])

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
        arc &= centre | (modal.states & self.has(key("R")))
        # where it is not known what is active, a block with a centre and no other code may be one
        arc |= (modal.flow.reason != FlowReason.NONE) & centre & (modal.states | ~self.has(key("G")))
        return modal.flow.tape & ((self.axis | arc) & ~silent | modal.has(Once.HOME))

    @cached_property
    def machine(self) -> Bools:
        """(B,) motions that are not to a place in the base."""
        return self.motion & self.modal.has(Once.HOME, Once.MACHINE, Once.PROBE)

    @cached_property
    def present(self) -> Bools:
        """(B, 6) the axes that have words."""
        return np.stack([self.has(axis) for axis in AXES], axis=1)

    @cached_property
    def relative(self) -> Bools:
        """(B, 6) axis words that are differences."""
        hows = np.stack([self.how(axis) for axis in AXES], axis=1)
        incremental = (self.modal.force[Group.DISTANCE] == 1)[:, None]
        return np.asarray((hows >= 0) & ((incremental & (hows != How.ABSOLUTE)) | (hows == How.INCREMENTAL)))


def blocks(source: Source, modal: Modal, control: Control, integers: IntegerWords) -> BlockWords:
    """All blocks of a program."""
    columns = (*COLUMNS, *(key(letter) for letter in "STDHLQ"), *control.columns)
    return BlockWords(source, modal, control, columns, integers, 0, len(source.blocks))


def _circles_back(words: BlockWords) -> Bools:
    """(B,) blocks with G12 or G13, which end where they start."""
    codes, mask = words.words(key("G")), np.zeros(len(words), np.bool_)
    mask[codes.block[np.isin(codes.value, (12.0, 13.0))]] = words.control.increments
    return mask


def _targets(words: BlockWords) -> tuple[Bools, Floats, Bools]:
    """(B, 6) words that are targets, their values [m, rad], and those of them that are differences."""
    values = [words.lengths(axis) if i < 3 else words.angles(axis) for i, axis in enumerate(AXES)]
    return (words.motion & ~words.machine)[:, None] & words.present, np.stack(values, axis=1), words.relative


def tilted(words: BlockWords, tilting: Bools) -> Bools:
    """(B,) of a whole program: blocks after which rotary axes may be away from 0; tilting (B,): those that state
    a direction of the tool which turns them.

    Without a change of the TCP mode that states nothing, and no block is named."""
    tip = words.modal.force[Group.TCP]
    if not len(tip) or (tip == tip[0]).all():
        return everywhere(False, len(words))
    target, value, relative = _targets(words)
    home = words.motion & words.modal.has(Once.HOME)
    return np.logical_or.accumulate(
        tilting | (target[:, 3:] & ((value[:, 3:] != 0) | relative[:, 3:])).any(axis=1) | home
    )


CYCLES = (73.0, *(float(code) for code in range(81, 90)))
"""Codes of the canned cycles of ISO controls."""


def frame_events(
    words: BlockWords,
    spoiled: Bools,
    away: Bools,
    ends: Floats,
    lengths: Bools,
    references: Floats,
    polar: PolarTargets,
    reasons: Reasons,
) -> AxisWords:
    """What the blocks do to the coordinates; why they leave them unknown is put into ``reasons``.

    spoiled (B,): blocks before which the base became another one; away (B,): see ``tilted``; ends (B,) [m]: as of
    ``CycleEnds``; lengths (B,): blocks in which another tool length holds than before; references (B, 6) [rad]: as of
    ``reference_angles``; polar: of these blocks.
    """
    modal, n = words.modal, len(words)
    force, flow = modal.force, modal.flow
    present = words.present
    target, value, relative = _targets(words)
    lost, left = np.zeros((n, 6), np.bool_), np.zeros((n, 6), np.bool_)
    reason = reasons.of[words.start : words.stop]
    linear = np.arange(6) < 3

    def lose(where: Bools, rows: Bools, why: str) -> None:
        """Leaves coordinates unknown after ``rows``: those of ``where`` (B, 6) or (6,)."""
        if rows.any():
            lost[rows] |= np.broadcast_to(where, (n, 6))[rows]
            reason[rows] = reasons.number(why)

    def leave(where: Bools, rows: Bools, why: str) -> None:
        """Leaves coordinates unknown before ``rows``, unless they set them: those of ``where`` (B, 6) or (6,)."""
        if rows.any():
            left[rows] |= np.broadcast_to(where, (n, 6))[rows]
            reason[rows & (reason < 0)] = reasons.number(why)

    whole = np.ones(6, np.bool_)
    move, cycle = words.move, words.motion & (words.move == Move.CYCLE)
    if polar.target.any():
        target[:, :3] |= polar.target
        value[:, :3] = np.where(polar.target, polar.place, value[:, :3])
        relative = relative & ~np.pad(polar.target, ((0, 0), (0, 3)))
    unread = target & np.isnan(value)
    lose(unread, np.any(unread, axis=1), What.WORD)
    lose(unread, np.any(unread[:, :3] & polar.target, axis=1), What.FRAME)
    lose(whole, words.axis & words.ambiguous, What.INTEGER)
    ambiguous = target & (force[Group.DISTANCE] < 0)[:, None]
    lose(ambiguous, np.any(ambiguous, axis=1), What.MODE)
    home, other = words.motion & modal.has(Once.HOME), np.isin(move, (Move.OTHER,)) & words.motion
    led = np.isfinite(references) & home[:, None]
    target, value, relative = target | led, np.where(led, references, value), relative & ~led
    lose((present | ~np.any(present, axis=1)[:, None]) & ~led, home, What.REFERENCE)
    lose(present, words.motion & modal.has(Once.MACHINE), What.MACHINE)
    lose(whole, words.motion & modal.has(Once.PROBE), What.PROBE)
    lose(whole, words.axis & modal.unknown, What.CODE)
    lose(whole, words.axis & modal.unused, What.UNUSED)
    lose(whole, words.motion & words.twice, What.TWICE)
    if not words.control.further and words.beside.any():
        parallel = words.beside
        both = np.concatenate([parallel, np.zeros((n, 3), np.bool_)], axis=1)
        lose(both, parallel.any(axis=1) & words.motion & ~home, What.PARALLEL)
    # of a motion of the control without words of axes: holes on a circle (G70 I J L), a pocket (G150 P)
    other |= modal.states & (move == Move.OTHER) & ~_circles_back(words)
    lose(whole, other | (words.motion & (np.abs(force[Group.MACRO]) == 1)), What.OTHER)
    if cycle.any():
        # Words of a cycle give where it works.
        depth = np.array([2, 1, 0])[np.clip(force[Group.PLANE], 0, 2)]
        deep = np.zeros((n, 6), np.bool_)
        deep[np.arange(n), depth] = True
        target &= ~(cycle[:, None] & deep)
        relative = relative & ~(cycle[:, None] & deep)
        at_level = cycle & np.isfinite(ends)
        target |= at_level[:, None] & deep
        value = np.where(at_level[:, None] & deep, ends[:, None], value)
        repeats = words.has(key("L")) | words.has(key("K"))
        lose(deep, cycle & ~at_level, What.CYCLE)
        lose(linear, cycle & (force[Group.PLANE] < 0), What.CYCLE)
        # of a hole that runs no time it is not stated whether the tool goes there
        none = (words.number(key("L")) == 0) | (words.number(key("K")) == 0)
        lose(linear, cycle & none, What.CYCLE)
        lose(whole, cycle & repeats & (force[Group.DISTANCE] != 0), What.CYCLE)
    if (move < 0).any() and np.isin(words.source.column(key("G")).value, CYCLES).any():
        # perhaps a cycle, which ends elsewhere along the axis in which it works
        lose(linear, words.motion & (move < 0), What.CYCLE)
    lose(present, words.motion & (flow.reason != FlowReason.NONE), What.UNCERTAIN)
    lose(whole, words.noted("unknown"), What.TEXT)
    if (called := words.noted("cycle")).any():
        single = np.zeros((n, 6), np.bool_)
        single[np.arange(n), np.array([2, 1, 0])[np.clip(force[Group.PLANE], 0, 2)]] = True
        retracting = () if words.control.retract is None else (words.control.retract,)
        at_plane = called & words.has(*retracting) & np.isfinite(ends)
        target |= at_plane[:, None] & single
        value = np.where(at_plane[:, None] & single, ends[:, None], value)
        lose(linear, called & ~at_plane, What.CYCLE)
    leave(linear, words.noted("swivel"), What.SWIVEL)
    lose(whole, words.noted("axis", "polar") | (words.noted("corner") & ~words.motion), What.OTHER)
    leave(whole, flow.forget, What.CALL)

    leave(linear, modal.switched(Group.OFFSET) | spoiled, What.BASE)
    if (apart := force[Group.OFFSET] < 0).any():
        # from one offset that is not known to another one
        leave(linear, apart & (flow.reason != FlowReason.NONE) & words.has(key("G")), What.BASE)
    codes = words.words(key("G"))
    mirrored = np.zeros(n, np.bool_)
    mirrored[codes.block[np.isin(codes.value, MIRRORING)]] = True
    mirrored &= force[Group.MIRRORED] == READ
    for group in FRAMED:
        if force[group].any() or modal.ahead[group]:
            known = polar.read if group == Group.POLAR else np.zeros(n, np.bool_)
            lose(whole, framed(force[group]) & words.motion & ~known, What.FRAME)
            leave(whole, modal.switched(group) & ~mirrored & ~known, What.FRAME)
    leave(present, mirrored, What.FRAME)
    if force[Group.PLACED].any() or modal.ahead[Group.PLACED]:
        by_plane = modal.has(Once.FRAME) & words.control.iso & ~mirrored
        leave(linear, modal.switched(Group.PLACED) | by_plane, What.FRAME)
    # With the rotary axes at 0 the words mean the same with and without a TCP mode.
    leave(linear, modal.switched(Group.TCP) & away, What.TIP)
    if lengths.any():
        # Along the tool, which only rotary axes away from 0 can lay elsewhere than along Z.
        leave(np.arange(6) == 2, lengths, What.LENGTH)
        leave(linear, lengths & away, What.LENGTH)
    by_machine = words.motion & modal.has(Once.HOME, Once.MACHINE)
    return AxisWords(
        np.where(target, value, 0.0), target & ~relative, target & relative, lost, left, by_machine, lengths
    )
