"""The bytes of a G-code program as words.

Lines of nothing but ``letter number`` and ``letter digits = number`` words, which is nearly all of them, are taken
apart together, as arrays; only what is left comes to the control's own ``line``.  Blanks and letter case say nothing.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.control import Control, Line
from postproc.dialects.gcode.words import Blocks, How, Note, Text, Words

BOM = b"\xef\xbb\xbf"
LONGEST = 40
"""Bytes of a number; what is longer is none."""

_BLANK, _NEWLINE, _LETTER, _DIGIT, _DOT, _SIGN, _EQUALS, _OTHER = range(8)
_CLASS = np.full(256, _OTHER, dtype=np.uint8)
for _bytes, _class in (
    (b" \t\x0b\x0c", _BLANK),
    (b"\r\n", _NEWLINE),
    (b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz", _LETTER),
    (b"0123456789", _DIGIT),
    (b".", _DOT),
    (b"+-", _SIGN),
    (b"=", _EQUALS),
):
    _CLASS[list(_bytes)] = _class

Bytes = NDArray[np.uint8]


def lex(raw: bytes, control: Control) -> Text:
    """The words, blocks and notes of a program; never raises on its content, in linear time."""
    letters = np.frombuffer(raw, np.uint8)
    comments = _comments(raw, control.comment)
    blanked = _blanked(letters, comments, raw.startswith(BOM))
    plain, odd, ends = _plain(letters, _CLASS[blanked])
    starts = np.concatenate([[0], ends[:-1] + 1])
    clean = blanked.tobytes()
    taken = [control.line(clean[starts[i] : ends[i]], int(starts[i])) for i in odd]
    text = _joined(letters, plain, odd, taken, starts, ends)
    return Text(*text, comments)


def _comments(raw: bytes, pattern: bytes) -> Ints:
    """(C, 2) ranges of comments, delimiters included."""
    compiled = re.compile(pattern, re.M)
    group = compiled.groups  # a string is group 1, and no comment
    spans = [found.span() for found in compiled.finditer(raw) if not group or found[1] is None]
    return np.array(spans, dtype=np.int64).reshape(-1, 2)


def _blanked(letters: Bytes, comments: Ints, marked: bool) -> Bytes:
    """The bytes with blanks in the place of comments and of the byte order mark."""
    blanked = letters.copy()
    if marked:
        blanked[: len(BOM)] = 32
    if len(comments):
        edge = np.zeros(len(letters) + 1, np.int8)
        edge[comments[:, 0]] += 1
        edge[comments[:, 1]] -= 1
        blanked[np.cumsum(edge[:-1], dtype=np.int8) > 0] = 32
    return blanked


class _Plain:
    """Words of plain lines; ``line`` counts the ends of lines before a word."""

    def __init__(
        self, at: Ints, start: Ints, stop: Ints, key: Ints, value: Floats, how: Ints, line: Ints
    ) -> None:
        self.at, self.start, self.stop, self.key = at, start, stop, key
        self.value, self.how, self.line = value, how, line


def _plain(letters: Bytes, kinds: Bytes) -> tuple[_Plain, list[int], Ints]:
    """The words of all plain lines; the lines that are not plain; where every line ends (before its LF or CR)."""
    size = len(letters)
    numeral = (kinds >= _DIGIT) & (kinds <= _SIGN)
    begins = numeral.copy()
    begins[1:] &= ~numeral[:-1]
    closes = numeral.copy()
    closes[:-1] &= ~numeral[1:]
    run_start, run_stop = np.flatnonzero(begins), np.flatnonzero(closes) + 1
    bad_run, integer = _numerals(kinds, run_start, run_stop)

    item = begins | (kinds == _NEWLINE) | (kinds == _LETTER) | (kinds >= _EQUALS)
    place = np.append(np.flatnonzero(item), size)
    kind = np.append(kinds[place[:-1]], np.uint8(_NEWLINE))
    kind[(kind == _DOT) | (kind == _SIGN)] = _DIGIT
    new = kind == _NEWLINE
    line = np.cumsum(new) - new
    run = np.cumsum(kind == _DIGIT) - 1
    bad = np.zeros(len(kind), np.bool_)
    bad[kind == _DIGIT] = bad_run
    bad |= kind == _OTHER

    # ``X = 1`` and ``A3 = 1``: the sign, and the digits before it, go; the address remembers the digits.
    index = np.full(len(kind), -1)
    dropped = np.zeros(len(kind), np.bool_)
    equal = np.flatnonzero(kind == _EQUALS)
    if len(equal):
        before, two = np.maximum(equal - 1, 0), np.maximum(equal - 2, 0)
        after = np.minimum(equal + 1, len(kind) - 1)
        named = (kind[before] == _LETTER) & (equal > 0)
        one = place[two] + 1 == place[before]
        alone = np.append(run_stop, -1)[run[before]] == place[before] + 1
        digit = kinds[np.minimum(place[before], size - 1)] == _DIGIT
        indexed = (kind[before] == _DIGIT) & (kind[two] == _LETTER) & (equal > 1) & one & alone & digit
        fine = (named | indexed) & (kind[after] == _DIGIT)
        bad[equal[~fine]] = True
        dropped[equal] = True
        numbered = equal[indexed & fine]
        dropped[numbered - 1] = True
        index[numbered - 2] = letters[place[numbered - 1]].astype(np.int64) - ord("0")

    kept = np.flatnonzero(~dropped)
    this, following = kind[kept[:-1]], kind[kept[1:]]
    lone = (this == _LETTER) != (following == _DIGIT)
    # A letter without a number, or a number without a letter.
    bad[kept[:-1][lone & (this == _LETTER)]] = True
    bad[kept[1:][lone & (this != _LETTER)]] = True
    if kind[kept[0]] == _DIGIT:
        bad[kept[0]] = True
    odd = np.unique(line[bad & ~new])
    is_odd = np.zeros(int(new.sum()), np.bool_)
    is_odd[odd] = True

    first = kept[:-1][(this == _LETTER) & ~is_odd[line[kept[:-1]]]]
    position = np.searchsorted(kept, first)
    runs = run[kept[position + 1]]
    start, stop = run_start[runs], run_stop[runs]
    upper = letters[place[first]].astype(np.int64) & 0xDF
    value = _values(letters, start, stop)
    how = np.where(integer[runs], How.INTEGER, How.NUMBER)
    how[~np.isfinite(value)] = How.UNREAD
    value[~np.isfinite(value)] = np.nan
    key = np.where(index[first] >= 0, upper + 256 * (index[first] + 1), upper)
    return _Plain(place[first], start, stop, key, value, how, line[first]), odd.tolist(), place[new]


def _numerals(kinds: Bytes, start: Ints, stop: Ints) -> tuple[Bools, Bools]:
    """Of every run of digits, dots and signs: whether it is no number; whether it has no decimal point."""
    dots, signs = np.flatnonzero(kinds == _DOT), np.flatnonzero(kinds == _SIGN)
    n = len(start)
    dot_run = np.searchsorted(start, dots, side="right") - 1
    sign_run = np.searchsorted(start, signs, side="right") - 1
    many_dots = np.bincount(dot_run, minlength=n)
    many_signs = np.bincount(sign_run, minlength=n)
    bad = (many_dots > 1) | (many_signs > 1) | (stop - start - many_dots - many_signs == 0)
    bad |= stop - start > LONGEST
    bad[sign_run[signs != start[sign_run]]] = True
    return bad, many_dots == 0


def _values(letters: Bytes, start: Ints, stop: Ints) -> Floats:
    """The numbers that stand in these ranges, all of them well formed."""
    edge = np.zeros(len(letters) + 1, np.int8)
    edge[start] += 1
    edge[stop] -= 1
    inside = np.cumsum(edge[:-1], dtype=np.int8) > 0
    text = np.where(inside, letters, np.uint8(32)).tobytes()
    return np.fromstring(text, dtype=np.float64, sep=" ") if len(start) else np.empty(0)


def _joined(
    letters: Bytes, plain: _Plain, odd: list[int], taken: list[Line], starts: Ints, ends: Ints
) -> tuple[Words, Blocks, tuple[Note, ...]]:
    """Words of plain and of other lines in one order; lines without words and notes are no blocks."""
    flat = [(*word, row) for row, line in zip(odd, taken, strict=True) for word in line.words]
    extra: list[tuple[int | float, ...]] = list(zip(*flat, strict=True)) if flat else [()] * 7
    at, key, start, stop, value, how, row = (np.array(column) for column in extra)
    order = np.argsort(np.concatenate([plain.at, at]), kind="stable")

    def merged(one: Ints | Floats, two: Ints | Floats) -> Ints:
        return np.concatenate([one, two])[order].astype(np.int64)

    lines = merged(plain.line, row)
    said = [row for row, line in zip(odd, taken, strict=True) if line.notes or line.deleted]
    used = np.union1d(lines, np.array(said, dtype=np.int64)).astype(np.int64)
    words = Words(
        at=merged(plain.at, at),
        start=merged(plain.start, start),
        stop=merged(plain.stop, stop),
        key=merged(plain.key, key),
        value=np.concatenate([plain.value, value.astype(np.float64)])[order],
        how=merged(plain.how, how),
        block=np.searchsorted(used, lines),
    )
    deleted = np.zeros(len(starts), np.bool_)
    deleted[[row for row, line in zip(odd, taken, strict=True) if line.deleted]] = True
    feeds = np.flatnonzero(letters == 10)
    code = starts[used].copy()
    code[words.block] = np.maximum(words.stop, words.at + 1)
    blocks = Blocks(
        start=starts[used],
        stop=ends[used],
        line=np.searchsorted(feeds, starts[used]) + 1,
        code=code,
        deleted=deleted[used],
    )
    notes = tuple(
        note._replace(block=int(np.searchsorted(used, row)))
        for row, line in zip(odd, taken, strict=True)
        for note in line.notes
    )
    return words, blocks, notes
