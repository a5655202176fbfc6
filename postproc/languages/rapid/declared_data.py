"""The data that a module declares, before its routines run, and who reads or assigns it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from postproc.languages.core.reach import reached
from postproc.languages.rapid.array_items import repeated
from postproc.languages.rapid.data_types import RECORDS, SPEEDS, STOP_KINDS, STOP_POINTS, ZONES, Components
from postproc.languages.rapid.evaluation import Evaluator, Typed
from postproc.languages.rapid.instructions import (
    ANY_PROCEDURE,
    HARMLESS,
    MOTIONS,
    SETS_BY_NAME,
    WRITERS,
    is_motion,
    sort_arguments,
)
from postproc.languages.rapid.motion_facts import is_direct
from postproc.languages.rapid.parsing import declaration_at
from postproc.languages.rapid.syntax_tree import (
    Argument,
    AssignmentStatement,
    Component,
    DataDeclaration,
    For,
    FunctionCall,
    If,
    Index,
    Instruction,
    Label,
    Module,
    Name,
    NotUnderstood,
    PlainMotions,
    RapidRoutine,
    Statement,
    StringLiteral,
    Test,
    While,
)
from postproc.languages.rapid.values import FALSE, TRUE, GroupValue, Leaf, UnknownData, Value, number_of

LARGEST = 200_000
"""Elements of an array without values that are looked at one by one."""


def _predefined() -> dict[bytes, Typed]:
    found: dict[bytes, Typed] = {}
    for name, speed in SPEEDS.items():
        found[name] = (GroupValue((Leaf(speed),)), b"")
    for name, zone in ZONES.items():
        found[name] = (GroupValue((TRUE if name == b"FINE" else FALSE, Leaf(zone))), b"")
    for name, kind in STOP_POINTS.items():
        found[name] = (GroupValue((Leaf(kind),)), b"")
    for name, kind in STOP_KINDS.items():
        found[name] = (Leaf(kind), b"NUM")
    return found


PREDEFINED: Mapping[bytes, Typed] = _predefined()


class DeclaredData:
    """Names of the module level: type, and value where it is a constant or before anything is assigned."""

    def __init__(self, module: Module, shadowed: frozenset[bytes], raw: bytes) -> None:
        self.lines: dict[bytes, int] = {}
        self._raw, self._targets = raw, module.targets
        self._declarations: dict[bytes, DataDeclaration] = {}
        self._values: dict[bytes, Value] = {}
        self.evaluator = Evaluator(self.look, module.records, shadowed)
        self.records: Mapping[bytes, Components] = module.records
        for one in module.declarations:
            twice = one.name in self._declarations
            self._declarations[one.name] = one
            self.lines[one.name] = one.start
            if twice:
                self._values[one.name] = UnknownData(f"{_shown(one.name)} is declared twice")
        for unread_statements in module.unread_statements:
            for name in unread_statements.names & (self._declarations.keys() | self._targets.keys()):
                self._values[name] = UnknownData(f"a line with {_shown(name)} is not understood")

    def __contains__(self, name: bytes) -> bool:
        return name in self._declarations or name in self._targets

    def _declaration(self, name: bytes) -> DataDeclaration | None:
        """That of a name; None where the module does not declare it."""
        one = self._declarations.get(name)
        if one is None and name in self._targets:
            one = self._declarations[name] = declaration_at(self._raw, self._targets[name])
        return one

    def is_constant(self, name: bytes) -> bool:
        return self.kind_of(name) == b"CONST"

    def kind_of(self, name: bytes) -> bytes:
        """CONST, PERS or VAR; b"" of a name that is not of the module."""
        declaration = self._declaration(name)
        return b"" if declaration is None else declaration.kind

    def type_of(self, name: bytes) -> bytes:
        """The type of a name of the module, b"" of another one."""
        declaration = self._declaration(name)
        return b"" if declaration is None else declaration.type

    def look(self, name: bytes) -> Typed:
        """Value and type of a name of the module, or of the controller."""
        declaration = self._declaration(name)
        if declaration is None:
            if name in PREDEFINED:
                return PREDEFINED[name]
            reason = f"{_shown(name)} is not declared in this file" if name else "it is computed"
            return UnknownData(reason, name), b""
        if name not in self._values:
            self._values[name] = UnknownData(f"{_shown(name)} depends on itself")
            self._values[name] = first_value(declaration, self.evaluator)
        return self._values[name], declaration.type


def first_value(declaration: DataDeclaration, evaluator: Evaluator) -> Value:
    """The value of a declaration."""
    if declaration.value is not None:
        return evaluator.value(declaration.value)
    shown = _shown(declaration.name)
    if declaration.kind != b"VAR":
        return UnknownData(f"{shown} has no value in this file")
    value = _zero(declaration.type, evaluator, 0)
    size = 1.0
    for extent in reversed(declaration.extent):
        count = number_of(evaluator.value(extent))
        if count is None or not 1 <= count <= LARGEST or count != int(count) or size * count > LARGEST:
            return UnknownData(f"the size of {shown} is not known")
        size *= count
        value = GroupValue(repeated(value, int(count)))
    return value


def _zero(kind: bytes, evaluator: Evaluator, depth: int) -> Value:
    """What a variable of a type is without a value."""
    if kind in (b"NUM", b"DNUM"):
        return Leaf(0.0)
    if kind == b"BOOL":
        return FALSE
    if kind == b"STRING":
        return Leaf(b"")
    parts = RECORDS.get(kind) or evaluator.records.get(kind)
    if parts is None or depth > 8:
        return UnknownData(f"the type {_shown(kind)} is not known")
    return GroupValue(tuple(_zero(part, evaluator, depth + 1) for _, part in parts))


class Usage:
    """Names in the routines: ``assigned`` anywhere, ``later``: not shown by the flow, ``read``: otherwise than
    as the point of a motion; ``calls``, ``assigned_in``, ``mentioned_in``: routine -> what it may call, assigns, and
    has in it; ``written``: left of := anywhere; ``moves``: routines in which the robot may move; ``set_by_name``: data
    is set that a string names; ``aside``: routines that traps, error handlers and synchronous calls of motions
    (MoveLSync) run; ``strays``: one of these may move the robot, and does not keep the path (StorePath)."""

    def __init__(self, module: Module) -> None:
        self.assigned: set[bytes] = set()
        self.later: set[bytes] = set()
        self.read: set[bytes] = set()
        self.calls: dict[bytes, set[bytes]] = {}
        self.assigned_in: dict[bytes, set[bytes]] = {}
        self.mentioned_in: dict[bytes, set[bytes]] = {}
        self.set_by_name = False
        self.moves: set[bytes] = set()
        self.written: set[bytes] = set()
        self._called: set[bytes] = set()
        self._set: set[bytes] = set()
        self._mentioned: set[bytes] = set()
        self._module_data = {declaration.name for declaration in module.declarations} | module.targets.keys()
        self._own = {routine.name for routine in module.routines}
        self._copying = {r.name for r in module.routines if not any(p.mode for p in r.parameters)}
        for one in module.declarations:
            self._expressions(one.value, one.extent)
        for unread_statements in module.unread_statements:
            self.read |= unread_statements.names
        self._synchronous: set[bytes] = set()
        aside = [routine.name for routine in module.routines if routine.kind == b"TRAP"]
        handlers_move = False
        for routine in module.routines:
            self._called, self._set, self._mentioned = set(), set(), set()
            errors, others = _of_errors(routine.handlers)
            for statement in walk(others):
                self._statement(statement, routine)
            self.moves.discard(routine.name)
            self._called = set()
            for statement in walk(errors):
                self._statement(statement, routine)
            handlers_move |= routine.name in self.moves and b"STOREPATH" not in self._called
            self.later |= self._set
            aside += self._called
            for statement in walk(routine.body):
                self._statement(statement, routine)
            self.calls.setdefault(routine.name, set()).update(self._called)
            self.assigned_in.setdefault(routine.name, set()).update(self._set)
            self.mentioned_in.setdefault(routine.name, set()).update(self._mentioned)
            self.assigned |= self._set
        self.aside = self.reached([*aside, *self._synchronous])
        for name in self.aside:
            self.later |= self.assigned_in.get(name, set())
        moving = (name for name in self.aside & self.moves if b"STOREPATH" not in self.calls.get(name, ()))
        self.strays = handlers_move or any(moving)

    def reached(self, names: Iterable[bytes]) -> set[bytes]:
        """What calls of routines may run: these, and what they call."""
        return reached(names, lambda one: self._own if self.is_late(one) else self.calls.get(one, ()))

    @staticmethod
    def is_late(name: bytes) -> bool:
        """Whether a call is one whose procedure a string names."""
        return name.startswith(ANY_PROCEDURE)

    def _statement(self, statement: Any, routine: RapidRoutine) -> None:
        match statement:
            case DataDeclaration():
                self._expressions(statement.value, statement.extent)
            case AssignmentStatement():
                target = statement.target
                while isinstance(target, Index | Component):
                    if isinstance(target, Index):
                        self._expressions(*target.indices)
                    target = target.base
                if isinstance(target, Name):
                    self.written.add(target.name)
                    self._set.add(target.name)
                    self._mentioned.add(target.name)
                self._expressions(statement.value)
            case Instruction():
                self._instruction(statement, routine)
            case PlainMotions():
                self._instruction(statement.first, routine)
            case NotUnderstood():
                self._mentioned |= statement.names
                if not is_motion(statement.first):
                    self._set |= statement.names
                self.read |= statement.names
            case For():
                self._set.add(statement.name)
                if statement.name in self._module_data:
                    self.later.add(statement.name)  # the name is not always that of the loop
                self._expressions(statement.first, statement.last, statement.step)
            case _:
                self._expressions(*_conditions(statement))

    def _instruction(self, statement: Instruction, routine: RapidRoutine) -> None:
        form = MOTIONS.get(statement.name)
        sorted_arguments = None if form is None else sort_arguments(form, statement.arguments)
        points = () if sorted_arguments is None else sorted_arguments.points
        if is_motion(statement.name):
            self.moves.add(routine.name)
            if form is not None and form.calls:
                self._synchronous.add(self.synchronous_call(statement))
        elif statement.name in SETS_BY_NAME:
            self._set_by_name(statement)
        elif statement.name not in HARMLESS or statement.name in WRITERS or statement.name in self._own:
            self._called.add(statement.name)
            if statement.name not in self._copying:
                self._set |= names_in(statement.arguments)
            if statement.name not in WRITERS and statement.name not in self._own:
                self.moves.add(routine.name)  # it may, or what it calls does
        for argument in statement.arguments:
            if argument in points and is_direct(argument):
                expression = argument.value
                while isinstance(expression, Index):
                    self._expressions(*expression.indices)
                    expression = expression.base
                self._mentioned |= names_in((argument,))
            else:
                self._expressions(argument.value)

    @staticmethod
    def synchronous_call(statement: Instruction) -> bytes:
        """The routine that a motion calls at its end, which its last argument names."""
        name = statement.arguments[-1].value if statement.arguments else None
        return name.value.upper() if isinstance(name, StringLiteral) else ANY_PROCEDURE[0]

    def _set_by_name(self, statement: Instruction) -> None:
        name = statement.arguments[0].value if statement.arguments else None
        if statement.name == b"SETDATAVAL" and isinstance(name, StringLiteral):
            self.later.add(name.value.upper())
            self._set.add(name.value.upper())
        else:
            self.set_by_name = True

    def _expressions(self, *values: Any) -> None:
        """Takes up the names of expressions, which are read, and functions, which are called."""
        pending = list(values)
        while pending:
            one = pending.pop()
            if isinstance(one, Name):
                self.read.add(one.name)
                self._mentioned.add(one.name)
            elif isinstance(one, FunctionCall):
                self._called.add(one.name)
                pending += one.arguments
            elif isinstance(one, tuple):
                pending += one


def _of_errors(handlers: tuple[Statement, ...]) -> tuple[tuple[Statement, ...], tuple[Statement, ...]]:
    """The statements of ERROR, and those of BACKWARD and UNDO, after which the program does not go on."""
    parts: tuple[list[Statement], list[Statement]] = [], []
    is_other = False
    for one in handlers:
        if isinstance(one, Label) and one.name in (b"ERROR", b"BACKWARD", b"UNDO"):
            is_other = one.name != b"ERROR"
        parts[is_other].append(one)
    return tuple(parts[0]), tuple(parts[1])


def _conditions(statement: Any) -> Iterator[Any]:
    for name in ("condition", "value"):
        if hasattr(statement, name):
            yield getattr(statement, name)
    for condition, _ in getattr(statement, "branches", ()):
        yield condition
    for values, _ in getattr(statement, "cases", ()):
        yield values


_WITH_BLOCKS = (If, While, For, Test)


def walk(body: tuple[Any, ...]) -> Iterator[Any]:
    """All statements of a body, with those of its blocks."""
    for statement in body:
        yield statement
        if not isinstance(statement, _WITH_BLOCKS):
            continue
        for _, inner in getattr(statement, "branches", ()):
            yield from walk(inner)
        for _, inner in getattr(statement, "cases", ()):
            yield from walk(inner)
        yield from walk(getattr(statement, "otherwise", ()))
        yield from walk(getattr(statement, "body", ()))


def names_in(arguments: tuple[Argument, ...]) -> set[bytes]:
    """Variables that a call may change: those that are arguments themselves, or of which a part is."""
    found = set()
    for argument in arguments:
        expression = argument.value
        while isinstance(expression, Index | Component):
            expression = expression.base
        if isinstance(expression, Name):
            found.add(expression.name)
    return found


def _shown(name: bytes) -> str:
    return name.decode("latin-1")[:40]
