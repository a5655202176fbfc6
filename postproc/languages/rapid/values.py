"""Values of RAPID as they are known before the program runs, with the places of their literals."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from postproc.languages.rapid.array_items import ArrayItems, Items, with_item


class Leaf(NamedTuple):
    """A number, a truth value or a string; ``start``, ``stop``: its literal, -1 where it is computed."""

    value: float | bool | bytes
    start: int = -1
    stop: int = -1


class GroupValue(NamedTuple):
    """An aggregate or an array; ``items``: its values."""

    items: Items


class UnknownData(NamedTuple):
    """``reason`` completes "... because"; ``name``: that of data which the file does not declare."""

    reason: str
    name: bytes = b""


Value = Leaf | GroupValue | UnknownData

TRUE, FALSE = Leaf(True), Leaf(False)


def plain(value: Value) -> Value:
    """The value without places: a copy of it."""
    if isinstance(value, Leaf):
        return value if value.start < 0 else Leaf(value.value)
    if isinstance(value, GroupValue):
        if isinstance(value.items, ArrayItems):
            return GroupValue(value.items.mapped(plain))
        return GroupValue(tuple(map(plain, value.items)))
    return value


def joined(one: Value, other: Value, reason: str) -> Value:
    """What holds where both may be: the value where they are equal, else unknown for ``reason``."""
    if one is other or one == other:
        return one
    if isinstance(one, Leaf) and isinstance(other, Leaf):
        same = one.value == other.value and isinstance(one.value, bytes | bool) == isinstance(
            other.value, bytes | bool
        )
        return Leaf(one.value) if same else UnknownData(reason)
    if isinstance(one, GroupValue) and isinstance(other, GroupValue) and len(one.items) == len(other.items):
        if isinstance(one.items, ArrayItems) and isinstance(other.items, ArrayItems):
            return GroupValue(one.items.joined(other.items, partial(joined, reason=reason)))
        return GroupValue(tuple(joined(a, b, reason) for a, b in zip(one.items, other.items, strict=True)))
    if isinstance(one, UnknownData):
        return UnknownData(one.reason) if one.name else one
    return UnknownData(reason)


def unknown_in(value: Value) -> UnknownData | None:
    """The first part that is not known."""
    if isinstance(value, UnknownData):
        return value
    if isinstance(value, GroupValue):
        if isinstance(value.items, ArrayItems):
            unknown: UnknownData | None = value.items.first(unknown_in)
            return unknown
        for item in value.items:
            found = unknown_in(item)
            if found is not None:
                return found
    return None


def number_of(value: Value) -> float | None:
    """A number, None for anything else."""
    if isinstance(value, Leaf) and not isinstance(value.value, bytes | bool):
        return value.value
    return None


def numbers_of(value: Value, count: int) -> tuple[float, ...] | None:
    """``count`` numbers of a group, None where it is none."""
    if not isinstance(value, GroupValue) or len(value.items) != count:
        return None
    found = tuple(number_of(item) for item in value.items)
    return None if None in found else tuple(number for number in found if number is not None)


def truth_of(value: Value) -> bool | None:
    """A truth value, None for anything else."""
    return value.value if isinstance(value, Leaf) and isinstance(value.value, bool) else None


def replaced(value: Value, place: tuple[int, ...], new: Value, reason: str) -> Value:
    """``value`` with ``new`` at the indices of ``place``."""
    if not place:
        return new
    if not isinstance(value, GroupValue) or not 0 <= place[0] < len(value.items):
        return UnknownData(reason)
    at = place[0]
    part = replaced(value.items[at], place[1:], new, reason)
    return GroupValue(with_item(value.items, at, part))
