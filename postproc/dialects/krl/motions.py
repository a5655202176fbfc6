"""The motion statements: their target, and whether it can be corrected."""

from __future__ import annotations

import re
from dataclasses import dataclass

from postproc.dialects.krl.lexing import LONGEST, LOOPS, NAME, SPLINES, Statement, identifiers, keyed
from postproc.dialects.krl.rows import Reason, refusal
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.state import Anchor, Numbers, Point, State
from postproc.dialects.krl.survey import HERE, READS_POSITION, in_spline
from postproc.dialects.krl.target import Six, Target, Unclear, parse, six
from postproc.toolpath import Kind

_NAMED = re.compile(
    rb"(" + NAME + rb")[ \t]*(?:\[([^\]]*)\])?((?:[ \t]*\.[ \t]*" + NAME + rb"(?:\[[^\]]*\])?)*)"
)
_APPROXIMATION = re.compile(rb"(?:[ \t,]*C_(?:DIS|VEL|ORI|PTP|SPL)\b){0,2}[ \t]*\Z", re.I)
_COMPUTED = re.compile(rb"[ \t]*[:+\-*/(]")
_WITH = re.compile(rb"[ \t]*(?:C_[A-Za-z]+[ \t]*)*WITH\b", re.I)
_CIRCLE_ANGLE = re.compile(rb"[ \t]*,[ \t]*CA\b", re.I)
_RELATIVE = {
    b"PTP_REL": Kind.PTP,
    b"SPTP_REL": Kind.PTP,
    b"LIN_REL": Kind.LIN,
    b"SLIN_REL": Kind.LIN,
    b"CIRC_REL": Kind.CIRC,
    b"SCIRC_REL": Kind.CIRC,
}
_HOME = re.compile(rb"X?HOME[1-5]?\Z")


@dataclass(frozen=True, slots=True)
class Operand:
    """One target as it is written: what it says, the variable that holds it, and what follows it."""

    target: Target | Unclear
    rest: bytes = b""
    name: bytes = b""
    point: Point | None = None
    builds: bool = False  # it is not clear, and may leave components to the point before


def move(run: Run, statement: Statement) -> None:
    """Takes up a motion statement."""
    if len(statement.code) > LONGEST:
        unknown_motion(run, statement)
        return
    word = statement.word
    text = statement.code[len(word) :]
    at = statement.at + len(word)
    operand = _operand(run, text, at)
    plain = word in (b"PTP", b"LIN", b"SPTP", b"SLIN")
    if plain and operand.name in HERE and _APPROXIMATION.match(operand.rest):
        return
    if word.endswith(b"_REL"):
        run.mentioned |= identifiers(text)
        reason = Reason(
            "KRL008", "a relative motion; it and the motion before it are kept as they are", "rel"
        )
        spline = in_spline(item.block for item in run.stack)
        kind = Kind.OTHER if spline else _RELATIVE.get(word, Kind.OTHER)
        _enter(run, statement.line, statement.at, kind, Unclear("KRL008", ""), reason)
        return
    if word in (b"CIRC", b"SCIRC"):
        _arc(run, statement, operand, at + len(text))
        return
    if word == b"SPL" or (in_spline(item.block for item in run.stack) and word != b"PTP"):
        operand = _closed(operand)
        reason = Reason("KRL009", "a spline is not corrected", "spline")
        _enter(run, statement.line, statement.at, Kind.OTHER, operand.target, reason, operand)
        return
    kind = Kind.PTP if word.endswith(b"PTP") else Kind.LIN
    if kind is Kind.PTP and _HOME.match(operand.name) and operand.point is None:
        shown = operand.name.decode("latin-1")
        home = Reason("KRL016", f"{shown} is a point of the controller; the motion stays as it is", "home")
        _enter(run, statement.line, statement.at, Kind.PTP, Unclear("KRL016", ""), home)
        return
    operand = _closed(operand)
    _enter(run, statement.line, statement.at, kind, operand.target, None, operand)


def move_to(run: Run, word: bytes, line: int, at: int, target: Target) -> None:
    """Takes up a PTP or LIN to an inline aggregate that was read already."""
    _enter(run, line, at, Kind.LIN if word in b"LINlin" else Kind.PTP, target, None)


def unknown_motion(run: Run, statement: Statement) -> None:
    """Takes up a statement of a package that holds a motion word."""
    run.mentioned |= identifiers(statement.code)
    shown = statement.code[:40].decode("latin-1")
    _enter(
        run, statement.line, statement.at, Kind.OTHER, Unclear("KRL001", ""),
        Reason("KRL001", f"'{shown}' is not understood", "package"),
    )  # fmt: skip


