"""Where the tool is after a canned cycle, along the axis in which it works."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.control import Group, Move, Once
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.words import How, key


@dataclass(frozen=True, eq=False)
class CycleEnds:
    """level (B,) [m]: the coordinate of the working axis after the cycle of a block, NaN where it is not known;
    inherited (B,): it is that of the motion before the cycles; axis (B,): 0, 1, 2 for X, Y, Z; source (B,): the block
    of that motion, where it may decide on the level, else -1."""

    level: Floats
    inherited: Bools
    axis: Ints
    source: Ints

    def stated(self, sets: Bools, blocks: Ints) -> Bools:
        """(N, 3) the coordinates that ``blocks`` (N,) state, of those that they set (N, 3)."""
        return np.asarray(sets & ~(self.inherited[blocks, None] & (self.axis[blocks, None] == np.arange(3))))


def leaves_unknown(words: BlockWords, lengths: Bools) -> Bools:
    """(B,) blocks before or after which the place of the tool may be another one than the last coordinates; lengths
    (B,): those in which another tool length holds than before."""
    modal = words.modal
    once = (Once.HOME, Once.MACHINE, Once.PROBE, Once.CALL, Once.OTHER, Once.STORE)
    others = (
        modal.has(*once) | modal.unknown | modal.unused | words.noted("unknown", "axis", "polar", "corner")
    )
    uncertain = modal.flow.forget | (modal.flow.reason != 0) | modal.switched(Group.OFFSET) | lengths
    elsewhere = words.motion & ((words.move == Move.OTHER) | (words.move < 0))
    return np.asarray(others | uncertain | words.twice | elsewhere)


def _named_ends(words: BlockWords, retract: int) -> CycleEnds:
    """Of a control whose cycles are called by name: their planes are coordinates."""
    n, column, none = len(words), words.words(retract), everywhere(-1, len(words))
    axis = np.array([2, 1, 0])[np.clip(words.modal.force[Group.PLANE], 0, 2)]
    if not len(column):
        return CycleEnds(everywhere(np.nan, n), everywhere(False, n), axis, none)
    # Of the latest call; uncertain ones, and a change of units after them, leave it unknown.
    sure = words.modal.flow.reason[column.block] == 0
    values = np.where(sure, column.value, np.nan)
    at = np.searchsorted(column.block, np.arange(n), side="right") - 1
    block = np.append(column.block, 0)[at]
    level = np.where(at >= 0, np.append(values, np.nan)[at], np.nan) * words.length
    level = np.where(words.length[block] == words.length, level, np.nan)
    return CycleEnds(level, everywhere(False, n), axis, none)


def _level_from(words: BlockWords, row: int, cycle: Bools, source: Ints) -> int:
    """The motion whose end is the level to which the cycle ``row`` goes back."""
    before = row - 1
    while before >= 0 and not words.motion[before]:
        before -= 1
    return int(source[before]) if before >= 0 and cycle[before] else before


def cycle_ends(words: BlockWords, events: Ints, lengths: Bools) -> CycleEnds:
    """The ends of all cycles of a whole program; ``events`` (E,): blocks that change the frame; lengths (B,): those in
    which another tool length holds than before.

    G99: at R.  G98: where the first of the cycles without another motion between began, if that is not below R: from
    there controls differ.  R is known where it is a coordinate (G90); it holds to the end of these cycles.
    """
    n = len(words)
    if words.control.retract is not None:
        return _named_ends(words, words.control.retract)
    cycle = words.motion & (words.move == Move.CYCLE)
    rows = np.flatnonzero(cycle)
    if not len(rows):
        return CycleEnds(everywhere(np.nan, n), everywhere(False, n), everywhere(2, n), everywhere(-1, n))
    level = np.full(n, np.nan)
    axis = np.array([2, 1, 0])[np.clip(words.modal.force[Group.PLANE], 0, 2)]
    absolute = words.modal.force[Group.DISTANCE] == 0
    back = words.modal.force[Group.RETURN]
    plane, has_plane = words.lengths(key("R")), words.has(key("R"))
    height = np.stack([words.lengths(one) for one in AXES[:3]], axis=1)
    hows = np.stack([words.how(one) for one in AXES[:3]], axis=1)
    # Where the last coordinate of each axis is stated; words of a cycle along its own axis are depths.
    certain = words.modal.flow.reason == 0
    sure = words.motion & ~words.machine & absolute & certain
    sure &= (words.move != Move.OTHER) & (words.move >= 0)  # these may end elsewhere
    placed = sure[:, None] & np.isin(hows, (How.NUMBER, How.INTEGER))
    placed &= ~(cycle[:, None] & (axis[:, None] == np.arange(3)))
    frame = np.searchsorted(events, np.arange(n))
    # Of a cycle in a plane that is not known, neither is along which axis it works.
    anywhere = cycle & (words.modal.force[Group.PLANE] < 0)
    placed &= ~anywhere[:, None]
    number = np.arange(n)[:, None]
    latest = np.maximum.accumulate(np.where(placed, number, -1), axis=0)
    # A difference, or what is not read, says where the tool is as well, and not at which coordinate.
    moved = (
        words.motion[:, None] & (hows >= 0) & ~placed & ~(cycle[:, None] & (axis[:, None] == np.arange(3)))
    )
    unplaced = np.maximum.accumulate(np.where(moved, number, -1), axis=0)
    uncertain, units = np.cumsum(anywhere), words.modal.force[Group.UNITS]
    lost = np.cumsum(leaves_unknown(words, lengths) | anywhere)
    # A cycle that does not state R, G98, G99, the frame and the unit ends as the one before it.
    says = has_plane[rows] | ~absolute[rows] | (words.move[rows - 1] != Move.CYCLE)
    for state in (axis, frame, back, uncertain, units):
        says[1:] |= state[rows[1:]] != state[rows[:-1]]
    says[0] = True
    heads = np.flatnonzero(says)
    at_r, before, last = np.nan, np.nan, -1
    inherited, source, origin = np.zeros(n, np.bool_), np.full(n, -1), -1
    drilled = [-1, -1, -1]  # the latest cycle of each axis
    for row, tail in zip(
        rows[heads].tolist(), rows[np.append(heads[1:], len(rows)) - 1].tolist(), strict=True
    ):
        if last < 0 or words.move[row - 1] != Move.CYCLE:
            at, drill = latest[row, axis[row]], drilled[axis[row]]
            there = level[drill] if drill > at else height[at, axis[row]]
            at, origin = max(at, drill), _level_from(words, row, cycle, source)
            same = at > unplaced[row, axis[row]] and frame[at] == frame[row] and lost[at] == lost[row]
            at_r, before = np.nan, there if same else np.nan
        elif any(state[row] != state[last] for state in (frame, axis, uncertain, units)):
            # LinuxCNC goes back to the number of the other axis, and in the other unit
            at_r, before = np.nan, np.nan
        last = drilled[axis[row]] = tail
        if has_plane[row]:  # one that is computed is not known
            at_r = plane[row] if absolute[row] and certain[row] else np.nan
        elif not absolute[row]:
            at_r = np.nan
        if back[row] == 1:
            level[row] = at_r
        elif back[row] == 0 and before >= at_r:
            level[row], inherited[row] = before, True
        if back[row] != 1:
            source[row] = origin
        if not inherited[row]:  # which motion a G98 after it would build on is not followed
            before = np.nan
        for column in (level, inherited, source):
            column[tail] = column[row]
    like = rows[np.maximum.accumulate(np.where(says, np.arange(len(rows)), 0))]
    for column in (level, inherited, source):
        column[rows] = column[like]
    level[anywhere], inherited[anywhere] = np.nan, False
    return CycleEnds(level, inherited, axis, source)
