"""Constants, frames and what is in force, propagated over the flow of all routines.

Every statement is run with what holds on all paths that lead to it; calls of routines of the file are followed into
them.  A motion has one fact, which holds in all of its executions.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from postproc.languages.core.comments_in_force import VARYING, Varying, place_of
from postproc.languages.core.flow_runner import FlowRunner
from postproc.languages.core.motion_sources import ELSEWHERE, START, Meeting, Source
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.core.waits import Waits
from postproc.languages.rapid.call_arguments import give_arguments, given_back
from postproc.languages.rapid.call_effects import CallEffects, ModeChanges, leaving_words, mode_changes
from postproc.languages.rapid.declared_data import DeclaredData, Usage, first_value, names_in
from postproc.languages.rapid.evaluation import Evaluator, is_component, unknown_record
from postproc.languages.rapid.instructions import (
    ANY_PROCEDURE,
    AT_ONCE,
    DISPLACING,
    HARMLESS,
    MOTIONS,
    OTHER_MOTIONS,
    PURE,
    READERS,
    RESTORING,
    SCALING,
    WRITERS,
    MotionForm,
    is_motion,
)
from postproc.languages.rapid.motion_facts import motion_fact, not_read, waits_at
from postproc.languages.rapid.motion_modes import MODES_OF_MOTIONS, modes_at_start, set_mode
from postproc.languages.rapid.program_state import ProgramState
from postproc.languages.rapid.routine_entries import program_entries, run_again, run_aside, value_at_start
from postproc.languages.rapid.routine_graph import RapidStep, RoutineGraph
from postproc.languages.rapid.routine_names import RoutineNames
from postproc.languages.rapid.run_record import RunRecord
from postproc.languages.rapid.step_budget import StepBudget
from postproc.languages.rapid.syntax_tree import (
    Argument,
    AssignmentStatement,
    DataDeclaration,
    Expression,
    Instruction,
    Module,
    NotUnderstood,
    PlainMotions,
    RapidRoutine,
    Remark,
)
from postproc.languages.rapid.values import UnknownData, Value, replaced, truth_of
from postproc.toolpath import Kind

OTHER = MotionForm(Kind.OTHER)
_SETTINGS = frozenset([b"TOOLDATA", b"WOBJDATA", b"SPEEDDATA", b"ZONEDATA"])
NOT_CONSTANT = " is not constant: "
MOST_RUNS = 8
"""Runs of main after each other until all of them start with the same."""
DEEPEST = 12
"""Calls in each other."""
UNSETTLED = ProgramState()
"""In the place of what is left at the end of a run: it is still to come."""


class Propagation:
    """Runs a module.  ``facts``, ``passed``, ``calls``, ``reads``, ``refreshed``: as of a RunRecord; ``unread``:
    statements that are not understood; ``preceding``: the comment in force before each, VARYING where several may."""

    def __init__(self, module: Module, raw: bytes) -> None:
        self.module = module
        self.routines: dict[bytes, RapidRoutine] = {}
        self.ambiguous: set[bytes] = set()
        for routine in module.routines:
            if routine.name in self.routines:
                self.ambiguous.add(routine.name)
            self.routines[routine.name] = routine
        functions = frozenset(r.name for r in module.routines if r.kind == b"FUNC")
        self.data = DeclaredData(module, functions, raw)
        self.usage = Usage(module)
        record = self._record = RunRecord()
        self.facts, self.passed, self.calls = record.facts, record.passed, record.calls
        self.reads, self.refreshed = record.reads, record.refreshed
        self.unread: dict[int, NotUnderstood] = {}
        self._strayed = frozenset([ELSEWHERE] if self.usage.strays else [])
        self._again: set[bytes] = set()  # routines of which not each run is followed
        self._graphs: dict[bytes, RoutineGraph] = {}
        self._effects = CallEffects(self.usage)
        self._names = RoutineNames(self.data, self.usage)
        self._changes: dict[bytes, ModeChanges] = {}
        self._at_start = modes_at_start(module)
        aside = [self.routines[name].body for name in self.usage.aside if name in self.routines]
        aside += [routine.handlers for routine in module.routines]
        self._aside = mode_changes(aside, self._at_start)
        self._of_all = mode_changes((routine.body for routine in module.routines), self._at_start)
        bodies = (body for routine in module.routines for body in (routine.body, routine.handlers))
        self._restarts = any(b"EXITCYCLE" in leaving_words(body) for body in bodies)
        self._numbers = KeyNumbers()
        self.preceding: dict[int, Remark | Varying | None] = {}
        self.waited: set[Source] = set()
        self._budget = StepBudget(module)
        self._runner = FlowRunner(self.after_block, lambda: len(self._names.aliased))

    def run(self) -> None:
        """Follows the program from main, and every routine that nothing in the file calls.  Raises TooLong."""
        main, entries = program_entries(self.module, self.usage)
        aside = run_aside(self.module, self.usage)
        for routine in entries:
            self._enter(routine, routine is main, routine is not main and routine.name in aside)
        for name in run_again(aside | self._again, entries, main, self.usage):
            self._enter(self.routines[name], False, True)

    def is_unclear(self, routine: RapidRoutine) -> bool:
        """Whether the structure of a routine is not understood, or its name is that of several."""
        return routine.broken >= 0 or routine.name in self.ambiguous or bool(self._graph(routine).missing)

    def _graph(self, routine: RapidRoutine) -> RoutineGraph:
        graph = self._graphs.get(routine.name)
        if graph is None:
            graph = self._graphs[routine.name] = RoutineGraph(routine.body)
        return graph

    def _enter(self, routine: RapidRoutine, is_main: bool, is_aside: bool) -> None:
        """Runs a routine; ``is_aside``: the file itself calls it, where the flow does not show it."""
        if routine.kind != b"PROC" or self.is_unclear(routine):
            return
        places = frozenset([START if is_main else ELSEWHERE]) | self._strayed
        state = ProgramState(PersistentMap(self._numbers), places)
        for name in self.usage.assigned:
            if name in self.data and not self.data.is_constant(name):
                state.put(name, value_at_start(self.data, name, is_main))
        if is_aside:
            self._of_all.lose(state, b"its caller")
        if self._aside.names - SCALING or self._aside.speaks:
            state.displaced |= {b"a trap or an error handler"}
        if self._aside.names & SCALING:  # at any time
            state.scaled = True
        if not is_main or (end := self._start_again(routine, state)) is UNSETTLED:
            self._start()
            end = self._routine(routine, state, True)
        if end is not None:
            self._leave_place(end)

    def _start_again(self, main: RapidRoutine, state: ProgramState) -> ProgramState | None:
        """Takes in what the last run of main left, with which it starts again.  What is left at the end where the last
        run started so, and is taken up; UNSETTLED where ``state`` is still to be run."""
        if not (any(state.values.items()) or self._of_all.names):
            return UNSETTLED
        for number in range(0 if self._restarts else MOST_RUNS):
            self._start()
            self._record.clear()
            aliases = len(self._names.aliased)
            after = end = self._routine(main, state.copy(), number > 0)
            again = state.copy()
            if after is not None:
                end = after.copy()
                if main.handlers:  # an error may end it in the middle
                    self._lose_effects(main.name, after)
                after.forget_own(main.name)
                again.join(after, Meeting())
            again.last, again.waits = state.last, state.waits
            again.force, again.switch = state.force, state.switch
            if again.is_same(state):
                return end if number and len(self._names.aliased) == aliases else UNSETTLED
            state.take(again)
        self._record.clear()
        self._forget_all(self.usage.assigned, state)
        self._of_all._replace(speaks=False).lose(state, b"an earlier run")
        return UNSETTLED

    def _start(self) -> None:
        """Starts a run of the program."""
        self._runner.start()
        self._budget.start_run()

    def _lose_effects(self, name: bytes, state: ProgramState) -> None:
        """What calls of a routine may have done, or a part of it."""
        reach = self._effects.of(name)
        self._forget_all(reach.assigned, state)
        found = self._changes.get(name)
        if found is None:
            bodies = (self.routines[one].body for one in reach.routines if one in self.routines)
            found = self._changes[name] = mode_changes(bodies, self._at_start)
        found.lose(state, b"a routine")
        if not reach.routines.isdisjoint(self.usage.moves):
            state.last |= {ELSEWHERE}  # or it is where it was

    def _leave_place(self, state: ProgramState) -> None:
        """What the file does not contain goes on, or nothing does."""
        if state.waits:
            self.waited |= state.last
        state.last = frozenset([ELSEWHERE])

    def _routine(self, routine: RapidRoutine, state: ProgramState, recording: bool) -> ProgramState | None:
        """The state after a routine; None where it does not come back."""
        self._names.active.append(routine)
        try:
            return self._runner.run(self._graph(routine), state, recording)
        finally:
            self._names.active.pop()

    def after_block(
        self, graph: RoutineGraph, at: int, state: ProgramState
    ) -> list[tuple[int, ProgramState]]:
        """Where a block leads, and what holds there."""
        block = graph.blocks[at]
        self._steps(block.steps, state)
        if block.condition is None:
            return [(block.follow, state)]
        self._functions(block.condition, state)
        holds = truth_of(self._evaluator(state).value(block.condition))
        if holds is None:
            return [(block.follow, state), (block.otherwise, state)]
        return [(block.follow if holds else block.otherwise, state)]

    def _steps(self, steps: list[RapidStep], state: ProgramState) -> None:
        """Runs statements.  A call that is there again and again is passed once it changes nothing: what it does then
        is what it did before."""
        called, count, settled = b"", 0, False
        for step in steps:
            name = step.name if type(step) is Instruction and not step.arguments else b""
            if not name or name != called or is_motion(name):
                called, count, settled = name, 1, False
                self._step(step, state)
            elif settled:
                self._budget.take(step)
            else:
                count += 1
                before = None if count & (count - 1) else state.copy()
                self._step(step, state)
                settled = before is not None and state.is_same(before)

    def _step(self, step: RapidStep, state: ProgramState) -> None:
        self._budget.take(step)
        match step:
            case Instruction():
                self._instruction(step, state)
            case PlainMotions():
                self._plain(step, state)
            case AssignmentStatement():
                self._functions(step.target, state)
                self._functions(step.value, state)
                self._assign(step.target, step.value, state)
            case DataDeclaration():
                if step.value is not None:
                    self._functions(step.value, state)
                value = first_value(step, self._evaluator(state))
                key = self._names.key(step.name)
                if step.kind == b"PERS" and step.name in self.usage.assigned:
                    value = UnknownData(f"{step.name.decode('latin-1')} is kept between calls")
                state.put(key, value)
            case Remark():
                self._remark(step, state)
            case NotUnderstood():
                self._lose(step, state)

    def _lose(self, step: NotUnderstood, state: ProgramState) -> None:
        """What a statement that is not understood may change."""
        self.unread.setdefault(step.start, step)
        if is_motion(step.first):
            moved = Instruction(step.first, (), step.start, step.stop)
            self._not_read(moved, state, "it is not understood")
            return
        for name in step.names:
            self._forget(name, state, "a statement that is not understood may change it")
        state.waits = max(state.waits, Waits.MAYBE)
        self._leave_place(state)
        if step.names & (DISPLACING | RESTORING.keys()):
            state.displaced |= {b"a statement that is not understood"}

    def _remark(self, step: Remark, state: ProgramState) -> None:
        if self._runner.recording:
            self.passed.setdefault(step.start, (step, self._record.rows))
        if place := place_of(step.text):
            if self.preceding.setdefault(step.start, before := getattr(state, place)) != before:
                self.preceding[step.start] = VARYING
            setattr(state, place, step)

    def _instruction(self, step: Instruction, state: ProgramState) -> None:
        name = step.name
        for argument in step.arguments:
            if argument.value is not None:
                self._functions(argument.value, state)
        routine = self.routines.get(name)
        if routine is not None and routine.kind == b"PROC" and name not in MOTIONS:
            self._call(routine, step, state)
        elif name in MOTIONS:
            if self._runner.recording:
                self._record.motion(
                    step.start, motion_fact(step, MOTIONS[name], state, self._evaluator(state))
                )
            self._moved(step, step.start, state)
            if MOTIONS[name].calls and self.usage.synchronous_call(step) not in self.routines:
                self.calls.setdefault(step.name, step.start)
        elif name in OTHER_MOTIONS:
            self._not_read(step, state, "this form of motion is not read")
            for argument_name in names_in(step.arguments):
                if self._names.look(argument_name, state)[1] not in _SETTINGS:
                    self._forget(argument_name, state, "an instruction may change it")
        else:
            self._setting(step, state)

    def _setting(self, step: Instruction, state: ProgramState) -> None:
        name = step.name
        options = {argument.name for argument in step.arguments}
        waits = waits_at(step, self._evaluator(state))
        if state.concurrent and name == b"WAITTIME" and b"INPOS" not in options:
            waits = min(waits, Waits.MAYBE)  # it starts with the motion, and may be over before this is
        state.waits = max(state.waits, waits)
        if name in DISPLACING:
            state.displaced |= {name}
            if name in READERS:
                self._note_reading(step.start, state)
        elif name in RESTORING:
            state.displaced -= frozenset(RESTORING[name])
        elif name in MODES_OF_MOTIONS:
            set_mode(step, state, self._evaluator(state))
            if name in AT_ONCE and self._runner.recording and state.waits != Waits.YES:
                self.refreshed |= state.last
        elif name in WRITERS:
            self._change(step.arguments, state)
        elif name not in HARMLESS and name not in (b"ACTUNIT", b"DEACTUNIT"):
            self._unread_call(step, state, moves=True)
        elif name.startswith(b"WAIT"):
            self._change(tuple(a for a in step.arguments if a.name), state)

    def _not_read(self, step: Instruction, state: ProgramState, message: str) -> None:
        """A motion of which only its place is known."""
        if self._runner.recording:
            self._record.motion(step.start, not_read(step, OTHER, state, message))
        self._moved(step, step.start, state)

    def _plain(self, step: PlainMotions, state: ProgramState) -> None:
        """Motions that are run one after the other."""
        if self._runner.recording:
            fact = motion_fact(step.first, MOTIONS[step.first.name], state, self._evaluator(state))
            self._record.motion(step.start, replace(fact, lines=step))
        self._moved(step.first, step.last, state)

    def _moved(self, motion: Instruction, at: int, state: ProgramState) -> None:
        """What holds after a motion, or the last one of its kind at an offset."""
        state.last = frozenset([at]) | self._strayed
        state.waits = Waits.NO
        state.concurrent = any(argument.name == b"CONC" for argument in motion.arguments)

    def _unread_call(self, step: Instruction, state: ProgramState, moves: bool) -> None:
        if self._runner.recording:
            self.calls.setdefault(step.name, step.start)
        self._change(step.arguments, state)
        state.waits = max(state.waits, Waits.MAYBE)
        if step.name.startswith(ANY_PROCEDURE):  # those of this file among them
            self._lose_effects(step.name, state)
        if moves:
            self._leave_place(state)

    def _change(self, arguments: tuple[Argument, ...], state: ProgramState) -> None:
        for name in names_in(arguments):
            self._forget(name, state, "an instruction or a call may change it")

    def _forget(self, name: bytes, state: ProgramState, reason: str) -> None:
        self._put(name, UnknownData(f"{name.decode('latin-1')}: {reason}"), state)

    def _put(self, name: bytes, value: Value, state: ProgramState) -> None:
        key = self._names.key(name)
        if key != name or (name in self.data and not self.data.is_constant(name)):
            state.put(key, value)

    def _call(self, routine: RapidRoutine, step: Instruction, state: ProgramState) -> None:
        """Runs a routine of the file with its arguments."""
        deep = len(self._names.active) >= DEEPEST
        unclear = deep or routine in self._names.active or self.is_unclear(routine)
        if unclear or not self._budget.take_call():
            reach = self._effects.of(routine.name)
            self._again |= reach.routines
            self._unread_call(step, state, moves=unclear or not reach.routines.isdisjoint(self.usage.moves))
            self._lose_effects(routine.name, state)
            return
        resumes = leaving_words(self._names.active[-1].handlers)
        if b"RETRY" in resumes:  # it may have run already, and was left where an error occurred
            self._lose_effects(routine.name, state)
            self._change(step.arguments, state)
        evaluator = self._evaluator(state)
        changed = self._effects.of(routine.name).assigned
        inner = state.copy()
        shared = give_arguments(routine, step, evaluator, inner)
        pairs = [(parameter, names_in((one,))) for parameter, one in shared]
        self._names.find_aliases(routine, pairs, self._effects.of(routine.name))
        after = self._routine(routine, inner, self._runner.recording)
        if after is None:
            self._lose_effects(routine.name, state)
            self._leave_place(state)
            return
        displaced = state.displaced
        state.take(after)
        self._change(tuple(argument for name, argument in shared if name in changed), state)
        if not routine.handlers and b"TRYNEXT" not in resumes:
            for name, value in given_back(routine, shared, changed, after):
                self._put(name, value, state)
        if routine.handlers or b"TRYNEXT" in resumes:
            self._lose_effects(routine.name, state)
            state.displaced |= displaced

    def _note_reading(self, at: int, state: ProgramState) -> None:
        """The program reads where the robot is."""
        if self._runner.recording:
            self.reads[at] |= state.last

    def _forget_all(self, names: Set[bytes], state: ProgramState) -> None:
        """Loses data of the module with names that other routines assign."""
        for name in names:
            if name in self.data and not self.data.is_constant(name):
                reason = f"{name.decode('latin-1')}: a function or a call may change it"
                state.put(name, UnknownData(reason))

    def _functions(self, expression: Expression, state: ProgramState) -> None:
        """What the functions in an expression change: those of the program."""
        for one in self._effects.calls_in(expression):
            if one.name not in PURE or one.name in self.routines:
                self._change(one.arguments, state)
                self._lose_effects(one.name, state)
            if one.name in READERS:
                self._note_reading(one.start, state)

    def _assign(self, target: Expression, expression: Expression, state: ProgramState) -> None:
        evaluator = self._evaluator(state)
        value = evaluator.value(expression)
        variable, place = evaluator.assigned_place(target)
        if variable is None:
            return
        key, shown = self._names.key(variable), variable.decode("latin-1")
        if key == variable and (variable not in self.data or self.data.is_constant(variable)):
            return
        if isinstance(value, UnknownData) and NOT_CONSTANT not in value.reason:
            value = UnknownData(f"{shown}{NOT_CONSTANT}{value.reason}")
        if place:
            old, kind = self._names.look(variable, state)
            if isinstance(old, UnknownData) and is_component(target):
                old = unknown_record(kind, evaluator.components, old)
            value = replaced(old, place, value, f"a part of {shown} is assigned that is not known")
        state.put(key, value)

    def _evaluator(self, state: ProgramState) -> Evaluator:
        return Evaluator(
            lambda name: self._names.look(name, state), self.module.records, self.data.evaluator.shadowed
        )
