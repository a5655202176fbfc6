"""The statements of a TP program as the blocks of its flow."""

from __future__ import annotations

from typing import NamedTuple

from postproc.languages.core.flow_graph import END, FlowBlock, FlowGraph
from postproc.languages.tp.tp_statements import (
    BlockElse,
    BlockEnd,
    BlockStart,
    ConditionalStatement,
    JumpStatement,
    LabelStatement,
    LoopEnd,
    LoopStart,
    OtherStatement,
    ProgramEnd,
    TimeoutStatement,
    TpMove,
    TpStatement,
)

MOST_JUMPS = 50_000
"""Places to which computed jumps may lead, all together."""
UNDECIDED = ConditionalStatement(None, OtherStatement())
"""A condition of which nothing is known."""


class TpStep(NamedTuple):
    """A statement, or what one does where its condition holds; ``at``: its index."""

    at: int
    one: TpStatement


class TpCondition(NamedTuple):
    at: int
    one: ConditionalStatement


class _Opened(NamedTuple):
    """An open IF, ELSE or FOR: its index, the block with its condition, and the last block before ELSE."""

    at: int
    head: FlowBlock[TpStep, TpCondition] | int
    end: FlowBlock[TpStep, TpCondition] | None = None


class StatementFlow(FlowGraph[TpStep, TpCondition, int]):
    """The blocks of a program.  ``problem``: index of a statement whose structure is not understood, and why; None
    where all is."""

    def __init__(self, statements: list[TpStatement]) -> None:
        super().__init__()
        self.statements = statements
        self.problem: tuple[int, str] | None = None
        self._opened: list[_Opened] = []
        self._wanted: list[tuple[int, int]] = []  # indices of statements, and labels to which they lead
        self._every = self._find_labels()
        self._computed = 0  # jumps
        for at, one in enumerate(statements):
            if self.problem is None:
                self._take(at, one)
        if self._opened:
            self._refuse(self._opened[-1].at, "a block that starts here has no end")
        if self._computed * len(self._every) > MOST_JUMPS:
            self._refuse(0, "too many computed jumps may lead to too many labels")
        known = set(self._every)
        for at, label in self._wanted:
            if label not in known:
                self._refuse(at, f"LBL[{label}] is not in the program")
        self.link()

    @property
    def is_structured(self) -> bool:
        return False

    def _find_labels(self) -> list[int]:
        found: dict[int, None] = {}
        for at, one in enumerate(self.statements):
            if isinstance(one, LabelStatement):
                if one.number in found:
                    self._refuse(at, f"LBL[{one.number}] is in the program twice")
                found[one.number] = None
        return list(found)

    def _refuse(self, at: int, why: str) -> None:
        if self.problem is None:
            self.problem = (at, why)

    def _take(self, at: int, one: TpStatement) -> None:
        match one:
            case LabelStatement():
                self.label(one.number)
            case JumpStatement():
                self._jump(at, one.label)
            case ProgramEnd():
                self.leave(END)
            case ConditionalStatement():
                head = self.branch(TpCondition(at, one))
                if isinstance(one.action, JumpStatement | ProgramEnd):
                    self._take(at, one.action)
                    self.otherwise(head)
                else:
                    self.step(TpStep(at, one.action))
                    self.meet([self.otherwise(head)])
            case BlockStart():
                self._opened.append(_Opened(at, self.branch(TpCondition(at, UNDECIDED))))
            case LoopStart():
                self._opened.append(_Opened(at, self.loop(TpCondition(at, UNDECIDED), [TpStep(at, one)])))
            case BlockElse() | BlockEnd() | LoopEnd():
                self._close(at, one)
            case _:
                self.step(TpStep(at, one))
                if isinstance(one, TimeoutStatement):
                    self._may_jump(at, one.label)
                elif isinstance(one, TpMove) and one.skip is not None:
                    self._may_jump(at, one.skip)

    def _close(self, at: int, one: BlockElse | BlockEnd | LoopEnd) -> None:
        opened = self._opened.pop() if self._opened else _Opened(at, -1)
        head, end = opened.head, opened.end
        if isinstance(one, LoopEnd):
            if isinstance(head, int) and head >= 0:
                self.end_loop(head)
            else:
                self._refuse(at, "ENDFOR has no FOR")
        elif isinstance(head, int) or (isinstance(one, BlockElse) and end is not None):
            self._refuse(at, "ELSE has no IF" if isinstance(one, BlockElse) else "ENDIF has no IF")
        elif isinstance(one, BlockElse):
            self._opened.append(_Opened(at, head, self.otherwise(head)))
        else:
            self.meet([self.otherwise(head) if end is None else end])

    def _jump(self, at: int, label: int | None) -> None:
        """JMP; None: to any label."""
        if label is not None:
            self._wanted.append((at, label))
            self.jump(label)
            return
        self._may_jump(at, None)
        self.leave(END)

    def _may_jump(self, at: int, label: int | None) -> None:
        self._computed += label is None
        if label is not None:
            self._wanted.append((at, label))
        self.may_jump(self._every if label is None else [label])
