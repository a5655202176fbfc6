"""Arrays stored so that what is free between them goes back to the system."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ArrayStore:
    """Keeps arrays in blocks so large that the system takes them back when nothing in them is used any more."""

    SIZE = 33 << 20
    """Bytes; the C library gives allocations above 32 MB back at once, and what is not used takes no memory."""

    def __init__(self) -> None:
        self._block, self._used = np.empty(0, np.uint8), 0

    def keep(self, array: NDArray[Any], dtype: type[np.generic] | None = None) -> NDArray[Any]:
        """A copy of ``array`` (...) of the same shape, with values of another type if one is given; an array that is
        large is kept as it is."""
        kind = np.dtype(dtype or array.dtype)
        size = array.size * kind.itemsize
        if size > self.SIZE // 8 and kind == array.dtype:
            return array
        if self._used + size > len(self._block):
            self._block, self._used = np.empty(max(self.SIZE, size), np.uint8), 0
        copy = self._block[self._used : self._used + size].view(kind).reshape(array.shape)
        copy[...] = array
        self._used += -(-size // 8) * 8
        return copy


class GrowingColumns:
    """Columns that grow at their ends, in place: the parts of a long one would leave holes in the memory.  What is
    large becomes an array, as only those lie in files where a program is larger than memory."""

    def __init__(self, *types: Any) -> None:
        self._types, self._bytes = types, [bytearray() for _ in types]
        self._arrays: list[list[NDArray[Any]]] = [[] for _ in types]

    def add(self, *columns: NDArray[Any]) -> None:
        """Append ``columns`` (K,) to those that are here, one to each."""
        for k, (values, kind) in enumerate(zip(columns, self._types, strict=True)):
            self._bytes[k] += np.ascontiguousarray(values, kind).data
            if len(self._bytes[k]) > ArrayStore.SIZE:
                self._arrays[k].append(np.frombuffer(self._bytes[k], kind).copy())
                self._bytes[k] = bytearray()

    def done(self) -> Iterator[NDArray[Any]]:
        """The columns (N,) as they are now."""
        for buffer, arrays, kind in zip(self._bytes, self._arrays, self._types, strict=True):
            last = np.frombuffer(buffer, kind)
            yield np.concatenate([*arrays, last]) if arrays else last
            arrays.clear()
