"""Feeds: F in a minute, in a turn of the spindle, or as the inverse of a block's time; and the speed of the spindle."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.languages.gcode.blocks import AXES, INCH, BlockWords
from postproc.languages.gcode.control import Feed, Group, Once
from postproc.languages.gcode.execution_flow import NONE_SAVED, FlowReason
from postproc.languages.gcode.modal_fill import lookup
from postproc.languages.gcode.source import WordColumn
from postproc.languages.gcode.words import key


def feeds_before_units(words: BlockWords) -> Bools:
    """(B,) blocks whose F is in the unit from before them, as they select another one."""
    units = words.modal.units
    if not words.control.feed_before_units:
        return np.zeros(len(words), np.bool_)
    return np.asarray(words.modal.switched(Group.UNITS) & (np.cumsum(units) > units) & words.has(key("F")))


class Feeds:
    """F and S of a program, as they hold on."""

    def __init__(self, words: BlockWords) -> None:
        # F and S of a dwell are times (G4 F2).
        self._dwell = words.modal.has(Once.DWELL)
        self._force, self._given = words.modal.force, words
        self._unit = lookup(self._force[words.control.feed_units], np.array([MM, INCH, np.nan]))
        late = np.flatnonzero(feeds_before_units(words))
        if len(late):
            unit = np.array(self._unit)
            unit[late] = self._unit[late - 1]
            self._unit = unit
        rate, spindle = (
            self._restored(self._outside(words.words(key("F")))),
            self._restored(self._speeds_of_spindle()),
        )
        self._rate, self._spindle = (_surely(column, _uncertain(words)) for column in (rate, spindle))
        other = words.modal.flow.forget | words.modal.flow.restored
        calls = np.where(other, np.arange(len(words)), -1)
        self._called = np.maximum.accumulate(calls)  # code that is not read may state F and S
        surface = np.where(self._force[Group.SPINDLE] != 0, np.arange(len(words)), -1)
        self._surface = np.maximum.accumulate(surface)

    def _outside(self, column: WordColumn) -> WordColumn:
        keep = ~self._dwell[column.block]
        return column if keep.all() else column.where(keep)

    def _restored(self, column: WordColumn) -> WordColumn:
        """The words with NaN where M72 or M73 brings back another one: controls round what they bring back."""
        words = self._given
        saved = words.modal.flow.saved if words.control.saves_modes else NONE_SAVED
        first, last = saved[saved[:, 1] < len(words)].T
        back = last[np.searchsorted(column.block, first) < np.searchsorted(column.block, last)]
        if not len(back):
            return column
        block = np.concatenate([back, column.block])
        order = np.argsort(block, kind="stable")
        value = np.concatenate([np.full(len(back), np.nan), column.value])[order]
        return WordColumn(block[order], value, np.zeros(len(block), np.int8))

    def _speeds_of_spindle(self) -> WordColumn:
        """The words S that are speeds, and those of which it is not known what they are, with NaN: S beside a shift of
        the origin alone is a limit (G92 S, G50 S), as it is beside G25 and G26 of a Sinumerik; S1= names a spindle."""
        words = self._given
        codes, limits = words.words(key("G")), words.modal.has(Once.SHIFT) & ~words.has(*AXES)
        limits[codes.block[np.isin(codes.value, _LIMITS)]] |= words.control.further
        column = self._outside(words.words(key("S")))
        column = column.where(~limits[column.block])
        unclear = words.modal.has(Once.SHIFT) | (self._force[Group.SPINDLE] != 0)
        named = np.flatnonzero(words.has(*(key("S", index) for index in range(10))))
        value = np.where(unclear[column.block], np.nan, column.value)
        block = np.concatenate([column.block, named])
        order = np.argsort(block, kind="stable")
        value = np.concatenate([value, np.full(len(named), np.nan)])[order]
        return WordColumn(block[order], value, np.zeros(len(block), np.int8))

    def _turns(self, blocks: Ints) -> Floats:
        """(N,) [1/min] what S states in blocks (N,); NaN at a constant surface speed, and after one until it is stated
        again."""
        at, turns = _latest(self._spindle, blocks)
        turns[(at <= self._surface[blocks]) | (at < self._called[blocks])] = np.nan
        return turns

    def of(self, blocks: Ints, length: Floats) -> Floats:
        """(N,) [m/s] of the motions in blocks of the program (N,); NaN where it is not known.

        G94: F units a minute; G95: F units a turn, S turns a minute, in the unit of the coordinates or, on a
        Sinumerik, of F; G93: the block takes 1/F minutes for its ``length`` (N,) [m].
        """
        mode = self._force[Group.FEED]
        here = mode[blocks]
        at, number = _latest(self._rate, blocks)
        rate = np.where(number > 0, number * self._unit[at], np.nan)
        # F means another thing in another mode, and has to be stated again there.
        rate[(mode[at] != here) | (at < self._called[blocks])] = np.nan
        turns = self._turns(blocks)
        own = self._given.words(key("F")).last(blocks)
        result = np.where(here == Feed.PER_TURN, rate * turns, rate)
        inverse_time = np.where(length > 0, length, np.nan) * np.where(own > 0, own, np.nan)
        result = np.where(here == Feed.INVERSE_TIME, inverse_time, result)
        result[here < 0] = np.nan
        for group in (Group.OVERRIDE, Group.FEED_AXES):
            result[self._force[group][blocks] != 0] = np.nan
        result[self._given.noted("feed")[blocks]] = np.nan
        return np.asarray(result / 60.0)

    def speeds(self, blocks: Ints) -> Floats:
        """(N,) [rad/s] of the spindle in blocks of the program (N,): the S that is in force, below zero after M4, 0
        after M5; NaN, after M4 -inf, where it is not known."""
        turns = self._turns(blocks)
        codes = self._given.words(key("M"))
        switches = np.isin(codes.value, (3.0, 4.0, 5.0))
        at = np.searchsorted(codes.block[switches], blocks, side="right") - 1
        switch = np.where(at >= 0, np.append(codes.value[switches], 0.0)[at], 0.0)
        back = switch == 4.0
        size = np.where(turns > 0, turns * (2 * np.pi / 60.0), np.where(back, np.inf, np.nan))
        return np.where(switch == 5.0, 0.0, np.where(back, -size, size))


_LIMITS = (25.0, 26.0)
"""G of a Sinumerik whose S is a limit."""
_HALTS = (0.0, 1.0, 60.0)
"""M that stop the program when their block has ended."""
_TOOL_CHANGE = 6.0
_FLOW = (2.0, 17.0, 30.0, 97.0, 98.0, 99.0)
"""M that say where the program goes on or ends; what is called is followed."""


def with_stops(blend: Floats, words: BlockWords, rows: Ints) -> Floats:
    """(N,) [m] ``blend`` (N,) of the motions in blocks ``rows`` (N,), as of ``blends``, but 0 where the control stops
    after a motion whatever its path mode, because a dwell or a halt is after it, and NaN where it may: controls differ
    in whether they blend over other M and tools."""
    codes = words.words(key("M"))
    called = np.isin(codes.value, _FLOW)
    halts = np.isin(codes.value, _HALTS)
    stops = _before_halts(words, rows)
    unclear = np.concatenate([codes.block[~halts & ~called], words.words(key("T")).block])
    maybe = np.concatenate([np.searchsorted(rows, unclear, side=side) - 1 for side in ("left", "right")])
    stops, maybe = stops[stops >= 0], maybe[maybe >= 0]
    stops, maybe = stops[blend[stops] != 0.0], maybe[blend[maybe] > 0.0]
    if not len(stops) and not len(maybe):
        return blend
    result = np.array(blend)
    result[maybe] = np.nan
    result[stops] = 0.0
    return result


def _before_halts(words: BlockWords, rows: Ints) -> Ints:
    """(K,) motions in blocks ``rows`` (N,) after which a dwell or a halt is, -1 before the first one."""
    codes = words.words(key("M"))
    before_dwell = np.searchsorted(rows, np.flatnonzero(words.modal.has(Once.DWELL)), side="left") - 1
    before_halt = np.searchsorted(rows, codes.block[np.isin(codes.value, _HALTS)], side="right") - 1
    return np.concatenate([before_dwell, before_halt])


def waits_after(words: BlockWords, rows: Ints) -> Bools:
    """(N,) motions in blocks ``rows`` (N,) after which the program waits, or may: a dwell, a halt, a change of tool."""
    codes = words.words(key("M"))
    changes = np.concatenate([codes.block[codes.value == _TOOL_CHANGE], words.words(key("T")).block])
    before = np.concatenate([_before_halts(words, rows), np.searchsorted(rows, changes, side="left") - 1])
    waits = np.zeros(len(rows), np.bool_)
    waits[before[before >= 0]] = True
    return waits


def _uncertain(words: BlockWords) -> Bools:
    """(B,) blocks that may run or not."""
    return np.isin(words.modal.flow.reason, (FlowReason.DELETED, FlowReason.FLOW))


def _surely(column: WordColumn, uncertain: Bools) -> WordColumn:
    """The words with NaN after one that states another value in a block that may run or not, uncertain (B,)."""
    maybe = uncertain[column.block]
    if not maybe.any():
        return column
    place = np.arange(len(column))
    sure = np.maximum.accumulate(np.where(maybe, -1, place))
    before = np.append(column.value, np.nan)[sure]
    other = np.maximum.accumulate(np.where(maybe & (column.value != before), place, -1))
    return WordColumn(column.block, np.where(other > sure, np.nan, column.value), column.how)


def _latest(column: WordColumn, blocks: Ints) -> tuple[Ints, Floats]:
    """The blocks (N,) that state what holds in ``blocks`` (N,), and what; 0 and NaN where none does."""
    at = np.searchsorted(column.block, blocks, side="right") - 1
    return np.maximum(np.append(column.block, -1)[at], 0), np.append(column.value, np.nan)[at]


def blend_tolerances(words: BlockWords) -> tuple[Ints, Floats]:
    """Blocks with a G64 (K,), and what its P allows [m] (K,), NaN where nothing bounds it."""
    codes = words.words(key("G"))
    says = codes.block[codes.value == 64.0]
    if not len(says):
        return says, np.empty(0)
    return says, np.where(_uncertain(words)[says], np.nan, words.lengths(key("P"))[says])


def blends(words: BlockWords, rows: Ints, allowed: tuple[Ints, Floats]) -> Floats:
    """(N,) [m] of the motions in blocks ``rows`` (N,): 0 in exact modes, else ``allowed`` (K,), as ``blend_tolerances``
    gives it."""
    path = words.modal.force[Group.PATH][rows]
    at = np.searchsorted(allowed[0], rows + words.start, side="right") - 1
    return np.where(path == 0, 0.0, np.where(path == 1, np.append(allowed[1], np.nan)[at], np.nan))
