"""Where every block ends: modal coordinates, differences, and frames that the program moves.

A coordinate is a recurrence: a word sets it (or adds to it), no word keeps it, some blocks leave it unknown.  Between
two changes of the frame it is solved for all blocks at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import DEG, MM
from postproc.languages.gcode.control import ProgrammedFrame, ToolAxis

_LINEAR = np.arange(6) < 3
SAME = 1e-9
"""[m, rad] coordinates that differ by less are the same."""
MOST = 2000
"""Changes of the frame that are followed; after them nothing is known."""


@dataclass(frozen=True, eq=False)
class AxisWords:
    """What the blocks do to the coordinates X, Y, Z, A, B, C, each (B, 6).

    value (B, 6) [m, rad]; sets (B, 6): it is a coordinate; adds (B, 6): a difference; unknown (B, 6): lost after the
    block; unknown_before (B, 6): unknown already before it.  by_machine (B,): it moves along axes of the machine;
    by_length (B,): another tool length holds from it on.
    """

    value: Floats
    sets: Bools
    adds: Bools
    unknown: Bools
    unknown_before: Bools
    by_machine: Bools
    by_length: Bools


@dataclass(frozen=True, eq=False)
class PolarTargets:
    """Of B blocks: target (B, 3): axes of the plane that a block in polar coordinates moves; place (B, 3) [m]: where,
    NaN where that is not known; read (B,): polar coordinates, or none, are in force, and which it is, is known."""

    target: Bools
    place: Floats
    read: Bools

    def part(self, start: int, stop: int) -> PolarTargets:
        """The blocks start .. stop - 1."""
        rows = slice(start, stop)
        return PolarTargets(self.target[rows], self.place[rows], self.read[rows])


@dataclass(frozen=True, eq=False)
class Positions:
    """Of some blocks, start, end (B, 6) [m, rad]: programmed coordinates before and after every block, in its frame.

    source (B, 6): the block of the program that set, or lost, each coordinate; -1 where none did. frame (B,): row in
    ``frames``.
    """

    start: Floats
    end: Floats
    source: Ints
    frame: Ints
    frames: Sequence[ProgrammedFrame]

    def in_base(self) -> Floats:
        """(B, 6) the ends in the base."""
        result = np.empty_like(self.end)
        for i, j in pairwise([*np.flatnonzero(np.diff(self.frame, prepend=-1)).tolist(), len(self.frame)]):
            result[i:j] = self.frames[self.frame[i]].to_base(self.end[i:j])
        return result


def stated_place(words: Mapping[str, float]) -> Floats:
    """(6,) [m, rad] where the axes are that ``words`` [mm, deg] name, NaN where that is not stated."""
    stated = np.array([words.get(axis, math.nan) for axis in "XYZABC"])
    return np.asarray(stated * np.repeat([MM, DEG], 3))


class Trace:
    """Follows the coordinates of a program through its blocks, in their order."""

    def __init__(
        self,
        first: ProgrammedFrame,
        events: Ints,
        change: Callable[[int, ProgrammedFrame, Floats], ProgrammedFrame],
        here: Floats | None = None,
        increments_by_setting: bool = False,
    ) -> None:
        """here (6,) [m, rad]: where the axes are at the first block, NaN where that is not known, as without;
        events (E,): blocks that change the frame (and move nothing), ascending; ``change`` (block, frame, position
        in the base) gives the frame after one; increments_by_setting: as of ``Control``."""
        self._by_setting, self._undecided = increments_by_setting, np.zeros(6, np.bool_)
        self._events, self._change = events[:MOST], change
        self.frames = [first]
        self._here = np.full(6, np.nan) if here is None else here
        self._origin = np.full(6, -1)

    def frame_of(self, blocks: Ints) -> Ints:
        """Rows (K,) in ``frames`` of blocks (K,) that were followed."""
        return np.searchsorted(self._events, blocks, side="right").astype(np.int16)

    def started(self, frames: Ints) -> Ints:
        """The blocks (K,) that start the frames of rows ``frames`` (K,) in ``frames``; 0 of the first."""
        return np.append(0, self._events)[frames]

    def follow(self, axis_words: AxisWords, start: int) -> Positions:
        """The next blocks, of which ``start`` is the first."""
        n = len(axis_words.value)
        found = Positions(
            np.empty((n, 6)),
            np.empty((n, 6)),
            np.empty((n, 6), np.int32),
            self.frame_of(np.arange(start, start + n)),
            self.frames,
        )
        low, high = np.searchsorted(self._events, [start, start + n]).tolist()
        at = 0
        for event in (self._events[low:high] - start).tolist():
            self._scan(axis_words, slice(at, event), start, found)
            self._turn(start + event, axis_words.unknown_before[event])
            at = event
        self._scan(axis_words, slice(at, n), start, found)
        return found

    def _turn(self, event: int, unknown_before: Bools) -> None:
        """Goes on in the frame after ``event``; after too many nothing is known.  left (6,): coordinates that are
        unknown already before it."""
        self._here = np.where(unknown_before, np.nan, self._here)
        self._origin = np.where(unknown_before, event, self._origin)
        there = self.frames[-1].to_base(self._here)
        frame = self._change(event, self.frames[-1], there)
        if len(self.frames) == MOST:
            frame = ProgrammedFrame(np.eye(3), np.full(6, np.nan))
        self.frames.append(frame)
        before, self._here = self._here, frame.from_base(there)
        if self._by_setting:
            moved = ~(np.abs(self._here - before) < SAME) & ~(np.isnan(before) & np.isnan(self._here))
            self._undecided = self._undecided | moved
        if frame.rotary is not None:
            self._here[3:] = frame.rotary
        self._origin = np.where(np.isnan(self._here), event, self._origin)

    def _scan(self, axis_words: AxisWords, piece: slice, first: int, positions: Positions) -> None:
        if piece.stop > piece.start:
            positions.start[piece], positions.end[piece], positions.source[piece] = _scan(
                axis_words, piece, self._here, self._origin, first, self.frames[-1], self._undecided
            )
            self._undecided = self._undecided & ~axis_words.sets[piece].any(axis=0)
            self._here, self._origin = (
                positions.end[piece.stop - 1].copy(),
                positions.source[piece.stop - 1].copy(),
            )


def _scan(
    axis_words: AxisWords,
    piece: slice,
    here: Floats,
    origin: Ints,
    first: int,
    frame: ProgrammedFrame,
    undecided: Bools,
) -> tuple[Floats, Floats, Ints]:
    value, sets, adds = axis_words.value[piece], axis_words.sets[piece], axis_words.adds[piece]
    lost, left = axis_words.unknown[piece], axis_words.unknown_before[piece]
    if not np.array_equal(frame.turn, np.eye(3)):
        # what moves along one axis of the machine, or of the tool, moves along several of the frame
        lost = lost | (axis_words.by_machine[piece][:, None] & _LINEAR)
        if frame.tool != ToolAxis.NORMAL and frame.turn[2, 2] != 1.0:
            left = left | (axis_words.by_length[piece][:, None] & _LINEAR)
    unknown_before = left & ~sets
    gone = lost | unknown_before | (adds & np.isnan(value))
    if undecided.any():
        gone |= adds & undecided & ~np.logical_or.accumulate(sets, axis=0)
    anchor = sets | gone
    n = len(value)
    where = np.maximum.accumulate(np.where(anchor, np.arange(n)[:, None], -1), axis=0)
    known = np.where(sets & ~lost, value, np.nan)
    total = np.cumsum(np.where(adds & ~anchor, value, 0.0), axis=0)
    row = np.maximum(where, 0)
    column = np.arange(6)
    end = np.where(where >= 0, known[row, column] + (total - total[row, column]), here + total)
    source = np.where(where >= 0, where + (first + piece.start), origin)
    start = np.concatenate([here[None], end[:-1]])
    start[left] = np.nan
    return start, end, source
