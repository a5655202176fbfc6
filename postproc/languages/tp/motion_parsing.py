"""Motions of TP: type, points, speed, termination and options; every word is known, or the motion is not read."""

from __future__ import annotations

import re
from dataclasses import dataclass

from postproc.languages.tp.tp_statements import Operand, PointReference, RegisterOperand, TpMove

_BLANK = re.compile(rb"[ \t]*+")
_START = re.compile(rb"[ \t]*+(?![AS]R[ \t]*+\[)([JLCAS])(?=[ \t]*+(?:P|PR|AR|R)[ \t]*+\[)", re.I)
_POINT = re.compile(rb"[ \t]*+P[ \t]*+\[[ \t]*+([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+\]", re.I)
_OTHER_POINT = re.compile(rb"[ \t]*+(PR|P|AR|R)[ \t]*+\[(?:[^\[\]]*+(?:\[[^\[\]]*+\])?+)*+\]", re.I)
_UNIT = rb"((?:mm/sec|cm/min|inch/min|deg/sec|msec|sec|%)(?![A-Z0-9_.%/]))"
_SPEED = re.compile(rb"[ \t]*+([0-9]++\.?+[0-9]*+|\.[0-9]++)[ \t]*+" + _UNIT, re.I)
_REGISTER_SPEED = re.compile(
    rb"[ \t]*+(A?+R)\[[ \t]*+([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+\][ \t]*+" + _UNIT, re.I
)
_NAMED_SPEED = re.compile(rb"[ \t]*+(WELD_SPEED|max_speed|DISP_SPEED)\b", re.I)
_FINE = re.compile(rb"[ \t]*+FINE\b", re.I)
_ROUND = re.compile(rb"[ \t]*+(CNT|CR)[ \t]*+([0-9]{1,9}+)(?![A-Z0-9_.\[])", re.I)
_REGISTER_ROUND = re.compile(rb"[ \t]*+(CNT|CR)[ \t]*+A?+R\[[^\]]*+\]", re.I)

_REGISTER = rb"\[[^\[\]]*+\]"
_ACTION = (
    rb"(?:CALL[ \t]++[A-Z_][A-Z0-9_]*+(?:[ \t]*+\([^()]*+\))?+|POINT_LOGIC"
    rb"|[A-Z]{1,2}"
    + _REGISTER
    + rb"[ \t]*+=[ \t]*+(?:ON|OFF|PULSE(?:[ \t]*+,[ \t]*+[0-9.]++[ \t]*+sec)?+|[0-9]++|A?+R"
    + _REGISTER
    + rb"))"
)
_ALTERING = re.compile(rb"CALL[ \t]++(?P<called>[A-Z_][A-Z0-9_]*+)|POINT_LOGIC|A?+R[ \t]*+\[", re.I)
_CARRIED = re.compile(
    rb"[ \t]*+(?:ACC[ \t]*+(?:[0-9]++|A?+R" + _REGISTER + rb")|PTH|PSPD[ \t]*+[0-9]++)(?![A-Z0-9_.])", re.I
)
_PACE = re.compile(rb"PSPD[ \t]*+([0-9]++)", re.I)
_WRIST = re.compile(rb"[ \t]*+Wjnt\b", re.I)
_OWN = re.compile(
    rb"[ \t]*+(?:(?:TB|TA)[ \t]*+[0-9]*+\.?+[0-9]*+[ \t]*+sec[ \t]*+,[ \t]*+(?P<at_time>" + _ACTION
    + rb")|DB[ \t]*+-?+[0-9]*+\.?+[0-9]*+[ \t]*+mm[ \t]*+,[ \t]*+(?P<at_place>" + _ACTION + rb")"
    + rb"|(?:Arc|Weld)[ \t]++(?:Start|End)[ \t]*+(?:" + _REGISTER + rb")?+|SPOT" + _REGISTER + rb"|BREAK\b)",
    re.I,
)  # fmt: skip
_LINEAR = re.compile(
    rb"[ \t]*+(RT|AP)_LD[ \t]*+(?:[0-9]++\.?+[0-9]*+(?:[ \t]*+mm)?+|A?+R" + _REGISTER + rb")(?![A-Z0-9_.])",
    re.I,
)
"""The first or the last part of a motion is a line, whatever the corners are; the distance is at least as stated."""
_DISPLACED = re.compile(
    rb"[ \t]*+(Offset|Tool_Offset|VOFFSET|INC|LOCK_PREG)\b(?:[ \t]*+,[ \t]*+(?:PR|VR|P)"
    + _REGISTER
    + rb")?+",
    re.I,
)
_COORDINATED = re.compile(
    rb"[ \t]*+(COORD(?:" + _REGISTER + rb")?+|RTCP|MROT|(?:Ind\.)?+EVi?+[ \t]*+[0-9]++[ \t]*+%)", re.I
)
_SKIP = re.compile(
    rb"[ \t]*+Skip[ \t]*+,[ \t]*+LBL\[[ \t]*+([0-9]{1,9}+)[ \t]*+(?::[^\]]*+)?+\](?:[ \t]*+,[ \t]*+PR" + _REGISTER
    + rb"[ \t]*+=[ \t]*+[LJ]POS)?+",
    re.I,
)  # fmt: skip
_MM = {b"mm/sec": 1.0, b"cm/min": 10 / 60, b"inch/min": 25.4 / 60}


