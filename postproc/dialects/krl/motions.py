"""The motion statements: their target, their way, and whether they can be corrected."""

from __future__ import annotations

import re
from dataclasses import replace

from postproc.dialects.krl.assignments import with_clause
from postproc.dialects.krl.bulk import Bulk
from postproc.dialects.krl.effects import HERE
from postproc.dialects.krl.lexing import LONGEST, LOOPS, SPLINES, Statement, identifiers
from postproc.dialects.krl.operands import Operand, Parts, operand_at, take_apart
from postproc.dialects.krl.partial import anchored, filled, incomplete
from postproc.dialects.krl.places import Auxiliary, InlineForm, Relative
from postproc.dialects.krl.rows import NAN6, NO_ARC, Reason, Row, index, refusal, way_of
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.spatial import Arc, Numbers, Vector, arc, rotation, turned
from postproc.dialects.krl.state import NAN, Anchor, State
from postproc.dialects.krl.target import Target, Unclear, shown, six
from postproc.document import Span
from postproc.toolpath import Kind

_CIRCLE_ANGLE = re.compile(rb"CA(?![A-Za-z0-9_$])[ \t]*=?[ \t]*", re.I)
_POINTS = (b"PTP", b"SPTP", b"PTP_REL", b"SPTP_REL")
_ARCS = (b"CIRC", b"SCIRC", b"CIRC_REL", b"SCIRC_REL")
_SPLINES = (b"SPL", b"SPL_REL")


def move(run: Run, statement: Statement) -> None:
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
    state.blend, state.tool_stands = outside.blend, outside.tool_stands


def move_bulk(run: Run, bulk: Bulk) -> None:
    """Takes up a run of common lines."""
    state = run.state
    reason = _structure(run) or _frames_missing(run)
    last = run.rows.add_bulk(bulk, state, reason)
    if _apart(run):
        run.rows.apart.append((last + 1 - len(bulk.values), last))
    x, y, z, a, b, c = bulk.values[-1].tolist()
    state.point, state.point_frames, state.axes, state.anchor = (
        (x, y, z, a, b, c),
        (state.base, state.tool),
        None,
        None,
    )
    state.sources = frozenset([last])


def unknown_motion(run: Run, statement: Statement) -> None:
    """Takes up a statement of a package that holds a motion word, or a motion that is no KRL."""
    run.mentioned |= identifiers(statement.code[:LONGEST])
    motion = _extent(statement, None)
    operand = Operand(Unclear("KRL001", ""), motion[1], motion[2])
    reason = Reason("KRL001", f"'{shown(statement.code)}' is not understood", "package")
    _enter(run, statement, Kind.OTHER, operand, reason, NAN)


def _move(run: Run, statement: Statement, parts: Parts, reason: Reason | None) -> None:
    word, code = statement.word, statement.code
    relative = word.endswith(b"_REL")
    kind = _kind(run, word)
    if not parts.points:
        empty = Operand(
            Unclear("KRL001", "it has no target that can be read"), *_extent(statement, None)[1:3]
        )
        _enter(run, statement, kind, empty, reason, NAN)
        return
    blend = _blend(run.state, parts)
    first = operand_at(run, code, statement.at, parts.points[0])
    if not relative and first.variable is not None and first.variable.name in HERE and len(parts.points) == 1:
        return
    if parts.odd:
        reason = reason or Reason("KRL001", f"'{shown(parts.odd)}' is not understood")
    if kind == Kind.CIRC:
        _arc(run, statement, parts, first, reason, blend)
        return
    if len(parts.points) > 1:
        odd = code[slice(*parts.points[1])]
        reason = reason or Reason("KRL001", f"'{shown(odd)}' is not understood")
    if relative:
        first, reason = _absolute(run, statement, parts, first, reason)
    if isinstance(first.target, Unclear) and first.target.code == "KRL016":
        reason = Reason("KRL016", first.target.message, "home")
    row = _enter(run, statement, kind, first, reason, blend, relative=relative)
    if relative:
        run.rows.relative[row] = _reference(statement, parts)


