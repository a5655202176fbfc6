"""A source file as bytes, and edits on it.

A source is never rebuilt: a change is a list of edits (span, text) that are spliced into the
bytes.  What no edit covers is copied, so the result is lossless by construction.  Millions of
edits are stored as arrays, and spliced and taken out again in blocks.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from postproc.base.array_storage import ArrayStore
from postproc.base.arrays import Ints, sums
from postproc.base.batches import in_blocks
from postproc.base.sized_bytes import SizedBytes

Offsets = NDArray[np.signedinteger]
"""Byte offsets; 32 bits where they fit."""

_LF = 10

BLOCK = 1 << 20
"""Bytes that are spliced, compared, or searched at a time."""


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
    """The raw bytes of one file, and where its lines start."""

    path: Path
    raw: bytes

    @cached_property
    def line_starts(self) -> Offsets:
        """Offsets (L,) of the first byte of every line (the byte after each LF; CRLF and LF alike)."""
        letters, kind = np.frombuffer(self.raw, np.uint8), offset_type(len(self.raw))
        parts = [np.zeros(1, kind)]
        for at in range(0, len(letters), BLOCK):
            line_feeds = np.flatnonzero(letters[at : at + BLOCK] == _LF)
            parts.append((line_feeds + (at + 1)).astype(kind))
        return np.concatenate(parts)

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
        return line, offset - int(self.line_starts[line - 1]) + 1

    def line(self, number: int) -> bytes:
        """The bytes of a line (from 1) without its ending."""
        start = self.line_starts[number - 1]
        stop = self.line_starts[number] if number < len(self.line_starts) else len(self.raw)
        return self.raw[start:stop].rstrip(b"\r\n")


class Edits(Sequence[Edit]):
    """K edits in order of place, as arrays; as a sequence it gives them as ``Edit``, which is slow for millions.

    file, start, stop (K,): the spans; ends (K + 1,): text k is ``texts[ends[k]:ends[k + 1]]``; offsets are of 32 bits
    where they fit.
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
        self.file, self.start, self.stop = file.astype(np.int8, copy=False), _narrow(start), _narrow(stop)
        self.texts, self.ends = texts, _narrow(ends)
        self._arrange()

    def _arrange(self) -> None:
        """Brings the edits in order of place, one column after the other."""
        file, start, stop = self.file, self.start, self.stop
        later = stop[1:] >= stop[:-1]
        later &= start[1:] == start[:-1]
        later |= start[1:] > start[:-1]
        later &= file[1:] == file[:-1]
        later |= file[1:] > file[:-1]
        if later.all():
            return
        order = np.lexsort((stop, start, file))
        del file, start, stop
        self.file = self.file[order]
        self.start = self.start[order]
        self.stop = self.stop[order]
        self.texts, self.ends = _rearranged(self.texts, self.ends, order)

    @staticmethod
    def joined(*parts: Iterable[Edit]) -> Edits:
        """All edits of the parts; those of one place in the order of the parts."""
        return Edits.collected(parts)

    @staticmethod
    def collected(parts: Iterable[Iterable[Edit]]) -> Edits:
        """As ``joined``, of parts that are taken one after the other, and need not be there together."""
        rest = iter(parts)
        first, second = next(rest, ()), next(rest, None)
        if second is None:
            return first if isinstance(first, Edits) else _as_arrays(first)
        # Of what is there in parts, only one column is there as a whole as well.
        columns = _in_columns(chain((first, second), rest))
        del first, second
        edits = Edits.__new__(Edits)
        edits.texts = _joined(columns.pop())
        edits.ends = sums(np.concatenate(columns.pop()), offset_type(len(edits.texts)))
        edits.stop = np.concatenate(columns.pop())
        edits.start = np.concatenate(columns.pop())
        edits.file = np.concatenate(columns.pop())
        edits._arrange()
        return edits

    def of(self, file: int) -> Edits:
        """The edits of one document."""
        bounds = np.array([file, file + 1], self.file.dtype)
        low, high = np.searchsorted(self.file, bounds).tolist()
        if low == 0 and high == len(self):
            return self
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


