"""What a RAPID module is made of: expressions, statements and routines, each with its place in the bytes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from numpy.typing import NDArray


class NumberLiteral(NamedTuple):
    value: float
    start: int
    stop: int


class StringLiteral(NamedTuple):
    """A string; its value without the quotes."""

    value: bytes
    start: int
    stop: int


class Name(NamedTuple):
    """A name in capitals."""

    name: bytes
    start: int
    stop: int


class Index(NamedTuple):
    base: Expression
    indices: tuple[Expression, ...]
    start: int
    stop: int


class Component(NamedTuple):
    base: Expression
    name: bytes
    start: int
    stop: int


class Aggregate(NamedTuple):
    items: tuple[Expression, ...]
    start: int
    stop: int


class Argument(NamedTuple):
    """``name``: of an optional argument (\\WObj), b"" of a required one; ``value``: None of a switch."""

    name: bytes
    value: Expression | None
    start: int
    stop: int


class FunctionCall(NamedTuple):
    name: bytes
    arguments: tuple[Argument, ...]
    start: int
    stop: int


class OperatorExpression(NamedTuple):
    """One or two operands."""

    operator: bytes
    operands: tuple[Expression, ...]
    start: int
    stop: int


class Star(NamedTuple):
    """A target that is stored where the text does not show it."""

    start: int
    stop: int


Expression = (
    NumberLiteral
    | StringLiteral
    | Name
    | Index
    | Component
    | Aggregate
    | FunctionCall
    | OperatorExpression
    | Star
)


SENSE, GOES_ON = b"sense of a FOR", b"a FOR goes on"
"""Operators of what FOR does by itself: 1 or -1 of the first and the last value; whether a value is not beyond the last
one."""
AND_AFTER_NOT = b"AND after NOT"
"""Operator of NOT a AND b: whether NOT is of a alone or of both is not stated alike everywhere."""


@dataclass(frozen=True, slots=True)
class DataDeclaration:
    """``kind``: CONST, PERS or VAR; ``extent``: of an array, () for others."""

    kind: bytes
    type: bytes
    name: bytes
    extent: tuple[Expression, ...]
    value: Expression | None
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class AssignmentStatement:
    target: Expression
    value: Expression
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Instruction:
    """A motion, a setting, or the call of a procedure."""

    name: bytes
    arguments: tuple[Argument, ...]
    start: int
    stop: int


@dataclass(frozen=True, slots=True, eq=False)
class PlainPlaces:
    """Where K motions that are alike are: starts (K,): offsets of the statements; from there are counted targets (K,):
    the ends of their targets, stops (K,): their ends, literals, literal_stops (K, 7): those of x, y, z, q1..q4;
    ``named``: these are in the declarations of the targets."""

    starts: NDArray[Any]
    targets: NDArray[Any]
    stops: NDArray[Any]
    literals: NDArray[Any]
    literal_stops: NDArray[Any]
    named: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class PlainMotions:
    """K motions that follow each other, one a line, and differ in the numbers of their targets alone.

    first: the statement of the first one.  values (K, 7): x, y, z [mm], q1..q4.  extras (U, 10): configurations and
    external axes; which (K,): the row of ``extras`` of each.  end: of the last line.
    """

    first: Instruction
    places: PlainPlaces
    values: NDArray[Any]
    extras: NDArray[Any]
    which: NDArray[Any]
    end: int

    def __len__(self) -> int:
        return len(self.values)

    @property
    def start(self) -> int:
        return self.first.start

    @property
    def last(self) -> int:
        """Offset of the last motion."""
        return int(self.places.starts[-1])


@dataclass(frozen=True, slots=True)
class If:
    branches: tuple[tuple[Expression, tuple[Statement, ...]], ...]
    otherwise: tuple[Statement, ...]
    start: int


@dataclass(frozen=True, slots=True)
class For:
    name: bytes
    first: Expression
    last: Expression
    step: Expression | None
    body: tuple[Statement, ...]
    start: int


def loop_names(depth: int) -> tuple[bytes, bytes]:
    """What no program can name, for the blank in it: the last value and the step of a loop in ``depth`` others, which
    are computed once."""
    return b"last of %d" % depth, b"step of %d" % depth


def presence_name(parameter: bytes) -> bytes:
    """What no program can name either: whether a call gives an optional ``parameter``."""
    return b"presence of " + parameter


@dataclass(frozen=True, slots=True)
class While:
    condition: Expression
    body: tuple[Statement, ...]
    start: int


@dataclass(frozen=True, slots=True)
class Test:
    value: Expression
    cases: tuple[tuple[tuple[Expression, ...], tuple[Statement, ...]], ...]
    otherwise: tuple[Statement, ...]
    start: int


@dataclass(frozen=True, slots=True)
class Label:
    name: bytes
    start: int


@dataclass(frozen=True, slots=True)
class Goto:
    name: bytes
    start: int


@dataclass(frozen=True, slots=True)
class Leave:
    """``word``: RETURN, or what ends the program, its cycle or the error handler: EXIT, EXITCYCLE, RAISE, RETRY,
    TRYNEXT."""

    value: Expression | None
    word: bytes
    start: int


@dataclass(frozen=True, slots=True)
class Remark:
    """A comment; ``alone`` on its line."""

    text: str
    alone: bool
    start: int


@dataclass(frozen=True, slots=True)
class NotUnderstood:
    """A statement of which a token is consumed by no rule; ``names``: that occur in it; ``first``: its first token."""

    names: frozenset[bytes]
    first: bytes
    start: int
    stop: int


Statement = (
    DataDeclaration
    | AssignmentStatement
    | Instruction
    | PlainMotions
    | If
    | For
    | While
    | Test
    | Label
    | Goto
    | Leave
    | Remark
    | NotUnderstood
)


class RoutineParameter(NamedTuple):
    """``mode``: b"" (a copy), INOUT, VAR or PERS (the caller's own); ``optional``: written with a backslash."""

    mode: bytes
    type: bytes
    name: bytes
    optional: bool


@dataclass(slots=True)
class RapidRoutine:
    """``kind``: PROC, FUNC or TRAP; ``handlers``: statements after ERROR, BACKWARD and UNDO, each of which
    an empty label precedes; ``broken``: offset at
    which its structure is not understood, -1 where it is."""

    kind: bytes
    name: bytes
    parameters: tuple[RoutineParameter, ...]
    body: tuple[Statement, ...]
    handlers: tuple[Statement, ...]
    local: bool
    start: int
    broken: int = -1


@dataclass(slots=True)
class Module:
    """What a file declares.  ``records``: type -> (component, type); ``name_stop``: where the line of MODULE goes on,
    -1 without one; ``unread_statements``: places between routines that are not understood; ``targets``: name -> offset
    of a declaration that is in no other list."""

    declarations: list[DataDeclaration] = field(default_factory=list)
    routines: list[RapidRoutine] = field(default_factory=list)
    records: dict[bytes, tuple[tuple[bytes, bytes], ...]] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)
    unread_statements: list[NotUnderstood] = field(default_factory=list)
    name_stop: int = -1
    unclosed: int = -1
    targets: Mapping[bytes, int] = field(default_factory=dict)
