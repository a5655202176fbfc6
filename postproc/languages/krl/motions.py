"""The motion statements: their target, their path, and whether they can be corrected."""

from __future__ import annotations

import numpy as np

from postproc.languages.core.motion_sources import ELSEWHERE
from postproc.languages.krl.arc_motions import move_on_arc
from postproc.languages.krl.assignments import with_clause
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.lexing import LONGEST, Statement, identifiers
from postproc.languages.krl.modal_state import NAN, NOT_TO_TARGET, ModalState
from postproc.languages.krl.motion_entry import enter_motion, extent
from postproc.languages.krl.motion_refusals import (
    frames_missing,
    orientation_refusal,
    structure_refusal,
)
from postproc.languages.krl.motion_rows import NAN6, RowRefusal
from postproc.languages.krl.operands import Operand, Parts, operand_at, take_apart
from postproc.languages.krl.relative_motions import absolute_target, relative_reference
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.statement_effects import HERE
from postproc.languages.krl.target import UnknownValue, shown
from postproc.languages.krl.vectorised import VectorisedLines
from postproc.toolpath import Kind

_POINTS = (b"PTP", b"SPTP", b"PTP_REL", b"SPTP_REL")

_ARCS = (b"CIRC", b"SCIRC", b"CIRC_REL", b"SCIRC_REL")

_SPLINES = (b"SPL", b"SPL_REL")


def move(run: ExecutionContext, statement: Statement) -> None:
    """Takes up a motion statement."""
    word = statement.word
    if len(statement.code) > LONGEST:
        unknown_motion(run, statement)
        return
    parts = take_apart(statement.code, len(word))
    if not parts.clause:
        _move(run, statement, parts, None)
        return
    outside = run.state
    run.state = outside.copy()
    problem = with_clause(run, statement, parts.clause)
    _move(run, statement, parts, problem)
    state = run.state
    state.base, state.tool, state.feed = outside.base, outside.tool, outside.feed
    state.blend, state.tool_known = outside.blend, outside.tool_known
    state.orientation, state.arc_frame = outside.orientation, outside.arc_frame


def move_bulk(run: ExecutionContext, vectorised: VectorisedLines) -> None:
    """Takes up a run of common lines."""
    state = run.state
    reason = structure_refusal(run) or frames_missing(run)
    run.rows.note_start(state)
    if state.no_insert:
        run.rows.no_insert_before[len(run.rows)] = state.no_insert
        state.no_insert = ""
    last = run.rows.add_vectorised(vectorised, state, reason)
    if (turns := orientation_refusal(state, Kind.LIN)) is not None:
        for row in (last + 1 - len(vectorised) + np.flatnonzero(vectorised.is_line)).tolist():
            run.rows.reasons[row] = reason or turns
    state.point, state.point_frames, state.axes, state.anchor = (
        _bulk_end(state, vectorised),
        (state.base, state.tool),
        None,
        None,
    )
    state.point_line = vectorised.line + len(vectorised) - 1
    state.sources = frozenset([last])
    if state.moved_later:
        for row in range(last + 2 - len(vectorised), last + 1):
            run.rows.sources_of[row] = frozenset([row - 1, ELSEWHERE])
        state.unsettle(run.has_tcp_mode, run.has_turning)


def _bulk_end(state: ModalState, vectorised: VectorisedLines) -> Numbers:
    """Where a run of common lines ends, X..C."""
    x, y, z, a, b, c = vectorised.values[-1].tolist()
    if state.orientation not in NOT_TO_TARGET or not vectorised.is_line[-1]:
        return x, y, z, a, b, c
    point = state.point if state.point_frames == (state.base, state.tool) else None
    jumps = np.flatnonzero(~vectorised.is_line)
    start = vectorised.values[jumps[-1]] if len(jumps) else np.array(point or NAN6)
    same = (vectorised.values[jumps[-1] + 1 if len(jumps) else 0 :, 3:] == start[3:]).all()
    return (x, y, z, a, b, c) if same else (x, y, z, NAN, NAN, NAN)


def unknown_motion(run: ExecutionContext, statement: Statement) -> None:
    """Takes up a statement of a package that holds a motion word, or a motion that is no KRL."""
    run.mentioned |= identifiers(statement.code[:LONGEST])
    motion = extent(statement, None)
    operand = Operand(UnknownValue("KRL001", ""), motion[1], motion[2])
    reason = RowRefusal("KRL001", f"'{shown(statement.code)}' is not understood", "package")
    enter_motion(run, statement, Kind.OTHER, operand, reason, NAN)


def _move(run: ExecutionContext, statement: Statement, parts: Parts, reason: RowRefusal | None) -> None:
    word, code = statement.word, statement.code
    relative = word.endswith(b"_REL")
    kind = _kind(run, word)
    if not parts.points:
        empty = Operand(UnknownValue("KRL001", "it has no readable target"), *extent(statement, None)[1:3])
        enter_motion(run, statement, kind, empty, reason, NAN)
        return
    blend = _blend(run.state, parts)
    first = operand_at(run, code, statement.at, parts.points[0])
    if not relative and first.variable is not None and first.variable.name in HERE and len(parts.points) == 1:
        return
    if parts.not_understood:
        reason = reason or RowRefusal("KRL001", f"'{shown(parts.not_understood)}' is not understood")
    if parts.reference is not None and not relative:
        reference = code[slice(*parts.reference)]
        reason = reason or RowRefusal("KRL001", f"'{shown(reference)}' is not understood")
    if kind == Kind.CIRC:
        move_on_arc(run, statement, parts, first, reason, blend)
        return
    if len(parts.points) > 1:
        odd = code[slice(*parts.points[1])]
        reason = reason or RowRefusal("KRL001", f"'{shown(odd)}' is not understood")
    if relative:
        first, reason = absolute_target(run, statement, parts, first, reason)
    if isinstance(first.target, UnknownValue) and first.target.code == "KRL016":
        reason = RowRefusal("KRL016", first.target.message, "home")
    row = enter_motion(run, statement, kind, first, reason, blend, relative=relative)
    if relative:
        run.rows.relative[row] = relative_reference(statement, parts)


def _kind(run: ExecutionContext, word: bytes) -> Kind:
    if word in _POINTS:
        return Kind.PTP
    if word in _ARCS:
        return Kind.CIRC
    return Kind.SPL if word in _SPLINES else Kind.LIN


def _blend(state: ModalState, parts: Parts) -> float:
    """[mm] that the controller may leave the path before the end point."""
    if not parts.approximations:
        return 0.0
    if state.no_advance or set(parts.approximations) == {b"C_DIS"}:
        return state.steady_blend
    return NAN
