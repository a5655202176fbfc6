"""Work offsets that a program of a Sinumerik writes: $P_UIFR[1]=CTRANS(X,10,Y,20,Z,30):CROT(Z,90).

What is written is data; G500, G54 ... G599 make it the frame in force (programming manual "job planning", predefined
frame variables).  CROT turns as ROT does: about Z, the new Y, the new X.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG, MM
from postproc.languages.gcode.blocks import BlockWords
from postproc.languages.gcode.control import Group
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal import decode_g_codes
from postproc.languages.gcode.sinumerik_expression import constant
from postproc.languages.gcode.words import key

_WRITTEN = re.compile(r"\$P_UIFR(?:[ \t]*+\[[ \t]*+(\d{1,4}+)[ \t]*+([\],]))?+", re.I)
_ASSIGNED = re.compile(r"[ \t]*+=[ \t]*+([^\r\n]*+)")
_PART = re.compile(r"[ \t]*+(CTRANS|CROT)[ \t]*+\(([^()]*+)\)[ \t]*+", re.I)


def written_frames(words: BlockWords) -> Iterator[tuple[int, int | None, Floats | None]]:
    """Blocks after which a work offset is another one, its number, None for any, and its X, Y, Z [m] and angles [rad]
    about Z, the new Y and the new X (6,), None where it is not known: after it is written, until the program selects
    it again."""
    notes = [note for note in words.source.notes if note.kind == "base"]
    if not notes:
        return
    codes = words.words(key("G"))
    _, _, groups, values = decode_g_codes(codes.value, words.control)
    own = (groups == Group.OFFSET) & (words.modal.flow.reason[codes.block] == FlowReason.NONE)
    blocks, numbers = codes.block[own], values[own]
    selections = {number: blocks[numbers == number] for number in np.unique(numbers).tolist()}
    end = len(words)
    written: dict[int | None, int] = {}  # of every number, the block after this one that writes it
    for note in reversed(notes):
        found = _WRITTEN.match(note.text)
        number = None if found is None or found[1] is None else int(found[1])
        until = min(written.get(number, end), written.get(None, end))
        written[number] = note.block
        sure = words.modal.flow.reason[note.block] == FlowReason.NONE
        if found is not None and number in selections and sure:
            at = int(np.searchsorted(selections[number], note.block, side="right"))
            metric = words.modal.force[Group.UNITS][note.block] == 0 and found[2] == "]"
            frame = _frame(note.text[found.end() :]) if metric else None
            if frame is not None and at < len(selections[number]) and selections[number][at] <= until:
                yield int(selections[number][at]) - 1, number, frame
        yield note.block, number, None


def _frame(text: str) -> Floats | None:
    """(6,) [m, rad] of ``=CTRANS(...):CROT(...)``, of which either may be absent; None of any other one."""
    assigned = _ASSIGNED.fullmatch(text)
    if assigned is None:
        return None
    frame, kinds = np.zeros(6), []
    for part in assigned[1].split(":"):
        found = _PART.fullmatch(part)
        if found is None:
            return None
        kinds.append(found[1].upper())
        arguments = [one.strip() for one in found[2].split(",")]
        axes, values = [one.upper() for one in arguments[::2]], arguments[1::2]
        if len(arguments) % 2 or len(set(axes)) < len(axes) or not set(axes) <= {"X", "Y", "Z"}:
            return None
        for axis, value in zip(axes, values, strict=True):
            place = "XYZ".index(axis) if kinds[-1] == "CTRANS" else 3 + "ZYX".index(axis)
            frame[place] = constant(value.encode("latin-1", "replace")) * (MM if place < 3 else DEG)
    known = kinds in (["CTRANS"], ["CROT"], ["CTRANS", "CROT"]) and np.isfinite(frame).all()
    return frame if known else None
