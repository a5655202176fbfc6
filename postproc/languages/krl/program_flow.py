"""The flow of a program: what runs, in which order and how often, as far as its constants say."""

from __future__ import annotations

import contextlib
from dataclasses import replace

from postproc.languages.core.comments_in_force import CommentInForce, place_of
from postproc.languages.core.motion_sources import ELSEWHERE
from postproc.languages.core.waits import Waits
from postproc.languages.krl import motions
from postproc.languages.krl.advance_run import advance_of, stop_of
from postproc.languages.krl.assignments import assign, declare
from postproc.languages.krl.calls import Calls
from postproc.languages.krl.execution_context import Flow
from postproc.languages.krl.expressions import Value
from postproc.languages.krl.external_axes import by_themselves
from postproc.languages.krl.flow_frames import Restart, Unfollowed
from postproc.languages.krl.later_changes import (
    EVENTS,
    later_actions,
    later_functions,
    starts_nothing,
    variables_of_unknown_effect,
)
from postproc.languages.krl.lexing import (
    SPLINES,
    Assignment,
    Call,
    Declared,
    Statement,
    StatementKind,
    has_foreign_letters,
    identifiers,
)
from postproc.languages.krl.modal_state import (
    NAN,
    TRIGGERED,
    FrameRegister,
    InlineFormState,
    ModalState,
)
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.open_blocks import BUDGET
from postproc.languages.krl.other_modules import (
    MOST_DEPTH,
    MOST_OUTCOMES,
    MOST_STEPS,
    RoutineExit,
    exit_of,
    state_at_entry,
    visible,
)
from postproc.languages.krl.program_blocks import Routine
from postproc.languages.krl.program_structure import INLINE
from postproc.languages.krl.routine_calls import closure
from postproc.languages.krl.statement_effects import (
    ANNOTATION,
    COMMENTS,
    EVERYTHING,
    HIDDEN,
    Effect,
    as_effects,
    called_in,
    effects_of,
    effects_of_unknown,
    functions_of,
)
from postproc.languages.krl.target import shown
from postproc.languages.krl.vectorised import Item, VectorisedLines
from postproc.toolpath import Annotation
from postproc.toolpath.meant_comments import meant_to_speak

_WAITS = tuple(Waits)


