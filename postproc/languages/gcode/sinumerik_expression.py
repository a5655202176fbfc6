"""Constant expressions of Sinumerik: numbers, + - * / and brackets; everything else has no value here."""

from __future__ import annotations

import math
import re

from postproc.languages.gcode.expression_values import SINUMERIK, evaluate

_CONSTANT = re.compile(rb"(?:[-+*/(). \t0-9]|(?<=[.0-9])EX)++", re.I)
_OPERAND = re.compile(rb"'[^']*'|[0-9.]+(?:EX[-+]?[0-9]+)?|[$A-Za-z_][$A-Za-z0-9_]*", re.I)
_OPERATOR = re.compile(rb"[ \t]*+(?:MOD|DIV|AND|OR|XOR|NOT|B_[A-Z]+)(?![A-Za-z_0-9])|[ \t]*+[-+*/<>=]", re.I)
_CLOSED = re.compile(rb'"[^"]*"')
_LONGEST = 200


def constant(text: bytes) -> float:
    """The value of an expression; NaN where it is no constant that is read here, or is not finite."""
    if len(text) > _LONGEST or not _CONSTANT.fullmatch(text):
        return math.nan
    try:
        return float(text)
    except ValueError:
        return evaluate(text.decode("latin-1"), SINUMERIK, _unknown)


def _unknown(name: str) -> float:
    return math.nan


def expression_end(text: bytes, at: int) -> int:
    """Where an expression that starts at ``at`` ends, blanks after it included: before the letter of the next word.

    Brackets hold whatever they hold; a name, a number and what operators join belong to it.
    """
    size, place, joined = len(text), at, True
    while place < size:
        letter = text[place : place + 1]
        if letter in b"([":
            place, joined = bracket_end(text, place), False
        elif letter in b"+-*/<>=":
            place, joined = place + 1, True
        elif letter in b" \t":
            place += 1
        elif letter == b'"':
            stop = text.find(b'"', place + 1)
            place, joined = (size if stop < 0 else stop + 1), False
        elif joined:
            found = _OPERAND.match(text, place)
            if found is None:
                return place
            place, joined = found.end(), False
        elif (operator := _OPERATOR.match(text, place)) is not None:  # MOD, DIV, AND ..
            place, joined = operator.end(), True
        else:
            return place
    return size


def assigned_end(text: bytes, at: int) -> int:
    """Where what is assigned to a parameter ends: before another word, with an operator of letters (R1=R2 MOD 3) at
    the end of the line."""
    close = expression_end(text, at)
    return len(text) if _OPERATOR.match(text, close) else close


def is_open(text: bytes) -> bool:
    """Whether a string, a bracket or a sum does not close: what is put after such a line would belong to it."""
    rest = _CLOSED.sub(b"0", text).rstrip()
    return (
        b'"' in rest
        or rest.endswith((b"=", b"+", b"-", b"*", b"/"))
        or any(rest.count(a) > rest.count(b) for a, b in ((b"(", b")"), (b"[", b"]")))
    )


def bracket_end(text: bytes, at: int) -> int:
    """After the bracket that closes the one at ``at``; the end of the line where none does."""
    depth = 0
    for place in range(at, len(text)):
        depth += (text[place] in b"([") - (text[place] in b")]")
        if depth == 0:
            return place + 1
    return len(text)
