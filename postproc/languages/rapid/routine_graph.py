"""The statements of a routine of RAPID as the blocks of its flow."""

from __future__ import annotations

from collections.abc import Iterable

from postproc.languages.core.flow_graph import END, GONE, FlowGraph
from postproc.languages.rapid.syntax_tree import (
    GOES_ON,
    SENSE,
    AssignmentStatement,
    DataDeclaration,
    Expression,
    For,
    Goto,
    If,
    Instruction,
    Label,
    Leave,
    Name,
    NotUnderstood,
    NumberLiteral,
    OperatorExpression,
    PlainMotions,
    Remark,
    Statement,
    Test,
    While,
    loop_names,
)

NOTHING = Name(b"", 0, 0)
"""A name that nothing has: its value is not known."""

RapidStep = DataDeclaration | AssignmentStatement | Instruction | PlainMotions | Remark | NotUnderstood
"""A statement that goes on with the next one."""


class RoutineGraph(FlowGraph[RapidStep, Expression, bytes]):
    """The blocks of a routine."""

    def __init__(self, body: tuple[Statement, ...]) -> None:
        super().__init__()
        self._depth = 0  # loops in each other
        self._body(body)
        self.link()

    def _body(self, statements: tuple[Statement, ...]) -> None:
        for statement in statements:
            match statement:
                case If():
                    self._arms(statement.branches, statement.otherwise)
                case While():
                    head = self.loop(statement.condition)
                    self._body(statement.body)
                    self.end_loop(head)
                case For():
                    self._for(statement)
                case Test():
                    arms = ((_is_one_of(statement, values), body) for values, body in statement.cases)
                    self._arms(arms, statement.otherwise)
                case Label():
                    if statement.name:
                        self.label(statement.name)
                case Goto():
                    self.jump(statement.name)
                case Leave():
                    self.leave(END if statement.word == b"RETURN" else GONE)
                case _:
                    self.step(statement)

    def _arms(
        self, arms: Iterable[tuple[Expression, tuple[Statement, ...]]], otherwise: tuple[Statement, ...]
    ) -> None:
        """The bodies of which the first one runs whose condition holds, else ``otherwise``."""
        ends = []
        for condition, body in arms:
            head = self.branch(condition)
            self._body(body)
            ends.append(self.otherwise(head))
        self._body(otherwise)
        self.meet(ends)

    def _for(self, statement: For) -> None:
        """last := ..; step := ..; i := first; WHILE i is not beyond last DO ...; i := i + step; ENDWHILE.  Without a
        step it counts down where the first value exceeds the last one.  Numbers stand for themselves."""
        at = statement.start
        name = Name(statement.name, at, at)
        kept: list[tuple[Name, Expression]] = []
        last, step = (
            _kept(value, Name(word, at, at), kept)
            for word, value in zip(
                loop_names(self._depth), (statement.last, statement.step or _sense(statement)), strict=True
            )
        )
        more = OperatorExpression(b"+", (name, step), at, at)
        self._assign(at, *kept, (name, statement.first))
        self._depth += 1
        head = self.loop(OperatorExpression(GOES_ON, (name, last, step), at, at))
        self._body(statement.body)
        self._assign(at, (name, more))
        self.end_loop(head)
        self._depth -= 1
        self._assign(
            at, *((target, NOTHING) for target in (name, *(one for one, _ in kept)))
        )  # of the loop alone

    def _assign(self, at: int, *pairs: tuple[Name, Expression]) -> None:
        for target, value in pairs:
            self.step(AssignmentStatement(target, value, at, at))


def _sense(statement: For) -> Expression:
    """1 or -1, as a FOR without a step counts."""
    first, last, at = statement.first, statement.last, statement.start
    if isinstance(first, NumberLiteral) and isinstance(last, NumberLiteral):
        return NumberLiteral(1.0 if first.value <= last.value else -1.0, at, at)
    return OperatorExpression(SENSE, (first, last), at, at)


def _kept(value: Expression, name: Name, kept: list[tuple[Name, Expression]]) -> Expression:
    """A number itself; the name under which any other value is kept while a loop runs, added to ``kept``."""
    if isinstance(value, NumberLiteral):
        return value
    kept.append((name, value))
    return name


def _is_one_of(statement: Test, values: tuple[Expression, ...]) -> Expression:
    """The condition of a CASE."""
    at = statement.start
    condition, *others = (OperatorExpression(b"=", (statement.value, value), at, at) for value in values)
    for other in others:
        condition = OperatorExpression(b"OR", (condition, other), at, at)
    return condition
