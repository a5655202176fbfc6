"""Which base and which tool of the cell a block is in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.dialects.gcode.blocks import Blocks
from postproc.dialects.gcode.control import Group, Once
from postproc.dialects.gcode.flow import Doubt
from postproc.dialects.gcode.words import key
from postproc.geometry import Poses
from postproc.toolpath import FrameRef

TOOL_CHANGE = 6
SYSTEM = ((5201, 5400), (7001, 7999), (14001, 20000))
"""Variables that are work offsets: of Fanuc and Haas (7001, 14001: G54.1 Pn), 5211 to 5400 of LinuxCNC."""


@dataclass(frozen=True, eq=False)
class Spoiled:
    """Offsets that the program itself writes: the cell's base of that number holds no longer.

    at (B,): blocks before which the offset in force changed; bad (B,): blocks whose offset is not the cell's.
    """

    at: Bools
    bad: Bools


def spoiled(given: Blocks) -> Spoiled:
    """G10 L2, G10 L20, and variables that are offsets."""
    n = len(given)
    base = given.modal.force[Group.OFFSET]
    at, bad = np.zeros(n + 1, np.bool_), np.zeros(n, np.bool_)
    events: list[tuple[int, int | None]] = []  # block, number of the base or None for all
    settings = np.flatnonzero(given.modal.has(Once.SETTING))
    if len(settings):
        kind, which = given.number(key("L"))[settings], given.number(key("P"))[settings]
        for block, level, number in zip(settings.tolist(), kind.tolist(), which.tolist(), strict=True):
            stated = given.of(key("L"))[block] >= 0
            if level in (2, 20):
                events.append((block, None if np.isnan(number) else int(number) or int(base[block])))
            elif stated and np.isnan(level):
                events.append((block, None))
    for note in given.text.notes:
        if note.kind == "assign" and _is_offset(note.text):
            events.append((note.block, None))
    first: dict[int | None, int] = {}
    for block, number in sorted(events, key=lambda event: event[0]):
        first.setdefault(number, block)
        at[block + 1] |= number is None or number == base[block]
    rows = np.arange(n)
    for number, block in first.items():
        bad |= (rows > block) & ((base == number) if number is not None else True)
    return Spoiled(at[:n], bad)


def _is_offset(text: str) -> bool:
    if not text.isdigit():
        return not text.startswith("<")
    return any(low <= int(text[:9]) <= high for low, high in SYSTEM)


def tools(given: Blocks) -> tuple[Ints, bool]:
    """(B,) number of the tool in force, -1 where it can not be told; whether the program names any.

    T loads a tool at once, or with M6 in programs that have an M6.  T0 without M6 loads nothing.  A program without a
    tool works with number 1.
    """
    words, n = given.text.words, len(given)
    changes = words.block[np.flatnonzero((words.key == key("M")) & (words.value == TOOL_CHANGE))]
    tape = given.modal.flow.tape
    changes = changes[tape[changes]]
    number = given.number(key("T"))
    named = (given.of(key("T")) >= 0) & tape
    if not len(changes):
        named &= number != 0
    if not named.any():
        return np.ones(n, np.int64), False
    whole = (
        np.isfinite(number) & (number > 0) & (number == np.floor(np.where(np.isfinite(number), number, 0.0)))
    )
    sure = given.modal.flow.doubt == Doubt.NONE
    value = np.where(whole & sure & (number < 1e9), np.where(whole, number, 0), -1).astype(np.int64)
    chosen = _filled(named, value)
    if not len(changes):
        return chosen, True
    loads = np.zeros(n, np.bool_)
    loads[changes] = True
    return _filled(loads, np.where(sure, chosen, -1)), True


def _filled(where: Bools, value: Ints) -> Ints:
    at = np.maximum.accumulate(np.where(where, np.arange(len(where)), -1))
    return np.where(at >= 0, value[at], -1)


def references(base: Ints, tool: Ints, line: Ints) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """Indices (N,) of bases and tools in the frames of a toolpath, -1 where unknown, and these frames."""
    frames: list[FrameRef] = []
    columns = []
    for numbers in (base, tool):
        names, first, inverse = np.unique(numbers, return_index=True, return_inverse=True)
        index = np.full(len(names), -1)
        for i, name in enumerate(names.tolist()):
            if name >= 0:
                index[i] = len(frames)
                # Base 0 is no offset (G500): the control's own coordinates.
                pose = Poses.identity() if numbers is base and name == 0 else None
                frames.append(FrameRef(name, pose, int(line[first[i]])))
        columns.append(index[inverse] if len(numbers) else np.empty(0, np.int64))
    return columns[0], columns[1], tuple(frames)
