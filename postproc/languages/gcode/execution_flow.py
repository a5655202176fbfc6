"""Which blocks surely run once: not those after a slash, in loops, branches and subprograms, or after the end."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import key

_JUMP = re.compile(r"GOTO[BFC]?\s*(N?\d+|[A-Z_]\w+)?|REPEATB?\s*(N?\d+|[A-Z_]\w+)?(?:\s+([A-Z_]\w+))?", re.I)
_ZEROS = re.compile(r"^N?0*(?=\d)")
SAVES, RESTORES, SAVES_FOR_A_CALL = 70, 72, 73
"""Of LinuxCNC: M72 brings back modes that M70 has saved; M73 has the end of its subprogram do so."""
CALLS = (RESTORES, 97, 98, 198)
LOCAL = 97
RETURNS = (99,)


STRAIGHT, ONE_ARM_RUNS = 1, 2
"""Of what may be passed or not: nothing in it goes elsewhere; it is an arm of a branch of which one surely runs."""

_ENDS = (2, 17, 30, *RETURNS)


class FlowReason(IntEnum):
    """Why a block may run many times, or never."""

    NONE = 0
    DELETED = 1
    FLOW = 2
    PROGRAM = 3
    ENDED = 4
    COMPUTED = 5
    SKIPPED = 6


@dataclass(frozen=True, eq=False)
class ExecutionFlow:
    """reason (B,) FlowReason; forget (B,): before it other code ran that was not read; calls (B,): runs it; called
    (B,): calls code of the file, which runs after it; tape (B,): belongs to the program; entered (B,): a jump leads
    to it, past what is before it; repeated (B,): its line runs in other
    blocks as well; restored (B,): before it modes were brought back that are not followed."""

    reason: Ints
    forget: Bools
    calls: Bools
    called: Bools
    tape: Bools
    entered: Bools
    repeated: Bools
    restored: Bools

    def part(self, start: int, stop: int) -> ExecutionFlow:
        return ExecutionFlow(*(getattr(self, one.name)[start:stop] for one in fields(self)))

    @cached_property
    def last(self) -> Ints:
        """(B,) the last block of the run of uncertain blocks that each block is in, itself elsewhere."""
        n = len(self.reason)
        sure = np.append(self.reason == FlowReason.NONE, True)
        following = np.where(sure, np.arange(n + 1), n)
        following = np.minimum.accumulate(following[::-1])[::-1]
        return np.where(sure[:-1], np.arange(n), following[:-1] - 1)


def tape_blocks(source: Source) -> Bools:
    """(B,) what is between the first two ``%``, or before the only one where motions are before it."""
    n = len(source.blocks)
    marks = [note.block for note in source.notes if note.kind == "tape"]
    inside = np.ones(n, np.bool_)
    if marks:
        if any((source.column(key(letter)).block[:1] < marks[0]).any() for letter in "XYZ"):
            inside[marks[0] :] = False
        else:
            inside[: marks[0]] = False
            if len(marks) > 1:
                inside[marks[1] :] = False
    return inside


def program_starts(source: Source) -> list[int]:
    """Blocks where a program starts (O1234, :1234); 0 as well where what is before the first of them ends."""
    plain = source.column(key("O")).block
    noted = [note.block for note in source.notes if note.kind == "program"]
    starts = sorted({*plain.tolist(), *noted})
    m = source.column(key("M"))
    headless = starts and np.isin(m.value[m.block < starts[0]], _ENDS).any()
    return [0, *starts] if headless else starts


def uncertain_stretches(source: Source, entered: Bools | None = None) -> list[tuple[int, int]]:
    """Ranges of blocks that are loops, branches, subprograms or lie under a jump; where jumps lead to is put into
    ``entered`` (B,)."""
    n = len(source.blocks)
    found: list[tuple[int, int]] = []
    stack: list[tuple[int, str]] = []
    labels: dict[str, list[int]] | None = None
    for note in source.notes:
        if note.kind == "open" or (
            note.kind == "while" and not any(label == note.text.split()[0] for _, label in stack[-1:])
        ):
            stack.append((note.block, note.text.split()[0]))
        elif note.kind in ("close", "while"):
            if stack:
                start = stack.pop()[0]
                if not stack:
                    found.append((start, note.block + 1))
        elif note.kind == "jump":
            jumps = _JUMP.findall(note.text)  # several of a CASE
            if not jumps:
                continue
            labels = _labels(source) if labels is None else labels
            ends = [
                labels.get(label_name(name)) for names in jumps for name in [*filter(None, names)] or [""]
            ]
            if None in ends:
                found.append((0, n))
            else:
                at = [note.block, *(end for some in ends if some is not None for end in some)]
                found.append((min(at), max([note.block + 1, *at])))
                if entered is not None:
                    entered[at[1:]] = True
    if stack:
        found.append((stack[0][0], n))
    return found


def _labels(source: Source) -> dict[str, list[int]]:
    """Blocks by the N-number or the label that they start with."""
    numbers = source.column(key("N"))
    known = np.isfinite(numbers.value)
    names = [f"{value:.0f}" for value in numbers.value[known].tolist()]
    labels: dict[str, list[int]] = {}
    for name, block in zip(names, numbers.block[known].tolist(), strict=True):
        labels.setdefault(name, []).append(block)
    for note in source.notes:
        if note.kind == "label":
            labels.setdefault(label_name(note.text), []).append(note.block)
    return labels


def label_name(name: str) -> str:
    """A label in upper case, of a block number the digits: N0030 and 30 are 30."""
    return _ZEROS.sub("", name.upper())
