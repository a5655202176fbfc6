"""Text of a statement -> what it does."""

from __future__ import annotations

import re
from collections.abc import Iterable

from postproc.languages.tp.motion_parsing import is_motion_like, parse_motion
from postproc.languages.tp.tp_listing import NumberedStatement
from postproc.languages.tp.tp_statements import (
    BlockElse,
    BlockEnd,
    BlockStart,
    ConditionalStatement,
    DisplacementSwitch,
    FrameSelection,
    JumpStatement,
    LabelStatement,
    LoopEnd,
    LoopStart,
    Operand,
    OtherStatement,
    OverrideStatement,
    PositionUse,
    ProgramCall,
    ProgramEnd,
    RegisterAssignment,
    RegisterExpression,
    RegisterOperand,
    SpeedChange,
    StatementNotRead,
    TimeoutStatement,
    TpRemark,
    TpStatement,
    WaitStatement,
)

_REMARK = re.compile(rb"[ \t]*+(!|//|--[a-z]{2}:)")
_LABEL = re.compile(rb"LBL[ \t]*+\[[ \t]*+([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+\]", re.I)
_JUMP = re.compile(
    rb"JMP[ \t]++LBL[ \t]*+\[[ \t]*+(?:([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+|[A-Z]++\[[^\]]*+\][ \t]*+)\]", re.I
)
_CALL = re.compile(rb"(CALL|RUN)[ \t]++([A-Z_][A-Z0-9_\-]*+|SR\[[^\]]*+\])[ \t]*+(?:\(.*\))?+", re.I | re.S)
_END = re.compile(rb"(?:END|ABORT)", re.I)
_FRAME = re.compile(
    rb"(UFRAME_NUM|UTOOL_NUM)[ \t]*+(?:\[[ \t]*+GP([0-9]{1,9}+)[ \t]*+\])?+[ \t]*+=(.*)", re.I | re.S
)
_ASSIGNED = re.compile(rb"(R|P|PR|UFRAME|UTOOL)[ \t]*+\[", re.I)
_ASSIGNMENT = re.compile(
    rb"(R|P|PR|UFRAME|UTOOL)[ \t]*+\[((?:[^\[\]=]*+(?:\[[^\[\]]*+\])?+)*+)\][ \t]*+=(.*)", re.I | re.S
)
_INDEX = re.compile(rb"[ \t]*+(?:GP[0-9]++[ \t]*+:)?+[ \t]*+([0-9]{1,9}+)[ \t]*+(?:[,:].*)?+", re.I | re.S)
_UNSIGNED = rb"(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)"
_OPERAND = (
    rb"(?:\([ \t]*+-?+[ \t]*+" + _UNSIGNED + rb"[ \t]*+\)|-?+[ \t]*+" + _UNSIGNED + rb"|R\[[^\[\]]*+\])"
)
_EXPRESSION = re.compile(
    rb"[ \t]*+(" + _OPERAND + rb")[ \t]*+(?:(\+|-|\*|/|DIV|MOD)[ \t]*+(" + _OPERAND + rb"))?+[ \t]*+", re.I
)
_ONE_REGISTER = re.compile(rb"R\[[ \t]*+([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+\]", re.I)
_CONDITION = re.compile(
    rb"[ \t]*+\(?+[ \t]*+(R\[[^\[\]]*+\])[ \t]*+(=|<>|<=|>=|<|>)[ \t]*+("
    + _OPERAND
    + rb")[ \t]*+\)?+[ \t]*+",
    re.I,
)
_IF = re.compile(rb"IF(?=[ \t(])(.*)", re.I | re.S)
_THEN = re.compile(rb"(?:.*[ \t)])THEN", re.I | re.S)
_CASE = re.compile(rb"(?:SELECT[ \t]++[^,]*+|=[^,]*+|ELSE[ \t]*+),(.*)", re.I | re.S)
_FOR = re.compile(
    rb"FOR[ \t]++R\[[ \t]*+([0-9]{1,9}+)[^\]]*+\][ \t]*+=.*[ \t](?:TO|DOWNTO)[ \t].*", re.I | re.S
)
_TIMEOUT = re.compile(
    rb"(?:WAIT\b.*\bTIMEOUT[ \t]*+,|VISION[ \t]++GET_OFFSET\b.*\bJMP[ \t]*+,?+)[ \t]*+LBL[ \t]*+\[[ \t]*+"
    rb"(?:([0-9]{1,9}+)(?![0-9]))?+.*",
    re.I | re.S,
)
"""A WAIT whose time is over, and a vision process that finds nothing, go on at a label."""
_OVERRIDE = re.compile(
    rb"(?:OVERRIDE|\$MCR[ \t]*+\.[ \t]*+\$GENOVERRIDE)[ \t]*+=[ \t]*+(?:([0-9]{1,9}+)(?![0-9.])[ \t]*+%?+|.*)",
    re.I | re.S,
)
"""OVERRIDE= sets the system variable $MCR.$GENOVERRIDE, which a program may assign as well."""
_LIMIT = re.compile(rb"(?:JOINT|LINEAR)_MAX_SPEED\b.*", re.I | re.S)
_POINT_READ = re.compile(rb"(?<![A-Z])P[ \t]*+\[[ \t]*+(?:([0-9]{1,9}+)(?![0-9]))?+", re.I)
_MAY_SLOW = re.compile(rb"\$|SPEED|SPD|OVERRIDE|OVRD", re.I)
_PLACE = re.compile(rb"\b[LJC]POS\b", re.I)
_STARTS = re.compile(
    rb"(Weave|Track|Touch[ \t]++Offset|Search[ \t]++Start|SOFTFLOAT|MIG[ \t]++EYE|LINE|FORCE[ \t]++CTRL)\b.*",
    re.I | re.S,
)
_STOPS = re.compile(
    rb"(?:(Weave|Track|Touch[ \t]++Offset|SOFTFLOAT|MIG[ \t]++EYE|FORCE[ \t]++CTRL)[ \t]++End|(Search)[ \t]++End)\b.*",
    re.I | re.S,
)
_MAY_DISPLACE = re.compile(
    rb"OFFSET|TRACK|TOUCH|SEARCH|SOFT|WEAVE|FORCE|SENS|LINE|COORD|GROUP|TOOL|FRAME|PREG|POS", re.I
)
_WAIT = re.compile(
    rb"PAUSE|WAIT[ \t]*+((?:[0-9]{1,9}+(?:\.[0-9]{0,9}+)?+|\.[0-9]{1,9}+))[ \t]*+(?:\([ \t]*+sec[ \t]*+\))?+",
    re.I,
)
_WAIT_FOR = re.compile(rb"WAIT\b|UALM[ \t]*+\[", re.I)
"""What may wait; a user alarm (UALM) pauses the program or not, by a setting of the controller."""
SHORTEST_WAIT_S = 0.2
"""A WAIT of as much is not over when the robot, which the program is ahead of, is in the corner."""
_OTHER = re.compile(
    rb"(?:(?:DO|RO|GO|AO|SO|UO|WO|F|M|SR|AR|DI|RI|GI|AI|TIMER|ENC|VR|PL)[ \t]*+\[.*\][ \t]*+=.*"
    rb"|MESSAGE[ \t]*+\[.*|PAYLOAD\b.*"
    rb"|COL[ \t]++(?:DETECT|GUARD).*|(?:Arc|Weld)[ \t]++(?:Start|End|Stabilize).*|SPOT\[.*"
    rb"|(?:TOOL_)?+OFFSET[ \t]++CONDITION.*|VOFFSET[ \t]++CONDITION.*|SKIP[ \t]++CONDITION.*"
    rb"|VISION[ \t]++(?:RUN_FIND|SET_REFERENCE|GET_OFFSET)\b.*|TC_ONLINE\b.*|MONITOR[ \t]++END\b.*"
    rb"|(?:UN)?+LOCK[ \t]++PREG|RSR\[.*|DIAG_REC\[.*|PRINT\b.*|STRLEN\b.*|Sample[ \t]++(?:Start|End).*"
    rb"|\$(?:WAITTMOUT|WAITRELEASE|RMT_MASTER)[ \t]*+=.*)",
    re.I | re.S,
)


