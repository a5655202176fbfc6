"""What a name means in a routine: data of its own, of the module, or of the controller."""

from __future__ import annotations

from collections.abc import Iterable

from postproc.languages.rapid.call_effects import Reach
from postproc.languages.rapid.declared_data import DeclaredData, Usage, walk
from postproc.languages.rapid.evaluation import Typed
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import DataDeclaration, For, Goto, RapidRoutine
from postproc.languages.rapid.values import UnknownData


class RoutineNames:
    """Of the routines that run; the last of ``active`` is the one whose statements are run.  ``aliased``: keys of data
    that has two names where one of them is assigned."""

    def __init__(self, data: DeclaredData, usage: Usage) -> None:
        self.active: list[RapidRoutine] = []
        self._data, self._usage = data, usage
        self.aliased: set[bytes] = set()
        self._of: dict[bytes, dict[bytes, tuple[bytes, bytes]]] = {}
        self._meanings: dict[tuple[bytes, bytes], tuple[bytes, bytes, UnknownData | None]] = {}
        self._aliased = 0  # how many were aliased when these were found

    def key(self, name: bytes) -> bytes:
        """The name of a variable in the state: that of a routine's own has its routine before it."""
        if not self.active:
            return name
        own = self._own(self.active[-1]).get(name)
        if own is not None:
            return own[0]
        return self.active[-1].name + b"/" + name if b" " in name else name  # of a loop

    def look(self, name: bytes, state: ProgramState) -> Typed:
        """Value and type of a name."""
        key, kind, unknown = self._meaning(name)
        if unknown is not None:
            return unknown, b""
        value = state.values.get(key)
        if value is not None:
            return value, kind
        if key != name:
            return UnknownData(f"{name.decode('latin-1')} has no value yet"), b""
        return self._data.look(name)

    def _meaning(self, name: bytes) -> tuple[bytes, bytes, UnknownData | None]:
        """Key in the state and type of a name in the routine that runs, and why it is never known there, if so."""
        routine = self.active[-1].name if self.active else b""
        if self._aliased != len(self.aliased):  # there are new ones
            self._aliased = len(self.aliased)
            self._meanings.clear()
        found = self._meanings.get((routine, name))
        if found is None:
            key = self.key(name)
            lost = self._lost(name, key)
            unknown = None if lost is None else UnknownData(f"{name.decode('latin-1')} {lost}")
            found = self._meanings[routine, name] = key, self._type(name, key), unknown
        return found

    def _lost(self, name: bytes, key: bytes) -> str | None:
        if name in self._usage.later:
            return "is assigned where the flow does not show it"
        if key in self.aliased:
            return "has a second name in a routine that changes it"
        own = key != name or name not in self._data or self._data.is_constant(name)
        return "may be set by SetDataVal" if self._usage.set_by_name and not own else None

    def find_aliases(
        self, routine: RapidRoutine, shared: Iterable[tuple[bytes, set[bytes]]], reach: Reach
    ) -> None:
        """Data that a routine, or what it calls, knows by two names, and changes by one of them; ``shared``: its
        parameters that are data of the caller, and the names of these."""
        before = routine.name + b"/"
        other: dict[bytes, bytes] = {}
        for parameter, names in shared:
            if parameter in reach.assigned:
                self._usage.written |= names
            for name in names:
                key = self.key(name)
                changed = not reach.assigned.isdisjoint((name, parameter))
                if key in self.aliased or (key == name and name in reach.mentioned and changed):
                    self.aliased |= {key, before + parameter}
                if key in other and not reach.assigned.isdisjoint((parameter, other[key])):
                    self.aliased |= {key, before + parameter, before + other[key]}
                other[key] = parameter

    def _own(self, routine: RapidRoutine) -> dict[bytes, tuple[bytes, bytes]]:
        """The routine's own names -> key in the state, type."""
        names = self._of.get(routine.name)
        if names is None:
            before = routine.name + b"/"
            names = {one.name: (before + one.name, one.type) for one in routine.parameters}
            loops: set[bytes] = set()
            jumps = False
            for statement in walk(routine.body):
                if isinstance(statement, DataDeclaration):
                    names[statement.name] = (before + statement.name, statement.type)
                elif isinstance(statement, For):
                    loops.add(statement.name)
                jumps = jumps or isinstance(statement, Goto)
            if jumps:  # it may leave a loop, whose variable is not the one of this name any more
                self.aliased |= {names[name][0] for name in loops & names.keys()}
            names |= {name: (before + name, b"NUM") for name in loops}
            self._of[routine.name] = names
        return names

    def _type(self, name: bytes, key: bytes) -> bytes:
        if key == name:
            return self._data.type_of(name)
        return b"NUM" if b" " in name else self._own(self.active[-1])[name][1]
