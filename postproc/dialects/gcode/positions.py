"""Where every block ends: modal coordinates, differences, and frames that the program moves.

A coordinate is a recurrence: a word sets it (or adds to it), no word keeps it, some blocks leave it unknown.  Between
two changes of the frame it is solved for all blocks at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.control import Frame

MOST = 2000
"""Changes of the frame that are followed; behind them nothing is known."""


@dataclass(frozen=True, eq=False)
class Course:
    """What the blocks do to the coordinates X, Y, Z, A, B, C, all (B, 6).

    value [m, rad] where ``sets``, a coordinate, or where ``adds``, a difference; lost: unknown behind the block;
    left: unknown already before it.
    """

    value: Floats
    sets: Bools
    adds: Bools
    lost: Bools
    left: Bools


@dataclass(frozen=True, eq=False)
class Positions:
    """begin, end (B, 6) [m, rad]: programmed coordinates before and behind every block, in its frame.

    source (B, 6): the block that set, or lost, each coordinate; -1 where none did.  frame (B,): row in ``frames``.
    """

    begin: Floats
    end: Floats
    source: Ints
    frame: Ints
    frames: tuple[Frame, ...]

    def in_base(self) -> Floats:
        """(B, 6) the ends in the base."""
        result = np.empty_like(self.end)
        for i, j in pairwise([*np.flatnonzero(np.diff(self.frame, prepend=-1)).tolist(), len(self.frame)]):
            result[i:j] = self.frames[self.frame[i]].to_base(self.end[i:j])
        return result


def positions(
    course: Course, first: Frame, events: Ints, change: Callable[[int, Frame, Floats], Frame]
) -> Positions:
    """The coordinates of every block.

    events (E,): blocks that change the frame (and move nothing), ascending; ``change`` (block, frame, position in the
    base) gives the frame behind one.
    """
    n = len(course.value)
    begin, end = np.empty((n, 6)), np.empty((n, 6))
    source = np.empty((n, 6), np.int64)
    number = np.empty(n, np.int64)
    frames = [first]
    here, origin, at = np.full(6, np.nan), np.full(6, -1), 0
    for event in [*events[:MOST].tolist(), n]:
        frame = frames[-1]
        piece = slice(at, event)
        number[piece] = len(frames) - 1
        if event > at:
            begin[piece], end[piece], source[piece] = _scan(course, piece, here, origin)
            here, origin = end[event - 1], source[event - 1]
        if event < n:
            there = frame.to_base(here)
            frames.append(change(event, frame, there))
            here = frames[-1].from_base(there)
            origin = np.where(np.isnan(here), event, origin)
        at = event
        if len(frames) > MOST:
            frames.append(Frame(np.eye(3), np.full(6, np.nan)))
            here = np.full(6, np.nan)
    return Positions(begin, end, source, number, tuple(frames))


def _scan(course: Course, piece: slice, here: Floats, origin: Ints) -> tuple[Floats, Floats, Ints]:
    value, sets, adds = course.value[piece], course.sets[piece], course.adds[piece]
    lost, left = course.lost[piece], course.left[piece] & ~course.sets[piece]
    gone = lost | left | (adds & np.isnan(value))
    anchor = sets | gone
    n = len(value)
    where = np.maximum.accumulate(np.where(anchor, np.arange(n)[:, None], -1), axis=0)
    known = np.where(sets & ~lost, value, np.nan)
    total = np.cumsum(np.where(adds & ~anchor, value, 0.0), axis=0)
    row = np.maximum(where, 0)
    column = np.arange(6)
    end = np.where(where >= 0, known[row, column] + (total - total[row, column]), here + total)
    source = np.where(where >= 0, where + piece.start, origin)
    begin = np.concatenate([here[None], end[:-1]])
    begin[course.left[piece]] = np.nan
    return begin, end, source
