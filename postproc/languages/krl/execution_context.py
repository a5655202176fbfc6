"""What one reading of a program works on, shared by the parts of the interpreter."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.languages.krl.data import Declarations
from postproc.languages.krl.expressions import Value, evaluate
from postproc.languages.krl.lexing import LOOPS, Statement
from postproc.languages.krl.modal_state import ZERO, FrameRegister, ModalState, Source
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.program_structure import Block, ProgramStructure, Routine
from postproc.languages.krl.statement_effects import Effects
from postproc.languages.krl.target import UnknownValue, known, shown
from postproc.languages.krl.variables import Entry, Variables
from postproc.languages.krl.vectorised import VectorisedLines

Item = Statement | VectorisedLines


@dataclass(eq=False)
class BlockFrame:
    """A block or call that is open.

    followed: it runs with values that are all known; else it is passed over once, and what it changes is forgotten.
    entry, mark, rows, notes, routine: what was before it (notes: number of annotations, comments, readings of the
    position, routines followed); sources: where its branches so far may have left the robot; counter: of a FOR: name,
    value, last value, step; back, returned, saved: of a call: where it goes on, which parameter comes back into which
    variable (name, path), and the entries that the caller's variables had; enters: a straight motion can be inserted
    before the header of a spline block.
    """

    block: Block
    followed: bool
    entry: ModalState
    mark: int
    rows: int
    notes: tuple[int, int, int, int] = (0, 0, 0, 0)
    sources: frozenset[Source] = frozenset()
    counter: tuple[bytes, int, int, int] | None = None
    back: int = -1
    returned: tuple[tuple[bytes, bytes, bytes], ...] = ()
    saved: tuple[tuple[bytes, Entry | None], ...] = ()
    routine: Routine | None = None
    enters: bool = False

    @property
    def repeats(self) -> bool:
        """A loop or a call that is followed."""
        return self.followed and (self.back >= 0 or self.block.word in LOOPS)


@dataclass(eq=False)
class ExecutionContext:
    """``mentioned``: names that code reads, other than as the target of a motion.  ``root_set``: the line, if any, from
    which on the program itself states where the robot is in the world.  ``later_since``: the line, if any, from which
    on an interrupt or a trigger may change base or tool.  ``routine``: the one that runs.
    ``walked``: it is passed over without a call that is known.  ``idle``: what no flow leads to is listed.
    ``has_tcp_mode``, ``has_turning``: some line names another interpolation mode, or another way of turning the tool,
    than the usual one.
    ``triggered``: a TRIGGER is between the last motion and here.  ``followed``: routines that ran.
    """

    document: Document
    code: list[Item]
    survey: ProgramStructure
    declarations: Declarations
    variables: Variables
    has_tcp_mode: bool
    has_turning: bool
    rows: MotionRows
    state: ModalState = field(default_factory=ModalState)
    frames: FrameRegister = field(default_factory=FrameRegister)
    stack: list[BlockFrame] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    mentioned: set[bytes] = field(default_factory=set)
    reported: set[tuple[str, str]] = field(default_factory=set)
    root_set: int | None = None
    later_since: int | None = None
    routine: Routine | None = None
    walked: bool = False
    idle: bool = False
    triggered: bool = False
    followed: dict[bytes, None] = field(default_factory=dict)

    def add_finding(self, code: str, message: str, statement: Statement) -> None:
        """Notes a finding; the same words are reported once, at their first place."""
        if (code, message) in self.reported:
            return
        self.reported.add((code, message))
        line, column = self.document.place(statement.at)
        self.findings.append(Finding(code, message, str(self.document.path), line, column))

    def forget(self, effects: Effects, why: str) -> None:
        """Makes unknown what ``effects`` name.  A variable that is forgotten may still hold any value that it had,
        so none of its literals can be changed for one motion alone."""
        words = {effect for effect in effects if isinstance(effect, str)}
        self.state.forget(words, why, self.has_tcp_mode, self.has_turning)
        unclear = UnknownValue("KRL002", f"its value is not known {why}")
        if "all" in words:
            self.variables.forget_all(unclear)
            self.mentioned |= {name.partition(b".")[0] for name in self.survey.assigned}
        for effect in effects:
            if isinstance(effect, bytes) and self.variables.forget(effect, unclear):
                self.mentioned.add(effect)

    def type_of(self, name: bytes) -> bytes:
        """The type with which a variable is declared, b"" where it is not."""
        if self.routine is not None and self.routine.types.get(name):
            return self.routine.types[name]
        return self.declarations.types.get(name, b"")

    def lookup(self, name: bytes, path: bytes) -> Value | None:
        """The value of a variable, where nothing else than this program's flow can have changed it."""
        value = self.variables.get(name, path)
        if value is None and name.startswith(b"$") and not path:
            if name in (b"$BASE", b"$TOOL"):
                numbers = self.frames.values(self.state.base if name == b"$BASE" else self.state.tool)
                return known(numbers) if numbers is not None else None
            return known(ZERO) if name in (b"$NULLFRAME", b"$WORLD") else None
        if value is None:
            if self.type_of(name):
                return UnknownValue("KRL002", f"{shown(name)} has no value yet")
            return None
        if name in self.survey.later:
            return UnknownValue("KRL002", f"{shown(name)} is changed by an interrupt or a trigger")
        return value

    def value(self, text: bytes) -> Value:
        """The value of an expression in the program."""
        return evaluate(text, self.lookup)

    def trusted(self, name: bytes) -> bool:
        """Whether a number assigned to a variable stays there: it is one of this program's own."""
        routine = self.routine
        if routine is not None and name in routine.types:
            return True
        return name in self.declarations.types and name not in self.declarations.shared

    def converted(self, name: bytes, value: Value) -> Value:
        """The value as a variable of its type holds it; a number is no BOOL, and a BOOL no number."""
        kind = self.type_of(name)
        if not isinstance(value, (int, float)) or kind not in (b"INT", b"REAL", b"BOOL"):
            return value
        if isinstance(value, bool) != (kind == b"BOOL"):
            return UnknownValue(
                "KRL002", f"{shown(name)} has the type {shown(kind)} and gets a value of another type"
            )
        if kind == b"INT":
            return int(value + 0.5) if value >= 0 else -int(0.5 - value)
        return float(value) if kind == b"REAL" else value

    def why_walked(self, routine: Routine) -> str:
        """Why the motions of a subprogram are not known to run, or run otherwise than they are read here."""
        if routine.name in self.survey.later:
            return f"it is in the subprogram of line {routine.line}, which an interrupt or trigger calls"
        return f"it is in the subprogram of line {routine.line}, which is not called with known values"

    @property
    def uncertain(self) -> bool:
        """Whether it is not known that, and how often, the present line runs."""
        return self.walked or any(not item.followed for item in self.stack)
