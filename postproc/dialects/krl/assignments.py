"""Assignments and calls of BAS: base, tool, feed, motion records and variables."""

from __future__ import annotations

import re
from functools import lru_cache

from postproc.dialects.krl.effects import READS_POSITION, bas
from postproc.dialects.krl.expressions import Value, index_text
from postproc.dialects.krl.lexing import (
    SCALARS,
    Assignment,
    Declared,
    Statement,
    assignment,
    number,
    value_end,
)
from postproc.dialects.krl.rows import Reason
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.state import NAN, ZERO, Frame, Record
from postproc.dialects.krl.target import AXES, COMPONENTS, EXTERNAL, Target, Unclear, fields, parse, shown

_DATA = re.compile(rb"(BASE|TOOL)_DATA[ \t]*\[([^\]]*)\][ \t]*\Z", re.I)
_OF_RECORD = re.compile(rb"S(TOOL2?|BASE)[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_SPEED = re.compile(rb"SVEL_CP[ \t]*\(([^(),]*),[^(),]*,([^(),]*)\)[ \t]*\Z", re.I)
_ROUNDING = re.compile(rb"SAPO(?:_PTP)?[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_MODE = re.compile(rb"SIPO_MODE[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_EXTERNAL = re.compile(rb"\bE[BK][ \t]*\(", re.I)
DEFAULT_ROUNDING = 3.0
"""[mm] $APO.CDIS after BAS(#INITMOV,0): DEF_APO_CDIS of KUKA's bas.src."""


def assign(run: Run, statement: Statement, said: Assignment, here: bool = False) -> None:
    """Takes up ``name[index].path = value``; ``here``: it holds for this motion only."""
    state = run.state
    if READS_POSITION.search(said.value):
        run.rows.reads.append((statement.line, state.sources))
    name = said.name
    if name in (b"$BASE", b"$TOOL"):
        _set_frame(run, statement, name, _assigned_frame(run, name, said, statement.line), here)
    elif name == b"$VEL":
        if said.path in (b"", b"CP"):
            _set_speed(run, said)
    elif name == b"$APO":
        if said.path in (b"", b"CDIS"):
            _set_rounding(run, said)
    elif name == b"$IPO_MODE":
        mode = said.value.strip().upper()
        if found := _MODE.match(mode):
            mode = (_of_record(run, found[1]) or b"?").upper()
        state.tool_stands = not mode.endswith(b"#BASE")
    elif name in (b"$ROBROOT", b"$WORLD"):
        run.root_set = run.root_set or statement.line
    elif name == b"FDAT_ACT":
        state.frames_record = _record(run, said, state.frames_record)
    elif name == b"LDAT_ACT":
        state.path_record = _record(run, said, state.path_record)
    elif name == b"PDAT_ACT":
        state.axis_record = _record(run, said, state.axis_record)
    elif not name.startswith(b"$"):
        _set_variable(run, said)


def with_clause(run: Run, statement: Statement, clause: bytes) -> Reason | None:
    """Takes up what a WITH sets; the caller takes it back behind the motion."""
    place = 0
    while place < len(clause):
        end = value_end(clause, place)
        said = assignment(clause[place:end].strip(), 0)
        if said is None:
            return Reason("KRL001", f"'{shown(clause[place:end])}' is not understood")
        assign(run, statement, said, here=True)
        place = end + 1
    return None


def declare(run: Run, declared: Declared) -> None:
    """Takes up a declaration in the program; a parameter has its value from the call."""
    routine = run.routine
    given = {name for name, _ in routine.parameters} if routine is not None else set()
    for key, value, at in declared.items:
        if key is None:
            continue
        root = key.split(b"[")[0]
        if not value:
            if root not in given:
                run.variables.replace(root, {})
            continue
        run.variables.set(root, key[len(root) :], run.converted(root, _value(run, value, at)))


def command(run: Run, statement: Statement, arguments: bytes) -> None:
    """Takes up a call of BAS."""
    state = run.state
    parsed = bas(arguments)
    if parsed is None:
        run.forget({"base", "tool", "feed", "apo", "mode"}, f"after the call of BAS in line {statement.line}")
        return
    word, argument = parsed
    if word == b"INITMOV":
        state.base = run.frames.known(0, ZERO, statement.line)
        state.tool = _numbered(run, b"TOOL", 1, statement.line)
        speed = run.variables.get(b"DEF_VEL_CP")
        state.feed = speed if isinstance(speed, float) else NAN
        state.blend, state.tool_stands = DEFAULT_ROUNDING, False
    elif word in (b"BASE", b"TOOL"):
        _set_frame(run, statement, b"$" + word, _indexed(run, word, argument, statement.line))
    elif word == b"EX_BASE":
        state.base = Unclear("KRL011", f"$BASE is moved by an external kinematic since line {statement.line}")
    if word in (b"FRAMES", b"PTP_PARAMS", b"CP_PARAMS"):
        _apply_record(run, statement)
    if word in (b"CP_PARAMS", b"CP_DAT"):
        state.blend = _number(run, state.path_record, b"APO_DIST")
    elif word in (b"PTP_PARAMS", b"PTP_DAT"):
        record = state.axis_record
        if record is None or b"CDIS" in record.get(b"APO_MODE", b"").upper():
            state.blend = _number(run, record, b"APO_DIST")
    if word in (b"CP_PARAMS", b"VEL_CP", b"CP_DAT"):
        value = run.value(argument) if argument else 0
        speed = float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else NAN
        state.feed = _number(run, state.path_record, b"VEL") if speed <= 0 else speed


def _number(run: Run, record: Record | None, key: bytes) -> float:
    value = run.value(record[key]) if record and record.get(key) else None
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else NAN


def _set_speed(run: Run, said: Assignment) -> None:
    state, value = run.state, said.value.strip()
    if found := _SPEED.match(value):
        speed = run.value(found[1].strip()) if found[1].strip() else 0
        known = isinstance(speed, (int, float)) and not isinstance(speed, bool)
        state.feed = float(speed) if known else NAN  # type: ignore[arg-type]
        if state.feed <= 0:
            state.feed = _number(run, run.declarations.records.get(found[2].strip().upper()), b"VEL")
        return
    text = value if said.path else fields(value).get(b"CP", b"")
    # An aggregate without CP leaves it as it was.
    if said.path or text:
        speed = run.value(text)
        known = isinstance(speed, (int, float)) and not isinstance(speed, bool)
        state.feed = float(speed) if known else NAN  # type: ignore[arg-type]


def _set_rounding(run: Run, said: Assignment) -> None:
    state, value = run.state, said.value.strip()
    if found := _ROUNDING.match(value):
        state.blend = _number(run, run.declarations.records.get(found[1].strip().upper()), b"APO_DIST")
        return
    if said.path:
        state.blend = _number(run, {b"CDIS": value}, b"CDIS")
    elif b"CDIS" in (given := fields(value)) or not value.startswith(b"{"):
        state.blend = _number(run, given, b"CDIS")


def _set_frame(
    run: Run, statement: Statement, name: bytes, frame: Frame | Unclear, here: bool = False
) -> None:
    label = name.decode()
    if isinstance(frame, Unclear) and frame.code == "KRL012" and here:
        frame = Unclear("KRL012", f"{label}: {frame.message}")
    elif isinstance(frame, Unclear) and frame.code == "KRL012":
        run.tell("KRL012", f"{label}: {frame.message}; motions after it are not corrected", statement)
        frame = Unclear("KRL005", f"{label} is not known since line {statement.line}")
    if name == b"$BASE":
        run.state.base = frame
    else:
        run.state.tool = frame


def _assigned_frame(run: Run, name: bytes, said: Assignment, line: int) -> Frame | Unclear:
    value = said.value.strip()
    if said.path or said.element is not None:
        before = run.frames.values(run.state.base if name == b"$BASE" else run.state.tool)
        changed = run.value(value)
        known = isinstance(changed, (int, float)) and not isinstance(changed, bool)
        if before is None or not known or said.path not in COMPONENTS or said.element is not None:
            return Unclear("KRL012", f"{shown(said.path)} is set in a frame that is not given in numbers")
        values = list(before)
        values[COMPONENTS[said.path]] = float(changed)  # type: ignore[arg-type]
        x, y, z, a, b, c = values
        return run.frames.known(None, (x, y, z, a, b, c), line)
    if value.upper() in (b"$WORLD", b"$NULLFRAME"):
        return run.frames.known(0, ZERO, line)
    if found := _DATA.match(value):
        table = found[1].upper()
        if table == name[1:]:
            return _indexed(run, table, found[2], line)
        return Unclear("KRL012", f"it is set to {shown(value)}, a frame of another kind")
    if found := _OF_RECORD.match(value):
        table = b"TOOL" if found[1].upper().startswith(b"TOOL") else b"BASE"
        given = found[2].strip()
        if b"." not in given and number(given) is None:
            given += b"." + table + b"_NO"
        return _indexed(run, table, _of_record(run, given) or given, line)
    if _EXTERNAL.search(value):
        return Unclear("KRL011", f"$BASE is moved by an external kinematic since line {line}")
    target = _value(run, said.value.rstrip(), said.at)
    numbers = target.numbers if isinstance(target, Target) else None
    if numbers is not None:
        return run.frames.known(None, numbers, line)
    return Unclear("KRL012", f"'{shown(value)}' does not give six numbers")


def _indexed(run: Run, table: bytes, given: bytes, line: int) -> Frame | Unclear:
    value = run.value(given.strip())
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != int(value) or value < 0:
        return Unclear("KRL012", f"the number '{shown(given)}' is not a constant")
    return _numbered(run, table, int(value), line)


def _numbered(run: Run, table: bytes, at: int, line: int) -> Frame | Unclear:
    """Entry ``at`` of BASE_DATA or TOOL_DATA as the program left it so far."""
    if at == 0:
        return run.frames.known(0, ZERO, line)
    value = run.variables.get(table + b"_DATA", b"[%d]" % at)
    if value is None:
        return run.frames.known(at, None, line)
    numbers = value.numbers if isinstance(value, Target) else None
    if numbers is not None:
        return run.frames.known(at, numbers, line)
    return Unclear("KRL012", f"{table.decode()}_DATA[{at}] is computed in the program")


def _record(run: Run, said: Assignment, before: Record | None) -> Record | None:
    """FDAT_ACT, LDAT_ACT or PDAT_ACT after an assignment; None if not known."""
    value = said.value.strip()
    if said.path:
        return None if before is None else {**before, said.path: value}
    if value.startswith(b"{"):
        return fields(value)
    name = value.upper()
    return None if name in run.survey.assigned else run.declarations.records.get(name)


def _of_record(run: Run, text: bytes) -> bytes | None:
    """The entry that ``FP1.BASE_NO`` names."""
    name, _, key = text.strip().upper().partition(b".")
    record = run.declarations.records.get(name)
    if record is None or name in run.survey.assigned or name + b"." + key in run.survey.assigned:
        return None
    return record.get(key)


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
    name, path = said.name, b""
    if said.element is not None:
        indices = index_text(said.element, run.lookup)
        if indices is None:
            run.forget({name}, "after an assignment with a computed index")
            return
        path = b"[" + indices + b"]"
    if not said.path:
        value = _value(run, said.value.rstrip(), said.at)
        keep(run, name, path, value)
        return
    inner, _, key = said.path.rpartition(b".")
    if b"[" in said.path:
        run.forget({name}, "after an assignment with a computed index")
        return
    path += b"." + inner if inner else b""
    is_component = key in COMPONENTS or key in AXES or key in EXTERNAL or key in (b"S", b"T")
    before = run.variables.get(name, path)
    if not is_component or not (isinstance(before, Target) or _may_be_point(run, name, path)):
        keep(run, name, path + b"." + key, _value(run, said.value.rstrip(), said.at))
        return
    text = said.value.rstrip()
    value = run.value(text)
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    why = Unclear("KRL002", f"its component {shown(key)} is computed")
    if not isinstance(before, Target):
        if key in EXTERNAL or key in (b"S", b"T"):
            return
        unset = (
            before if isinstance(before, Unclear) else Unclear("KRL002", "not all of its components are set")
        )
        six = (NAN,) * 6
        before = Target((None,) * 6, axes=six, lost=unset) if key in AXES else Target(six, lost=unset)
    place = (0, said.at, said.at + len(text)) if number(text) is not None else (-1, -1, -1)
    after = before.changed(key, float(value) if known else None, why, place, text)  # type: ignore[arg-type]
    run.variables.set(name, path, after)


def _may_be_point(run: Run, name: bytes, path: bytes) -> bool:
    """Whether ``.X`` of this is a component of a point, and not a field of a structure that is called so."""
    return b"." in path or run.type_of(name) not in SCALARS


def keep(run: Run, name: bytes, path: bytes, value: Value) -> None:
    """Stores a value; a number only where no other program can change it."""
    if not isinstance(value, (Target, Unclear)):
        if not run.trusted(name):
            value = _untrusted(name)
        else:
            value = run.converted(name, value) if not path.startswith(b".") else value
    run.variables.set(name, path, value)


@lru_cache(maxsize=1024)
def _untrusted(name: bytes) -> Unclear:
    return Unclear("KRL002", f"{shown(name)} is not declared in this module, others may change it")


def _value(run: Run, text: bytes, at: int) -> Value:
    """What a value gives; an aggregate of literals keeps its places, all else is a copy without them."""
    if text.startswith(b"{") and text.endswith(b"}") and text.count(b"{") == 1 and b'"' not in text:
        return parse(text, at, 0, run.value)
    value = run.value(text)
    if isinstance(value, Target):
        return value.detached()
    if isinstance(value, Unclear):
        return Unclear(
            "KRL002",
            value.message
            if value.message.startswith("its value")
            else f"its value is computed: {value.message}",
        )
    return value
