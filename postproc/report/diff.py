"""The change of a document in the form of ``diff -u``, from its edits."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.document import Document, Edit, Edits, apply, sums

CONTEXT = 3
"""Lines shown around a change, as diff -u does."""

_LF = 10


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Stretches of lines that edits touch: old lines ``first .. last`` (from 0; of an inserted whole line, last is
    first - 1) become the new lines from ``new``, ``count`` of them."""

    first: Ints
    last: Ints
    new: Ints
    count: Ints


def unified_diff(document: Document, name: str, edits: Iterable[Edit]) -> bytes:
    """The change of one document; every changed line stands before its new form (lines keep their bytes, CR
    included)."""
    found = Edits.joined(edits)
    if not found:
        return b""
    written = apply(document, found)
    old, new = _Lines(document.raw), _Lines(written)
    blocks = _blocks(document.raw, old, found)
    out = [b"--- %s\n+++ %s\n" % (os.fsencode(document.path.name), os.fsencode(name))]
    far = np.flatnonzero(blocks.first[1:] - blocks.last[:-1] - 1 > 2 * CONTEXT) + 1
    for low, high in zip([0, *far.tolist()], [*far.tolist(), len(blocks.first)], strict=True):
        out += _hunk(old, new, blocks, low, high)
    return b"".join(out)


class _Lines:
    """The lines of a text, with their endings."""

    def __init__(self, raw: bytes) -> None:
        self.raw = raw
        ends = np.flatnonzero(np.frombuffer(raw, np.uint8) == _LF) + 1
        self.starts: Ints = np.concatenate([[0], ends])
        self._bounds = [*self.starts.tolist(), len(raw)]
        self.count = len(self._bounds) - (2 if self._bounds[-2] == len(raw) else 1)

    def of(self, offsets: Ints) -> Ints:
        """The lines, from 0, that hold these bytes."""
        return np.searchsorted(self.starts, offsets, side="right") - 1

    def some(self, first: int, last: int, sign: bytes) -> Iterator[bytes]:
        """Lines first .. last that there are, behind a sign."""
        bounds, raw = self._bounds, self.raw
        for i in range(first, min(last, self.count - 1) + 1):
            line = sign + raw[bounds[i] : bounds[i + 1]]
            yield line if line.endswith(b"\n") else line + b"\n\\ No newline at end of file\n"


def _blocks(raw: bytes, lines: _Lines, edits: Edits) -> _Blocks:
    start, stop = edits.start.astype(np.int64), edits.stop.astype(np.int64)
    first, last = lines.of(start), lines.of(np.maximum(start, stop - 1))
    texts = np.frombuffer(edits.texts, np.uint8)
    breaks = sums(texts == _LF)
    growth = breaks[edits.ends[1:]] - breaks[edits.ends[:-1]]
    growth -= lines.of(stop) - first
    filled = edits.ends[1:] > edits.ends[:-1]
    ends_line = ~filled
    ends_line[filled] = texts[edits.ends[1:][filled] - 1] == _LF
    at_begin = start == lines.starts[first]
    # Whole lines that are inserted touch no line; a line whose ending goes, joins the one behind it.
    whole: Bools = (start == stop) & at_begin & ends_line & filled
    joined = (stop > start) & (lines.starts[lines.of(stop)] == stop) & ~(ends_line & (filled | at_begin))
    last = np.where(joined, lines.of(stop), last)
    last = np.where(whole, first - 1, last)
    reached = np.maximum.accumulate(last)
    begins = np.ones(len(start), dtype=bool)
    begins[1:] = whole[1:] | whole[:-1] | (first[1:] > reached[:-1])
    at = np.flatnonzero(begins)
    grown = np.add.reduceat(growth, at)
    first, last = first[at], np.maximum.reduceat(last, at)
    return _Blocks(first, last, first + sums(grown)[:-1], last - first + 1 + grown)


def _hunk(old: _Lines, new: _Lines, blocks: _Blocks, low: int, high: int) -> list[bytes]:
    """The hunk of the blocks low .. high - 1."""
    first, last, begin, count = (
        part[low:high].tolist() for part in (blocks.first, blocks.last, blocks.new, blocks.count)
    )
    top = max(0, first[0] - CONTEXT)
    end = min(old.count - 1, last[-1] + CONTEXT)
    body: list[bytes] = []
    at = top
    for one, final, there, many in zip(first, last, begin, count, strict=True):
        body += old.some(at, one - 1, b" ")
        body += old.some(one, final, b"-")
        body += new.some(there, there + many - 1, b"+")
        at = final + 1
    body += old.some(at, end, b" ")
    removed = sum(line.startswith(b"-") for line in body)
    added = sum(line.startswith(b"+") for line in body)
    same = len(body) - removed - added
    shift = begin[0] - first[0]
    head = b"@@ -%d,%d +%d,%d @@\n" % (top + 1, same + removed, top + 1 + shift, same + added)
    return [head, *body]
