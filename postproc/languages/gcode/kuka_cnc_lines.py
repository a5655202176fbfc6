"""Lines of KUKA.CNC (G-code on a robot's own control) that are not plain words: # commands, assignments, flow."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from postproc.languages.gcode.control import LexedLine
from postproc.languages.gcode.sinumerik_expression import (
    assigned_end,
    bracket_end,
    constant,
    expression_end,
    is_open,
)
from postproc.languages.gcode.words import How, key

_HEAD = re.compile(rb"[ \t\x0b\x0c]*(?P<slash>/[ \t]*\d?[ \t]*)?(?:[Nn:][ \t]*\d+)?[ \t]*")
_COMMAND = re.compile(rb"#[ \t]*([A-Za-z]+)[ \t]*([A-Za-z]*)[ \t]*")
_FLOW = re.compile(
    rb"\$[ \t]*(IF|ENDIF|ELSE|ELSEIF|FOR|ENDFOR|WHILE|ENDWHILE|DO|ENDDO|GOTO|SWITCH|ENDSWITCH|CASE|BREAK|CONTINUE)",
    re.I,
)
_ADDRESS = re.compile(rb"([A-Za-z])([0-9]{0,3})[ \t]*=[ \t]*")
_WORD = re.compile(rb"([A-Za-z])[ \t]*((?:[-+][ \t]*)?(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?)", re.I)
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
        words: list[tuple[int, int, int, int, float, int]] = []
        notes: list[tuple[str, str]] = []

        def note(kind: str, text: bytes) -> None:
            notes.append((kind, text.decode("latin-1")))

        def word(at: int, address: int, start: int, stop: int, value: float, how: int) -> None:
            words.append((at, address, start, stop, value, how))

        head = _HEAD.match(text)
        place = head.end() if head else 0
        deleted = head is not None and head["slash"] is not None
        while place < len(text):
            if text[place] in b" \t\x0b\x0c":
                place += 1
                continue
            command, flow = _COMMAND.match(text, place), _FLOW.match(text, place)
            if command is not None:
                self._command(text, place, command, word, note)
                break
            if flow is not None:
                name = flow[1].upper()
                kind = "close" if name.startswith(b"END") else "open"
                if name in (b"ELSE", b"ELSEIF", b"CASE", b"BREAK", b"CONTINUE"):
                    kind = "between"
                note("jump" if b"GOTO" in text.upper() else kind, text[place:].strip().upper())
                break
            address, plain = _ADDRESS.match(text, place), _WORD.match(text, place)
            if address is not None:
                letter, index = address[1].decode().upper(), address[2]
                if letter == "P" and index:
                    note("assign", b"<" + address[0])
                    place = assigned_end(text, address.end())
                    continue
                close = expression_end(text, address.end())
                literal = text[address.end() : close].rstrip()
                value = constant(literal)
                how = How.UNREAD if math.isnan(value) else How.NUMBER
                stop = address.end() + len(literal)
                word(place, key(letter, int(index) if index else None), address.end(), stop, value, how)
                place = max(close, address.end() + 1)
            elif plain is not None:
                value = constant(plain[2])
                how = How.NUMBER if b"." in plain[2] else How.INTEGER
                word(place, key(plain[1].decode().upper()), plain.start(2), plain.end(), value, how)
                place = plain.end()
            else:
                place = self._rest(text, place, words, note)
        if words and is_open(text):
            note("unknown", text.strip())
        return LexedLine(words, notes, deleted)

    def _command(self, text: bytes, place: int, command, word, note) -> None:  # type: ignore[no-untyped-def]
        name, second = command[1].upper(), command[2].upper()
        said = name + b" " + second if second else name
        for number in self._names.get(said, self._names.get(name, ())):
            word(place, key("G"), -1, len(text.rstrip()), number, How.INTEGER)
        if said in self._names or name in self._names or name in QUIET:
            if name == b"CS":
                note("frame", text[place:].strip().upper())
            elif _MOVES.search(_BRACKETS.sub(b" ", text[command.end() :])):
                note("unknown", text[place:].strip())
            return
        note("call", text[place:].strip())

    @staticmethod
    def _rest(text: bytes, place: int, words: list[tuple[int, int, int, int, float, int]], note) -> int:  # type: ignore[no-untyped-def]
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
                note("assign", b"<" + rest)
                return max(assigned_end(text, assigned.end()), at + 1)
            quiet = name[0].upper() == b"WAIT"
            note("assign" if quiet else "call", b"<" + rest if quiet else rest)
        else:
            note("unknown", rest)
        return len(text)
