"""What of a run is certain: which steps surely run in it, once, and from where."""

from __future__ import annotations

import re

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.control import Control, Once
from postproc.languages.gcode.execution import Execution
from postproc.languages.gcode.execution_flow import (
    CALLS,
    LOCAL,
    RESTORES,
    RETURNS,
    SAVES,
    ExecutionFlow,
    FlowReason,
    program_starts,
    uncertain_stretches,
)
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import key

_CODE = re.compile(r"(?<![A-Z_])[GM][ \t]*[\d#\[]", re.I)


def follow(execution: Execution, control: Control, once: Ints) -> ExecutionFlow:
    """The flow of a program; ``once`` (B,): bits of the Once codes of every block."""
    source = execution.source
    n = len(source.blocks)
    uncertainty = execution.reason.copy() if execution.followed else np.zeros(n, np.int8)
    forget = np.zeros(n + 1, np.bool_)
    tape = execution.tape
    deleted = source.blocks.deleted & (uncertainty == FlowReason.NONE)
    uncertainty[deleted] = FlowReason.DELETED

    m = source.column(key("M"))
    forget[m.block[np.isin(m.value, CALLS)] + 1] = True
    forget[1:] |= (once & (1 << Once.CALL)) != 0
    # text that is not understood may select anything by a code in it
    coded = [note.block for note in source.notes if note.kind == "unknown" and _CODE.search(note.text)]
    coded += [note.block for note in source.notes if note.kind == "call"]
    forget[np.array(coded, np.intp) + 1] = True
    if control.calls:
        forget[1:] |= source.mask(*control.calls)
    forget[1:] &= ~execution.called
    entered = _returned(source, n) | execution.entered
    if not execution.followed:
        edge = np.zeros(n + 1, np.int32)
        for start, end in uncertain_stretches(source, entered):
            edge[start] += 1
            edge[end] -= 1
        if edge.any():
            uncertainty[np.cumsum(edge)[:n] > 0] = FlowReason.FLOW
    computed = [column.block[np.isnan(column.value)] for column in (source.column(key("G")), m)]
    first = min((int(blocks[0]) for blocks in computed if len(blocks)), default=n)
    rest = uncertainty[first:]
    rest[rest == FlowReason.NONE] = FlowReason.COMPUTED
    if not execution.followed:
        _ended(source, control, uncertainty, tape)
    restored = np.zeros(n + 1, np.bool_)
    if (m.value == SAVES).any():
        restored[m.block[m.value == RESTORES] + 1] = True
    return ExecutionFlow(
        uncertainty,
        forget[:-1],
        forget[1:],
        execution.called,
        tape,
        entered,
        execution.repeated,
        restored[:-1],
    )


def _ended(source: Source, control: Control, uncertainty: Ints, tape: Bools) -> None:
    """Marks what is after the end of the program."""
    m, programs = source.column(key("M")), program_starts(source)
    if len(programs) > 1:
        uncertainty[programs[1] :] = FlowReason.PROGRAM
    ends = m.block[np.isin(m.value, [*control.endings, *RETURNS])]
    ends = ends[(uncertainty[ends] == FlowReason.NONE) & tape[ends]]
    if len(ends):
        rest = uncertainty[ends[0] + 1 :]
        # M97 runs what is after the end, as a subprogram.
        rest[rest != FlowReason.PROGRAM] = (
            FlowReason.PROGRAM if (m.value == LOCAL).any() else FlowReason.ENDED
        )


def _returned(source: Source, n: int) -> Bools:
    """(B,) blocks to which M99 P leads, by their N."""
    entered, m, numbers = np.zeros(n, np.bool_), source.column(key("M")), source.column(key("N"))
    returning = m.block[np.isin(m.value, RETURNS)]
    if len(returning) and len(numbers):
        to = source.column(key("P")).last(returning)
        entered[numbers.block[np.isin(numbers.value, to[np.isfinite(to)])]] = True
    return entered
