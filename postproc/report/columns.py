"""A table of many rows as the bytes of a CSV, block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Floats
from postproc.blocks import ROWS, in_blocks
from postproc.decimals import Fours, fours, number_letters, text_of


@dataclass(frozen=True, eq=False)
class Numbers:
    """A column of numbers (K,) with as many ``decimals``; empty where one is not finite."""

    name: str
    values: Floats
    decimals: int = 0

    def __len__(self) -> int:
        return len(self.values)

    def letters(self, before: bytes) -> list[Fours]:
        """Its texts as columns (K,), each behind the letter ``before``."""
        values = self.values
        if len(values) and (values == values[0]).all():
            text = text_of(number_letters(values[:1], self.decimals, before))
            return _chosen([text], np.zeros(len(values), np.int8))
        return number_letters(values, self.decimals, before)


@dataclass(frozen=True, eq=False)
class Words:
    """A column of words: ``codes`` (K,) are places in ``words``, which hold no comma, quote or line end."""

    name: str
    codes: NDArray[np.integer]
    texts: Sequence[str]

    def __len__(self) -> int:
        return len(self.codes)

    def letters(self, before: bytes) -> list[Fours]:
        """As those of ``Numbers``."""
        return _chosen([before + text.encode("ascii") for text in self.texts], self.codes)


def _chosen(texts: Sequence[bytes], codes: NDArray[np.integer]) -> list[Fours]:
    places = range(0, max(map(len, texts)), 4)
    return [np.array([fours(text[at : at + 4]) for text in texts])[codes] for at in places]


def csv_parts(
    columns: Callable[[slice], Sequence[Numbers | Words]], count: int, rows: int = ROWS
) -> Iterator[bytes]:
    """A header, and a line each of ``count`` rows; ``columns`` gives those of some rows."""
    yield ",".join(column.name for column in columns(slice(0, 0))).encode("ascii") + b"\n"
    yield from in_blocks(lambda block: _lines(columns(block)), count, rows)


def _lines(columns: Sequence[Numbers | Words]) -> bytes:
    first, *others = columns
    letters = [*first.letters(b""), *(part for column in others for part in column.letters(b","))]
    return text_of([*letters, np.full(len(first), fours(b"\n"))])
