"""Assignments and calls of BAS: base, tool, feed, motion records and point variables."""

from __future__ import annotations

import re
from dataclasses import replace

from postproc.dialects.krl.lexing import (
    POINT_TYPES,
    Assignment,
    Declared,
    Statement,
    identifiers,
    keyed,
    number,
)
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.state import ZERO, Frame, Numbers, Point
from postproc.dialects.krl.survey import READS_POSITION, bas
from postproc.dialects.krl.target import AXES, COMPONENTS, EXTERNAL, NOWHERE, Target, Unclear, fields, parse

NAN = float("nan")
_DATA = re.compile(rb"(BASE|TOOL)_DATA[ \t]*\[([^\]]*)\][ \t]*\Z", re.I)
_NAMED = re.compile(rb"([A-Za-z_$][A-Za-z0-9_$]*)[ \t]*(?:\[([^\]]*)\])?[ \t]*\Z")
_EXTERNAL = re.compile(rb"\bE[BK][ \t]*\(", re.I)


def assign(run: Run, statement: Statement, said: Assignment) -> None:
    """Takes up ``name[index].path = value``."""
    state = run.state
    if READS_POSITION.search(said.value):
        run.rows.reads.append((statement.line, state.sources))
    if said.element is not None:
        run.mentioned |= identifiers(said.element)
    name = said.name
    if name in (b"$BASE", b"$TOOL"):
        _set_frame(run, statement, name, _assigned_frame(run, name, said, statement.line))
    elif name == b"$VEL":
        if said.path in (b"", b"CP"):
            text = said.value if said.path else fields(said.value).get(b"CP", b"")
            speed = number(text.strip())
            # An aggregate without CP leaves it as it was.
            if said.path or text:
                state.feed = NAN if speed is None else speed
    elif name == b"$IPO_MODE":
        state.tool_stands = not said.value.strip().upper().endswith(b"#BASE")
    elif name in (b"BASE_DATA", b"TOOL_DATA"):
        _set_data(run, said)
    elif name in (b"$ROBROOT", b"$WORLD"):
        run.root_set = run.root_set or statement.line
        run.mentioned |= identifiers(said.value)
    elif name == b"FDAT_ACT":
        state.frames_record = _record(run, said, state.frames_record)
    elif name == b"LDAT_ACT":
        state.path_record = _record(run, said, state.path_record)
    elif name.startswith(b"$"):
        # $H_POS=XHOME belongs to the inline form of the motion to XHOME.
        if name != b"$H_POS":
            run.mentioned |= identifiers(said.value)
    else:
        _set_variable(run, said)


def declare(run: Run, declared: Declared) -> None:
    """Takes up a declaration in the program."""
    if declared.type not in POINT_TYPES:
        for _, value, _ in declared.items:
            run.mentioned |= identifiers(value)
        return
    for key, value, at in declared.items:
        if key is None:
            continue
        if value:
            run.state.variables[key] = Point(_pose(run, value, at))
        else:
            run.state.variables[key] = Point(Unclear("KRL003", "it has no value yet"))


def command(run: Run, statement: Statement, arguments: bytes) -> None:
    """Takes up a call of BAS."""
    state = run.state
    parsed = bas(arguments)
    if parsed is None:
        run.mentioned |= identifiers(arguments)
        run.forget({"base", "tool", "feed"}, f"after the call of BAS in line {statement.line}")
        return
    word, argument = parsed
    value = number(argument)
    if word == b"INITMOV":
        state.base = run.frames.known(0, ZERO, statement.line)
        state.tool = _numbered(run, b"TOOL", 1, statement.line)
        state.feed, state.tool_stands = NAN, False
    elif word in (b"BASE", b"TOOL"):
        _set_frame(run, statement, b"$" + word, _indexed(run, word, argument, statement.line))
    elif word == b"EX_BASE":
        state.base = Unclear("KRL011", f"$BASE is moved by an external kinematic since line {statement.line}")
    if word in (b"FRAMES", b"PTP_PARAMS", b"CP_PARAMS"):
        _apply_record(run, statement)
    if word in (b"CP_PARAMS", b"VEL_CP"):
        if value is not None and value <= 0:
            value = number((state.path_record or {}).get(b"VEL", b""))
        state.feed = NAN if value is None else value


def _set_frame(run: Run, statement: Statement, name: bytes, frame: Frame | Unclear) -> None:
    shown = name.decode()
    if isinstance(frame, Unclear) and frame.code == "KRL012":
        run.tell("KRL012", f"{shown}: {frame.message}; motions after it are not corrected", statement)
        frame = Unclear("KRL005", f"{shown} is not known since line {statement.line}")
    if name == b"$BASE":
        run.state.base = frame
    else:
        run.state.tool = frame


def _assigned_frame(run: Run, name: bytes, said: Assignment, line: int) -> Frame | Unclear:
    value = said.value.strip()
    if said.path or said.element is not None:
        before = run.frames.values(run.state.base if name == b"$BASE" else run.state.tool)
        changed = number(value)
        if before is None or changed is None or said.path not in COMPONENTS or said.element is not None:
            run.mentioned |= identifiers(value)
            return Unclear(
                "KRL012", f"{said.path.decode('latin-1')} is set in a frame that is not given in numbers"
            )
        values = list(before)
        values[COMPONENTS[said.path]] = changed
        x, y, z, a, b, c = values
        return run.frames.known(None, (x, y, z, a, b, c), line)
    if value.upper() in (b"$WORLD", b"$NULLFRAME"):
        return run.frames.known(0, ZERO, line)
    found = _DATA.match(value)
    if found:
        run.mentioned |= identifiers(found[2])
        table = found[1].upper()
        if table == name[1:]:
            return _indexed(run, table, found[2], line)
        return Unclear("KRL012", f"it is set to {value.decode('latin-1')}, a frame of another kind")
    if _EXTERNAL.search(value):
        return Unclear("KRL011", f"$BASE is moved by an external kinematic since line {line}")
    numbers = _complete(_pose(run, said.value.rstrip(), said.at))
    if numbers is not None:
        return run.frames.known(None, numbers, line)
    return Unclear("KRL012", f"'{value[:40].decode('latin-1')}' does not give six numbers")


