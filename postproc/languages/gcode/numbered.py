"""Which base and which tool of the cell a block is in."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.base.units import DEG
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.control import Group, Once
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal_fill import everywhere, fill_modal, switched
from postproc.languages.gcode.settable_frames import written_frames
from postproc.languages.gcode.words import key
from postproc.toolpath import FrameRef

TOOL_CHANGE = 6
OFFSET_LEVELS = (2.0, 20.0)
"""L of a G10 that writes work offsets."""
LENGTH_CODES = (43.0, 43.4, 43.5, 234.0)
SYSTEM = ((5201, 5400), (7001, 7999), (14001, 20000))
"""Variables that are work offsets: of Fanuc and Haas (7001, 14001: G54.1 Pn), 5211 to 5400 of LinuxCNC."""
FANUC_SYSTEM = ((2401, 2999), (3005, 3005), (5500, 5700), (26000, 26999), (100001, 115350))
"""Further ones of a Fanuc: work offsets by their old numbers (2500 to 2806; 2401 on: offsets of tools of lathes), the
setting of mm or inch, offsets of fixtures on a rotary table, errors of set-up, work offsets of many axes (operator's
manuals of the series 0i, 16i and 30i, system variables)."""
LENGTHS = ((2000, 2200), (2200, 2400), (10000, 10999), (11000, 11999))
"""Variables of a Fanuc after the first number are lengths of tools, or the wear of these, up to the second."""

_BASE_FRAME = re.compile(
    r"\$(?:P_(?:(?!PFRAME)[A-Z0-9]*FRAME|(?!UIFR)[A-Z0-9]*FR)|AA_(?:OFF|ETRANS|DRF))(?![A-Z])", re.I
)
"""Variables of a Sinumerik that move all work offsets; $P_UIFR is one of these, $P_PFRAME the programmed frame."""
_WRITTEN_TOOL = re.compile(
    r"(?!\$TC_(?:DP(?:1|6|7|8|9|10|11|15|16|17|18|19|20|24|25)|DPCE|DPH|TP\d*|MOP\w*+)[ \t]*+\[)"
    r"\$TC_\w++(?:[ \t]*+\[[ \t]*+(\d{1,9}+)[ \t]*+[\],])?+", re.I
)  # fmt: skip
"""Data of a tool, but for what moves nothing: its type, radius, corners, wear of these, names and monitoring."""
_TARGET = re.compile(r"#[ \t]*+(\d++|<)?")


STATED = 1 << 28
"""Numbers from here on are those of work offsets that the program itself states, in ``WorkOffsets.stated``."""


@dataclass(frozen=True, eq=False)
class StatedOffset:
    """A work offset as the program sets it: its number, which one it is, and where it is in the machine."""

    number: int
    index: int
    pose: Poses


@dataclass(frozen=True, eq=False)
class WorkOffsets:
    """base (B,): number of the work offset in force; that of the cell, STATED and more of one in ``stated``, -1
    where it is not known.  changed (B,): blocks before which the offset in force became another one."""

    base: Ints
    changed: Bools
    stated: tuple[StatedOffset, ...]


def work_offsets(words: BlockWords) -> WorkOffsets:
    """The cell's offsets, with those that the program writes by G10 L2 and L20, or by variables that are offsets."""
    n, base = len(words), words.modal.force[Group.OFFSET]
    events = _offset_events(words)
    if not events:
        return WorkOffsets(base, everywhere(False, n), ())
    changed = np.zeros(n + 1, np.bool_)
    result = np.array(base)
    stated: dict[tuple[float, ...], StatedOffset] = {}
    written: dict[int, Floats] = {}
    lost = False  # what moves all offsets moves those too that are written later
    blocks = [block for block, _, _ in events]
    for (block, number, values), stop in zip(events, [*blocks[1:], n - 1], strict=True):
        changed[block + 1] |= number is None or number == base[block]
        if number is None:
            lost = True
        else:
            before = written.get(number, _NOWHERE)
            written[number] = np.where(np.isnan(values), before, values) if values is not None else _NOWHERE
        rows = slice(block + 1, stop + 1)
        here = base[rows]
        for one in np.unique(here).tolist():
            if one in written or lost:
                values = _NOWHERE if lost else written[one]
                result[rows][here == one] = _stated(one, values, stated)
    return WorkOffsets(result, changed[:n], tuple(stated.values()))


_NOWHERE = np.full(6, np.nan)
MOST_STATED = 1000
"""Offsets that a program states; what more it writes is not known."""


