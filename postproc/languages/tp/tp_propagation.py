"""Frames, registers and comments in force, propagated over the flow of a TP program.

Every statement is run with what holds on all paths that lead to it.  A motion has one fact, which holds in all of its
executions.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from postproc.languages.core.comments_in_force import Varying, join_comments, place_of
from postproc.languages.core.field_joins import FieldJoins, either, lost
from postproc.languages.core.flow_runner import FlowRunner
from postproc.languages.core.motion_sources import ELSEWHERE, START, Meeting, Source, met
from postproc.languages.core.persistent_map import KeyNumbers, PersistentMap
from postproc.languages.core.rounded_numbers import are_comparable, computed
from postproc.languages.core.waits import Waits
from postproc.languages.tp.statement_flow import StatementFlow, TpStep
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
    SpeedChange,
    StatementNotRead,
    TimeoutStatement,
    TpMove,
    TpRemark,
    TpStatement,
    WaitStatement,
)

Said = TpRemark | Varying | None


NO_REGISTERS = PersistentMap(KeyNumbers())


@dataclass(frozen=True, slots=True)
class TpState:
    """``base``, ``tool``: the selected numbers, None where they are not known; ``registers``: number -> value of those
    that are known, the same object where another path adds nothing; ``displaced``: what displaces targets;
    ``override``: factor of speeds, None where it is not known; ``slowed``: what OVERRIDE does not end may change them
    as well."""

    base: int | None = None
    tool: int | None = None
    registers: PersistentMap = NO_REGISTERS
    displaced: frozenset[bytes] = frozenset()
    override: float | None = 1.0
    slowed: bool = False
    force: Said = None
    switch: Said = None

    def joined(self, other: TpState) -> TpState:
        """What holds where two paths meet."""
        changed = _JOINS.changes(self, other)
        return replace(self, **changed) if changed else self

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
                return computed(one + two, one, two)
            case b"-":
                return computed(one - two, one, two)
            case b"*":
                return computed(one * two, one, two)
        return None  # divisions round as the controller does

    def with_register(self, number: int, value: float | None) -> TpState:
        """Another value of a register, None where it is not known; number -1: any of them may have another one."""
        if number < 0:
            return self.without_registers()
        kept = value if value is not None and abs(value) < 1e9 else None
        return replace(self, registers=self.registers.set(number, kept))

    def without_registers(self) -> TpState:
        return replace(self, registers=PersistentMap(self.registers.numbers))


_JOINS = FieldJoins(
    {
        "base": lost(None),
        "tool": lost(None),
        "registers": PersistentMap.common,
        "displaced": frozenset.union,
        "override": lost(None),
        "slowed": either,
        "force": join_comments,
        "switch": join_comments,
    }
)


@dataclass(slots=True)
class Reached:
    """What holds at a place of the program; ``last``: statements of the motions after which the robot is here;
    ``waits``: whether the program waited since."""

    state: TpState
    last: frozenset[Source] = frozenset([START])
    waits: Waits = Waits.NO

    def copy(self) -> Reached:
        return Reached(self.state, self.last, self.waits)

    def join(self, other: Reached, meeting: Meeting) -> bool:
        """Takes in what holds where another path meets this one, at the place of ``meeting``; whether anything
        changed."""
        before = self.copy()
        self.state = self.state.joined(other.state)
        self.last = met(self.last, other.last, meeting)
        self.waits = self.waits if self.waits == other.waits else Waits.MAYBE
        return self.state is not before.state or (self.last, self.waits) != (before.last, before.waits)

    @property
    def known(self) -> PersistentMap:
        """What is known of registers."""
        return self.state.registers

    def forget(self) -> None:
        """Makes every register unknown that the program has set."""
        self.state = self.state.without_registers()

    def is_same(self, other: Reached) -> bool:
        return self == other


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
    _runner: FlowRunner[StatementFlow, Reached] = field(init=False)

    def __post_init__(self) -> None:
        self.before = [None] * len(self.flow.statements)
        self._alters = any(isinstance(one, TpMove) and one.alters for one in self.flow.statements)
        self._runner = FlowRunner(self._after)

    def run(self, state: TpState) -> None:
        """Follows the program from its first statement."""
        if self.flow.problem is None:
            registers = PersistentMap(KeyNumbers())
            self._runner.run(self.flow, Reached(replace(state, registers=registers)), True)

    def _after(self, flow: StatementFlow, at: int, reached: Reached) -> list[tuple[int, Reached]]:
        """Where a block leads, and what holds there."""
        block = flow.blocks[at]
        for step in block.steps:
            if self._runner.recording:
                self._record(step, reached)
            self._step(step.one, step.at, reached)
        leads = [block.follow, *block.further]
        if block.condition is not None:
            place, one = block.condition
            if self._runner.recording:
                self._record(TpStep(place, one.action), reached)
            holds = _decided(one, reached.state)
            leads = [block.follow, block.otherwise]
            if holds is not None:
                leads = leads[:1] if holds else leads[1:]
        return [(there, reached) for there in leads]

    def _record(self, step: TpStep, reached: Reached) -> None:
        at, one = step
        match one:
            case ProgramCall(name=name) | TpMove(called=name) if name:
                self.calls.setdefault(at, name)
            case PositionUse(reads_place=True):
                self.reads[at] = self.reads.get(at, frozenset()) | reached.last
            case StatementNotRead(moves=False):
                self.unread.add(at)
        if isinstance(one, TpMove | TpRemark | StatementNotRead) and one is self.flow.statements[at]:
            self.before[at] = reached.state
            if reached.last != {at - 1}:
                self.jumps[at] = reached.last
            if reached.waits and isinstance(one, TpMove):
                self.waits[at] = reached.waits

    def _step(self, one: TpStatement, at: int, reached: Reached) -> None:
        """Runs a statement."""
        state = reached.state
        if isinstance(one, TpMove):
            # where a displaced or interrupted motion ends is not in the text
            ends = {ELSEWHERE} if one.problem is not None else {at, ELSEWHERE} if state.displaced else {at}
            reached.last, reached.waits = frozenset(ends), Waits.NO
            if one.alters:
                reached.state = _nothing_set(state)
            return
        if isinstance(one, StatementNotRead) and one.moves:
            reached.last, reached.waits = frozenset([at]), Waits.NO
            return
        reached.state = self._state_after(one, state)
        if isinstance(one, ProgramCall | StatementNotRead):
            reached.last, reached.waits = NOWHERE, Waits.MAYBE
        elif isinstance(one, WaitStatement):
            reached.waits = Waits.YES if one.surely else max(reached.waits, Waits.MAYBE)
        elif isinstance(one, TimeoutStatement):
            reached.waits = max(reached.waits, Waits.MAYBE)

    def _state_after(self, one: TpStatement, state: TpState) -> TpState:
        """What holds after a statement that is no motion."""
        match one:
            case TpRemark():
                place = place_of(one.text)
                return replace(state, **{place: one}) if place else state  # type: ignore[arg-type]
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
            case SpeedChange():
                return replace(state, slowed=True)
            case DisplacementSwitch():
                changed = state.displaced | {one.name} if one.starts else state.displaced - {one.name}
                return replace(state, displaced=frozenset(changed))
            case ProgramCall():
                return _nothing_set(state)
            case StatementNotRead():
                lost = state.displaced | ({b"a statement that is not understood"} if one.displaces else set())
                state = replace(
                    state, override=None, slowed=state.slowed or one.slows, displaced=frozenset(lost)
                )
                return _nothing_set(state)
        return state


def _nothing_set(state: TpState) -> TpState:
    """The same where base, tool and registers may be any."""
    return replace(state.without_registers(), base=None, tool=None)


def _decided(one: ConditionalStatement, state: TpState) -> bool | None:
    """Whether a condition holds; None where it is not known."""
    if one.condition is None:
        return None
    left, sign, right = one.condition
    a, b = state.value(left), state.value(right)
    if a is None or b is None or not are_comparable(a, b):
        return None
    return {b"=": a == b, b"<>": a != b, b"<": a < b, b">": a > b, b"<=": a <= b, b">=": a >= b}[sign]
