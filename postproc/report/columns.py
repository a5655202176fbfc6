"""A table of many rows as the bytes of a CSV, column by column."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Floats, Ints
from postproc.dialects.decimals import fixed
from postproc.document import sums

ROWS = 50_000
"""Rows that are put together at once."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column of numbers (N,) with as many ``decimals``; empty where one is NaN."""

    name: str
    values: Floats
    decimals: int = 0

    def texts(self, rows: slice) -> tuple[NDArray[np.uint8], Ints]:
        """The texts of some rows one behind the other, and the length of each."""
        values = np.asarray(self.values[rows], float)
        known = np.isfinite(values)
        blob, ends = fixed(values[known], np.full(int(known.sum()), self.decimals))
        lengths = np.zeros(len(values), np.int64)
        lengths[known] = np.diff(ends)
        return np.frombuffer(blob, np.uint8), lengths


@dataclass(frozen=True, eq=False)
class Words:
    """A column of words: ``codes`` (N,) are places in ``words``, which hold no comma, quote or line end."""

    name: str
    codes: Ints
    words: Sequence[str]

    def texts(self, rows: slice) -> tuple[NDArray[np.uint8], Ints]:
        """As those of ``Numbers``."""
        raw = [word.encode("ascii") for word in self.words]
        begin = sums(np.array([len(word) for word in raw]))
        codes = np.asarray(self.codes[rows])
        lengths = np.diff(begin)[codes]
        return np.frombuffer(b"".join(raw), np.uint8)[_offsets(begin[codes], lengths)], lengths


def csv_bytes(columns: Sequence[Numbers | Words]) -> bytes:
    """A header and a line a row."""
    head = ",".join(column.name for column in columns) + "\n"
    return b"".join([head.encode("ascii"), *_lines(columns)])


def _lines(columns: Sequence[Numbers | Words]) -> Iterator[bytes]:
    first = columns[0]
    count = len(first.codes if isinstance(first, Words) else first.values)
    for begin in range(0, count, ROWS):
        parts = [column.texts(slice(begin, begin + ROWS)) for column in columns]
        lengths = np.stack([own for _, own in parts], axis=1)
        # every text is followed by a comma, the last of its row by a line end
        starts = sums((lengths + 1).ravel())
        line = np.full(int(starts[-1]), ord(","), np.uint8)
        starts = starts[:-1].reshape(lengths.shape)
        line[starts[:, -1] + lengths[:, -1]] = ord("\n")
        for place, (text, own) in enumerate(parts):
            line[_offsets(starts[:, place], own)] = text
        yield line.tobytes()


def _offsets(start: Ints, lengths: Ints) -> Ints:
    """The offsets of all letters of texts that begin at ``start`` (K,)."""
    ends = sums(lengths)
    return np.asarray(np.arange(ends[-1]) + np.repeat(start - ends[:-1], lengths))
