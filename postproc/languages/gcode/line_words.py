"""What the lines of controls with addresses of several letters have in common: words, and expressions in them."""

from __future__ import annotations

import math
import re
from abc import abstractmethod

from postproc.languages.gcode.control import LexedLine
from postproc.languages.gcode.sinumerik_expression import constant, expression_end, is_open
from postproc.languages.gcode.words import How, key, value_note

ADDRESS = re.compile(rb"([A-Za-z])([0-9]{0,3})[ \t]*=[ \t]*")
_WORD = re.compile(rb"([A-Za-z])[ \t]*((?:[-+][ \t]*)?(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?)", re.I)


class LineWords:
    """A line that is taken apart, token by token; ``evaluated``: expressions that are no constants are noted."""

    evaluated = True

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.words: list[tuple[int, int, int, int, float, int]] = []
        self.notes: list[tuple[str, str]] = []

    def note(self, kind: str, text: bytes) -> None:
        self.notes.append((kind, text.decode("latin-1")))

    def word(self, at: int, address: int, start: int, stop: int, value: float, how: int) -> None:
        self.words.append((at, address, start, stop, value, how))

    @abstractmethod
    def token(self, place: int) -> int:
        """Reads what starts at ``place``; where it ends."""

    def lexed(self, head: re.Match[bytes] | None, place: int, deleted: bool) -> LexedLine:
        """The line, whose ``head`` is passed, from ``place`` on."""
        text = self.text
        while place < len(text):
            place = place + 1 if text[place] in b" \t\x0b\x0c" else self.token(place)
        if self.words and is_open(text):
            self.note("unknown", text[head.end() if head else 0 :].strip())
        return LexedLine(self.words, self.notes, deleted)

    def plain_word(self, place: int) -> int | None:
        """Reads a letter and its number; where it ends, None where it is none."""
        plain = _WORD.match(self.text, place)
        if plain is None:
            return None
        value = constant(plain[2])
        how = How.NUMBER if b"." in plain[2] else How.INTEGER
        self.word(place, key(plain[1].decode().upper()), plain.start(2), plain.end(), value, how)
        return plain.end()

    def expression_word(self, place: int, address: int, at: int) -> int:
        """Reads what an address has after its equals sign, from ``at`` on; where it ends."""
        close = expression_end(self.text, at)
        literal = self.text[at:close].rstrip()
        number = constant(literal)
        known = not math.isnan(number)
        if not known and self.evaluated:
            self.note("value", value_note(self.words, address, How.NUMBER, literal))
        self.word(place, address, at, at + len(literal), number, How.NUMBER if known else How.UNREAD)
        return max(close, at + 1)
