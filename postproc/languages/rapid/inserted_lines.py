"""Lines of motions that are inserted: parts of the path of a motion, and straight transition moves to its start."""

from __future__ import annotations

from codecs import BOM_UTF8

import numpy as np

from postproc.base.decimals import fixed_one
from postproc.base.document import Edit, Span
from postproc.languages.core.plan_rows import PlannedNumbers, blocks
from postproc.languages.dialect import Role
from postproc.languages.rapid.data_types import FLY_BY
from postproc.languages.rapid.plan_writer import PlanWriter, aggregate
from postproc.languages.rapid.target_places import MotionText, PointText, in_one_line
from postproc.toolpath import Kind


def insertions(task: PlanWriter) -> tuple[list[Edit], dict[int, str]]:
    """The edits that insert motions, and the rows before which one cannot be written, with the reason.

    Raises ValueError where a row has no target: a defect of the caller.
    """
    chosen = np.flatnonzero(task.plan.role != Role.ORIGINAL)
    edits: list[Edit] = []
    unfit: dict[int, str] = {}
    document = task.program.documents[0]
    for motions in blocks(chosen):
        rows = task.plan.source[motions]
        said = task.places.numbers(rows)
        wanted, vias = task.wanted(said, rows, motions), task.middles(motions)
        external = None if task.plan.external is None else task.plan.external[motions]
        for k, (motion, row) in enumerate(zip(motions.tolist(), rows.tolist(), strict=True)):
            text = task.text(row)
            point = text.target
            if point is None:
                raise ValueError(f"row {row} has no target")
            numbers = PlannedNumbers(said[k].tolist(), wanted[k].tolist(), task.decimals(point, 7))
            words = point.words
            if external is not None:
                words = _external(task, words, external[k].tolist(), task.path.external[row].tolist())
            if not words:
                unfit[row] = "the external axes of an inserted motion are not known in numbers"
                continue
            target = aggregate(task.spelt(point, numbers), words)
            if task.plan.role[motion] == Role.INTERMEDIATE and task.path.kind[row] == Kind.CIRC:
                why = task.unfit_arc(motion)
                if why:
                    unfit[row] = why
                target = _via(task, point, vias[k].tolist(), said[k, 3:].tolist(), words) + b"," + target
            line = document.line_starts[task.path.line[row] - 1]
            start = len(BOM_UTF8) if line == 0 and task.raw.startswith(BOM_UTF8) else int(line)
            edits.append(Edit(Span(0, start, start), _line(task, motion, row, text, target, start)))
    return edits, unfit


def _line(task: PlanWriter, motion: int, row: int, text: MotionText, target: bytes, start: int) -> bytes:
    """The line of a motion with speed, tool and work object of its source; its zone, where it does not stop there."""
    if task.plan.role[motion] == Role.TRANSITION:
        word = b"MoveL"
    else:
        word = {Kind.LIN: b"MoveL", Kind.CIRC: b"MoveC"}.get(Kind(task.path.kind[row]), b"MoveJ")
    passing = FLY_BY if task.path.stops[row] else text.zone
    zone = passing if task.plan.flows[motion] else b"fine"
    parts = [target, *map(in_one_line, (text.speed, zone, text.tool))]
    indent = task.raw[start : text.start]
    return indent + word + b" " + b",".join(parts) + b";" + task.program.documents[0].newline


def _via(task: PlanWriter, point: PointText, via: list[float], turn: list[float], words: bytes) -> bytes:
    """The auxiliary point of an arc, with the orientation of its source's target, which counts for nothing."""
    place = [fixed_one(value, count) for value, count in zip(via, task.decimals(point, 3), strict=True)]
    orientation = [fixed_one(value, count) for value, count in zip(turn, task.least[3:], strict=True)]
    return aggregate([*place, *orientation], words)


def _external(task: PlanWriter, words: bytes, now: list[float], end: list[float]) -> bytes:
    """Configuration and external axes, these at ``now`` (6) [mm or deg] instead of ``end`` (6); b"" where unknown."""
    if all(a == b or (a != a and b != b) for a, b in zip(now, end, strict=True)):
        return words
    if not words or not np.isfinite([value for value in now if value == value]).all():
        return b""
    values = [b"9E9" if value != value else fixed_one(value, task.least[0]) for value in now]
    if not words.startswith(b"["):
        return b""
    return words[: words.index(b"]") + 1] + b",[" + b",".join(values) + b"]"
