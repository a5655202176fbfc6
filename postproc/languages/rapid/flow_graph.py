"""The statements of a routine as blocks that run from their first to their last, and where each goes on."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable
from dataclasses import dataclass, field

from postproc.languages.core.motion_sources import Meeting
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

Step = DataDeclaration | AssignmentStatement | Instruction | PlainMotions | Remark | NotUnderstood
"""A statement that goes on with the next one."""


@dataclass(slots=True)
class FlowBlock:
    """``condition``: None goes on with ``follow``; else with ``follow`` where it holds and ``otherwise`` where not.

    follow: the next block, -1 for the end of the routine, -2 for what does not come back.
    """

    steps: list[Step] = field(default_factory=list)
    condition: Expression | None = None
    follow: int = -1
    otherwise: int = -1


class FlowGraph:
    """The blocks of a routine; the first one is where it starts.  ``missing``: a label that no statement has;
    ``loops``: block with the condition of a loop -> the block after it; between them are those of its body;
    ``meetings``: of places where paths meet."""

    def __init__(self, body: tuple[Statement, ...]) -> None:
        self.blocks: list[FlowBlock] = [FlowBlock()]
        self.missing = False
        self.loops: dict[int, int] = {}
        self.meetings: defaultdict[Hashable, Meeting] = defaultdict(Meeting)
        self._depth = 0  # loops in each other
        self._labels: dict[bytes, int] = {}
        self._jumps: list[tuple[FlowBlock, bytes]] = []
        self._body(body)
        for block, label in self._jumps:
            block.follow = self._labels.get(label, -2)
            self.missing |= label not in self._labels

    @property
    def is_structured(self) -> bool:
        """Whether only loops go back, and nothing jumps into them."""
        return not self._jumps

    def _new(self) -> int:
        self.blocks.append(FlowBlock())
        return len(self.blocks) - 1

    def _go_on(self) -> int:
        """A new block after the last one."""
        last = self.blocks[-1]
        last.follow = self._new()
        return last.follow

    def _body(self, statements: tuple[Statement, ...]) -> None:
        """Adds statements to the last block and new ones."""
        for statement in statements:
            match statement:
                case If():
                    self._if(statement)
                case While():
                    self._loop(statement.condition, statement.body, [])
                case For():
                    self._for(statement)
                case Test():
                    self._test(statement)
                case Label():
                    if statement.name:
                        self.missing |= statement.name in self._labels
                        self._labels[statement.name] = self._go_on()
                case Goto():
                    self._jumps.append((self.blocks[-1], statement.name))
                    self._new()
                case Leave():
                    self.blocks[-1].follow = -1 if statement.word == b"RETURN" else -2
                    self._new()
                case _:
                    self.blocks[-1].steps.append(statement)

    def _if(self, statement: If) -> None:
        ends: list[FlowBlock] = []
        for condition, body in statement.branches:
            head = self.blocks[-1]
            head.condition = condition
            head.follow = self._new()
            self._body(body)
            ends.append(self.blocks[-1])
            head.otherwise = self._new()
        self._body(statement.otherwise)
        self._meet(ends)

    def _meet(self, ends: list[FlowBlock]) -> None:
        after = self._go_on()
        for block in ends:
            block.follow = after

    def _loop(self, condition: Expression, body: tuple[Statement, ...], last: list[Step]) -> None:
        head = self.blocks[self._go_on()]
        at = len(self.blocks) - 1
        head.condition = condition
        head.follow = self._new()
        self._body(body)
        self.blocks[-1].steps += last
        self.blocks[-1].follow = at
        head.otherwise = self.loops[at] = self._new()

    def _for(self, statement: For) -> None:
        """last := ..; step := ..; i := first; WHILE i is not beyond last DO ...; i := i + step; ENDWHILE.  Without a
        step it counts down where the first value exceeds the last one."""
        at = statement.start
        name, last, step = (Name(word, at, at) for word in (statement.name, *loop_names(self._depth)))
        sense = statement.step or OperatorExpression(SENSE, (statement.first, statement.last), at, at)
        test = OperatorExpression(GOES_ON, (name, last, step), at, at)
        more = AssignmentStatement(name, OperatorExpression(b"+", (name, step), at, at), at, at)
        start = ((last, statement.last), (step, sense), (name, statement.first))
        self.blocks[-1].steps += [AssignmentStatement(target, value, at, at) for target, value in start]
        self._depth += 1
        self._loop(test, statement.body, [more])
        self._depth -= 1
        end = [AssignmentStatement(target, NOTHING, at, at) for target in (name, last, step)]
        self.blocks[-1].steps += end  # they are of the loop alone

    def _test(self, statement: Test) -> None:
        ends: list[FlowBlock] = []
        for values, body in statement.cases:
            at = statement.start
            condition: Expression = OperatorExpression(b"=", (statement.value, values[0]), at, at)
            for value in values[1:]:
                other = OperatorExpression(b"=", (statement.value, value), at, at)
                condition = OperatorExpression(b"OR", (condition, other), at, at)
            head = self.blocks[-1]
            head.condition = condition
            head.follow = self._new()
            self._body(body)
            ends.append(self.blocks[-1])
            head.otherwise = self._new()
        self._body(statement.otherwise)
        self._meet(ends)
