"""What a reader claims of the motions of a program, held against one execution of it by another interpreter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from postproc.languages.dialect import Program


class Executed(Protocol):
    """A motion as it was executed: its line in the text, and the FORCE comment that was in force."""

    line: int
    force: str | None


ELSEWHERE = -2
"""Among the rows after which a row runs: another place, which may be any."""
M = TypeVar("M", bound=Executed)


def disagreements(
    program: Program,
    done: Sequence[M],
    never_runs: str,
    claims: Callable[[Program, int, M, int], list[str]],
    start: Callable[[M], int | None] = lambda motion: None,
) -> list[str]:
    """What does not agree, in words.

    never_runs: the code with which the reader says that a motion never runs; ``claims``: what is wrong with a row that
    it understands, given program, row, motion and the row before it; ``start``: another place than that row where the
    motion starts, -1 being the start of the program.
    """
    path = program.toolpath
    refused = path.constraints.refused
    row_of = {int(line): row for row, line in enumerate(path.line)}
    wrong: list[str] = []
    before = -1
    for motion in done:
        row = row_of.get(motion.line)
        if row is None:
            return [*wrong, f"line {motion.line}: a motion that the reader does not have"]
        if getattr(
            motion, "aside", False
        ):  # a trap or a handler runs it: what is said of its target has to hold
            wrong += [
                f"line {motion.line}: {one}"
                for one in ([] if row in refused else claims(program, row, motion, -2))
            ]
            continue
        elsewhere = start(motion)
        at = before if elsewhere is None else elsewhere
        what = []
        if row not in refused:
            what = [*claims(program, row, motion, at), *_force(program, row, motion)]
        elif refused[row].code == never_runs:
            what = ["it runs, and the reader says that it does not"]
        if path.continues[row]:
            if at != row - 1:
                what.append(f"it starts after row {at}, not after the row before it")
        elif row in path.predecessors and not {at, ELSEWHERE} & set(path.predecessors[row]):
            what.append(f"row {at} is no predecessor of row {row}")
        wrong += [f"line {motion.line}: {one}" for one in what]
        before = row
    return wrong


def _force(program: Program, row: int, motion: Executed) -> list[str]:
    force = None
    for note in program.toolpath.annotations:
        if note.row <= row and note.text.upper().startswith("FORCE"):
            force = note.text
    same = force == motion.force or {force, motion.force} <= {
        None,
        "FORCE OFF",
    }  # before a comment no force acts
    return [] if same else [f"force {force!r} instead of {motion.force!r}"]


def other_numbers(row: int, pairs: Sequence[tuple[str, np.ndarray, float | None]]) -> list[str]:
    """Speeds and corners that are claimed otherwise: word, claims of all rows [m], what was executed [mm]."""
    wrong = []
    for word, claims, actual in pairs:
        claimed = claims[row] * 1e3
        if actual is not None and np.isfinite(claimed) and abs(claimed - actual) > 1e-9:
            wrong.append(f"{word} {claimed} instead of {actual}")
    return wrong
