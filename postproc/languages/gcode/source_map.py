"""Where the motions of a G-code program are in its text, and what its words mean there: for the writer.

Words are many: they are not kept, but lexed again of the rows that are asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.languages.gcode.control import Control, Group, Move
from postproc.languages.gcode.execution import FoldedWords
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.modal import decode_g_codes
from postproc.languages.gcode.orientation_words import OrientationWords
from postproc.languages.gcode.words import COLUMNS, BlockSpans, How, Text, WordArrays, key


@dataclass(frozen=True, eq=False)
class WriterState:
    """What is in force at N motions.

    move (N,) Move and plane (N,) (0 XY, 1 ZX, 2 YZ); incremental (N,): axis words are differences (a word's own AC, IC
    goes before it: text.words.how); arc_absolute (N,): I J K are coordinates, else differences from the start. scale
    (N,) [m]: what one unit of a length word is; increment (N,) [m]: what one unit of a length word without a decimal
    point is (the same but for controls that count in increments). frame (N,): row in ``frames``, the programmed
    coordinates in the base: base = frame @ (number * scale). start_position (N, 3) [m]: where the motion starts, in its
    ``frame``; NaN where not known. orient (N,): row in ``orientations``, what the orientation words mean there, -1
    where none are in force; turned_values, turned_before (N, 3): the numbers of these words in force at the end of the
    motion, and just before its block; NaN where not known. room (N,) [m]: of drill cycles, from the bottom of the hole
    up to R, NaN of all others. feed_mode (N,) Feed: F of INVERSE_TIME belongs to the whole motion.
    """

    move: Ints
    plane: Ints
    incremental: Bools
    arc_absolute: Bools
    scale: Floats
    increment: Floats
    frame: Ints
    start_position: Floats
    orient: Ints
    turned_values: Floats
    turned_before: Floats
    room: Floats
    feed_mode: Ints

    def __len__(self) -> int:
        return len(self.move)


STATE = tuple(field.name for field in fields(WriterState))


@dataclass(frozen=True, eq=False)
class FoldedNumbers:
    """Words of motions whose text is an expression: row (K,) ascending, key (K,), value (K,) of the expression."""

    row: Ints
    key: Ints
    value: Floats

    @classmethod
    def of(cls, words: FoldedWords, rows: Ints) -> FoldedNumbers:
        """The words of a run with values of expressions, in the motions, which are its steps ``rows`` (N,)."""
        at = np.searchsorted(rows, words.step)
        mine = np.append(rows, -1)[at] == words.step
        order = np.argsort(at[mine], kind="stable")
        return cls(*(column[mine][order] for column in (at, words.key, words.value)))


@dataclass(frozen=True, eq=False)
class GcodeSourceMap(WriterState):
    """One row a motion, as in the Toolpath; every motion is a block.

    start, stop (N,): bytes of its line.
    """

    raw: bytes
    control: Control
    start: Ints
    stop: Ints
    frames: Poses
    orientations: tuple[OrientationWords, ...]
    folded: FoldedNumbers

    def part(self, start: int, stop: int) -> SourceMapPart:
        """The rows start .. stop - 1 with their words."""
        rows = slice(start, stop)
        columns = (*COLUMNS, *self.control.columns)
        state = {name: getattr(self, name)[rows] for name in STATE}
        span = (int(self.start[rows].min()), int(self.stop[rows].max())) if stop > start else (0, 0)
        text = _lexed(self.raw, self.control, self.start[rows], self.stop[rows])
        block = np.searchsorted(text.blocks.start, self.start[rows])
        word = np.full((len(text.blocks), len(columns)), -1, np.int32)
        for k, one in enumerate(columns):
            mine = np.flatnonzero(text.words.key == one)
            word[text.words.block[mine], k] = mine
        computed = self._fold(text, word, block, start, stop)
        return SourceMapPart(
            **state,
            raw=self.raw,
            span=span,
            text=text,
            block=block,
            columns=columns,
            word=word[block],
            verb=_verbs(text, self.control)[block],
            insert=text.blocks.code[block],
            frames=self.frames,
            orientations=self.orientations,
            computed=computed,
        )

    def _fold(self, text: Text, word: Ints, block: Ints, start: int, stop: int) -> Bools:
        """Puts the values of expressions into the words of the rows start .. stop - 1; (W,) these words."""
        computed = np.zeros(len(text.words), np.bool_)
        low, high = np.searchsorted(self.folded.row, [start, stop]).tolist()
        columns = np.array([*COLUMNS, *self.control.columns])
        for one in np.unique(self.folded.key[low:high]).tolist():
            if one in columns:
                mine = low + np.flatnonzero(self.folded.key[low:high] == one)
                at = word[block[self.folded.row[mine] - start], np.flatnonzero(columns == one)[0]]
                text.words.value[at], computed[at] = self.folded.value[mine], True
                unread = at[text.words.how[at] == How.UNREAD]
                text.words.how[unread] = How.NUMBER
        return computed


NEARER = 1 << 16
"""Bytes between lines that are lexed with them."""


def _lexed(raw: bytes, control: Control, start: Ints, stop: Ints) -> Text:
    """The lines from ``start`` to ``stop`` (N,) and those between that are not far."""
    if not len(start):
        return lex(raw, control, 0, 0)
    order = np.argsort(start, kind="stable")
    first, last = start[order], np.maximum.accumulate(stop[order])
    cuts = np.flatnonzero(first[1:] > last[:-1] + NEARER) + 1
    starts, stops = first[np.append(0, cuts)], last[np.append(cuts - 1, len(last) - 1)]
    parts = [lex(raw, control, *span) for span in zip(starts.tolist(), stops.tolist(), strict=True)]
    return parts[0] if len(parts) == 1 else _joined(parts)


def _joined(parts: list[Text]) -> Text:
    """Texts that follow each other as one."""
    before = np.cumsum([0, *(len(part.blocks) for part in parts)]).tolist()
    words = {
        one.name: np.concatenate([getattr(part.words, one.name) for part in parts])
        for one in fields(WordArrays)
    }
    words["block"] = np.concatenate([part.words.block + at for part, at in zip(parts, before, strict=False)])
    blocks = {
        one.name: np.concatenate([getattr(part.blocks, one.name) for part in parts])
        for one in fields(BlockSpans)
    }
    return Text(WordArrays(**words), BlockSpans(**blocks), (), np.empty((0, 3), np.int64))


@dataclass(frozen=True, eq=False)
class SourceMapPart(WriterState):
    """Motions that follow each other, with their words.

    raw: bytes of the file; span: range of their lines.  text: words, blocks of these and of the lines between.
    block (N,): row in text.blocks.
    columns (K,): keys; word (N, K): row in text.words of the word with that key in the block, -1 where it has none.
    verb (N,): row in text.words of the code (G1, G02 ...) that states the motion, -1 where it is inherited.
    computed (W,): words whose text is an expression.
    insert (N,): offset at which words that are missing are inserted (after the last word of the block).
    """

    raw: bytes
    span: tuple[int, int]
    text: Text
    block: Ints
    columns: tuple[int, ...]
    word: Ints
    verb: Ints
    insert: Ints
    frames: Poses
    orientations: tuple[OrientationWords, ...]
    computed: Bools

    def column(self, letter: str, index: int | None = None) -> Ints:
        """(N,) row in text.words of the words with this address."""
        return self.word[:, self.columns.index(key(letter, index))]


def _verbs(text: Text, control: Control) -> Ints:
    """(B,) the word that states the motion of a block, the last of them; -1 where none does."""
    rows = np.flatnonzero(text.words.key == key("G"))
    _, _, groups, values = decode_g_codes(text.words.value[rows], control)
    rows = rows[(groups == Group.MOTION) & (values != Move.NOTHING)]
    verb = np.full(len(text.blocks), -1, np.int32)
    verb[text.words.block[rows]] = rows
    return verb
