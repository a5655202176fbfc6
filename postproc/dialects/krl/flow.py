"""The flow of a program: what runs, in which order and how often, as far as its constants say."""

from __future__ import annotations

import re

from postproc.dialects.krl import motions
from postproc.dialects.krl.assignments import assign, declare
from postproc.dialects.krl.blocks import BUDGET
from postproc.dialects.krl.bulk import Bulk
from postproc.dialects.krl.calls import Calls, Restart
from postproc.dialects.krl.effects import HIDDEN, effects_of, functions_of
from postproc.dialects.krl.lexing import Assignment, Call, Declared, Statement, has_strange_letters
from postproc.dialects.krl.state import Form, State
from postproc.dialects.krl.survey import INLINE, Routine
from postproc.toolpath import Annotation

_ANNOTATION = re.compile(rb";[ \t]*(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)


class Flow(Calls):
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
                run.state, run.routine, run.stack = State(), routine, []
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
        pc: int | None = routine.begin + 1
        outside = routine.end + 1 if run.survey.has_routine else len(run.code)
        while pc is not None and pc < len(run.code) and (pc < outside or run.routine is not routine):
            pc = self._step(pc)
        run.stack, run.routine, run.state, self.repeating = [], None, State(), 0

    def _walk(self, routine: Routine) -> None:
        """Passes over a routine that no call that is known leads to."""
        run = self.run
        mark = b"routine %d" % routine.line
        run.state = State(sources=frozenset([mark]))
        run.state.lose_point("it is where the caller left the robot")
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
            run.state, run.stack, run.routine = State(), [], None
            if isinstance(item, Bulk):
                if id(item) not in bulks:
                    motions.move_bulk(run, item)
            elif item.kind == "motion" and item.line not in lines:
                motions.move(run, item)
            elif item.kind == "strange" and item.line not in lines and run.survey.has_routine:
                motions.unknown_motion(run, item)

    def _step(self, pc: int) -> int | None:
        """Takes up a statement; gives the index of the next one, None behind the end."""
        run = self.run
        item = run.code[pc]
        if self.repeating or self.jumped:
            if self.seen[pc]:
                self.spent += len(item) if isinstance(item, Bulk) else 1
            self.seen[pc] = 1
            if self.spent > BUDGET and not self.doubts.plain:
                return self._give_up(pc)
        if isinstance(item, Bulk):
            motions.move_bulk(run, item)
            return pc + 1
        if item.comment:
            self._comment(item)
        kind, said = item.kind, item.said
        if kind == "comment":
            return pc + 1
        if not item.code.isascii() and kind != "motion" and has_strange_letters(item.code):
            self._tell_letters(item)
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
            run.forget(effects_of(item)[0], f"after line {item.line}, whose name is none of KRL")
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
        elif kind == "other" and run.survey.has_routine and HIDDEN.search(item.code):
            motions.unknown_motion(run, item)
        elif item.word == b"TRIGGER":
            run.triggered = True
        return pc + 1

    def _comment(self, item: Statement) -> None:
        run = self.run
        if run.survey.inline and item.kind == "comment" and INLINE.match(item.comment):
            state = run.state
            at = run.document.raw.rfind(b"\n", 0, item.at) + 1
            state.form = Form(at, (state.base, state.tool), state.feed)
        text = item.comment[1:].decode("latin-1").strip()
        note = Annotation(len(run.rows), text, item.line)
        if _ANNOTATION.match(item.comment):
            run.rows.annotations.append(note)
        elif item.kind == "comment":
            self.comments.setdefault(item.line, note)

    def _tell_letters(self, item: Statement) -> None:
        """Once; the motions that it leaves uncertain are told one by one."""
        self.run.tell("KRL025", "letters that KRL does not have: what they name is not known", item)

    def _give_up(self, pc: int) -> int:
        """The budget is spent."""
        run = self.run
        outermost = next((item for item in run.stack if item.followed and item.repeats), None)
        self.doubts.plain = True
        if self.jumped or outermost is None:
            raise Restart
        at = self._abort(outermost)
        item = run.code[at]
        assert isinstance(item, Statement)
        self._tell_length(item)
        return at
