"""The motion statements: their target, their path, and whether they can be corrected."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from postproc.base.document import Span
from postproc.languages.krl.assignments import with_clause
from postproc.languages.krl.effects import HERE
from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.external_axes import ALL_LOST, UNSTATED, apart, reached
from postproc.languages.krl.lexing import LONGEST, LOOPS, SPLINES, Statement, identifiers, is_number
from postproc.languages.krl.modal_state import NAN, Anchor, ModalState
from postproc.languages.krl.motion_rows import NAN6, NO_ARC, MotionRow, Refusal, index, path_of, refusal
from postproc.languages.krl.operands import Operand, Parts, operand_at, take_apart
from postproc.languages.krl.partial import anchored, filled, incomplete
from postproc.languages.krl.source_map import Auxiliary, InlineForm, Relative
from postproc.languages.krl.spatial import Arc, Numbers, Vector, arc, rotation, turned
from postproc.languages.krl.target import KrlTarget, UnknownValue, shown, six
from postproc.languages.krl.vectorised import VectorisedLines
from postproc.toolpath import ArcFrame, Kind, OrientationMode

_CIRCLE_ANGLE = re.compile(rb"CA(?![A-Za-z0-9_$])[ \t]*=?[ \t]*", re.I)
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


def move_bulk(run: ExecutionContext, bulk: VectorisedLines) -> None:
    """Takes up a run of common lines."""
    state = run.state
    reason = _structure(run) or _frames_missing(run)
    last = run.rows.add_bulk(bulk, state, reason)
    if (turns := _turns_otherwise(state, Kind.LIN)) is not None:
        for row in (last + 1 - len(bulk) + np.flatnonzero(bulk.is_line)).tolist():
            run.rows.reasons[row] = reason or turns
    if _apart(run):
        run.rows.apart.append((last + 1 - len(bulk.values), last))
    state.point, state.point_frames, state.axes, state.anchor = (
        _bulk_end(state, bulk),
        (state.base, state.tool),
        None,
        None,
    )
    state.sources = frozenset([last])


def _bulk_end(state: ModalState, bulk: VectorisedLines) -> Numbers:
    """Where a run of common lines ends, X..C."""
    x, y, z, a, b, c = bulk.values[-1].tolist()
    if state.orientation != OrientationMode.CONSTANT or not bulk.is_line[-1]:
        return x, y, z, a, b, c
    point = state.point if state.point_frames == (state.base, state.tool) else None
    jumps = np.flatnonzero(~bulk.is_line)
    start = bulk.values[jumps[-1]] if len(jumps) else np.array(point or NAN6)
    same = (bulk.values[jumps[-1] + 1 if len(jumps) else 0 :, 3:] == start[3:]).all()
    return (x, y, z, a, b, c) if same else (x, y, z, NAN, NAN, NAN)


def _reached(state: ModalState, kind: Kind, values: Numbers | None) -> Numbers | None:
    """Where a motion ends, X..C: of one that keeps its orientation the angles are not those of its text, if it starts
    with others, and are then not known in numbers."""
    keeps = state.orientation == OrientationMode.CONSTANT and kind in (Kind.LIN, Kind.CIRC, Kind.SPL)
    if values is None or not keeps:
        return values
    point = state.point if state.point_frames == (state.base, state.tool) else None
    along = kind is Kind.CIRC and state.arc_frame != ArcFrame.BASE
    if point is not None and point[3:] == values[3:] and not along:
        return values
    return (*values[:3], NAN, NAN, NAN)


def unknown_motion(run: ExecutionContext, statement: Statement) -> None:
    """Takes up a statement of a package that holds a motion word, or a motion that is no KRL."""
    run.mentioned |= identifiers(statement.code[:LONGEST])
    motion = _extent(statement, None)
    operand = Operand(UnknownValue("KRL001", ""), motion[1], motion[2])
    reason = Refusal("KRL001", f"'{shown(statement.code)}' is not understood", "package")
    _enter(run, statement, Kind.OTHER, operand, reason, NAN)


def _move(run: ExecutionContext, statement: Statement, parts: Parts, reason: Refusal | None) -> None:
    word, code = statement.word, statement.code
    relative = word.endswith(b"_REL")
    kind = _kind(run, word)
    if not parts.points:
        empty = Operand(UnknownValue("KRL001", "it has no readable target"), *_extent(statement, None)[1:3])
        _enter(run, statement, kind, empty, reason, NAN)
        return
    blend = _blend(run.state, parts)
    first = operand_at(run, code, statement.at, parts.points[0])
    if not relative and first.variable is not None and first.variable.name in HERE and len(parts.points) == 1:
        return
    if parts.not_understood:
        reason = reason or Refusal("KRL001", f"'{shown(parts.not_understood)}' is not understood")
    if kind == Kind.CIRC:
        _arc(run, statement, parts, first, reason, blend)
        return
    if len(parts.points) > 1:
        odd = code[slice(*parts.points[1])]
        reason = reason or Refusal("KRL001", f"'{shown(odd)}' is not understood")
    if relative:
        first, reason = _absolute(run, statement, parts, first, reason)
    if isinstance(first.target, UnknownValue) and first.target.code == "KRL016":
        reason = Refusal("KRL016", first.target.message, "home")
    row = _enter(run, statement, kind, first, reason, blend, relative=relative)
    if relative:
        run.rows.relative[row] = _reference(statement, parts)


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
    return state.blend if set(parts.approximations) == {b"C_DIS"} else NAN


def _extent(statement: Statement, operand: Operand | None) -> tuple[int, int, int, int]:
    """Offsets of the word, of the operand and after it, and after the code."""
    at = statement.at
    stop = at + len(statement.code)
    if operand is None:
        return at, at + len(statement.word), stop, stop
    return at, operand.start, operand.stop, stop


def _reference(statement: Statement, parts: Parts) -> Relative:
    at = statement.at
    word = Span(0, at, at + len(statement.word))
    if parts.reference is None:
        return Relative(word, None, False)
    start, end = parts.reference
    return Relative(word, Span(0, at + start, at + end), statement.code[start:end].upper().endswith(b"TOOL"))


def _absolute(
    run: ExecutionContext, statement: Statement, parts: Parts, operand: Operand, reason: Refusal | None
) -> tuple[Operand, Refusal | None]:
    """A relative target as the absolute one."""
    state, moved = run.state, operand.target
    if parts.reference is not None:
        named = statement.code[slice(*parts.reference)].upper().replace(b" ", b"")
        if named not in (b"#BASE", b"#TOOL"):
            why = Refusal("KRL008", f"it is a relative motion in {shown(named)}")
            return replace(operand, target=UnknownValue("KRL008", "")), reason or why
    if isinstance(moved, UnknownValue):
        return operand, reason
    if moved.axes is not None:
        if state.axes is None:
            why = Refusal(
                "KRL008", f"it is relative to axis angles that are not known: {_axes_lost(state)}", "axes"
            )
            return replace(operand, target=UnknownValue("KRL008", "")), reason or why
        there = [old + (new or 0.0) for old, new in zip(state.axes, moved.axes, strict=True)]
        absolute = KrlTarget((None,) * 6, axes=six(there), external=moved.external)
        return replace(operand, target=absolute), reason
    if any(moved.values[3:]):
        why = Refusal(
            "KRL008", "it is a relative rotation, which is not documented well enough to be followed", "turn"
        )
        return replace(operand, target=UnknownValue("KRL008", "")), reason or why
    if state.point is None or state.point_frames != (state.base, state.tool):
        lost = state.point_unknown
        if state.point is not None:
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is the end of an axis motion"
        why = Refusal(
            "KRL008",
            f"it is a relative motion, and the position before is not known in numbers: {lost}",
            lost,
        )
        return replace(operand, target=UnknownValue("KRL008", "")), reason or why
    by = shift(state.point, moved, _reference(statement, parts).in_tool)
    x, y, z = (old + new for old, new in zip(state.point, by, strict=False))
    return replace(operand, target=replace(moved, values=(x, y, z, *state.point[3:]))), reason


def shift(point: Numbers, moved: KrlTarget, in_tool: bool) -> Vector:
    """A relative translation in the axes of the base."""
    x, y, z = (value or 0.0 for value in moved.values[:3])
    return turned(rotation(*point[3:]), (x, y, z)) if in_tool else (x, y, z)


def _axes_lost(state: ModalState) -> str:
    return state.point_unknown if state.point is None else "the motion before it does not define the axes"


def _arc(
    run: ExecutionContext, statement: Statement, parts: Parts, first: Operand, reason: Refusal | None, blend: float
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
            reason = reason or Refusal("KRL002", f"its angle CA is computed: {why}")
    if len(points) != 1:
        what = (
            "it has no end point" if not points else f"'{shown(code[slice(*points[1])])}' is not understood"
        )
        operand = Operand(UnknownValue("KRL001", what), first.start, first.stop, None, True)
        _enter(run, statement, Kind.CIRC, operand, reason, blend)
        return
    end_point = operand_at(run, code, statement.at, points[0])
    begin_known = state.point if state.point_frames == (state.base, state.tool) else None
    relative = statement.word.endswith(b"_REL")
    if relative:
        end_point, reason = _absolute(run, statement, parts, end_point, reason)
        if isinstance(first.target, KrlTarget) and begin_known is not None:
            by = shift(begin_known, first.target, _reference(statement, parts).in_tool)
            x, y, z = (old + new for old, new in zip(begin_known, by, strict=False))
            first = replace(first, target=replace(first.target, values=(x, y, z, None, None, None)))
    found, unknown = _arc_path(state, begin_known, first.target, end_point.target, angle)
    if found is None and reason is None and isinstance(end_point.target, KrlTarget):
        reason = unknown
    if has_angle and (angle is None or found is None):
        # Where the path ends is not where the end point is.
        found = None
        code_of = reason.code if reason is not None else "KRL009"
        end_point = replace(end_point, target=UnknownValue(code_of, "its path is not known"), builds=True)
    row = _enter(run, statement, Kind.CIRC, end_point, reason, blend, found, relative)
    if row in run.rows.reasons:
        run.rows.builds_on[row] = run.rows.builds_on.get(row, frozenset()) | _before(run, row)
    if isinstance(first.target, KrlTarget):
        t = first.target
        run.rows.arcs[row] = Auxiliary(
            t.start[:3], t.stop[:3], t.file[:3], t.insert, t.home,  # type: ignore[arg-type]
            Span(0, first.start, first.stop), first.variable, -1, t.locked, span if angle is not None else None,
            has_angle,
        )  # fmt: skip
    if relative:
        run.rows.relative[row] = _reference(statement, parts)


def _before(run: ExecutionContext, row: int) -> frozenset[int | bytes]:
    return frozenset([row - 1]) if row else frozenset()


def _arc_path(
    state: ModalState,
    start: Numbers | None,
    auxiliary: KrlTarget | UnknownValue,
    end: KrlTarget | UnknownValue,
    angle: float | None,
) -> tuple[Arc | None, Refusal]:
    """The path of an arc, or why it is not known."""
    if isinstance(auxiliary, UnknownValue):
        code = auxiliary.code if auxiliary.code in ("KRL001", "KRL002", "KRL003") else "KRL009"
        return None, Refusal(
            code, f"its auxiliary point is not known: {auxiliary.message}", auxiliary.message
        )
    if auxiliary.axes is not None:
        return None, Refusal("KRL009", "its auxiliary point is given in axis angles")
    if start is None:
        lost = state.point_unknown
        if state.point_frames is not None and state.point_frames != (state.base, state.tool):
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is the end of an axis motion"
        return None, Refusal(
            "KRL009", f"it is an arc, and its start is not known in numbers: {lost}", f"start {lost}"
        )
    if isinstance(end, UnknownValue) or end.axes is not None:
        return None, Refusal("KRL009", "its end is not known")
    through = [old if new is None else new for new, old in zip(auxiliary.values[:3], start, strict=False)]
    there = [old if new is None else new for new, old in zip(end.values[:3], start, strict=False)]
    found = arc(start[:3], (through[0], through[1], through[2]), (there[0], there[1], there[2]), angle)
    same = "its start, auxiliary point and end do not define a circle"
    return found, Refusal("KRL009", same, "flat")


def _enter(
    run: ExecutionContext, statement: Statement, kind: Kind, operand: Operand, reason: Refusal | None, blend: float,
    way: Arc | None = None, relative: bool = False,
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
            reason = reason or Refusal("KRL001", "a straight line cannot lead to axis angles")
        stated = replace(target.detached(), locked="")
    else:
        values = filled(target.values, state.point)
        if values is None and state.anchor is not None and state.point_frames == (state.base, state.tool):
            values, anchor = anchored(target.values, state.anchor)
        stated = target
    partial = stated is not None and bool(stated.missing) and not relative
    if partial and stated is not None and reason is None and anchor is None:
        reason = incomplete(state, stated, axes if kind is Kind.AXIS else values)
    if partial and values is not None and state.point_frames != (state.base, state.tool):
        values = None
    if values is not None and way is not None:
        values = (*way.end, *values[3:])
    elif kind == Kind.CIRC and reason is None:
        reason = Refusal("KRL009", "its path is not known")
    if reason is None and kind is not Kind.AXIS:
        reason = _frames_missing(run) or _turns_otherwise(state, kind)
    structure = _structure(run)
    if structure is not None and (reason is None or reason.code != "KRL016"):
        reason = structure
    if stated is not None and values is None and anchor is None and stated.axes is None:
        stated = replace(stated.detached(), locked="")
    external = _external(state, target, relative)
    rows = run.rows
    row = rows.add(
        MotionRow(
            kind, statement.line, _extent(statement, operand), values or NAN6, axes or NAN6,
            NAN if kind in (Kind.PTP, Kind.AXIS) else state.feed, index(state.base), index(state.tool), blend,
            stated, _inherits(stated, relative), path_of(way) if values is not None else NO_ARC,
            state.orientation, state.arc_frame, external,
        ),
        anchor,
    )  # fmt: skip
    if reason is not None:
        rows.reasons[row] = reason
    if _apart(run):
        rows.apart.append((row, row))
    if operand.variable is not None and stated is not None:
        rows.variables[row] = operand.variable
        if stated.locked:
            rows.locked[row] = stated.locked
    if kind == Kind.SPL or (run.stack and any(item.block.word in SPLINES for item in run.stack)):
        rows.whole[row] = "it is part of a spline"
        _in_block(run, row)
    elif run.triggered:
        rows.whole[row] = "a TRIGGER before it refers to it"
    elif statement.line in run.survey.inline and not _in_form(run, row):
        rows.whole[row] = "it is an inline form that sets another base or tool"
    run.triggered = False
    if partial or relative or operand.builds:
        rows.builds_on[row] = state.sources
    _advance(state, statement.line, _reached(state, kind, values), axes, reason)
    state.external = external
    if axes is not None:
        anchor = Anchor(row)
    if anchor is not None:
        state.anchor, state.point_frames = anchor, (state.base, state.tool)
    state.sources = frozenset([row])
    return row


def _in_block(run: ExecutionContext, row: int) -> None:
    """Notes that the controller passes a point of a spline block, and before which line its first point is entered."""
    block = next((item for item in reversed(run.stack) if item.block.word in SPLINES), None)
    if block is None:
        return
    run.rows.passing[row] = True
    if block is run.stack[-1] and block.enters and block.rows == row:
        run.rows.entries[row] = block.block.line


def _external(state: ModalState, target: KrlTarget | UnknownValue, relative: bool) -> Numbers:
    """E1..E6 after a motion; at the controller's HOME they are where the program started."""
    if isinstance(target, UnknownValue):
        return UNSTATED if target.code == "KRL016" else ALL_LOST
    values = reached(state.external, target.external, relative)
    return apart(values) if state.external_apart and target.external else values


