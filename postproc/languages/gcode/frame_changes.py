"""How blocks change the frame of a program (G92, G52, work offsets, rotations)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM
from postproc.languages.gcode.blocks import AXES, SMALL_ANGLE, BlockWords
from postproc.languages.gcode.control import READ, Event, Group, Once, ProgrammedFrame, either_frame
from postproc.languages.gcode.lexing import FARTHEST
from postproc.languages.gcode.words import How, Note, key

_ANGLES = tuple(key(letter) for letter in "IJKR")
"""Words of planes (G68, G68.2) that are angles."""


def frame_blocks(words: BlockWords) -> Ints:
    """(K,) the blocks that change the frame: G92 and G52 only with coordinates."""
    mentioned = words.has(*(key(letter) for letter in "XYZABC"))
    always = words.modal.has(Once.UNSHIFT, Once.SUSPEND, Once.RESTORE, Once.FRAME)
    placed = (words.modal.force[Group.PLACED] != 0) | (words.modal.force[Group.MIRRORED] == READ)
    if placed.any():
        always |= words.modal.switched(Group.PLACED) | (words.modal.switched(Group.OFFSET) & placed)
    return np.flatnonzero(
        (always | (words.modal.has(Once.SHIFT, Once.LOCAL) & mentioned)) & words.modal.flow.tape
    )


def frame_change(
    block_words: BlockWords, events: Ints
) -> Callable[[int, ProgrammedFrame, Floats], ProgrammedFrame]:
    """What gives the frame after one of the blocks ``events`` (K,), which change it; unknown where that may not
    run."""
    change = block_words.control.frame
    notes: dict[int, list[Note]] = {block: [] for block in events.tolist()}
    for note in block_words.source.notes if notes else ():
        if note.block in notes:
            notes[note.block].append(note)

    keys = [one for one in block_words.columns if one in block_words.source.columns]

    def changed(block: int, frame: ProgrammedFrame, position: Floats) -> ProgrammedFrame:
        here = block_words.part(block, block + 1)
        lengths = float(here.length_of_integer[0] / here.length[0])
        angles = SMALL_ANGLE if block_words.integers.increments else 1.0
        small = {one: angles if one in (*AXES[3:], *_ANGLES) else lengths for one in keys}
        words = {
            one: float(column.value[-1] * (small[one] if column.how[-1] == How.INTEGER else 1.0))
            for one in keys
            if len(column := here.words(one))
        }
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
