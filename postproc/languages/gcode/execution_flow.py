"""Which blocks surely run once: not those after a slash, in loops, branches and subprograms, or after the end."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.modal_fill import fill_modal
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import key

_JUMP = re.compile(r"GOTO[BFC]?\s*(N?\d+|[A-Z_]\w+)?|REPEATB?\s*(N?\d+|[A-Z_]\w+)?(?:\s+([A-Z_]\w+))?", re.I)
_ZEROS = re.compile(r"^N?0*(?=\d)")
_STRING = re.compile(r'"\w+"')
SAVES, INVALIDATES, RESTORES, SAVES_FOR_A_CALL = 70, 71, 72, 73
"""Of LinuxCNC: M72 brings back modes that M70 or M73 has saved; M73 has the end of its subprogram do so, too."""
MODE_CODES = (SAVES, INVALIDATES, RESTORES, SAVES_FOR_A_CALL)
NEVER, UNCLEAR = -1, -2
"""In place of the step at which modes were saved: nothing is restored; what is restored is not known."""
CALLS = (RESTORES, 97, 98, 198)
"""M that call code; M72 where it does not restore modes."""
LOCAL = 97
RETURNS = (99,)


STRAIGHT, ONE_ARM_RUNS = 1, 2
"""Of what may be passed or not: nothing in it goes elsewhere; it is an arm of a branch of which one surely runs."""

_ENDS = (2, 17, 30, *RETURNS)

MODAL, MODAL_EACH, MODAL_END = 66.0, 66.1, 67.0
"""Of a Fanuc: every motion calls a macro; every block does, and its words are arguments; none does any more."""
EACH = 2

NONE_SAVED = np.empty((0, 2), np.int64)


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
    blocks as well; restored (B,): before it modes were brought back that are not followed; saved (S, 2), of the whole
    run, never of a part: the step of a call, or of M70 or M73, and the one before which what was in force there is
    restored, the second ascending."""

    reason: Ints
    forget: Bools
    calls: Bools
    called: Bools
    tape: Bools
    entered: Bools
    repeated: Bools
    restored: Bools
    saved: Ints

    def part(self, start: int, stop: int) -> ExecutionFlow:
        rows = {one.name: getattr(self, one.name)[start:stop] for one in fields(self)}
        return ExecutionFlow(**{**rows, "saved": NONE_SAVED})

    @cached_property
    def last(self) -> Ints:
        """(B,) the last block of the run of uncertain blocks that each block is in, itself elsewhere."""
        n = len(self.reason)
        sure = np.append(self.reason == FlowReason.NONE, True)
        following = np.where(sure, np.arange(n + 1), n)
        following = np.minimum.accumulate(following[::-1])[::-1]
        return np.where(sure[:-1], np.arange(n), following[:-1] - 1)


def macro_modes(source: Source) -> Ints:
    """(B,) 1 in blocks under G66, in which motions call a macro, EACH under G66.1, in which all do, else 0."""
    codes, n = source.column(key("G")), len(source.blocks)
    some = np.isin(codes.value, (MODAL, MODAL_EACH, MODAL_END))
    if not some.any():
        return np.zeros(n, np.int8)
    value = codes.value[some]
    kind = np.where(value == MODAL, 1, np.where(value == MODAL_EACH, EACH, 0))
    return np.asarray(fill_modal(n, codes.block[some], kind, 0, np.int8))


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
    return found + _main_returns(source, found)


def _main_returns(source: Source, found: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The ranges of blocks that M99 of the main program passes, or may repeat; ``found``: those that may be
    subprograms."""
    n, m, numbers = len(source.blocks), source.column(key("M")), source.column(key("N"))
    edge = np.zeros(n + 1, np.int32)
    for start, stop in found:
        edge[start] += 1
        edge[stop] -= 1
    sure = np.cumsum(edge)[:n] == 0
    ends = m.block[np.isin(m.value, _ENDS[: -len(RETURNS)])]
    end = min([*program_starts(source)[1:2], *ends[sure[ends]][:1].tolist()], default=n)
    returns = m.block[np.isin(m.value, RETURNS) & (m.block < end)]
    if not len(returns):
        return []
    leads = source.mask(key("P"))[returns]
    places: dict[float, list[int]] = {}
    for number, block in zip(numbers.value.tolist(), numbers.block.tolist(), strict=True):
        places.setdefault(number, []).append(block)
    found = [(0, n)] * bool((~leads).any())
    for block, to in zip(
        returns[leads].tolist(), source.column(key("P")).last(returns[leads]).tolist(), strict=True
    ):
        at = places.get(to, [])
        found.append((block, max(at)) if at and min(at) > block else (0, n))
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
    """A label in upper case, of a block number the digits: N0030 and 30 are 30; "PAST" is PAST."""
    text = name.strip().upper()
    return _ZEROS.sub("", text[1:-1] if _STRING.fullmatch(text) else text)