def _kind(run: Run, word: bytes) -> Kind:
    if word in _POINTS:
        return Kind.PTP
    if word in _ARCS:
        return Kind.CIRC
    return Kind.SPL if word in _SPLINES else Kind.LIN


def _blend(state: State, parts: Parts) -> float:
    """[mm] that the controller may leave the way before the end point."""
    if not parts.slurs:
        return 0.0
    return state.blend if set(parts.slurs) == {b"C_DIS"} else NAN


def _extent(statement: Statement, operand: Operand | None) -> tuple[int, int, int, int]:
    """Offsets of the word, of the operand and behind it, and behind the code."""
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
    begin, end = parts.reference
    return Relative(word, Span(0, at + begin, at + end), statement.code[begin:end].upper().endswith(b"TOOL"))


def _absolute(
    run: Run, statement: Statement, parts: Parts, operand: Operand, reason: Reason | None
) -> tuple[Operand, Reason | None]:
    """A relative target as the absolute one."""
    state, moved = run.state, operand.target
    if parts.reference is not None:
        named = statement.code[slice(*parts.reference)].upper().replace(b" ", b"")
        if named not in (b"#BASE", b"#TOOL"):
            why = Reason("KRL008", f"a relative motion in {shown(named)}")
            return replace(operand, target=Unclear("KRL008", "")), reason or why
    if isinstance(moved, Unclear):
        return operand, reason
    if moved.axes is not None:
        if state.axes is None:
            why = Reason(
                "KRL008", f"a motion relative to axis angles that are not known: {_axes_lost(state)}", "axes"
            )
            return replace(operand, target=Unclear("KRL008", "")), reason or why
        there = [old + (new or 0.0) for old, new in zip(state.axes, moved.axes, strict=True)]
        return replace(operand, target=Target((None,) * 6, axes=six(there))), reason
    if any(moved.values[3:]):
        why = Reason("KRL008", "a relative rotation; it is not documented well enough to be followed", "turn")
        return replace(operand, target=Unclear("KRL008", "")), reason or why
    if state.point is None or state.point_frames != (state.base, state.tool):
        lost = state.point_lost
        if state.point is not None:
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is where an axis motion ends"
        why = Reason(
            "KRL008", f"a relative motion, and the position before is not known in numbers: {lost}", lost
        )
        return replace(operand, target=Unclear("KRL008", "")), reason or why
    by = shift(state.point, moved, _reference(statement, parts).in_tool)
    x, y, z = (old + new for old, new in zip(state.point, by, strict=False))
    return replace(operand, target=replace(moved, values=(x, y, z, *state.point[3:]))), reason


def shift(point: Numbers, moved: Target, in_tool: bool) -> Vector:
    """A relative translation in the axes of the base."""
    x, y, z = (value or 0.0 for value in moved.values[:3])
    return turned(rotation(*point[3:]), (x, y, z)) if in_tool else (x, y, z)


def _axes_lost(state: State) -> str:
    return state.point_lost if state.point is None else "the motion before it does not give the axes"


