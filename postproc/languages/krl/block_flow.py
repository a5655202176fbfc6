"""Blocks of a program: followed where their conditions are constant, else all of their paths are joined."""

from __future__ import annotations

import re
from abc import abstractmethod

from postproc.languages.core.motion_sources import ELSEWHERE, together
from postproc.languages.krl.assignments import with_clause
from postproc.languages.krl.execution_context import Flow, SplineBlock
from postproc.languages.krl.expressions import Value
from postproc.languages.krl.flow_frames import BlockFrame
from postproc.languages.krl.lexing import NAME, SPLINES, Statement, cached, identifiers, is_integer, value_end
from postproc.languages.krl.modal_state import ModalState
from postproc.languages.krl.open_blocks import BUDGET, OpenBlocks
from postproc.languages.krl.program_blocks import Block
from postproc.languages.krl.statement_effects import EVERYTHING_AND_COMMENTS, MODAL, Effect
from postproc.languages.krl.target import UnknownValue

AFTER_FOR = UnknownValue("KRL002", "the value of a counter after its FOR is not documented")

_FOR = re.compile(
    rb"FOR[ \t]+("
    + NAME
    + rb")[ \t]*=(.*?)(?<=[ \t)])TO(?![A-Za-z0-9_$])(.*?)(?:(?<=[ \t)])STEP(?![A-Za-z0-9_$])(.*))?\Z",
    re.I | re.S,
)
_THEN = re.compile(rb"(?<![A-Za-z0-9_$])THEN[ \t]*\Z", re.I)
_WITH = re.compile(rb"(?<![A-Za-z0-9_$])WITH(?![A-Za-z0-9_$])(.*)\Z", re.I | re.S)


@cached
def _head_of_for(code: bytes) -> tuple[bytes, tuple[bytes, ...], tuple[Value, ...]] | None:
    """Counter of a FOR, the texts of first value, last value and step, and their values where they are digits."""
    found = _FOR.match(code)
    if found is None:
        return None
    texts = tuple(text.strip() for text in (found[2], found[3], found[4] or b"1"))
    plain = all(text.isdigit() and len(text) < 19 for text in texts)
    return found[1].upper(), texts, tuple(map(int, texts)) if plain else ()


_SET_BY_WITH: dict[str, Effect] = {
    "base": "base", "tool": "tool", "feed": "feed", "blend": "apo", "tool_known": "mode", "orientation": "turning",
    "arc_frame": "turning",
}  # fmt: skip
"""What a WITH sets, and the effect of what changes it."""


def _changed_since(opened: ModalState, state: ModalState) -> set[Effect]:
    """What statements of a spline, or functions that it calls, have changed since its WITH: it stays changed."""
    return {
        effect
        for name, effect in _SET_BY_WITH.items()
        if (now := getattr(state, name)) != (before := getattr(opened, name))
        and not (now != now and before != before)
    }


