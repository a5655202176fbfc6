"""What is in force at every block: the modal groups, filled forward, and the codes that hold once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.languages.gcode.certain_flow import follow
from postproc.languages.gcode.control import UNKNOWN, Control, Group, ModalCode, Move, Once
from postproc.languages.gcode.execution import Execution
from postproc.languages.gcode.execution_flow import NONE_SAVED, ExecutionFlow, FlowReason
from postproc.languages.gcode.modal_fill import everywhere, fill_modal, switched
from postproc.languages.gcode.source import Source, WordColumn
from postproc.languages.gcode.words import key

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
_FORGOTTEN = (Group.MOTION, Group.PLANE, Group.DISTANCE, Group.FEED, Group.OFFSET)
"""What other code leaves in another state; that it leaves units, a tool radius or what I J K are in another one is not
assumed."""
_SAVED = (
    Group.MOTION, Group.PLANE, Group.DISTANCE, Group.UNITS, Group.FEED, Group.FEED_UNITS, Group.OFFSET, Group.PATH,
    Group.RADIUS, Group.DIAMETER, Group.AXIAL, Group.EULER, Group.ORIENTED, Group.SPINDLE,
)  # fmt: skip
"""What SAVE of a subprogram restores: G functions, not transformations and values of words (Siemens, programming
manual "job planning", SAVE)."""
_RESTORED = (
    Group.PLANE, Group.DISTANCE, Group.ARCS, Group.UNITS, Group.FEED, Group.FEED_UNITS, Group.OFFSET, Group.PATH,
    Group.RETURN, Group.LENGTH, Group.LENGTHS, Group.RADIUS, Group.DIAMETER, Group.SPINDLE,
)  # fmt: skip
"""What M72 and M73 restore: not what kind of motion it is (LinuxCNC, M codes, "Save Modal State")."""
CALLING_M = (96, 97, 98, 99, 198)
"""M codes that have a P."""
_FIXTURES = (542, 544)
"""G54.2 P, G54.4 P of a Fanuc: offsets that turn with a table, or for a part that is not straight; with P0 none."""
_LENGTHS = (430, 434, 435, 440, 490, 2340)
"""Codes of tool lengths, of which the H of their block is."""
_FARTHEST_OFFSET = 1e6
"""No control numbers its offsets so far."""

_START = {Group.MOTION: UNKNOWN, Group.OFFSET: 1, Group.PATH: 1}


@dataclass(frozen=True, eq=False)
class Modal:
    """force: group -> (B,) value in force in each block, UNKNOWN where it cannot be determined; ahead: group -> the
    value in the block ahead of the first one.

    once (B,): bits 1 << Once; states (B,): a code states the motion; strange: codes that are not known, by block, the
    last of each; twice (B,): two codes state different motions; more (B,): codes beside those of motion, plane,
    coordinates and units.  units (B,): codes state mm or inch.
    unused (B,): a word I, J, K, P, Q, L or R belongs to none of the block's codes, nor to its motion.
    """

    force: Mapping[Group, Ints]
    ahead: Mapping[Group, int]
    once: Ints
    states: Bools
    unknown_codes: WordColumn
    twice: Bools
    more: Bools
    units: Bools
    unused: Bools
    flow: ExecutionFlow

    def has(self, *once: Once) -> Bools:
        """(B,) blocks with one of these codes."""
        return np.asarray((self.once & sum(1 << code for code in once)) != 0)

    @cached_property
    def unknown(self) -> Bools:
        """(B,) blocks with a code that is not known."""
        mask = np.zeros(len(self.once), np.bool_)
        mask[self.unknown_codes.block] = True
        return mask

    def with_value(self, group: Group, value: int) -> Modal:
        """The same with ``value`` of ``group`` in force all along."""
        return self.with_values(group, everywhere(value, len(self.once), np.int8), value)

    def with_values(self, group: Group, values: Ints, ahead: int) -> Modal:
        """The same with ``values`` (B,) of ``group`` in force, ``ahead`` ahead of the first block."""
        return replace(self, force={**self.force, group: values}, ahead={**self.ahead, group: ahead})

    def switched(self, group: Group) -> Bools:
        """(B,) blocks in which another value is in force than in the block ahead."""
        return switched(self.force[group], self.ahead[group])

    def part(self, start: int, stop: int) -> Modal:
        """The blocks start .. stop - 1."""
        rows = slice(start, stop)
        ahead = {group: int(force[start - 1]) for group, force in self.force.items()} if start else self.ahead
        return Modal(
            {group: force[rows] for group, force in self.force.items()},
            ahead,
            self.once[rows],
            self.states[rows],
            self.unknown_codes.part(start, stop),
            self.twice[rows],
            self.more[rows],
            self.units[rows],
            self.unused[rows],
            self.flow.part(start, stop),
        )


def modal(execution: Execution, control: Control, base: int | None = None) -> Modal:
    """The state at every block of a program; ``base``: number of the work offset at its start, if that is stated."""
    source = execution.source
    n = len(source.blocks)
    codes = source.column(key("G"))
    blocks = codes.block
    number, inside, groups, values = decode_g_codes(codes.value, control)

    once = np.zeros(n, np.int32)
    for code in np.unique(values[groups == Group.ONCE]).tolist():
        once[blocks[(groups == Group.ONCE) & (values == code)]] |= 1 << code
    also = _Also(control, number, inside)
    for code in Once:
        once[blocks[also.says(Group.ONCE, code)]] |= 1 << code
    m = source.column(key("M"))
    once[m.block[np.isin(m.value, _ARGUMENTS)]] |= 1 << Once.OTHER
    once[m.block[m.value == 206]] |= 1 << Once.SETTING
    storing = np.flatnonzero(once & (1 << Once.STORE))
    if len(storing):
        named = source.mask(*(key(letter) for letter in "XYZABC"))
        once[storing[named[storing]]] |= 1 << Once.HOME
    odd = np.flatnonzero(groups < 0)
    odd = odd[np.append(blocks[odd][1:] != blocks[odd][:-1], True)[: len(odd)]]
    strange = WordColumn(blocks[odd], codes.value[odd], codes.how[odd])

    flow = follow(execution, control, once)
    groups, values = _offsets(source, control, number, groups, values, blocks)
    groups, values = _polar_or_offset(flow, number, groups, values, blocks)
    start = {**_START, **control.start, **({} if base is None else {Group.OFFSET: base})}
    force: dict[Group, Ints] = {}
    for one in Group:
        if one in (Group.ONCE, Group.NONE):
            continue
        own = groups == one
        fill = _Fill(flow, start.get(one, 0), one, control.saves_modes)
        if one == Group.MOTION:
            force[one] = _moves(fill, blocks[own], values[own], control.cycle_apart)
        else:
            some, assigned = also.added(one, own, values)
            force[one] = fill(blocks[some], assigned[some])
    states, twice = _verbs(blocks, values, groups == Group.MOTION, n)
    quiet = states.astype(np.int8)
    for one in (Group.PLANE, Group.DISTANCE, Group.ARCS, Group.UNITS):
        quiet[_rows(n, blocks[groups == one])] += 1
    more = np.bincount(blocks, minlength=n) != quiet
    units = np.zeros(n, np.bool_)
    units[blocks[groups == Group.UNITS]] = True
    ahead = {one: int(values[0]) if n else 0 for one, values in force.items()}
    unused = _unused(source, control, blocks, groups, values, number, force)
    return Modal(force, ahead, once, states, strange, twice, more, units, unused, flow)


_PLAIN = (
    Group.MOTION, Group.PLANE, Group.DISTANCE, Group.ARCS, Group.UNITS, Group.FEED, Group.OFFSET, Group.PATH,
    Group.LENGTH, Group.RADIUS, Group.RETURN,
)  # fmt: skip
"""Groups whose codes have no words of their own, but those in ``_OWN``."""
_ENDS = (Group.TURNED, Group.SCALED, Group.POLAR, Group.PLACED, Group.SPINDLE)
"""Groups of modes whose end has none either (G69, G50, G15, G97)."""
_WORDLESS_M = (*range(10), 13, 14, 30, 48, 49, 60)
"""M codes of stops, spindle, tool change and coolant, which use none of these words beside a motion."""
_OWN = {"P": (540, 541, 1540, 640), "Q": (640,)}
"""Tenfold numbers of the codes of these groups that have such words: G54.1 P, G54 P, G154 P, G64 P Q."""
_WORDLESS = (Move.RAPID, Move.LINE, Move.NOTHING, UNKNOWN)
_CURVED = (Move.CLOCKWISE, Move.COUNTER, Move.THROUGH)


def _unused(
    source: Source,
    control: Control,
    blocks: Ints,
    groups: Ints,
    values: Ints,
    number: Ints,
    force: Mapping[Group, Ints],
) -> Bools:
    """(B,) blocks with a word that nothing in them uses; of a control that is not of ISO code only those of arcs."""
    n = len(source.blocks)
    unused = np.zeros(n, np.bool_)
    if control.expressions is None:
        return unused
    letters = "IJKPQLR" if control.iso else "IJKR"
    # P gives the turns of an arc of some controls only.
    straight = "LQ" if control.turns[0] == key("P") else "LQP"
    using = np.zeros(n, np.bool_)  # a code that is free to have any word
    using[blocks[~np.isin(groups, _PLAIN) & ~(np.isin(groups, _ENDS) & (values == 0))]] = True
    m, axis = source.column(key("M")), source.mask(*(key(letter) for letter in "XYZABC"))
    using[m.block[~np.isin(m.value, _WORDLESS_M) | ~axis[m.block]]] = True
    for group in (Group.MACRO, Group.FOREIGN, Group.FACE, Group.BENT):
        using |= force[group].astype(bool)
    move = force[Group.MOTION]
    using |= ~np.isin(move, (*_WORDLESS, *_CURVED))
    curved = np.isin(move, _CURVED)
    for letter in letters:
        has = source.mask(key(letter))
        if not has.any():
            continue
        own = np.zeros(n, np.bool_)
        own[blocks[np.isin(number, _OWN.get(letter, ()))]] = True
        unused |= has & ~using & ~own & ~(curved & (letter not in straight))
    if control.increments:
        # X of a dwell is a time; beside P, or with other axes, controls of this kind have no meaning for it
        dwells = np.zeros(n, np.bool_)
        dwells[blocks[number == 40]] = True
        unused |= dwells & axis & (source.mask(key("P")) | source.mask(*(key(letter) for letter in "YZABC")))
    return unused


def decode_g_codes(codes: Floats, control: Control) -> tuple[Ints, Bools, Ints, Ints]:
    """Of G codes (K,): ten times their number (K,), whether a control may have it (K,); its Group (K,), -1 if it is not
    known there, and what it says of that (K,)."""
    number, known = _numbers(codes)
    size = max(control.codes) + 1
    group, value = np.full(size, -1, np.int8), np.zeros(size, np.int32)
    for code, what in control.codes.items():
        group[code], value[code] = what
    inside = known & (number >= 0) & (number < size)
    at = np.where(inside, number, 0)
    return number, inside, np.where(inside, group[at], np.int8(-1)), value[at]


class _Also:
    """What else some codes say."""

    def __init__(self, control: Control, number: Ints, inside: Bools) -> None:
        self._rows = {
            code: (np.flatnonzero(inside & (number == code)), others)
            for code, others in control.also.items()
            if (number == code).any()
        }

    def says(self, group: Group, value: int) -> Ints:
        """Codes that say ``value`` of ``group``."""
        rows = [rows for rows, others in self._rows.values() if ModalCode(group, value) in others]
        return np.concatenate([np.empty(0, np.intp), *rows])

    def added(self, group: Group, own: Bools, values: Ints) -> tuple[Bools, Ints]:
        """Codes that say something of ``group``, and what."""
        some, assigned = own, values
        for rows, others in self._rows.values():
            for other in others:
                if other.group == group:
                    some, assigned = (some.copy(), assigned.copy()) if some is own else (some, assigned)
                    some[rows], assigned[rows] = True, other.value
        return some, assigned


def _offsets(
    source: Source, control: Control, number: Ints, groups: Ints, values: Ints, blocks: Ints
) -> tuple[Ints, Ints]:
    """Groups and values with the offsets that a word P or H gives."""
    numbered = (groups == Group.OFFSET) & (values >= 100)
    if control.increments and (first := (groups == Group.OFFSET) & (number == 540)).any():
        # G54 P is G54.1 P of a Fanuc, where no other code of the block has the P
        m = source.column(key("M"))
        taken = np.zeros(len(source.blocks), np.bool_)
        taken[m.block[np.isin(m.value, CALLING_M)]] = True
        taken[blocks[(groups == Group.ONCE) | (groups == Group.MACRO) | (number == 640)]] = True
        numbered |= first & (source.mask(key("P")) & ~taken)[blocks]
    if numbered.any():
        given = source.column(key("P")).last(blocks)
        fine = (given >= 0) & (given < _FARTHEST_OFFSET)
        chosen = np.where(fine, 100 + np.where(fine, given, 0), UNKNOWN).astype(np.int32)
        values = np.where(numbered, chosen, values)
    fixture = np.isin(number, _FIXTURES) & (groups == Group.BENT)
    if fixture.any():
        none = fixture & (source.column(key("P")).last(blocks) == 0)
        groups = np.where(none, np.int8(Group.NONE), groups)
        values = np.where(none, np.int32(0), values)
    selecting = (number == 150) & (groups == Group.POLAR)
    if selecting.any():
        # An Okuma: G15 H selects the offset, and G54 to G59 with an H are lengths of tools; beside G43 of a Fanuc the H
        # is that of the length.
        lengths = np.zeros(len(source.blocks), np.bool_)
        lengths[blocks[np.isin(number, _LENGTHS)]] = True
        selecting &= source.mask(key("H"))[blocks] & ~lengths[blocks]
        if selecting.any():
            groups = np.where(selecting, np.int8(Group.OFFSET), groups)
            values = np.where(groups == Group.OFFSET, np.int32(UNKNOWN), values)
    return groups, values


def _polar_or_offset(
    flow: ExecutionFlow, number: Ints, groups: Ints, values: Ints, blocks: Ints
) -> tuple[Ints, Ints]:
    """Groups and values where G113 ends a mode only if one is in force; else it is an offset of a Haas, as G110 is."""
    polar = groups == Group.FACE
    ending = (number == 1130) & polar
    if ending.any():
        force = _Fill(flow, 0, Group.FACE)(blocks[polar], values[polar])
        before = np.append(np.zeros(1, force.dtype), force)[blocks]  # in the block ahead
        ending &= before != 1
        groups = np.where(ending, np.int8(Group.OFFSET), groups)
        values = np.where(ending, np.int32(UNKNOWN), values)
    return groups, values


def _numbers(value: Floats) -> tuple[Ints, Bools]:
    tens = value * 10.0
    fine = np.isfinite(tens) & (np.abs(tens) < 1e6)
    number = np.rint(np.where(fine, tens, -1.0)).astype(np.int32)
    return number, fine & (np.abs(np.where(fine, tens, 0.0) - number) < 1e-6)


def _rows(n: int, rows: Ints) -> Ints:
    """``rows`` ascending, each once."""
    mask = np.zeros(n, np.bool_)
    mask[rows] = True
    return np.flatnonzero(mask)


class _Fill:
    """Fills codes forward; what uncertain blocks change, and what follows code that was not read, is unknown."""

    def __init__(self, flow: ExecutionFlow, start: int, group: Group, saves_modes: bool = False) -> None:
        self._flow, self._start = flow, start
        self._type = np.int32 if group == Group.OFFSET else np.int8
        forgotten = flow.forget if group in _FORGOTTEN else np.zeros(len(flow.forget), np.bool_)
        self._forget = np.flatnonzero(forgotten | (flow.restored if group in _RESTORED else False))
        self._saved = flow.saved if group in (_RESTORED if saves_modes else _SAVED) else NONE_SAVED

    def __call__(self, at: Ints, value: Ints) -> Ints:
        n = len(self._flow.reason)
        sure = self._flow.reason[at] == FlowReason.NONE
        tape = self._flow.tape[at]
        lost = self._forget
        filled = self._filled(n, at[sure & tape], value[sure & tape], lost)
        uncertain = ~sure & tape
        if uncertain.any():
            changed = at[uncertain][value[uncertain] != filled[at[uncertain]]]
            after = self._flow.last[changed] + 1
            lost = np.union1d(lost, after[after < n])
            filled = self._filled(n, at[sure & tape], value[sure & tape], lost)
        return filled

    def _filled(self, n: int, at: Ints, value: Ints, lost: Ints) -> Ints:
        calls, returns = self._saved[self._saved[:, 1] < n].T
        if len(lost) or len(returns):
            # What a block itself says holds in it.
            order = np.argsort(np.concatenate([returns, lost, at]), kind="stable")
            value = np.concatenate([np.zeros(len(returns), np.int32), np.full(len(lost), UNKNOWN), value])[
                order
            ]
            at = np.concatenate([returns, lost, at])[order]
            restoring = np.flatnonzero(order < len(returns))
            before = np.searchsorted(at, calls[order[restoring]], side="right") - 1
            for row, last in zip(restoring.tolist(), before.tolist(), strict=True):
                value[row] = value[last] if last >= 0 else self._start
        return fill_modal(n, at, value, self._start, self._type)


def _moves(fill: _Fill, at: Ints, value: Ints, apart: bool) -> Ints:
    """The move in force; G80 yields to another code in its block, and may lead back to the one before a cycle."""
    quiet = value == Move.NOTHING
    if quiet.any():
        # The last of a block wins: NOTHING comes first.
        order = np.lexsort((~quiet, at))
        at, value = at[order], value[order]
    cyclic = np.isin(value, (Move.CYCLE, Move.NOTHING))
    if not apart or not cyclic.any():
        return fill(at, value)
    plain = fill(at[~cyclic], value[~cyclic])
    inside = fill(at, (value == Move.CYCLE).astype(np.int8))
    return np.where(inside == 1, np.int8(Move.CYCLE), plain)


def _verbs(blocks: Ints, values: Ints, own: Bools, n: int) -> tuple[Bools, Bools]:
    """Of every block, whether a code states its motion; whether two of them differ."""
    mine = np.flatnonzero(own & (values != Move.NOTHING))
    block, value = blocks[mine], values[mine].astype(np.int8)
    states = np.zeros(n, np.bool_)
    states[block] = True
    twice = np.zeros(n, np.bool_)
    if len(block) > np.count_nonzero(states):
        first, last = np.zeros(n, np.int8), np.zeros(n, np.int8)
        first[block[::-1]], last[block] = value[::-1], value
        twice = first != last
    return states, twice