def _in_columns(parts: Iterable[Iterable[Edit]]) -> list[list[NDArray[Any]]]:
    """Documents, starts, ends, lengths of texts, and texts of the parts; in order of place where one part as a whole
    is before the other."""
    store = ArrayStore(), ArrayStore(), ArrayStore(), ArrayStore(), ArrayStore()
    kinds = np.int8, np.int32, np.int32, np.int32, np.uint8
    columns: list[list[NDArray[Any]]] = [[np.empty(0, kind)] for kind in kinds]
    spans = [(Span(-1, 0, 0), Span(-1, 0, 0))]
    for part in parts:
        edits = part if isinstance(part, Edits) else _as_arrays(part)
        for file in range(int(edits.file[0]), int(edits.file[-1]) + 1) if len(edits) else ():
            own = edits.of(file)
            if not len(own):
                continue
            spans.append((own[0].span, own[-1].span))
            arrays = own.file, own.start, own.stop, np.diff(own.ends), np.frombuffer(own.texts, np.uint8)
            for column, storage, array in zip(columns, store, arrays, strict=True):
                column.append(storage.keep(array))
    order = sorted(range(len(spans)), key=spans.__getitem__)
    if all(spans[a][1] < spans[b][0] for a, b in pairwise(order)):
        return [[column[k] for k in order] for column in columns]
    return columns


def _as_arrays(edits: Iterable[Edit]) -> Edits:
    items = list(edits)
    spans = np.array([(e.span.file, e.span.start, e.span.stop) for e in items], dtype=np.int64).reshape(-1, 3)
    texts = [edit.text for edit in items]
    ends = sums(np.array([len(text) for text in texts], dtype=np.int64))
    return Edits(spans[:, 0], spans[:, 1], spans[:, 2], b"".join(texts), ends)


def offset_type(size: int) -> type[np.signedinteger]:
    """The type of offsets in so many bytes."""
    return np.int32 if size < 2**31 else np.int64


def _narrow(offsets: NDArray[Any]) -> Offsets:
    return offsets.astype(offset_type(int(offsets.max(initial=0))), copy=False)


