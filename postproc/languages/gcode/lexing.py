"""The bytes of a G-code program as words.

Lines of nothing but ``letter number`` and ``letter digits = number`` words, which is nearly all of them, are taken
apart together, as arrays; only what is left comes to the control's own ``line``.  Blanks and letter case say nothing.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.decimals import literals
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.words import BlockSpans, How, Note, Text, WordArrays

LONGEST = 40
"""Bytes of a number; what is longer is none."""
FARTHEST = 1e7
"""Units of a coordinate; with a greater one doubles do not hold the digits that are written, and it is not read."""
CODES = np.frombuffer(b"GMNO", np.uint8).astype(np.int64)
"""Letters of codes, of block numbers and of programs."""
COORDINATES = np.frombuffer(b"XYZABCIJKRUVWE", np.uint8).astype(np.int64)
"""Letters of what is or makes a coordinate."""

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
_CLASSES = _CLASS.tobytes()

Bytes = NDArray[np.uint8]

_UNTAPED = bytes(32 if byte in (0, 2, 3, 4, 17, 18, 19, 20, 26) else byte for byte in range(256))
"""What tapes and serial lines leave between the characters states nothing."""


def lex(raw: bytes, control: Control, start: int = 0, end: int | None = None, line: int = 1) -> Text:
    """The words, blocks and notes of ``raw[start:end]``, which are whole lines, the first of them number ``line``.

    Never raises on its content; in linear time.
    """
    end = len(raw) if end is None else end
    letters = np.frombuffer(raw, np.uint8)[start:end]
    feeds = np.flatnonzero(letters == 10)
    comments = _comments(raw, control.comment, start, end)
    clean = _blanked(raw[start:end], comments, start == 0 and raw.startswith(BOM_UTF8))
    kinds = np.frombuffer(clean.translate(_CLASSES), np.uint8)
    plain, odd, ends = _plain(letters, kinds, control.parameter)
    starts = np.concatenate([[0], ends[:-1] + 1])
    other = _other_lines(
        [clean[starts[i] : ends[i]] for i in odd], np.array(odd, dtype=np.int64), starts, control
    )
    words, blocks, notes = _joined(feeds, plain, other, starts, ends)
    if start:
        for places in (words.at, words.stop, blocks.start, blocks.stop, blocks.first, blocks.code):
            places += start
        words.start[words.start >= 0] += start
        comments[:, :2] += start
    blocks.line[:] += line
    comments[:, 2] += line + np.searchsorted(feeds, comments[:, 0] - start)
    return Text(words, blocks, notes, comments)


def _comments(raw: bytes, pattern: bytes, start: int, end: int) -> Ints:
    """(C, 3) ranges of comments from ``start``, delimiters included; and 0."""
    compiled = re.compile(pattern, re.M)
    group = compiled.groups  # a string is group 1, and no comment
    found = compiled.finditer(raw, start, end)
    spans = [(*one.span(), start) for one in found if not group or one[1] is None]
    return np.array(spans, dtype=np.int64).reshape(-1, 3) - start


def _blanked(text: bytes, comments: Ints, marked: bool) -> bytes:
    """The text with blanks in the place of comments and of the byte order mark."""
    clean = text.translate(_UNTAPED)
    if not marked and not len(comments):
        return clean
    blanked = np.frombuffer(bytearray(clean), np.uint8)
    if marked:
        blanked[: len(BOM_UTF8)] = 32
    if len(comments):
        edge = np.zeros(len(clean) + 1, np.int8)
        edge[comments[:, 0]] += 1
        edge[comments[:, 1]] -= 1
        blanked[np.cumsum(edge[:-1], dtype=np.int8) > 0] = 32
    return blanked.tobytes()


@dataclass(frozen=True, eq=False)
class _Plain:
    """Columns as in Words; ``line`` counts the ends of lines before a word."""

    at: Ints
    start: Ints
    stop: Ints
    key: Ints
    value: Floats
    how: Ints
    line: Ints


def _plain(letters: Bytes, kinds: Bytes, parameter: str) -> tuple[_Plain, list[int], Ints]:
    """The words of all plain lines; the lines that are not plain; where every line ends (before its LF or CR)."""
    size = len(letters)
    numeral = (kinds >= _DIGIT) & (kinds <= _SIGN)
    starts = numeral.copy()
    starts[1:] &= ~numeral[:-1]
    closes = numeral.copy()
    closes[:-1] &= ~numeral[1:]
    run_start, run_stop = np.flatnonzero(starts), np.flatnonzero(closes) + 1
    bad_run, integer = _numerals(kinds, run_start, run_stop)

    item = starts | (kinds == _NEWLINE) | (kinds == _LETTER) | (kinds >= _EQUALS)
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
        lettered = (kind[before] == _LETTER) & (equal > 0)
        one = place[two] + 1 == place[before]
        alone = np.append(run_stop, -1)[run[before]] == place[before] + 1
        digit = kinds[np.minimum(place[before], size - 1)] == _DIGIT
        indexed = (kind[before] == _DIGIT) & (kind[two] == _LETTER) & (equal > 1) & one & alone & digit
        fine = (lettered | indexed) & (kind[equal + 1] == _DIGIT)
        bad[equal[~fine]] = True
        dropped[equal] = True
        numbered = equal[indexed & fine]
        if parameter:
            bad[numbered[letters[place[numbered - 2]] & 0xDF == ord(parameter)]] = True
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
    is_odd = np.zeros(int(new.sum()), np.bool_)
    is_odd[line[bad & ~new]] = True
    odd = np.flatnonzero(is_odd)

    named = np.flatnonzero(this == _LETTER)
    if len(odd):
        named = named[~is_odd[line[kept[named]]]]
    first, runs = kept[named], run[kept[named + 1]]
    start, stop = run_start[runs], run_stop[runs]
    upper = letters[place[first]].astype(np.int64) & 0xDF
    value, _ = literals(letters, start, stop, _long)
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


def _long(text: bytes) -> tuple[float, int]:
    """A number of more digits than are read in bulk."""
    return float(text), 0


@dataclass(frozen=True, eq=False)
class _Other:
    """Words of the other lines; notes: of which line, their kinds and texts; commented: lines with notes or a slash;
    deleted: those with a slash."""

    words: _Plain
    notes: list[tuple[int, str, str]]
    commented: Ints
    deleted: Ints


def _other_lines(texts: list[bytes], rows: Ints, starts: Ints, control: Control) -> _Other:
    """The lines that are not plain, each text taken apart once; ``rows``: their numbers."""
    number: dict[bytes, int] = {}
    which = np.array([number.setdefault(text, len(number)) for text in texts], dtype=np.int64)
    lines = [control.line(text) for text in number]
    counts = np.array([len(line.words) for line in lines], dtype=np.int64)
    flat = [word for line in lines for word in line.words]
    columns = zip(*flat, strict=True) if flat else [()] * 6
    at, key, start, stop, value, how = (
        np.array(column, dtype=np.float64 if i == 4 else np.int64) for i, column in enumerate(columns)
    )
    # The words of each line, one after the other: those of its text, moved to where it starts.
    many = counts[which] if len(lines) else which
    first = (np.cumsum(counts) - counts)[which] if len(lines) else which
    own = np.repeat(first - (np.cumsum(many) - many), many) + np.arange(many.sum())
    offset = np.repeat(starts[rows], many)
    words = _Plain(
        at[own] + offset,
        np.where(start[own] < 0, -1, start[own] + offset),
        stop[own] + offset,
        key[own],
        value[own],
        how[own],
        np.repeat(rows, many),
    )
    speaks = np.array([bool(line.notes) for line in lines], dtype=np.bool_)
    slashed = np.array([line.deleted for line in lines], dtype=np.bool_)
    noted = np.flatnonzero(speaks[which]) if len(lines) else which
    notes = [
        (row, *note)
        for row, text in zip(rows[noted].tolist(), which[noted].tolist(), strict=True)
        for note in lines[text].notes
    ]
    deleted = rows[slashed[which]] if len(lines) else rows
    return _Other(words, notes, np.concatenate([rows[noted], deleted]), deleted)


def _in_order(plain: _Plain, other: _Plain) -> _Plain:
    """The words of both as they come in the text."""
    order = np.argsort(np.concatenate([plain.at, other.at]), kind="stable")
    pairs = ((getattr(plain, one.name), getattr(other, one.name)) for one in fields(_Plain))
    return _Plain(*(np.concatenate(pair)[order] for pair in pairs))


def _with_exponent(words: _Plain) -> Bools:
    """Which words ``X1e-05`` are: C programs read the exponent, LinuxCNC an address E.  X1E0.5 is the latter alone; so
    are G92E0, as no program writes the number of a code so, and X50E8, which no machine reaches as a number."""
    named = ~np.isin(words.key[:-1], CODES) & (words.start[:-1] >= 0)
    exponent = (
        (words.key[1:] == ord("E")) & (words.how[1:] == How.INTEGER) & (words.at[1:] == words.stop[:-1])
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        reached = ~(np.log10(np.abs(words.value[:-1])) + words.value[1:] > np.log10(FARTHEST))
    return np.append(named & exponent & reached, np.zeros(min(len(words.key), 1), np.bool_))


def _joined(
    feeds: Ints, plain: _Plain, other: _Other, starts: Ints, ends: Ints
) -> tuple[WordArrays, BlockSpans, tuple[Note, ...]]:
    """Words of plain and of other lines in one order; lines without words and notes are no blocks.  feeds: where LFs
    are; lines are counted from 0."""
    all_words = plain if not len(other.words.at) else _in_order(plain, other.words)
    lines, key, value, how = all_words.line, all_words.key, all_words.value, all_words.how
    some = np.zeros(len(starts), np.bool_)
    some[lines] = True
    some[other.commented] = True
    used = np.flatnonzero(some)
    far = (np.abs(value) > FARTHEST) & np.isin(key & 0xFF, COORDINATES)
    unread = far | _with_exponent(all_words)
    value[unread], how[unread] = np.nan, How.UNREAD
    block = np.searchsorted(used, lines)
    words = WordArrays(all_words.at, all_words.start, all_words.stop, key, value, how, block)
    deleted = np.zeros(len(starts), np.bool_)
    deleted[other.deleted] = True
    first, code = starts[used].copy(), starts[used].copy()
    first[words.block[::-1]] = words.at[::-1]
    code[words.block] = np.maximum(words.stop, words.at + 1)
    blocks = BlockSpans(
        start=starts[used],
        stop=ends[used],
        line=np.searchsorted(feeds, starts[used]),
        first=first,
        code=code,
        deleted=deleted[used],
    )
    where = np.searchsorted(used, np.array([row for row, _, _ in other.notes], dtype=np.int64)).tolist()
    notes = tuple(
        Note(block, kind, commented) for block, (_, kind, commented) in zip(where, other.notes, strict=True)
    )
    return words, blocks, notes
