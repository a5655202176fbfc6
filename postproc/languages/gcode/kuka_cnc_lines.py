"""Lines of KUKA.CNC (G-code on a robot's own control) that are not plain words: # commands, assignments, flow."""

from __future__ import annotations

import re
from collections.abc import Mapping

from postproc.languages.gcode.control import LexedLine
from postproc.languages.gcode.line_words import ADDRESS, LineWords
from postproc.languages.gcode.sinumerik_expression import assigned_end, bracket_end
from postproc.languages.gcode.words import How, key

_HEAD = re.compile(rb"[ \t\x0b\x0c]*(?P<slash>/[ \t]*\d?[ \t]*)?(?:[Nn:][ \t]*\d+)?[ \t]*")
_COMMAND = re.compile(rb"#[ \t]*([A-Za-z]+)[ \t]*([A-Za-z]*)[ \t]*")
_FLOW = re.compile(
    rb"\$[ \t]*(IF|ENDIF|ELSE|ELSEIF|FOR|ENDFOR|WHILE|ENDWHILE|DO|ENDDO|GOTO|SWITCH|ENDSWITCH|CASE|BREAK|CONTINUE)",
    re.I,
)
_NAME = re.compile(rb"[A-Za-z_][A-Za-z_.][A-Za-z0-9_.]*")
_ASSIGNED = re.compile(rb"[ \t]*+=(?!=)[ \t]*+")
_BRACKETS = re.compile(rb"\[[^\[\]]*+\]")
_MOVES = re.compile(rb"(?<![A-Za-z])[GXYZABCIJKF][ \t]*+[-+]?+[ \t]*+[.\d=]", re.I)
_NUMBER = re.compile(rb"(?:[-+][ \t]*)?(?:\d+\.?\d*|\.\d+)")

WEIGHTS = frozenset(
    (100.0, 101.0, 102.0, 129.0, 130.0, 131.0, 132.0, 133.0, 134.0, 135.0, 136.0, 137.0, 231.0, 233.0, 234.0)
)
"""Codes of acceleration whose percentage follows without a letter."""

QUIET = frozenset(
    b"SLOPE MSG ERROR SET HSC DYN SPLINE CONTOUR COMP FILTER PSET FLUSH VELO EDM TIME STOP DIST FACTOR".split()
)
"""Commands that do not state where motions go."""


class KukaCncLines:
    """Takes lines apart.  names: a command -> the numbers of its codes."""

    def __init__(self, names: Mapping[bytes, tuple[float, ...]]) -> None:
        self._names = names

    def __call__(self, text: bytes) -> LexedLine:
        head = _HEAD.match(text)
        place = head.end() if head else 0
        return _KukaCncLine(text, self._names).lexed(
            None, place, head is not None and head["slash"] is not None
        )


class _KukaCncLine(LineWords):
    evaluated = False

    def __init__(self, text: bytes, names: Mapping[bytes, tuple[float, ...]]) -> None:
        super().__init__(text)
        self.names = names

    def token(self, place: int) -> int:
        text = self.text
        if (command := _COMMAND.match(text, place)) is not None:
            self.command(place, command)
            return len(text)
        if (flow := _FLOW.match(text, place)) is not None:
            name = flow[1].upper()
            kind = "close" if name.startswith(b"END") else "open"
            if name in (b"ELSE", b"ELSEIF", b"CASE", b"BREAK", b"CONTINUE"):
                kind = "between"
            self.note("jump" if b"GOTO" in text.upper() else kind, text[place:].strip().upper())
            return len(text)
        if (address := ADDRESS.match(text, place)) is not None:
            letter, index = address[1].decode().upper(), address[2]
            if letter == "P" and index:
                self.note("assign", b"<" + address[0])
                return assigned_end(text, address.end())
            return self.expression_word(place, key(letter, int(index) if index else None), address.end())
        end = self.plain_word(place)
        return self.rest(place) if end is None else end

    def command(self, place: int, command: re.Match[bytes]) -> None:
        text, names = self.text, self.names
        name, second = command[1].upper(), command[2].upper()
        if name == b"SET" and second == b"SPLINE":  # as it was written before
            name, second = second, text[command.end() :].strip().upper()
        said = name + b" " + second if second else name
        for number in names.get(said, names.get(name, ())):
            self.word(place, key("G"), -1, len(text.rstrip()), number, How.INTEGER)
        if said not in names and name not in names and name not in QUIET:
            self.note("call", text[place:].strip())
        elif name == b"CS":
            self.note("frame", text[place:].strip().upper())
        elif _MOVES.search(_BRACKETS.sub(b" ", text[command.end() :])):
            self.note("unknown", text[place:].strip())

    def rest(self, place: int) -> int:
        """Reads what is no word; where it ends."""
        text, words = self.text, self.words
        number = _NUMBER.match(text, place)
        if number is not None and words and words[-1][1] == key("G") and words[-1][4] in WEIGHTS:
            return number.end()
        name = _NAME.match(text, place)
        rest = text[place:].strip()
        if name is not None and not words:
            at = name.end()
            while text[at : at + 1] == b"[":
                at = bracket_end(text, at)
            assigned = _ASSIGNED.match(text, at)
            if assigned is not None:
                self.note("assign", b"<" + rest)
                return max(assigned_end(text, assigned.end()), at + 1)
            quiet = name[0].upper() == b"WAIT"
            self.note("assign" if quiet else "call", b"<" + rest if quiet else rest)
        else:
            self.note("unknown", rest)
        return len(text)
