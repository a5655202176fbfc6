"""A motion as a row of the table, and the modal state after it."""

from __future__ import annotations

from functools import lru_cache

from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.external_axes import ALL_LOST, UNSTATED, apart, reached
from postproc.languages.krl.lexing import Statement
from postproc.languages.krl.modal_state import NAN, NOT_TO_TARGET, Anchor, ModalState
from postproc.languages.krl.motion_refusals import (
    frames_missing,
    orientation_refusal,
    structure_refusal,
)
from postproc.languages.krl.motion_rows import NAN6, NO_ARC, MotionRow, RowRefusal, index, path_of, refusal
from postproc.languages.krl.operands import Operand
from postproc.languages.krl.partial import anchored, filled, incomplete, varying
from postproc.languages.krl.spatial import Arc, Numbers
from postproc.languages.krl.target import KrlTarget, UnknownValue
from postproc.toolpath import ArcFrame, Kind


def _reached(state: ModalState, kind: Kind, values: Numbers | None) -> Numbers | None:
    """Where a motion ends, X..C: of one that keeps its orientation the angles are not those of its text, if it starts
    with others, and are then not known in numbers."""
    keeps = state.orientation in NOT_TO_TARGET and kind in (Kind.LIN, Kind.CIRC, Kind.SPL)
    if values is None or not keeps:
        return values
    point = state.point if state.point_frames == (state.base, state.tool) else None
    along = kind is Kind.CIRC and state.arc_frame != ArcFrame.BASE
    if point is not None and point[3:] == values[3:] and not along:
        return values
    return (*values[:3], NAN, NAN, NAN)


def _turns_unknown(state: ModalState, kind: Kind, anchor: Anchor) -> bool:
    """Whether a motion does not end with the angles that its text states."""
    keeps = state.orientation in NOT_TO_TARGET and kind in (Kind.LIN, Kind.CIRC, Kind.SPL)
    return keeps and any(angle is not None for angle in anchor.partial_target[3:])


def extent(statement: Statement, operand: Operand | None) -> tuple[int, int, int, int]:
    """Offsets of the word, of the operand and after it, and after the code."""
    at = statement.at
    stop = at + len(statement.code)
    if operand is None:
        return at, at + len(statement.word), stop, stop
    return at, operand.start, operand.stop, stop


def _frames(state: ModalState, kind: Kind) -> tuple[int, int]:
    """Indices of base and tool; of an axis motion, which no finding refuses, where nothing changes them meanwhile."""
    if kind is Kind.AXIS and state.later_since:
        return -1, -1
    return index(state.base), index(state.tool)


