"""The blocks of a program in the order in which the control runs them, with the values of variables in their words.

Loops with known counts, known branches, jumps and calls of subprograms of the file are followed; a value that is the
same in every run of a block is put into its words.  What may run or not (an unknown condition, a slash) stays in its
place and is marked: what it assigns is unknown after it.  A flow that cannot be followed leaves the order of the text.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.execution_flow import (
    LOCAL,
    MODE_CODES,
    NONE_SAVED,
    RETURNS,
    FlowReason,
    program_starts,
    tape_blocks,
    uncertain_stretches,
)
from postproc.languages.gcode.integer_words import PLAIN_INTEGERS, IntegerWords
from postproc.languages.gcode.run_calls import RunAgain
from postproc.languages.gcode.run_flow import RunFlow
from postproc.languages.gcode.run_state import SUBPROGRAM
from postproc.languages.gcode.source import MACRO, Source
from postproc.languages.gcode.statements import NotFollowed, Structure, structure
from postproc.languages.gcode.variable_values import VariableValues
from postproc.languages.gcode.words import key

RESTARTS = 20
"""How often a program is followed again with more that may run or not."""
MOST_STEPS = 100_000
"""Statements after which, with four more for each of the program, it is not followed again."""


@dataclass(frozen=True, eq=False)
class FoldedWords:
    """Words whose values come from variables: step (K,), row of the run; key (K,); nth (K,): how many words of that key
    are before it in the block; value (K,); how (K,) How."""

    step: Ints
    key: Ints
    nth: Ints
    value: np.ndarray
    how: Ints

    def __len__(self) -> int:
        return len(self.step)


@dataclass(frozen=True, eq=False)
class Execution:
    """The run of a program in E steps.

    text: the program as it is written.  source: its blocks, one a step, with the known values in their words; order
    (E,): the block of the text of each; None where that is the order of the text.  followed: loops, branches and
    calls are; reason (E,) FlowReason where they are.  tape (E,): the block belongs to the program.  called (E,):
    the step calls a subprogram that is followed.  entered (E,): a jump leads to the block.  repeated (E,): the
    block runs in other steps as well.  arrivals (J,): steps that a jump leads to, past what is written before their
    block; reached (R, 2): steps before which the run comes to a block that does not run then, and that block.
    perhaps (P, 4): first and last step of what is written before their blocks and may be passed or not, the number of
    the branch or loop that it is a part of, and what else is known of it (STRAIGHT, ONE_ARM_RUNS).
    saved (S, 2): as of ``ExecutionFlow``.  restarts: blocks of the text with a M99 of the main program that leads
    back; second_pass: the step with which it runs the second time, -1 where it does not.
    folded: the words whose values are put in.  unknown: names whose value was wanted and is not known, which the cell
    may state as no block sets them, and the block where it was first.  missing: names of programs that are called and
    are not in the text."""

    text: Source
    source: Source
    order: Ints | None
    followed: bool
    reason: Ints
    tape: Bools
    called: Bools
    entered: Bools
    repeated: Bools
    folded: FoldedWords
    unknown: Mapping[str, int]
    missing: frozenset[str] = frozenset()
    arrivals: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    reached: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    perhaps: Ints = field(default_factory=lambda: np.empty((0, 4), np.int64))
    saved: Ints = field(default_factory=lambda: NONE_SAVED)
    restarts: tuple[int, ...] = ()
    second_pass: int = -1


def execute(
    source: Source,
    control: Control,
    symbols: Mapping[str, object],
    own: int | None = None,
    integers: IntegerWords = PLAIN_INTEGERS,
    again: int | None = None,
) -> Execution:
    """The run of a program; ``symbols``: values of names that only the controller knows; own: blocks of the program
    itself: those after them are of other files, and where they do not run they are not in the run; integers: what
    lengths without a decimal point mean; again: one of ``restarts``, after which it runs a second time."""
    n = len(source.blocks)
    nothing = np.zeros(n, np.bool_)
    tape = tape_blocks(source)
    plain = Execution(
        source, source, None, False, np.zeros(n, np.int8), tape, nothing, nothing, nothing, _folded([]), {}
    )
    language = control.expressions
    if language is None or not n:
        return plain
    noted = {note.kind for note in source.notes}
    m = source.column(key("M"))
    calls = (
        np.isin(m.value, (SUBPROGRAM, LOCAL, *RETURNS)).any()
        or (source.column(key("G")).value == MACRO).any()
        or (control.calls and source.mask(*control.calls).any())
        or (control.saves_modes and np.isin(m.value, MODE_CODES).any())
    )
    if not noted & {"value", "assign", "if", "open", "close", "while", "jump", "call"} and not calls:
        return plain
    known = {name: float(value) for name, value in symbols.items() if isinstance(value, int | float)}
    wanted: dict[str, int] = {}
    try:
        shape = structure(source.notes)
        opaque: set[int] = set()
        steps = 0
        for _ in range(RESTARTS):
            run = RunFlow(
                source, control, VariableValues(language, known, control.name), shape, opaque, integers, again
            )
            try:
                return _result(run, run.follow(), True, own)
            except RunAgain:
                steps += run.steps
            except NotFollowed:
                if run.lacks_count:
                    wanted = run.unknown
                raise
            if steps > MOST_STEPS + 4 * len(run.special):
                break
    except NotFollowed:
        pass
    run = RunFlow(
        source,
        control,
        VariableValues(language, known, control.name),
        Structure({}, {}, {}, followed=False),
        set(),
        integers,
    )
    run.unknown.update(wanted)
    return _in_text_order(run)


def _folded(rows: list[tuple[int, int, int, float, int]]) -> FoldedWords:
    columns = list(zip(*rows, strict=True)) if rows else [()] * 5
    step, address, nth, how = (np.array(columns[i], np.int64) for i in (0, 1, 2, 4))
    return FoldedWords(step, address, nth, np.array(columns[3], np.float64), how)


def _in_text_order(run: RunFlow) -> Execution:
    """Values where the flow is not followed: what a loop or a branch assigns is unknown from its first block on."""
    run.emit(0, run.n)
    stretches = uncertain_stretches(run.source)
    inside = np.zeros(run.n + 1, np.int32)
    for start, stop in stretches:
        inside[start] += 1
        inside[stop] -= 1
    uncertain = np.cumsum(inside)[: run.n] > 0
    starts = np.flatnonzero(uncertain & ~np.append(False, uncertain[:-1])).tolist()
    stops = (np.flatnonzero(uncertain & ~np.append(uncertain[1:], False)) + 1).tolist()
    ahead = list(zip(starts, stops, strict=True))[::-1]
    for block in run.special:
        while ahead and ahead[-1][0] <= block:
            run.kill(*ahead.pop())
        run.fold(block, block)
        if block in run.calling or block in run.strange:
            run.variables.forget()
        run.assign(block, certain=not uncertain[block] and block not in run.deleted)
    return _result(run, run.n, False)


def _result(run: RunFlow, stop: int, followed: bool, own: int | None = None) -> Execution:
    """The run as arrays; blocks that do not run come last, of the first ``own`` ones."""
    n = run.n
    pieces = [np.arange(start, end) for start, end, _ in run.ranges]
    flags = [
        np.full(end - start, FlowReason.FLOW * uncertain, np.int8) for start, end, uncertain in run.ranges
    ]
    order = np.concatenate(pieces) if pieces else np.empty(0, np.int64)
    many = np.bincount(order, minlength=n)
    rest = np.flatnonzero(many[:own] == 0)
    programs = program_starts(run.source)
    later = programs[1] if len(programs) > 1 else n
    why = np.where(rest >= stop, FlowReason.ENDED, FlowReason.SKIPPED).astype(np.int8)
    why[rest >= later] = FlowReason.PROGRAM
    if (run.source.column(key("M")).value == LOCAL).any():
        why[rest >= stop] = FlowReason.PROGRAM
    for one in run.shape.subprograms.values():
        why[(rest >= one.start) & (rest <= one.stop)] = FlowReason.PROGRAM
    reason = np.concatenate([*flags, why]) if flags else why
    order = np.concatenate([order, rest])
    reason[run.perhaps_run()[order] & (reason == FlowReason.NONE)] = FlowReason.FLOW
    same = len(order) == n and bool((order == np.arange(n)).all())
    folded = _folded(run.rows)
    called, entered = np.zeros(len(order), np.bool_), np.zeros(len(order) + 1, np.bool_)
    called[run.called], entered[run.entered] = True, True
    if not same:
        entered[:-1] |= np.diff(order, prepend=-1) != 1
    held = np.array(run.held, np.int64)
    source = run.source if same and not len(held) else run.source.in_order(order, held)
    source = source.with_values(folded.step, folded.key, folded.nth, folded.value, folded.how)
    return Execution(
        run.source,
        source,
        None if same else order,
        followed,
        reason,
        run.tape[order],
        called,
        entered[:-1],
        many[order] > 1,
        folded,
        run.unknown,
        frozenset(run.missing),
        np.array(run.jumped, np.int64),
        np.array(run.reached, np.int64).reshape(-1, 2),
        np.array(run.conditional, np.int64).reshape(-1, 4),
        np.array(run.saved, np.int64).reshape(-1, 2),
        tuple(dict.fromkeys(run.restarts)),
        run.second_pass,
    )
