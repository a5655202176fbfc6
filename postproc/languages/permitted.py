"""What the edits of a program may touch: the numbers and the targets of its motions, and lines of further ones."""

from __future__ import annotations

from codecs import BOM_UTF8

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Ints
from postproc.base.batches import in_blocks
from postproc.base.document import Document, Edits
from postproc.base.findings import Finding, Refusal
from postproc.languages.dialect import EditSyntax, Program
from postproc.languages.single_values import are_words, is_one_value
from postproc.toolpath import Toolpath

EDITS = 1 << 15
"""Edits that are looked at at a time."""

Bytes = NDArray[np.uint8]

_LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def _table(letters: bytes) -> Bools:
    table = np.zeros(256, np.bool_)
    table[list(letters)] = True
    return table


_BLANK, _DIGIT = _table(b" \t"), _table(b"0123456789")
_NAMED = _table(_LETTERS + _LETTERS.lower() + b"_$")
_NUMBER = _table(b"0123456789+-.eE \t")
_TARGET = b"0123456789 \t.,:+-*/'=#_$[]{}()"
"""What is in targets and in words of a motion beside letters: no comment, no string, no line ending."""

_COORDINATE = _table(b"XYZABCIJKRxyzabcijkr")
_OPEN, _CLOSE, _EQUALS, _SEMICOLON, _LF, _CR = b"()=;\n\r"


def refuse_other(program: Program, edits: Edits, letters: bytes) -> None:
    """Every edit of the motions is one of these, or Refusal FIL008:

    - a number in the place of a number, or of an expression, after the address of a coordinate, outside of comments;
    - in the line of a motion, outside of comments: words and targets, of the dialect's ``letters``;
    - whole lines of such words before the line of a motion or a spline block, or after the last point of a section of
      points; or whole lines in a companion.

    Where the language has no addresses (``EditSyntax``), the number of a coordinate is one in a list.
    """
    for index, document in enumerate(program.documents):
        own = edits.of(index)
        moving = _lines_of_motions(program.toolpath, document) if index == 0 else None
        if moving is not None and program.edit_syntax.points[1]:
            moving[program.edit_syntax.points[1]] = True
        look = _Look(document, own, letters, moving, program.edit_syntax)
        for wrong in in_blocks(look.first_wrong, len(own), EDITS):
            if wrong >= 0:
                edit = own[wrong]
                old, new = (
                    text[:60].decode("latin-1")
                    for text in (document.raw[edit.span.start : edit.span.stop], edit.text)
                )
                message = (
                    f"{new!r} in the place of {old!r} is not a correction of a motion; the"
                    f" self-check failed: the output differs from the plan"
                )
                raise Refusal(
                    Finding("FIL008", message, document.path.name, *document.place(edit.span.start))
                )


def _lines_of_motions(path: Toolpath, document: Document) -> Bools:
    """Of each number of a line, from 1, whether a motion is there, or a block starts before which one may."""
    lines = np.zeros(len(document.line_starts) + 1, np.bool_)
    lines[path.line] = True
    lines[list(path.constraints.spline_headers.values())] = True
    return lines


