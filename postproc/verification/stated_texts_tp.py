"""Statements of Fanuc TP listings: numbered lines, attributes before them and points after them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from postproc.verification.stated_texts import MovingLines, Statements

_SECTION = re.compile(rb"/(PROG|ATTR|APPL|MN|POS|END)\b", re.IGNORECASE)
_COUNTED = re.compile(rb"(LINE_COUNT[ \t]*+=[ \t]*+)[0-9]++", re.IGNORECASE)
_NUMBERED = re.compile(rb"[ \t]*+([0-9]*+)[ \t]*+:")
_MOTION = re.compile(rb"[ \t]*+[LCJAS][ \t]++P[ \t]*+\[", re.IGNORECASE)
_VERB = re.compile(rb"\A[ \t]*+[LCJAS]\b", re.IGNORECASE)
_OPERAND = re.compile(rb"(?<![A-Z])P[ \t]*+\[[ \t]*+([0-9]++)[^\[\]]*+\]", re.IGNORECASE)
_COORDINATE = re.compile(rb"\b([XYZWPR])[ \t]*+=[ \t]*+[-+]?[ \t]*+[0-9.*]++", re.IGNORECASE)
_POINT = re.compile(rb"P[ \t]*+\[[ \t]*+([0-9]++)", re.IGNORECASE)


class TpStatements:
    """TP as a ``StatementForm``."""

    flowing = frozenset([b"FINE", b"CNT100"])

    def read(self, files: Sequence[list[bytes]], lines: MovingLines) -> list[Statements]:
        found = Statements()
        for text, first, last in _statements(files[0]):
            moving = any(number in lines.moving for number in range(first, last + 1))
            if moving and _MOTION.match(text):
                rest = _OPERAND.sub(b" ", _VERB.sub(b"", text))
                operands = frozenset(b"P%d" % int(one) for one in _OPERAND.findall(text))
                found.add_motion(b" ".join(rest.replace(b";", b" ").split()), operands, first)
                continue
            point = _POINT.match(text)
            if point is not None and text.endswith(b"}"):
                found.points[len(found.texts)] = b"P%d" % int(point[1])
                text = _COORDINATE.sub(rb"\1", text)
            found.add(text, first)
        return [found]

    def words(self, text: bytes) -> frozenset[bytes]:
        return frozenset(text.upper().split())

    def insertable(self, words: frozenset[bytes]) -> bool:
        return bool(words)

    def opens_block(self, _text: bytes) -> bool:
        return False


def _statements(file: list[bytes]) -> Iterator[tuple[bytes, int, int]]:
    """The statements without their numbers; the first and last line of each."""
    section, pending, first = b"", list[bytes](), 0
    for number, line in enumerate(file, 1):
        head = _SECTION.match(line)
        if head is not None:
            yield b" ".join(line.split()), number, number
            section = head[1].upper()
            continue
        if section == b"MN":
            numbered = _NUMBERED.match(line)
            text = line[numbered.end() :] if numbered is not None else line
            if numbered is not None and not numbered[1] and pending:
                pending.append(text)
            else:
                pending, first = [text], number
            if text.rstrip().endswith(b";"):
                text = b" ".join(b" ".join(pending).split())
                pending = []
                if text != b";":
                    yield text, first, number
            continue
        text = line.strip()
        if not text:
            continue
        if section == b"POS":
            if not pending:
                first = number
            pending.append(text)
            if text.endswith(b"};"):
                yield b" ".join(b" ".join(pending).split())[:-1], first, number
                pending = []
            continue
        yield _COUNTED.sub(rb"\1", text), number, number
    if pending:
        yield b" ".join(b" ".join(pending).split()), first, len(file)
