"""What calls in a routine reach, and what these change, whatever the flow."""

from __future__ import annotations

from collections.abc import Iterable, Set
from itertools import chain
from typing import NamedTuple

from postproc.languages.core.comments_in_force import SPEAKS, VARYING
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.declared_data import Usage, walk
from postproc.languages.rapid.instructions import DISPLACING, HALTING, MODES, SCALING, WAITING
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import (
    Expression,
    FunctionCall,
    Instruction,
    Leave,
    Name,
    NotUnderstood,
    NumberLiteral,
    Remark,
    Star,
    Statement,
    StringLiteral,
)
from postproc.toolpath import ArcFrame, OrientationMode

_ALONE = (Name, NumberLiteral, Star, StringLiteral)
NO_CALLS: tuple[FunctionCall, ...] = ()


class Reach(NamedTuple):
    """``routines`` that a call may run, the names that they assign, and all in them."""

    routines: Set[bytes]
    assigned: Set[bytes]
    mentioned: Set[bytes]


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
            routines = self.usage.reached([name])
            assigned, mentioned = (
                set().union(*(names.get(one, ()) for one in routines))
                for names in (self.usage.assigned_in, self.usage.mentioned_in)
            )
            found = self._of[name] = Reach(routines, assigned, mentioned)
        return found

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


class ModeChanges(NamedTuple):
    """The instructions of routines that change how motions are meant, and whether comments on forces, and instructions
    at which the program waits, are in them."""

    names: Set[bytes]
    speaks: bool
    waits: bool

    def __bool__(self) -> bool:
        return bool(self.names) or self.speaks

    def lose(self, state: ProgramState, reason: bytes) -> None:
        """What is in force where one of the routines may have run, or a part of it."""
        names = self.names
        if not names.isdisjoint(DISPLACING):
            state.displaced |= {reason}
        if b"VELSET" in names:
            state.override = None
        if not names.isdisjoint(SCALING):
            state.scaled = True
        if b"SINGAREA" in names:
            state.orientation = OrientationMode.UNKNOWN
        if b"CIRPATHMODE" in names:
            state.arc = ArcFrame.UNKNOWN
        if b"CONFL" in names:
            state.checks_linear = None
        if b"CONFJ" in names:
            state.checks_joint = None
        if self.waits:
            state.waits = max(state.waits, Waits.MAYBE)
        if self.speaks:
            state.force = state.switch = VARYING


def leaving_words(body: tuple[Statement, ...]) -> set[bytes]:
    """RETURN and other words that leave statements, or start them again."""
    return {one.word for one in walk(body) if isinstance(one, Leave)}


def mode_changes(bodies: Iterable[tuple[Statement, ...]], at_start: Set[bytes]) -> ModeChanges:
    """Those of all statements; at_start: instructions that only state what is in force where a program starts."""
    names: set[bytes] = set()
    speaks = False
    for one in chain.from_iterable(map(walk, bodies)):
        if isinstance(one, Instruction):
            names.add(one.name)
        elif isinstance(one, NotUnderstood):
            names |= one.names
        elif isinstance(one, Remark):
            speaks = speaks or SPEAKS.match(one.text) is not None
    return ModeChanges(
        (names & MODES) - at_start, speaks, not names.isdisjoint(HALTING | WAITING | {b"WAITTIME"})
    )
