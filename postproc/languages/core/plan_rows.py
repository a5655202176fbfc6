"""A plan beside the rows of the program that it is made for: which of them move, and what must not."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints, differs
from postproc.base.batches import each_block
from postproc.base.decimals import fixed_one
from postproc.base.findings import Finding
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import MM
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.toolpath import Kind, Role, Toolpath

BLOCK = 1 << 14
"""Motions that are written at a time."""


@dataclass(frozen=True)
class ArcLimits:
    """What arcs three points in digits define, and the controller takes: fullest, smallest: sweep [rad]; nearest [mm]:
    distance of the points; ``word``: the motion, as messages call it."""

    fullest: float
    smallest: float
    nearest: float
    word: str


class PlanRows:
    """A program, the plan for it, and what is looked up in both.  own (N,): the motion of the plan that takes the text
    of each row."""

    limits: ArcLimits

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        self.program, self.plan, self.writing = program, plan, writing
        self.path: Toolpath = program.toolpath
        self.raw = program.documents[0].raw
        self.own: Ints = np.flatnonzero(plan.own)
        if not np.array_equal(plan.source[self.own], np.arange(len(self.path))):
            raise ValueError("a plan needs one motion with the text of every row")

    def moved(self, rows: Ints | slice, motions: Ints) -> tuple[Bools, Bools]:
        """(K,) whether motions (K,) of the plan are elsewhere than the rows (K,) they stem from; turned otherwise."""
        shifted = np.asarray(differs(self.plan.position[motions], self.path.position[rows]).any(axis=1))
        turned = np.asarray(differs(self.plan.rotation[motions], self.path.rotation[rows]).any(axis=(1, 2)))
        return shifted, turned

    def touched(self, may_be_entered: Set[int] = frozenset()) -> tuple[Bools, Bools]:
        """(N,) rows whose end is another one, and arcs whose path is.  may_be_entered: rows before which something may
        be inserted whatever is said of them otherwise.

        Raises ValueError where the plan moves or divides what cannot be: a defect of the caller.
        """
        path, plan, own = self.path, self.plan, self.own
        n = len(path)
        touched, way = np.zeros(n, np.bool_), np.zeros(n, np.bool_)

        def ends(rows: slice) -> None:
            shifted, turned = self.moved(rows, own[rows])
            touched[rows] = shifted | turned

        each_block(ends, n)
        for arcs in blocks(np.flatnonzero(path.kind == Kind.CIRC)):
            there = own[arcs]
            way[arcs] = differs(plan.centre[there], path.arcs.centre[arcs]).any(axis=1)
            way[arcs] |= differs(plan.normal[there], path.arcs.normal[arcs]).any(axis=1)
            way[arcs] |= differs(plan.sweep[there], path.arcs.sweep[arcs])
        self._refuse_forbidden(touched, way, may_be_entered)
        return touched, way

    def _refuse_forbidden(self, touched: Bools, path_changes: Bools, may_be_entered: Set[int]) -> None:
        path, plan = self.path, self.plan
        fixed = path.constraints
        moved = {row for row in (*fixed.refused, *fixed.locked) if touched[row]}
        moved |= {row for row in fixed.refused if path_changes[row]}
        moved |= set(np.flatnonzero(touched & (path.kind == Kind.AXIS)).tolist())
        refuse_moved(sorted(moved))
        divided = set(plan.source[plan.role != Role.ORIGINAL].tolist())
        refuse_divided(sorted(divided & ({*fixed.refused, *fixed.no_insert_before} - may_be_entered)))

    def middles(self, motions: Ints) -> Floats:
        """(K, 3) [mm] points in the middle of the arcs ``motions`` (K,); NaN for motions that are no arcs."""
        plan = self.plan
        centre = plan.centre[motions]
        back = rotation_from_vector(np.nan_to_num(-0.5 * plan.sweep[motions][:, None] * plan.normal[motions]))
        radius = plan.position[motions] - centre
        return np.asarray((centre + (back @ radius[..., None])[..., 0]) / MM)

    def unfit_arc(self, motion: int) -> str:
        """Why three points in digits do not define an arc of the plan; "" where they do."""
        limits, sweep = self.limits, float(self.plan.sweep[motion])
        end = self.plan.position[np.array([motion])][0]
        radius = float(np.linalg.norm(end - self.plan.centre[motion])) / MM
        nearest = 2 * radius * min(abs(np.sin(sweep / 4)), abs(np.sin(sweep / 2)))
        if sweep > limits.fullest:
            return "the corrected arc is nearly a full turn, which three points do not define"
        if sweep < limits.smallest or nearest < limits.nearest:
            return f"the corrected arc is too short for {limits.word}"
        return ""


Task = TypeVar("Task", bound=PlanRows)


class TargetWriter(Generic[Task]):
    """The rows of a plan that are written, and why some cannot be.  ``code``: of these; ``help``: what to do."""

    code: str
    help: str

    def __init__(self, task: Task) -> None:
        self.task = task
        self.refused: dict[int, Finding] = {}

    @abstractmethod
    def start(self, row: int) -> int:
        """The byte at which the motion of a row starts."""

    def refuse(self, row: int, why: str, code: str = "") -> None:
        """Takes up why a row cannot be written; the first reason counts."""
        document = self.task.program.documents[0]
        place = document.place(self.start(row))
        found = Finding(code or self.code, why, str(document.path), *place, self.help)
        self.refused.setdefault(row, found)


def refuse_moved(rows: Sequence[int]) -> None:
    """Raises ValueError for rows that a plan moves, and that stay: a defect of the caller."""
    if rows:
        raise ValueError(f"motions that cannot be corrected are moved: rows {rows[:5]}")


def refuse_divided(rows: Sequence[int]) -> None:
    """Raises ValueError for rows before which a plan inserts, and nothing can be: a defect of the caller."""
    if rows:
        raise ValueError(f"motions that cannot be divided are divided: rows {rows[:5]}")


class PlannedNumbers(NamedTuple):
    """Numbers of a point: what the text says, what is wanted, and the decimals of each."""

    own: list[float]
    wanted: list[float]
    decimals: list[int]

    def changed(self) -> list[int]:
        """Those that differ by more than half a written step."""
        return [
            i
            for i, (own, wanted, count) in enumerate(zip(self.own, self.wanted, self.decimals, strict=True))
            if not abs(wanted - own) <= 0.5 * 10.0**-count
        ]

    def literal(self, i: int) -> bytes:
        """The wanted number as it is written."""
        return fixed_one(self.wanted[i], self.decimals[i])


def blocks(rows: Ints) -> Iterator[Ints]:
    """Parts (M,) of rows (K,) that are worked on at a time, one after the other."""
    return (rows[at : at + BLOCK] for at in range(0, len(rows), BLOCK))
