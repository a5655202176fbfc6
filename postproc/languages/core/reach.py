"""What is reached from somewhere, step by step."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TypeVar

Place = TypeVar("Place", bound=Hashable)


def reached(start: Iterable[Place], steps: Callable[[Place], Iterable[Place]]) -> set[Place]:
    """``start``, what its steps lead to, and what the steps from there do."""
    seen: set[Place] = set()
    todo = list(start)
    while todo:
        place = todo.pop()
        if place not in seen:
            seen.add(place)
            todo += steps(place)
    return seen
