"""Jumps, and calls of the routines of a program."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Set
from functools import lru_cache

from postproc.languages.core.motion_sources import ELSEWHERE, Meeting, together
from postproc.languages.core.waits import Waits
from postproc.languages.krl.assignments import command, keep
from postproc.languages.krl.block_flow import BlockFlow
from postproc.languages.krl.expressions import Value, index_text
from postproc.languages.krl.flow_frames import BlockFrame, LabelHead, Restart
from postproc.languages.krl.later_changes import EVENTS
from postproc.languages.krl.lexing import LOOPS, NAME, Call, Statement, identifiers, split_values
from postproc.languages.krl.modal_state import TRIGGERED, ModalState
from postproc.languages.krl.other_modules import RoutineExit, take_exit
from postproc.languages.krl.program_blocks import Routine
from postproc.languages.krl.program_structure import MOST_EFFECTS
from postproc.languages.krl.routine_calls import callers, closure
from postproc.languages.krl.statement_effects import (
    EVERYTHING_AND_COMMENTS,
    PATH_FROM_FILE,
    Effect,
    Effects,
    as_effects,
    functions_of,
    is_harmless,
    returned_by,
)
from postproc.languages.krl.system_variables import SYSTEM, has_unknown_effect
from postproc.languages.krl.target import shown
from postproc.languages.krl.variables import Entry
from postproc.languages.krl.vectorised import Item

MOST_CALLS = 30
"""Calls inside of one another that are followed."""

_PLACE = re.compile(
    rb"(" + NAME + rb")[ \t]*+(?:\[((?:[^\[\]]|\[[^\[\]]*+\])*+)\][ \t]*+)?+(\.[^+*/:=<>(){}-]*+)?+\Z"
)
"""A variable, an element of it, a component: what a parameter can change."""


@lru_cache(maxsize=1024)
def _not_read(called: str) -> str:
    return f"{called} is not read: after it the position is not known; base and tool are assumed unchanged"


class Calls(BlockFlow):
    """Follows jumps and calls.

    mentioned_from: start of a routine -> the names in its text; event_routines: those that state an interrupt or a
    trigger, themselves or in what they call, once it was asked for; resumes: an interrupt may end a subprogram.
    """

    mentioned_from: dict[int, frozenset[bytes]]
    event_routines: set[bytes] | None
    resumes: bool

    def _label(self, pc: int, item: Statement, name: bytes) -> None:
        run, routine, active = self.run, self.run.routine, self.activations[-1]
        if routine is None or routine.labels.get(name, (-1,))[0] != pc:
            return
        key = (routine.start, name)
        if key in self.unfollowed.labels:
            self._lose_all(item, name, key)
            return
        waiting = active.waiting.get(name)
        flow = run.merged(self._here(), waiting)
        if waiting is not None:
            active.waiting = active.waiting.set(name, None)
        self._continue_with(flow)
        if run.structure.jumps.get(key, (-1, -1))[1] > pc:
            head = LabelHead(flow, flow, self._checkpoint(copies=True), Meeting())
            active.heads = active.heads.set(name, head)
            self._start_at(head)

    def _lose_all(self, item: Statement, name: bytes, key: tuple[int, bytes]) -> None:
        """After a label to which jumps lead that are not followed."""
        run, meeting = self.run, self.run.rows.label(*key)
        self.reachable = True
        run.forget(EVERYTHING_AND_COMMENTS, f"after the label {shown(name)} in line {item.line}")
        meeting.sources |= run.state.sources
        run.state.sources = frozenset([meeting])
        run.state.form = None
        run.add_finding(
            "KRL024", f"the jumps to {shown(name)} are not followed: from here on nothing is known", item
        )

    def _start_at(self, head: LabelHead) -> None:
        """Goes on after a label with what holds there."""
        head.meeting.sources = set() if head.entry is None else set(head.entry.state.sources)
        self._continue_with(head.flow)
        if head.flow is not None:
            self.run.state.sources = frozenset([head.meeting])

    def _goto(self, pc: int, name: bytes) -> int:
        run, routine = self.run, self.run.routine
        if routine is None or name not in routine.labels:
            return pc + 1
        at, blocks = routine.labels[name]
        key = (routine.start, name)
        active = self.activations[-1]
        own = self.stack[active.blocks :]
        inside = [frame for frame in own if frame.block in blocks]
        followed = not self.unfollowed.everything and key not in self.unfollowed.labels
        single = followed and self._is_single(own)
        if single and at <= pc and [frame.block for frame in inside] == list(blocks):
            while self.stack[active.blocks + len(inside) :]:
                self._pop()
            self.went_back = True
            run.spline = None
            return at
        if key in self.unfollowed.labels:
            run.rows.label(*key).sources |= run.state.sources
            self.reachable = False
            return pc + 1
        left = next(
            (f for f in own if f.followed and f.block.word in LOOPS - {b"FOR"} and f.block not in blocks),
            None,
        )
        if left is not None and not single:
            return self._abort(left)
        if run.opaque is not None:
            run.forget(run.opaque.effects, f"in the block of line {run.opaque.line}")
        if at > pc:
            active.waiting = active.waiting.set(name, run.merged(active.waiting.get(name), run.flow()))
            self.reachable = False
            return pc + 1
        return self._jump_back(pc, name, key, routine)

    def _jump_back(self, pc: int, name: bytes, key: tuple[int, bytes], routine: Routine) -> int:
        """To a label before: its text is passed again as long as what holds there learns from it."""
        run, flow = self.run, self.run.flow()
        head: LabelHead | None = self.activations[-1].heads.get(name)
        if head is None:
            self.unfollowed.labels.add(key)
            raise Restart
        head.meeting.sources |= flow.state.sources
        raised = flow if head.flow is None else run.raised(head.flow, flow)
        if raised is head.flow:
            self.reachable = False
            return pc + 1
        if self.steps > self.most_steps:
            raised = self._forgotten(raised, routine)
        self._return_to(head.checkpoint)
        head = LabelHead(raised, head.entry, head.checkpoint, head.meeting)
        self.activations[-1].heads = self.activations[-1].heads.set(name, head)
        self._start_at(head)
        return routine.labels[name][0] + 1

    def _is_single(self, frames: list[BlockFrame]) -> bool:
        """Whether only one path leads from the start of the outermost of these frames to here, and no other waits
        further down."""
        active = self.activations[-1]
        if not all(frame.followed and frame.exits is None for frame in frames):
            return False
        return active.returned is None and next(active.waiting.items(), None) is None

    def _exit(self, pc: int) -> int:
        run, own = self.run, self.stack[self.activations[-1].blocks :]
        loop = next((frame for frame in reversed(own) if frame.block.word in LOOPS), None)
        if loop is None or run.opaque is not None:
            return pc + 1
        if loop.followed:
            if self._is_single(own[own.index(loop) :]):
                while self.stack[-1] is not loop:
                    self._pop()
                self._pop()
                return self._after_loop(loop.block)
            if loop.block.word != b"FOR":
                return self._abort(loop)
        loop.exits = run.merged(loop.exits, run.flow())
        self.reachable = False
        return pc + 1

    def _leave(self, pc: int, by_return: bool = False) -> int | None:
        """A RETURN, or the end of a routine."""
        run, active = self.run, self.activations[-1]
        if run.routine is None:
            return pc + 1
        own = self.stack[active.blocks :]
        if not active.blocks and self.reachable and run.state.stop:
            run.rows.stopped_at_end.append((len(run.rows), run.state.sources, run.state.stop))
        if run.walked and not active.blocks and self.reachable:
            run.rows.unfollowed_ends |= run.state.sources
        if by_return and not self._is_single(own):
            loop = next((f for f in own if f.followed and f.block.word in LOOPS - {b"FOR"}), None)
            if loop is not None:
                return self._abort(loop)
            if run.opaque is not None:
                run.forget(run.opaque.effects, f"in the block of line {run.opaque.line}")
            active.returned = run.merged(active.returned, run.flow())
            self.reachable = False
            return pc + 1
        if not active.blocks:
            return None
        flow = run.merged(active.returned, self._here())
        self._continue_with(flow)
        while len(self.stack) > active.blocks:
            self._pop()
        call = self._pop()
        self.activations.pop()
        back = [(run.variables.get(inner), name, path) for inner, name, path in call.returned]
        for name, entry in call.saved:
            run.variables.swap(name, entry)
        routine, run.routine, run.spline = run.routine, call.checkpoint.routine, call.checkpoint.spline
        ended = flow is not None and call.before is not None and bool(call.before.state.ended_later)
        if ended or (flow is None and self.resumes):
            if flow is None:
                self._continue_with(call.before)
            back_to = f"after the call in line {self._item(call.back - 1).line}"
            returned = (name for _, name, _ in call.returned)
            self._end_anywhere({*routine.effects, *returned}, back_to, call.checkpoint.counts[0])
            back = []
        for value, name, path in back:
            if value is not None:
                keep(run, name, path, value)
        if call.lost:
            run.forget(set(call.lost), f"after the call in line {self._item(call.back - 1).line}")
        return call.back

    def _end_anywhere(self, effects: Effects, why: str, first: int = -1) -> None:
        """After a call that an interrupt may have ended, after any of the rows from ``first`` on."""
        run = self.run
        run.forget({"point", *effects}, why)
        meeting = Meeting()
        meeting.sources |= {*run.state.sources, ELSEWHERE}
        if first >= 0:
            meeting.sources.update(range(first, len(run.rows)))
        run.state.sources = frozenset([meeting])

    def _call(self, pc: int, item: Statement, call: Call) -> int:
        run = self.run
        if call.name == b"BAS":
            command(run, item, call.arguments)
            return pc + 1
        routine = run.structure.routines.get(call.name)
        if routine is None and call.name in run.others.routines:
            self._call_other(item, call)
            return pc + 1
        if routine is not None and self._follows(call.name, routine) and self._can_return(call, routine):
            return self._enter_call(pc, call, routine)
        run.mentioned |= identifiers(call.arguments)
        self._called(item, call.name, returned_by(call, run.structure.directions))
        return pc + 1

    def _follows(self, name: bytes, routine: Routine) -> bool:
        """Whether a call is followed: its depth is allowed, and it is none of a routine by itself that maybe runs."""
        run, maybe = self.run, self.not_followed or self.run.walked
        if self.unfollowed.everything or run.opaque is not None or routine.is_main or routine.is_function:
            return False
        later = name in run.structure.later or (maybe and self.shallow)
        if later or routine.start in self.unfollowed.blocks:
            return False
        if maybe and any(frame.block is routine for frame in self.stack):
            return False
        return len(self.activations) <= MOST_CALLS

    def _can_return(self, call: Call, routine: Routine) -> bool:
        """Whether each parameter that comes back is a variable that the subprogram, and the controller, do not know by
        its own name too."""
        run = self.run
        given = [text.strip() for text in split_values(call.arguments)]
        names = [
            found[1].upper()
            for (_, comes_back), text in zip(routine.parameters, given, strict=False)
            if comes_back and (found := _PLACE.match(text))
        ]
        if not names:
            return True
        if len(set(names)) < len(names) or any(name in SYSTEM or name.startswith(b"$") for name in names):
            return False
        if len(run.structure.routines) > MOST_EFFECTS:
            return False  # as long to look through as nobody waits for
        for name in closure(run.structure.routines, [routine.name]):
            inner = run.structure.routines[name]
            first, last = run.code[inner.start], run.code[min(inner.end, len(run.code) - 1)]
            mentioned = self._mentioned(first, last)
            if any(one in mentioned and one not in inner.types for one in names):
                return False
        return True

    def _mentioned(self, first: Item, last: Item) -> frozenset[bytes]:
        """The names between two statements."""
        start, stop = (
            item.at if isinstance(item, Statement) else int(item.motion[0, 0]) for item in (first, last)
        )
        if start not in self.mentioned_from:
            self.mentioned_from[start] = identifiers(self.run.document.raw[start:stop])
        return self.mentioned_from[start]

    def _enter_call(self, pc: int, call: Call, routine: Routine) -> int:
        run, variables = self.run, self.run.variables
        texts = [text.strip() for text in split_values(call.arguments)]
        given: dict[bytes, Entry] = {}
        returned = []
        lost = set()
        for (name, comes_back), text in zip(routine.parameters, texts, strict=False):
            value = run.value(text) if text else None
            given[name] = {} if value is None else {b"": value}
            found = _PLACE.match(text)
            if comes_back and found:
                element = b"" if found[2] is None else index_text(found[2], run.lookup)
                if found[3] or element is None:
                    lost.add(found[1].upper())
                else:
                    returned.append((name, found[1].upper(), b"[" + element + b"]" if element else b""))
        frame = self._push(routine, True)
        frame.back, frame.returned, frame.lost = pc + 1, tuple(returned), frozenset(lost)
        self.activations.append(self._activation())
        own = run.routine.types if run.routine is not None else {}
        names = dict.fromkeys([*own, *routine.types])
        if self.not_followed or run.walked:
            self.spent_not_followed += len(names)
        else:
            self.spent += len(names)
        run.routine = routine
        for name, entry in given.items():
            for key, value in entry.items():
                entry[key] = run.converted(name, value)
        frame.saved = tuple(
            (name, variables.swap(name, variables.entry(given[name]) if name in given else None))
            for name in names
        )
        run.followed[routine.name] = None
        self._comment_after(self._item(routine.start))
        return routine.start + 1

    def _call_functions(self, item: Statement) -> None:
        for name in functions_of(item):
            self._called(item, name, as_effects(identifiers(item.code)))

    def _called(self, item: Statement, name: bytes, words: Set[Effect]) -> None:
        """Takes up that a routine or function ran; ``words``: what may come back from it changed."""
        run = self.run
        called = shown(name)
        why = f"after the call of {called} in line {item.line}"
        routine = run.structure.routines.get(name)
        if not is_harmless(name):
            run.state.stop = max(run.state.stop, Waits.MAYBE)
        if routine is not None:
            run.rows.meetings[b"routine %d" % routine.line].sources |= run.state.sources
            self.text_called.add(name)
            if "point" in routine.effects:
                run.state.sources = together(run.state.sources | {ELSEWHERE})
            run.forget(routine.effects | words, why)
            if run.state.ended_later:
                self._end_anywhere(set(), why)
            if self._starts_events(name):
                run.expect_later(run.structure.later_effects, item.line)
            return
        if is_harmless(name):
            return
        if name in run.others.routines:
            self._after_other(item, name, words)
            return
        run.unread.add(name)
        run.forget({"point", *words}, why)
        run.state.no_insert = run.state.no_insert or f"{called} runs before it and is not read"
        if name.startswith(PATH_FROM_FILE):
            run.add_finding(
                "KRL021", f"{called} reads its path from a file; that path is not corrected", item
            )
        else:
            run.add_finding("KRL010", _not_read(called), item)

    def _starts_events(self, name: bytes) -> bool:
        """Whether a routine, or what it calls, states an interrupt or a trigger: it may happen after the return."""
        if self.event_routines is None:
            run = self.run
            self.event_routines = callers(
                run.structure.routines,
                (
                    one.name
                    for one in run.structure.routines.values()
                    if any(
                        isinstance(item, Statement) and item.word in EVENTS
                        for item in run.code[one.start : one.end + 1]
                    )
                ),
            )
        return name in self.event_routines

    def _call_other(self, item: Statement, call: Call) -> None:
        """A routine of another module: what it leaves is worked out, variables are forgotten."""
        run = self.run
        run.mentioned |= identifiers(call.arguments)
        given = [run.value(text.strip()) if text.strip() else None for text in split_values(call.arguments)]
        before = run.state.copy()
        run.state.stop = max(run.state.stop, Waits.MAYBE)
        returned = returned_by(call, run.structure.directions)
        self._after_other(item, call.name, returned)
        own = {*(run.routine.types if run.routine is not None else ()), *run.declarations.types}
        if not run.others.stay_apart(call, returned - (own - run.declarations.shared)):
            return
        if run.state.ended_later:
            why = f"after the call of {shown(call.name)} in line {item.line}"
            self._end_anywhere(set(), why)
            return
        left = self._exit_of(call.name, before, tuple(given))
        if left is not None:
            why = f"after the call of {shown(call.name)} in line {item.line}"
            take_exit(run.state, before, left, run.frames, why, item.line)
            if left.moves:
                run.rows.note_call(before.sources)
            run.state.unsettle(run.has_tcp_mode, run.has_turning)

    @abstractmethod
    def _exit_of(self, name: bytes, state: ModalState, args: tuple[Value | None, ...]) -> RoutineExit | None:
        """What a routine of another module leaves, called with what holds here; None where that is not followed."""

    def _after_other(self, item: Statement, name: bytes, words: Set[Effect]) -> None:
        """Takes up what a routine of another module may change."""
        run = self.run
        effects = run.effects_of_others[name]
        if "point" in effects:
            run.state.sources = together(run.state.sources | {ELSEWHERE})
        run.forget(effects | words, f"after the call of {shown(name)} in line {item.line}")
        self._note_other(item, name)

    def _note_other(self, item: Statement, name: bytes) -> None:
        """Takes up what else another module does, now or at a time of its own."""
        run, (module, _) = self.run, self.run.others.routines[name]
        run.state.set_apart(module.apart)
        if module.has_trigger:
            run.state.no_insert = TRIGGERED
        run.expect_later(module.structure.later_effects, item.line)
        file = module.document.path.name
        for effect in sorted(one for one in run.effects_of_others[name] if isinstance(one, bytes)):
            if has_unknown_effect(effect):
                run.report_unknown_effect(f"{shown(effect)}, which {file} sets,", item)
        for unread in run.others.unread[name]:
            called = f"{shown(unread)}, which {file} calls,"
            message = f"{called} is not read: base and tool are assumed unchanged by it"
            run.add_finding("KRL010", message, item)

    def _unread(self, item: Statement, name: bytes) -> None:
        """Reports a routine that an interrupt or a trigger runs, and that is not in this file."""
        run = self.run
        if name in run.others.routines:
            self._note_other(item, name)
        elif not is_harmless(name):
            run.unread.add(name)
            message = f"{shown(name)} is not read: it runs at a time of its own; base and tool are assumed unchanged"
            run.add_finding("KRL010", message, item)
