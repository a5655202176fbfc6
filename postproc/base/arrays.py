"""Arrays as the rest of the house holds them: of a stated shape, and read-only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.signedinteger[Any]]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, shape: tuple[int, ...] | None = None, dtype: Any = np.float64) -> NDArray[Any]:
    """A read-only, C-ordered copy of ``values``; -1 in ``shape`` means any length.  What is read-only already and
    owns its data, or is one row that represents all, is taken as it is.

    Raises ValueError when the shape is another one: a defect of the program, never of its input.
    """
    array = values if _is_frozen(values, dtype) else np.array(values, dtype=dtype, order="C")
    if shape is not None and (
        array.ndim != len(shape)
        or any(want not in (-1, have) for want, have in zip(shape, array.shape, strict=True))
    ):
        raise ValueError(f"the array has the shape {array.shape} where {shape} is expected")
    array.setflags(write=False)
    return array


def differs(new: Floats, old: Floats, tolerance: float = 1e-12) -> Bools:
    """(...) element by element, where ``new`` is another number than ``old`` (...); NaN is one.  ``tolerance``: of
    positions [m] and rotations."""
    with np.errstate(invalid="ignore"):
        return ~((np.abs(new - old) <= tolerance) | (np.isnan(new) & np.isnan(old)))


def _is_frozen(values: ArrayLike, dtype: Any) -> TypeGuard[NDArray[Any]]:
    if not isinstance(values, np.ndarray) or values.flags.writeable or values.dtype != dtype:
        return False
    one_for_all = values.ndim > 0 and values.size > 0 and values.strides[0] == 0
    return one_for_all or bool(values.flags.owndata and values.flags.c_contiguous)


def is_shared(array: NDArray[Any]) -> bool:
    """Whether one row in memory represents all rows of ``array`` (N, ...), as ``shared`` and ``np.broadcast_to`` make
    it."""
    return not array.strides[0]


def shared(array: NDArray[Any]) -> NDArray[Any]:
    """``array`` (N, ...), or where its rows are all the same one of them that represents all, of the same shape;
    read-only."""
    if len(array) < 2 or is_shared(array):
        return array
    for rows in (slice(0, 64), slice(None)):  # the first rows decide most cases
        part = array[rows]
        if not ((part == array[0]) | ((part != part) & (array[0] != array[0]))).all():
            return array
    return np.broadcast_to(array[0].copy(), array.shape)


def numbers(rows: Any, count: int) -> Ints:
    """The numbers (K,) of ``rows`` of ``count``: given as such, or as a mask (count,) or a slice."""
    if isinstance(rows, slice):
        return np.arange(*rows.indices(count))
    chosen = np.asarray(rows)
    return np.flatnonzero(chosen) if chosen.dtype == np.bool_ else chosen


def sums(lengths: NDArray[Any], kind: type[np.signedinteger] = np.int64) -> Ints:
    """(K + 1,) where parts of these lengths (K,) start, and the last one ends."""
    ends = np.zeros(len(lengths) + 1, dtype=kind)
    np.cumsum(lengths, out=ends[1:])
    return ends


class FewRows:
    """(N, k) numbers of which only few rows are known, stored alone; NaN in all others.  Read-only.

    rows (R,): which are known, ascending; values (R, k).
    """

    def __init__(self, rows: Ints, values: Floats, count: int) -> None:
        self.rows, self.values, self.shape = rows, values, (count, values.shape[1])

    @staticmethod
    def of(values: Floats | FewRows) -> FewRows:
        """Of an array (N, k): the rows that hold a number."""
        if isinstance(values, FewRows):
            return values
        rows = np.flatnonzero(np.isfinite(values).any(axis=1))
        return FewRows(rows, frozen(values[rows]), len(values))

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Any) -> Floats:
        """As of an array, by rows: numbers from 0, a mask or a slice."""
        chosen = numbers(rows, len(self))
        values = np.full((*chosen.shape, self.shape[1]), np.nan)
        if len(self.rows):
            at = np.minimum(np.searchsorted(self.rows, chosen), len(self.rows) - 1)
            known = self.rows[at] == chosen
            values[known] = self.values[at[known]]
        return values

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)


class LazyRows:
    """An array (N, ...) of which parts are computed where they are asked for; read-only, and indexed by rows only."""

    def __init__(self, count: int, build: Callable[[Ints], Floats]) -> None:
        self._count, self._build = count, build

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, rows: Any) -> Floats:
        """As of an array, by rows: numbers from 0, a mask or a slice."""
        return self._build(numbers(rows, self._count))