_PLAIN_HEAD = re.compile(rb"[ \t]*+[JLA][ \t]++P[ \t]*+\[[ \t]*+([0-9]{1,9}+)")
MOST_KNOWN = 1 << 12
"""Forms of motions that are kept while a program is read."""


def parse_statements(statements: Iterable[NumberedStatement]) -> list[TpStatement]:
    """What each does; motions that are alike but for the number of their point are the same object."""
    known: dict[tuple[bytes, int, bytes], TpStatement] = {}
    parsed = []
    for one in statements:
        head = _PLAIN_HEAD.match(one.text)
        if head is None:
            parsed.append(parse_statement(one))
            continue
        first, last = head.span(1)
        key = one.text[:first], last, one.text[last:]
        found = known.get(key)
        if found is None:
            found = parse_statement(one)
            if len(known) < MOST_KNOWN:
                known[key] = found
        parsed.append(found)
    return parsed


def parse_statement(statement: NumberedStatement) -> TpStatement:
    """What a numbered statement of /MN does."""
    text = statement.text
    remark = _REMARK.match(text)
    if remark is not None:
        at = statement.start + remark.start(1)
        shown = text[remark.end() :].decode("latin-1").strip()
        return TpRemark(shown, at, statement.stop)
    motion = parse_motion(text)
    if motion is not None:
        return motion
    if is_motion_like(text):
        return StatementNotRead(moves=True)
    return _parse(text.strip())