def _operand(run: Run, text: bytes, at: int) -> Operand:
    """The first target in ``text``, which stands at byte ``at``."""
    stripped = text.lstrip(b" \t")
    at += len(text) - len(stripped)
    if stripped.startswith(b"{"):
        stop = stripped.find(b"}")
        if stop < 0 or b"{" in stripped[1:stop]:
            return Operand(Unclear("KRL001", "its braces do not close"), builds=True)
        rest = stripped[stop + 1 :]
        if _COMPUTED.match(rest):
            run.mentioned |= identifiers(rest)
            return Operand(Unclear("KRL002", "its target is computed"), builds=True)
        target = parse(stripped[: stop + 1], at, 0)
        return Operand(target, rest, builds=isinstance(target, Unclear))
    found = _NAMED.match(stripped)
    if found is None:
        return Operand(Unclear("KRL001", "it has no target that can be read"))
    name, rest = found[1].upper(), stripped[found.end() :]
    shown = found[0].strip().decode("latin-1")
    key = keyed(name, found[2])
    if _COMPUTED.match(rest) or found[3].strip() or key is None:
        run.mentioned |= identifiers(stripped)
        reads = READS_POSITION.search(stripped) is not None
        return Operand(Unclear("KRL002", f"its target {shown} is computed"), rest, builds=reads)
    point = run.state.variables.get(key)
    if point is not None:
        computed = isinstance(point.target, Unclear) and point.target.code != "KRL003"
        return Operand(point.target, rest, key, point, computed)
    if name.startswith(b"$"):
        reads = READS_POSITION.match(name) is not None
        variable = Unclear("KRL002", f"its target {shown} is a variable of the controller")
        return Operand(variable, rest, key, None, reads)
    return Operand(Unclear("KRL003", f"point {shown} is not declared"), rest, key)


def _closed(operand: Operand) -> Operand:
    """The operand if nothing but approximation follows it."""
    if _APPROXIMATION.match(operand.rest):
        return operand
    if isinstance(operand.target, Unclear) and operand.target.code in ("KRL001", "KRL002"):
        return operand
    message = "WITH sets frames or speeds for this motion only"
    if not _WITH.match(operand.rest):
        message = f"'{operand.rest.strip()[:40].decode('latin-1')}' is not understood"
        if operand.name:
            message += "; an inline form without the lines that it unfolds to"
    return Operand(Unclear("KRL001", message), b"", operand.name, operand.point, not operand.name)


def _cause(target: Unclear, operand: Operand | None) -> str:
    """What joins refusals that are to be told together."""
    if target.code == "KRL003" or (target.code == "KRL001" and operand is not None and operand.name):
        return target.code
    return ""


def _arc(run: Run, statement: Statement, auxiliary: Operand, stop: int) -> None:
    reason = Reason("KRL009", "an arc is not corrected", "arc")
    rest = auxiliary.rest.lstrip(b" \t")
    end = Operand(Unclear("KRL009", ""))
    if rest.startswith(b","):
        end = _operand(run, rest[1:], stop - len(rest) + 1)
        if _CIRCLE_ANGLE.match(end.rest):
            # The arc goes on or ends before: the end point only gives the direction.
            end = Operand(Unclear("KRL009", ""), b"", end.name, end.point, True)
        end = _closed(end)
    row = _enter(run, statement.line, statement.at, Kind.CIRC, end.target, reason, end)
    if auxiliary.point is not None:
        auxiliary.point.serve(row)


