"""Words that are inserted into blocks, and blocks that are inserted before them."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Ints, sums
from postproc.base.document import Edit, Edits, Span
from postproc.languages.dialect import Program, Role
from postproc.languages.gcode.control import Move
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.source_map import SourceMapPart
from postproc.languages.gcode.words import How, key
from postproc.languages.gcode.writer_text import RADIUS, ProgrammedWords

_HEAD = re.compile(rb"(?:\xef\xbb\xbf)?([ \t]*(?:/[ \t]*\d?[ \t]*)?)")
HEAD = 1 << 16
"""Bytes from the start of a file that say how it is written."""

_NUMBER = key("N")
_LETTERS = list(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_")
_BEHIND = [ord(letter) for letter in ") \t"]
_CLOSED = re.compile(rb"(?:[ \t]*\))*")
_BLANK = re.compile(rb"[ \t]")


@dataclass(frozen=True)
class Style:
    """How a program is written: its newline; spaced: blocks have blanks between their words; two_digits: G01 for G1;
    longest: bytes of a line without its end that the control reads, None for any."""

    newline: bytes
    spaced: bool
    two_digits: bool
    longest: int | None = None

    @staticmethod
    def of(program: Program) -> Style:
        """By the first words of the program, and its first motion."""
        document, places = program.documents[0], program.text
        raw = document.raw
        words = lex(raw, places.control, 0, raw.find(b"\n", HEAD) + 1 or None).words
        gaps = [
            raw[a:b]
            for a, b in zip(words.stop[:200].tolist(), words.at[1:201].tolist(), strict=False)
            if 0 <= a <= b and b"\n" not in raw[a:b]
        ]
        part = places.part(0, min(len(places), 200))
        verbs = part.verb[part.verb >= 0][:1].tolist()
        said = part.text.words
        two = any(len(raw[int(said.start[v]) : int(said.stop[v])].strip()) > 1 for v in verbs)
        limit = places.control.longest_line
        longest = None if limit is None else limit - len(document.newline)
        return Style(document.newline, not gaps or any(gaps), two, longest)


@dataclass(frozen=True, eq=False)
class BlockInsertions:
    """Of M motions, row (M,) in ``places`` and ``text``, role (M,) as in the plan; convert (M,): I J K take the place
    of R; missing: motion -> column -> number."""

    style: Style
    places: SourceMapPart
    text: ProgrammedWords
    row: Ints
    role: Ints
    convert: Bools
    missing: Mapping[int, Mapping[int, bytes]]

    @property
    def raw(self) -> bytes:
        return self.places.raw

    @cached_property
    def _blanks(self) -> Ints:
        """Blanks before each byte of the lines."""
        start, end = self.places.span
        raw = np.frombuffer(self.raw, np.uint8)[start:end]
        return sums((raw == 32) | (raw == 9))

    def words_of(self, rows: Ints) -> tuple[Ints, Ints]:
        """(n,) the first word of the blocks of rows (n,) that is no block number, and after the last one."""
        words = self.places.text.words
        first, behind = (np.searchsorted(words.block, self.places.block[rows] + i) for i in (0, 1))
        return first + (words.key[np.minimum(first, len(words) - 1)] == _NUMBER), behind

    def gaps(self, rows: Ints, ends: Ints) -> Bools:
        """(n,) whether the words of the blocks of ``rows`` (n,), whose text goes to ``ends`` (n,), have blanks between;
        those with one word go by the program."""
        first, behind = self.words_of(rows)
        start = self.places.text.words.at[first]
        begin = self.places.span[0]
        blanks = self._blanks[ends - begin] > self._blanks[start - begin]
        spaced = np.where(behind - first > 1, blanks, self.style.spaced)
        # What follows a name without a blank would belong to it.
        raw = np.frombuffer(self.raw, np.uint8)
        return np.asarray(spaced | np.isin(raw[ends - 1], _LETTERS))


def insertions(blocks: BlockInsertions) -> Edits:
    """The edits that insert; a converted R as well."""
    own = np.flatnonzero(blocks.role == Role.ORIGINAL)
    inserted = np.flatnonzero(blocks.role != Role.ORIGINAL).tolist()
    before: dict[int, list[int]] = {}
    for m, owner in zip(inserted, own[np.searchsorted(own, inserted)].tolist(), strict=True):
        before.setdefault(owner, []).append(m)
    odd = set(before) | set(np.flatnonzero(blocks.convert).tolist())
    plain = np.array(sorted(set(blocks.missing) - odd - set(inserted)), dtype=np.int64)
    return Edits.joined(_completed(blocks, plain), _odd(blocks, sorted(odd), before))


def _odd(blocks: BlockInsertions, motions: list[int], before: Mapping[int, list[int]]) -> Iterator[Edit]:
    for m in motions:
        block = _InsertedBlock(blocks, int(blocks.row[m]))
        if m in before:
            yield block.inserted(before[m])
        if blocks.role[m] == Role.ORIGINAL:
            yield from block.completed(m, before.get(m, []))


def _completed(blocks: BlockInsertions, motions: Ints) -> Edits:
    """The words that blocks lack, after their last ones."""
    rows = blocks.row[motions]
    first, _ = blocks.words_of(rows)
    raw = np.frombuffer(blocks.raw, np.uint8)
    start = blocks.places.text.words.at[first]
    insert = blocks.places.insert[rows]
    ends = insert.copy()
    if np.isin(blocks.places.text.words.how, (How.ABSOLUTE, How.INCREMENTAL)).any():
        for k in np.flatnonzero(np.isin(raw[np.minimum(insert, len(raw) - 1)], _BEHIND)).tolist():
            ends[k] = _closed(blocks.raw, int(insert[k]))
    gaps = blocks.gaps(rows, ends).tolist()
    lower = (raw[start] > 96).tolist()
    addresses = blocks.text.keys[rows].tolist()
    texts = []
    for k, m in enumerate(motions.tolist()):
        gap, keys, small, numbers = b" " if gaps[k] else b"", addresses[k], lower[k], blocks.missing[m]
        texts.append(
            b"".join(gap + _address(keys[column], small) + numbers[column] for column in sorted(numbers))
        )
    bounds = sums(np.array([len(text) for text in texts], dtype=np.int64))
    return Edits(np.zeros(len(motions), np.int8), ends, ends, b"".join(texts), bounds)


def _closed(raw: bytes, at: int) -> int:
    """After the brackets of AC( and IC( that close after a number."""
    found = _CLOSED.match(raw, at)
    return found.end() if found else at


def _address(number: int, lower: bool) -> bytes:
    letter = bytes([number & 0xFF])
    text = letter if number < 256 else b"%s%d=" % (letter, (number >> 8) - 1)
    return text.lower() if lower else text


class _InsertedBlock:
    """The block of one row."""

    def __init__(self, blocks: BlockInsertions, row: int) -> None:
        self.blocks, self.row = blocks, row
        places, rows = blocks.places, np.array([row])
        self.raw = blocks.raw
        words = places.text.words
        (first,), (behind,) = blocks.words_of(rows)
        self.words = list(range(int(first), int(behind)))
        self.start = int(places.text.blocks.start[places.block[row]])
        self.insert = _closed(self.raw, int(places.insert[row]))
        self.gap = b" " if blocks.gaps(rows, np.array([self.insert]))[0] else b""
        self.lower = bool(self.raw[int(words.at[first])] > 96)
        self.verb = int(places.verb[row])
        self.move = int(places.move[row])

    def _word(self, k: int) -> bytes:
        words = self.blocks.places.text.words
        return self.raw[int(words.at[k]) : int(words.stop[k])]

    def _cased(self, text: bytes) -> bytes:
        return text.lower() if self.lower else text

    def _motion(self, move: int) -> bytes:
        if move == self.move and self.verb >= 0:
            return self._word(self.verb)
        if move == Move.THROUGH:
            return self._cased(b"CIP")
        return self._cased(b"G%02d" % move if self.blocks.style.two_digits else b"G%d" % move)

    def _address(self, column: int) -> bytes:
        """The address of a column, spelt as in the block if it is there."""
        k = int(self.blocks.text.word[self.row, column])
        if k >= 0:
            words = self.blocks.places.text.words
            own = self.raw[int(words.at[k]) : int(words.start[k])]
            if b"(" not in own:
                return own
        return _address(int(self.blocks.text.keys[self.row, column]), self.lower)

    def _stated(self, m: int) -> list[bytes]:
        numbers = self.blocks.missing.get(m, {})
        return [self._address(column) + numbers[column] for column in sorted(numbers)]

    def inserted(self, motions: list[int]) -> Edit:
        """The blocks of motions before the row's own."""
        head = _HEAD.match(self.raw, self.start)
        lead = head[1] if head else b""
        at = self.start + (len(BOM_UTF8) if self.raw.startswith(BOM_UTF8, self.start) else 0)
        lines: list[bytes] = []
        for m in motions:
            link = self.blocks.role[m] == Role.TRANSITION
            words = [self._motion(Move.LINE if link else self.move), *self._stated(m)]
            if not lines:
                words = [*self._modal(), *words, *self._feed()]
            lines.append(lead + self.gap.join(words) + self.blocks.style.newline)
        return Edit(Span(0, at, at), b"".join(lines))

    def _modal(self) -> list[bytes]:
        """The codes of the block other than its motion: they hold for what is inserted before it as well."""
        words = self.blocks.places.text.words
        return [self._word(k) for k in self.words if words.key[k] == key("G") and k != self.verb]

    def _feed(self) -> list[bytes]:
        words = self.blocks.places.text.words
        return [self._word(k) for k in self.words if words.key[k] == key("F")]

    def completed(self, m: int, before: list[int]) -> Iterator[Edit]:
        """The row's own block with the words that it lacks."""
        link = bool(before) and self.blocks.role[before[-1]] == Role.TRANSITION
        if link and self.verb < 0 and self.move != Move.LINE:
            at = int(self.blocks.places.text.words.at[self.words[0]])
            yield Edit(Span(0, at, at), self._motion(self.move) + self.gap)
        stated = self._stated(m)
        if self.blocks.convert[m]:
            centre = [
                word
                for column, word in zip(sorted(self.blocks.missing[m]), stated, strict=True)
                if column > 5
            ]
            stated = stated[: len(stated) - len(centre)]
            k = int(self.blocks.text.word[self.row, RADIUS])
            words = self.blocks.places.text.words
            yield Edit(Span(0, int(words.at[k]), int(words.stop[k])), self.gap.join(centre))
        if stated:
            text = b"".join(self.gap + word for word in stated)
            yield Edit(Span(0, self.insert, self.insert), text)
