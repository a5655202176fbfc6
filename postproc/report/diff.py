"""The change of a document in the form of ``diff -u``, from its edits."""

from __future__ import annotations

import os
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Ints, sums
from postproc.base.batches import in_blocks
from postproc.base.document import Document, Edit, Edits, gathered

CONTEXT = 3
"""Lines shown around a change, as diff -u does."""

EDITS = 1 << 16
"""Edits that are looked at together, at least."""

BLOCKS = 1 << 12
"""Blocks that are written together."""

_LF = 10
_OPEN = b"\n\\ No newline at end of file\n"
_SIGNS = b" -+"


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Stretches of lines that edits touch (B,): old lines ``first .. last`` (from 0; of an inserted whole line, last is
    first - 1) become the new lines from ``new``, ``count`` of them."""

    first: Ints
    last: Ints
    new: Ints
    count: Ints

    def __getitem__(self, rows: slice) -> _Blocks:
        return _Blocks(self.first[rows], self.last[rows], self.new[rows], self.count[rows])

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True, eq=False)
class _Hunks:
    """Blocks with the lines around them (H,): ``at`` (H + 1,) numbers of their first blocks, and that of all; old lines
    from ``top``, ``old`` of them, become the new ones from ``new_top``, ``new`` of them."""

    at: Ints
    top: Ints
    old: Ints
    new_top: Ints
    new: Ints


def unified_diff(document: Document, name: str, edits: Iterable[Edit], written: bytes) -> Iterator[bytes]:
    """The change of one document into ``written`` by ``edits``, in parts; every changed line is before its new form
    (lines keep their bytes, CR included)."""
    joined = Edits.joined(edits)
    if not joined:
        return
    old, new = _DiffLines(document), _DiffLines(Document(document.path, written))
    blocks = _blocks(old, new, joined)
    hunks = _hunks(old, blocks)
    yield b"--- %s\n+++ %s\n" % (os.fsencode(document.path.name), os.fsencode(name))
    yield from in_blocks(lambda rows: _part(old, new, hunks, blocks, rows), len(blocks), BLOCKS)


class _DiffLines:
    """The lines of a text, with their endings; one without an ending has the note that diff writes."""

    def __init__(self, document: Document) -> None:
        self.raw, self.starts = document.raw, document.line_starts
        self._open = int(self.starts[-1]) < len(self.raw)
        self.bounds = np.append(self.starts, len(self.raw) + len(_OPEN)) if self._open else self.starts
        self.count = len(self.bounds) - 1

    def of(self, offsets: Ints) -> Ints:
        """The lines (K,), from 0, that hold these bytes (K,), which ascend."""
        low, high = np.searchsorted(self.starts, [offsets[0], offsets[-1]], side="right")
        start = np.searchsorted(offsets, self.starts[low:high])
        return np.asarray(low - 1 + np.cumsum(np.bincount(start, minlength=len(offsets))))

    def part(self, first: int, stop: int) -> tuple[bytes, Ints]:
        """The lines first .. stop - 1, and where in them each starts and the last one ends."""
        bounds = self.bounds[first : stop + 1]
        text = self.raw[int(bounds[0]) : int(bounds[-1])]
        return text + _OPEN if self._open and stop == self.count else text, bounds - bounds[0]


def _blocks(old: _DiffLines, new: _DiffLines, edits: Edits) -> _Blocks:
    """All blocks; of those at the end of a text the line after its last ending is none."""
    ranges = list(_apart(old.raw, edits))
    parts = in_blocks(lambda part: _touched(old, edits, *ranges[part.start]), len(ranges), 1)
    first, last, grown = np.concatenate(list(parts), axis=1)
    start = (first + sums(grown)[:-1]).astype(np.int32)
    stop = np.minimum(start + last - first + 1 + grown, new.count)
    return _Blocks(first, np.minimum(last, old.count - 1), start, stop - start)


def _apart(raw: bytes, edits: Edits) -> Iterator[tuple[int, int]]:
    """Ranges of edits none of which touches a line of another one."""
    low = 0
    while low < len(edits):
        high = low + EDITS
        while high < len(edits):
            line = raw.find(b"\n", int(edits.stop[high - 1])) + 1 or len(raw) + 1
            after = bisect_left(edits.start, line)
            if after == high:
                break
            high = after
        high = min(high, len(edits))
        yield low, high
        low = high


def _touched(old: _DiffLines, edits: Edits, low: int, high: int) -> Ints:
    """(3, B) first and last line of the blocks of the edits low .. high - 1, and the lines by which each grows."""
    at, last = _abutting_edits(old, edits, low, high)
    start, stop, ends = edits.start[at], edits.stop[last], edits.ends[np.append(at, high)]
    first, stop_line = old.of(start), old.of(stop)
    cut, at_start, to_start = stop > start, old.starts[first] == start, old.starts[stop_line] == stop
    ended, emptied = _end_lines(edits.texts, ends[:-1], ends[1:]), ends[1:] == ends[:-1]
    last = np.where(cut & to_start, stop_line - 1, stop_line)
    breaks = np.flatnonzero(np.frombuffer(edits.texts, np.uint8)[ends[0] : ends[-1]] == _LF) + int(ends[0])
    growth = np.diff(np.searchsorted(breaks, ends)) - (stop_line - first)
    # Whole lines that are inserted touch no line; a line whose ending goes, joins the one after it.
    whole = ~cut & at_start & ended
    joined = cut & to_start & ~(ended | (emptied & at_start))
    last = np.where(joined, stop_line, last)
    last = np.where(whole, first - 1, last)
    reached = np.maximum.accumulate(last)
    starts = np.ones(len(start), dtype=bool)
    starts[1:] = first[1:] > reached[:-1]
    at = np.flatnonzero(starts)
    lines = np.stack([first[at], np.maximum.reduceat(last, at), np.add.reduceat(growth, at)])
    return lines.astype(np.int32)


def _abutting_edits(old: _DiffLines, edits: Edits, low: int, high: int) -> tuple[Ints, Ints]:
    """Runs of edits that abut: their first ones and their last ones.  A run ends where a line does on both sides."""
    parted = edits.start[low + 1 : high] > edits.stop[low : high - 1]
    k = np.flatnonzero(~parted) + low + 1
    start = edits.start[k]
    line = np.searchsorted(old.starts, start, side="right") - 1
    parted[k - low - 1] = (old.starts[line] == start) & _end_lines(
        edits.texts, edits.ends[k - 1], edits.ends[k]
    )
    run_start = np.flatnonzero(parted) + low + 1
    return np.append(low, run_start), np.append(run_start, high) - 1


def _end_lines(texts: bytes, start: Ints, end: Ints) -> Bools:
    """(K,) whether each of these parts of ``texts`` ends a line; an empty one does not."""
    ends_line = end > start
    ends_line[ends_line] = np.frombuffer(texts, np.uint8)[end[ends_line] - 1] == _LF
    return ends_line


def _hunks(old: _DiffLines, blocks: _Blocks) -> _Hunks:
    far = np.flatnonzero(blocks.first[1:] - blocks.last[:-1] - 1 > 2 * CONTEXT) + 1
    at = np.concatenate([[0], far, [len(blocks)]])
    top = np.maximum(blocks.first[at[:-1]] - CONTEXT, 0)
    end = np.minimum(blocks.last[at[1:] - 1] + CONTEXT, old.count - 1)
    grown = np.add.reduceat(blocks.count - (blocks.last - blocks.first + 1), at[:-1])
    count = end - top + 1
    return _Hunks(at, top, count, top + blocks.new[at[:-1]] - blocks.first[at[:-1]], count + grown)


def _part(old: _DiffLines, new: _DiffLines, hunks: _Hunks, blocks: _Blocks, rows: slice) -> bytes:
    """The text of some blocks: of each the head of its hunk, the lines before it, its old ones and its new ones, and
    the lines after it; a head before the first of a hunk only, lines after it after the last."""
    here, number = blocks[rows], np.arange(rows.start, rows.stop)
    hunk = np.searchsorted(hunks.at, number, side="right") - 1
    starts, ends = hunks.at[hunk] == number, hunks.at[hunk + 1] == number + 1
    before = np.where(starts, hunks.top[hunk], blocks.last[number - 1] + 1)
    stop = np.where(ends, hunks.top[hunk] + hunks.old[hunk], here.last + 1)
    heads = _heads(hunks, hunk[starts])
    old_text, old_bounds = old.part(before[0], stop[-1])
    new_text, new_bounds = new.part(here.new[0], here.new[-1] + here.count[-1])
    # All lines of the part in one table, and the place of each run of lines in it.
    texts = (_SIGNS, b"".join(heads), old_text, new_text)
    at = sums(np.array([len(text) for text in texts]))
    bounds = (sums(np.array([len(head) for head in heads], np.int64)), old_bounds, new_bounds)
    table = np.concatenate([own + start for own, start in zip(bounds, at[1:-1], strict=True)])
    to_old = len(heads) + 1 - before[0]
    to_new = len(heads) + 1 + len(old_bounds) - here.new[0]
    first = np.stack(
        [
            np.cumsum(starts) - 1,
            before + to_old,
            here.first + to_old,
            here.new + to_new,
            here.last + 1 + to_old,
        ],
        axis=1,
    ).ravel()
    count = np.stack(
        [starts, here.first - before, here.last - here.first + 1, here.count, stop - here.last - 1], axis=1
    ).ravel()
    place = sums(count)
    line = np.arange(place[-1]) + np.repeat(first - place[:-1], count)
    sign, signed = (np.repeat(np.tile(each, len(here)), count) for each in ([0, 0, 1, 2, 0], [0, 1, 1, 1, 1]))
    return gathered(
        b"".join(texts),
        np.stack([sign, table[line]], axis=1).ravel(),
        np.stack([signed, table[line + 1] - table[line]], axis=1).ravel(),
    )


def _heads(hunks: _Hunks, chosen: Ints) -> list[bytes]:
    columns = (hunks.top + 1, hunks.old, hunks.new_top + 1, hunks.new)
    numbers = zip(*(column[chosen].tolist() for column in columns), strict=True)
    return [b"@@ -%d,%d +%d,%d @@\n" % four for four in numbers]
