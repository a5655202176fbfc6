"""What a reading and the motions of rs274 differ in.

Rows and motions are paired by their line.  As many rows as motions: in order; one row: with every motion of its
line, as what it claims has to hold each time that it runs.  A row that a finding refuses claims nothing.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from .oracle import Motion
from .reading import Reading, Row

DIGIT = 0.5 + 1e-3
"""Of the last digit that rs274 prints."""


@dataclass(frozen=True)
class Difference:
    """kind: missing (a motion without row and without finding), target, kind, arc, base, tool, offset (the work offset
    was changed), extra (a claimed motion that does not run, or more of them than run), order."""

    kind: str
    line: int
    message: str


@dataclass
class Comparison:
    """motions: of rs274, but those without a row that move nothing (a G0 alone), and a cycle as one; known: those
    that a row claims, and rightly; located: those whose place is right, refused or not; misplaced: refused rows
    with another place than rs274's, which are no difference."""

    motions: int = 0
    known: int = 0
    located: int = 0
    misplaced: int = 0
    differences: list[Difference] = field(default_factory=list)


def compare(motions: list[Motion], reading: Reading) -> Comparison:
    """All differences, by line."""
    result = Comparison(len(motions))
    runs: dict[int, list[int]] = defaultdict(list)
    for index, motion in enumerate(motions):
        runs[motion.line].append(index)
    rows: dict[int, list[int]] = defaultdict(list)
    for index, row in enumerate(reading.rows):
        rows[row.line].append(index)

    def differ(kind: str, line: int, message: str) -> None:
        result.differences.append(Difference(kind, line, message))

    first: dict[int, int] = {}
    for line in sorted({*runs, *rows}):
        here, there = rows[line], runs[line]
        claimed = [row for row in here if reading.rows[row].claimed]
        if here and there and all(reading.rows[row].drills for row in here):
            # Each pass is a hole, and what is read of it its bottom.
            bottoms = [bottom for one in _passes(there) if (bottom := _bottom(motions, one)) is not None]
            result.motions -= len(there) - len(bottoms)
            there = bottoms
        elif here and there and all(reading.rows[row].kind == "OTHER" for row in here):
            # A canned cycle: many motions of rs274, of which the end is read.
            passes = [one[-1] for one in _passes(there)]
            result.motions -= len(there) - len(passes)
            there = [index for index in passes if not _left_at_the_bottom(motions[index])]
            if len(here) not in (1, len(there)):
                continue
        if not here:
            there = [index for index in there if not motions[index].still]
            result.motions -= len(runs[line]) - len(there)
            if there and not reading.reported(line):
                differ("missing", line, f"{len(there)} motions of rs274 without row and without finding")
            continue
        if not there:
            if claimed and reading.rows[claimed[0]].continues and not reading.reported(line):
                differ("extra", line, "a motion that does not run")
            continue
        if len(here) == 1:
            pairs = [(here[0], index) for index in there]
        elif len(here) == len(there):
            pairs = list(zip(here, there, strict=True))
        elif claimed and not (len(here) > len(there) and reading.may_end_before(here[len(there)])):
            differ("extra", line, f"{len(here)} rows, rs274 has {len(there)} motions")
            continue
        else:
            pairs = []
        for number, index in pairs:
            row, motion = reading.rows[number], motions[index]
            near = row.located and place_error(row, motion) <= DIGIT * motion.step
            result.located += near
            if not row.claimed:
                result.misplaced += row.located and not near and len(there) == 1
                continue
            wrong = _check(row, motion)
            for kind, message in wrong:
                differ(kind, line, message)
            result.known += not wrong
            if len(pairs) == len(here) and row.continues:
                first[number] = index
    order = [first[number] for number in sorted(first)]
    for before, after in pairwise(order):
        if after < before:
            differ("order", motions[after].line, f"it runs before line {motions[before].line}")
            break
    return result