def _parse(text: bytes) -> TpStatement:
    if not text:
        return OtherStatement()
    simple = _parse_simple(text)
    if simple is not None:
        return simple
    if (found := _IF.fullmatch(text)) is not None:
        return _conditional(found[1])
    if (found := _CASE.fullmatch(text)) is not None:
        return ConditionalStatement(None, _action(found[1]))
    if (found := _FOR.fullmatch(text)) is not None:
        return LoopStart(int(found[1]))
    return _parse_settings(text)


_WORDS: dict[bytes, TpStatement] = {b"ELSE": BlockElse(), b"ENDIF": BlockEnd(), b"ENDFOR": LoopEnd()}


def _parse_simple(text: bytes) -> TpStatement | None:
    if text.upper() in _WORDS:
        return _WORDS[text.upper()]
    if _END.fullmatch(text):
        return ProgramEnd()
    if (found := _LABEL.fullmatch(text)) is not None:
        return LabelStatement(int(found[1]))
    if (found := _JUMP.fullmatch(text)) is not None:
        return JumpStatement(None if found[1] is None else int(found[1]))
    if (found := _CALL.fullmatch(text)) is not None:
        return ProgramCall(found[2].decode("latin-1"))
    if (found := _FRAME.fullmatch(text)) is not None:
        if found[2] not in (None, b"1"):
            return OtherStatement()
        return FrameSelection(found[1].upper() == b"UTOOL_NUM", _expression(found[3]))
    if _ASSIGNED.match(text):
        return _assignment(text)
    return None


def _parse_settings(text: bytes) -> TpStatement:
    if (found := _TIMEOUT.fullmatch(text)) is not None:
        return TimeoutStatement(None if found[1] is None else int(found[1]))
    if (found := _OVERRIDE.fullmatch(text)) is not None:
        return OverrideStatement(None if found[1] is None else float(found[1]))
    if _LIMIT.fullmatch(text):
        return SpeedChange()
    if (found := _STOPS.fullmatch(text)) is not None:
        return DisplacementSwitch(_name(found[1] or found[2]), False)
    if (found := _STARTS.fullmatch(text)) is not None:
        return DisplacementSwitch(_name(found[1]), True)
    if (found := _WAIT.fullmatch(text)) is not None:
        return WaitStatement(found[1] is None or float(found[1]) >= SHORTEST_WAIT_S)
    if _WAIT_FOR.match(text):
        return WaitStatement(False)
    return (
        OtherStatement()
        if _OTHER.fullmatch(text)
        else StatementNotRead(
            displaces=_MAY_DISPLACE.search(text) is not None, slows=_MAY_SLOW.search(text) is not None
        )
    )


def _name(words: bytes) -> bytes:
    return b" ".join(words.upper().split()).removesuffix(b" START")


def _action(text: bytes) -> TpStatement:
    """A statement after a condition; one that only a line of its own may be is not read there."""
    one = _parse(text.strip())
    blocks = (BlockStart, BlockElse, BlockEnd, LoopStart, LoopEnd, LabelStatement)
    return StatementNotRead() if isinstance(one, blocks) or is_motion_like(text) else one


def _conditional(text: bytes) -> TpStatement:
    if _THEN.fullmatch(text):
        return BlockStart()
    depth = 0
    for at, letter in enumerate(text):
        depth += (letter in b"([") - (letter in b")]")
        if letter == ord(",") and depth == 0:
            found = _CONDITION.fullmatch(text[:at])
            condition = None
            if found is not None:
                condition = (_operand(found[1]), found[2], _operand(found[3]))
            return ConditionalStatement(condition, _action(text[at + 1 :]))
    return StatementNotRead()


def _assignment(text: bytes) -> TpStatement:
    found = _ASSIGNMENT.fullmatch(text)
    if found is None:
        return StatementNotRead()
    word, value = found[1].upper(), found[3]
    index = _INDEX.fullmatch(found[2])
    number = None if index is None else int(index[1])
    if word == b"R" and number is not None and not _POINT_READ.search(value):
        return RegisterAssignment(number, _expression(value))
    read = tuple(None if one[1] is None else int(one[1]) for one in _POINT_READ.finditer(value))
    known = -1 if number is None else number
    return PositionUse(
        assigned=(number,) if word == b"P" else (),
        read=read,
        reads_place=_PLACE.search(value) is not None,
        is_tool=word == b"UTOOL",
        frame=known if word in (b"UFRAME", b"UTOOL") else None,
        register=known if word == b"R" else None,
    )


def _expression(text: bytes) -> RegisterExpression:
    found = _EXPRESSION.fullmatch(text)
    if found is None:
        return RegisterExpression(None)
    if found[2] is None:
        return RegisterExpression(_operand(found[1]))
    return RegisterExpression(_operand(found[1]), found[2].upper(), _operand(found[3]))


def _operand(text: bytes) -> Operand:
    register = _ONE_REGISTER.fullmatch(text)
    if register is not None:
        return RegisterOperand(int(register[1]))
    if b"[" in text:
        return None
    return float(b"".join(text.strip(b"() \t").split()))
