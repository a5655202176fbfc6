"""A source file as bytes, and edits on it.

A source is never rebuilt: a change is a list of edits (span, text) that are spliced into the
bytes.  What no edit covers is copied, so the result is lossless by construction.  Millions of
edits are held as arrays, and spliced and taken out again in blocks.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Ints

BLOCK = 1 << 22
"""Bytes that are spliced, or compared, at a time."""


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """The bytes ``start .. stop - 1`` of document number ``file`` of a program; empty where start == stop."""

    file: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Edit:
    """``text`` takes the place of ``span``; an empty span inserts."""

    span: Span
    text: bytes


@dataclass(frozen=True)
class Document:
    """The raw bytes of one file, and where its lines begin."""

    path: Path
    raw: bytes

    @cached_property
    def line_starts(self) -> list[int]:
        """Offset of the first byte of every line (the byte after each LF; CRLF and LF alike)."""
        starts = [0]
        find = self.raw.find
        at = find(b"\n")
        while at >= 0:
            starts.append(at + 1)
            at = find(b"\n", at + 1)
        return starts

    @cached_property
    def newline(self) -> bytes:
        """The line ending this file uses (of its first line; LF where it has none)."""
        at = self.raw.find(b"\n")
        return b"\r\n" if at > 0 and self.raw[at - 1 : at] == b"\r" else b"\n"

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the bytes, hexadecimal."""
        return hashlib.sha256(self.raw).hexdigest()

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column, both from 1, of a byte."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> bytes:
        """The bytes of a line (from 1) without its ending."""
        start = self.line_starts[number - 1]
        stop = self.line_starts[number] if number < len(self.line_starts) else len(self.raw)
        return self.raw[start:stop].rstrip(b"\r\n")


class Edits(Sequence[Edit]):
    """K edits in order of place, as arrays; as a sequence it gives them as ``Edit``, which is slow for millions.

    file, start, stop (K,): the spans; ends (K + 1,): text k is ``texts[ends[k]:ends[k + 1]]``.
    """

    def __init__(
        self,
        file: NDArray[Any],
        start: NDArray[Any],
        stop: NDArray[Any],
        texts: bytes,
        ends: NDArray[Any],
    ) -> None:
        """Takes the edits in any order; those of one place (file, start, stop) stay in the order given."""
        self.file, self.start, self.stop, self.texts, self.ends = file, start, stop, texts, ends
        same = file[1:] == file[:-1]
        later = (start[1:] > start[:-1]) | ((start[1:] == start[:-1]) & (stop[1:] >= stop[:-1]))
        if not ((same & later) | (file[1:] > file[:-1])).all():
            order = np.lexsort((stop, start, file))
            lengths = np.diff(ends)[order]
            self.file, self.start, self.stop = file[order], start[order], stop[order]
            self.texts = gathered(texts, ends[:-1][order], lengths)
            self.ends = sums(lengths)

    @staticmethod
    def joined(*parts: Iterable[Edit]) -> Edits:
        """All edits of the parts; those of one place in the order of the parts."""
        arrays = [part if isinstance(part, Edits) else _as_arrays(part) for part in parts]
        if len(arrays) == 1:
            return arrays[0]
        shifts = sums(np.array([len(part.texts) for part in arrays], dtype=np.int64))
        ends = [part.ends[:-1] + shift for part, shift in zip(arrays, shifts.tolist(), strict=False)]
        return Edits(
            np.concatenate([np.empty(0, np.int8), *(part.file for part in arrays)]),
            np.concatenate([np.empty(0, np.int32), *(part.start for part in arrays)]),
            np.concatenate([np.empty(0, np.int32), *(part.stop for part in arrays)]),
            b"".join(part.texts for part in arrays),
            np.concatenate([*ends, shifts[-1:]]),
        )

    def of(self, file: int) -> Edits:
        """The edits of one document."""
        low, high = np.searchsorted(self.file, [file, file + 1]).tolist()
        first, last = int(self.ends[low]), int(self.ends[high])
        return Edits(
            self.file[low:high],
            self.start[low:high],
            self.stop[low:high],
            self.texts[first:last],
            self.ends[low : high + 1] - first,
        )

    def __len__(self) -> int:
        return len(self.file)

    @overload
    def __getitem__(self, index: int) -> Edit: ...
    @overload
    def __getitem__(self, index: slice) -> list[Edit]: ...
    def __getitem__(self, index: int | slice) -> Edit | list[Edit]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        span = Span(int(self.file[index]), int(self.start[index]), int(self.stop[index]))
        return Edit(span, self.texts[int(self.ends[index]) : int(self.ends[index + 1])])

    def __iter__(self) -> Iterator[Edit]:
        columns = (self.file, self.start, self.stop, self.ends[:-1], self.ends[1:])
        for file, start, stop, first, last in zip(*(column.tolist() for column in columns), strict=True):
            yield Edit(Span(file, start, stop), self.texts[first:last])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]


def _as_arrays(edits: Iterable[Edit]) -> Edits:
    found = list(edits)
    spans = np.array([(e.span.file, e.span.start, e.span.stop) for e in found], dtype=np.int64).reshape(-1, 3)
    texts = [edit.text for edit in found]
    ends = sums(np.array([len(text) for text in texts], dtype=np.int64))
    return Edits(spans[:, 0], spans[:, 1], spans[:, 2], b"".join(texts), ends)


