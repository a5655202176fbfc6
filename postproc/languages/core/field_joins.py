"""What holds where paths meet: fields that are the same stay, and each says what becomes of one that is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import compress
from operator import attrgetter, is_not
from typing import Any

from postproc.languages.core.waits import Waits

Join = Callable[[Any, Any], Any]
"""The value of a field of two values that differ: the own one, and that of the path that comes in."""


def lost(value: object) -> Join:
    """Different ones leave this ``value``: not known, or varying."""
    return lambda one, other: value


def either(one: Any, other: Any) -> Any:
    return one or other


SOMETIMES = lost(Waits.MAYBE)
"""Of waits that not all paths have."""


def is_same(one: object, other: object) -> bool:
    """Whether two values are one, and so are two that are not numbers."""
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    return one is other or one == other or (one != one and other != other)


class FieldJoins:
    """``joins``: name of a field -> its join.  ``values``: those of all of them, of a state."""

    def __init__(self, joins: Mapping[str, Join]) -> None:
        self._names, self._joins = tuple(joins), tuple(joins.values())
        self.values: Callable[[Any], tuple[Any, ...]] = attrgetter(*joins)

    def changes(self, one: object, other: object) -> dict[str, Any]:
        """The fields that are no longer those of ``one`` where ``other`` comes in, and their values."""
        values, others = self.values(one), self.values(other)
        changed: dict[str, Any] = {}
        differing = tuple(map(is_not, values, others))
        if True not in differing:
            return changed
        for name, join, a, b in compress(
            zip(self._names, self._joins, values, others, strict=True), differing
        ):
            if is_same(a, b):
                continue
            value = join(a, b)
            if not is_same(value, a):
                changed[name] = value
        return changed
