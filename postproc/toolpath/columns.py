"""Small types whose arrays have one row a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import frozen, shared
from postproc.base.dataclass import dataclass

COLUMN = "column"
"""The key of a ``Column`` in the metadata of a dataclass's field."""


@dataclass(frozen=True)
class Column:
    """An array (N, *shape) of ``dtype``; where none is given, ``default`` is in all rows (None: it has to be given)."""

    shape: tuple[int, ...]
    dtype: type[np.generic]
    default: float | None

    def fill(self, values: NDArray[Any], count: int) -> NDArray[Any]:
        """``values`` (N, ...) read-only, of ``count`` rows; where they are the same, one is stored for all.

        Raises ValueError where it has another number of rows or another shape: a defect of the program.
        """
        shape = (count, *self.shape)
        if not len(values) and self.default is not None:
            values = np.broadcast_to(np.asarray(self.default, self.dtype), shape)
        return shared(frozen(values, shape, self.dtype))


def column(
    *shape: int, dtype: type[np.generic] = np.float64, default: float | None = None
) -> dict[str, Column]:
    """The metadata of a field that is an array (N, *shape); with a ``default`` it may be ``not_given``."""
    return {COLUMN: Column(shape, dtype, default)}


def not_given() -> NDArray[Any]:
    """(0,) in the place of a column that has its default in all rows."""
    return np.empty(0)


@dataclass(frozen=True)
class MotionColumns:
    """Read-only arrays of N rows, one a motion.

    A column that is not given (it has no rows) has its default in all rows.
    """

    def __post_init__(self) -> None:
        self._fill(max((len(getattr(self, name)) for name, _ in self._columns()), default=0))

    def for_motions(self, count: int) -> Self:
        """Itself; where nothing is given, ``count`` rows of defaults.

        Raises ValueError where it has another number of rows: a defect of the program.
        """
        if all(len(getattr(self, name)) == count for name, _ in self._columns()):
            return self
        new = replace(self)
        new._fill(count)
        return new

    def _fill(self, count: int) -> None:
        for name, its in self._columns():
            object.__setattr__(self, name, its.fill(getattr(self, name), count))

    def _columns(self) -> Iterator[tuple[str, Column]]:
        return ((one.name, one.metadata[COLUMN]) for one in fields(self) if COLUMN in one.metadata)
