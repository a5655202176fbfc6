"""What a name means in a routine: data of its own, of the module, or of the controller."""

from __future__ import annotations

from postproc.languages.rapid.declared_data import DeclaredData, Usage, walk
from postproc.languages.rapid.evaluation import Typed
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.syntax_tree import DataDeclaration, For, RapidRoutine
from postproc.languages.rapid.values import UnknownData


class RoutineNames:
    """Of the routines that run; the last of ``active`` is the one whose statements are run."""

    def __init__(self, data: DeclaredData, usage: Usage) -> None:
        self.active: list[RapidRoutine] = []
        self._data, self._usage = data, usage
        self._of: dict[bytes, dict[bytes, tuple[bytes, bytes]]] = {}

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
        if name in self._usage.later:
            return UnknownData(f"{name.decode('latin-1')} is assigned in a trap or an error handler"), b""
        key = self.key(name)
        value = state.values.get(key)
        if value is not None:
            return value, self._type(name, key)
        if key != name:
            return UnknownData(f"{name.decode('latin-1')} has no value yet"), b""
        return self._data.look(name)

    def _own(self, routine: RapidRoutine) -> dict[bytes, tuple[bytes, bytes]]:
        """The routine's own names -> key in the state, type."""
        names = self._of.get(routine.name)
        if names is None:
            before = routine.name + b"/"
            names = {one.name: (before + one.name, one.type) for one in routine.parameters}
            for statement in walk(routine.body):
                if isinstance(statement, DataDeclaration):
                    names[statement.name] = (before + statement.name, statement.type)
                elif isinstance(statement, For):
                    names[statement.name] = (before + statement.name, b"NUM")
            self._of[routine.name] = names
        return names

    def _type(self, name: bytes, key: bytes) -> bytes:
        if key == name:
            return self._data.type_of(name)
        return b"NUM" if b" " in name else self._own(self.active[-1])[name][1]