def _rearranged(texts: bytes, ends: NDArray[Any], order: Ints) -> tuple[bytes, Offsets]:
    """Texts in another order, and their new ends; those that stay together are taken together."""
    arranged = sums(np.diff(ends)[order], offset_type(len(texts)))
    runs = np.concatenate([[0], np.flatnonzero(np.diff(order) != 1) + 1, [len(order)]])
    rearranged, view = SizedBytes(len(texts)), memoryview(texts)
    for low in range(0, len(runs) - 1, BLOCK // 8):
        bounds = runs[low : low + BLOCK // 8 + 1]
        first, last = ends[order[bounds[:-1]]], ends[order[bounds[1:] - 1] + 1]
        rearranged.write_all(view[a:b] for a, b in zip(first.tolist(), last.tolist(), strict=True))
    return rearranged.done(), arranged


def _joined(parts: list[NDArray[Any]]) -> bytes:
    """The bytes of all parts, (B_k,) each."""
    text = SizedBytes(sum(map(len, parts)))
    text.write_all(part.data for part in parts)
    return text.done()


def gathered(source: bytes | NDArray[np.uint8], start: NDArray[Any], lengths: NDArray[Any]) -> bytes:
    """The parts of ``source`` (B,) that start at ``start`` (K,) and have ``lengths`` (K,), one after the other."""
    data = np.frombuffer(source, np.uint8) if isinstance(source, bytes) else source
    return data[_offsets(start, lengths)].tobytes()


def _offsets(start: NDArray[Any], lengths: NDArray[Any]) -> Ints:
    """The offsets of all bytes of parts that start at ``start`` (K,)."""
    ends = sums(lengths)
    offsets = np.arange(ends[-1])
    offsets += np.repeat(start - ends[:-1], lengths)
    return offsets


def apply(document: Document, edits: Iterable[Edit]) -> bytes:
    """The bytes of ``document`` with ``edits`` (all of that document) spliced in.

    Edits at one place are written in the order given.  Raises ValueError on an overlap or a span
    outside of the document: a defect of the program, never of its input.
    """
    all_edits, raw = Edits.joined(edits), document.raw
    if len(all_edits) and all_edits.file[0] != all_edits.file[-1]:
        raise ValueError("the edits belong to several documents")
    wrong = _disorder(all_edits, len(raw))
    if wrong >= 0:
        raise ValueError(f"edits overlap or leave the document at byte {int(all_edits.start[wrong])}")
    growth = int(all_edits.ends[-1]) - int(
        all_edits.stop.sum(dtype=np.int64) - all_edits.start.sum(dtype=np.int64)
    )
    written, at = SizedBytes(len(raw) + growth), 0
    old, texts = np.frombuffer(raw, np.uint8), np.frombuffer(all_edits.texts, np.uint8)
    parts = list(_blocks(all_edits))

    def spliced(part: slice) -> NDArray[np.uint8]:
        low, high = parts[part.start]
        block_start, block_end = int(all_edits.start[low]), int(all_edits.stop[high - 1])
        lengths = np.diff(all_edits.ends[low : high + 1])
        start, stop = all_edits.start[low:high] - block_start, all_edits.stop[low:high] - block_start
        own = texts[all_edits.ends[low] : all_edits.ends[high]]
        return _spliced(old[block_start:block_end], start, stop, own, lengths)

    for (low, high), new in zip(parts, in_blocks(spliced, len(parts), 1), strict=True):
        written.write(memoryview(raw)[at : int(all_edits.start[low])])
        written.write(new.data)
        at = int(all_edits.stop[high - 1])
    written.write(memoryview(raw)[at:])
    return written.done()


def _disorder(edits: Edits, size: int) -> int:
    """The first edit that overlaps the one before it or leaves a document of ``size`` bytes; -1 if none does."""
    wrong = edits.stop < edits.start
    wrong |= edits.stop > size
    wrong[1:] |= edits.start[1:] < edits.stop[:-1]
    wrong[:1] |= edits.start[:1] < 0
    return int(np.argmax(wrong)) if wrong.any() else -1


def _blocks(edits: Edits) -> Iterator[tuple[int, int]]:
    """Ranges of edits that follow each other within few bytes."""
    low = 0
    while low < len(edits):
        high = min(low + BLOCK // 8, len(edits))
        near = edits.start[low:high] <= int(edits.start[low]) + BLOCK
        high = low + int(np.count_nonzero(near))
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
    remaining = raw[~_covered(start, stop, len(raw))]
    text_start = start + sums(lengths - (stop - start))[:-1]
    result = np.empty(len(remaining) + len(texts), np.uint8)
    is_text = _covered(text_start, text_start + lengths, len(result))
    result[is_text] = texts
    result[~is_text] = remaining
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

    Goes by the written bytes, independently of ``apply``: computes for every byte where it must have come from,
    and compares.
    """
    all_edits = Edits.joined(edits)
    if _disorder(all_edits, len(original)) >= 0:
        return False
    new, old, texts = (np.frombuffer(part, np.uint8) for part in (written, original, all_edits.texts))
    parts, shifts = list(_blocks(all_edits)), [0]
    """How far after its place in the original the first edit of each part lies, and what follows the last one."""
    for low, high in parts:
        removed = all_edits.stop[low:high].sum(dtype=np.int64) - all_edits.start[low:high].sum(dtype=np.int64)
        shifts.append(shifts[-1] + int(all_edits.ends[high]) - int(all_edits.ends[low]) - int(removed))

    def undoes(part: slice) -> bool:
        low, high = parts[part.start]
        at = int(all_edits.stop[low - 1]) if low else 0  # how far those before compare the original
        start, stop = all_edits.start[low:high].astype(np.int64), all_edits.stop[low:high].astype(np.int64)
        before, block_start, block_end = shifts[part.start], int(start[0]), int(stop[-1])
        if not np.array_equal(new[at + before : block_start + before], old[at:block_start]):
            return False
        lengths = np.diff(all_edits.ends[low : high + 1])
        # How far after its place in the original each edit, and what follows it, lies.
        shift = before + sums(lengths - (stop - start))
        if block_end + int(shift[-1]) > len(written):
            return False
        between = _offsets(stop[:-1], start[1:] - stop[:-1])
        moves = np.repeat(shift[1:-1], start[1:] - stop[:-1])
        if not np.array_equal(new[between + moves], old[between]):
            return False
        text_offsets = _offsets(start + shift[:-1], lengths)
        return np.array_equal(new[text_offsets], texts[all_edits.ends[low] : all_edits.ends[high]])

    at = int(all_edits.stop[-1]) if len(all_edits) else 0
    rest = np.array_equal(new[at + shifts[-1] :], old[at:])
    return rest and all(in_blocks(undoes, len(parts), 1))