def _in_form(run: ExecutionContext, row: int) -> bool:
    """Notes the inline form to which a motion belongs; gives whether its base and tool are in force before it."""
    state, form = run.state, run.state.form
    if form is None:
        return False
    run.rows.inline[row] = InlineForm(form.at, form.feed)
    return form.frames == (state.base, state.tool)


def _inherits(stated: KrlTarget | None, relative: bool) -> int:
    if stated is None or stated.axes is not None:
        return 0
    if relative:
        return sum(1 << i for i in range(6) if stated.start[i] < 0)
    return sum(1 << i for i, value in enumerate(stated.values) if value is None)


def _advance(
    state: ModalState, line: int, values: Numbers | None, axes: Numbers | None, reason: Refusal | None
) -> None:
    if values is not None:
        state.point, state.point_frames = values, (state.base, state.tool)
        state.axes = state.anchor = None
    elif axes is not None:
        state.lose_point(f"after the axis motion in line {line}")
        state.axes = axes
    elif reason is None or reason.code != "KRL004" or state.point is not None or state.anchor is not None:
        state.lose_point(f"after the motion in line {line}")


def _frames_missing(run: ExecutionContext) -> Refusal | None:
    state = run.state
    if run.root_set is not None:
        return Refusal("KRL005", f"the robot's place in the world is set in line {run.root_set}", "root")
    if run.later_since is not None:
        what = f"the interrupt or trigger of line {run.later_since} may change base or tool at any time"
        return Refusal("KRL005", what, "later")
    if state.tool_known:
        return Refusal("KRL013", "the tool is fixed in the world ($IPO_MODE=#TCP)", "tcp")
    for frame in (state.base, state.tool):
        if isinstance(frame, UnknownValue):
            return refusal(frame, "", frame.message)
    return None


