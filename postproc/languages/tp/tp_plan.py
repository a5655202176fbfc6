"""What is to be written of a plan, in the numbers and the spelling of the text."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.decimals import decimals_of, fixed_one
from postproc.base.document import Span
from postproc.base.geometry import abc_from_rotation, rotation_from_vector, turn_between
from postproc.base.units import DEG, MM
from postproc.languages.core.plan_rows import ArcLimits, PlannedNumbers, PlanRows
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.tp.position_data import CARTESIAN, EXTERNAL, TpPosition
from postproc.languages.tp.tp_source_map import TpSourceMap
from postproc.languages.tp.tp_statements import TpMove

MOST_POINTS = 10**8
"""Numbers of points from here on are left out where the next free one is looked for: more digits are not read."""


class TpPlanNumbers(PlanRows):
    """The rows of a listing beside a plan, with their points."""

    limits = ArcLimits(330 * DEG, 1 * DEG, 0.1, "C")

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        super().__init__(program, plan, writing)
        self.places: TpSourceMap = program.text
        self.least = [writing.mm] * 3 + [writing.deg] * 3

    def move(self, row: int) -> TpMove:
        """Raises ValueError for a motion that is not understood."""
        move = self.places.moves[row]
        if move is None:
            raise ValueError(f"row {row} is not understood and cannot be written")
        return move

    def place(self, row: int, span: tuple[int, int]) -> Span:
        """Of a part of the statement of a row."""
        start = int(self.places.starts[row])
        return Span(0, start + span[0], start + span[1])

    def point(self, row: int) -> TpPosition:
        """Raises ValueError for a motion without a target in /POS."""
        point = self.places.target(row)
        if point is None:
            raise ValueError(f"row {row} has no target")
        return point

    def decimals(self, point: TpPosition) -> list[int]:
        """Of the six numbers of a point: those of the text, or the least."""
        spans = point.groups[0].spans
        return [
            max(least, decimals_of(self.raw[slice(*spans[name])]))
            for name, least in zip(CARTESIAN, self.least, strict=True)
        ]

    def wanted(self, rows: Ints, motions: Ints) -> Floats:
        """(K, 6) [mm, deg] targets of motions (K,) of the plan that stem from rows (K,), in the spelling of the
        text."""
        numbers = self.places.numbers[rows].copy()
        shifted, turned = self.moved(rows, motions)
        numbers[shifted, :3] = self.plan.position[motions[shifted]] / MM
        if turned.any():
            near = numbers[turned, 5:2:-1] * DEG
            numbers[turned, 3:] = abc_from_rotation(self.plan.rotation[motions[turned]], near)[:, ::-1] / DEG
        return numbers

    def vias(self, motions: Ints, near: Floats) -> Floats:
        """(K, 6) [mm, deg] points in the middle of the arcs ``motions`` (K,), with half of the turn of the tool, in the
        spelling of ``near`` (K, 6)."""
        plan = self.plan
        start = plan.rotation[np.maximum(motions - 1, 0)]
        turn = rotation_from_vector(0.5 * turn_between(start, plan.rotation[motions]))
        angles = abc_from_rotation(turn @ start, near[:, 5:2:-1] * DEG)[:, ::-1] / DEG
        return np.concatenate([self.middles(motions), angles], axis=1)


def new_literals(numbers: PlannedNumbers) -> dict[bytes, bytes]:
    """Name -> new literal of those of X, Y, Z, W, P, R that change."""
    return {CARTESIAN[i]: numbers.literal(i) for i in numbers.changed()}


class NewPoints:
    """Points that are added to /POS, with numbers above those that the file has or names, unless these are absurd."""

    def __init__(self, task: TpPlanNumbers) -> None:
        self.task = task
        places = task.places
        used = np.concatenate([places.targets, places.middles, [0]])
        known = chain([int(used[used < MOST_POINTS].max())], places.positions, places.read)
        self.next = max(number for number in known if number < MOST_POINTS) + 1
        self.texts: list[bytes] = []

    def add(self, source: TpPosition, literals: Mapping[bytes, bytes], named: bool = False) -> int:
        """The number of a new point: ``source`` with other ``literals`` by their names; ``named``: and its comment."""
        number, self.next = self.next, self.next + 1
        raw, spans = self.task.raw, source.groups[0].spans
        parts = [(*source.number_span, b"%d" % number)]
        comment = raw[slice(*source.comment)]
        if not (named and comment.isascii() and comment.replace(b" ", b"").replace(b'"', b"")[1:].isalnum()):
            parts.append((*source.comment, b""))
        parts += [(*spans[name], text) for name, text in literals.items()]
        text, at = b"", source.start
        for start, stop, new in sorted(parts):
            text += raw[at:start] + new
            at = stop
        self.texts.append(text + raw[at : source.stop] + self.task.program.documents[0].newline)
        return number

    def external(self, source: TpPosition, now: list[float], end: list[float]) -> dict[bytes, bytes] | None:
        """Literals of external axes at ``now`` (6) [mm or deg] instead of ``end`` (6); None where they are not
        known."""
        literals: dict[bytes, bytes] = {}
        for name, there, last in zip(EXTERNAL, now, end, strict=True):
            if there == last or (there != there and last != last):
                continue
            if not np.isfinite(there) or name not in source.groups[0].spans:
                return None
            literals[name] = fixed_one(there, self.task.least[0])
        return literals