def _stated(number: int, values: Floats, stated: dict[tuple[float, ...], StatedOffset]) -> int:
    """The number of a work offset with ``values`` (6,) X, Y, Z [m] and angles [rad] about Z, the new Y and the new X;
    -1 where unknown."""
    if np.isnan(values).any() or number < 0:
        return -1
    same = (float(number), *values.tolist())
    if same not in stated:
        if len(stated) == MOST_STATED:
            return -1
        pose = Poses.from_abc(values[:3], values[3:])
        stated[same] = StatedOffset(number, len(stated), pose)
    return STATED + stated[same].index


def _offset_events(words: BlockWords) -> list[tuple[int, int | None, Floats | None]]:
    """Blocks that write an offset, its number or None for all, and its X, Y, Z [m] and angles [rad] as of
    ``_stated``, NaN where they stay; None where they are not known."""
    base, fanuc = words.modal.force[Group.OFFSET], words.control.increments
    events: list[tuple[int, int | None, Floats | None]] = []
    settings = np.flatnonzero(words.modal.has(Once.SETTING))
    if len(settings):
        level, which = words.number(key("L")), words.number(key("P"))
        values = np.stack([*(words.lengths(one) for one in AXES[:3]), words.number(key("R")) * DEG], axis=1)
        read = (
            (words.modal.flow.reason == FlowReason.NONE)
            & ~words.has(*AXES[3:])
            & ~words.ambiguous
            & ~words.twice
        )
        if fanuc:  # in G91 the values are added
            read &= (words.modal.force[Group.DISTANCE] == 0) & ~words.has(key("R"))
        present = np.stack([words.has(one) for one in (*AXES[:3], key("R"))], axis=1)
        read &= ~(present & np.isnan(values)).any(axis=1)
        # An angle that no block states is that of the cell: none.
        turned = present[settings, 3].any()
        angle = np.where(present[:, 3] | fanuc | (not turned), np.nan_to_num(values[:, 3]), np.nan)
        values = np.concatenate([values[:, :3], angle[:, None], np.zeros((len(words), 2))], axis=1)
        has = words.has(key("L"))
        for block in settings.tolist():
            kind, number = level[block], which[block]
            if kind not in (2, 20):
                if has[block] and np.isnan(kind):
                    events.append((block, None, None))
                continue
            if np.isnan(number):
                events.append((block, None, None))
                continue
            if fanuc and kind == 2 and number == 0:
                # The external offset moves all others.
                if not (read[block] and not np.nan_to_num(values[block]).any()):
                    events.append((block, None, None))
                continue
            if fanuc and kind == 20:
                number, kind = 100 + number, 2
            chosen = int(number) or int(base[block])
            events.append((block, chosen, values[block] if kind == 2 and read[block] else None))
    for note in words.source.notes:
        assigned = note.kind == "assign" and _is_offset(note.text, fanuc)
        if assigned or (note.kind == "unknown" and note.text.startswith("#")):
            events.append((note.block, None, None))
    # of a block that writes one and one that selects it, the first comes first
    return sorted([*events, *written_frames(words)], key=lambda event: (event[0], event[2] is not None))


def _rewritten(words: BlockWords, used: Ints) -> Iterator[tuple[int, int | None]]:
    """Blocks that write data of a tool that a motion before them has, and its number, None for any: the cell can state
    only what it is before or after; used (B,): numbers that blocks have."""
    notes = [note for note in words.source.notes if note.kind == "tool data"]
    if not notes:
        return
    moving = np.flatnonzero(words.motion)
    numbers, first = np.unique(used[moving], return_index=True)
    begins = dict(zip(numbers.tolist(), moving[first].tolist(), strict=True))
    for note in notes:
        found = _WRITTEN_TOOL.match(note.text)
        if found is None:
            continue
        number = None if found[1] is None else int(found[1])
        start = min(begins.values(), default=len(used)) if number is None else begins.get(number, len(used))
        if start < note.block:
            yield note.block, number


def _is_offset(assignment: str, fanuc: bool) -> bool:
    """Whether an assignment may write a work offset: to a variable that is one, or to one that is computed."""
    if _BASE_FRAME.match(assignment):
        return True
    target = _TARGET.match(assignment)
    if target is None or target[1] is None:
        return target is not None
    ranges = (*SYSTEM, *FANUC_SYSTEM) if fanuc else SYSTEM
    return target[1].isdigit() and any(low <= int(target[1][:9]) <= high for low, high in ranges)


