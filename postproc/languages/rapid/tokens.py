"""The tokens of RAPID: names, numbers, strings, signs; comments run from ! to the end of the line."""

from __future__ import annotations

import re
from collections.abc import Set
from typing import NamedTuple

_TOKEN = re.compile(
    rb"[ \t\r\n\f]*+(?:"
    rb"(?P<number>(?:0[xX][0-9A-Fa-f]++|0[oO][0-7]++|0[bB][01]++|(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+))(?![A-Za-z0-9_.])"
    rb"|(?P<name>[A-Za-z][A-Za-z0-9_]*+)"
    rb'|(?P<text>"(?:[^"\r\n]|"")*+")'
    rb"|(?P<sign>:=|<>|<=|>=|[-+*/=<>,;:\\|()\[\]{}.?%])"
    rb"|(?P<comment>![^\r\n]*+)|(?P<other>[^ \t\r\n\f!;]++)|(?P<end>))",
)
_HEADER = re.compile(rb"\s*+%%%.*?%%%", re.S)
NUMBER, NAME, TEXT, SIGN, OTHER, END = "number", "name", "text", "sign", "other", "end"
_COMMENT = "comment"


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
        while found := _TOKEN.match(raw, at):
            kind, at = found.lastgroup or OTHER, found.end()
            if kind == NAME:
                return Token(kind, found[kind].upper(), found.start(kind), at)
            if kind == END and at < len(raw):
                return Token(OTHER, raw[at : at + 1], at, at + 1)
            if kind != _COMMENT:
                return Token(kind, found[kind], found.start(kind), at)
            self.comments.append(found.span(kind))
        return Token(END, b"", at, at)

    def skip(self, start: int, words: Set[bytes]) -> set[bytes]:
        """Passes tokens to the semicolon that comes, or to before a name that is one of ``words``, at least one; gives
        the names from ``start`` on."""
        raw, first, match = self.raw, self.next.start, _TOKEN.match
        names: set[bytes] = set()
        at, stop = start, self.before
        while (found := match(raw, at)) and found.lastgroup != END:
            kind, after = found.lastgroup, found.end()
            if kind == _COMMENT:
                if after > first:  # it was not passed yet
                    self.comments.append(found.span(kind))
            else:
                if kind == NAME:
                    name = found[kind].upper()
                    if found.start(kind) > first and name in words:
                        break
                    names.add(name)
                stop = after
                if kind == SIGN and after > first and raw[after - 1 : after] == b";":
                    break
            at = after
        self.before, self.next = stop, self._at(stop)
        return names

    def jump(self, at: int) -> None:
        """Goes on at a later byte, with no comment between."""
        self.before, self.next = at, self._at(at)
