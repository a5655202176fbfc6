"""What one reading of a program works on, shared by the parts of the interpreter."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.dialects.krl.data import Declarations
from postproc.dialects.krl.lexing import Statement
from postproc.dialects.krl.rows import HELP, Rows
from postproc.dialects.krl.state import Frames, Source, State
from postproc.dialects.krl.survey import Block, Routine, Survey
from postproc.document import Document
from postproc.findings import Finding


@dataclass(eq=False)
class Open:
    """A block that is open: the state at its begin, and where its branches so far may have left the robot."""

    block: Block
    entry: State
    sources: frozenset[Source] = frozenset()


@dataclass(eq=False)
class Run:
    """``mentioned``: names that code reads, other than as the target of a motion.  ``root_set``: the line, if any, from
    which on the program itself says where the robot stands in the world."""

    document: Document
    survey: Survey
    declarations: Declarations
    has_tcp_mode: bool
    rows: Rows
    state: State = field(default_factory=State)
    frames: Frames = field(default_factory=Frames)
    stack: list[Open] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    mentioned: set[bytes] = field(default_factory=set)
    told: set[tuple[str, str]] = field(default_factory=set)
    root_set: int | None = None

    @property
    def routine(self) -> Routine | None:
        block = self.stack[0].block if self.stack else None
        return block if isinstance(block, Routine) else None

    def tell(self, code: str, message: str, statement: Statement) -> None:
        """Notes a finding; the same words are told once, at their first place."""
        if (code, message) in self.told:
            return
        self.told.add((code, message))
        line, column = self.document.place(statement.at)
        self.findings.append(
            Finding(code, message, str(self.document.path), line, column, HELP.get(code, ""))
        )

    def forget(self, effects: set[str | bytes], why: str) -> None:
        """Makes unknown what ``effects`` name.  A variable that is forgotten may still hold any value that it had,
        so none of its values can be changed for one motion alone."""
        self.mentioned |= self.state.forget(effects, why, self.has_tcp_mode)