def _arc(
    run: Run, statement: Statement, parts: Parts, first: Operand, reason: Reason | None, blend: float
) -> None:  # fmt: skip
    code, state = statement.code, run.state
    points, angle, span = list(parts.points[1:]), None, None
    has_angle = bool(points) and _CIRCLE_ANGLE.match(code[slice(*points[-1])]) is not None
    if has_angle:
        begin, end = points.pop()
        head = _CIRCLE_ANGLE.match(code[begin:end])
        assert head is not None
        text = code[begin + head.end() : end]
        value = run.value(text)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            angle = float(value)
            span = Span(0, statement.at + begin + head.end(), statement.at + end)
            run.mentioned |= identifiers(text)
        else:
            why = value.message if isinstance(value, Unclear) else "it is no number"
            reason = reason or Reason("KRL002", f"its angle CA is computed: {why}")
    if len(points) != 1:
        what = (
            "it has no end point" if not points else f"'{shown(code[slice(*points[1])])}' is not understood"
        )
        operand = Operand(Unclear("KRL001", what), first.start, first.stop, None, True)
        _enter(run, statement, Kind.CIRC, operand, reason, blend)
        return
    end_point = operand_at(run, code, statement.at, points[0])
    begin_known = state.point if state.point_frames == (state.base, state.tool) else None
    relative = statement.word.endswith(b"_REL")
    if relative:
        end_point, reason = _absolute(run, statement, parts, end_point, reason)
        if isinstance(first.target, Target) and begin_known is not None:
            by = shift(begin_known, first.target, _reference(statement, parts).in_tool)
            x, y, z = (old + new for old, new in zip(begin_known, by, strict=False))
            first = replace(first, target=replace(first.target, values=(x, y, z, None, None, None)))
    found, unknown = _way(state, begin_known, first.target, end_point.target, angle)
    if found is None and reason is None and isinstance(end_point.target, Target):
        reason = unknown
    if has_angle and (angle is None or found is None):
        # Where the path ends is not where the end point is.
        found = None
        code_of = reason.code if reason is not None else "KRL009"
        end_point = replace(end_point, target=Unclear(code_of, "its way is not known"), builds=True)
    row = _enter(run, statement, Kind.CIRC, end_point, reason, blend, found, relative)
    if row in run.rows.reasons:
        run.rows.builds_on[row] = run.rows.builds_on.get(row, frozenset()) | _before(run, row)
    if isinstance(first.target, Target):
        t = first.target
        run.rows.arcs[row] = Auxiliary(
            t.start[:3], t.stop[:3], t.file[:3], t.insert, t.home,  # type: ignore[arg-type]
            Span(0, first.start, first.stop), first.variable, -1, t.locked, span if angle is not None else None,
            has_angle,
        )  # fmt: skip
    if relative:
        run.rows.relative[row] = _reference(statement, parts)


def _before(run: Run, row: int) -> frozenset[int | bytes]:
    return frozenset([row - 1]) if row else frozenset()


def _way(
    state: State,
    begin: Numbers | None,
    auxiliary: Target | Unclear,
    end: Target | Unclear,
    angle: float | None,
) -> tuple[Arc | None, Reason]:
    """The way of an arc, or why it is not known."""
    if isinstance(auxiliary, Unclear):
        code = auxiliary.code if auxiliary.code in ("KRL001", "KRL002", "KRL003") else "KRL009"
        return None, Reason(code, f"its auxiliary point is not known: {auxiliary.message}", auxiliary.message)
    if auxiliary.axes is not None:
        return None, Reason("KRL009", "its auxiliary point is given in axis angles")
    if begin is None:
        lost = state.point_lost
        if state.point_frames is not None and state.point_frames != (state.base, state.tool):
            lost = "base or tool changed since the point before"
        elif state.anchor is not None:
            lost = "it is where an axis motion ends"
        return None, Reason(
            "KRL009", f"an arc, and its begin is not known in numbers: {lost}", f"begin {lost}"
        )
    if isinstance(end, Unclear) or end.axes is not None:
        return None, Reason("KRL009", "its end is not known")
    through = [old if new is None else new for new, old in zip(auxiliary.values[:3], begin, strict=False)]
    there = [old if new is None else new for new, old in zip(end.values[:3], begin, strict=False)]
    found = arc(begin[:3], (through[0], through[1], through[2]), (there[0], there[1], there[2]), angle)
    same = "an arc whose begin, auxiliary point and end do not define a circle"
    return found, Reason("KRL009", same, "flat")


