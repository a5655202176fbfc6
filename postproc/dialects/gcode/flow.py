"""Which blocks surely run once: not those behind a slash, in loops, branches and subprograms, or after the end."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from postproc.arrays import Bools, Ints
from postproc.dialects.gcode.control import Control, Once
from postproc.dialects.gcode.words import Text, key

_GOTO = re.compile(r"(?:GOTO[BFC]?|REPEATB?)\s*(N?\d+|[A-Z_]\w+)?(?:\s+([A-Z_]\w+))?", re.I)
CALLS = (72, 97, 98, 198)
"""M72 of LinuxCNC brings back modes that M70 has saved."""
LOCAL = 97
RETURNS = (99,)


class Doubt(IntEnum):
    """Why a block may run many times, or never."""

    NONE = 0
    DELETED = 1
    FLOW = 2
    PROGRAM = 3
    ENDED = 4


@dataclass(frozen=True, eq=False)
class Flow:
    """doubt (B,) Doubt; last (B,): the last block of the doubtful stretch that the block is in, itself elsewhere;
    forget (B,): before it other code ran that was not read; calls (B,): runs it; tape (B,): belongs to the program;
    entered (B,): a jump leads to it, past what stands before it."""

    doubt: Ints
    last: Ints
    forget: Bools
    calls: Bools
    tape: Bools
    entered: Bools


def follow(text: Text, control: Control, once: Ints) -> Flow:
    """The flow of a program; ``once`` (B,): bits of the Once codes of every block."""
    n = len(text.blocks)
    doubt = np.zeros(n, np.int64)
    forget = np.zeros(n + 1, np.bool_)
    tape = _tape(text, n)
    doubt[text.blocks.deleted] = Doubt.DELETED

    words = text.words
    m_rows = np.flatnonzero(words.key == key("M"))
    codes, at = words.value[m_rows], words.block[m_rows]
    forget[at[np.isin(codes, CALLS)] + 1] = True
    forget[1:] |= (once & (1 << Once.CALL)) != 0
    if control.calls:
        coded = np.zeros(n, np.bool_)
        coded[words.block[np.isin(words.key, (key("G"), key("M")))]] = True
        named = words.block[np.isin(words.key, list(control.calls))]
        forget[named[~coded[named]] + 1] = True
    edge = np.zeros(n + 1, np.int64)
    entered = np.zeros(n, np.bool_)
    for begin, end in _stretches(text, n, forget, entered):
        edge[begin] += 1
        edge[end] -= 1
    doubt[np.cumsum(edge)[:n] > 0] = Doubt.FLOW
    programs = _programs(text)
    if len(programs) > 1:
        doubt[programs[1] :] = Doubt.PROGRAM
    ends = at[np.isin(codes, [*control.endings, *RETURNS])]
    ends = ends[(doubt[ends] == Doubt.NONE) & tape[ends]]
    if len(ends):
        rest = doubt[ends[0] + 1 :]
        # M97 runs what stands behind the end, as a subprogram.
        rest[rest != Doubt.PROGRAM] = Doubt.PROGRAM if (codes == LOCAL).any() else Doubt.ENDED
    return Flow(doubt, _last(doubt), forget[:-1], forget[1:], tape, entered)


def _tape(text: Text, n: int) -> Bools:
    """What stands between the first two ``%``, or before the only one where motions stand before it."""
    marks = [note.block for note in text.notes if note.kind == "tape"]
    inside = np.ones(n, np.bool_)
    if marks:
        axes = np.isin(text.words.key, [key(letter) for letter in "XYZ"])
        first = text.words.block[axes]
        if len(first) and first[0] < marks[0]:
            inside[marks[0] :] = False
        else:
            inside[: marks[0]] = False
            if len(marks) > 1:
                inside[marks[1] :] = False
    return inside


def _programs(text: Text) -> list[int]:
    """Blocks where a program begins (O1234, :1234)."""
    plain = text.words.block[np.flatnonzero(text.words.key == key("O"))]
    noted = [note.block for note in text.notes if note.kind == "program"]
    return sorted({*plain.tolist(), *noted})


def _stretches(text: Text, n: int, forget: Bools, entered: Bools) -> list[tuple[int, int]]:
    """Ranges of blocks that are loops, branches, subprograms or lie under a jump; calls are put into ``forget``, where
    jumps lead to into ``entered``."""
    found: list[tuple[int, int]] = []
    stack: list[tuple[int, str]] = []
    labels: dict[str, int] | None = None
    for note in text.notes:
        if note.kind == "call":
            forget[note.block + 1] = True
        elif note.kind == "open" or (note.kind == "while" and not any(s == note.text for _, s in stack[-1:])):
            stack.append((note.block, note.text))
        elif note.kind in ("close", "while"):
            if stack:
                begin = stack.pop()[0]
                if not stack:
                    found.append((begin, note.block + 1))
        elif note.kind == "jump":
            goto = _GOTO.search(note.text)
            if goto is None:
                continue
            labels = _labels(text) if labels is None else labels
            ends = [labels.get(name.upper().lstrip("N0") or "0") for name in goto.groups() if name]
            if not ends or None in ends:
                found.append((0, n))
            else:
                at = [note.block, *(end for end in ends if end is not None)]
                found.append((min(at), max([note.block + 1, *at])))
                entered[at[1:]] = True
    if stack:
        found.append((stack[0][0], n))
    return found


def _labels(text: Text) -> dict[str, int]:
    """Blocks by the N-number or the label that they begin with."""
    rows = np.flatnonzero((text.words.key == key("N")) & np.isfinite(text.words.value))
    names = [f"{value:.0f}" for value in text.words.value[rows].tolist()]
    labels = dict(zip(names, text.words.block[rows].tolist(), strict=True))
    return labels | {
        note.text.upper().lstrip("N0"): note.block for note in text.notes if note.kind == "label"
    }


def _last(doubt: Ints) -> Ints:
    """(B,) the end of the run of doubtful blocks that each block is in."""
    n = len(doubt)
    own = np.arange(n)
    sure = np.append(doubt == Doubt.NONE, True)
    following = np.where(sure, np.arange(n + 1), n)
    following = np.minimum.accumulate(following[::-1])[::-1]
    return np.where(doubt == Doubt.NONE, own, following[:-1] - 1)
