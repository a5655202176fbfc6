"""Drill cycles whose hole the block itself states: where it is and how deep, in the sticky words of the cycle.

A control goes above the hole, down to R, on to the depth and back; X, Y, the depth (Z in G17) and R hold until the
cycle ends, for blocks that leave them out.  LinuxCNC's manual, canned cycles; Fanuc's, canned cycles for drilling.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.control import Group, Move
from postproc.languages.gcode.cycle_ends import leaves_unknown
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal_fill import everywhere, switched
from postproc.languages.gcode.motions import NOT_HIDDEN, GcodeMotions
from postproc.languages.gcode.positions import Positions
from postproc.languages.gcode.refusals import RefusalCollector
from postproc.languages.gcode.words import How, key
from postproc.toolpath import Kind

WHY = (
    ("", ""),
    ("its motions are not in the program", ""),
    (
        "under G91 its depth and R are differences from where the cycle before it ended",
        "write G90 and coordinates",
    ),
    ("it runs another number of times than once (K, L)", "write every hole once"),
    (
        "its depth is not stated since the cycle was selected, or is not known",
        "write the depth (Z in G17) beside the cycle's code",
    ),
    (
        "its R is not stated since the cycle was selected, or is not known",
        "write R beside the cycle's code",
    ),
    ("its depth is not below R", "check R and the depth"),
)
"""Why the hole of a cycle is not the block's own, and what to do; the first: it is."""
HIDDEN, DIFFERENCES, REPEATED, NO_DEPTH, NO_PLANE, ABOVE = range(NOT_HIDDEN + 1, len(WHY))


@dataclass(frozen=True, eq=False)
class DrillCycles:
    """Of B blocks: depth (B,) [m], the coordinate of the bottom along ``axis`` (B,) (0, 1, 2 for X, Y, Z), NaN where
    the block is no such cycle; room (B,) [m]: from there to R; stated (B,): the depth is a word of the block, else that
    of an earlier one holds; why (B,): place in ``WHY``."""

    depth: Floats
    room: Floats
    stated: Bools
    axis: Ints
    why: Ints

    def part(self, start: int, stop: int) -> DrillCycles:
        """The blocks start .. stop - 1."""
        rows = slice(start, stop)
        return DrillCycles(
            self.depth[rows], self.room[rows], self.stated[rows], self.axis[rows], self.why[rows]
        )


def drill_cycles(words: BlockWords, events: Ints, rebased: Bools, lengths: Bools) -> DrillCycles:
    """Of a whole program; events (E,): blocks that change the frame; rebased, lengths (B,): those before which the
    base, or the tool's length, became another one."""
    n = len(words)
    cycle = words.motion & (words.move == Move.CYCLE)
    rows = np.flatnonzero(cycle)
    if not len(rows):
        unknown, none = everywhere(np.nan, n), everywhere(False, n)
        return DrillCycles(unknown, unknown, none, everywhere(2, n, np.int8), everywhere(HIDDEN, n, np.int8))
    axis = np.array([2, 1, 0])[np.clip(words.modal.force[Group.PLANE], 0, 2)]
    chain, drills = _chains(words, rows, axis, events, rebased | lengths)
    depth, stated = _sticky(words, rows, chain, axis)
    plane, _ = _sticky(words, rows, chain, None)
    why = np.full(n, HIDDEN, np.int8)
    why[rows] = np.select(
        [
            ~drills | (words.modal.force[Group.PLANE][rows] < 0),
            words.modal.force[Group.DISTANCE][rows] != 0,
            ~_once(words, rows),
            ~np.isfinite(depth),
            ~np.isfinite(plane),
            ~(depth < plane),
        ],
        [HIDDEN, DIFFERENCES, REPEATED, NO_DEPTH, NO_PLANE, ABOVE],
        NOT_HIDDEN,
    )
    own = why[rows] == NOT_HIDDEN
    result = DrillCycles(np.full(n, np.nan), np.full(n, np.nan), np.zeros(n, np.bool_), axis, why)
    result.depth[rows[own]], result.room[rows[own]] = depth[own], (plane - depth)[own]
    result.stated[rows] = stated
    return result


