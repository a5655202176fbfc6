"""A table of many rows as the bytes of a CSV, block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Floats
from postproc.base.batches import ROWS, in_blocks
from postproc.base.dataclass import dataclass
from postproc.base.decimals import Fours, fours, number_letters, text_of


@dataclass(frozen=True, eq=False)
class NumberColumn:
    """A column of ``values`` (K,) with as many ``decimals``; empty where one is not finite."""

    name: str
    values: Floats
    decimals: int = 0

    def __len__(self) -> int:
        return len(self.values)

    def letters(self, before: bytes) -> list[Fours]:
        """Its texts as columns (K,), each after the letter ``before``."""
        values = self.values
        if len(values) and (values == values[0]).all():
            text = text_of(number_letters(values[:1], self.decimals, before))
            return _chosen([text], np.zeros(len(values), np.int8))
        return number_letters(values, self.decimals, before)


@dataclass(frozen=True, eq=False)
class TextColumn:
    """A column of words: ``codes`` (K,) are places in ``texts``, which hold no comma, quote or line end."""

    name: str
    codes: NDArray[np.integer]
    texts: Sequence[str]

    def __len__(self) -> int:
        return len(self.codes)

    def letters(self, before: bytes) -> list[Fours]:
        """As those of ``NumberColumn``, columns (K,) of fours."""
        return _chosen([before + text.encode("ascii") for text in self.texts], self.codes)


def _chosen(texts: Sequence[bytes], codes: NDArray[np.integer]) -> list[Fours]:
    places = range(0, max(map(len, texts)), 4)
    return [np.array([fours(text[at : at + 4]) for text in texts])[codes] for at in places]


def csv_parts(
    columns: Callable[[slice], Sequence[NumberColumn | TextColumn]], count: int, rows: int = ROWS
) -> Iterator[bytes]:
    """A header, and a line each of ``count`` rows; ``columns`` gives those of some rows."""
    yield ",".join(column.name for column in columns(slice(0, 0))).encode("ascii") + b"\n"
    yield from in_blocks(lambda block: _lines(columns(block)), count, rows)


def _lines(columns: Sequence[NumberColumn | TextColumn]) -> bytes:
    first, *others = columns
    letters = [*first.letters(b""), *(part for column in others for part in column.letters(b","))]
    return text_of([*letters, np.full(len(first), fours(b"\n"))])
