"""What one reading of a program works on, shared by the parts of the interpreter."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from postproc.base.document import Document
from postproc.base.findings import Finding
from postproc.languages.core.motion_sources import together
from postproc.languages.core.waits import Waits
from postproc.languages.krl.data import Declarations
from postproc.languages.krl.expressions import Value, evaluate
from postproc.languages.krl.lexing import FRAME_TABLES, Statement
from postproc.languages.krl.modal_state import (
    OVERRIDES,
    FrameIndex,
    FrameRegister,
    ModalState,
    Record,
    joined,
)
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.other_modules import OtherModules
from postproc.languages.krl.program_blocks import Block, Routine
from postproc.languages.krl.program_structure import ProgramStructure
from postproc.languages.krl.spatial import ZERO
from postproc.languages.krl.statement_effects import COMMENTS, Effect, Effects
from postproc.languages.krl.target import COMPONENTS, FrameEntry, KrlTarget, UnknownValue, known, shown
from postproc.languages.krl.value_types import component_type, of_component, of_type
from postproc.languages.krl.variables import VariableFacts, Variables
from postproc.languages.krl.vectorised import Item

_ENTRY = re.compile(rb"\[(\d{1,9})\]\Z")


@dataclass(frozen=True)
class SplineBlock:
    """A spline block that is open: the line of its header, its first row, and whether a straight motion can be inserted
    before the header."""

    line: int
    first_row: int
    can_be_entered: bool


class Flow(NamedTuple):
    """What holds at one place of a program; never changed once it is made."""

    state: ModalState
    variables: VariableFacts


@dataclass(eq=False)
class ExecutionContext:
    """What all parts of the interpreter share.

    ``mentioned``: names that code reads, other than as the target of a motion; ``forgot_all``: something may have
    changed all that the program assigns.  ``routine``: the one that runs.
    ``walked``: nothing is known of who calls it; ``walked_rows``: first row, and that after the last, of such routines.
    ``followed``: routines that ran.  ``idle``: what no flow leads to is listed.  ``opaque``: the block, if any, whose
    structure is not understood.  ``spline``: the spline block that is open.  ``has_tcp_mode``, ``has_turning``: some
    line names another interpolation mode, or another way of turning the tool, than the usual one; ``has_override``:
    some line names a speed override.  ``initial``: what holds where the program starts.  ``root_set``, ``later_since``,
    ``later_speed``, ``moved_later``, ``ended_later``, ``later_comments``: what ``ModalState`` calls so;
    ``apart_later``: an interrupt or a trigger may take external axes out of motions.
    ``others``: the modules read besides; ``effects_of_others``: what their routines change of what this one knows;
    ``unread``: routines that are called and not read; ``depth``: how many calls of other modules lead here.
    """

    document: Document
    code: list[Item]
    structure: ProgramStructure
    declarations: Declarations
    variables: Variables
    has_tcp_mode: bool
    has_turning: bool
    has_override: bool
    rows: MotionRows
    others: OtherModules
    effects_of_others: Mapping[bytes, Effects]
    initial: ModalState = field(default_factory=ModalState)
    state: ModalState = field(default_factory=ModalState)
    frames: FrameRegister = field(default_factory=FrameRegister)
    spline: SplineBlock | None = None
    opaque: Block | None = None
    findings: list[Finding] = field(default_factory=list)
    mentioned: set[bytes] = field(default_factory=set)
    forgot_all: bool = False
    reported: set[tuple[str, str]] = field(default_factory=set)
    routine: Routine | None = None
    walked: bool = False
    idle: bool = False
    followed: dict[bytes, None] = field(default_factory=dict)
    walked_rows: list[tuple[int, int, Routine]] = field(default_factory=list)
    root_set: int = 0
    later_since: int = 0
    later_speed: frozenset[Effect] = frozenset()
    moved_later: int = 0
    ended_later: int = 0
    later_comments: frozenset[Effect] = frozenset()
    apart_later: bool = False
    unread: set[bytes] = field(default_factory=set)
    depth: int = 0

    def add_finding(self, code: str, message: str, statement: Statement) -> None:
        """Notes a finding; the same words are reported once, at their first place."""
        if (code, message) in self.reported:
            return
        self.reported.add((code, message))
        line, column = self.document.place(statement.at)
        self.findings.append(Finding(code, message, str(self.document.path), line, column))

    def report_unknown_effect(self, name: str, statement: Statement) -> None:
        """Notes that the program sets a variable of the controller whose effect is not known."""
        message = f"what {name} does to motions is not known; they are read as if it was not set"
        self.add_finding("KRL037", message, statement)

    def expect_later(self, effects: Effects, line: int) -> None:
        """Takes up what an interrupt or a trigger may do at any time from ``line`` on."""
        if not effects.isdisjoint(("base", "tool", "mode", "turning", "root", "record")):
            self.state.later_since = self.state.later_since or line
            self.later_since = self.later_since or line
        self.later_speed |= effects & {"feed", "apo"}
        if "override" in effects:
            self.later_speed |= {"feed"}
        if "advance" in effects:
            self.later_speed |= {"apo"}
        self.apart_later = self.apart_later or "apart" in effects
        self.state.set_apart(self.apart_later)
        self.state.later_speed |= self.later_speed
        if "point" in effects:
            self.moved_later = self.moved_later or line
            self.state.moved_later = self.state.moved_later or line
            self.state.unsettle(self.has_tcp_mode, self.has_turning)
        self.later_comments |= effects & COMMENTS
        self.state.later_comments |= self.later_comments
        if "resume" in effects:
            self.ended_later = self.ended_later or line
            self.state.ended_later = self.state.ended_later or line

    def named(self) -> set[bytes]:
        """The names that anything asked for or made unknown: no literal of theirs is changed for one motion alone."""
        assigned = self.structure.assigned if self.forgot_all else ()
        return self.mentioned | {name.partition(b".")[0] for name in assigned}

    def forget(self, effects: Effects, why: str) -> None:
        """Makes unknown what ``effects`` name.  A variable that is forgotten may still hold any value that it had,
        so none of its literals can be changed for one motion alone."""
        if not effects:
            return
        if len(effects) == 1 and "point" in effects:  # a call that is not read: the most frequent one
            self.state.forget({"point"}, why, self.has_tcp_mode, self.has_turning)
            return
        words = {effect for effect in effects if isinstance(effect, str)}
        words -= COMMENTS - self.structure.effects
        self.state.forget(words, why, self.has_tcp_mode, self.has_turning)
        if "override" in words and self.has_override:
            self.state.overridden = OVERRIDES
        if "advance" in words & self.structure.effects:
            self.state.no_advance = max(self.state.no_advance, Waits.MAYBE)
        self.state.set_apart("apart" in words & self.structure.effects)
        if "root" in words:
            self.state.root_set = self.state.root_set or self.variables.line
            self.root_set = self.root_set or self.variables.line
        unclear = UnknownValue("KRL002", f"its value is not known {why}")
        if "all" in words:
            self.variables.forget_all(unclear)
            self.forgot_all = True
        for effect in effects:
            if isinstance(effect, bytes) and self.variables.forget(effect, unclear):
                self.mentioned.add(effect)

    def type_of(self, name: bytes) -> bytes:
        """The type with which a variable is declared, b"" where it is not."""
        if self.routine is not None and self.routine.types.get(name):
            return self.routine.types[name]
        return self.declarations.types.get(name, b"")

    def numbered_frame(self, table: bytes, at: int, line: int) -> FrameIndex | UnknownValue:
        """Entry ``at`` of BASE_DATA or TOOL_DATA (``table`` without _DATA) as the program left it so far."""
        if at == 0:
            return self.frames.known(0, ZERO, line)
        entry, name = b"[%d]" % at, table.decode() + "_DATA"
        if table + b"_DATA" in self.structure.later:
            return UnknownValue("KRL012", f"{name} is changed by an interrupt or a trigger")
        value = self.variables.get(table + b"_DATA", entry)
        if value is None and not self.structure.table_entries.isdisjoint((table + b"_DATA" + entry, None)):
            why = "has the value of the last run: the program assigns it elsewhere"
            return UnknownValue("KRL012", f"{name}[{at}] {why}")
        if value is None:
            return self.frames.known(at, None, line)
        if isinstance(value, FrameEntry) and value.table == table:
            return self.frames.in_entry(value, line)
        numbers = value.numbers if isinstance(value, KrlTarget) else None
        if numbers is not None:
            return self.frames.known(at, numbers, line)
        return UnknownValue("KRL012", f"{name}[{at}] is computed in the program")

    def lookup(self, name: bytes, path: bytes) -> Value | None:
        """The value of a variable, where nothing else than this program's flow can have changed it."""
        if name in FRAME_TABLES and (entry := _ENTRY.match(path)):
            table = name.partition(b"_")[0]
            frame = self.numbered_frame(table, int(entry[1]), 0)
            return self.frames.copied(frame, table) if isinstance(frame, FrameIndex) else frame
        return self.resolve(name, path, self.variables.get(name, path))

    def resolve(self, name: bytes, path: bytes, value: Value | None) -> Value | None:
        """The same of a variable that has this ``value`` as far as the program assigns it."""
        if value is None and name.startswith(b"$") and not path:
            if name in (b"$BASE", b"$TOOL"):
                return self.frames.copied(self.state.base if name == b"$BASE" else self.state.tool, name[1:])
            return known(ZERO) if name in (b"$NULLFRAME", b"$WORLD") else None
        if value is None:
            if self.type_of(name):
                return UnknownValue("KRL002", f"{shown(name)} has no value yet")
            return None
        if name in self.structure.later:
            return UnknownValue("KRL002", f"{shown(name)} is changed by an interrupt or a trigger")
        if isinstance(value, FrameEntry) and path.rpartition(b".")[2] in COMPONENTS:
            return UnknownValue(value.code, value.message)
        return value

    def record(self, name: bytes, key: bytes = b"") -> Record | None:
        """The entries of an FDAT, LDAT or PDAT as it is declared; None where the program changes it, or its ``key``."""
        self.variables.asked.add(name)
        partly = name + b"." + key in self.structure.assigned if key else name in self.partly_assigned
        return None if partly or name in self.structure.assigned else self.declarations.records.get(name)

    @cached_property
    def partly_assigned(self) -> frozenset[bytes]:
        """Names of which the program assigns a component."""
        return frozenset(name.partition(b".")[0] for name in self.structure.assigned if b"." in name)

    def value(self, text: bytes) -> Value:
        """The value of an expression in the program."""
        return evaluate(text, self.lookup)

    def trusted(self, name: bytes) -> bool:
        """Whether a number assigned to a variable stays there: it is one of this program's own."""
        routine = self.routine
        if routine is not None and name in routine.types:
            return True
        return name in self.declarations.types and name not in self.declarations.shared

    def type_at(self, name: bytes, path: bytes) -> bytes:
        """The type of ``name path``, b"" where it is not declared."""
        return component_type(self.type_of(name), path, self.declarations.structures)

    def converted(self, name: bytes, value: Value, path: bytes = b"") -> Value:
        """The value as ``name path`` holds it by its type."""
        convert = of_component if b"." in path else of_type
        return convert(value, self.type_at(name, path), name + path)

    def flow(self) -> Flow:
        """What holds here."""
        return Flow(self.state.copy(), self.variables.facts)

    def resume(self, flow: Flow) -> None:
        """Goes on with what held elsewhere."""
        self.state, self.variables.facts = flow.state.copy(), flow.variables

    def merged(self, one: Flow | None, other: Flow | None) -> Flow | None:
        """What holds where two paths meet; None for a path that nothing takes."""
        if one is None or other is None:
            return one or other
        sources = together(one.state.sources | other.state.sources)
        state = joined(one.state, other.state).changed(sources=sources)
        return Flow(state, self.variables.joined(one.variables, other.variables))

    def raised(self, head: Flow, back: Flow) -> Flow:
        """What holds at the head of a loop, ``back`` what its end brings; ``head`` itself where that adds nothing."""
        state = joined(head.state, back.state)
        facts = self.variables.joined(head.variables, back.variables)
        return head if state is head.state and facts is head.variables else Flow(state, facts)
