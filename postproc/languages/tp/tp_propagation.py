"""Frames, registers and comments in force, propagated over the flow of a TP program.

Every statement is run with what holds on all paths that lead to it.  A motion has one fact, which holds in all of its
executions.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field, replace
from enum import IntEnum
from heapq import heappop, heappush
from typing import NamedTuple

from postproc.languages.core.motion_sources import Meeting, Source, met
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.core.waits import Waits
from postproc.languages.tp.statement_flow import END, StatementFlow
from postproc.languages.tp.tp_statements import (
    ConditionalStatement,
    DisplacementSwitch,
    FrameSelection,
    LoopStart,
    Operand,
    OverrideStatement,
    PositionUse,
    ProgramCall,
    RegisterAssignment,
    RegisterExpression,
    RegisterOperand,
    StatementNotRead,
    TimeoutStatement,
    TpMove,
    TpRemark,
    TpStatement,
    WaitStatement,
)

START, ELSEWHERE = -1, -2
"""In the place of a motion: the start of the program; what the program does not contain."""


class Contradictory(IntEnum):
    """In the place of a comment in force: it differs with the path of the program."""

    CONTRADICTORY = 0


CONTRADICTORY = Contradictory.CONTRADICTORY
Said = TpRemark | Contradictory | None


NO_REGISTERS = PersistentMap(KeyNumbers())


@dataclass(frozen=True, slots=True)
class TpState:
    """``base``, ``tool``: the selected numbers, None where they are not known; ``registers``: number -> value of those
    that are known, the same object where another path adds nothing; ``displaced``: what displaces targets;
    ``override``: factor of speeds, None where it is not known."""

    base: int | None = None
    tool: int | None = None
    registers: PersistentMap = NO_REGISTERS
    displaced: frozenset[bytes] = frozenset()
    override: float | None = 1.0
    force: Said = None
    switch: Said = None

    def joined(self, other: TpState) -> TpState:
        """What holds where two paths meet."""
        if self == other:
            return self
        return TpState(
            self.base if self.base == other.base else None,
            self.tool if self.tool == other.tool else None,
            self.registers.common(other.registers),
            self.displaced | other.displaced,
            self.override if self.override == other.override else None,
            self.force if self.force == other.force else CONTRADICTORY,
            self.switch if self.switch == other.switch else CONTRADICTORY,
        )

    def value(self, operand: Operand) -> float | None:
        if isinstance(operand, RegisterOperand):
            value: float | None = self.registers.get(operand.number)
            return value
        return operand

    def result(self, expression: RegisterExpression) -> float | None:
        """The value of an expression; None where it is not known."""
        one = self.value(expression.first)
        if not expression.operation or one is None:
            return one
        two = self.value(expression.second)
        if two is None:
            return None
        match expression.operation:
            case b"+":
                return one + two
            case b"-":
                return one - two
            case b"*":
                return one * two
        return None  # divisions round as the controller does

    def with_register(self, number: int, value: float | None) -> TpState:
        """Another value of a register, None where it is not known; number -1: any of them may have another one."""
        if number < 0:
            return self.without_registers()
        kept = value if value is not None and abs(value) < 1e9 else None
        return replace(self, registers=self.registers.set(number, kept))

    def without_registers(self) -> TpState:
        return replace(self, registers=PersistentMap(self.registers.numbers))


class Reached(NamedTuple):
    """What holds at a place of the program; ``last``: statements of the motions after which the robot is here;
    ``waits``: whether the program waited since."""

    state: TpState
    last: frozenset[Source] = frozenset([START])
    waits: Waits = Waits.NO

    def joined(self, other: Reached, meeting: Meeting) -> Reached:
        """What holds where two paths meet, at the place of ``meeting``."""
        waits = self.waits if self.waits == other.waits else Waits.MAYBE
        return Reached(self.state.joined(other.state), met(self.last, other.last, meeting), waits)


NOWHERE = frozenset([ELSEWHERE])


@dataclass(slots=True)
class TpPropagation:
    """``before``: of each statement what holds before it, None where it is not run; ``jumps``: statement -> motions
    after which it is run, where that is not the statement before it alone; ``calls``: statement -> program that the
    file does not contain; ``reads``: statement that reads where the robot is -> motions after which; ``unread``:
    statements that are not understood; ``waits``: motions before which the program waits, or may."""

    flow: StatementFlow
    before: list[TpState | None] = field(init=False)
    jumps: dict[int, frozenset[Source]] = field(default_factory=dict)
    calls: dict[int, str] = field(default_factory=dict)
    reads: dict[int, frozenset[Source]] = field(default_factory=dict)
    unread: set[int] = field(default_factory=set)
    waits: dict[int, Waits] = field(default_factory=dict)
    _alters: bool = field(init=False)
    _meetings: defaultdict[int, Meeting] = field(default_factory=lambda: defaultdict(Meeting))

    def __post_init__(self) -> None:
        self.before = [None] * len(self.flow.statements)
        self._alters = any(isinstance(one, TpMove) and one.alters for one in self.flow.statements)

    def run(self, state: TpState) -> None:
        """Follows the program from its first statement."""
        if self.flow.problem is not None or not self.flow.blocks:
            return
        starts = {0: Reached(replace(state, registers=PersistentMap(KeyNumbers())))}
        pending, waiting = [0], {0}
        while pending:
            block = heappop(pending)
            waiting.remove(block)
            for there, after in self._through(block, starts[block], False):
                known = starts.get(there)
                new = (
                    after
                    if known is None
                    else known.joined(after, self._meetings[self.flow.blocks[there][0]])
                )
                if new == known:
                    continue
                starts[there] = new
                if there not in waiting:
                    waiting.add(there)
                    heappush(pending, there)
        for block in sorted(starts):
            self._through(block, starts[block], True)

    def _through(self, block: int, state: Reached, recording: bool) -> list[tuple[int, Reached]]:
        """The blocks that follow one, and what holds there."""
        first, last = self.flow.blocks[block]
        for at in range(first, last):
            one = self.flow.statements[at]
            if recording and isinstance(one, TpMove | TpRemark | StatementNotRead):
                self.before[at] = state.state
                if len(state.last) != 1 or at - 1 not in state.last:
                    self.jumps[at] = state.last
                if state.waits and isinstance(one, TpMove):
                    self.waits[at] = state.waits
            if at == last - 1:
                return self._leave(at, one, state, recording)
            state = self._step(at, one, state, recording)
        return []

    def _leave(self, at: int, one: TpStatement, state: Reached, recording: bool) -> list[tuple[int, Reached]]:
        after = self.flow.after(at)
        states = dict.fromkeys(after, state)
        if isinstance(one, ConditionalStatement):
            done = self._step(at, one.action, state, recording)
            holds = _decided(one, state.state)
            leads = self.flow.targets(one)
            if leads:
                jumps, follow = set(after[1:]), after[0]
                states = dict.fromkeys(after, state)
                if holds is not None:
                    states = dict.fromkeys(jumps if holds else {follow}, state)
            elif END in after and len(after) == 2:
                states = {there: state for there in after if holds is None or (there == END) == holds}
            else:
                states = {
                    after[0]: done
                    if holds
                    else state
                    if holds is False
                    else state.joined(done, self._meetings[-1 - at])
                }
        else:
            done = self._step(at, one, state, recording)
            states = dict.fromkeys(after, done)
        return [(self.flow.block_at[there], new) for there, new in states.items() if there != END]

    def _step(self, at: int, one: TpStatement, reached: Reached, recording: bool) -> Reached:
        state, last, waits = reached
        if isinstance(one, TpMove):
            # where a displaced or interrupted motion ends is not in the text
            state = _nothing_set(state) if one.alters else state
            ends = {ELSEWHERE} if one.problem is not None else {at, ELSEWHERE} if state.displaced else {at}
            return Reached(state, frozenset(ends))
        if isinstance(one, StatementNotRead) and one.moves:
            return Reached(state, frozenset([at]))
        if isinstance(one, PositionUse) and one.reads_place and recording:
            self.reads[at] = self.reads.get(at, frozenset()) | last
        new = self._state_after(at, one, state, recording)
        if isinstance(one, ProgramCall | StatementNotRead):
            return Reached(new, NOWHERE, Waits.MAYBE)
        if isinstance(one, WaitStatement):
            waits = Waits.YES if one.surely else max(waits, Waits.MAYBE)
        elif isinstance(one, TimeoutStatement):
            waits = max(waits, Waits.MAYBE)
        return Reached(new, last, waits)

    def _state_after(self, at: int, one: TpStatement, state: TpState, recording: bool) -> TpState:
        """What holds after a statement that is no motion."""
        match one:
            case TpRemark():
                return _remark(one, state)
            case FrameSelection():
                value = state.result(one.value)
                number = int(value) if value is not None and value == int(value) and value >= 0 else None
                return replace(state, tool=number) if one.is_tool else replace(state, base=number)
            case RegisterAssignment():
                # what a motion calls after some time may set it again
                return state.with_register(one.register, None if self._alters else state.result(one.value))
            case LoopStart():
                return state.with_register(one.register, None)
            case PositionUse():
                return state if one.register is None else state.with_register(one.register, None)
            case OverrideStatement():
                return replace(state, override=None if one.percent is None else one.percent / 100.0)
            case DisplacementSwitch():
                changed = state.displaced | {one.name} if one.starts else state.displaced - {one.name}
                return replace(state, displaced=frozenset(changed))
            case ProgramCall():
                if recording:
                    self.calls.setdefault(at, one.name)
                return _nothing_set(state)
            case StatementNotRead():
                if recording:
                    self.unread.add(at)
                lost = state.displaced | ({b"a statement that is not understood"} if one.displaces else set())
                state = replace(state, override=None, displaced=frozenset(lost))
                return _nothing_set(state)
        return state


def _nothing_set(state: TpState) -> TpState:
    """The same where base, tool and registers may be any."""
    return replace(state.without_registers(), base=None, tool=None)


def _remark(one: TpRemark, state: TpState) -> TpState:
    words = one.text.replace("\t", " ").replace(",", " ").split(" ")
    if words[0].upper() == "FORCE":
        return replace(state, force=one)
    if words[0].upper() == "COMPENSATE":
        return replace(state, switch=one)
    return state


def _decided(one: ConditionalStatement, state: TpState) -> bool | None:
    """Whether a condition holds; None where it is not known."""
    if one.condition is None:
        return None
    left, sign, right = one.condition
    a, b = state.value(left), state.value(right)
    if a is None or b is None:
        return None
    return {b"=": a == b, b"<>": a != b, b"<": a < b, b">": a > b, b"<=": a <= b, b">=": a >= b}[sign]
