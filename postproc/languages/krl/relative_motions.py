"""Relative motions: their target as the absolute one."""

from __future__ import annotations

from postproc.base.document import Span
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.lexing import Statement
from postproc.languages.krl.modal_state import ModalState
from postproc.languages.krl.motion_rows import RowRefusal
from postproc.languages.krl.operands import Operand, Parts
from postproc.languages.krl.source_map import Relative
from postproc.languages.krl.spatial import Numbers, Vector, rotation, turned
from postproc.languages.krl.target import KrlTarget, UnknownValue, shown, six


def relative_reference(statement: Statement, parts: Parts) -> Relative:
    at = statement.at
    word = Span(0, at, at + len(statement.word))
    if parts.reference is None:
        return Relative(word, None, False)
    start, end = parts.reference
    return Relative(word, Span(0, at + start, at + end), statement.code[start:end].upper().endswith(b"TOOL"))


def absolute_target(
    run: ExecutionContext, statement: Statement, parts: Parts, operand: Operand, reason: RowRefusal | None
) -> tuple[Operand, RowRefusal | None]:
    """A relative target as the absolute one."""
    state, moved = run.state, operand.target
    if parts.reference is not None:
        named = statement.code[slice(*parts.reference)].upper().replace(b" ", b"")
        if named not in (b"#BASE", b"#TOOL"):
            why = RowRefusal("KRL008", f"it is a relative motion in {shown(named)}")
            return operand._replace(target=UnknownValue("KRL008", "")), reason or why
    if isinstance(moved, UnknownValue):
        return operand, reason
    if moved.axes is not None:
        if state.axes is None:
            why = RowRefusal(
                "KRL008", f"it is relative to axis angles that are not known: {_axes_lost(state)}", "axes"
            )
            return operand._replace(target=UnknownValue("KRL008", "")), reason or why
        there = [old + (new or 0.0) for old, new in zip(state.axes, moved.axes, strict=True)]
        absolute = KrlTarget((None,) * 6, axes=six(there), external=moved.external)
        return operand._replace(target=absolute), reason
    if any(moved.values[3:]):
        why = RowRefusal(
            "KRL008", "it is a relative rotation, which is not documented well enough to be followed", "turn"
        )
        return operand._replace(target=UnknownValue("KRL008", "")), reason or why
    varies = state.point is not None and any(value != value for value in state.point[:3])
    if varies or state.point is None or state.point_frames != (state.base, state.tool):
        lost = state.point_unknown
        if state.point is not None and not varies:
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is the end of an axis motion"
        why = RowRefusal(
            "KRL008",
            f"it is a relative motion, and the position before is not known in numbers: {lost}",
            lost,
        )
        return operand._replace(target=UnknownValue("KRL008", "")), reason or why
    by = shift(state.point, moved, relative_reference(statement, parts).in_tool)
    x, y, z = (old + new for old, new in zip(state.point, by, strict=False))
    return operand._replace(target=moved._replace(values=(x, y, z, *state.point[3:]))), reason


def shift(point: Numbers, moved: KrlTarget, in_tool: bool) -> Vector:
    """A relative translation in the axes of the base."""
    x, y, z = (value or 0.0 for value in moved.values[:3])
    return turned(rotation(*point[3:]), (x, y, z)) if in_tool else (x, y, z)


def _axes_lost(state: ModalState) -> str:
    return state.point_unknown if state.point is None else "the motion before it does not define the axes"
