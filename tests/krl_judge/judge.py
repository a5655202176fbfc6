"""Compares what the reader claims with what several runs of the program execute; makes a program smaller.

Every execution of a line is held against the rows of that line.  One row speaks for all of them.  Where a line has
several rows, as many as it is executed, or more, they follow each other in that order.  Where it is executed more
often, or inputs decide how often, each execution has to be that of some row.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from . import claims
from .claims import Claim, Tables
from .machine import Inputs, Run, load, run
from .motions import Executed, Six
from .syntax import routines
from .values import FRAME, Stop, matrix, rotation

LENGTH, ANGLE = 1e-6, math.radians(1e-7)
"""[mm], [rad]; what numbers of the size of a metre carry in double precision is below."""

Reader = Callable[[str, str, str, Tables], list[Claim]]


@dataclass(frozen=True)
class Case:
    """A program, what belongs to it, and with what inputs it runs."""

    src: str
    dat: str = ""
    config: str = ""
    inputs: tuple[Inputs, ...] = ({},)

    def __str__(self) -> str:
        parts = [self.src]
        parts += [f"--- part.dat\n{self.dat}"] * bool(self.dat)
        parts += [f"--- $config.dat\n{self.config}"] * bool(self.config)
        return "".join(parts) + f"--- $IN: {list(self.inputs)}\n"


@dataclass(frozen=True)
class Disagreement:
    line: int
    what: str
    """Of one word, which a smaller program has to keep, and the rest behind a colon."""

    @property
    def word(self) -> str:
        return self.what.partition(":")[0]


@dataclass(frozen=True)
class Verdict:
    """motions: executed in all runs; known: of these claimed; constant: of these whose line runs the same each time,
    with a determined target; stopped: runs that did not come to their end."""

    disagreements: tuple[Disagreement, ...] = ()
    runs: int = 0
    motions: int = 0
    known: int = 0
    constant: int = 0
    constant_known: int = 0
    stopped: int = 0


TABLES: Tables = {
    "BASE_DATA": {n: (100.0 * n, -40.0 * n, 30.0 + n, 3.0 * n, -2.0 * n, 1.5 * n) for n in range(1, 9)},
    "TOOL_DATA": {n: (10.0 * n, 4.0 - n, 150.0 + 7 * n, -2.0 * n, 30.0 + n, 0.5 * n) for n in range(1, 9)},
}


def judge(case: Case, reader: Reader | None = None) -> Verdict:
    """Runs a case with each of its inputs, first with the .dat as it is written, then again with what the runs before
    have left in it."""
    claimed = (reader or claims.read_claims)(case.src, case.dat, case.config, TABLES)
    try:
        runs = execute(case)
    except Stop:
        return Verdict()
    rows: dict[int, list[Claim]] = defaultdict(list)
    for claim in claimed:
        rows[claim.line].append(claim)
    found: dict[tuple[int, str], Disagreement] = {}
    known: dict[int, int] = defaultdict(int)
    executed: dict[int, list[Executed]] = defaultdict(list)
    by_line = [_by_line(one.motions) for one in runs]
    # where paths meet or part, a row may stand for any number of executions of its line
    parts = any(claim.apart and not claim.never for claim in claimed)
    for one, of_line in zip(runs, by_line, strict=True):
        for line, motions in of_line.items():
            executed[line] += motions
            always = all(len(other.get(line, ())) == len(rows[line]) for other in by_line)
            matched, why = align(rows[line], motions, parts or (one.reads_inputs and not always))
            known[line] += matched
            if why:
                found.setdefault((line, why.partition(":")[0]), Disagreement(line, why))
    for one in runs:
        for line, why in wrong_starts(claimed, one.motions):
            found.setdefault((line, "start"), Disagreement(line, why))
    constant = {line for line, motions in executed.items() if _one_motion(motions)}
    return Verdict(
        tuple(found.values()),
        len(runs),
        sum(map(len, executed.values())),
        sum(known.values()),
        sum(len(executed[line]) for line in constant),
        sum(known[line] for line in constant),
        sum(bool(one.stopped) for one in runs),
    )


def judge_split(case: Case) -> Verdict:
    """As ``judge``, where every routine but the first is in a module of its own, of which nothing is claimed."""
    last = claims.split(case.src)[0].count("\n")
    verdict = judge(case, claims.read_split_claims)
    own = tuple(one for one in verdict.disagreements if one.line <= last)
    return replace(verdict, disagreements=own)


def wrong_starts(claimed: Sequence[Claim], motions: Sequence[Executed]) -> Iterator[tuple[int, str]]:
    """Motions that are said to start where the one before them in the text ends, and to be the only ones that do, but
    are not; of lines with one row."""
    rows = Counter(claim.line for claim in claimed)
    before = {row.line: last.line for last, row in pairwise(claimed) if not row.apart}
    before = {line: last for line, last in before.items() if rows[line] == rows[last] == 1}
    after = {last: line for line, last in before.items()}
    lines = [motion.line for motion in motions]
    if lines and lines[0] in before:
        yield lines[0], f"start: it comes first, not after line {before[lines[0]]}"
    for last, line in pairwise(lines):
        if line in before and before[line] != last:
            yield line, f"start: it comes after line {last}, not {before[line]}"
        if last in after and after[last] != line:
            yield line, f"start: line {last} leads to it, not to {after[last]} alone"


def execute(case: Case) -> list[Run]:
    first = load(TABLES, case.dat, case.config)
    code = routines(case.src)
    runs = [run(code, first.copy(), inputs) for inputs in case.inputs]
    memory = first.copy()
    for inputs in (*case.inputs[-2:], case.inputs[0]):
        runs.append(run(code, memory, inputs))
    return runs


def _by_line(motions: Sequence[Executed]) -> dict[int, list[Executed]]:
    out: dict[int, list[Executed]] = defaultdict(list)
    for motion in motions:
        out[motion.line].append(motion)
    return out


def _one_motion(motions: Sequence[Executed]) -> bool:
    first = motions[0]
    frames = first.base is not None and first.tool is not None
    determined = (frames or first.axes is not None) and not any(v != v for v in (first.axes or first.target))
    return determined and all(
        (m.target, m.axes, m.base, m.tool, m.origin)
        == (first.target, first.axes, first.base, first.tool, first.origin)
        for m in motions
    )


def align(rows: Sequence[Claim], motions: Sequence[Executed], inputs: bool) -> tuple[int, str]:
    """How many executions of a line are claimed, and what is wrong, or "".  inputs: they decide how often it runs."""
    if not rows:
        return 0, "missing: the line has no row"
    if all(row.never for row in rows):
        return 0, "never: it runs and is said not to"
    inputs = inputs or any(row.apart for row in rows)  # such rows stand where nothing is said of the order
    if len(rows) == 1 or (len(rows) == len(motions) and not inputs):
        pairs = list(zip(list(rows) * (len(motions) if len(rows) == 1 else 1), motions, strict=True))
        why = next((text for row, motion in pairs if (text := differs(row, motion))), "")
        return sum(row.claimed for row, _ in pairs), why
    in_order = len(motions) < len(rows) and not inputs
    known = at = 0
    for motion in motions:
        turn = range(at, len(rows)) if in_order else [k % len(rows) for k in range(at, at + len(rows))]
        fit = next((k for k in turn if not differs(rows[k], motion)), None)
        if fit is None:
            return known, "none of the rows: " + "; ".join(
                filter(None, (differs(row, motion) for row in rows))
            )
        known += rows[fit].claimed
        at = fit + 1
    return known, ""


def differs(row: Claim, motion: Executed) -> str:
    """Why a claim is not true of an execution; "" where it is, or nothing is claimed."""
    if not row.claimed:
        return ""
    if row.kind != motion.kind:
        return f"kind: {row.kind}, it is {motion.kind}"
    for name, claimed, true in (("base", row.base, motion.base), ("tool", row.tool, motion.tool)):
        if claimed is not None:
            if true is None:
                return f"{name}: it is not set"
            if not _same_place(claimed, matrix(dict(zip(FRAME, true, strict=True)))):
                return f"{name}: {np.round(claimed[:3, 3], 6)}, it is {true}"
    if row.force != motion.force:
        return f"force: {row.force!r}, it is {motion.force!r}"
    why = _target(row, motion)
    if why or motion.kind in ("AXIS", "PTP"):
        return why
    if math.isfinite(row.feed) and (motion.feed is None or abs(row.feed - motion.feed) > 1e-9):
        return f"feed: {row.feed}, it is {motion.feed}"
    told = motion.approximation is not None and math.isfinite(row.approximation)
    if told and not abs(row.approximation - motion.approximation) <= LENGTH:
        return f"approximation: {row.approximation}, it is {motion.approximation}"
    if row.orientation and motion.ori_type is not None and row.orientation != motion.ori_type:
        return f"orientation: {row.orientation}, it is {motion.ori_type}"
    return _arc(row, motion)


def _target(row: Claim, motion: Executed) -> str:
    if motion.axes is not None:
        near = row.axes is not None and _near(row.axes, motion.axes, 1e-7)
        return "" if near else f"axes: {row.axes}, it is {motion.axes}"
    true = motion.target
    if row.partial is not None:
        for key, claimed, value in zip(FRAME, row.partial, true, strict=True):
            if math.isnan(claimed) != (value is None) or (
                value is not None and not abs(claimed - value) <= LENGTH
            ):
                return f"partial: {key} {claimed}, it is {value}"
        near = row.origin is not None and motion.origin is not None and _near(row.origin, motion.origin, 1e-7)
        return "" if near else f"origin: from {row.origin}, it is from {motion.origin}"
    if None in true or not _near(row.position, true[:3], LENGTH):
        return f"target: {np.round(row.position, 6)}, it is {true}"
    if not _same_turn(row.rotation, rotation(*true[3:])):
        return f"turn: of {np.round(row.position, 6)}, it is {true}"
    return ""


def _arc(row: Claim, motion: Executed) -> str:
    if motion.arc is None or row.arc is None:
        return "" if row.arc is None else "arc: it is none"
    (centre, normal, sweep), (c, n, s) = row.arc, motion.arc
    size = 1.0 + float(np.linalg.norm(c - motion.target[:3]))
    if _near(centre, c, 1e-6 * size) and _near(normal, n, 1e-6) and abs(sweep - s) < 1e-4:
        return ""
    return f"arc: {centre} {normal} {sweep}, it is {c} {n} {s}"


def _near(one: np.ndarray, other: Sequence[float] | Six | np.ndarray, by: float) -> bool:
    return bool((np.abs(np.asarray(one, float) - np.asarray(other, float)) <= by).all())


def _same_turn(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.linalg.norm(one - other) <= 2 * ANGLE)


def _same_place(one: np.ndarray, other: np.ndarray) -> bool:
    return _near(one[:3, 3], other[:3, 3], LENGTH) and _same_turn(one[:3, :3], other[:3, :3])


def shrunk(case: Case, remains: Callable[[Case], bool]) -> Case:
    """The case with lines and inputs dropped as long as what is looked for remains."""
    before = None
    while before != case:
        before = case
        for part in ("src", "dat", "config"):
            lines = getattr(case, part).splitlines(keepends=True)
            size = len(lines)
            while size:
                at = 0
                while at < len(lines):
                    shorter = lines[:at] + lines[at + size :]
                    smaller = replace(case, **{part: "".join(shorter)})
                    if remains(smaller):
                        case, lines = smaller, shorter
                    else:
                        at += size if size > 4 else 1
                size = size // 2 if size > 6 else size - 1
        for inputs in case.inputs:
            if len(case.inputs) > 1 and remains(smaller := replace(case, inputs=(inputs,))):
                case = smaller
                break
    return case
