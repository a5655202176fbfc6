"""The items of a long array in chunks that its versions share: one with another item costs a chunk, not the array."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from operator import is_
from typing import Any, TypeVar, overload

CHUNK = 512
"""Items that a chunk has; a longer sequence of items is an ``ArrayItems``."""

Change = Callable[[Any], Any]
"""A function of an item alone."""


Kept = TypeVar("Kept", bound=tuple[Any, ...])


class _Chunk(tuple[Any, ...]):
    """Items that follow each other, and what was asked of each of them."""

    def __new__(cls, items: Sequence[Any]) -> _Chunk:
        chunk = super().__new__(cls, items)
        chunk.answers = {}
        return chunk

    answers: dict[Change, Any]


class ArrayItems(Sequence[Any]):
    """A tuple of many items, in its behaviour."""

    __slots__ = ("_count", "chunks")

    def __init__(self, chunks: tuple[_Chunk, ...], count: int) -> None:
        self.chunks, self._count = chunks, count

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, at: int) -> Any: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[Any, ...]: ...

    def __getitem__(self, at: int | slice) -> Any:
        if isinstance(at, slice):
            return tuple(self)[at]
        if not -self._count <= at < self._count:
            raise IndexError(at)
        chunk, place = divmod(at % self._count, CHUNK)
        return self.chunks[chunk][place]

    def __iter__(self) -> Iterator[Any]:
        return chain.from_iterable(self.chunks)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ArrayItems) and self.chunks == other.chunks

    def __hash__(self) -> int:
        return hash(self.chunks)

    def with_item(self, at: int, item: Any) -> ArrayItems:
        """The items with another one at a place that exists."""
        chunk, place = divmod(at, CHUNK)
        old = self.chunks[chunk]
        if old[place] is item:
            return self
        new = _Chunk((*old[:place], item, *old[place + 1 :]))
        return ArrayItems((*self.chunks[:chunk], new, *self.chunks[chunk + 1 :]), self._count)

    def mapped(self, change: Change) -> ArrayItems:
        """The items as ``change`` gives them; itself where that gives them all back.  A chunk is asked once."""
        chunks = []
        for chunk in self.chunks:
            if change not in chunk.answers:
                new = _kept(chunk, _Chunk(tuple(map(change, chunk))))
                chunk.answers[change] = None if new is chunk else new
            chunks.append(chunk.answers[change] or chunk)
        changed = _kept(self.chunks, tuple(chunks))
        return self if changed is self.chunks else ArrayItems(changed, self._count)

    def first(self, find: Change) -> Any:
        """The first that ``find`` gives of an item and that is not None.  A chunk is asked once."""
        for chunk in self.chunks:
            if find not in chunk.answers:
                chunk.answers[find] = next(
                    (found for item in chunk if (found := find(item)) is not None), None
                )
            if chunk.answers[find] is not None:
                return chunk.answers[find]
        return None

    def joined(self, other: ArrayItems, join: Callable[[Any, Any], Any]) -> ArrayItems:
        """The items joined one by one with those of as many others; ``join`` gives back one that is met by itself."""
        chunks = tuple(
            mine if mine is others else _kept(mine, _Chunk(tuple(map(join, mine, others))))
            for mine, others in zip(self.chunks, other.chunks, strict=True)
        )
        return self if _kept(self.chunks, chunks) is self.chunks else ArrayItems(chunks, self._count)


def _kept(old: Kept, new: Kept) -> Kept:
    """The old ones where the new ones are the same objects."""
    return old if all(map(is_, old, new)) else new


Items = tuple[Any, ...] | ArrayItems


def repeated(item: Any, count: int) -> Items:
    """One item again and again."""
    if count <= CHUNK:
        return (item,) * count
    chunk = _Chunk((item,) * CHUNK)
    rest = count % CHUNK
    return ArrayItems((chunk,) * (count // CHUNK) + ((_Chunk((item,) * rest),) if rest else ()), count)


def with_item(items: Items, at: int, item: Any) -> Items:
    """Items with another one at a place that exists."""
    if isinstance(items, ArrayItems):
        return items.with_item(at, item)
    return (*items[:at], item, *items[at + 1 :])
