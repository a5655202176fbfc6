"""How blocks change the frame of a program (G92, G52, work offsets, rotations)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.languages.gcode.blocks import AXES, SMALL_ANGLE, BlockWords
from postproc.languages.gcode.control import READ, Event, Group, Once, ProgrammedFrame, either_frame
from postproc.languages.gcode.lexing import FARTHEST
from postproc.languages.gcode.modal import decode_g_codes
from postproc.languages.gcode.words import How, Note, key

_ANGLES = tuple(key(letter) for letter in "IJKR")
"""Words of planes (G68, G68.2) that are angles."""


def frame_blocks(words: BlockWords) -> Ints:
    """(K,) the blocks that change the frame, G92 and G52 only with coordinates; of calls whose end restores it, the
    first block after the call and that after the return."""
    changes = _changes(words)
    for call, after in _saved(words, np.flatnonzero(changes)):
        changes[[call + 1, after]] = True
    return np.flatnonzero(changes)


def _changes(words: BlockWords) -> Bools:
    """(B,) blocks that say how the frame changes."""
    mentioned = words.has(*(key(letter) for letter in "XYZABC"))
    always = words.modal.has(Once.UNSHIFT, Once.SUSPEND, Once.RESTORE, Once.FRAME)
    placed = (words.modal.force[Group.PLACED] != 0) | (words.modal.force[Group.MIRRORED] == READ)
    if words.control.layered_offsets and always.any():
        codes = words.words(key("G"))
        always[codes.block[decode_g_codes(codes.value, words.control)[2] == Group.OFFSET]] = True
    if placed.any():
        always |= words.modal.switched(Group.PLACED) | (words.modal.switched(Group.OFFSET) & placed)
    return (always | (words.modal.has(Once.SHIFT, Once.LOCAL) & mentioned)) & words.modal.flow.tape


def _saved(words: BlockWords, changes: Ints) -> list[tuple[int, int]]:
    """Of ``ExecutionFlow.saved`` the calls between whose blocks and returns one of ``changes`` (K,) is."""
    if words.control.saves_modes:
        return []  # M72 restores none
    saved = words.modal.flow.saved
    calls, after = saved[saved[:, 1] < len(words)].T
    inside = np.searchsorted(changes, calls, side="right") < np.searchsorted(changes, after)
    return list(zip(calls[inside].tolist(), after[inside].tolist(), strict=True))


def frame_change(
    block_words: BlockWords, events: Ints
) -> Callable[[int, ProgrammedFrame, Floats], ProgrammedFrame]:
    """What gives the frame after one of the blocks ``events`` (K,), which change it; unknown where that may not
    run."""
    change = block_words.control.frame
    own = _changes(block_words)
    saved = _saved(block_words, np.flatnonzero(own))
    restoring, called = {after: call for call, after in saved}, {call + 1 for call, _ in saved}
    at_call: dict[int, ProgrammedFrame] = {}
    notes: dict[int, list[Note]] = {block: [] for block in events.tolist()}
    for note in block_words.source.notes if notes else ():
        if note.block in notes:
            notes[note.block].append(note)

    keys = [one for one in block_words.columns if one in block_words.source.columns]

    def changed(block: int, frame: ProgrammedFrame, position: Floats) -> ProgrammedFrame:
        if block in restoring:
            frame = _restored(frame, at_call[restoring[block]])
        if block in called:
            at_call[block - 1] = frame
        if not own[block]:
            return frame
        here = block_words.part(block, block + 1)
        lengths = float(here.length_of_integer[0] / here.length[0])
        angles = SMALL_ANGLE if block_words.integers.increments else 1.0
        small = {one: angles if one in (*AXES[3:], *_ANGLES) else lengths for one in keys}
        words = {
            one: float(column.value[-1] * (small[one] if column.how[-1] == How.INTEGER else 1.0))
            for one in keys
            if len(column := here.words(one))
        }
        for one in (*AXES, *_ANGLES):
            if len(here.words(one)) > 1:  # which of them counts is not known
                words[one] = math.nan
        if here.ambiguous.any():
            words = {one: math.nan if one in (*AXES[:3], *_ANGLES) else value for one, value in words.items()}
        codes = tuple(here.words(key("G")).value.tolist())
        event = Event(
            words,
            int(here.modal.once[0]),
            tuple(notes[block]),
            codes,
            int(here.modal.force[Group.PLANE][0]),
            float(here.length[0]),
            frame,
            position,
            int(here.modal.force[Group.DISTANCE][0]) == 0,
        )
        after = change(event)
        after = replace(after, shift=np.where(np.abs(after.shift) > FARTHEST * MM, np.nan, after.shift))
        if here.modal.flow.reason[0]:
            return either_frame(frame, after)
        return after

    return changed


def _restored(frame: ProgrammedFrame, at_call: ProgrammedFrame) -> ProgrammedFrame:
    """The frame after the end of a subprogram that restores that of its caller.  Frames of the control itself, those of
    CYCLE800 and TOROT, and what is not known stay (Siemens, function manual "frames", subprograms with SAVE)."""
    if frame.memory is None and at_call.memory is None and not np.isnan(frame.shift).any():
        return replace(at_call, rotary=None)
    return replace(frame, shift=np.full(6, np.nan), rotary=None)
