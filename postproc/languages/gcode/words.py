"""The words of a G-code program as arrays: which address, which number, where it is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from postproc.base.arrays import Bools, Floats, Ints

NAMES = 1 << 16
"""Keys from here on are a control's own names (CR, TURN): its ``Control.names`` numbers them."""


def key(letter: str, index: int | None = None) -> int:
    """The key of an address: of ``X`` or, with an index, of ``A3=`` (an address with digits and an equals sign)."""
    return ord(letter) if index is None else ord(letter) + 256 * (index + 1)


COLUMNS = tuple(key(letter) for letter in "XYZABCIJKRPFUVWE")
"""Addresses of words that say something of motions; a control's own follow."""


class How(IntEnum):
    """How the value of a word is written."""

    NUMBER = 0  # X1.5
    INTEGER = 1  # X1, no decimal point: a control may count it in increments
    ABSOLUTE = 2  # X=AC(1.5): absolute, whatever G90 or G91
    INCREMENTAL = 3  # X=IC(1.5): relative
    UNREAD = 4  # X#1, X[1+2], X=R1: no number; its value is NaN


@dataclass(frozen=True, eq=False)
class WordArrays:
    """W words in the order of the text.

    at (W,): offset of the address; start, stop (W,): range of the number's bytes alone (sign included, without AC( ));
    -1 where the word has none.  key (W,): see ``key``; value (W,): the number as written, NaN if UNREAD;
    how (W,) How; block (W,): row in Blocks.
    """

    at: Ints
    start: Ints
    stop: Ints
    key: Ints
    value: Floats
    how: Ints
    block: Ints

    def __len__(self) -> int:
        return len(self.at)


def value_note(
    words: list[tuple[int, int, int, int, float, int]], address: int, how: int, text: bytes
) -> bytes:
    """What a note of the kind "value" says of a word that follows ``words`` of its line: its key, how many words of
    that key are before it, its How, and its expression."""
    return b"%d %d %d " % (address, sum(word[1] == address for word in words), how) + text.strip()


class Note(NamedTuple):
    """What a block says besides its words: ``kind`` of the said, and its text.

    value: the expression of a word, see ``value_note``; assign: an assignment; if: the condition of the rest of the
    block; open, close, between, while: a loop or a branch; jump, label, call, program, tape: as in the text; base: a
    work offset is written; tool: a tool is called by its name; corner, axis, polar, frame, swivel, spin: a word
    of that kind; cycle: a cycle of the control is called;
    arguments: the letters of a block with G65 in their order; unknown: text that is not understood."""

    block: int
    kind: str
    text: str


@dataclass(frozen=True, eq=False)
class BlockSpans:
    """B blocks: the lines that have a word or a note.

    start, stop (B,): bytes of the line, without its ending; line (B,): from 1; first (B,): offset of the first word, or
    start; code (B,): where its code ends (after the last word, before a comment); deleted (B,): starts with a slash.
    """

    start: Ints
    stop: Ints
    line: Ints
    first: Ints
    code: Ints
    deleted: Bools

    def __len__(self) -> int:
        return len(self.start)


@dataclass(frozen=True, eq=False)
class Text:
    """Lines taken apart; offsets and numbers of lines are those of the file.  ``comments``: (C, 3) byte ranges of
    comments, and their lines."""

    words: WordArrays
    blocks: BlockSpans
    notes: tuple[Note, ...]
    comments: Ints