def _passes(indices: list[int]) -> list[list[int]]:
    """Motions that follow each other."""
    passes: list[list[int]] = []
    for index in indices:
        if passes and passes[-1][-1] == index - 1:
            passes[-1].append(index)
        else:
            passes.append([index])
    return passes


def _bottom(motions: list[Motion], hole: list[int]) -> int | None:
    """The motion of a drill cycle that ends deepest, None where none goes down."""
    feeds = [index for index in hole if motions[index].kind == "LIN"]
    axes = [np.flatnonzero(np.abs(motions[i].end - motions[i].start) > 2 * motions[i].step) for i in feeds]
    straight = [axis for axis in axes if len(axis)]
    if not straight or any(len(axis) != 1 or axis[0] != straight[0][0] for axis in straight):
        return None
    return min(feeds, key=lambda index: float(motions[index].end[straight[0][0]]))


def _left_at_the_bottom(motion: Motion) -> bool:
    """The end of G88, where the operator retracts the tool."""
    step = motion.end - motion.start
    return motion.kind == "LIN" and int((step < -1e-3).sum()) == 1 and bool((step < 1e-3).all())


def place_error(row: Row, motion: Motion) -> float:
    """[mm] the farthest of the three coordinates."""
    return float(np.abs(row.end - motion.end).max())


def _check(row: Row, motion: Motion) -> list[tuple[str, str]]:
    """What a claimed row has other than rs274: kinds and messages."""
    wrong: list[tuple[str, str]] = []
    if row.kind not in (motion.kind, "OTHER"):
        return [("kind", f"{row.kind}, rs274 has {motion.kind}")]
    if place_error(row, motion) > DIGIT * motion.step:
        wrong.append(("target", f"{_shown(row.end)}, rs274 has {_shown(motion.end)}"))
    elif motion.kind == "CIRC" and np.isfinite(row.sweep):
        wrong += _check_arc(row, motion)
    if row.base >= 0 and row.base != motion.base:
        wrong.append(("base", f"work offset {row.base}, rs274 has {motion.base}"))
    if np.isfinite(row.offset).all() and row.base != 0:
        turned = (row.turn - motion.rotation + 180.0) % 360.0 - 180.0
        if np.abs(row.offset - motion.offset).max() > 2 * motion.offset_step or abs(turned) > 1e-3:
            wrong.append(("offset", f"{_shown(row.offset)}, rs274 has {_shown(motion.offset)}"))
    elif row.base >= 0 and motion.rewritten:
        wrong.append(("offset", "the work offset is not that of the cell: the program changes it"))
    if motion.tool > 0 and row.tool >= 0 and row.tool != motion.tool:
        wrong.append(("tool", f"tool {row.tool}, rs274 has {motion.tool}"))
    return wrong


def _check_arc(row: Row, motion: Motion) -> list[tuple[str, str]]:
    u, v, w = motion.plane
    plane, axis = [u, v], np.eye(3)[w]
    step = max(motion.step, motion.start_step)
    assert motion.centre is not None
    sign = float(row.normal @ axis)
    if abs(abs(sign) - 1.0) > 1e-9:
        return [("arc", f"normal {_shown(row.normal)}, rs274 has the axis {_shown(axis)}")]
    # The normal of G18 is Y, and Z, X, Y is right-handed as X, Y, Z is.
    if sign * motion.turn < 0:
        return [("arc", "the other sense of turn")]
    off = float(np.abs(row.centre - motion.centre)[plane].max())
    if off > 3 * step:
        return [("arc", f"centre {_shown(row.centre)}, rs274 has {_shown(motion.centre)}")]
    radius = float(np.linalg.norm((motion.end - motion.centre)[plane]))
    if abs(row.sweep - abs(motion.turn)) > 10 * step / max(radius, step):
        return [("arc", f"turns by {row.sweep:.5f}, rs274 by {abs(motion.turn):.5f}")]
    return []


def _shown(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.5f}" for value in vector) + ")"
