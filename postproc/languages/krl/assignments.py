"""Assignments and calls of BAS: base, tool, feed, motion records and variables."""

from __future__ import annotations

import re
from functools import lru_cache

from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.expressions import Value, index_text
from postproc.languages.krl.external_axes import apart
from postproc.languages.krl.lexing import (
    POINT_TYPES,
    Assignment,
    Declared,
    Statement,
    assignment,
    is_number,
    number,
    value_end,
)
from postproc.languages.krl.modal_state import NAN, OVERRIDES, FrameIndex, Record
from postproc.languages.krl.motion_rows import RowRefusal
from postproc.languages.krl.spatial import ZERO
from postproc.languages.krl.statement_effects import BAS_COMMANDS, MODAL, READS_POSITION, bas
from postproc.languages.krl.system_variables import has_unknown_effect
from postproc.languages.krl.target import (
    AXES,
    COMPONENTS,
    EXTERNAL,
    FrameEntry,
    KrlTarget,
    UnknownValue,
    fields,
    parse,
    shown,
)
from postproc.toolpath import ArcFrame, OrientationMode

_SIMPLE = re.compile(rb"[A-Z_$][A-Z0-9_$]*+\Z")
_DATA = re.compile(rb"(BASE|TOOL)_DATA[ \t]*\[([^\]]*)\][ \t]*\Z", re.I)
_LEFT_OF_DATA = re.compile(rb":[ \t]*(?:BASE|TOOL)_DATA[ \t]*+\[[^\[\]]*+\][ \t]*+\Z", re.I)
_OF_RECORD = re.compile(rb"S(TOOL2?|BASE)[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_SPEED = re.compile(rb"SVEL_CP[ \t]*\(([^(),]*),[^(),]*,([^(),]*)\)[ \t]*\Z", re.I)
_ROUNDING = re.compile(rb"SAPO(?:_PTP)?[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_MODE = re.compile(rb"SIPO_MODE[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_ORIENTATION = re.compile(rb"S(?:ORI|CIRC)_TYPE?[ \t]*\(([^()]*)\)[ \t]*\Z", re.I)
_ORIENTATIONS = {
    b"#VAR": OrientationMode.VAR,
    b"#CONSTANT": OrientationMode.CONSTANT,
    b"#JOINT": OrientationMode.JOINT,
}
_ARC_FRAMES = {b"#BASE": ArcFrame.BASE, b"#PATH": ArcFrame.PATH}
_EXTERNAL = re.compile(rb"\bE[BK][ \t]*\(", re.I)
DEFAULT_ROUNDING = 3.0
"""[mm] $APO.CDIS after BAS(#INITMOV,0): DEF_APO_CDIS of KUKA's bas.src."""


def assign(run: ExecutionContext, statement: Statement, assignment: Assignment, here: bool = False) -> None:
    """Takes up ``name[index].path = value``; ``here``: it holds for this motion only."""
    state, name = run.state, assignment.name
    if READS_POSITION.search(assignment.value):
        run.rows.reads.append((statement.line, state.sources))
    if name in (b"$BASE", b"$TOOL"):
        _set_frame(run, statement, name, _assigned_frame(run, name, assignment, statement.line), here)
    elif name == b"$VEL":
        if assignment.path in (b"", b"CP"):
            _set_speed(run, assignment)
    elif name == b"$APO":
        if assignment.path in (b"", b"CDIS"):
            _set_rounding(run, assignment)
    elif name in OVERRIDES:
        reduced = {name} if run.value(assignment.value) != 100 else set()
        state.overridden = state.overridden - {name} | reduced
    elif name == b"$IPO_MODE":
        mode = assignment.value.strip().upper()
        if found := _MODE.match(mode):
            mode = (_of_record(run, found[1]) or b"?").upper()
        state.tool_known = not mode.endswith(b"#BASE")
    elif name == b"$ORI_TYPE":
        value = _turning(run, assignment, b"ORI_TYP")
        state.orientation = _ORIENTATIONS.get(value, OrientationMode.UNKNOWN)
    elif name == b"$CIRC_TYPE":
        value = _turning(run, assignment, b"CIRC_TYP")
        state.arc_frame = _ARC_FRAMES.get(value, ArcFrame.UNKNOWN)
    elif name == b"$CIRC_MODE":
        state.arc_frame = ArcFrame.UNKNOWN
    elif name in (b"$ROBROOT", b"$WORLD"):
        state.root_set = state.root_set or statement.line
        run.root_set = run.root_set or statement.line
    elif name in (b"$EX_AX_IGNORE", b"$ASYNC_AXIS"):
        before = state.external_apart
        off = number(assignment.value.strip()) == 0.0
        state.external_apart = before - {name} if off else before | {name}
        if before or state.external_apart:
            state.external = apart(state.external)
    elif name == b"FDAT_ACT":
        state.frames_record = _frames_record(run, assignment, state.frames_record)
    elif name == b"LDAT_ACT":
        state.path_record = _record(run, assignment, state.path_record)
    elif name == b"PDAT_ACT":
        state.axis_record = _record(run, assignment, state.axis_record)
    elif not name.startswith(b"$"):
        _set_variable(run, assignment)
    elif has_unknown_effect(name):
        run.report_unknown_effect(shown(name), statement)


def with_clause(run: ExecutionContext, statement: Statement, clause: bytes) -> RowRefusal | None:
    """Takes up what a WITH sets; the caller takes it back after the motion."""
    place = 0
    while place < len(clause):
        end = value_end(clause, place)
        said = assignment(clause[place:end].strip(), 0)
        if said is None:
            return RowRefusal("KRL001", f"'{shown(clause[place:end])}' is not understood")
        assign(run, statement, said, here=True)
        place = end + 1
        if end < len(clause) and not clause[place:].strip():
            return RowRefusal("KRL001", "a value is missing after the last comma of its WITH")
    return None


def declare(run: ExecutionContext, declared: Declared) -> None:
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


def command(run: ExecutionContext, statement: Statement, arguments: bytes) -> None:
    """Takes up a call of BAS."""
    state = run.state
    parsed = bas(arguments)
    if parsed is None or parsed[0] not in BAS_COMMANDS:
        run.forget(MODAL, f"after the call of BAS in line {statement.line}")
        return
    word, argument = parsed
    if word == b"INITMOV":
        state.base = run.frames.known(0, ZERO, statement.line)
        state.tool = run.numbered_frame(b"TOOL", 1, statement.line)
        speed = run.variables.get(b"DEF_VEL_CP")
        state.feed = speed if isinstance(speed, float) else NAN
        state.blend, state.tool_known = DEFAULT_ROUNDING, False
        state.orientation, state.arc_frame = OrientationMode.VAR, ArcFrame.BASE
    elif word in (b"BASE", b"TOOL"):
        _set_frame(run, statement, b"$" + word, _indexed(run, word, argument, statement.line))
    elif word == b"EX_BASE":
        state.base = UnknownValue(
            "KRL011", f"$BASE is moved by an external kinematic since line {statement.line}"
        )
    if word in (b"FRAMES", b"PTP_PARAMS", b"CP_PARAMS"):
        _apply_record(run, statement)
    if word in (b"CP_PARAMS", b"CP_DAT"):
        state.blend = _number(run, state.path_record, b"APO_DIST")
        _turn_by_record(run)
    elif word in (b"PTP_PARAMS", b"PTP_DAT"):
        record = state.axis_record
        if record is None or b"CDIS" in record.get(b"APO_MODE", b"").upper():
            state.blend = _number(run, record, b"APO_DIST")
    if word in (b"CP_PARAMS", b"VEL_CP", b"CP_DAT"):
        value = run.value(argument) if argument else 0
        speed = float(value) if is_number(value) else NAN
        state.feed = _number(run, state.path_record, b"VEL") if speed <= 0 else speed


def _turning(run: ExecutionContext, assignment: Assignment, key: bytes) -> bytes:
    """What $ORI_TYPE or $CIRC_TYPE is set to, in capitals; of SORI_TYP(LCPDAT1) what that record says under ``key``."""
    value = assignment.value.strip()
    if assignment.path or assignment.element is not None:
        return b""
    if found := _ORIENTATION.match(value):
        value = _of_record(run, found[1].strip() + b"." + key) or b""
    else:
        known = run.value(value)
        value = known if isinstance(known, bytes) else value
    return value.upper().replace(b" ", b"")


def _turn_by_record(run: ExecutionContext) -> None:
    """BAS sets $ORI_TYPE and $CIRC_TYPE from LDAT_ACT; a record without them leaves both."""
    state, record = run.state, run.state.path_record
    if record is None:
        state.forget({"turning"}, "", False, run.has_turning)
        return
    if b"ORI_TYP" in record:
        state.orientation = _ORIENTATIONS.get(record[b"ORI_TYP"].upper(), OrientationMode.UNKNOWN)
    if b"CIRC_TYP" in record:
        state.arc_frame = _ARC_FRAMES.get(record[b"CIRC_TYP"].upper(), ArcFrame.UNKNOWN)


def _number(run: ExecutionContext, record: Record | None, key: bytes) -> float:
    value = run.value(record[key]) if record and record.get(key) else None
    return float(value) if is_number(value) else NAN


def _set_speed(run: ExecutionContext, assignment: Assignment) -> None:
    state, value = run.state, assignment.value.strip()
    if found := _SPEED.match(value):
        speed = run.value(found[1].strip()) if found[1].strip() else 0
        state.feed = float(speed) if is_number(speed) else NAN
        if state.feed <= 0:
            state.feed = _number(run, run.record(found[2].strip().upper()), b"VEL")
        return
    text = value if assignment.path else fields(value).get(b"CP", b"")
    # An aggregate without CP leaves it as it was.
    if assignment.path or text:
        speed = run.value(text)
        state.feed = float(speed) if is_number(speed) else NAN


def _set_rounding(run: ExecutionContext, assignment: Assignment) -> None:
    state, value = run.state, assignment.value.strip()
    if found := _ROUNDING.match(value):
        state.blend = _number(run, run.record(found[1].strip().upper()), b"APO_DIST")
        return
    if assignment.path:
        state.blend = _number(run, {b"CDIS": value}, b"CDIS")
    elif b"CDIS" in (given := fields(value)) or not value.startswith(b"{"):
        state.blend = _number(run, given, b"CDIS")


def _set_frame(
    run: ExecutionContext,
    statement: Statement,
    name: bytes,
    frame: FrameIndex | UnknownValue,
    here: bool = False,
) -> None:
    label = name.decode()
    if isinstance(frame, UnknownValue) and frame.code == "KRL012" and here:
        frame = UnknownValue("KRL012", f"{label}: {frame.message}")
    elif isinstance(frame, UnknownValue) and frame.code == "KRL012":
        run.add_finding("KRL012", f"{label}: {frame.message}; motions after it are not corrected", statement)
        frame = UnknownValue("KRL005", f"{label} is not known since line {statement.line}")
    if name == b"$BASE":
        run.state.base = frame
    else:
        run.state.tool = frame


def _assigned_frame(
    run: ExecutionContext, name: bytes, assignment: Assignment, line: int
) -> FrameIndex | UnknownValue:
    value = assignment.value.strip()
    if assignment.path or assignment.element is not None:
        frame = run.state.base if name == b"$BASE" else run.state.tool
        before, changed = run.frames.values(frame), run.value(value)
        component = COMPONENTS.get(assignment.path)
        if component is None or assignment.element is not None:
            return UnknownValue(
                "KRL012", f"what is set of it, {shown(assignment.path)}, is no component of a frame"
            )
        if not is_number(changed):
            return UnknownValue("KRL012", f"{shown(assignment.path)} is not set to a constant number")
        if before is None:
            of_entry = None
            if isinstance(frame, FrameIndex):
                of_entry = run.frames.with_component(frame, component, float(changed), line)
            return of_entry or UnknownValue(
                "KRL012", f"{shown(assignment.path)} is relative to a frame that is not given in numbers"
            )
        values = list(before)
        values[component] = float(changed)
        x, y, z, a, b, c = values
        return run.frames.known(None, (x, y, z, a, b, c), line)
    if value.upper() in (b"$WORLD", b"$NULLFRAME"):
        return run.frames.known(0, ZERO, line)
    if found := _DATA.match(value):
        table = found[1].upper()
        if table == name[1:]:
            return _indexed(run, table, found[2], line)
        return UnknownValue("KRL012", f"it is set to {shown(value)}, a frame of another kind")
    if found := _OF_RECORD.match(value):
        table = b"TOOL" if found[1].upper().startswith(b"TOOL") else b"BASE"
        given = found[2].strip()
        if b"." not in given and number(given) is None:
            given += b"." + table + b"_NO"
        return _indexed(run, table, _of_record(run, given) or given, line)
    copied = run.value(value)
    if isinstance(copied, FrameEntry) and copied.table == name[1:]:
        return run.frames.in_entry(copied, line)
    if _EXTERNAL.search(value):
        return UnknownValue("KRL011", f"$BASE is moved by an external kinematic since line {line}")
    target = _value(run, assignment.value.rstrip(), assignment.at)
    numbers = target.numbers if isinstance(target, KrlTarget) else None
    if numbers is not None:
        return run.frames.known(None, numbers, line)
    if _LEFT_OF_DATA.search(value):
        why = "a product with a frame of the controller on its right is not read; write it as six numbers"
        return UnknownValue("KRL012", f"'{shown(value)}': {why}")
    return UnknownValue("KRL012", f"'{shown(value)}' does not consist of six numbers")


def _indexed(run: ExecutionContext, table: bytes, index: bytes, line: int) -> FrameIndex | UnknownValue:
    value = run.value(index.strip())
    if not is_number(value) or value != int(value) or value < 0:
        return UnknownValue("KRL012", f"the number '{shown(index)}' is not a constant")
    return run.numbered_frame(table, int(value), line)


def _record(run: ExecutionContext, assignment: Assignment, before: Record | None) -> Record | None:
    """FDAT_ACT, LDAT_ACT or PDAT_ACT after an assignment; None if not known."""
    value = assignment.value.strip()
    if assignment.path:
        return None if before is None else {**before, assignment.path: value}
    if value.startswith(b"{"):
        return fields(value)
    return run.record(value.upper())


_NAME = b""
"""The key that has the name of a record in place of what it states, where that is not known."""


def _frames_record(run: ExecutionContext, assignment: Assignment, before: Record | None) -> Record | None:
    """The same of FDAT_ACT; {_NAME: name} where a record that no file declares is assigned."""
    record = _record(run, assignment, None if before is None or _NAME in before else before)
    name = assignment.value.strip().upper()
    changed = name in run.structure.assigned or name in run.partly_assigned
    if record is None and not assignment.path and _SIMPLE.match(name) and not changed:
        return {_NAME: name}
    return record


def _of_record(run: ExecutionContext, text: bytes) -> bytes | None:
    """The entry that ``FP1.BASE_NO`` names."""
    name, _, key = text.strip().upper().partition(b".")
    record = run.record(name, key)
    return None if record is None else record.get(key)


def _apply_record(run: ExecutionContext, statement: Statement) -> None:
    state, record = run.state, run.state.frames_record
    if record is None or _NAME in record:
        run.variables.asked.add(b"FDAT_ACT")
        unknown = (
            "is not known" if record is None else f"{record[_NAME].decode('latin-1')} is declared elsewhere"
        )
        why = f"since line {statement.line}: its FDAT {unknown}"
        state.forget({"mode"}, why, run.has_tcp_mode, run.has_turning)
        state.base = UnknownValue("KRL005", f"$BASE is not known {why}")
        state.tool = UnknownValue("KRL005", f"$TOOL is not known {why}")
        return
    for table, key in ((b"BASE", b"BASE_NO"), (b"TOOL", b"TOOL_NO")):
        _set_frame(run, statement, b"$" + table, _indexed(run, table, record.get(key, b"?"), statement.line))
    if b"IPO_FRAME" in record:
        state.tool_known = record[b"IPO_FRAME"].upper() != b"#BASE"


def _set_variable(run: ExecutionContext, assignment: Assignment) -> None:
    name, path = assignment.name, b""
    if assignment.element is not None:
        indices = index_text(assignment.element, run.lookup)
        if indices is None:
            run.forget({name}, "after an assignment with a computed index")
            return
        path = b"[" + indices + b"]"
    if not assignment.path:
        value = _value(run, assignment.value.rstrip(), assignment.at)
        has_value = run.variables.get(name, path) is not None or not run.trusted(name)
        if isinstance(value, KrlTarget) and value.missing and has_value:
            missing = value.missing
            value = UnknownValue("KRL002", f"the aggregate assigned to {shown(name)} omits {missing}")
        keep(run, name, path, value)
        return
    inner, _, key = assignment.path.rpartition(b".")
    if b"[" in assignment.path:
        run.forget({name}, "after an assignment with a computed index")
        return
    path += b"." + inner if inner else b""
    is_component = key in COMPONENTS or key in AXES or key in EXTERNAL or key in (b"S", b"T")
    before = run.variables.get(name, path)
    if not is_component or not (isinstance(before, KrlTarget) or _may_be_point(run, name, path)):
        keep(run, name, path + b"." + key, _value(run, assignment.value.rstrip(), assignment.at))
        return
    text = assignment.value.rstrip()
    value = run.value(text)
    why = UnknownValue("KRL002", f"its component {shown(key)} is computed")
    if not isinstance(before, KrlTarget):
        if key in EXTERNAL or key in (b"S", b"T"):
            return
        unset = (
            before
            if isinstance(before, UnknownValue)
            else UnknownValue("KRL002", "not all of its components are set")
        )
        six = (NAN,) * 6
        before = (
            KrlTarget((None,) * 6, axes=six, unknown=unset) if key in AXES else KrlTarget(six, unknown=unset)
        )
    place = (0, assignment.at, assignment.at + len(text)) if number(text) is not None else (-1, -1, -1)
    after = before.changed(key, float(value) if is_number(value) else None, why, place, text)
    run.variables.set(name, path, after)


def _may_be_point(run: ExecutionContext, name: bytes, path: bytes) -> bool:
    """Whether ``.X`` of this is a component of a point, and not a field of a structure that is called so."""
    kind = run.type_at(name, path)
    return not kind or kind in POINT_TYPES


def keep(run: ExecutionContext, name: bytes, path: bytes, value: Value) -> None:
    """Stores a value; a number only where no other program can change it."""
    if not isinstance(value, (KrlTarget, UnknownValue)):
        value = run.converted(name, value, path) if run.trusted(name) else _untrusted(name)
    run.variables.set(name, path, value)


@lru_cache(maxsize=1024)
def _untrusted(name: bytes) -> UnknownValue:
    return UnknownValue("KRL002", f"{shown(name)} is not declared in this module, others may change it")


def _value(run: ExecutionContext, text: bytes, at: int) -> Value:
    """What a value gives; an aggregate of literals keeps its places, all else is a copy without them."""
    if text.startswith(b"{") and text.endswith(b"}") and text.count(b"{") == 1 and b'"' not in text:
        return parse(text, at, 0, run.value)
    value = run.value(text)
    if isinstance(value, FrameEntry):
        return value
    if isinstance(value, KrlTarget):
        return value.detached()
    if isinstance(value, UnknownValue):
        return UnknownValue(
            "KRL002",
            value.message
            if value.message.startswith("its value")
            else f"its value is computed: {value.message}",
        )
    return value
