"""Targets that are written one by one: partial, shared, relative and named points, and the points of arcs."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.decimals import fixed_one, literals
from postproc.base.document import Edit, Span
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.languages.krl.arcs import half_way, on_arcs
from postproc.languages.krl.in_place import completion
from postproc.languages.krl.rewritten_lines import RewrittenLines
from postproc.languages.krl.source_map import Auxiliary, PointVariable
from postproc.languages.krl.write_plan import KrlWritePlan, other_literal

FULL = math.radians(300.0)
"""Arcs that sweep more keep their CA: a circle through points that are close to each other would not hold."""
FINER = 2
"""More decimals for the points of such a circle: what they are off by grows along it."""

Spot = tuple[int, int]
"""Document and offset of a literal."""
Via = tuple[list[float], list[int]]
"""Values [mm] and decimals of an auxiliary point, as the text gives it."""


@dataclass(slots=True)
class TargetEdit:
    """A point that a row needs in the text: its end, or the auxiliary point of its arc (three components).

    start, stop, file: literals of its components, -1 where there is none.  own, wanted, steps [mm, deg]: what they
    say, what is to be said, and half of a written step.  texts: six components as they are to be written.
    missing: components to be written into the aggregate, of those left_out.  The others: see ``Places``.
    """

    row: int
    start: list[int]
    stop: list[int]
    file: list[int]
    own: list[float]
    wanted: list[float]
    steps: list[float]
    texts: list[bytes]
    missing: list[int]
    left_out: list[int]
    insert: int
    home: int
    operand: Span
    variable: PointVariable | None
    text: int
    locked: str
    via: bool = False

    def moved(self) -> list[int]:
        """The components whose own literal, or expression, gives another value than is wanted."""
        return [
            i
            for i in range(len(self.start))
            if i not in self.left_out and _apart(self.own[i], self.wanted[i], i) > self.steps[i]
        ]

    def spots(self) -> list[tuple[int, Spot]]:
        """Components and the places of their literals."""
        return [(i, (self.file[i], self.start[i])) for i in range(len(self.start)) if self.start[i] >= 0]


def single_edits(task: KrlWritePlan, rows: Ints, completed: Bools) -> tuple[list[Edit], dict[int, Finding]]:
    """Edits of ``rows`` (K,), and the rows that cannot move as planned.

    completed (N, 6): components that a row leaves out and that must be written.
    """
    if not len(rows):
        return [], {}
    lines, edits = RewrittenLines(task), list[Edit]()
    needed: dict[int, list[TargetEdit]] = defaultdict(list)
    for target in _targets(task, rows, completed, lines):
        needed[target.text].append(target)
    users = _users(task, needed)
    for number, targets in needed.items():
        edits += _of_one_text(task, targets, users.get(number, {}), lines)
    edits += lines.edits()
    return edits, lines.refused


def _targets(task: KrlWritePlan, rows: Ints, completed: Bools, lines: RewrittenLines) -> Iterator[TargetEdit]:
    """The points that the rows need and that are not there yet; relative motions go to ``lines`` at once."""
    places, there = task.places, task.own[rows]
    said = task.components(rows)
    wanted = task.wanted(rows, said.own, task.plan.position[there], task.plan.rotation[there])
    vias, kept_angle = _arc_points(task, rows, wanted)
    finer = np.where(kept_angle[:, None] & (np.arange(6) < 3), FINER, 0)
    said = replace(said, decimals=said.decimals + finer)
    kept, steps = said.unchanged(wanted), said.half_step
    programmed_vias = _programmed_vias(task, [row for row in rows.tolist() if row in places.arcs])
    for k, row in enumerate(rows.tolist()):
        texts = task.texts(said, wanted, kept, k)
        arc = places.arcs.get(row)
        via = vias[k].tolist() if arc is not None and np.isfinite(vias[k, 0]) else []
        if row in places.relative:
            lines.absolute(row, texts, [fixed_one(v, int(task.least[0])) for v in via])
            continue
        if task.runs_unlike(row):
            lines.refuse(row, "its line runs several times, and what it inherits is not known each time")
            continue
        inherits = [i for i in range(6) if places.inherits[row] >> i & 1]
        _, start, stop, _ = places.motion[row].tolist()
        end = TargetEdit(
            row, places.start[row].tolist(), places.stop[row].tolist(), places.file[row].tolist(),
            said.own[k].tolist(), wanted[k].tolist(), steps[k].tolist(), texts,
            [i for i in inherits if completed[row, i] or task.has_angle[row]], inherits,
            int(places.insert[row]), int(places.home[row]), Span(0, start, stop),
            places.variables.get(row), int(places.text[row]), places.locked.get(row, ""),
        )  # fmt: skip
        if end.missing or end.moved():
            yield end
        if arc is None or not via:
            continue
        if arc.angle is not None:
            _change_angle(task, row, arc.angle, bool(kept_angle[k]), lines)
        finer_by = FINER if kept_angle[k] else 0
        auxiliary = _auxiliary(task, row, arc, programmed_vias[row], via, finer_by, texts[3:])
        if auxiliary.missing or auxiliary.moved():
            yield auxiliary


def _arc_points(task: KrlWritePlan, rows: Ints, wanted: Floats) -> tuple[Floats, Bools]:
    """Auxiliary points (K, 3) [mm] of the planned arcs, NaN for other motions, and whether CA stays (K,).

    A CA is dropped, as the end is written; a sweep of nearly a turn or more keeps it, and its points are at 120 and
    240 degrees (``wanted``: the latter goes there).
    """
    there = task.own[rows]
    sweep = task.plan.sweep[there]
    kept = task.has_angle[rows] & (sweep > FULL)
    vias = half_way(task.plan, there)
    if kept.any():
        third = 2 * math.pi / 3
        vias[kept] = on_arcs(task.plan, there[kept], sweep[kept] - third)
        wanted[kept, :3] = on_arcs(task.plan, there[kept], sweep[kept] - 2 * third)
    return vias, kept


def _auxiliary(
    task: KrlWritePlan,
    row: int,
    arc: Auxiliary,
    programmed: Via,
    via: list[float],
    finer: int,
    angles: list[bytes],
) -> TargetEdit:
    """The auxiliary point; ``angles``: A, B, C as written, that an own point gets besides (they do not count)."""
    own, decimals = programmed[0], [count + finer for count in programmed[1]]
    steps = [0.5 * 10.0**-count for count in decimals]
    texts = [fixed_one(value, count) for value, count in zip(via, decimals, strict=True)]
    left_out = [i for i in range(3) if arc.start[i] < 0]
    return TargetEdit(
        row, list(arc.start), list(arc.stop), list(arc.file), own, via, steps, [*texts, *angles],
        left_out, left_out, arc.insert, arc.home, arc.operand, arc.variable, arc.text, arc.locked, True,
    )  # fmt: skip


def _programmed_vias(task: KrlWritePlan, rows: list[int]) -> dict[int, Via]:
    """Values [mm] and decimals of the auxiliary points of rows, as the text gives them."""
    arcs = [task.places.arcs[row] for row in rows]
    start, stop, file = (
        np.array([getattr(arc, name) for arc in arcs], np.int64).reshape(-1, 3)
        for name in ("start", "stop", "file")
    )
    values, decimals = np.full(start.shape, math.inf), np.full(start.shape, int(task.least[0]))
    for index, raw in enumerate(task.raws):
        here = (start >= 0) & (file == index)
        values[here], written = literals(raw, start[here], stop[here], other_literal)
        decimals[here] = np.maximum(written, decimals[here])
    return dict(zip(rows, zip(values.tolist(), decimals.tolist(), strict=True), strict=True))


def _change_angle(task: KrlWritePlan, row: int, angle: Span, stays: bool, lines: RewrittenLines) -> None:
    """Drops the CA of a row, or sets it to the planned sweep."""
    if stays:
        plan, own = task.plan, task.own[row]
        radius = float(np.linalg.norm(plan.position[own] - plan.centre[own])) / MM
        decimals = int(task.least[0] + FINER + math.log10(max(radius, 1.0)))
        lines.ask(row, lines.replaced(angle, fixed_one(float(plan.sweep[own]) / DEG, decimals)))
    else:
        # ", CA 90": from the end point to the number.
        lines.ask(row, Edit(Span(0, int(task.places.motion[row, 2]), angle.stop), b""))


def _users(task: KrlWritePlan, needed: dict[int, list[TargetEdit]]) -> dict[int, dict[Spot, float]]:
    """Number of a text -> its literals that rows or arcs use which do not need another value, and the values."""
    places, numbers = task.places, np.array(sorted(needed))
    moving = {(target.row, target.via) for targets in needed.values() for target in targets}
    rows = np.flatnonzero(np.isin(places.text, numbers))
    rows = rows[[(row, False) not in moving for row in rows.tolist()]] if len(rows) else rows
    users: dict[int, dict[Spot, float]] = defaultdict(dict)
    said = task.components(rows) if len(rows) else None
    for k, row in enumerate(rows.tolist()):
        assert said is not None
        for i in range(6):
            if places.start[row, i] >= 0:
                spot = (int(places.file[row, i]), int(places.start[row, i]))
                users[int(places.text[row])][spot] = float(said.own[k, i])
    kept = [row for row, arc in places.arcs.items() if arc.text in needed and (row, True) not in moving]
    for row, (values, _) in _programmed_vias(task, kept).items():
        arc = places.arcs[row]
        for i in range(3):
            if arc.start[i] >= 0:
                users[arc.text][arc.file[i], arc.start[i]] = values[i]
    return users


def _of_one_text(
    task: KrlWritePlan, targets: list[TargetEdit], written: dict[Spot, float], lines: RewrittenLines
) -> list[Edit]:
    """Edits for the targets that take their numbers from one text; ``written``: what its literals must say.

    What wants the same is written once, the first one's in place; the others get points of their own.
    """
    edits: list[Edit] = []
    shared = len(targets) > 1 or bool(written)
    for target in targets:
        moved = target.moved()
        computed = any(target.start[i] < 0 for i in moved)
        why = _why_own(task, target, computed, shared, written)
        if why:
            lines.point(target.row, target.operand, target.variable, target.texts, why, target.via)
            continue
        for i, spot in target.spots():
            if spot not in written:
                written[spot] = target.wanted[i] if i in moved else target.own[i]
                if i in moved:
                    span = Span(spot[0], spot[1], target.stop[i])
                    edits.append(lines.replaced(span, target.texts[i]))
        if target.missing:
            edits.append(completion(task, target.home, target.insert, target.texts, target.missing))
    return edits


def _why_own(
    task: KrlWritePlan, target: TargetEdit, computed: bool, shared: bool, written: dict[Spot, float]
) -> str:
    """Why the target cannot be written in place; "" if it can."""
    shown = "its target"
    if target.variable is not None and target.variable.name:
        shown = f"point {target.variable.name.decode('latin-1')}"
    if target.locked:
        return target.locked
    if computed:
        return f"{shown} is computed"
    if target.missing and (target.home < 0 or shared or task.uses_of(target.home, target.insert) > 1):
        return f"{shown} omits components and is shared by several motions"
    # Half a step and what a double is off by.
    same = all(
        spot not in written or _apart(written[spot], target.wanted[i], i) <= 1.000001 * target.steps[i]
        for i, spot in target.spots()
    )
    return "" if same else f"{shown} is shared by several motions with different corrections"


def _apart(one: float, other: float, component: int) -> float:
    difference = abs(one - other)
    return difference if component < 3 else abs((difference + 180.0) % 360.0 - 180.0)
