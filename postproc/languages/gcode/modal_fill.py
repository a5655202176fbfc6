"""What is in force at each of many blocks, and columns that are the same all over: these take no room."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from postproc.base.arrays import Bools, Ints, is_shared


def everywhere(value: ArrayLike, count: int, dtype: Any = None) -> NDArray[Any]:
    """(``count``, ...) rows of one ``value`` (...), read-only."""
    one = np.asarray(value, dtype)
    if one.ndim and one.size and np.array_equal(one, np.broadcast_to(one.flat[0], one.shape), equal_nan=True):
        return np.broadcast_to(one.flat[0], (count, *one.shape))
    return np.broadcast_to(one, (count, *one.shape))


def fill_modal(count: int, at: Ints, value: NDArray[Any], first: int, dtype: Any) -> NDArray[Any]:
    """(count,) the value of the last of ``at`` (K,), ascending, that is not after a row; ``first`` before them all.

    Of several values at one row the last holds.
    """
    last = np.append(at[1:] != at[:-1], True)[: len(at)]
    at, value = at[last], value[last]
    new = value != np.append(first, value[:-1])[: len(value)]
    at, value = at[new], value[new].astype(dtype)
    if not len(at) or (len(at) == 1 and at[0] == 0):
        return everywhere(value[0] if len(at) else first, count, dtype)
    return np.repeat(np.append(dtype(first), value), np.diff(at, prepend=0, append=count))


def switched(state: Ints, before: int) -> Bools:
    """(B,) blocks in which ``state`` (B,) is another one than in the block ahead; ``before`` ahead of the first."""
    if is_shared(state):
        return _single(len(state), len(state) > 0 and int(state[0]) != before)
    return np.asarray(np.diff(state, prepend=state.dtype.type(before)) != 0)


def _single(count: int, first: bool) -> Bools:
    mask = np.zeros(count, np.bool_)
    mask[:1] = first
    return mask


def lookup(state: Ints, table: NDArray[Any]) -> NDArray[Any]:
    """(B, ...) ``table[state]`` of ``state`` (B,) and ``table`` (K, ...); one value where the state is one."""
    if is_shared(state) and len(state):
        return everywhere(table[state[0]], len(state))
    return np.asarray(table[state])


class FilledRows:
    """Columns of N rows, filled from the first row on, part by part."""

    def __init__(self, count: int) -> None:
        self._count, self._filled = count, 0
        self._one: dict[str, NDArray[Any]] = {}
        self._many: dict[str, NDArray[Any]] = {}

    def put(self, count: int, **columns: NDArray[Any]) -> None:
        """Fills the next ``count`` rows of all ``columns`` (``count``, ...)."""
        for name, values in columns.items():
            if not count:
                self._one.setdefault(name, np.zeros(values.shape[1:], values.dtype))
                continue
            if name not in self._many and not self._uniform(name, values):
                self._many[name] = np.empty((self._count, *values.shape[1:]), values.dtype)
                self._many[name][: self._filled] = self._one.pop(name)
            if name in self._many:
                self._many[name][self._filled : self._filled + count] = values
        self._filled += count

    def _uniform(self, name: str, values: NDArray[Any]) -> bool:
        """Whether all rows up to now, and those of ``values``, are the same."""
        if self._filled == 0:
            self._one[name] = values[0].copy()
        one = self._one[name]
        if not np.array_equal(values[0], one, equal_nan=True):
            return False
        if is_shared(values):
            return True
        same = values == one
        if values.dtype.kind == "f":
            same |= np.isnan(values) & np.isnan(one)
        return bool(same.all())

    def take_column(self, name: str) -> NDArray[Any]:
        """The column (N, ...), read-only; it is let go here."""
        if name not in self._many:
            return everywhere(self._one[name], self._count)
        column = self._many.pop(name)
        column.setflags(write=False)
        return column