def tools(words: BlockWords, loaded: int | None = None) -> tuple[Ints, bool]:
    """(B,) number of the tool in force, -1 where it cannot be determined; whether the program names any.

    T loads a tool at once, or with M6 in programs that have an M6.  T0 without M6 loads nothing.  A program without a
    tool, or with T0 alone, works with number 1.  ``loaded``: the tool at the start of the program, if that is stated.
    """
    first = -1 if loaded is None else loaded
    n, column, m = len(words), words.words(key("T")), words.words(key("M"))
    changes = m.block[m.value == TOOL_CHANGE]
    tape, sure = words.modal.flow.tape, words.modal.flow.reason == FlowReason.NONE
    changes = changes[tape[changes]]
    stated = _stated_tools(words)
    # The last T of a block counts.
    counts = np.append(column.block[1:] != column.block[:-1], True)[: len(column)] & tape[column.block]
    named = np.flatnonzero(counts & ((column.value != 0) | (len(changes) > 0)))
    if not (column.value[named] != 0).any() and not len(stated[0]):
        alone = everywhere(1 if loaded is None else loaded, n, np.int32)
        return _without_rewritten(words, alone), loaded is not None
    block, number = column.block[named], column.value[named]
    whole = (number > 0) & (number == np.floor(number)) & sure[block] & (number < 1e9)
    loads = block, np.where(whole, number, -1).astype(np.int32)
    if len(changes):
        chosen = fill_modal(n, *loads, first, np.int32)
        loads = changes, np.where(sure[changes], chosen[changes], -1)
    at, which = (np.concatenate(pair) for pair in zip(loads, stated, strict=True))
    order = np.argsort(at, kind="stable")
    return _without_rewritten(words, fill_modal(n, at[order], which[order], first, np.int32)), True


def _stated_tools(words: BlockWords) -> tuple[Ints, Ints]:
    """Blocks (K,) that say which tool is loaded, without loading it (M61 Q2), and its numbers (K,), -1 if unknown."""
    code, m = words.control.states_tool, words.words(key("M"))
    at = m.block[m.value == code] if code is not None else np.empty(0, np.int64)
    if not len(at):
        return at, np.empty(0, np.int32)
    flow, number = words.modal.flow, words.number(key("Q"))[at]
    whole = (
        (number > 0) & (number == np.floor(number)) & (number < 1e9) & (flow.reason[at] == FlowReason.NONE)
    )
    return at[flow.tape[at]], np.where(whole, number, -1).astype(np.int32)[flow.tape[at]]


def _without_rewritten(words: BlockWords, tool: Ints) -> Ints:
    """(B,) the numbers of tools, -1 from where the program writes other lengths of a tool that it has used."""
    lost: dict[int | None, int] = {}
    for block, number in _rewritten(words, tool):
        lost.setdefault(number, block)
    moving = np.flatnonzero(words.motion)
    for block, number in written_lengths(words):
        used = moving[tool[moving] == number]
        if len(used) and used[0] < block:
            lost[number] = min(block, lost.get(number, block))
    if not lost:
        return tool
    numbers, which = np.unique(tool, return_inverse=True)
    until = np.array([min(lost.get(one, len(tool)), lost.get(None, len(tool))) for one in numbers.tolist()])
    return np.where(np.arange(len(tool)) < until[which], tool, np.int32(-1))


def written_lengths(words: BlockWords) -> Iterator[tuple[int, int]]:
    """Blocks that write a variable of a Fanuc that is the length of a tool or its wear, and the tool's number."""
    for note in words.source.notes if words.control.increments else ():
        target = _TARGET.match(note.text) if note.kind == "assign" else None
        if target is None or not (target[1] or "").isdigit():
            continue
        for low, high in LENGTHS:
            if low < int(target[1][:9]) <= high:
                yield note.block, int(target[1][:9]) - low


def _stated_lengths(words: BlockWords) -> Ints:
    """(K,) blocks that say which tool length is active: G43, and H while it is."""
    codes = words.words(key("G"))
    stated = words.has(key("H"))
    stated[codes.block[np.isin(codes.value, LENGTH_CODES)]] = True
    return np.flatnonzero(stated & (words.modal.force[Group.LENGTH] == 1))


