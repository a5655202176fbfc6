"""Statements of KRL: one a line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from postproc.verification.stated_texts import NONE, MovingLines, Statements

_INLINE = re.compile(
    rb"[ \t]*+S?(?:PTP|LIN|CIRC|PL)(?:_REL)?[ \t]*+(?:\{[^{};\"]*+\}[ \t]*+,?+[ \t]*+)++([^{};\"\r]*+)\r?\Z",
    re.IGNORECASE,
)
"""A motion to numbers: what is after them."""

_VERB = re.compile(rb"[ \t]*+S?(?:PTP|LIN|CIRC|PL)(?:_REL)?(?![A-Z0-9_$])", re.IGNORECASE)
_OF_TARGET = re.compile(
    rb"\A[ \t,]*+CA(?![A-Z0-9_$]).*?(?=(?<![A-Z0-9_$])C_[A-Z]{3}(?![A-Z0-9_$])|(?<![A-Z0-9_$])WITH\b|\Z)"
    rb"|\A[ \t]*+#(?:BASE|TOOL)\b",
    re.IGNORECASE,
)  # fmt: skip
"""The angle of an arc, and the reference of a relative target."""

_STOPS = re.compile(
    rb"(\{[^{}]*+(?:\{[^{}]*+\}[^{}]*+)*+\})|\"[^\"]*+\"?|(;)|"
    rb"((?<![A-Z0-9_$])(?:C_(?:DIS|VEL|ORI|PTP|SPL)|WITH|CA)(?![A-Z0-9_$])|#(?:BASE|TOOL)\b)",
    re.IGNORECASE,
)  # fmt: skip
_NAME = re.compile(rb"(?<![A-Za-z0-9_$#.])[A-Za-z_$][A-Za-z0-9_$]*+")
_POINT = re.compile(
    rb"[ \t]*+(?:(?:GLOBAL|DECL|CONST|E6POS|E3POS|POS|FRAME|E6AXIS)[ \t]++)*+([A-Z_][A-Z0-9_$]*+)"
    rb"[ \t]*+(?:\[[^\]]*+\]|\.[A-Z0-9_$]++)*+[ \t]*+=",
    re.IGNORECASE,
)  # fmt: skip
_KEYED = re.compile(
    rb"(?<![A-Z0-9_$])([XYZABC])[ \t]*+=?[ \t]*+[-+]?[ \t]*+[0-9.]++(?:E[-+]?[0-9]++)?(?![A-Z0-9_$.])",
    re.IGNORECASE,
)
_SPLINE = re.compile(rb"(?:PTP_)?SPLINE\b", re.IGNORECASE)


class KrlStatements:
    """KRL as a ``StatementForm``."""

    flowing = frozenset([b"C_DIS", b"C_PTP", b"C_SPL"])

    def read(self, files: Sequence[list[bytes]], lines: MovingLines) -> list[Statements]:
        names: set[bytes] = set()
        first = _motions(files[0], lines, names)
        found = [first, *(_others(one) for one in files[1:])]
        for statements in found:
            _state_points(statements, names)
        return found

    def words(self, text: bytes) -> frozenset[bytes]:
        return frozenset(text.upper().replace(b",", b" ").split())

    def insertable(self, words: frozenset[bytes]) -> bool:
        return not any(word.startswith(b";") for word in words)

    def opens_block(self, text: bytes) -> bool:
        return _SPLINE.match(text) is not None


def _motions(file: list[bytes], lines: MovingLines, names: set[bytes]) -> Statements:
    """``names`` takes up those of points that motions lead to, capitals."""
    found, moving = Statements(), lines.moving
    known: dict[bytes, bytes] = {}
    for number, line in enumerate(file, 1):
        if number in moving:
            inline = _INLINE.match(line)
            if inline is not None:
                rest = inline[1]
                words = known.get(rest)
                if words is None:
                    words = known[rest] = b" ".join(_OF_TARGET.sub(b"", rest).split())
                found.add_motion(words, NONE, number)
                continue
            verb = _VERB.match(line)
            if verb is not None:
                target, words = _divided(line[verb.end() :])
                operands = {name.upper() for name in _NAME.findall(_KEYED.sub(b"", target))}
                operands -= {b"X", b"Y", b"Z", b"A", b"B", b"C", b"S", b"T"}
                names |= operands
                found.add_motion(words, frozenset(operands), number)
                continue
        text = line.strip()
        if text:
            found.add(text, number)
    return found


def _divided(text: bytes) -> tuple[bytes, bytes]:
    """The target that a motion names, without what it states in numbers, and the words after it."""
    target, last = [], 0
    for stop in _STOPS.finditer(text):
        if stop[1] is not None:
            target.append(text[last : stop.start()])
            last = stop.end()
        elif stop[2] is not None or stop[3] is not None:
            target.append(text[last : stop.start()])
            rest = _OF_TARGET.sub(b"", text[stop.start() :])
            return b" ".join(target), b" ".join(rest.split())
    return b" ".join([*target, text[last:]]), b""


def _others(file: list[bytes]) -> Statements:
    found = Statements()
    for number, line in enumerate(file, 1):
        text = line.strip()
        if text:
            found.add(text, number)
    return found


def _state_points(statements: Statements, names: set[bytes]) -> None:
    """Statements of points that motions lead to are without the numbers of places."""
    if not names:
        return
    texts = statements.texts
    for at, text in enumerate(texts):
        if b"=" in text and not text.startswith(b"\x01"):
            point = _POINT.match(text)
            if point is not None and point[1].upper() in names:
                statements.points[at] = point[1].upper()
                texts[at] = _KEYED.sub(rb"\1", text)
