"""A whole program taken apart: all words of an address in one column, which a range of blocks takes its part of.

The place of a word is not kept: who writes lexes the lines again that are changed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from postproc.base.array_storage import GrowingColumns
from postproc.base.arrays import Bools, Floats, Ints, sums
from postproc.base.batches import in_blocks
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.words import Note, Text, key

SIZE = 1 << 18
"""Bytes that are lexed at a time."""
MACRO = 65
"""G65 calls as M98, with values for variables."""
FIRST_INDEXED = 128
"""Keys from here on are no letters alone."""


@dataclass(frozen=True, eq=False)
class WordColumn:
    """The words of one key in the order of the text: block (W,), value (W,) as written, NaN if UNREAD, how (W,) How."""

    block: Ints
    value: Floats
    how: Ints

    def __len__(self) -> int:
        return len(self.block)

    def part(self, start: int, stop: int) -> WordColumn:
        """Those of the blocks start .. stop - 1, counted from ``start``."""
        low, high = np.searchsorted(self.block, [start, stop]).tolist()
        return WordColumn(self.block[low:high] - start, self.value[low:high], self.how[low:high])

    def where(self, stay: Bools) -> WordColumn:
        """Those of ``stay`` (W,)."""
        return WordColumn(self.block[stay], self.value[stay], self.how[stay])

    def in_order(self, order: Ints) -> WordColumn:
        """The words of blocks ``order`` (E,), which are the rows of the result."""
        first = np.searchsorted(self.block, order)
        many = np.searchsorted(self.block, order, side="right") - first
        total = int(many.sum())
        at = np.repeat(first - (np.cumsum(many) - many), many) + np.arange(total)
        return WordColumn(np.repeat(np.arange(len(order)), many), self.value[at], self.how[at])

    def last(self, blocks: Ints, absent: float = np.nan) -> Floats:
        """(K,) the last values in blocks (K,)."""
        if not len(self.block):
            return np.full(len(blocks), absent)
        at = np.maximum(np.searchsorted(self.block, blocks, side="right") - 1, 0)
        return np.where(self.block[at] == blocks, self.value[at], absent)


NONE = WordColumn(np.empty(0, np.int32), np.empty(0), np.empty(0, np.int8))


@dataclass(frozen=True, eq=False)
class SourceLines:
    """Of B blocks: start, stop, first, line, deleted as in ``words.Blocks``; wordy (B,): has a word beside N."""

    start: Ints
    stop: Ints
    first: Ints
    line: Ints
    deleted: Bools
    wordy: Bools

    def __len__(self) -> int:
        return len(self.start)


@dataclass(frozen=True, eq=False)
class Source:
    """columns: key -> its words; comments (C, 3): as in ``words.Text``."""

    columns: Mapping[int, WordColumn]
    blocks: SourceLines
    notes: tuple[Note, ...]
    comments: Ints

    @cached_property
    def noted(self) -> Mapping[str, Ints]:
        """kind of note -> its blocks (K,)."""
        rows: defaultdict[str, list[int]] = defaultdict(list)
        for note in self.notes:
            rows[note.kind].append(note.block)
        return {kind: np.array(blocks) for kind, blocks in rows.items()}

    def in_order(self, order: Ints, kept: Ints) -> Source:
        """The blocks in another ``order`` (E,), some maybe many times; those in rows ``kept`` (K,) are not
        deleted there."""
        columns = {one: column.in_order(order) for one, column in self.columns.items()}
        lines = {one.name: getattr(self.blocks, one.name)[order] for one in fields(SourceLines)}
        lines["deleted"][kept] = False
        noted: defaultdict[int, list[Note]] = defaultdict(list)
        for note in self.notes:
            noted[note.block].append(note)
        mask = np.zeros(len(self.blocks), np.bool_)
        mask[list(noted)] = True
        steps = np.flatnonzero(mask[order])
        notes = tuple(
            note._replace(block=step)
            for step, block in zip(steps.tolist(), order[steps].tolist(), strict=True)
            for note in noted[block]
        )
        return Source(columns, SourceLines(**lines), notes, self.comments)

    def with_values(self, block: Ints, address: Ints, nth: Ints, value: Floats, how: Ints) -> Source:
        """With other values in words: ``value`` and ``how`` (K,) of the ``nth`` (K,) ones with the key ``address`` (K,)
        in ``block`` (K,)."""
        if not len(block):
            return self
        columns = dict(self.columns)
        for one in np.unique(address).tolist():
            mine = np.flatnonzero(address == one)
            column = columns[one]
            values, hows = column.value.copy(), column.how.copy()
            at = np.searchsorted(column.block, block[mine]) + nth[mine]
            values[at], hows[at] = value[mine], how[mine]
            columns[one] = WordColumn(column.block, values, hows)
        return Source(columns, self.blocks, self.notes, self.comments)

    def column(self, wanted: int) -> WordColumn:
        return self.columns.get(wanted, NONE)

    def mask(self, *wanted: int) -> Bools:
        """(B,) blocks with a word of one of these keys."""
        mask = np.zeros(len(self.blocks), np.bool_)
        for one in wanted:
            mask[self.column(one).block] = True
        return mask


def scan(raw: bytes, control: Control) -> Source:
    """A program taken apart, part by part."""
    words: dict[int, GrowingColumns] = {}
    lines = GrowingColumns(np.int32, np.int32, np.int32, np.int32, np.bool_, np.bool_)
    comments = GrowingColumns(np.int32)
    notes: list[Note] = []
    pieces = list(_pieces(raw))
    first = sums(np.array([raw.count(b"\n", *piece) for piece in pieces])).tolist()
    blocks = 0

    def lexed(part: slice) -> Text:
        start, end = pieces[part.start]
        return lex(raw, control, start, end, 1 + first[part.start])

    for text in in_blocks(lexed, len(pieces), 1):
        for one in np.flatnonzero(np.bincount(text.words.key)).tolist():
            rows = np.flatnonzero(text.words.key == one)
            column = words.setdefault(one, GrowingColumns(np.int32, np.float64, np.int8))
            column.add(text.words.block[rows] + blocks, text.words.value[rows], text.words.how[rows])
        here = text.blocks
        wordy = np.zeros(len(here), np.bool_)
        wordy[text.words.block[text.words.key != key("N")]] = True
        lines.add(here.start, here.stop, here.first, here.line, here.deleted, wordy)
        notes += (
            [Note(block + blocks, kind, said) for block, kind, said in text.notes] if blocks else text.notes
        )
        notes += _arguments(text, blocks) if control.iso else ()
        comments.add(text.comments.reshape(-1))
        blocks += len(here)
    columns = {one: WordColumn(*column.done()) for one, column in sorted(words.items())}
    return Source(columns, SourceLines(*lines.done()), tuple(notes), next(comments.done()).reshape(-1, 3))


def _arguments(text: Text, before: int) -> Iterator[Note]:
    """The letters of blocks with a G65 in their order, which says what I, J and K are; ``before``: blocks before."""
    words = text.words
    for block in np.unique(words.block[(words.key == key("G")) & (words.value == MACRO)]).tolist():
        low, high = np.searchsorted(words.block, [block, block + 1]).tolist()
        letters = "".join(chr(one) for one in words.key[low:high].tolist() if one < FIRST_INDEXED)
        yield Note(block + before, "arguments", letters)


def _pieces(raw: bytes) -> Iterator[tuple[int, int]]:
    """Ranges of whole lines."""
    start = 0
    while start < len(raw) or not start:
        end = raw.find(b"\n", start + SIZE) + 1 or len(raw)
        yield start, end
        start = end or 1