def outdated_lengths(words: BlockWords, tool: Ints) -> Bools:
    """(B,) blocks in which the length of another tool than ``tool`` (B,) is active, as G43 was before the tool was
    loaded.  G43 without H takes the loaded tool in LinuxCNC, the last H on a Fanuc."""
    n, at = len(words), _stated_lengths(words)
    if not len(at):
        return everywhere(False, n)
    if words.control.keeps_length:
        h = words.number(key("H"))
        number = np.where(np.isnan(h), tool, h).clip(-1, 1e9).astype(np.int32)
    else:
        number = _active_h(words)
    active = fill_modal(n, at, number[at], 0, np.int32)
    # what the block of the number itself contradicts is reported there
    at = at if words.control.keeps_length else at[words.has(key("H"))[at]]
    then = fill_modal(n, at, tool[at], 0, np.int32)
    outdated = (active != 0) & (tool > 0) & (active != tool) & (then != tool)
    return np.asarray(outdated & (words.modal.force[Group.LENGTH] == 1))


def _active_h(words: BlockWords) -> Ints:
    """(B,) the last number H, which is not an argument of a call or a setting; -1 where there is none."""
    h = words.words(key("H"))
    own = ~words.modal.has(Once.CALL, Once.SETTING)[h.block]
    numbers = np.nan_to_num(h.value[own], nan=-1.0).clip(-1, 1e9).astype(np.int32)
    return fill_modal(len(words), h.block[own], numbers, -1, np.int32)


@dataclass(frozen=True, eq=False)
class ToolLengths:
    """changes (B,): another tool length holds from the block on; off (B,): the program has switched it off."""

    changes: Bools
    off: Bools


def tool_lengths(words: BlockWords, tool: Ints) -> ToolLengths:
    """Where a program changes the length of its tool: G43 with another number H or another ``tool`` (B,), or after a
    G10 that writes lengths; G49, a word D of a control with such offsets, M6."""
    n, force = len(words), words.modal.force[Group.LENGTH]
    changes, off = switched(force, words.modal.ahead[Group.LENGTH]).copy(), force == 0
    if (force == 1).any():
        at = _stated_lengths(words)
        number = words.number(key("H"))[at]
        number = np.where(np.isnan(number), tool[at], number)
        # Stated again in the other unit, LinuxCNC moves the coordinates by the length in both.
        units = words.modal.force[Group.UNITS][at]
        changes[at[1:][(number[1:] != number[:-1]) | (units[1:] != units[:-1])]] = True
        written = np.flatnonzero(
            words.modal.has(Once.SETTING) & ~np.isin(words.number(key("L")), OFFSET_LEVELS)
        )
        if len(written):
            changes[at[at > written[0]]] = True
            # Fanuc takes a new length at once, LinuxCNC with the next G43
            changes[written] |= words.control.increments
        off &= np.maximum.accumulate(force == 1)
        if words.control.increments:  # length number 0 is none
            none = _active_h(words) == 0
            off = off | (none & (force == 1))
            changes |= switched(none.astype(np.int8), 0)
    else:
        off = everywhere(False, n)
    m = words.words(key("M"))
    at = m.block[m.value == TOOL_CHANGE]
    if words.control.keeps_length:
        at = at[tool[at] < 0]
    changes[at] = True
    changes |= switched(tool, int(tool[0]) if n else -1)
    if words.control.offsets is not None:
        edge = words.words(words.control.offsets)
        chosen = fill_modal(n, edge.block, np.nan_to_num(edge.value, nan=-1.0).astype(np.int32), 1, np.int32)
        changes |= switched(chosen, 1)
        changes[edge.block[np.isnan(edge.value)]] = True
        named = words.words(key("T"))
        none = fill_modal(n, named.block, (named.value == 0).astype(np.int8), 0, np.int8)
        off = off | (chosen == 0) | (none == 1)
    return ToolLengths(changes, off)


def references(
    base: Ints, tool: Ints, line: Ints, stated: tuple[StatedOffset, ...] = ()
) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """Indices (N,) of bases and (N,) of tools in the frames of a toolpath, of ``base``, ``tool`` and ``line`` (N,), -1
    where unknown, and these frames; stated: see ``WorkOffsets``."""
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
                if numbers is base and name >= STATED:
                    frames.append(FrameRef(None, stated[name - STATED].pose, int(line[starts[first[i]]])))
                    continue
                frames.append(FrameRef(name, pose, int(line[starts[first[i]]])))
        if len(names) == 1:
            columns.append(everywhere(index[0], len(numbers)))
        else:
            columns.append(index[np.searchsorted(names, numbers)])
    return columns[0], columns[1], tuple(frames)
