"""An immutable map whose versions share what they have in common, so that branches of a program cost what they change.

A trie over hashable keys, which are numbered as they come: a new version copies one node a level, and two versions are
merged in the time that their difference takes (Driscoll, Sarnak, Sleator, Tarjan: Making data structures persistent,
JCSS 38, 1989).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from itertools import compress
from operator import is_not
from typing import Any

WIDTH = 16
BITS = 4
_EMPTY: tuple[Any, ...] = (None,) * WIDTH
_PLACES = range(WIDTH)

Merge = Callable[[Any, Any, Any], Any]
"""The value of a key from its values in two maps, None where one has none."""
_Node = tuple[Any, ...]
_Merges = dict[tuple[int, int, int], tuple[_Node, _Node, _Node]]
"""Numbers of the first key of two nodes, and of these -> both, and what they were merged to."""
MOST_MERGES = 50_000
"""Merges of nodes that are remembered."""


class KeyNumbers:
    """The numbers of the keys that maps of one program share, and what was merged of these maps."""

    def __init__(self) -> None:
        self.numbers: dict[Hashable, int] = {}
        self.keys: list[Any] = []
        self.merges: dict[Merge, _Merges] = {}

    def of(self, key: Hashable) -> int:
        number = self.numbers.get(key)
        if number is None:
            number = self.numbers[key] = len(self.keys)
            self.keys.append(key)
        return number


class PersistentMap:
    """Keys and their values; None is no value."""

    __slots__ = ("depth", "numbers", "root")

    def __init__(self, numbers: KeyNumbers, root: tuple[Any, ...] = _EMPTY, depth: int = 0) -> None:
        self.numbers, self.root, self.depth = numbers, root, depth

    def get(self, key: Hashable) -> Any:
        number = self.numbers.numbers.get(key)
        if number is None or number >> (BITS * (self.depth + 1)):
            return None
        node = self.root
        for shift in range(BITS * self.depth, 0, -BITS):
            node = node[(number >> shift) & (WIDTH - 1)]
            if node is None:
                return None
        return node[number & (WIDTH - 1)]

    def set(self, key: Hashable, value: Any) -> PersistentMap:
        """The map with another value of a key; None takes it out."""
        number = self.numbers.of(key)
        root, depth = self.root, self.depth
        while number >> (BITS * (depth + 1)):
            root, depth = (root, *_EMPTY[1:]), depth + 1
        changed = _set(root, BITS * depth, number, value)
        return (
            self if changed is root and depth == self.depth else PersistentMap(self.numbers, changed, depth)
        )

    def items(self) -> Iterator[tuple[Any, Any]]:
        for number, value in _walk(self.root, self.depth, 0):
            yield self.numbers.keys[number], value

    def merged(self, other: PersistentMap, merge: Merge, remembered: bool = False) -> PersistentMap:
        """The map of ``merge(key, own value, value in other)`` for all keys whose values are not the same object; the
        map itself where that changes nothing.

        remembered: ``merge`` is a function of its arguments alone, and is asked once of what these versions and others
        share: merging along a program then costs what changes between its places, not what differs at each.
        """
        if self.root is other.root:
            return self
        depth = max(self.depth, other.depth)
        own, others = (m._deepened(depth) for m in (self, other))
        known = self.numbers.merges.setdefault(merge, {}) if remembered else None
        root = _merged(own.root, others.root, depth, 0, self.numbers.keys, merge, known)
        if root is others.root:
            return others
        return self if root is own.root else PersistentMap(self.numbers, root, depth)

    def common(self, other: PersistentMap) -> PersistentMap:
        """The keys that have equal values in both; the map itself where these are all of its own.  It takes no time
        for what only ``other`` has."""
        depth = max(self.depth, other.depth)
        own, others = (m._deepened(depth) for m in (self, other))
        root = _common(own.root, others.root, depth)
        return self if root is own.root else PersistentMap(self.numbers, root, depth)

    def _deepened(self, depth: int) -> PersistentMap:
        if depth == self.depth:
            return self
        root = self.root
        for _ in range(depth - self.depth):
            root = (root, *_EMPTY[1:])
        return PersistentMap(self.numbers, root, depth)


def _set(node: tuple[Any, ...], shift: int, number: int, value: Any) -> tuple[Any, ...]:
    at = (number >> shift) & (WIDTH - 1)
    if shift:
        value = _set(node[at] or _EMPTY, shift - BITS, number, value)
    if node[at] is value:
        return node
    changed = list(node)
    changed[at] = value
    return tuple(changed)


def _walk(node: tuple[Any, ...], depth: int, base: int) -> Iterator[tuple[int, Any]]:
    for at, child in enumerate(node):
        if child is not None:
            if depth:
                yield from _walk(child, depth - 1, (base + at) * WIDTH)
            else:
                yield base + at, child


def _merged(
    own: tuple[Any, ...], other: tuple[Any, ...], depth: int, base: int, keys: list[Any], merge: Merge,
    known: _Merges | None,
) -> tuple[Any, ...]:  # fmt: skip
    place = base, id(own), id(other)
    if known is not None and place in known:
        return known[place][2]
    changed: list[tuple[int, Any]] = []
    is_other = True
    for at in compress(_PLACES, map(is_not, own, other)):
        one, two = own[at], other[at]
        if depth:
            mine, others = one or _EMPTY, two or _EMPTY
            new = _merged(mine, others, depth - 1, (base + at) * WIDTH, keys, merge, known)
            is_other = is_other and new is others
            new = one if new is mine else new
        else:
            new = merge(keys[base + at], one, two)
            is_other = is_other and new is two
        if new is not one:
            changed.append((at, new))
    found = own if not changed else other if is_other else _with(own, changed)
    if known is not None:
        if len(known) >= MOST_MERGES:
            known.clear()
        known[place] = own, other, found
    return found


def _with(node: tuple[Any, ...], changed: list[tuple[int, Any]]) -> tuple[Any, ...]:
    items = list(node)
    for at, item in changed:
        items[at] = item
    return tuple(items)


def _common(own: tuple[Any, ...], other: tuple[Any, ...], depth: int) -> tuple[Any, ...]:
    kept: list[Any] | None = None
    for at in compress(_PLACES, map(is_not, own, other)):
        one, two = own[at], other[at]
        if one is None:
            continue
        if two is None:
            new = None
        elif depth:
            new = _common(one, two, depth - 1)
        else:
            new = one if one == two else None
        if new is not one:
            kept = list(own) if kept is None else kept
            kept[at] = new
    return own if kept is None else tuple(kept)
