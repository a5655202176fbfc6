"""Blocks of a program: whether they are followed with values that are all known, or passed over once."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from postproc.languages.krl.assignments import with_clause
from postproc.languages.krl.execution_context import BlockFrame, ExecutionContext
from postproc.languages.krl.expressions import Value
from postproc.languages.krl.lexing import LOOPS, NAME, SPLINES, Statement, value_end
from postproc.languages.krl.program_structure import Block
from postproc.languages.krl.target import UnknownValue
from postproc.toolpath import Annotation

BUDGET = 20_000
"""Statements of a file that are followed again, in loops, jumps and calls."""

AFTER_FOR = UnknownValue("KRL002", "the value of a counter after its FOR is not documented")

_REPEATED = LOOPS | {b"DEF"}
_FOR = re.compile(
    rb"FOR[ \t]+("
    + NAME
    + rb")[ \t]*=(.*?)(?<=[ \t)])TO(?![A-Za-z0-9_$])(.*?)(?:(?<=[ \t)])STEP(?![A-Za-z0-9_$])(.*))?\Z",
    re.I | re.S,
)
_THEN = re.compile(rb"(?<![A-Za-z0-9_$])THEN[ \t]*\Z", re.I)
_WITH = re.compile(rb"(?<![A-Za-z0-9_$])WITH(?![A-Za-z0-9_$])(.*)\Z", re.I | re.S)


@dataclass
class UncertainBlocks:
    """What an earlier reading found to be uncertain.

    passed: begin of blocks and routines that are not followed; labels: (begin of the routine, name) of labels to which
    a jump leads that may happen or not; plain: nothing is followed.
    """

    passed: set[int] = field(default_factory=set)
    labels: set[tuple[int, bytes]] = field(default_factory=set)
    plain: bool = False


class BlockFollower:
    """Enters, leaves and takes back blocks.

    spent: statements that were followed again; seen: those that were followed in loops and calls (index); jumped: a
    GOTO led back, so that every line may run again; repeating: loops and calls that are followed and open; text_called:
    routines that were called where it is not known that, or with what, they run; mentioned_from: start of a routine ->
    the names in its text.
    """

    def __init__(self, run: ExecutionContext, uncertain_blocks: UncertainBlocks) -> None:
        self.run, self.uncertain_blocks = run, uncertain_blocks
        self.spent = self.repeating = 0
        self.seen = bytearray(len(run.code))
        self.jumped = False
        self.text_called: set[bytes] = set()
        self.mentioned_from: dict[int, frozenset[bytes]] = {}
        self.comments: dict[int, Annotation] = {}

    def _push(self, block: Block, followed: bool) -> BlockFrame:
        run = self.run
        opened = BlockFrame(
            block, followed, run.state.copy(), run.variables.mark(), len(run.rows), routine=run.routine,
            notes=(len(run.rows.annotations), len(self.comments), len(run.rows.reads), len(run.followed)),
        )  # fmt: skip
        run.stack.append(opened)
        self.repeating += followed and block.word in _REPEATED
        return opened

    def _pop(self) -> BlockFrame:
        opened = self.run.stack.pop()
        self.repeating -= opened.followed and opened.block.word in _REPEATED
        return opened

    def _open(self, pc: int, item: Statement, block: Block) -> int:
        run = self.run
        if block.word in SPLINES:
            opened = self._push(block, True)
            opened.enters = block.word == b"SPLINE" and not run.triggered
            clause = _WITH.search(item.code)
            if clause and with_clause(run, item, clause[1]) is not None:
                run.forget(
                    {"base", "tool"}, f"in the spline of line {block.line}: its WITH is not understood"
                )
            return pc + 1
        if not (block.broken or run.uncertain or pc in self.uncertain_blocks.passed):
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
        if self.uncertain_blocks.plain:
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
            if self.repeating or self.jumped:
                self.spent += 1
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
        if ((last - first) // step) * (block.end - block.start) > BUDGET - self.spent:
            if "point" in block.effects:
                self._report_length(item)
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

    def _report_length(self, item: Statement) -> None:
        message = f"it executes more than the {BUDGET} statements that are followed; it is skipped"
        self.run.add_finding("KRL024", message, item)

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
        """Ends a block; gives where it goes on if that is not after it."""
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
                return block.start + 1
            self._pop()
            run.variables.set(name, b"", AFTER_FOR)
        elif block.word in LOOPS:
            again = True
            if block.word != b"LOOP":
                head = run.code[block.start]
                assert isinstance(head, Statement)
                text = head.code[5:] if block.word == b"WHILE" else item.code[5:]
                value_now = run.value(text)
                if not isinstance(value_now, bool):
                    return self._abort(opened)
                again = value_now == (block.word == b"WHILE")
            if again:
                return block.start + 1
            self._pop()
        else:
            self._pop()
        return None

    def _end_spline(self, item: Statement, opened: BlockFrame) -> None:
        """What a WITH of the spline set ends with it."""
        run, entry = self.run, opened.entry
        state = run.state
        frames = (state.base, state.tool)
        state.base, state.tool, state.feed = entry.base, entry.tool, entry.feed
        state.blend, state.tool_known = entry.blend, entry.tool_known
        state.orientation, state.arc_frame = entry.orientation, entry.arc_frame
        if frames != (state.base, state.tool) and len(run.rows) > opened.rows:
            state.lose_point(f"after the spline of line {opened.block.line}")
        if len(run.rows) > opened.rows:
            run.rows.passing.pop(len(run.rows) - 1, None)  # the last point
            if b"C_" in item.code.upper():
                run.rows.approximated[len(run.rows) - 1] = float("nan")

    def _abort(self, opened: BlockFrame) -> int:
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
        self.uncertain_blocks.passed.add(opened.block.start)
        return opened.back - 1 if opened.back >= 0 else opened.block.start
