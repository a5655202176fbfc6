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
    MODE_CODES,
    RESTORES,
    RETURNS,
    SAVES,
    ExecutionFlow,
    FlowReason,
    macro_modes,
    program_starts,
    uncertain_stretches,
)
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import key

_RESTORED_G = (
    0, 1, 2, 3, 4, 17, 18, 19, 20, 21, 40, 54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3, 61, 80, 81, 82, 83, 90, 91, 90.1,
    91.1, 93, 94, 98, 99,
)  # fmt: skip
_QUIET_M = (0, 1, 7, 8, 9, *MODE_CODES)
_MAY_DO_MORE = (FlowReason.COMPUTED, FlowReason.SKIPPED)
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
    calls = CALLS[1:] if control.saves_modes else CALLS
    forget[m.block[np.isin(m.value, calls)] + 1] = True
    forget[1:] |= (once & (1 << Once.CALL)) != 0
    forget[1:] |= macro_modes(source) > 0
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
    restored, saved = np.zeros(n + 1, np.bool_), execution.saved
    if control.saves_modes or (m.value == SAVES).any():
        restored[m.block[m.value == RESTORES] + 1] = True
    if control.saves_modes:
        known = _kept(source, saved, uncertainty, forget)
        restored[saved[:, 1]] = ~known
        saved = saved[known]
    return ExecutionFlow(
        uncertainty,
        forget[:-1],
        forget[1:],
        execution.called,
        tape,
        entered,
        execution.repeated,
        restored[:-1],
        saved,
    )


def _kept(source: Source, saved: Ints, uncertainty: Ints, forget: Bools) -> Bools:
    """(S,) of ``saved`` (S, 2) of a LinuxCNC whether what is restored is known: where between only modes change that
    words alone state, neither the tool, its length, the spindle's direction nor how far corners are rounded."""
    codes, m = source.column(key("G")), source.column(key("M"))
    other = forget.copy()
    other[codes.block[~np.isin(codes.value, _RESTORED_G)]] = True
    other[m.block[~np.isin(m.value, _QUIET_M)]] = True
    other[:-1] |= source.mask(key("T"), key("H")) | np.isin(uncertainty, _MAY_DO_MORE)
    before = np.append(0, np.cumsum(other))
    alone = np.zeros(len(other) + 1, np.int64)
    switching = m.block[np.isin(m.value, MODE_CODES)]
    worded = source.mask(*(key(letter) for letter in "GFST"))
    alone[switching[worded[switching]]] = 1  # what of its own block it saves is not looked at
    odd = np.append(0, np.cumsum(alone))
    first, last = np.maximum(saved, 0).T
    same = (before[last] == before[first]) & (odd[last] == odd[first])
    return np.asarray((saved[:, 0] >= 0) & same)


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