def _enter(
    run: Run, line: int, at: int, kind: Kind, target: Target | Unclear, reason: Reason | None,
    operand: Operand | None = None,
) -> int:  # fmt: skip
    """Adds the row of a motion and brings the state behind it.  ``reason``: why it is refused in any case."""
    state = run.state
    values: Numbers | None = None
    axes: Numbers | None = None
    anchor: Anchor | None = None
    if isinstance(target, Unclear):
        reason = reason or refusal(target, _subject(target, operand), _cause(target, operand))
    elif target.axes is not None:
        if kind is Kind.PTP:
            kind = Kind.AXIS
            axes = _filled(target.axes, state.axes)
        else:
            reason = reason or Reason("KRL001", "a straight line can not go to axis angles")
    else:
        values = _filled(target.values, state.point)
        if values is None and state.point_frames == (state.base, state.tool):
            values, anchor = _anchored(target.values, state.anchor)
    partial = isinstance(target, Target) and bool(target.missing)
    if partial and isinstance(target, Target) and reason is None and anchor is None:
        reason = _incomplete(state, target, axes if kind is Kind.AXIS else values)
    if partial and values is not None and state.point_frames != (state.base, state.tool):
        values = None
    if reason is None and kind is not Kind.AXIS:
        reason = _frames_missing(run)
    structure = _structure(run)
    if structure is not None and (reason is None or reason.code != "KRL016"):
        reason = structure
    clear = target if isinstance(target, Target) else None
    row = run.rows.add(kind, line, at, state, values, axes, clear, anchor)
    if clear is not None and clear.external:
        run.rows.follow_external(row, clear)
    if reason is not None:
        run.rows.reasons[row] = reason
    relative = isinstance(target, Unclear) and target.code == "KRL008"
    if partial or relative or (operand is not None and operand.builds):
        run.rows.builds_on[row] = state.sources
    if operand is not None and operand.point is not None:
        operand.point.serve(row)
        run.rows.points[row] = (operand.name, operand.point)
    _advance(state, line, values, axes, reason)
    if axes is not None:
        anchor = Anchor(row)
    if anchor is not None:
        state.anchor, state.point_frames = anchor, (state.base, state.tool)
    state.sources = frozenset([row])
    return row


def _subject(target: Unclear, operand: Operand | None) -> str:
    if operand is not None and operand.point is not None and target.code != "KRL001":
        return f"point {operand.name.decode('latin-1')}: "
    return ""


def _advance(
    state: State, line: int, values: Numbers | None, axes: Numbers | None, reason: Reason | None
) -> None:
    if values is not None:
        state.point, state.point_frames, state.axes = values, (state.base, state.tool), None
    elif axes is not None:
        state.lose_point(f"after the axis motion in line {line}")
        state.axes = axes
    elif reason is None or reason.code != "KRL004" or state.anchor is not None:
        state.lose_point(f"after the motion in line {line}")


def _filled(own: Six, before: Numbers | None) -> Numbers | None:
    """The components with the missing ones from the point before; None if that is not known."""
    x, y, z, a, b, c = own
    if (
        x is not None and y is not None and z is not None
        and a is not None and b is not None and c is not None
    ):  # fmt: skip
        return (x, y, z, a, b, c)
    if before is None:
        return None
    u, v, w, d, e, f = (old if new is None else new for new, old in zip(own, before, strict=True))
    return (u, v, w, d, e, f)


def _anchored(own: Six, anchor: Anchor | None) -> tuple[Numbers | None, Anchor | None]:
    """The components with those of ``anchor``: all six, or what is then still left to its axis motion.

    Of A, B, C all three or none must be left: how the controller writes an orientation is its own choice.
    """
    if anchor is None:
        return None, None
    given = six([old if new is None else new for new, old in zip(own, anchor.given, strict=True)])
    full = _filled(given, None)
    if full is not None:
        return full, None
    angles = [value is None for value in given[3:]]
    return None, Anchor(anchor.row, given) if all(angles) or not any(angles) else None


def _incomplete(state: State, target: Target, values: Numbers | None) -> Reason | None:
    names = ", ".join(target.missing)
    if target.axes is None and state.point_frames not in (None, (state.base, state.tool)):
        return Reason("KRL017", f"{names} left out, and base or tool changed since the point before")
    if values is None:
        why = state.point_lost
        if target.axes is not None and not why.startswith("no motion"):
            why = "the motion before it does not give the axes"
        return Reason("KRL004", f"{names} left out, and the position is not known: {why}", why)
    return None


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


def _structure(run: Run) -> Reason | None:
    """The reason that lies in where the motion stands."""
    routine = run.routine
    if routine is None:
        if run.survey.has_routine:
            return Reason("KRL014", "a motion outside of every DEF", "outside")
    elif not routine.is_main:
        return Reason("KRL015", f"a motion of the subprogram in line {routine.line}", f"def {routine.line}")
    for item in run.stack:
        word = item.block.word
        if word != b"DEF" and word not in SPLINES:
            what = "loop" if word in LOOPS else "branch"
            shown = word.decode("latin-1")
            return Reason(
                "KRL006", f"inside of the {what} ({shown}) of line {item.block.line}", f"in {item.block.line}"
            )
    return None