def _chains(words: BlockWords, rows: Ints, axis: Ints, events: Ints, apart: Bools) -> tuple[Ints, Bools]:
    """Of the cycles ``rows`` (K,): number of the stretch in which words of one hold for the next; whether a code that
    drills is in force."""
    modal = words.modal
    codes = words.words(key("G"))
    tens = np.rint(codes.value * 10)
    of_cycles = [code for code, says in words.control.codes.items() if says == (Group.MOTION, Move.CYCLE)]
    selects = np.isin(tens, of_cycles)
    at = np.searchsorted(codes.block[selects], rows, side="right") - 1
    selected = np.append(tens[selects], -1)[at]
    breaks = (
        (words.move != Move.CYCLE) | leaves_unknown(words, apart) | (modal.flow.reason != FlowReason.NONE)
    )
    breaks |= switched(axis, int(axis[0])) | modal.switched(Group.UNITS) | modal.switched(Group.DISTANCE)
    breaks[events] = True
    interrupted = np.cumsum(breaks)[rows]
    new = (selected[1:] != selected[:-1]) | (interrupted[1:] != interrupted[:-1])
    drills = np.isin(selected, [10 * code for code in words.control.drills])
    return np.append(0, np.cumsum(new)), drills


def _sticky(words: BlockWords, rows: Ints, chain: Ints, axis: Ints | None) -> tuple[Floats, Bools]:
    """(K,) [m] the coordinate that holds along ``axis`` (B,), or R, at the cycles ``rows`` (K,); whether the block
    states it."""
    if axis is None:
        value, how = words.lengths(key("R"))[rows], words.how(key("R"))[rows]
    else:
        value, how = np.full(len(rows), np.nan), np.full(len(rows), -1)
        for number, letter in enumerate(AXES[:3]):
            mine = axis[rows] == number
            value[mine], how[mine] = words.lengths(letter)[rows[mine]], words.how(letter)[rows[mine]]
    stated = how >= 0
    modal = words.modal
    odd = words.twice | modal.unknown | modal.unused | (modal.flow.reason != FlowReason.NONE)
    value = np.where(np.isin(how, (How.NUMBER, How.INTEGER)) & ~odd[rows], value, np.nan)
    first = np.append(True, chain[1:] != chain[:-1])
    last = np.maximum.accumulate(np.where(stated | first, np.arange(len(rows)), 0))
    return value[last], np.asarray(stated)


def with_holes(moves: GcodeMotions, holes: DrillCycles, where: Positions) -> GcodeMotions:
    """The motions with the drill cycles among them as lines to the bottoms of their holes; holes (B,) of the blocks."""
    cycles = moves.move == Move.CYCLE
    if not cycles.any():
        return moves
    hidden = np.where(cycles, holes.why[moves.block], NOT_HIDDEN)
    at = np.flatnonzero(np.isfinite(holes.depth[moves.block]))
    block = moves.block[at]
    axis = holes.axis[block]
    kind, room = moves.kind.copy(), moves.room.copy()
    start, end, place = moves.start.copy(), moves.end.copy(), moves.place.copy()
    kind[at], room[at] = Kind.LIN, holes.room[block]
    end[at, axis] = holes.depth[block]
    sticky = at[~holes.stated[block]], axis[~holes.stated[block]]
    start[sticky] = end[sticky]  # where a word that the block leaves out has it
    for number in np.unique(where.frame[block]).tolist():
        mine = where.frame[block] == number
        place[at[mine]] = where.frames[number].to_base(end[at[mine]])[:, :3]
    return replace(moves, kind=kind, start=start, end=end, place=place, room=room, hidden=hidden)


def refuse_cycles(moves: GcodeMotions, collector: RefusalCollector) -> None:
    """Refuses the canned cycles whose hole is not that of their block."""
    for number in np.unique(moves.hidden[moves.hidden != NOT_HIDDEN]).tolist():
        why, what_to_do = WHY[number]
        collector.refuse(moves.hidden == number, "GCO008", f"the block is a canned cycle: {why}", what_to_do)


def stated_coordinates(sets: Bools, moves: GcodeMotions, holes: DrillCycles) -> Bools:
    """(N, 3) the coordinates ``sets`` (N, 3) of motions, without the depth of cycles that leave it out."""
    along = holes.axis[moves.block][:, None] == np.arange(3)
    sticky = (moves.move == Move.CYCLE) & ~holes.stated[moves.block]
    return np.asarray(sets & ~(sticky[:, None] & along))


def beside_holes(drills: Bools) -> dict[int, str]:
    """Motions, of which ``drills`` (N,) are drill cycles, before which nothing may be inserted for that."""
    found = dict.fromkeys((np.flatnonzero(drills) + 1).tolist(), "a drill cycle is before it")
    found.pop(len(drills), None)
    return found | dict.fromkeys(np.flatnonzero(drills).tolist(), "its block is a drill cycle")


def _once(words: BlockWords, rows: Ints) -> Bools:
    """(K,) cycles that run once: K and L, where they are stated, are 1."""
    once = np.ones(len(rows), np.bool_)
    for letter in "KL":
        value = words.number(key(letter))[rows]
        once &= (words.how(key(letter))[rows] < 0) | (value == 1)
    return once
