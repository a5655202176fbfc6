"""Moves motions of random programs, and runs what is written for them: each motion has to end where it did, or where it
was moved to."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.document import Document, apply
from postproc.base.units import MM
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program, ReadingSettings, WritingSettings
from postproc.toolpath import Kind, Plan, Toolpath

from .judge import Case, execute
from .motions import Executed
from .values import Stop, rotation

STEP = 0.5001e-3
"""[mm] Half of the last digit that is written."""
TURN = 3e-5
"""[rad] The same of three angles."""
SIX = 6
SIZES = (0.04, 0.2, -0.12, -0.36)


def read(case: Case) -> Program:
    documents = [Document(Path("part.src"), case.src.encode("latin-1"))]
    if case.dat:
        documents.append(Document(Path("part.dat"), case.dat.encode("latin-1")))
    references = (Document(Path("$config.dat"), case.config.encode("latin-1")),) if case.config else ()
    return DIALECTS["krl"].read(tuple(documents), ReadingSettings(references=references))


def movable(path: Toolpath) -> set[int]:
    """The lines whose motions are all correctable, and none of which an arc starts from."""
    fixed = {*path.constraints.refused, *path.constraints.locked}
    fixed |= set(np.flatnonzero(~path.known | ~np.isin(path.kind, (Kind.LIN, Kind.PTP, Kind.SPL))).tolist())
    for row in np.flatnonzero(path.kind == Kind.CIRC).tolist():
        fixed |= {row - 1, *path.predecessors.get(row, ())}
    lines = set(path.line.tolist())
    return lines - {int(path.line[row]) for row in fixed if row >= 0}


def moved(program: Program, lines: dict[int, np.ndarray]) -> tuple[Case | None, set[int]]:
    """The texts with the ends of ``lines`` shifted [mm]; or None, and the lines that cannot move so."""
    path = program.toolpath
    plan = Plan.of(path)
    position = np.array(plan.position)
    for line, shift in lines.items():
        position[path.line == line] += shift * MM
    found = DIALECTS["krl"].edit_targets(program, replace(plan, position=position), WritingSettings(3, 3))
    if found.unwritten:
        return None, {int(path.line[row]) for row in found.unwritten}
    texts = [
        apply(document, [edit for edit in found.edits if edit.span.file == index]).decode("latin-1")
        for index, document in enumerate(program.documents)
    ]
    return Case(*(*texts, "")[:2]), set()


def judge_written(case: Case, seed: int) -> tuple[int, list[str]]:
    """How many executions of moved lines there are, and what ends elsewhere than it should."""
    rng, program = random.Random(seed), read(case)
    path = program.toolpath
    share = rng.choice([0.1, 0.5, 1.0])
    shifts = {
        line: np.array([rng.choice(SIZES) for _ in range(3)])
        for line in sorted(movable(path)) if rng.random() < share
    }  # fmt: skip
    try:
        before = execute(case)
    except Stop:
        return 0, []
    while True:
        texts, kept = moved(program, shifts)
        if texts is not None:
            break
        if not kept & shifts.keys():
            return 0, [f"lines {sorted(kept)} are kept, and none of them moves"]
        shifts = {line: shift for line, shift in shifts.items() if line not in kept}
    after = execute(replace(case, src=texts.src, dat=texts.dat))
    at = _lines(case.src, texts.src)
    found: list[str] = []
    count = 0
    for one, other in zip(before, after, strict=True):
        if [at.get(motion.line) for motion in one.motions] != [motion.line for motion in other.motions]:
            found.append("other motions are executed")
            continue
        for motion, now in zip(one.motions, other.motions, strict=True):
            shift = shifts.get(motion.line)
            count += shift is not None
            if not _as_meant(motion, now, np.zeros(3) if shift is None else shift):
                found.append(f"line {motion.line}: {motion.target} moved by {shift} is {now.target}")
    return count, found


def _lines(before: str, after: str) -> dict[int, int]:
    """Lines keep their places."""
    count = before.count("\n")
    return dict(zip(range(1, count + 1), range(1, after.count("\n") + 1), strict=True))


def _as_meant(motion: Executed, now: Executed, shift: np.ndarray) -> bool:
    same = [(one.kind, one.axes, one.base, one.tool, one.feed, one.force) for one in (motion, now)]
    if repr(same[0]) != repr(same[1]):  # what is not determined is NaN
        return False
    pairs = [
        (old, new, by)
        for old, new, by in zip(motion.target, now.target, (*shift, 0.0, 0.0, 0.0), strict=True)
        if old is not None and new is not None and not math.isnan(old) and not math.isnan(new)
    ]
    if len(pairs) == SIX:  # a rotation has several spellings
        turned = rotation(*motion.target[3:]).T @ rotation(*now.target[3:])
        if np.abs(turned - np.eye(3)).max() > TURN:
            return False
        pairs = pairs[:3]
    return all(abs(new - old - by) <= STEP for old, new, by in pairs)
