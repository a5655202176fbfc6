"""The flow of a program: what runs, in which order and how often, as far as its constants say."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from postproc.dialects.krl import motions
from postproc.dialects.krl.assignments import assign, command, declare, with_clause
from postproc.dialects.krl.bulk import Bulk
from postproc.dialects.krl.expressions import Value
from postproc.dialects.krl.lexing import (
    LOOPS,
    NAME,
    SPLINES,
    Assignment,
    Call,
    Declared,
    Statement,
    identifiers,
    value_end,
)
from postproc.dialects.krl.run import Open, Run
from postproc.dialects.krl.state import Form, State
from postproc.dialects.krl.survey import (
    HIDDEN,
    INLINE,
    PATH_FROM_FILE,
    Block,
    Routine,
    functions_of,
    is_harmless,
)
from postproc.dialects.krl.target import Unclear, shown
from postproc.dialects.krl.variables import Entry
from postproc.toolpath import Annotation

BUDGET = 20_000
"""Statements of a file that are followed inside of loops and called routines."""

MOST_CALLS = 30
"""Calls inside of one another that are followed."""

AFTER_FOR = Unclear("KRL002", "what a counter is behind its FOR is not documented")

REPEATED = LOOPS | {b"DEF"}

_ANNOTATION = re.compile(rb";[ \t]*(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)
_FOR = re.compile(
    rb"FOR[ \t]+("
    + NAME
    + rb")[ \t]*=(.*?)[ \t)]TO(?![A-Za-z0-9_$])(.*?)(?:[ \t)]STEP(?![A-Za-z0-9_$])(.*))?\Z",
    re.I | re.S,
)
_THEN = re.compile(rb"(?<![A-Za-z0-9_$])THEN[ \t]*\Z", re.I)
_WITH = re.compile(rb"(?<![A-Za-z0-9_$])WITH(?![A-Za-z0-9_$])(.*)\Z", re.I | re.S)
_PLAIN_NAME = re.compile(rb"[ \t]*(" + NAME + rb")[ \t]*(\[[ \t]*\d+[ \t]*\])?[ \t]*\Z")


class Restart(Exception):
    """What was taken for certain was not; ``Doubts`` knows it now."""


@dataclass
class Doubts:
    """What an earlier reading found to be uncertain.

    passed: begin of blocks and routines that are not followed; labels: (begin of the routine, name) of labels to which
    a jump leads that may happen or not; plain: nothing is followed.
    """

    passed: set[int] = field(default_factory=set)
    labels: set[tuple[int, bytes]] = field(default_factory=set)
    plain: bool = False


class Flow:
    """Runs a program line by line; ``all`` once."""

    def __init__(self, run: Run, doubts: Doubts) -> None:
        self.run, self.doubts = run, doubts
        self.spent = 0
        self.jumped = False  # a GOTO led back, so that every line may run again
        self.repeating = 0  # loops and calls that are followed and open
        self.text_called: set[bytes] = set()
        self.comments: dict[int, Annotation] = {}

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
        run.idle = False

    def _step(self, pc: int) -> int | None:
        """Takes up a statement; gives the index of the next one, None behind the end."""
        run = self.run
        item = run.code[pc]
        if self.repeating or self.jumped:
            self.spent += len(item) if isinstance(item, Bulk) else 1
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

    # Blocks

    def _push(self, block: Block, followed: bool) -> Open:
        run = self.run
        opened = Open(
            block, followed, run.state.copy(), run.variables.mark(), len(run.rows), routine=run.routine,
            notes=(len(run.rows.annotations), len(self.comments), len(run.rows.reads), len(run.followed)),
        )  # fmt: skip
        run.stack.append(opened)
        self.repeating += followed and block.word in REPEATED
        return opened

    def _pop(self) -> Open:
        opened = self.run.stack.pop()
        self.repeating -= opened.followed and opened.block.word in REPEATED
        return opened

    def _open(self, pc: int, item: Statement, block: Block) -> int:
        run = self.run
        if block.word in SPLINES:
            self._push(block, True)
            clause = _WITH.search(item.code)
            if clause and with_clause(run, item, clause[1]) is not None:
                run.forget(
                    {"base", "tool"}, f"in the spline of line {block.line}: its WITH is not understood"
                )
            return pc + 1
        if not (block.broken or run.unsure or pc in self.doubts.passed):
            following = self._follow(pc, item, block)
            if following is not None:
                return following
        self._push(block, False)
        if block.word in LOOPS:
            run.forget(block.effects, f"in the loop of line {block.line}")
        return pc + 1

    def _follow(self, pc: int, item: Statement, block: Block) -> int | None:
        """Enters a block whose condition is constant; gives where it goes on, None where it is not."""
        run, word = self.run, block.word
        rest = item.code[len(word) :]
        if word == b"IF":
            found = _THEN.search(rest)
            value = run.value(rest[: found.start()]) if found else None
            if not isinstance(value, bool):
                return None
            self._push(block, True)
            if value:
                return pc + 1
            return block.branches[0] + 1 if block.branches else block.end
        if word == b"SWITCH":
            return self._switch(rest, block)
        if self.doubts.plain:
            return None
        if word == b"FOR":
            return self._for(pc, item, block)
        if word == b"WHILE":
            value = run.value(rest)
            if not isinstance(value, bool):
                return None
            if not value:
                return block.end + 1
        if word == b"LOOP" and not block.leaves:
            return None
        self._push(block, True)
        return pc + 1

    def _switch(self, text: bytes, block: Block) -> int | None:
        run = self.run
        value = run.value(text)
        if not isinstance(value, (int, bytes)):
            return None
        for at in block.branches:
            self.spent += 1 if self.repeating or self.jumped else 0
            case = run.code[at]
            assert isinstance(case, Statement)
            wanted = self._values(case.code[4:]) if case.word == b"CASE" else [value]
            if wanted is None:
                return None
            if any(type(w) is type(value) and w == value for w in wanted):
                self._push(block, True)
                return at + 1
        self._push(block, True)
        return block.end

    def _values(self, text: bytes) -> list[Value] | None:
        values: list[Value] = []
        place = 0
        while place < len(text):
            end = value_end(text, place)
            value = self.run.value(text[place:end].strip())
            if not isinstance(value, (int, bytes)):
                return None
            values.append(value)
            place = end + 1
        return values

    def _for(self, pc: int, item: Statement, block: Block) -> int | None:
        run = self.run
        found = _FOR.match(item.code)
        if found is None:
            return None
        numbers = [run.value(text.strip()) for text in (found[2], found[3], found[4] or b"1")]
        first, last, step = numbers
        if not (isinstance(first, int) and isinstance(last, int) and isinstance(step, int) and step):
            return None
        name = found[1].upper()
        opened = self._push(block, True)
        run.variables.set(name, b"", first)
        if (last - first) * step < 0:
            self._pop()
            run.variables.set(name, b"", AFTER_FOR)
            return block.end + 1
        opened.counter = (name, first, last, step)
        return pc + 1

    def _branch(self, pc: int, block: Block) -> int:
        run = self.run
        opened = run.stack[-1] if run.stack else None
        if opened is None or opened.block is not block:
            return pc + 1
        if opened.followed:
            return block.end
        opened.sources = run.rows.joined(opened.sources | run.state.sources)
        run.variables.undo(opened.mark)
        run.state = opened.entry.copy()
        return pc + 1

    def _close(self, item: Statement, block: Block) -> int | None:
        """Ends a block; gives where it goes on if that is not behind it."""
        run = self.run
        if not run.stack or run.stack[-1].block is not block:
            return None
        opened = run.stack[-1]
        if block.word in SPLINES:
            self._pop()
            self._end_spline(item, opened)
        elif not opened.followed:
            self._pop()
            sources = opened.sources | opened.entry.sources | run.state.sources
            run.variables.undo(opened.mark)
            run.state = opened.entry
            word = block.word.decode("latin-1")
            run.forget(block.effects, f"after the {word} block of lines {block.line} to {item.line}")
            run.state.sources = run.rows.joined(sources)
        elif opened.counter is not None:
            name, value, last, step = opened.counter
            value += step
            run.variables.set(name, b"", value)
            if (last - value) * step >= 0:
                opened.counter = (name, value, last, step)
                return block.begin + 1
            self._pop()
            run.variables.set(name, b"", AFTER_FOR)
        elif block.word in LOOPS:
            again = True
            if block.word != b"LOOP":
                head = run.code[block.begin]
                assert isinstance(head, Statement)
                text = head.code[5:] if block.word == b"WHILE" else item.code[5:]
                value_now = run.value(text)
                if not isinstance(value_now, bool):
                    return self._abort(opened)
                again = value_now == (block.word == b"WHILE")
            if again:
                return block.begin + 1
            self._pop()
        else:
            self._pop()
        return None

    def _end_spline(self, item: Statement, opened: Open) -> None:
        """What a WITH of the spline set ends with it."""
        run, entry = self.run, opened.entry
        state = run.state
        frames = (state.base, state.tool)
        state.base, state.tool, state.feed = entry.base, entry.tool, entry.feed
        state.blend, state.tool_stands = entry.blend, entry.tool_stands
        if frames != (state.base, state.tool) and len(run.rows) > opened.rows:
            state.lose_point(f"after the spline of line {opened.block.line}")
        if b"C_" in item.code.upper() and len(run.rows) > opened.rows:
            run.rows.slurred[len(run.rows) - 1] = float("nan")

    def _abort(self, opened: Open) -> int:
        """Takes back what was followed since ``opened``; from now on it is passed over."""
        run = self.run
        while run.stack[-1] is not opened:
            self._pop()
        self._pop()
        run.rows.truncate(opened.rows)
        run.variables.undo(opened.mark)
        run.state, run.routine, run.triggered = opened.entry, opened.routine, False
        annotations, comments, reads, followed = opened.notes
        del run.rows.annotations[annotations:], run.rows.reads[reads:]
        for table, count in ((self.comments, comments), (run.followed, followed)):
            while len(table) > count:
                table.popitem()
        self.doubts.passed.add(opened.block.begin)
        return opened.back - 1 if opened.back >= 0 else opened.block.begin

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
        run.tell(
            "KRL024", f"more than {BUDGET} statements run in loops and calls; the rest is not followed", item
        )
        return at

    # Jumps and calls

    def _label(self, item: Statement, name: bytes) -> None:
        run = self.run
        begin = run.routine.begin if run.routine is not None else -1
        if (begin, name) not in self.doubts.labels:
            return
        effects = {"point", "base", "tool", "feed", "apo", "mode", *run.survey.effects}
        run.forget(effects, f"after the label {shown(name)} in line {item.line}")
        mark = b"label %d " % begin + name
        run.rows.sources[mark] |= run.state.sources
        run.state.sources = frozenset([mark])
        run.tell(
            "KRL020",
            f"a GOTO leads to {shown(name)}: base, tool and position are not known from here on",
            item,
        )

    def _goto(self, pc: int, name: bytes) -> int:
        run, routine = self.run, self.run.routine
        target = routine.labels.get(name) if routine is not None else None
        if target is not None and routine is not None:
            at, blocks = target
            open_blocks = self._open_in_routine()
            inside = [opened for opened in open_blocks if opened.block in blocks]
            certain = not run.unsure and not self.doubts.plain and [o.block for o in inside] == list(blocks)
            if certain:
                while run.stack and run.stack[-1] in open_blocks and run.stack[-1] not in inside:
                    self._pop()
                self.jumped = self.jumped or at <= pc
                return at
            if (routine.begin, name) not in self.doubts.labels:
                self.doubts.labels.add((routine.begin, name))
                self.doubts.passed.update(o.block.begin for o in open_blocks if o.block.word in LOOPS)
                raise Restart
        begin = routine.begin if routine is not None else -1
        run.rows.sources[b"label %d " % begin + name] |= run.state.sources
        return pc + 1

    def _open_in_routine(self) -> list[Open]:
        found: list[Open] = []
        for opened in reversed(self.run.stack):
            if opened.back >= 0:
                break
            found.append(opened)
        return found[::-1]

    def _exit(self, pc: int) -> int:
        run = self.run
        loop = next((o for o in reversed(self._open_in_routine()) if o.block.word in LOOPS), None)
        if loop is None or not loop.followed:
            return pc + 1
        if run.unsure:
            return self._abort(loop)
        while run.stack[-1] is not loop:
            self._pop()
        self._pop()
        return loop.block.end + 1

    def _leave(self, pc: int, kind: str) -> int | None:
        run = self.run
        call = next((opened for opened in reversed(run.stack) if opened.back >= 0), None)
        if kind == "return" and run.unsure:
            return pc + 1 if call is None else self._abort(call)
        if call is None:
            return None if run.routine is not None else pc + 1
        while run.stack[-1] is not call:
            self._pop()
        self._pop()
        back = [(run.variables.get(inner), name, path) for inner, name, path in call.returned]
        for name, entry in call.saved:
            run.variables.replace(name, entry)
        run.routine = call.routine
        for value, name, path in back:
            if value is not None:
                run.variables.set(name, path, value)
        return call.back

    def _call(self, pc: int, item: Statement, said: Call) -> int:
        run = self.run
        if said.name == b"BAS":
            command(run, item, said.arguments)
            return pc + 1
        routine = run.survey.routines.get(said.name)
        known = routine is not None and not (run.unsure or self.doubts.plain or routine.is_main)
        if (
            routine is None
            or not known
            or routine.is_function
            or routine.begin in self.doubts.passed
            or said.name in run.survey.later
            or sum(opened.back >= 0 for opened in run.stack) >= MOST_CALLS
        ):
            run.mentioned |= identifiers(said.arguments)
            self._called(item, said.name, said.arguments)
            return pc + 1
        return self._enter_call(pc, said, routine)

    def _enter_call(self, pc: int, said: Call, routine: Routine) -> int:
        run, variables = self.run, self.run.variables
        texts = []
        place = 0
        while place < len(said.arguments):
            end = value_end(said.arguments, place)
            texts.append(said.arguments[place:end].strip())
            place = end + 1
        given: dict[bytes, Entry] = {}
        returned = []
        for (name, comes_back), text in zip(routine.parameters, texts, strict=False):
            value = run.value(text) if text else None
            given[name] = {} if value is None else {b"": value}
            found = _PLAIN_NAME.match(text)
            if comes_back and found:
                path = (found[2] or b"").replace(b" ", b"").replace(b"\t", b"")
                returned.append((name, found[1].upper(), path))
        opened = self._push(routine, True)
        opened.back, opened.returned = pc + 1, tuple(returned)
        own = run.routine.types if run.routine is not None else {}
        names = dict.fromkeys([*own, *routine.types])
        self.spent += len(names)
        opened.saved = tuple((name, variables.replace(name, given.get(name))) for name in names)
        run.routine = routine
        run.followed[routine.name] = None
        return routine.begin + 1

    def _called(self, item: Statement, name: bytes, given: bytes) -> None:
        """Takes up that a routine or function ran; the names in ``given`` may come back from it changed."""
        run = self.run
        words = identifiers(given)
        called = shown(name)
        why = f"after the call of {called} in line {item.line}"
        routine = run.survey.routines.get(name)
        if routine is not None:
            run.rows.sources[b"routine %d" % routine.line] |= run.state.sources
            self.text_called.add(name)
            run.forget(routine.effects | words, why)
            return
        if is_harmless(name):
            return
        run.forget({"point", *words}, why)
        if name.startswith(PATH_FROM_FILE):
            run.tell("KRL021", f"{called} reads its path from a file; nothing of that is corrected", item)
        else:
            message = f"{called} was not read: after it the position is not known; base and tool are taken as unchanged"
            run.tell("KRL010", message, item)