def _enter(
    run: Run, statement: Statement, kind: Kind, operand: Operand, reason: Reason | None, blend: float,
    way: Arc | None = None, relative: bool = False,
) -> int:  # fmt: skip
    """Adds the row of a motion and brings the state behind it.  ``reason``: why it is refused in any case."""
    state, target = run.state, operand.target
    values: Numbers | None = None
    axes: Numbers | None = None
    anchor: Anchor | None = None
    stated: Target | None = None
    if isinstance(target, Unclear):
        cause = target.code if target.code in ("KRL001", "KRL003") and operand.variable is not None else ""
        reason = reason or refusal(target, "", cause)
    elif target.axes is not None:
        if kind is Kind.PTP:
            kind = Kind.AXIS
            axes = filled(target.axes, state.axes)
        else:
            reason = reason or Reason("KRL001", "a straight line can not go to axis angles")
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
        reason = Reason("KRL009", "its way is not known")
    if reason is None and kind is not Kind.AXIS:
        reason = _frames_missing(run)
    structure = _structure(run)
    if structure is not None and (reason is None or reason.code != "KRL016"):
        reason = structure
    if stated is not None and values is None and anchor is None and stated.axes is None:
        stated = replace(stated.detached(), locked="")
    rows = run.rows
    row = rows.add(
        Row(
            kind, statement.line, _extent(statement, operand), values or NAN6, axes or NAN6,
            NAN if kind in (Kind.PTP, Kind.AXIS) else state.feed, index(state.base), index(state.tool), blend,
            stated, _inherits(stated, relative), way_of(way) if values is not None else NO_ARC,
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
    elif run.triggered:
        rows.whole[row] = "a TRIGGER before it counts from it"
    elif statement.line in run.survey.inline and not _in_form(run, row):
        rows.whole[row] = "it is an inline form that sets another base or tool"
    run.triggered = False
    if partial or relative or operand.builds:
        rows.builds_on[row] = state.sources
    _advance(state, statement.line, values, axes, reason)
    if axes is not None:
        anchor = Anchor(row)
    if anchor is not None:
        state.anchor, state.point_frames = anchor, (state.base, state.tool)
    state.sources = frozenset([row])
    return row


def _in_form(run: Run, row: int) -> bool:
    """Notes the inline form to which a motion belongs; gives whether its base and tool are in force before it."""
    state, form = run.state, run.state.form
    if form is None:
        return False
    run.rows.inline[row] = InlineForm(form.at, form.feed)
    return form.frames == (state.base, state.tool)


def _inherits(stated: Target | None, relative: bool) -> int:
    if stated is None or stated.axes is not None:
        return 0
    if relative:
        return sum(1 << i for i in range(6) if stated.start[i] < 0)
    return sum(1 << i for i, value in enumerate(stated.values) if value is None)


def _advance(
    state: State, line: int, values: Numbers | None, axes: Numbers | None, reason: Reason | None
) -> None:
    if values is not None:
        state.point, state.point_frames = values, (state.base, state.tool)
        state.axes = state.anchor = None
    elif axes is not None:
        state.lose_point(f"after the axis motion in line {line}")
        state.axes = axes
    elif reason is None or reason.code != "KRL004" or state.anchor is not None:
        state.lose_point(f"after the motion in line {line}")


def _frames_missing(run: Run) -> Reason | None:
    state = run.state
    if run.root_set is not None:
        return Reason("KRL005", f"the robot's own place in the world is set in line {run.root_set}", "root")
    if state.tool_stands:
        return Reason("KRL013", "the tool stands in the world ($IPO_MODE=#TCP)", "tcp")
    for frame in (state.base, state.tool):
        if isinstance(frame, Unclear):
            return refusal(frame, "", frame.message)
    return None


def _apart(run: Run) -> bool:
    """Whether the motion does not follow the one before it: it never runs, or nobody knows when."""
    return run.idle or run.walked


def _structure(run: Run) -> Reason | None:
    """The reason that lies in where the motion stands."""
    routine = run.routine
    if run.idle:
        return Reason("KRL023", "the flow that this program's constants give does not lead here", "never")
    if routine is None:
        if run.survey.has_routine:
            return Reason("KRL014", "a motion outside of every DEF", "outside")
    elif run.walked:
        return Reason("KRL015", run.why_walked(routine), f"def {routine.line}")
    for item in run.stack:
        word = item.block.word
        if not item.followed and word not in SPLINES:
            what = "loop" if word in LOOPS else "branch"
            told = word.decode("latin-1")
            return Reason(
                "KRL006", f"inside of the {what} ({told}) of line {item.block.line}", f"in {item.block.line}"
            )
    return None