def _turns_otherwise(state: ModalState, kind: Kind) -> Refusal | None:
    """Why it is not known how the tool turns on a motion, or not in a way that is corrected."""
    if kind not in (Kind.LIN, Kind.CIRC, Kind.SPL):
        return None
    if state.orientation == OrientationMode.UNKNOWN:
        return Refusal(
            "KRL031",
            "the orientation between the points is not known: $ORI_TYPE is none of #VAR, #CONSTANT, #JOINT",
            "ori",
        )
    if state.orientation == OrientationMode.JOINT and kind is not Kind.SPL:
        return Refusal(
            "KRL031", "the wrist axes move linearly, and the tool does not ($ORI_TYPE=#JOINT)", "joint"
        )
    if (
        kind is Kind.CIRC
        and state.orientation == OrientationMode.CONSTANT
        and state.arc_frame == ArcFrame.PATH
    ):
        message = "the tool rotates with the executed arc ($ORI_TYPE=#CONSTANT, $CIRC_TYPE=#PATH)"
        return Refusal("KRL031", message, "path")
    if kind is Kind.CIRC and state.arc_frame == ArcFrame.UNKNOWN:
        return Refusal(
            "KRL031",
            "the orientation on the arc is not known: $CIRC_TYPE or $CIRC_MODE is not understood",
            "circ",
        )
    return None


def _apart(run: ExecutionContext) -> bool:
    """Whether the motion does not follow the one before it: it never runs, or nobody knows when."""
    return run.idle or run.walked


def _structure(run: ExecutionContext) -> Refusal | None:
    """The reason that lies in where the motion is."""
    routine = run.routine
    if run.idle:
        return Refusal("KRL023", "the flow that the program's constants define does not lead here", "never")
    if routine is None:
        if run.survey.has_routine:
            return Refusal("KRL014", "the motion is outside every DEF", "outside")
    elif run.walked:
        return Refusal("KRL015", run.why_walked(routine), f"def {routine.line}")
    for item in run.stack:
        word = item.block.word
        if not item.followed and word not in SPLINES:
            what = "loop" if word in LOOPS else "branch"
            told = word.decode("latin-1")
            return Refusal(
                "KRL006",
                f"it is inside the {what} ({told}) of line {item.block.line}",
                f"in {item.block.line}",
            )
    return None
