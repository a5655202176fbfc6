"""The flow of a program: what runs, in which order and how often, as far as its constants say."""

from __future__ import annotations

import re

from postproc.languages.krl import motions
from postproc.languages.krl.assignments import assign, declare
from postproc.languages.krl.block_follower import BUDGET
from postproc.languages.krl.calls import Calls, Restart
from postproc.languages.krl.external_axes import ALL_LOST, by_themselves
from postproc.languages.krl.lexing import Assignment, Call, Declared, Statement, has_foreign_letters
from postproc.languages.krl.modal_state import InlineFormState, ModalState
from postproc.languages.krl.program_structure import INLINE, LATER, Routine
from postproc.languages.krl.statement_effects import HIDDEN, effects_of, functions_of
from postproc.languages.krl.vectorised import VectorisedLines
from postproc.toolpath import Annotation

_ANNOTATION = re.compile(rb";[ \t]*(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)


class ProgramFlow(Calls):
    """Runs a program line by line; ``all`` once."""

    def all(self) -> None:
        run = self.run
        pc: int | None = 0
        while pc is not None and pc < len(run.code):
            routine = run.survey.routine_at.get(pc)
            if routine is None:
                pc = self._step(pc)
                continue
            if routine.is_main:
                run.state, run.routine, run.stack = ModalState(), routine, []
                self._run(routine)
            pc = routine.end + 1
        run.variables.undo(0)
        for routine in run.survey.routine_at.values():
            if not routine.is_main and routine.name not in run.followed:
                self._walk(routine)
        self._idle()
        run.rows.comments = list(self.comments.values())

    def _run(self, routine: Routine) -> None:
        run = self.run
        pc: int | None = routine.start + 1
        outside = routine.end + 1 if run.survey.has_routine else len(run.code)
        while pc is not None and pc < len(run.code) and (pc < outside or run.routine is not routine):
            pc = self._step(pc)
        run.stack, run.routine, run.state, self.repeating = [], None, ModalState(), 0

    def _walk(self, routine: Routine) -> None:
        """Passes over a routine that no call that is known leads to."""
        run = self.run
        mark = b"routine %d" % routine.line
        run.state = ModalState(sources=frozenset([mark]), external=ALL_LOST)
        run.state.lose_point("it depends on the caller")
        run.routine, run.stack, run.walked = routine, [], True
        self._run(routine)
        run.variables.undo(0)
        run.walked = False

    def _idle(self) -> None:
        """Lists the motions that nothing led to."""
        run = self.run
        lines: set[int] = set()
        bulks: set[int] = set()
        for chunk in run.rows.chunks:
            if isinstance(chunk, list):
                lines.update(row.line for row in chunk)
            else:
                bulks.add(id(chunk.bulk))
        run.idle = True
        for item in run.code:
            run.state, run.stack, run.routine = ModalState(), [], None
            if isinstance(item, VectorisedLines):
                if id(item) not in bulks:
                    motions.move_bulk(run, item)
            elif item.kind == "motion" and item.line not in lines:
                motions.move(run, item)
            elif item.kind == "strange" and item.line not in lines and run.survey.has_routine:
                motions.unknown_motion(run, item)

    def _step(self, pc: int) -> int | None:
        """Takes up a statement; gives the index of the next one, None after the end."""
        run = self.run
        item = run.code[pc]
        if self.repeating or self.jumped:
            if self.seen[pc]:
                self.spent += len(item) if isinstance(item, VectorisedLines) else 1
            self.seen[pc] = 1
            if self.spent > BUDGET and not self.uncertain_blocks.plain:
                return self._give_up(pc)
        if isinstance(item, VectorisedLines):
            motions.move_bulk(run, item)
            return pc + 1
        if item.comment:
            self._comment(item)
        kind, said = item.kind, item.strings
        if kind == "comment":
            return pc + 1
        if not item.code.isascii() and kind != "motion" and has_foreign_letters(item.code):
            self._report_letters(item)
        for name in functions_of(item):
            self._called(item, name, item.code)
        events = run.survey.events.get(pc, ())
        for what, block in events:
            if what == "open":
                return self._open(pc, item, block)
            if what == "branch":
                return self._branch(pc, block)
            again = self._close(item, block)
            if again is not None:
                return again
        if kind == "motion":
            motions.move(run, item)
        elif kind == "strange":
            if run.survey.has_routine:
                motions.unknown_motion(run, item)
            run.forget(effects_of(item)[0], f"after line {item.line}, which is not understood")
        elif kind == "foreign" and isinstance(said, Call):
            self._called(item, said.name, said.arguments)
        elif kind == "foreign":
            run.forget(
                effects_of(item)[0], f"after line {item.line}, which contains letters that KRL does not have"
            )
        elif isinstance(said, Assignment):
            assign(run, item, said)
        elif isinstance(said, Declared):
            declare(run, said)
        elif isinstance(said, Call):
            return self._call(pc, item, said)
        elif kind == "label" and isinstance(said, bytes):
            self._label(item, said)
        elif kind == "goto" and isinstance(said, bytes):
            return self._goto(pc, said)
        elif kind == "exit":
            return self._exit(pc)
        elif kind in ("return", "end"):
            return self._leave(pc, kind)
        elif kind == "other" and item.word in (b"ASYPTP", b"ASYCONT"):
            run.state.external = by_themselves(run.state.external, item.code)
        elif kind == "other" and run.survey.has_routine and HIDDEN.search(item.code):
            motions.unknown_motion(run, item)
        elif item.word in (b"TRIGGER", b"INTERRUPT", b"GLOBAL"):
            run.triggered = run.triggered or item.word == b"TRIGGER"
            self._later(item)
        return pc + 1

    def _comment(self, item: Statement) -> None:
        run = self.run
        if run.survey.inline and item.kind == "comment" and INLINE.match(item.comment):
            state = run.state
            at = run.document.raw.rfind(b"\n", 0, item.at) + 1
            state.form = InlineFormState(at, (state.base, state.tool), state.feed)
        text = item.comment[1:].decode("latin-1").strip()
        note = Annotation(len(run.rows), text, item.line)
        if _ANNOTATION.match(item.comment):
            run.rows.annotations.append(note)
        elif item.kind == "comment":
            self.comments.setdefault(item.line, note)

    def _later(self, item: Statement) -> None:
        """Takes up what an interrupt or a trigger may do from here on."""
        run = self.run
        if not run.survey.later_effects.isdisjoint(("base", "tool", "mode", "turning")):
            run.later_since = run.later_since or item.line
        for name in LATER.findall(item.code):
            name = name.upper()
            if name + b"(" in item.code.upper().replace(b" ", b"") and name not in run.survey.routines:
                self._unread(item, name)

    def _report_letters(self, item: Statement) -> None:
        """Once; the motions that it leaves uncertain are reported one by one."""
        self.run.add_finding(
            "KRL025", "the statement contains letters that KRL does not have: its effect is not known", item
        )

    def _give_up(self, pc: int) -> int:
        """The budget is spent."""
        run = self.run
        outermost = next((item for item in run.stack if item.followed and item.repeats), None)
        self.uncertain_blocks.plain = True
        if self.jumped or outermost is None:
            raise Restart
        at = self._abort(outermost)
        item = run.code[at]
        assert isinstance(item, Statement)
        self._report_length(item)
        return at