class _Look:
    """Of the edits of a document; ``moving``: lines with a motion, None in a companion, where none are."""

    def __init__(
        self, document: Document, edits: Edits, letters: bytes, moving: Bools | None, syntax: EditSyntax
    ) -> None:
        self.syntax, self.letters = syntax, letters
        self.raw = np.frombuffer(document.raw, np.uint8)
        self.texts = np.frombuffer(edits.texts, np.uint8)
        self.words = _table(_TARGET + letters + letters.lower())
        self.begins, self.edits, self.moving = document.line_starts, edits, moving
        self.head = len(BOM_UTF8) if document.raw.startswith(BOM_UTF8) else 0

    def first_wrong(self, part: slice) -> int:
        """The first edit that may not be, -1 if all may."""
        edits = self.edits
        start, stop = edits.start[part].astype(np.int64), edits.stop[part].astype(np.int64)
        ends = edits.ends[part.start : part.stop + 1].astype(np.int64)
        # The lines of these edits.
        low = int(np.searchsorted(self.begins, start[0], "right")) - 1
        high = int(np.searchsorted(self.begins, stop[-1], "right"))
        region = slice(int(self.begins[low]), int(stop[-1]))
        raw, texts = self.raw[region], self.texts[ends[0] : ends[-1]]
        at, to, ends = start - region.start, stop - region.start, ends - ends[0]

        filled = to > at
        number = filled & (ends[1:] > ends[:-1]) & ~_any(~_NUMBER[texts], ends[:-1], ends[1:])
        wrong = _any(~self.words[raw], at, to)
        for k in np.flatnonzero(wrong & number).tolist():
            # An expression has names of its own: Y[#<width>*2], X=WIDTH+2.
            wrong[k] = bool(self.syntax.numbers_after) or not is_one_value(
                raw[at[k] : to[k]].tobytes(), self._is_assigned(int(start[k]))
            )
        placed = self._listed(start) if self.syntax.numbers_after else self._addressed(start)
        wrong |= number & ~placed
        starts = self.begins[low:high] - region.start
        if self.head and low == 0:
            starts[0] = self.head
        other = ~number
        if other.any():
            wrong |= other & self._other(raw, at, to, texts, ends, starts, low)
        mark = self.syntax.comment
        wrong |= filled & (_after_mark(raw, at, mark) if mark else _commented(raw, at))
        return part.start + int(np.argmax(wrong)) if wrong.any() else -1

    def _addressed(self, start: Ints) -> Bools:
        """(K,) whether the address of a coordinate is before: X, X=, A3=, X=AC(, CA, CR=."""
        raw = self.raw
        at = self._back(start - 1)
        letter = raw[at]
        opened = letter == _OPEN
        good = np.ones(len(at), np.bool_)
        if opened.any():
            mode = (raw[at - 1] | 32 == ord("c")) & np.isin(raw[at - 2] | 32, list(b"ai"))
            at = np.where(opened, self._back(at - 3), at)
            letter = raw[at]
            good &= ~opened | (mode & (letter == _EQUALS))
        equals = letter == _EQUALS
        if equals.any():
            at = np.where(equals, self._back(at - 1), at)
            at -= equals & _DIGIT[raw[at]]
            letter = raw[at]
        before, first = raw[at - 1], raw[at - 2]
        named = _NAMED[before] & (at > 0)
        if named.any():  # CA, CR
            pair = (before | 32 == ord("c")) & np.isin(letter | 32, list(b"ar")) & ~_NAMED[first]
            good &= ~named | pair
        return np.asarray(good & _COORDINATE[letter] & (at >= 0))

    def _is_assigned(self, start: int) -> bool:
        """Whether ``=`` is before what starts there, or ``=AC(``."""
        before = self.raw[max(start - 80, 0) : start].tobytes().rstrip(b" \t")
        return before.endswith((b"=", b"("))

    def _listed(self, start: Ints) -> Bools:
        """(K,) whether a sign of a list is before, with nothing but blanks and line ends between."""
        at = start - 1
        empty = _BLANK | _table(b"\r\n")
        while (blank := empty[self.raw[at]] & (at > 0)).any():
            at = at - blank
        return np.asarray(_table(self.syntax.numbers_after)[self.raw[at]] & (at >= 0))

    def _back(self, at: Ints) -> Ints:
        """From ``at`` (K,) back over blanks."""
        while (blank := _BLANK[self.raw[at]]).any():
            at = at - blank
        return at

    def _other(
        self, raw: Bytes, at: Ints, to: Ints, texts: Bytes, ends: Ints, starts: Ints, low: int
    ) -> Bools:
        """(K,) wrong where the edit is no number in the place of one; lines from number ``low``."""
        line = np.maximum(np.searchsorted(starts, at, "right") - 1, 0)
        feeds = texts == _LF
        lines = _any(feeds, ends[:-1], ends[1:])
        closed = lines & (np.append(texts, 0)[ends[1:] - 1] == _LF)
        alone = (starts[line] == at) | (np.append(raw, 0)[at - 1] == _CR)
        whole = closed & (to == at) & alone
        spelt = self.words[texts] | feeds | (texts == _CR)
        wrong = _any(~spelt, ends[:-1], ends[1:])
        if not self.syntax.numbers_after:
            for k in np.flatnonzero(wrong).tolist():  # F#<feed>, F=WIDTH*2 of an inserted block
                wrong[k] = not are_words(texts[ends[k] : ends[k + 1]].tobytes(), self.letters)
        if self.moving is None:
            last = len(self.raw) - self.begins[low]
            return np.asarray(wrong | ~(whole | (lines & (at == to) & (at == last))))
        return np.asarray(wrong | (lines & ~whole) | ~self.moving[line + low + 1])


def _any(mask: Bools, start: Ints, end: Ints) -> Bools:
    """(K,) whether ``mask`` holds anywhere in the ranges start .. end - 1 (K,)."""
    if not mask.any():
        return np.zeros(len(start), np.bool_)
    count = np.zeros(len(mask) + 1, np.int32)
    np.cumsum(mask, out=count[1:])
    return np.asarray(count[end] > count[start])


def _commented(raw: Bytes, at: Ints) -> Bools:
    """(K,) whether a comment has begun before in the line, which CR ends too; the bracket of AC( starts none."""
    wrong = np.zeros(len(at), np.bool_)
    semicolons, opens = (np.flatnonzero(raw == mark) for mark in (_SEMICOLON, _OPEN))
    if not len(semicolons) and not len(opens):
        return wrong
    feeds = np.append(-1, np.flatnonzero((raw == _LF) | (raw == _CR)))
    line = feeds[np.searchsorted(feeds, at) - 1]

    def between(marks: Ints) -> Ints:
        return np.searchsorted(marks, at) - np.searchsorted(marks, line)

    wrong |= between(semicolons) > 0
    inside = np.flatnonzero(between(opens) > between(np.flatnonzero(raw == _CLOSE)))
    if len(inside):
        last = opens[np.searchsorted(opens, at[inside]) - 1]
        wrong[inside] |= _any(~_BLANK[raw], last + 1, at[inside])
    return wrong


def _after_mark(raw: Bytes, at: Ints, mark: bytes) -> Bools:
    """(K,) whether a comment that starts with ``mark``, outside of a string, has begun before in the line."""
    feeds = np.append(-1, np.flatnonzero((raw == _LF) | (raw == _CR)))
    line = feeds[np.searchsorted(feeds, at) - 1]
    marks = np.flatnonzero(raw == mark[0])
    wrong = np.searchsorted(marks, at) > np.searchsorted(marks, line)
    for k in np.flatnonzero(wrong).tolist():
        before = raw[line[k] + 1 : at[k]].tobytes()
        wrong[k] = mark in b"".join(before.split(b'"')[::2])
    return np.asarray(wrong)
