"""What calls in a routine reach, and what these assign, whatever the flow."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple

from postproc.languages.rapid.declared_data import Usage
from postproc.languages.rapid.syntax_tree import (
    Expression,
    FunctionCall,
    Name,
    NumberLiteral,
    Star,
    StringLiteral,
)

_ALONE = (Name, NumberLiteral, Star, StringLiteral)
NO_CALLS: tuple[FunctionCall, ...] = ()


class Reach(NamedTuple):
    """``routines`` that a call may run, and the names that they assign."""

    routines: Set[bytes]
    assigned: Set[bytes]


class CallEffects:
    """Of the routines of a module, by ``usage``."""

    def __init__(self, usage: Usage) -> None:
        self.usage = usage
        self._of: dict[bytes, Reach] = {}
        self._calls: dict[int, tuple[Expression, tuple[FunctionCall, ...]]] = {}

    def of(self, name: bytes) -> Reach:
        """Of a routine and those that it calls."""
        found = self._of.get(name)
        if found is None:
            routines = self._reached(name)
            assigned = set().union(*(self.usage.assigned_in.get(one, ()) for one in routines))
            found = self._of[name] = Reach(routines, assigned)
        return found

    def _reached(self, name: bytes) -> set[bytes]:
        seen: set[bytes] = set()
        pending = [name]
        while pending:
            one = pending.pop()
            if one not in seen:
                seen.add(one)
                pending += self.usage.calls.get(one, ())
        return seen

    def calls_in(self, expression: Expression) -> tuple[FunctionCall, ...]:
        """The functions in an expression, which is one of the module for as long as this is."""
        if isinstance(expression, _ALONE):
            return NO_CALLS
        known = self._calls.get(id(expression))
        if known is None:
            known = self._calls[id(expression)] = expression, tuple(_calls(expression))
        return known[1]


def _calls(expression: Expression) -> list[FunctionCall]:
    found: list[FunctionCall] = []
    pending: list[object] = [expression]
    while pending:
        one = pending.pop()
        if isinstance(one, FunctionCall):
            found.append(one)
        if isinstance(one, tuple) and not isinstance(one, _ALONE):
            pending += one
    return found