class BlockFlow(OpenBlocks):
    """Enters and leaves blocks."""

    def _open(self, pc: int, item: Statement, block: Block) -> int:
        run = self.run
        if not self.reachable and not block.has_labels:
            return max(block.end, pc + 1)  # one that the last statement opens has no other end
        if block.word in SPLINES:
            self._open_spline(item, block)
            return pc + 1
        if block.broken or run.opaque is not None:
            frame = self._push(block, False)
            if self.reachable:
                self._continue_with(self._forgotten(run.flow(), block))
            frame.before = self._here()
            run.opaque = run.opaque or block
            self._comment_after(item)
            return pc + 1
        if block.word in (b"IF", b"SWITCH"):
            return self._open_branches(pc, item, block)
        if self.reachable and not block.is_entered and pc not in self.unfollowed.blocks:
            following = self._follow(pc, item, block)
            if following is not None:
                return following
        frame = self._push(block, False)
        frame.head = frame.before
        long = self.steps > self.most_steps or block.end - block.start > BUDGET
        if frame.head is not None and long:
            frame.head = self._forgotten(frame.head, block)
        return self._enter_pass(frame, item)

    def _open_spline(self, item: Statement, block: Block) -> None:
        run = self.run
        frame = self._push(block, True)
        clause = _WITH.search(item.code)
        if self.reachable and clause and with_clause(run, item, clause[1]) is not None:
            run.forget({"base", "tool"}, f"in the spline of line {block.line}: its WITH is not understood")
        frame.opened = run.state.copy()
        enters = block.word == b"SPLINE" and not run.state.no_insert
        run.spline = SplineBlock(block.line, frame.checkpoint.counts[0], enters)

    def _open_branches(self, pc: int, item: Statement, block: Block) -> int:
        chosen = self._chosen(pc, item, block) if self.reachable else None
        frame = self._push(block, chosen is not None)
        if chosen is not None and not block.has_labels:
            if chosen == block.end:
                return chosen
            self._comment_after(self._item(chosen))
            return chosen + 1
        is_if = block.word == b"IF"
        frame.chosen = chosen
        others = any(is_if or self._item(at).word == b"DEFAULT" for at in block.branches)
        frame.falls_through = chosen == block.end if chosen is not None else not others
        if not is_if or chosen not in (None, pc):
            self.reachable = False
        self._comment_after(item)
        return pc + 1

    def _chosen(self, pc: int, item: Statement, block: Block) -> int | None:
        """Index of the branch that a constant condition chooses, that of the end for none; None where any may run."""
        run, rest = self.run, item.code[len(block.word) :]
        if block.word == b"IF":
            found = _THEN.search(rest)
            value = run.value(rest[: found.start()]) if found else None
            if not isinstance(value, bool):
                return None
            return pc if value else block.branches[0] if block.branches else block.end
        value = run.value(rest)
        if not isinstance(value, (int, bytes)):
            return None
        for at in block.branches:
            if self.repeating or self.went_back:
                self.spent += 1
            case = self._item(at)
            if case.word == b"DEFAULT" and at != block.branches[-1]:
                return None
            wanted = self._values(case.code[4:]) if case.word == b"CASE" else [value]
            if wanted is None:
                return None
            if any(type(w) is type(value) and w == value for w in wanted):
                return at
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

    def _follow(self, pc: int, item: Statement, block: Block) -> int | None:
        """Enters a loop that runs as constants say; gives where it goes on, None where it does not."""
        run, word = self.run, block.word
        if self.unfollowed.everything or (self.shallow and (self.not_followed or run.walked)):
            return None
        if word == b"FOR":
            return self._for(pc, item, block)
        if word == b"WHILE":
            value = run.value(item.code[5:])
            if not isinstance(value, bool) or (
                value and item.code[5:].strip().upper() == b"TRUE" and not block.leaves
            ):
                return None
            if not value:
                return self._after_loop(block)
        if word == b"LOOP" and not block.leaves:
            return None
        if word == b"REPEAT" and not self._can_be_decided(block):
            return None
        self._push(block, True)
        self._comment_after(item)
        return pc + 1

    def _after_loop(self, block: Block) -> int:
        """Where it goes on behind a loop that ends without its last line."""
        self._comment_after(self._item(block.end))
        return block.end + 1

    def _can_be_decided(self, block: Block) -> bool:
        """Whether the condition of an UNTIL is a constant before its loop, or the loop may make it one."""
        text = self._item(block.end).code[5:]
        if "all" in block.effects or not block.effects.isdisjoint(identifiers(text)):
            return block.end - block.start <= BUDGET  # so long a one is not followed to a second pass
        return isinstance(self.run.value(text), bool)

    def _bounds(self, item: Statement) -> tuple[bytes, list[Value]] | None:
        """Counter, and first value, last value and step of a FOR."""
        head = _head_of_for(item.code)
        if head is None:
            return None
        name, texts, constants = head
        return name, list(constants) or [self.run.value(text) for text in texts]

    def _for(self, pc: int, item: Statement, block: Block) -> int | None:
        run = self.run
        bounds = self._bounds(item)
        if bounds is None:
            return None
        name, (first, last, step) = bounds
        if run.type_of(name) == b"REAL":
            return None  # a counter is an INT
        if not (isinstance(first, int) and isinstance(last, int) and isinstance(step, int) and step):
            return None
        if ((last - first) // step) * (block.end - block.start) > BUDGET - self.spent:
            if "point" in block.effects:
                self._report_length(item)
            return None
        frame = self._push(block, True)
        run.variables.set(name, b"", first)
        if (last - first) * step < 0:
            self._pop()
            run.variables.set(name, b"", AFTER_FOR)
            return self._after_loop(block)
        frame.counter = (name, first, last, step)
        self._comment_after(item)
        return pc + 1

    def _enter_pass(self, frame: BlockFrame, item: Statement) -> int:
        """Begins a pass over a loop that runs any number of times, with what holds at its head."""
        run, block = self.run, frame.block
        self._continue_with(frame.head)
        frame.exits = None
        if frame.before is not None:
            frame.meeting.sources = set(frame.before.state.sources)
        if frame.head is None:
            return block.start + 1
        run.state.sources = frozenset([frame.meeting])
        if block.word == b"WHILE":
            value = run.value(item.code[5:])
            if value is not True:
                frame.exits = run.flow()
            if value is False:
                self.reachable = False
        elif block.word == b"FOR":
            bounds = self._bounds(item)
            if bounds is None:
                frame.exits = run.flow()
            else:
                name, (first, last, step) = bounds
                run.variables.line = block.line
                run.variables.set(
                    name, b"", UnknownValue("KRL002", f"it counts in the FOR of line {block.line}")
                )
                frame.head = Flow(frame.head.state, run.variables.facts)
                known = all(isinstance(value, int) for value in (first, last, step))
                if not (known and (last - first) * step >= 0):  # type: ignore[operator]
                    frame.exits = run.flow()
        self._comment_after(item)
        return block.start + 1

    def _branch(self, pc: int, block: Block) -> int | None:
        """Where it goes on; None where the block ends, as the branch before is the one that runs."""
        frame = self.stack[-1] if self.stack else None
        if frame is None or frame.block is not block:
            return pc + 1
        if self.run.opaque is not None:
            self._end_opaque(frame)
            return pc + 1
        if frame.followed and not block.has_labels:
            return None
        frame.exits = self.run.merged(frame.exits, self._here())
        self._continue_with(frame.before if frame.chosen in (None, pc) else None)
        return pc + 1

    def _close(self, item: Statement, block: Block) -> int | None:
        """Ends a block; gives where it goes on if that is not after it."""
        run = self.run
        if not self.stack or self.stack[-1].block is not block:
            return None
        frame = self.stack[-1]
        if block.word in SPLINES:
            self._pop()
            self._end_spline(item, frame)
        elif run.opaque is not None:
            self._pop()
            self._end_opaque(frame)
        elif block.word in (b"IF", b"SWITCH"):
            self._pop()
            if not frame.followed or block.has_labels:
                flow = run.merged(frame.exits, self._here())
                self._continue_with(run.merged(flow, frame.before) if frame.falls_through else flow)
        elif not frame.followed:
            return self._end_pass(frame, item)
        elif not self.reachable:
            self._pop()
            self._continue_with(frame.exits)
        elif frame.counter is not None:
            name, _, last, step = frame.counter
            reached = run.value(name)  # its own statements may have set it
            if not is_integer(reached):
                return self._abort(frame)
            value = reached + step
            run.variables.set(name, b"", value)
            if (last - value) * step >= 0:
                frame.counter = (name, value, last, step)
                self._comment_after(self._item(block.start))
                return block.start + 1
            self._leave_loop(frame)
            run.variables.set(name, b"", AFTER_FOR)
        else:
            again = self._goes_on(item, block)
            if again is None:
                return self._abort(frame)
            if again:
                self._comment_after(self._item(block.start))
                return block.start + 1
            self._leave_loop(frame)
        return None

    def _end_opaque(self, frame: BlockFrame) -> None:
        """After a branch of a block whose structure is not understood: nothing is known of what ran."""
        sources = self.run.state.sources | {ELSEWHERE}
        self._continue_with(frame.before)
        if frame.block.has_labels:
            self.reachable = True
            self.run.forget(
                EVERYTHING_AND_COMMENTS, f"after line {frame.block.line}, whose block is not understood"
            )
            self.run.state.form = None
        self.run.state.sources = together(sources | self.run.state.sources)

    def _leave_loop(self, frame: BlockFrame) -> None:
        """After the last pass of a loop that is followed."""
        self._pop()
        self._continue_with(self.run.merged(frame.exits, self._here()))

    def _goes_on(self, item: Statement, block: Block) -> bool | None:
        """Whether a loop takes another pass; None where that is not known."""
        if block.word not in (b"WHILE", b"REPEAT"):
            return True
        text = self._item(block.start).code[5:] if block.word == b"WHILE" else item.code[5:]
        value = self.run.value(text)
        return value == (block.word == b"WHILE") if isinstance(value, bool) else None

    def _end_pass(self, frame: BlockFrame, item: Statement) -> int | None:
        """The end of a loop that runs any number of times: another pass as long as its head learns from it."""
        run, block = self.run, frame.block
        leaves: Flow | None = None
        if self.reachable:
            again = self._goes_on(item, block) if block.word == b"REPEAT" else True
            if again is not True:
                leaves = run.flow()
            if block.word == b"WHILE":
                self._call_functions(self._item(block.start))
            if again is not False:
                back = run.flow()
                frame.meeting.sources |= back.state.sources
                head = back if frame.head is None else run.raised(frame.head, back)
                if head is not frame.head:
                    if self.steps > self.most_steps:
                        head = self._forgotten(head, block)
                    self._return_to(frame.checkpoint)
                    self.stack.append(frame)
                    self._count()
                    frame.head = head
                    return self._enter_pass(frame, self._item(block.start))
                if block.word == b"FOR":
                    leaves = back
        self._pop()
        self._continue_with(run.merged(frame.exits, leaves))
        bounds = self._bounds(self._item(block.start)) if block.word == b"FOR" and self.reachable else None
        if bounds is not None:
            run.variables.set(bounds[0], b"", AFTER_FOR)
        return None

    @abstractmethod
    def _comment_after(self, item: Statement) -> None:
        """Takes up the comment of a line behind whose statement paths go on, if one does."""

    @abstractmethod
    def _call_functions(self, item: Statement) -> None:
        """Takes up that the expressions of a statement call functions."""

    def _end_spline(self, item: Statement, frame: BlockFrame) -> None:
        """What a WITH of the spline set ends with it."""
        run, entry, first = self.run, frame.checkpoint.flow.state, frame.checkpoint.counts[0]
        run.spline = None
        if not self.reachable:
            return
        if frame.before is None:  # a jump led into it
            run.forget({*MODAL, "point"}, f"after the spline of line {frame.block.line}")
            return
        state = run.state
        frames, changed = (state.base, state.tool), _changed_since(frame.opened or entry, state)
        state.base, state.tool, state.feed = entry.base, entry.tool, entry.feed
        state.blend, state.tool_known = entry.blend, entry.tool_known
        state.orientation, state.arc_frame = entry.orientation, entry.arc_frame
        if changed:
            run.forget(changed, f"after the spline of line {frame.block.line}, in which it is changed")
        if len(run.rows) > first:
            if frames != (state.base, state.tool):
                state.lose_point(f"after the spline of line {frame.block.line}")
            run.rows.passing.pop(len(run.rows) - 1, None)  # the last point
            if b"C_" in item.code.upper():
                run.rows.approximated[len(run.rows) - 1] = float("nan")