class ProgramFlow(Calls):
    """Goes over a program line by line, along all of its paths; ``all`` once."""

    def all(self) -> None:
        run = self.run
        self.mentioned_from, self.event_routines = {}, None
        self.resumes = any(isinstance(item, Statement) and item.word == b"RESUME" for item in run.code)
        start = run.flow()
        pc: int | None = 0
        while pc is not None and pc < len(run.code):
            routine = run.structure.routine_at.get(pc)
            if routine is None:
                pc = self._step(pc)
                continue
            if routine.is_main:
                run.resume(Flow(run.initial, run.variables.facts))
                run.routine = routine
                self.reset()
                self._run(routine)
            pc = routine.end + 1
        walked = closure(run.structure.routines, [*self.text_called, *run.structure.later])
        for routine in run.structure.routine_at.values():
            if not routine.is_main and (routine.name not in run.followed or routine.name in walked):
                run.variables.facts = start.variables
                self._walk(routine)
        self._idle()
        run.rows.comments = list(self.comments.values())

    def outcome(self, routine: Routine, args: tuple[Value | None, ...]) -> Flow | None:
        """What holds where a routine of another module returns that is called with these values."""
        run = self.run
        self.mentioned_from, self.event_routines, self.resumes = {}, None, False
        run.resume(Flow(run.initial, run.variables.facts))
        run.routine = routine
        self.reset()
        for i, (name, _) in enumerate(routine.parameters):
            value = args[i] if i < len(args) else None
            run.variables.replace(name, {} if value is None else {b"": run.converted(name, value)})
        self._comment_after(self._item(routine.start))
        pc: int | None = routine.start + 1
        while pc is not None:  # it has an END: else it is not followed
            pc = self._step(pc)
        return run.merged(self.activations[-1].returned, self._here())

    def _exit_of(self, name: bytes, state: ModalState, args: tuple[Value | None, ...]) -> RoutineExit | None:
        run = self.run
        others = run.others
        module, routine = others.routines[name]
        register = FrameRegister()
        entry = state_at_entry(state, run.frames, register)
        key = name, repr((entry, tuple(register.refs), args))
        if key not in others.outcomes:
            others.outcomes[key] = None  # of a call of itself nothing is known
            few = run.depth < MOST_DEPTH and len(others.outcomes) < MOST_OUTCOMES
            if few and others.steps < MOST_STEPS and module.can_be_followed:
                inner = replace(
                    run, document=module.document, code=module.code, structure=module.structure,
                    declarations=module.declarations, variables=module.variables(others),
                    effects_of_others=visible(others, module.declarations), rows=MotionRows(module.document),
                    initial=entry, state=ModalState(), frames=register, spline=None, opaque=None, findings=[],
                    mentioned=set(), reported=set(), followed={}, walked_rows=[], unread=set(), walked=False,
                    idle=False, depth=run.depth + 1,
                )  # fmt: skip
                following = ProgramFlow(inner, Unfollowed())
                with contextlib.suppress(Restart):
                    flow = following.outcome(routine, args)
                    others.outcomes[key] = None if flow is None else exit_of(flow.state, register, inner.rows)
                others.steps += following.steps + len(module.declarations.types)
        return others.outcomes[key]

    def _run(self, routine: Routine) -> None:
        run = self.run
        self._comment_after(self._item(routine.start))
        pc: int | None = routine.start + 1
        outside = routine.end + 1 if run.structure.has_routine else len(run.code)
        while pc is not None and pc < len(run.code) and (pc < outside or run.routine is not routine):
            pc = self._step(pc)
        run.routine, run.state = None, ModalState()
        self.reset()

    def _walk(self, routine: Routine) -> None:
        """Goes over a routine of whose callers nothing is known."""
        run = self.run
        callers = run.rows.meetings[b"routine %d" % routine.line]
        callers.sources.add(ELSEWHERE)
        run.state = ModalState(sources=frozenset([callers]), stop=Waits.MAYBE)
        run.state.root_set, run.state.later_since = run.root_set, run.later_since
        run.state.later_speed, run.state.ended_later = run.later_speed, run.ended_later
        run.state.moved_later, run.state.later_comments = run.moved_later, run.later_comments
        run.walked = True
        called_here = routine.name in self.text_called or routine.name in run.structure.later
        unknown = EVERYTHING - {"all"} | (COMMENTS if called_here else set())
        run.forget(unknown, f"at the start of the subprogram of line {routine.line}")
        run.state.set_apart(run.apart_later)
        run.routine = routine
        self.reset()
        first = len(run.rows)
        self._run(routine)
        run.walked_rows.append((first, len(run.rows), routine))
        if run.ended_later:
            run.rows.unfollowed_ends |= set(range(first, len(run.rows)))
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
                bulks.add(id(chunk.vectorised))
        run.idle, run.rows.never_from = True, len(run.rows)
        for item in run.code:
            if isinstance(item, VectorisedLines):
                if id(item) not in bulks:
                    self._anywhere()
                    motions.move_bulk(run, item)
            elif item.kind == StatementKind.MOTION and item.line not in lines:
                self._anywhere()
                motions.move(run, item)
            elif (
                item.kind == StatementKind.UNREADABLE and item.line not in lines and run.structure.has_routine
            ):
                self._anywhere()
                motions.unknown_motion(run, item)

    def _anywhere(self) -> None:
        """Nothing is known."""
        self.run.state, self.run.routine = ModalState(sources=frozenset([ELSEWHERE])), None

    def _step(self, pc: int) -> int | None:
        """Takes up a statement; gives the index of the next one, None after the end."""
        run = self.run
        item = run.code[pc]
        self.steps += 1
        if not self.reachable:
            return self._pass_over(pc, item)
        if self.repeating or self.went_back:
            if self.seen[pc]:
                count = len(item) if isinstance(item, VectorisedLines) else 1
                if self.not_followed or run.walked:
                    self.spent_not_followed += count
                else:
                    self.spent += count
            self.seen[pc] = 1
            if self.spent > BUDGET or self.spent_not_followed > BUDGET:
                elsewhere = self._give_up()
                if elsewhere is not None:
                    return elsewhere
        if isinstance(item, VectorisedLines):
            motions.move_bulk(run, item)
            return pc + 1
        if item.comment and not self._counts_after(pc, item):
            self._comment(item)
        if run.walked and run.structure.aliases:
            self._forget_aliases(item)
        kind, said = item.kind, item.strings
        if kind == StatementKind.COMMENT:
            return pc + 1
        if kind == StatementKind.MOTION and b"(" not in item.code and pc not in run.structure.events:
            run.variables.line = item.line
            motions.move(run, item)
            return pc + 1
        if kind != StatementKind.MOTION:
            self._advance_run(pc, item)
        code, structure = item.code, run.structure
        if not code.isascii() and kind != StatementKind.MOTION and has_foreign_letters(code):
            self._report_letters(item)
        run.variables.line = item.line
        if structure.ill_formed and code in structure.ill_formed:
            why = f"after line {item.line}, which is not understood"
            run.forget(effects_of_unknown(code), why)
        if b"(" in code:
            self._call_functions(item)
        for name in sorted(variables_of_unknown_effect(item, structure.directions)):
            run.report_unknown_effect(shown(name), item)
        if pc in structure.events:
            there = self._block_event(pc, item)
            if there is not None or not self.reachable:
                return pc + 1 if there is None else there
        if kind == StatementKind.MOTION:
            motions.move(run, item)
        elif kind == StatementKind.UNREADABLE:
            if run.structure.has_routine:
                motions.unknown_motion(run, item)
            run.forget(effects_of(item)[0], f"after line {item.line}, which is not understood")
        elif kind == StatementKind.UMLAUT_NAME and isinstance(said, Call):
            self._called(item, said.name, identifiers(said.arguments))
        elif kind == StatementKind.UMLAUT_NAME:
            run.forget(
                effects_of(item)[0], f"after line {item.line}, which contains letters that KRL does not have"
            )
        elif isinstance(said, Assignment):
            assign(run, item, said)
        elif isinstance(said, Declared):
            declare(run, said)
        elif isinstance(said, Call):
            return self._call(pc, item, said)
        elif kind == StatementKind.LABEL and isinstance(said, bytes):
            self._label(pc, item, said)
            self._comment_after(item)
        elif kind == StatementKind.GOTO and isinstance(said, bytes):
            there = self._goto(pc, said)
            if there <= pc:
                before = run.code[there - 1]
                if (
                    isinstance(before, Statement)
                    and before.kind == StatementKind.LABEL
                    and before.strings == said
                ):
                    self._comment_after(before)  # what its line states is passed again
            return there
        elif kind == StatementKind.EXIT:
            return self._exit(pc)
        elif kind in (StatementKind.RETURN, StatementKind.END):
            return self._leave(pc, kind == StatementKind.RETURN)
        elif kind == StatementKind.OTHER and item.word in (b"ASYPTP", b"ASYCONT"):
            run.state.external = by_themselves(run.state.external, item.code)
        elif item.word == b"TIME_BLOCK" and run.spline is not None:
            run.state.feed = NAN  # the block takes a time
            for frame in self.stack:
                if frame.opened is not None:
                    frame.opened.feed = NAN
        elif kind == StatementKind.OTHER and run.structure.has_routine and HIDDEN.search(item.code):
            motions.unknown_motion(run, item)
        elif item.word in EVENTS:
            if item.word == b"TRIGGER":
                run.state.no_insert = TRIGGERED
            if not starts_nothing(item):
                self._later(item)
        return pc + 1

    def _forget_aliases(self, item: Statement) -> None:
        """In a routine of whose callers nothing is known: what else a statement changes may have been handed over."""
        run = self.run
        changed = effects_of(item, run.structure.directions)[0]
        if functions_of(item):
            changed = changed | as_effects(identifiers(item.code))
        same = changed & run.structure.aliases.keys()
        if same:
            others = frozenset[Effect]().union(*(run.structure.aliases[effect] for effect in same)) - changed
            run.forget(set(others), f"as it may be what line {item.line} changes")

    def _advance_run(self, pc: int, item: Statement) -> None:
        """Takes up whether the advance run stops at a statement."""
        state = self.run.state
        ahead = advance_of(item)
        if ahead is not None:
            state.no_advance = ahead
        if state.stop is Waits.YES:
            return
        if state.stop and isinstance(item.strings, Assignment) and b"$" not in item.code:
            return  # it stops for sure at variables of the system alone
        if not self.stops[pc]:  # it is the same each time: the types of a routine's names do not change
            self.stops[pc] = 1 + stop_of(item, self._is_continued(pc), self.run.type_of)
        state.stop = max(state.stop, _WAITS[self.stops[pc] - 1])

    def _is_continued(self, pc: int) -> bool:
        """Whether a CONTINUE is before a statement."""
        for before in range(pc - 1, -1, -1):
            item = self.run.code[before]
            if isinstance(item, VectorisedLines) or item.kind != StatementKind.COMMENT:
                return isinstance(item, Statement) and item.word == b"CONTINUE"
        return False

    def _block_event(self, pc: int, item: Statement) -> int | None:
        """Opens, changes or closes blocks; gives where it goes on if that is not after the statement."""
        for what, block in self.run.structure.events[pc]:
            if what == StatementKind.OPEN:
                return self._open(pc, item, block)
            if what == StatementKind.BRANCH:
                there = self._branch(pc, block)
                if there is None:  # the branch before it is the one that runs
                    return block.end
                self._comment_after(item)
                return there
            again = self._close(item, block)
            if again is not None:
                return again
            if block.word not in SPLINES:
                self._comment_after(item)
        return None

    def _pass_over(self, pc: int, item: Item) -> int | None:
        """A statement to which no path leads: it may be the end of a block, or a label, to which one does."""
        if isinstance(item, VectorisedLines):
            return pc + 1
        if pc in self.run.structure.events:
            there = self._block_event(pc, item)
            return pc + 1 if there is None else there
        if item.kind == StatementKind.LABEL and isinstance(item.strings, bytes):
            self._label(pc, item, item.strings)
            self._comment_after(item)
        elif item.kind == StatementKind.END:
            return self._leave(pc)
        return pc + 1

    def _counts_after(self, pc: int, item: Statement) -> bool:
        """Whether the comment of a line counts where paths go on: behind a label, or a line of a block."""
        return item.kind == StatementKind.LABEL or any(
            block.word not in SPLINES and (what != StatementKind.OPEN or block.word != b"SWITCH")
            for what, block in self.run.structure.events.get(pc, ())
        )

    def _comment_after(self, item: Statement) -> None:
        """Takes up the comment of such a line, if a path leads on from it."""
        if item.comment and self.reachable:
            self._comment(item)

    def _comment(self, item: Statement) -> None:
        run = self.run
        if run.structure.inline and item.kind == StatementKind.COMMENT and INLINE.match(item.comment):
            state = run.state
            state.form = InlineFormState((state.base, state.tool))
        text = item.comment[1:].decode("latin-1").strip()
        note = Annotation(len(run.rows), text, item.line)
        if ANNOTATION.match(item.comment):
            run.rows.annotations.append(note)
            setattr(run.state, place_of(text), CommentInForce.of(text, item.line))
        elif item.kind == StatementKind.COMMENT or meant_to_speak(text):
            self.comments.setdefault(item.line, note)

    def _later(self, item: Statement) -> None:
        """Takes up what an interrupt or a trigger may do from here on."""
        run = self.run
        run.expect_later(run.structure.later_effects, item.line)
        called = called_in(item.code)
        named = [one.name for one in later_actions(item) if one.name in called]
        for name in (*named, *later_functions(item.code)):
            if name != b"BAS" and name not in run.structure.routines:
                self._unread(item, name)

    def _report_letters(self, item: Statement) -> None:
        """Once; the motions that it leaves uncertain are reported one by one."""
        self.run.add_finding(
            "KRL025", "the statement contains letters that KRL does not have: its effect is not known", item
        )
