"""What is in force at every block: the modal groups, filled forward, and the codes that hold once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.control import UNKNOWN, Control, Group, Move, Once
from postproc.dialects.gcode.flow import Doubt, Flow, follow
from postproc.dialects.gcode.words import Text, key, last_of

_ARGUMENTS = np.array(
    [
        92,
        201,
        203,
        204,
        205,
        208,
        218,
        350,
        425,
        557,
        558,
        566,
        569,
        574,
        665,
        666,
        669,
        851,
        906,
        907,
        908,
        913,
        914,
    ]
)
"""M codes of printers whose X, Y, Z are settings."""
_FORGOTTEN = (Group.MOTION, Group.PLANE, Group.DISTANCE, Group.ARCS, Group.FEED, Group.OFFSET)
"""What other code leaves in another state; that it leaves units or a tool radius in another one is not assumed."""
_FARTHEST_OFFSET = 1e6
"""No control numbers its offsets so far."""

_START = {Group.MOTION: UNKNOWN, Group.OFFSET: 1, Group.PATH: 1}


@dataclass(frozen=True, eq=False)
class Modal:
    """force: group -> (B,) value in force in each block, UNKNOWN where it can not be told.

    once (B,): bits 1 << Once; verb (B,): word that states the motion, -1 where none; unknown (B,): word whose code is
    not known, -1 where none; twice (B,): two codes that state different motions.  states: group -> the blocks of its
    codes.
    """

    force: Mapping[Group, Ints]
    once: Ints
    verb: Ints
    unknown: Ints
    twice: Bools
    flow: Flow
    states: Mapping[Group, Ints]

    def has(self, *once: Once) -> Bools:
        """(B,) blocks with one of these codes."""
        return (self.once & sum(1 << code for code in once)) != 0


def modal(text: Text, control: Control) -> Modal:
    """The state at every block of a program."""
    words, n = text.words, len(text.blocks)
    rows = np.flatnonzero(words.key == key("G"))
    number, known = _numbers(words.value[rows])
    size = max(control.codes) + 1
    group, value = np.full(size, -1), np.zeros(size, np.int64)
    for code, said in control.codes.items():
        group[code], value[code] = said
    inside = known & (number >= 0) & (number < size)
    at = np.where(inside, number, 0)
    groups, values = np.where(inside, group[at], -1), value[at]
    blocks = words.block[rows]

    once = np.zeros(n, np.int64)
    for code in Once:
        once[blocks[(groups == Group.ONCE) & (values == code)]] |= 1 << code
    for code, others in control.also.items():
        for other in others:
            if other.group == Group.ONCE:
                once[blocks[inside & (number == code)]] |= 1 << other.value
    m_rows = np.flatnonzero(words.key == key("M"))
    once[words.block[m_rows[np.isin(words.value[m_rows], _ARGUMENTS)]]] |= 1 << Once.OTHER
    once[words.block[m_rows[words.value[m_rows] == 206]]] |= 1 << Once.SETTING
    named = np.zeros(n, np.bool_)
    named[words.block[np.isin(words.key, [key(letter) for letter in "XYZABC"])]] = True
    once[((once & (1 << Once.STORE)) != 0) & named] |= 1 << Once.HOME
    unknown = np.full(n, -1)
    unknown[blocks[groups < 0]] = rows[groups < 0]

    flow = follow(text, control, once)
    numbered = (groups == Group.OFFSET) & (values >= 100)
    if numbered.any():
        entry = last_of(words, key("P"), n)[blocks]
        given = words.value[np.maximum(entry, 0)]
        fine = (entry >= 0) & (given >= 0) & (given < _FARTHEST_OFFSET)
        values = np.where(numbered, np.where(fine, 100 + np.where(fine, given, 0), UNKNOWN), values).astype(
            np.int64
        )
    selecting = (number == 150) & (groups == Group.POLAR) & (last_of(words, key("H"), n)[blocks] >= 0)
    if selecting.any():
        # An Okuma: G15 H selects the offset, and G54 to G59 with an H are lengths of tools.
        groups = np.where(selecting, Group.OFFSET, groups)
        values = np.where(groups == Group.OFFSET, UNKNOWN, values)
    start = {**_START, **control.start}
    force: dict[Group, Ints] = {}
    for one in Group:
        if one in (Group.ONCE, Group.NONE):
            continue
        own = groups == one
        fill = _Fill(flow, start.get(one, 0), one in _FORGOTTEN)
        if one == Group.MOTION:
            force[one] = _moves(fill, blocks[own], values[own], control.cycle_apart)
        else:
            said, meant = own.copy(), values.copy()
            for code, others in control.also.items():
                for other in others:
                    if other.group == one:
                        said |= inside & (number == code)
                        meant[inside & (number == code)] = other.value
            force[one] = fill(blocks[said], meant[said])
    verb, twice = _verbs(rows, blocks, values, groups == Group.MOTION, n)
    states = {one: _rows(n, blocks[groups == one]) for one in Group}
    return Modal(force, once, verb, unknown, twice, flow, states)


def _numbers(value: Floats) -> tuple[Ints, Bools]:
    tens = value * 10.0
    fine = np.isfinite(tens) & (np.abs(tens) < 1e6)
    number = np.rint(np.where(fine, tens, -1.0)).astype(np.int64)
    return number, fine & (np.abs(np.where(fine, tens, 0.0) - number) < 1e-6)


def _rows(n: int, rows: Ints) -> Ints:
    """``rows`` ascending, each once."""
    mask = np.zeros(n, np.bool_)
    mask[rows] = True
    return np.flatnonzero(mask)


class _Fill:
    """Fills codes forward; what doubtful blocks change, and what follows code that was not read, is unknown."""

    def __init__(self, flow: Flow, start: int, forgets: bool) -> None:
        self._flow, self._start = flow, start
        self._forget = np.flatnonzero(flow.forget) if forgets else np.empty(0, np.int64)

    def __call__(self, at: Ints, value: Ints) -> Ints:
        n = len(self._flow.doubt)
        sure = self._flow.doubt[at] == Doubt.NONE
        tape = self._flow.tape[at]
        lost = self._forget
        filled = self._filled(n, at[sure & tape], value[sure & tape], lost)
        doubtful = ~sure & tape
        if doubtful.any():
            changed = at[doubtful][value[doubtful] != filled[at[doubtful]]]
            after = self._flow.last[changed] + 1
            lost = np.union1d(lost, after[after < n])
            filled = self._filled(n, at[sure & tape], value[sure & tape], lost)
        return filled

    def _filled(self, n: int, at: Ints, value: Ints, lost: Ints) -> Ints:
        latest = np.full(n, -1)
        values = np.concatenate([value, np.full(len(lost), UNKNOWN), [self._start]])
        latest[lost] = len(value) + np.arange(len(lost))
        latest[at] = np.arange(len(at))
        where = np.maximum.accumulate(np.where(latest >= 0, np.arange(n), -1))
        return np.where(where >= 0, values[latest[where]], self._start).astype(np.int64)


def _moves(fill: _Fill, at: Ints, value: Ints, apart: bool) -> Ints:
    """The move in force; G80 gives way to another code in its block, and may lead back to the one before a cycle."""
    quiet = value == Move.NOTHING
    # The last of a block wins: NOTHING comes first.
    order = np.lexsort((~quiet, at))
    at, value = at[order], value[order]
    if not apart:
        return fill(at, value)
    cyclic = np.isin(value, (Move.CYCLE, Move.NOTHING))
    plain = fill(at[~cyclic], value[~cyclic])
    inside = fill(at, (value == Move.CYCLE).astype(np.int64))
    return np.where(inside == 1, Move.CYCLE, plain)


def _verbs(rows: Ints, blocks: Ints, values: Ints, own: Bools, n: int) -> tuple[Ints, Bools]:
    """The word of every block that states its motion; whether two of them differ."""
    mine = np.flatnonzero(own & (values != Move.NOTHING))
    verb = np.full(n, -1)
    verb[blocks[mine]] = rows[mine]
    first = np.full(n, -1)
    first[blocks[mine[::-1]]] = values[mine[::-1]]
    last = np.full(n, -1)
    last[blocks[mine]] = values[mine]
    return verb, first != last