def sums(lengths: NDArray[Any]) -> Ints:
    """(K + 1,) where parts of these lengths (K,) begin, and the last one ends."""
    ends = np.zeros(len(lengths) + 1, dtype=np.int64)
    np.cumsum(lengths, out=ends[1:])
    return ends


def gathered(source: bytes | NDArray[np.uint8], start: NDArray[Any], lengths: NDArray[Any]) -> bytes:
    """The parts of ``source`` that begin at ``start`` (K,), one behind the other."""
    data = np.frombuffer(source, np.uint8) if isinstance(source, bytes) else source
    return data[_offsets(start, lengths)].tobytes()


def _offsets(start: NDArray[Any], lengths: NDArray[Any]) -> Ints:
    """The offsets of all bytes of parts that begin at ``start`` (K,)."""
    ends = sums(lengths)
    offsets = np.arange(ends[-1])
    offsets += np.repeat(start - ends[:-1], lengths)
    return offsets


def apply(document: Document, edits: Iterable[Edit]) -> bytes:
    """The bytes of ``document`` with ``edits`` (all of that document) spliced in.

    Edits at one place are written in the order given.  Raises ValueError on an overlap or a span
    outside of the document: a defect of the program, never of its input.
    """
    found, raw = Edits.joined(edits), document.raw
    if len(found) and found.file[0] != found.file[-1]:
        raise ValueError("edits of several documents")
    wrong = _disorder(found, len(raw))
    if wrong >= 0:
        raise ValueError(f"edits overlap or leave the document at byte {int(found.start[wrong])}")
    pieces: list[bytes] = []
    at = 0
    for low, high in _blocks(found):
        begin, end = int(found.start[low]), int(found.stop[high - 1])
        pieces.append(raw[at:begin])
        texts = np.frombuffer(found.texts, np.uint8)[found.ends[low] : found.ends[high]]
        lengths = np.diff(found.ends[low : high + 1])
        start, stop = found.start[low:high] - begin, found.stop[low:high] - begin
        pieces.append(
            _spliced(np.frombuffer(raw, np.uint8)[begin:end], start, stop, texts, lengths).tobytes()
        )
        at = end
    pieces.append(raw[at:])
    return b"".join(pieces)


def _disorder(edits: Edits, size: int) -> int:
    """The first edit that overlaps the one before it or leaves a document of ``size`` bytes; -1 if none does."""
    before = np.concatenate([[0], edits.stop[:-1]])
    wrong = (edits.start < before) | (edits.stop < edits.start) | (edits.stop > size)
    return int(np.argmax(wrong)) if wrong.any() else -1


def _blocks(edits: Edits) -> Iterator[tuple[int, int]]:
    """Ranges of edits that follow each other within few bytes."""
    low = 0
    while low < len(edits):
        high = int(np.searchsorted(edits.start, int(edits.start[low]) + BLOCK, side="right"))
        high = max(low + 1, min(high, low + BLOCK // 8))
        yield low, high
        low = high


def _spliced(
    raw: NDArray[np.uint8],
    start: NDArray[Any],
    stop: NDArray[Any],
    texts: NDArray[np.uint8],
    lengths: NDArray[Any],
) -> NDArray[np.uint8]:
    """Bytes with texts of ``lengths`` (K,) in the place of the spans."""
    kept = raw[~_covered(start, stop, len(raw))]
    begin = start + sums(lengths - (stop - start))[:-1]
    result = np.empty(len(kept) + len(texts), np.uint8)
    is_text = _covered(begin, begin + lengths, len(result))
    result[is_text] = texts
    result[~is_text] = kept
    return result


def _covered(start: NDArray[Any], stop: NDArray[Any], size: int) -> NDArray[np.bool_]:
    """(size,) the bytes that lie in one of the spans, which do not overlap."""
    filled = stop > start
    change = np.zeros(size + 1, np.int8)
    change[start[filled]] += 1
    change[stop[filled]] -= 1
    return np.cumsum(change[:-1], dtype=np.int8).view(np.bool_)


def undone(written: bytes, original: bytes, edits: Iterable[Edit]) -> bool:
    """Whether ``written`` is ``original`` in every byte that no edit covers, and each edit's text in its place.

    Goes by the written bytes, on another way than ``apply``: it says for every byte where it must have come from,
    and compares.
    """
    found = Edits.joined(edits)
    lengths = np.diff(found.ends)
    if _disorder(found, len(original)) >= 0:
        return False
    shift = sums(lengths - (found.stop - found.start))
    if len(written) != len(original) + int(shift[-1]):
        return False
    new, old, texts = (np.frombuffer(part, np.uint8) for part in (written, original, found.texts))
    at = 0
    for low, high in _blocks(found):
        begin, end = int(found.start[low]), int(found.stop[high - 1])
        moved = int(shift[low])
        if written[at + moved : begin + moved] != original[at:begin]:
            return False
        # What stands between an edit and the next one, then the texts.
        between = _offsets(
            found.stop[low : high - 1], found.start[low + 1 : high] - found.stop[low : high - 1]
        )
        moves = np.repeat(shift[low + 1 : high], found.start[low + 1 : high] - found.stop[low : high - 1])
        if not np.array_equal(new[between + moves], old[between]):
            return False
        said = _offsets(found.start[low:high] + shift[low:high], lengths[low:high])
        if not np.array_equal(new[said], texts[found.ends[low] : found.ends[high]]):
            return False
        at = end
    return written[at + int(shift[-1]) :] == original[at:]
