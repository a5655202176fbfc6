"""Which base and which tool of the cell a block is in."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.geometry import Poses
from postproc.languages.gcode.blocks import BlockWords
from postproc.languages.gcode.control import Group, Once
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal_fill import everywhere, fill_modal, switched
from postproc.languages.gcode.words import key
from postproc.toolpath import FrameRef

TOOL_CHANGE = 6
LENGTH_CODES = (43.0, 43.4, 43.5, 234.0)
SYSTEM = ((5201, 5400), (7001, 7999), (14001, 20000))
"""Variables that are work offsets: of Fanuc and Haas (7001, 14001: G54.1 Pn), 5211 to 5400 of LinuxCNC."""

_TARGET = re.compile(r"#[ \t]*+(\d++|<)?")


@dataclass(frozen=True, eq=False)
class Spoiled:
    """Offsets that the program itself writes: the cell's base of that number holds no longer.

    at (B,): blocks before which the offset in force changed; bad (B,): blocks whose offset is not the cell's.
    """

    at: Bools
    bad: Bools


def spoiled(given: BlockWords) -> Spoiled:
    """G10 L2, G10 L20, and variables that are offsets."""
    n = len(given)
    base = given.modal.force[Group.OFFSET]
    events: list[tuple[int, int | None]] = []  # block, number of the base or None for all
    settings = np.flatnonzero(given.modal.has(Once.SETTING))
    if len(settings):
        kind, which = given.number(key("L"))[settings], given.number(key("P"))[settings]
        has = given.has(key("L"))[settings]
        for block, level, number, stated in zip(
            settings.tolist(), kind.tolist(), which.tolist(), has.tolist(), strict=True
        ):
            if level in (2, 20):
                events.append((block, None if np.isnan(number) else int(number) or int(base[block])))
            elif stated and np.isnan(level):
                events.append((block, None))
    for note in given.source.notes:
        assigned = note.kind == "assign" and _is_offset(note.text)
        if assigned or (note.kind == "unknown" and note.text.startswith("#")):
            events.append((note.block, None))
    if not events:
        no = everywhere(False, n)
        return Spoiled(no, no)
    at = np.zeros(n + 1, np.bool_)
    first: dict[int | None, int] = {}
    for block, number in sorted(events, key=lambda event: event[0]):
        first.setdefault(number, block)
        at[block + 1] |= number is None or number == base[block]
    written = {number: block for number, block in first.items() if number is not None}
    numbers, blocks = np.array(sorted(written)), np.array([written[number] for number in sorted(written)])
    # From where on the base in force is not the cell's: the first change of its own number, or of all.
    since = np.full(n, first.get(None, n))
    if len(numbers):
        own = np.minimum(np.searchsorted(numbers, base), len(numbers) - 1)
        since = np.where(numbers[own] == base, np.minimum(since, blocks[own]), since)
    return Spoiled(at[:n], np.arange(n) > since)


def _is_offset(assignment: str) -> bool:
    """Whether an assignment may write a work offset: to a variable that is one, or to one that is computed."""
    target = _TARGET.match(assignment)
    if target is None or target[1] is None:
        return target is not None
    return target[1].isdigit() and any(low <= int(target[1][:9]) <= high for low, high in SYSTEM)


def tools(given: BlockWords, loaded: int | None = None) -> tuple[Ints, bool]:
    """(B,) number of the tool in force, -1 where it cannot be determined; whether the program names any.

    T loads a tool at once, or with M6 in programs that have an M6.  T0 without M6 loads nothing.  A program without a
    tool, or with T0 alone, works with number 1.  ``loaded``: the tool at the start of the program, if that is stated.
    """
    first = -1 if loaded is None else loaded
    n, column, m = len(given), given.words(key("T")), given.words(key("M"))
    changes = m.block[m.value == TOOL_CHANGE]
    tape, sure = given.modal.flow.tape, given.modal.flow.reason == FlowReason.NONE
    changes = changes[tape[changes]]
    # The last T of a block counts.
    counts = np.append(column.block[1:] != column.block[:-1], True)[: len(column)] & tape[column.block]
    named = np.flatnonzero(counts & ((column.value != 0) | (len(changes) > 0)))
    if not (column.value[named] != 0).any():
        return everywhere(1 if loaded is None else loaded, n, np.int32), loaded is not None
    block, number = column.block[named], column.value[named]
    whole = (number > 0) & (number == np.floor(number)) & sure[block] & (number < 1e9)
    chosen = fill_modal(n, block, np.where(whole, number, -1).astype(np.int32), first, np.int32)
    if not len(changes):
        return chosen, True
    return fill_modal(n, changes, np.where(sure[changes], chosen[changes], -1), first, np.int32), True


@dataclass(frozen=True, eq=False)
class ToolLengths:
    """changes (B,): another tool length holds from the block on; off (B,): the program has switched it off."""

    changes: Bools
    off: Bools


def tool_lengths(given: BlockWords, tool: Ints) -> ToolLengths:
    """Where a program changes the length of its tool: G43 with another number H or another ``tool`` (B,), G49, a word D
    of a control with such offsets, M6."""
    n, force = len(given), given.modal.force[Group.LENGTH]
    changes, off = switched(force, given.modal.ahead[Group.LENGTH]).copy(), force == 0
    if (force == 1).any():
        codes = given.words(key("G"))
        stated = np.zeros(n, np.bool_)
        stated[codes.block[np.isin(codes.value, LENGTH_CODES)]] = True
        stated |= given.has(key("H"))
        at = np.flatnonzero(stated & (force == 1))
        number = given.number(key("H"))[at]
        number = np.where(np.isnan(number), tool[at], number)
        # Stated again in the other unit, LinuxCNC moves the coordinates by the length in both.
        units = given.modal.force[Group.UNITS][at]
        changes[at[1:][(number[1:] != number[:-1]) | (units[1:] != units[:-1])]] = True
        off &= np.maximum.accumulate(force == 1)
    else:
        off = everywhere(False, n)
    m = given.words(key("M"))
    changes[m.block[m.value == TOOL_CHANGE]] = True
    changes |= switched(tool, int(tool[0]) if n else -1)
    if given.control.offsets is not None:
        edge = given.words(given.control.offsets)
        chosen = fill_modal(n, edge.block, np.nan_to_num(edge.value, nan=-1.0).astype(np.int32), 1, np.int32)
        changes |= switched(chosen, 1)
        off = off | (chosen == 0)
    return ToolLengths(changes, off)


def references(base: Ints, tool: Ints, line: Ints) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """Indices (N,) of bases and (N,) of tools in the frames of a toolpath, of ``base``, ``tool`` and ``line`` (N,), -1
    where unknown, and these frames."""
    frames: list[FrameRef] = []
    columns = []
    for numbers in (base, tool):
        starts = np.flatnonzero(np.diff(numbers, prepend=numbers[:1] - 1))
        names, first = np.unique(numbers[starts], return_index=True)
        index = np.full(len(names), -1, np.int32)
        for i, name in enumerate(names.tolist()):
            if name >= 0:
                index[i] = len(frames)
                # Base 0 is no offset (G500): the control's own coordinates.
                pose = Poses.identity() if numbers is base and name == 0 else None
                frames.append(FrameRef(name, pose, int(line[starts[first[i]]])))
        if len(names) == 1:
            columns.append(everywhere(index[0], len(numbers)))
        else:
            columns.append(index[np.searchsorted(names, numbers)])
    return columns[0], columns[1], tuple(frames)
