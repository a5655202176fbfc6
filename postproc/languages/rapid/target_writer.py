"""A plan as edits: literals of targets where they serve one motion, targets in numbers elsewhere, inserted motions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.decimals import fixed, fixed_one
from postproc.base.document import Edit, Edits, Span
from postproc.languages.core.plan_rows import PlannedNumbers, TargetWriter, blocks
from postproc.languages.dialect import EditedTargets, Plan, Program, WritingSettings
from postproc.languages.rapid.inserted_lines import insertions
from postproc.languages.rapid.plan_writer import PlanWriter, aggregate
from postproc.languages.rapid.target_places import MotionText, PointText

_OPERAND = frozenset(b"0123456789 \t.,:+-*/'=#_$[]{}()\\ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz")


def edit_targets(program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
    """The edits after which the program makes the motions of ``plan``.

    Raises ValueError if a row is asked to move, or to be divided, that cannot: a defect of the caller.
    """
    return _Writer(program, plan, writing).edited()


class _Writer(TargetWriter[PlanWriter]):
    code = "RAP015"
    help = "Give each motion its own point in numbers."

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        super().__init__(PlanWriter(program, plan, writing))

    def edited(self) -> EditedTargets:
        task = self.task
        touched, way = task.touched()
        changed = np.flatnonzero(touched | way)
        plain = task.places.motions.is_plain(changed)
        edits = list(self._in_text(changed[~plain]))
        numbers = (self._in_lines(part) for part in blocks(changed[plain]))
        inserted, unfit = insertions(task)
        for row, why in unfit.items():
            self.refuse(row, why, "RAP012")
        if self.refused:
            return EditedTargets((), self.refused)
        return EditedTargets(Edits.collected(chain([edits, inserted], numbers)))

    def _in_lines(self, rows: Ints) -> Edits:
        """Edits of the literals of ``rows`` (K,) of runs of common lines, each of one motion alone."""
        task = self.task
        own, written, start, stop = task.places.literals(rows)
        decimals = np.maximum(written, task.least)
        wanted = task.wanted(own, rows, task.own[rows])
        changed = ~(np.abs(wanted - own) <= 0.5 * 10.0**-decimals)
        texts, ends = fixed(wanted[changed], decimals[changed])
        start, stop = start[changed], stop[changed]
        return Edits(np.zeros(len(start), np.int8), start, stop, texts, ends)

    def _in_text(self, rows: Ints) -> Iterator[Edit]:
        """Edits of the targets of ``rows`` (K,), and of the auxiliary points of arcs."""
        task = self.task
        there = task.own[rows]
        said = task.places.numbers(rows)
        wanted, vias = task.wanted(said, rows, there), task.middles(there)
        for k, row in enumerate(rows.tolist()):
            text = task.text(row)
            if text.target is None:
                raise ValueError(f"row {row} has no target")
            numbers = PlannedNumbers(said[k].tolist(), wanted[k].tolist(), task.decimals(text.target, 7))
            yield from self._point(row, text, text.target, numbers)
            if text.via is None:
                continue
            own = task.places.vias[row].tolist()
            numbers = PlannedNumbers(own, vias[k].tolist(), task.decimals(text.via, 3))
            if numbers.changed():
                unfit = task.unfit_arc(int(there[k]))
                if unfit:
                    self.refuse(row, unfit, "RAP012")
                yield from self._point(row, text, text.via, numbers)

    def _point(self, row: int, text: MotionText, point: PointText, numbers: PlannedNumbers) -> Iterator[Edit]:
        """The edits of a point: its literals, or a point in numbers in the place of the argument."""
        changed = numbers.changed()
        if not changed:
            return
        spots = [point.spots[i] for i in changed]
        why = self._why_not_in_place(point, spots)
        if not why:
            for i, (start, stop) in zip(changed, spots, strict=True):
                yield Edit(Span(0, start, stop), numbers.literal(i))
            return
        raw, (start, stop) = self.task.raw, point.operand
        if self.task.writing.shared_points == "keep":
            self.refuse(row, why)
        elif not point.words:
            self.refuse(row, f"{why}, and its configuration or external axes are not known in numbers")
        elif b"\n" in raw[text.start : stop] or b"\r" in raw[text.start : stop]:
            self.refuse(row, f"{why}, and its statement runs over several lines")
        elif not set(raw[start:stop]) <= _OPERAND:
            self.refuse(row, f"{why}, and its target contains other signs than numbers and names")
        else:
            texts = self.task.spelt(point, numbers)
            if len(texts) == 3:
                texts += self._orientation(row)
            yield Edit(Span(0, start, stop), aggregate(texts, point.words))

    def _orientation(self, row: int) -> list[bytes]:
        """q1..q4 that an auxiliary point gets in numbers: those of the target, which count for nothing."""
        least = self.task.least[3:]
        pairs = zip(self.task.places.numbers(np.array([row]))[0, 3:].tolist(), least, strict=True)
        return [fixed_one(value, count) for value, count in pairs]

    def _why_not_in_place(self, point: PointText, spots: list[tuple[int, int]]) -> str:
        """Why the literals of a point cannot be edited; "" where they can."""
        shown = point.name.decode("latin-1")[:40]
        if any(start < 0 for start, _ in spots):
            return "its target is computed"
        if point.name and point.name in self.task.places.read:
            return f"other code reads {shown} too"
        if any(self.task.places.motions.uses(start) > 1 for start, _ in spots):
            return f"{shown or 'its target'} is shared by several motions"
        return ""

    def start(self, row: int) -> int:
        return self.task.text(row).start
