"""The cells below the header: where they lie in the bytes of the file, found and read for many lines at a time.

A common line has as many cells as the header, nothing that is not ASCII, and quotes only around whole cells.  All
others go to the reader of single lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.decimals import plain_decimals
from postproc.base.tables.csv_lines import NOTHING, CsvLines
from postproc.base.tables.csv_spelling import as_text, is_number

BLOCK = 1 << 20
"""Bytes at a time; more than a line may have."""

ROWS = 1 << 14
"""Rows at a time."""

_LONGEST = 1 << 12
"""Bytes of a common line."""

_LONG = 32
"""Letters of a number that is read in bulk."""

_SEPARATOR, _LINE_END, _OTHER, _SOMETHING, _QUOTE = 1, 2, 4, 8, 16
_QUOTED = ord('"')
_NO_NUMBER = ord("x")
_POINT = bytes(code if code in b"0123456789+-.eE" else _NO_NUMBER for code in range(256))
"""Letters of numbers, and all others as one that is none."""

_COMMA = _POINT[: ord(",")] + b"." + _POINT[ord(",") + 1 :]

Other = Callable[[int, int, int], Sequence[str] | None]
"""Reads a line that is not common, of the bytes from .. to and the number: its cells, None where it is no row."""


@dataclass(frozen=True, eq=False)
class CsvCells:
    """Where the cells of R rows and C columns lie in ``raw``.

    start (R,): of the rows; ends (R, C): of the cells; each starts after the separator before it.  number (R,): line
    of the file, from 1.  others: row -> its cells, of lines that are not common.
    """

    raw: bytes
    start: NDArray[np.int32]
    ends: NDArray[np.int32]
    number: Ints
    others: Mapping[int, Sequence[str]]

    @cached_property
    def apostrophes(self) -> bool:
        """Whether any cell can hold one."""
        return b"'" in self.raw

    @cached_property
    def decimal_comma(self) -> tuple[int, str] | None:
        """Row and text of a number with a decimal comma, None where no column has one; where commas do not separate."""
        for index in range(self.ends.shape[1]):
            for row, text in CsvColumn(self, index).with_letter(","):
                if is_number(text.replace(",", ".", 1)):
                    return row, text
        return None

    def bounds(self, column: int, rows: slice) -> tuple[Ints, Ints]:
        """Where the cells of a column start and end, two (K,) offsets of ``rows``, without quotes and blanks; an empty
        one for ``others``."""
        data = np.frombuffer(self.raw, np.uint8)
        cell_start = self.start[rows] if column == 0 else self.ends[rows, column - 1] + 1
        start, stop = _trimmed(data, cell_start.astype(np.int64), self.ends[rows, column].astype(np.int64))
        quoted = (start < stop) & (data[np.minimum(start, len(data) - 1)] == _QUOTED)
        return _trimmed(data, start + quoted, stop - quoted) if quoted.any() else (start, stop)


def _contain(data: NDArray[np.uint8], start: Ints, stop: Ints, letter: str) -> Bools:
    """Which cells (K,) contain a letter."""
    low, high = int(start.min(initial=len(data))), int(stop.max(initial=0))
    places = low + np.flatnonzero(data[low:high] == ord(letter))
    return np.asarray(np.searchsorted(places, stop) > np.searchsorted(places, start))


def _trimmed(data: NDArray[np.uint8], start: Ints, stop: Ints) -> tuple[Ints, Ints]:
    """The same cells (K,) without blanks around them."""
    while (blank := (start < stop) & (data[np.minimum(start, len(data) - 1)] <= 0x20)).any():
        start = start + blank
    while (blank := (start < stop) & (data[stop - 1] <= 0x20)).any():
        stop = stop - blank
    return start, stop


class CsvColumn(Sequence[str]):
    """The cells of one column as text, blanks stripped."""

    def __init__(self, cells: CsvCells, column: int) -> None:
        self.cells, self.column = cells, column

    def __len__(self) -> int:
        return len(self.cells.number)

    @overload
    def __getitem__(self, row: int) -> str: ...
    @overload
    def __getitem__(self, row: slice) -> list[str]: ...
    def __getitem__(self, row: int | slice) -> str | list[str]:
        if isinstance(row, slice):
            return [self[at] for at in range(*row.indices(len(self)))]
        at = range(len(self))[row]
        return next(iter(self._texts(slice(at, at + 1))))

    def __iter__(self) -> Iterator[str]:
        for rows in _blocks(len(self)):
            yield from self._texts(rows)

    def _texts(self, rows: slice) -> list[str]:
        raw = self.cells.raw
        start, stop = self.cells.bounds(self.column, rows)
        texts = [raw[a:b].decode("ascii") for a, b in zip(start.tolist(), stop.tolist(), strict=True)]
        for at, row in enumerate(range(rows.start, rows.stop) if self.cells.others else ()):
            if row in self.cells.others:
                texts[at] = self.cells.others[row][self.column].strip()
        return list(map(as_text, texts)) if self.cells.apostrophes else texts

    def numbers(self, one: Callable[[int, str], float], comma: bool) -> Floats:
        """(R,) the cells as ``float`` reads them, with a decimal ``comma`` or without one.

        one: reads the cell of a row that is no plain number, of its row and its text.
        """
        values = np.empty(len(self))

        def read(rows: slice) -> None:
            block, plain = self._plain(rows, comma)
            if not plain.all():
                texts = self._texts(rows)
                for at in np.flatnonzero(~plain).tolist():
                    block[at] = one(rows.start + at, texts[at])
            values[rows] = block

        each_block(read, len(self), ROWS)
        return values

    def with_letter(self, letter: str, without: str = "") -> Iterator[tuple[int, str]]:
        """(row, text) of the cells that contain ``letter``, and not ``without``."""
        data = np.frombuffer(self.cells.raw, np.uint8)
        for rows in _blocks(len(self)):
            start, stop = self.cells.bounds(self.column, rows)
            found = _contain(data, start, stop, letter)
            if without and found.any():
                found &= ~_contain(data, start, stop, without)
            if not found.any() and not self.cells.others:
                continue
            for row, text in enumerate(self._texts(rows), start=rows.start):
                if letter in text and not (without and without in text):
                    yield row, text

    def _plain(self, rows: slice, comma: bool) -> tuple[Floats, Bools]:
        """Values of some rows, and which of them are numbers in the letters that numbers have."""
        start, stop = self.cells.bounds(self.column, rows)
        data = np.frombuffer(self.cells.raw, np.uint8)
        values, _, plain = plain_decimals(data, start, stop, b"," if comma else b".")
        rest = np.flatnonzero(~plain)
        if len(rest):
            values[rest], plain[rest] = _spelled(data, start[rest], stop[rest], comma)
        return values, plain


def _spelled(data: NDArray[np.uint8], start: Ints, stop: Ints, comma: bool) -> tuple[Floats, Bools]:
    """The values of cells (K,) with exponents or many digits, and which of them are numbers."""
    length = stop - start
    plain = (length > 0) & (length <= _LONG)
    length[~plain] = 0
    place = np.arange(int(length.max(initial=1)) + 1)  # one blank at least after each
    inside = place < length[:, None]
    letters = data[np.minimum(start[:, None] + place, len(data) - 1)]
    known = _COMMA if comma else _POINT
    letters = np.frombuffer(letters.tobytes().translate(known), np.uint8).reshape(letters.shape)
    plain &= ~((letters == _NO_NUMBER) & inside).any(axis=1)
    inside &= plain[:, None]
    letters = np.where(inside, letters, np.uint8(0x20))
    letters[~plain, 0] = ord("0")
    try:
        # nothing but these letters: float() takes what is a number and nothing else
        values = np.array(list(map(float, letters.tobytes().split())))
    except ValueError:
        return np.empty(len(plain)), np.zeros_like(plain)
    return values, plain & np.isfinite(values)


def find_cells(
    lines: CsvLines, offset: int, number: int, separator: str, columns: int, other: Other
) -> CsvCells:
    """The cells of the lines from byte ``offset`` on, the first of which has this ``number``.

    Raises what ``other`` raises.
    """
    raw, kinds = lines.raw, _kinds(separator)
    parts: list[tuple[NDArray[np.int32], NDArray[np.int32], Ints]] = []
    others: dict[int, Sequence[str]] = {}
    count = 0
    while offset < len(raw):
        stop = _cut(raw, offset)
        text = raw[offset:stop].replace(b"\r\n", b" \n")
        if not text.endswith((b"\n", b"\r")):
            text += b"\n"  # the last line
        kind = np.frombuffer(text.translate(kinds), np.uint8)
        ends = np.flatnonzero(kind & (_SEPARATOR | _LINE_END))
        last = np.flatnonzero(kind[ends] & _LINE_END)
        closing = ends[last]
        opening = np.append(0, closing[:-1] + 1)
        has = np.bitwise_or.reduceat(kind, opening)
        short = closing - opening <= _LONGEST
        common = (np.diff(last, prepend=-1) == columns) & (has & (_OTHER | _SOMETHING) == _SOMETHING) & short
        quoted = np.flatnonzero(common & (has & _QUOTE != 0))
        if len(quoted):
            stops = ends[last[quoted][:, None] + np.arange(1 - columns, 1)]
            starts = np.column_stack([opening[quoted], stops[:, :-1] + 1])
            quotes = np.add.reduceat((kind == _QUOTE).astype(np.int32), opening)[quoted]
            common[quoted] = quotes == 2 * _in_quotes(raw, starts + offset, stops + offset).sum(axis=1)
        rows = common.copy()
        uncommon = []
        for at in np.flatnonzero(~common & ((has & (_OTHER | _SOMETHING) != 0) | ~short)).tolist():
            start, end = offset + int(opening[at]), offset + int(closing[at])
            cells = other(start, end - (raw[end - 1 : end + 1] == b"\r\n"), number + at)
            if cells is not None:
                rows[at] = True
                uncommon.append((at, cells))
        index = np.flatnonzero(rows)
        where = np.maximum(last[index][:, None] + np.arange(1 - columns, 1), 0)
        cell_ends = (ends[where] + offset).astype(np.int32)
        row_start = (opening[index] + offset).astype(np.int32)
        for at, cells in uncommon:
            row = int(np.searchsorted(index, at))
            others[count + row] = cells
            cell_ends[row], row_start[row] = 0, 0
        parts.append((row_start, cell_ends, index + number))
        count += len(index)
        number += len(closing)
        offset = stop
    parts = parts or [(np.empty(0, np.int32), np.empty((0, columns), np.int32), np.empty(0, np.int64))]
    row_starts, cells_end, numbers = (np.concatenate(part) for part in zip(*parts, strict=True))
    return CsvCells(raw, row_starts, cells_end, numbers, others)


def _in_quotes(raw: bytes, start: Ints, stop: Ints) -> Bools:
    """Which cells (K, C) start and end with a quote."""
    data = np.frombuffer(raw, np.uint8)
    stop = stop - (data[stop - 1] == 0x0D)  # of the line's end
    first = data[np.minimum(start, len(data) - 1)]
    return np.asarray((stop - start >= 2) & (first == _QUOTED) & (data[stop - 1] == _QUOTED))


def _cut(raw: bytes, start: int) -> int:
    """The end of the last line that ends within a block."""
    stop = start + BLOCK
    if stop >= len(raw):
        return len(raw)
    end = raw.rfind(b"\n", start, stop)
    if end < 0:
        end = raw.rfind(b"\r", start, stop - 1)  # not the first half of \r\n
    return end + 1


def _kinds(separator: str) -> bytes:
    """Byte -> what it is in a line."""
    kinds = [_SOMETHING if 0x20 < code < 0x7F else _OTHER for code in range(256)]
    for letter in NOTHING:
        kinds[ord(letter)] = 0
    for letter, kind in (
        ('"', _QUOTE),
        ("#", _OTHER),
        (separator, _SEPARATOR),
        ("\n", _LINE_END),
        ("\r", _LINE_END),
    ):
        kinds[ord(letter)] = kind
    return bytes(kinds)


def _blocks(count: int) -> list[slice]:
    return [slice(start, min(start + ROWS, count)) for start in range(0, count, ROWS)]