def _indexed(run: Run, table: bytes, index: bytes, line: int) -> Frame | Unclear:
    value = number(index.strip())
    if value is None or value != int(value) or value < 0:
        run.mentioned |= identifiers(index)
        return Unclear("KRL012", f"the number '{index.strip()[:40].decode('latin-1')}' is not a constant")
    return _numbered(run, table, int(value), line)


def _numbered(run: Run, table: bytes, index: int, line: int) -> Frame | Unclear:
    """Entry ``index`` of BASE_DATA or TOOL_DATA as the program left it so far."""
    state = run.state
    if index == 0:
        return run.frames.known(0, ZERO, line)
    if (table, index) in state.data:
        values = state.data[table, index]
        if values is not None:
            return run.frames.known(index, values, line)
    elif not state.data_lost:
        return run.frames.known(index, None, line)
    return Unclear("KRL012", f"{table.decode()}_DATA[{index}] is computed in the program")


def _set_data(run: Run, said: Assignment) -> None:
    state, table = run.state, said.name[:4]
    index = number((said.element or b"").strip())
    if index is None or index != int(index):
        run.mentioned |= identifiers(said.value)
        state.data, state.data_lost = {}, True
        return
    key = (table, int(index))
    if not said.path:
        state.data[key] = _complete(_pose(run, said.value.rstrip(), said.at))
        return
    before, changed = state.data.get(key), number(said.value.strip())
    run.mentioned |= identifiers(said.value)
    if before is None or changed is None or said.path not in COMPONENTS:
        state.data[key] = None
        return
    values = list(before)
    values[COMPONENTS[said.path]] = changed
    x, y, z, a, b, c = values
    state.data[key] = (x, y, z, a, b, c)


def _record(run: Run, said: Assignment, before: dict[bytes, bytes] | None) -> dict[bytes, bytes] | None:
    """FDAT_ACT or LDAT_ACT after an assignment; None if not known."""
    value = said.value.strip()
    if said.path:
        return None if before is None else {**before, said.path: value}
    if value.startswith(b"{"):
        return fields(value)
    name = value.upper()
    return None if name in run.survey.assigned else run.declarations.records.get(name)


def _apply_record(run: Run, statement: Statement) -> None:
    state, record = run.state, run.state.frames_record
    if record is None:
        why = f"since line {statement.line}: its FDAT is declared elsewhere"
        state.base = Unclear("KRL005", f"$BASE is not known {why}")
        state.tool = Unclear("KRL005", f"$TOOL is not known {why}")
        return
    for table, key in ((b"BASE", b"BASE_NO"), (b"TOOL", b"TOOL_NO")):
        _set_frame(run, statement, b"$" + table, _indexed(run, table, record.get(key, b"?"), statement.line))
    if b"IPO_FRAME" in record:
        state.tool_stands = record[b"IPO_FRAME"].upper() != b"#BASE"


def _set_variable(run: Run, said: Assignment) -> None:
    variables, key = run.state.variables, said.key
    if key is None:
        run.mentioned |= identifiers(said.value)
        run.forget({said.name}, "after an assignment with a computed index")
        return
    if not said.path:
        variables[key] = Point(_pose(run, said.value.rstrip(), said.at))
        if not said.value.lstrip().startswith(b"{") and isinstance(variables[key].target, Target):
            variables[key].blocked = Unclear("KRL007", "it is a copy of another point")
        return
    run.mentioned |= identifiers(said.value)
    value, before = number(said.value.strip()), variables.get(key)
    if before is None:
        return
    if said.path in EXTERNAL:
        variables[key] = before.with_external(said.path, value)
        return
    if said.path in (b"S", b"T"):
        variables[key] = before.with_state(said.path, value)
    elif said.path in COMPONENTS and value is not None:
        variables[key] = before.changed(COMPONENTS[said.path], value)
    elif said.path in COMPONENTS or said.path in AXES:
        variables[key] = Point(Unclear("KRL002", "one of its components is computed"), origin=before)


def _pose(run: Run, value: bytes, at: int) -> Target | Unclear:
    """The target that a value gives: an aggregate in the program, or a copy of a known variable."""
    if value.startswith(b"{") and value.endswith(b"}") and value.count(b"{") == 1:
        return parse(value, at, 0)
    run.mentioned |= identifiers(value)
    found = _NAMED.match(value)
    key = keyed(found[1].upper(), found[2]) if found else None
    point = run.state.variables.get(key) if key is not None else None
    declared = point is not None and key is not None and point is run.declarations.points.get(key)
    if declared and key is not None and key.split(b"[")[0] in run.survey.assigned:
        return Unclear("KRL002", "its value in the .dat is not kept by the program")
    if point is not None and isinstance(point.target, Target):
        return replace(point.target, file=-1, start=NOWHERE, stop=NOWHERE)
    return Unclear("KRL002", "its value is computed")


def _complete(target: Target | Unclear) -> Numbers | None:
    if isinstance(target, Unclear) or target.axes is not None or target.missing:
        return None
    x, y, z, a, b, c = (0.0 if value is None else value for value in target.values)
    return (x, y, z, a, b, c)