@dataclass(slots=True)
class _Options:
    carried: list[bytes]
    own: bool = False
    alters: bool = False
    called: str = ""
    paced: bool = False
    relative: bool = False
    wrist: bool = False
    problem: tuple[str, str] | None = None
    skip: int | None = None
    linear: frozenset[bytes] = frozenset()


def parse_motion(text: bytes) -> TpMove | None:
    """The motion in the text of a statement; None where it is none that is known."""
    head = _START.match(text)
    if head is None or head[1] in b"Ss":
        return None
    form, at = head[1].upper(), head.end()
    points: list[PointReference] = []
    options = _Options([])
    for _ in range(2 if form == b"C" else 1):
        if points:
            at = _read_options(text, at, options)
        point, at = _point(text, at)
        if point is None:
            return None
        points.append(point)
    speed = _speed(text, at)
    if speed is None:
        return None
    value, unit, end = speed
    shown = text[at:end].strip()
    at = end
    corner = _corner(text, at)
    if corner is None:
        return None
    termination = text[at : corner[2]].strip()
    at = _read_options(text, corner[2], options)
    if text[at:].strip():
        return None
    if (unit == b"%") != (form == b"J") and unit not in (b"sec", b"msec", b""):
        return None
    reason = next((point.reason for point in points if point.reason), "")
    problem = ("FTP002", reason) if reason else options.problem
    return TpMove(
        form, tuple(points), shown, value, unit, termination, corner[:2], b" ".join(options.carried), options.own,
        options.wrist, problem, options.skip, head.span(1), options.alters, options.relative,
        options.called, options.paced, options.linear,
    )  # fmt: skip


def is_motion_like(text: bytes) -> bool:
    """Whether a statement starts as a motion does."""
    return _START.match(text) is not None


def _point(text: bytes, at: int) -> tuple[PointReference | None, int]:
    found = _POINT.match(text, at)
    if found is not None:
        return PointReference(found.span(1)), found.end()
    found = _OTHER_POINT.match(text, at)
    if found is None:
        return None, at
    if found[1].upper() == b"PR":
        reason = "its target is a position register, which only the controller knows"
    else:
        reason = "the number of its point is computed where the program runs"
    return PointReference((-1, -1), reason), found.end()


def _speed(text: bytes, at: int) -> tuple[Operand, bytes, int] | None:
    """The value in mm/s where the unit is a speed of the TCP, the unit, and where it ends."""
    found = _SPEED.match(text, at)
    if found is not None:
        unit = found[2].lower()
        return float(found[1]) * _MM.get(unit, 1.0), unit, found.end()
    found = _REGISTER_SPEED.match(text, at)
    if found is not None:
        unit = found[3].lower()
        known = found[1].upper() == b"R" and unit == b"mm/sec"
        return RegisterOperand(int(found[2])) if known else None, unit, found.end()
    found = _NAMED_SPEED.match(text, at)
    return None if found is None else (None, b"", found.end())


def _corner(text: bytes, at: int) -> tuple[bytes, float | None, int] | None:
    found = _FINE.match(text, at)
    if found is not None:
        return b"FINE", 0.0, found.end()
    found = _ROUND.match(text, at)
    if found is not None:
        return found[1].upper(), float(found[2]), found.end()
    found = _REGISTER_ROUND.match(text, at)
    return None if found is None else (found[1].upper(), None, found.end())


def _read_options(text: bytes, at: int, options: _Options) -> int:
    """Where the options that are known end."""
    while True:
        blank = _BLANK.match(text, at)
        after = at if blank is None else blank.end()
        found = _CARRIED.match(text, after)
        if found is not None:
            options.carried.append(found[0].strip())
            pace = _PACE.fullmatch(options.carried[-1])
            options.paced |= pace is not None and int(pace[1]) != 100
        elif (found := _WRIST.match(text, after)) is not None:
            options.wrist = True
            options.carried.append(found[0].strip())
        elif (found := _OWN.match(text, after)) is not None:
            options.own = True
            action = found["at_time"] or found["at_place"]
            if action is not None and (altering := _ALTERING.match(action)) is not None:
                options.alters = True
                options.called = (altering["called"] or b"").decode("latin-1") or options.called
        elif (found := _LINEAR.match(text, after)) is not None:
            options.own = True
            options.linear |= {found[1].upper()}
        elif (found := _DISPLACED.match(text, after)) is not None:
            name = found[1].decode("latin-1")
            options.relative |= name.upper() == "INC"
            options.problem = options.problem or ("FTP008", f"its target is displaced ({name})")
        elif (found := _COORDINATED.match(text, after)) is not None:
            name = found[1].decode("latin-1")
            options.problem = options.problem or (
                "FTP011",
                f"it is coordinated with another motion group ({name})",
            )
        elif (found := _SKIP.match(text, after)) is not None:
            options.skip = int(found[1])
            options.problem = options.problem or ("FTP013", "it may end before its target (Skip)")
        else:
            return at
        at = found.end()