def enter_motion(
    run: ExecutionContext, statement: Statement, kind: Kind, operand: Operand, reason: RowRefusal | None, blend: float,
    arc: Arc | None = None, relative: bool = False,
) -> int:  # fmt: skip
    """Adds the row of a motion and brings the state after it.  ``reason``: why it is refused in any case."""
    state, target = run.state, operand.target
    values: Numbers | None = None
    axes: Numbers | None = None
    anchor: Anchor | None = None
    stated: KrlTarget | None = None
    if isinstance(target, UnknownValue):
        cause = target.code if target.code in ("KRL001", "KRL003") and operand.variable is not None else ""
        reason = reason or refusal(target, "", cause)
    elif target.axes is not None:
        if kind is Kind.PTP:
            kind = Kind.AXIS
            axes = filled(target.axes, state.axes)
        else:
            reason = reason or RowRefusal("KRL001", "a straight line cannot lead to axis angles")
        stated = target.detached()
    else:
        values = filled(target.values, state.point)
        if values is None and state.anchor is not None and state.point_frames == (state.base, state.tool):
            values, anchor = anchored(target.values, state.anchor)
        stated = target
    partial = stated is not None and not relative and None in (stated.axes or stated.values)
    if partial and stated is not None and reason is None and anchor is None:
        reason = incomplete(state, stated, axes if kind is Kind.AXIS else values)
        if reason is None and kind is not Kind.AXIS and values is not None:
            reason = varying(state, stated, values)
    if partial and values is not None and state.point_frames != (state.base, state.tool):
        values = None
    if values is not None and arc is not None:
        values = (*arc.end, *values[3:])
    elif kind == Kind.CIRC and reason is None:
        reason = RowRefusal("KRL009", "its path is not known")
    if reason is None and kind is not Kind.AXIS:
        reason = frames_missing(run) or orientation_refusal(state, kind)
    structure = structure_refusal(run)
    if structure is not None and (reason is None or reason.code != "KRL016"):
        reason = structure
    if stated is not None and values is None and anchor is None and stated.axes is None:
        stated = stated.detached()
    external = _external(state, target, relative)
    rows = run.rows
    rows.note_start(state)
    row = rows.add(
        MotionRow(
            kind, statement.line, extent(statement, operand), values or NAN6, axes or NAN6,
            NAN if kind in (Kind.PTP, Kind.AXIS) else state.steady_feed, *_frames(state, kind), blend,
            stated, _inherits(stated, relative), path_of(arc) if values is not None else NO_ARC,
            state.orientation, state.arc_frame, external, state.steady_blend,
        ),
        anchor,
    )  # fmt: skip
    if reason is not None:
        rows.reasons[row] = reason
    if operand.variable is not None and stated is not None:
        rows.variables[row] = operand.variable
        if stated.locked:
            rows.locked[row] = stated.locked
    if kind == Kind.SPL or run.spline is not None:
        rows.no_insert_before[row] = "it is part of a spline"
        _in_block(run, row)
    elif state.no_insert:
        rows.no_insert_before[row] = state.no_insert
    elif statement.line in run.structure.inline and not _in_form(run):
        rows.no_insert_before[row] = "it is an inline form that sets another base or tool"
    state.no_insert = ""
    if partial or relative or operand.builds:
        rows.builds_on[row] = state.sources
    _advance(state, statement.line, _reached(state, kind, values), axes, reason)
    state.external = external
    if axes is not None:
        anchor = Anchor(row)
    if anchor is not None and not _turns_unknown(state, kind, anchor):
        state.anchor, state.point_frames = anchor, (state.base, state.tool)
    state.sources = frozenset([row])
    state.unsettle(run.has_tcp_mode, run.has_turning)
    return row


def _in_block(run: ExecutionContext, row: int) -> None:
    """Notes that the controller passes a point of a spline block, and before which line its first point is entered."""
    if run.spline is None:
        return
    run.rows.passing[row] = True
    if run.spline.can_be_entered and run.spline.first_row == row:
        run.rows.entries[row] = run.spline.line


def _external(state: ModalState, target: KrlTarget | UnknownValue, relative: bool) -> Numbers:
    """E1..E6 after a motion; at the controller's HOME they are where the program started."""
    if isinstance(target, UnknownValue):
        return UNSTATED if target.code == "KRL016" else ALL_LOST
    values = reached(state.external, target.external, relative)
    return apart(values) if state.external_apart and target.external else values


def _in_form(run: ExecutionContext) -> bool:
    """Whether base and tool of a motion in an inline form are in force before that."""
    state, form = run.state, run.state.form
    return form is not None and form.frames == (state.base, state.tool)


def _inherits(stated: KrlTarget | None, relative: bool) -> int:
    if stated is None or stated.axes is not None:
        return 0
    if relative:
        return sum([1 << i for i in range(6) if stated.start[i] < 0])
    if None not in stated.values:
        return 0
    return _bits(*[value is None for value in stated.values])


@lru_cache(maxsize=1024)
def _bits(*left_out: bool) -> int:
    return sum([1 << i for i, omitted in enumerate(left_out) if omitted])


def _advance(
    state: ModalState, line: int, values: Numbers | None, axes: Numbers | None, reason: RowRefusal | None
) -> None:
    if values is not None:
        state.point, state.point_frames = values, (state.base, state.tool)
        state.point_line = line
        state.axes = state.anchor = None
    elif axes is not None:
        state.lose_point(f"after the axis motion in line {line}")
        state.axes = axes
    elif reason is None or reason.code != "KRL004" or state.point is not None or state.anchor is not None:
        state.lose_point(f"after the motion in line {line}")
