"""Statements of RAPID: they end with a semicolon and may run over several lines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from postproc.verification.stated_texts import NONE, MovingLines, Statements

_PART = re.compile(rb"\"[^\"\n]*+\"?|(!)[^\n]*+|(;)|(\n)")
_LIST = rb"\[[^\[\]]*+\]"
_INLINE = re.compile(rb"(MOVE[LJ]) ?\[" + rb",".join([_LIST] * 4) + rb"\] ?,(.*+)\Z", re.IGNORECASE)
_VERB = re.compile(
    rb"(MOVE(?:L|J|C)|MOVE[A-Z]*|TRIGG[A-Z]*|ARC[A-Z]*|SEARCH[A-Z]*)(?=[ \[\\*])", re.IGNORECASE
)
_NAME = re.compile(rb"(?<![A-Za-z0-9_.\\])[A-Za-z_][A-Za-z0-9_]*+(?![ ]*\()")
_POINT = re.compile(
    rb"(?:(?:LOCAL|TASK|CONST|PERS|VAR|ROBTARGET|POSE|POS|ORIENT|NUM)[ ])*+([A-Z_][A-Z0-9_]*+)"
    rb" ?(?:\{[^}]*+\}|\.[A-Z0-9_]++)*+ ?:=",
    re.IGNORECASE,
)  # fmt: skip
_NUMBER = re.compile(rb"(?<![A-Za-z0-9_.])[-+]?[0-9.]++(?:E[-+]?[0-9]++)?", re.IGNORECASE)
_HEADER = re.compile(
    rb"(?:LOCAL )?(?:MODULE|PROC|FUNC|TRAP|END[A-Z]*+|ELSE|ELSEIF|IF|FOR|WHILE|TEST|CASE|DEFAULT|ERROR|UNDO|BACKWARD)\b"
    rb"|%%%"
)
_OPEN, _CLOSE = b"[({", b"])}"


class RapidStatements:
    """RAPID as a ``StatementForm``."""

    flowing = frozenset([b"FINE", b"Z0"])

    def read(self, files: Sequence[list[bytes]], lines: MovingLines) -> list[Statements]:
        found, names = Statements(), set[bytes]()
        for text, first, last in _statements(files[0]):
            moving = any(number in lines.moving for number in range(first, last + 1))
            motion = _motion(text) if moving else None
            if motion is None:
                found.add(text, first)
            else:
                names |= motion[1]
                found.add_motion(*motion, first)
        _state_points(found, names)
        return [found]

    def words(self, text: bytes) -> frozenset[bytes]:
        return frozenset(word.strip() for word in text.upper().split(b","))

    def insertable(self, words: frozenset[bytes]) -> bool:
        return b"MOVE" in words

    def opens_block(self, _text: bytes) -> bool:
        return False


def _statements(file: list[bytes]) -> Iterator[tuple[bytes, int, int]]:
    """Statements and comments with one blank between their words; the first and last line of each."""
    pending: list[bytes] = []
    first = 0
    for number, line in enumerate(file, 1):
        stripped = line.strip()
        if not pending and stripped.endswith(b";") and stripped.count(b";") == 1 and b"!" not in stripped:
            yield b" ".join(stripped[:-1].split()), number, number
            continue
        last = 0
        for part in _PART.finditer(line):
            if part[1] is None and part[2] is None:
                continue
            text = line[last : part.start()]
            if text.strip() and not pending:
                first = number
            pending.append(text)
            last = part.end()
            if part[2] is not None:
                text = b" ".join(b" ".join(pending).split())
                if text:
                    yield text, first, number
                pending = []
            else:
                yield b" ".join(part[0].split()), number, number
        rest = line[last:].strip()
        if rest and not pending:
            first = number
        if rest:
            pending.append(rest)
            if _alone(pending):
                yield b" ".join(b" ".join(pending).split()), first, number
                pending = []
        if not any(one.strip() for one in pending):
            pending = []
    if pending:
        yield b" ".join(b" ".join(pending).split()), first, len(file)


def _alone(pending: list[bytes]) -> bool:
    """Whether these are words that end with their line: MODULE, PROC, IF .. THEN, ENDIF."""
    text = b" ".join(pending).strip().upper()
    return _HEADER.match(text) is not None and (not text.startswith(b"IF") or text.endswith(b"THEN"))


def _motion(text: bytes) -> tuple[bytes, frozenset[bytes]] | None:
    """The words of a motion without its targets, and the names in these."""
    inline = _INLINE.match(text)
    if inline is not None:
        return b"MOVE," + inline[2].replace(b" ", b""), NONE
    verb = _VERB.match(text)
    if verb is None:
        return None
    arguments = _arguments(text[verb.end() :])
    name = verb[1].upper()
    places = 2 if name.endswith(b"C") or name.startswith((b"MOVEC", b"TRIGGC", b"ARCC")) else 1
    first = 0
    while first < len(arguments) and arguments[first].startswith(b"\\"):
        first += 1
    targets, rest = arguments[first : first + places], arguments[:first] + arguments[first + places :]
    names = {one.upper() for target in targets for one in _NAME.findall(target)} - {b"E"}
    word = b"MOVE" if name in (b"MOVEL", b"MOVEJ", b"MOVEC") else name
    return b",".join([word, *(one.replace(b" ", b"") for one in rest)]), frozenset(names)


def _arguments(text: bytes) -> list[bytes]:
    """What commas outside of brackets and strings separate."""
    found, depth, last, quoted = [], 0, 0, False
    for at, sign in enumerate(text):
        if sign == ord('"'):
            quoted = not quoted
        elif quoted:
            continue
        elif sign in _OPEN:
            depth += 1
        elif sign in _CLOSE:
            depth -= 1
        elif sign == ord(",") and depth == 0:
            found.append(text[last:at].strip())
            last = at + 1
    return [*found, text[last:].strip()]


def _state_points(statements: Statements, names: set[bytes]) -> None:
    """Statements of points that motions lead to are without their numbers."""
    for at, text in enumerate(statements.texts):
        if b":=" in text and names and not text.startswith(b"\x01"):
            point = _POINT.match(text)
            if point is not None and point[1].upper() in names:
                statements.points[at] = point[1].upper()
                statements.texts[at] = text[: point.end()] + _NUMBER.sub(b"0", text[point.end() :])
