"""Circular motions: auxiliary point, end point, angle, and the arc through them."""

from __future__ import annotations

import re

from postproc.base.document import Span
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.lexing import Statement, identifiers, is_number
from postproc.languages.krl.modal_state import ModalState
from postproc.languages.krl.motion_entry import enter_motion
from postproc.languages.krl.motion_rows import RowRefusal
from postproc.languages.krl.operands import Operand, Parts, operand_at
from postproc.languages.krl.relative_motions import absolute_target, relative_reference, shift
from postproc.languages.krl.source_map import Auxiliary
from postproc.languages.krl.spatial import Arc, Numbers, arc
from postproc.languages.krl.target import KrlTarget, UnknownValue, shown
from postproc.toolpath import Kind

_CIRCLE_ANGLE = re.compile(rb"CA(?![A-Za-z0-9_$])[ \t]*=?[ \t]*", re.I)


def move_on_arc(
    run: ExecutionContext, statement: Statement, parts: Parts, first: Operand, reason: RowRefusal | None, blend: float
) -> None:  # fmt: skip
    code, state = statement.code, run.state
    points, angle, span = list(parts.points[1:]), None, None
    has_angle = bool(points) and _CIRCLE_ANGLE.match(code[slice(*points[-1])]) is not None
    if has_angle:
        start, end = points.pop()
        head = _CIRCLE_ANGLE.match(code[start:end])
        assert head is not None
        text = code[start + head.end() : end]
        value = run.value(text)
        if is_number(value):
            angle = float(value)
            span = Span(0, statement.at + start + head.end(), statement.at + end)
            run.mentioned |= identifiers(text)
        else:
            why = value.message if isinstance(value, UnknownValue) else "it is not a number"
            reason = reason or RowRefusal("KRL002", f"its angle CA is computed: {why}")
    if len(points) != 1:
        what = (
            "it has no end point" if not points else f"'{shown(code[slice(*points[1])])}' is not understood"
        )
        operand = Operand(UnknownValue("KRL001", what), first.start, first.stop, None, True)
        enter_motion(run, statement, Kind.CIRC, operand, reason, blend)
        return
    end_point = operand_at(run, code, statement.at, points[0])
    start_known = state.point if state.point_frames == (state.base, state.tool) else None
    relative = statement.word.endswith(b"_REL")
    if relative:
        end_point, reason = absolute_target(run, statement, parts, end_point, reason)
        if isinstance(first.target, KrlTarget) and start_known is not None:
            by = shift(start_known, first.target, relative_reference(statement, parts).in_tool)
            x, y, z = (old + new for old, new in zip(start_known, by, strict=False))
            first = first._replace(target=first.target._replace(values=(x, y, z, None, None, None)))
    found, unknown = _arc_path(state, start_known, first.target, end_point.target, angle)
    if found is None and reason is None and isinstance(end_point.target, KrlTarget):
        reason = unknown
    if has_angle and (angle is None or found is None):
        # Where the path ends is not where the end point is.
        found = None
        code_of = reason.code if reason is not None else "KRL009"
        end_point = end_point._replace(target=UnknownValue(code_of, "its path is not known"), builds=True)
    before = state.sources
    row = enter_motion(run, statement, Kind.CIRC, end_point, reason, blend, found, relative)
    if row in run.rows.reasons:
        run.rows.builds_on[row] = before
    if isinstance(first.target, KrlTarget):
        t = first.target
        run.rows.arcs[row] = Auxiliary(
            t.start[:3], t.stop[:3], t.file[:3], t.insert, t.home,  # type: ignore[arg-type]
            Span(0, first.start, first.stop), first.variable, -1, t.locked, span if angle is not None else None,
            has_angle,
        )  # fmt: skip
    if relative:
        run.rows.relative[row] = relative_reference(statement, parts)


def _arc_path(
    state: ModalState,
    start: Numbers | None,
    auxiliary: KrlTarget | UnknownValue,
    end: KrlTarget | UnknownValue,
    angle: float | None,
) -> tuple[Arc | None, RowRefusal]:
    """The path of an arc, or why it is not known."""
    if isinstance(auxiliary, UnknownValue):
        code = auxiliary.code if auxiliary.code in ("KRL001", "KRL002", "KRL003") else "KRL009"
        return None, RowRefusal(
            code, f"its auxiliary point is not known: {auxiliary.message}", auxiliary.message
        )
    if auxiliary.axes is not None:
        return None, RowRefusal("KRL009", "its auxiliary point is given in axis angles")
    if start is None:
        lost = state.point_unknown
        if state.point_frames is not None and state.point_frames != (state.base, state.tool):
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is the end of an axis motion"
        return None, RowRefusal(
            "KRL009", f"it is an arc, and its start is not known in numbers: {lost}", f"start {lost}"
        )
    if isinstance(end, UnknownValue) or end.axes is not None:
        return None, RowRefusal("KRL009", "its end is not known")
    through = [old if new is None else new for new, old in zip(auxiliary.values[:3], start, strict=False)]
    there = [old if new is None else new for new, old in zip(end.values[:3], start, strict=False)]
    found = arc(start[:3], (through[0], through[1], through[2]), (there[0], there[1], there[2]), angle)
    same = "its start, auxiliary point and end do not define a circle"
    return found, RowRefusal("KRL009", same, "flat")
