"""A plan as edits: numbers of points that serve one motion, new points elsewhere, inserted and renumbered lines."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator
from itertools import chain, islice

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.decimals import fixed, literals, other_literal
from postproc.base.document import Edit, Edits, Span
from postproc.languages.core.plan_rows import BLOCK, PlannedNumbers, TargetWriter, blocks
from postproc.languages.dialect import EditedTargets, Plan, Program, Role, WritingSettings
from postproc.languages.tp.position_data import TpPosition
from postproc.languages.tp.tp_plan import NewPoints, TpPlanNumbers, new_literals
from postproc.languages.tp.tp_statements import INSERTED_CNT, TpMove
from postproc.toolpath import Kind

FLOWING = b"CNT%d" % INSERTED_CNT
"""Of inserted points at which the robot does not stop, where the motion itself does."""


def edit_targets(program: Program, plan: Plan, writing: WritingSettings) -> EditedTargets:
    """The edits after which the program makes the motions of ``plan``.

    Raises ValueError if a row is asked to move, or to be divided, that cannot: a defect of the caller.
    """
    return _PointWriter(program, plan, writing).edited()


class _PointWriter(TargetWriter[TpPlanNumbers]):
    code = "FTP015"
    help = "Give each motion its own point."

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        super().__init__(TpPlanNumbers(program, plan, writing))
        self.points = NewPoints(self.task)

    def edited(self) -> EditedTargets:
        task = self.task
        touched, way = task.touched()
        arcs = np.flatnonzero(np.isfinite(task.path.arcs.sweep))
        way[arcs] |= touched[arcs - 1]  # the tool is to turn evenly from the new start
        divided = np.flatnonzero(task.plan.role != Role.ORIGINAL)
        touched |= way
        rewritten = self._rewritten_runs(touched, set(task.plan.source[divided].tolist()))
        touched[list(rewritten)] = True
        chosen = np.flatnonzero(touched)
        alone = self._have_own_points(chosen, rewritten)
        edits = list(self._in_text(chosen[~alone], rewritten))
        numbers = [self._in_points(part) for part in blocks(chosen[alone])]
        lines = self._inserted(divided)
        if self.refused:
            return EditedTargets((), self.refused)
        edited = bool(edits) or any(map(len, numbers))
        if self.points.texts:
            at = task.places.listing.points[1]
            edits.append(Edit(Span(0, at, at), b"".join(self.points.texts)))
        counted = self._numbered(lines, edited)
        parts = iter(lambda: list(islice(counted, BLOCK)), [])
        return EditedTargets(Edits.collected(chain([edits], numbers, parts)))

    def _rewritten_runs(self, moved: Bools, divided: set[int]) -> set[int]:
        """Rows of runs of A motions of which one is ``moved`` (N,), or an arc divided: their points are no longer on
        one circle, so that the run is written as L and C."""
        runs = self.task.places.runs
        arcs = {row for row in divided if row in runs and row != runs[row][0]}
        return {one for row in runs if moved[row] or row in arcs for one in runs[row]}

    def _have_own_points(self, rows: Ints, rewritten: set[int]) -> Bools:
        """(K,) whether of motions (K,) nothing is written but the numbers of a point that serves no other one."""
        places = self.task.places
        numbers = places.targets[rows]
        if places.any_read:
            return np.zeros(len(rows), np.bool_)
        alone = np.fromiter(map(places.positions.is_common, numbers.tolist()), np.bool_, len(rows))
        alone &= self.task.path.kind[rows] != Kind.CIRC
        alone &= ~np.isin(numbers, [*places.shared, *places.read])
        return np.asarray(alone & ~np.isin(rows, list(rewritten)))

    def _in_points(self, rows: Ints) -> Edits:
        """Edits of the numbers of the points of ``rows`` (K,) that have their own."""
        task = self.task
        spans = task.places.positions.common_spans(task.places.targets[rows].tolist())
        start, stop = spans[:, ::2].ravel(), spans[:, 1::2].ravel()
        _, written = literals(np.frombuffer(task.raw, np.uint8), start, stop, other_literal)
        decimals = np.maximum(written.reshape(-1, 6), task.least).ravel()
        own, wanted = task.places.numbers[rows].ravel(), task.wanted(rows, task.own[rows]).ravel()
        changed = ~(np.abs(wanted - own) <= 0.5 * 10.0**-decimals)
        texts, ends = fixed(wanted[changed], decimals[changed])
        return Edits(np.zeros(changed.sum(), np.int8), start[changed], stop[changed], texts, ends)

    def _in_text(self, rows: Ints, rewritten: set[int]) -> Iterator[Edit]:
        """Edits of the points of ``rows`` (K,), and of the form of those that are ``rewritten``."""
        task = self.task
        for part in blocks(rows):
            there = task.own[part]
            wanted = task.wanted(part, there)
            arcs = np.isfinite(task.plan.sweep[there]) & (task.path.kind[part] == Kind.CIRC)
            vias = np.full((len(part), 6), np.nan)
            near = np.where(
                np.isnan(task.places.vias[part]), task.places.numbers[part], task.places.vias[part]
            )
            if arcs.any():
                vias[arcs] = task.vias(there[arcs], near[arcs])
            for k, row in enumerate(part.tolist()):
                move = task.move(row)
                numbers = self._numbers(
                    task.point(row), task.places.numbers[row].tolist(), wanted[k].tolist()
                )
                yield from self._point(row, move, -1, task.point(row), numbers)
                if task.path.kind[row] == Kind.CIRC:
                    yield from self._via(row, move, int(there[k]), vias[k].tolist(), row in rewritten)
                elif row in rewritten:
                    yield Edit(task.place(row, move.head), b"L")

    def _numbers(self, point: TpPosition, own: list[float], wanted: list[float]) -> PlannedNumbers:
        return PlannedNumbers(own, wanted, self.task.decimals(point))

    def _via(
        self, row: int, move: TpMove, motion: int, wanted: list[float], rewritten: bool
    ) -> Iterator[Edit]:
        task = self.task
        if rewritten:
            self._check_arc(row, motion)
            yield Edit(task.place(row, move.head), b"C P[%d]" % self._middle(row, wanted))
            return
        via = task.places.middle(row)
        if via is None:
            raise ValueError(f"row {row} has no auxiliary point")
        numbers = self._numbers(via, task.places.vias[row].tolist(), wanted)
        if numbers.changed():
            self._check_arc(row, motion)
            yield from self._point(row, move, 0, via, numbers)

    def _middle(self, row: int, wanted: list[float]) -> int:
        """The number of a new point for the middle of an arc."""
        point = self.task.point(row)
        own = self.task.places.numbers[row].tolist()
        return self.points.add(point, new_literals(self._numbers(point, own, wanted)))

    def _check_arc(self, row: int, motion: int) -> None:
        unfit = self.task.unfit_arc(motion)
        if unfit:
            self.refuse(row, unfit, "FTP012")

    def _point(
        self, row: int, move: TpMove, which: int, point: TpPosition, numbers: PlannedNumbers
    ) -> Iterator[Edit]:
        """The edits of a point: its literals, or the number of a new point in the motion."""
        changed = new_literals(numbers)
        if not changed:
            return
        why = self._why_not_in_place(point)
        if not why:
            spans = point.groups[0].spans
            yield from (Edit(Span(0, *spans[name]), text) for name, text in changed.items())
        elif self.task.writing.shared_points == "keep":
            self.refuse(row, why)
        else:
            number = self.points.add(point, changed, named=True)
            yield Edit(self.task.place(row, move.points[which].span), b"%d" % number)

    def _why_not_in_place(self, point: TpPosition) -> str:
        """Why the numbers of a point cannot be edited; "" where they can."""
        places = self.task.places
        if point.number in places.read or places.any_read:
            return f"other statements read P[{point.number}] too"
        if point.number in places.shared:
            return f"P[{point.number}] is shared by several motions"
        return ""

    def _inserted(self, motions: Ints) -> dict[int, list[bytes]]:
        """Row -> texts of the motions before it, after their line numbers."""
        task = self.task
        lines: dict[int, list[bytes]] = {}
        for part in blocks(motions):
            rows = task.plan.source[part]
            wanted = task.wanted(rows, part)
            arcs = (task.plan.role[part] == Role.INTERMEDIATE) & (task.path.kind[rows] == Kind.CIRC)
            vias = np.full((len(part), 6), np.nan)
            if arcs.any():
                vias[arcs] = task.vias(part[arcs], task.places.numbers[rows[arcs]])
            external = None if task.plan.external is None else task.plan.external[part]
            for k, (motion, row) in enumerate(zip(part.tolist(), rows.tolist(), strict=True)):
                now = [] if external is None else external[k].tolist()
                text = self._line(motion, row, wanted[k].tolist(), vias[k].tolist(), now)
                lines.setdefault(row, []).append(text)
        return lines

    def _line(self, motion: int, row: int, wanted: list[float], via: list[float], now: list[float]) -> bytes:
        task = self.task
        move, point = task.move(row), task.point(row)
        literals = new_literals(self._numbers(point, task.places.numbers[row].tolist(), wanted))
        if now:
            external = self.points.external(point, now, task.path.external[row].tolist())
            if external is None:
                self.refuse(row, "the external axes of an inserted motion are not known in numbers", "FTP022")
            literals |= external or {}
        form = b"L"
        if via[0] == via[0]:
            self._check_arc(row, motion)
            form = b"C P[%d]" % self._middle(row, via)
        number = self.points.add(point, literals)
        passing = FLOWING if task.path.stops[row] else move.termination
        rounding = passing if task.plan.flows[motion] else b"FINE"
        words = [form, b"P[%d]" % number, move.speed, rounding, *([move.carried] if move.carried else [])]
        return b" ".join(words) + b"    ;"

    def _numbered(self, lines: dict[int, list[bytes]], edited: bool) -> Iterator[Edit]:
        """Edits that insert lines, count all lines again, and keep LINE_COUNT; the mark will be the first line."""
        task = self.task
        listing, document = task.places.listing, task.program.documents[0]
        if not lines and not edited:
            return
        before = {int(task.path.line[row]): texts for row, texts in lines.items()}
        count = 1 if task.program.marker is None else 0
        columns = listing.statements.columns()[:, 2:6]
        for part in blocks(columns):
            for line, start, first, last in part.tolist():
                width = last - first
                if start == 0 and task.raw.startswith(BOM_UTF8):
                    start = len(BOM_UTF8)
                for text in before.get(line, ()):
                    count += 1
                    number = str(count).rjust(width).encode()
                    yield Edit(Span(0, start, start), number + b":" + text + document.newline)
                if first < 0:
                    continue
                count += 1
                if int(task.raw[first:last]) != count:
                    yield Edit(Span(0, first, last), str(count).rjust(width).encode())
        span = listing.attributes.get(b"LINE_COUNT")
        if (
            span is not None
            and task.raw[slice(*span)].strip() == b"%d" % listing.count
            and count != listing.count
        ):
            yield Edit(Span(0, span[0], span[0] + len(b"%d" % listing.count)), b"%d" % count)

    def start(self, row: int) -> int:
        return self.task.place(row, self.task.move(row).head).start
