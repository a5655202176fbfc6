"""The tokens of RAPID: names, numbers, strings, signs; comments run from ! to the end of the line."""

from __future__ import annotations

import re
from typing import NamedTuple

_TOKEN = re.compile(
    rb"(?P<number>(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+)(?![A-Za-z0-9_.])"
    rb"|(?P<name>[A-Za-z][A-Za-z0-9_]*+)"
    rb'|(?P<text>"(?:[^"\r\n]|"")*+")'
    rb"|(?P<sign>:=|<>|<=|>=|[-+*/=<>,;:\\()\[\]{}.?%])"
    rb"|(?P<other>[^ \t\r\n\f!;]++)",
)
_BLANK = re.compile(rb"[ \t\r\n\f]++")
_COMMENT = re.compile(rb"![^\r\n]*+")
_HEADER = re.compile(rb"\s*+%%%.*?%%%", re.S)
NUMBER, NAME, TEXT, SIGN, OTHER, END = "number", "name", "text", "sign", "other", "end"


class Token(NamedTuple):
    """``text``: its bytes; of a name in capitals."""

    kind: str
    text: bytes
    start: int
    stop: int


class Tokens:
    """The tokens of ``raw`` one after the other; ``next`` is the one that comes, ``before`` where the last one ended.

    ``comments``: (start, stop) of those that were passed, in order.
    """

    def __init__(self, raw: bytes, at: int = 0) -> None:
        self.raw = raw
        header = _HEADER.match(raw[: 1 << 16], at)
        self.comments: list[tuple[int, int]] = []
        self.before = at
        self.next = self._at(header.end() if header else at)

    def take(self) -> Token:
        """The next token, which is passed."""
        token = self.next
        self.before = token.stop
        self.next = self._at(token.stop)
        return token

    def _at(self, at: int) -> Token:
        raw = self.raw
        while True:
            blank = _BLANK.match(raw, at)
            if blank is not None:
                at = blank.end()
            comment = _COMMENT.match(raw, at)
            if comment is None:
                break
            self.comments.append(comment.span())
            at = comment.end()
        found = _TOKEN.match(raw, at)
        if found is None:
            stop = min(at + 1, len(raw))
            return Token(END if at >= len(raw) else OTHER, raw[at:stop], at, stop)
        kind = found.lastgroup or OTHER
        text = found[0]
        return Token(kind, text.upper() if kind == NAME else text, at, found.end())

    def jump(self, at: int) -> None:
        """Goes on at a later byte, with no comment between."""
        self.before, self.next = at, self._at(at)
