"""Constant expressions of Sinumerik: numbers, + - * / and brackets; everything else has no value here."""

from __future__ import annotations

import math
import re

_NUMBER = re.compile(rb"[ \t]*((?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?)[ \t]*", re.I)
_OPERAND = re.compile(rb"'[^']*'|[0-9.]+(?:EX[-+]?[0-9]+)?|[$A-Za-z_][$A-Za-z0-9_]*", re.I)
_OPERATOR = re.compile(rb"[ \t]*+(?:MOD|DIV|AND|OR|XOR|NOT|B_[A-Z]+)(?![A-Za-z_0-9])|[ \t]*+[-+*/<>=]", re.I)
_CLOSED = re.compile(rb'"[^"]*"')
_DEEPEST = 20
_LONGEST = 200


def constant(text: bytes) -> float:
    """The value of an expression; NaN where it is no constant that is read here, or is not finite."""
    if len(text) > _LONGEST:
        return math.nan
    value, end = _sum(text, 0, 0)
    return value if end == len(text) and math.isfinite(value) else math.nan


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


def _sum(text: bytes, at: int, depth: int) -> tuple[float, int]:
    value, at = _product(text, at, depth)
    while text[at : at + 1] in (b"+", b"-"):
        sign = 1.0 if text[at : at + 1] == b"+" else -1.0
        other, at = _product(text, at + 1, depth)
        value += sign * other
    return value, at


def _product(text: bytes, at: int, depth: int) -> tuple[float, int]:
    value, at = _factor(text, at, depth)
    while text[at : at + 1] in (b"*", b"/"):
        divide = text[at : at + 1] == b"/"
        other, at = _factor(text, at + 1, depth)
        value = math.nan if divide and other == 0.0 else value / other if divide else value * other
    return value, at


def _factor(text: bytes, at: int, depth: int) -> tuple[float, int]:
    while text[at : at + 1] in (b" ", b"\t"):
        at += 1
    if text[at : at + 1] in (b"+", b"-") and depth < _DEEPEST:
        value, end = _factor(text, at + 1, depth + 1)
        return (-value if text[at : at + 1] == b"-" else value), end
    if text[at : at + 1] == b"(" and depth < _DEEPEST:
        value, end = _sum(text, at + 1, depth + 1)
        if text[end : end + 1] != b")":
            return math.nan, end
        end += 1
        while text[end : end + 1] in (b" ", b"\t"):
            end += 1
        return value, end
    found = _NUMBER.match(text, at)
    if found is None:
        return math.nan, at
    try:
        return float(found[1].upper().replace(b"EX", b"E")), found.end()
    except (ValueError, OverflowError):
        return math.nan, found.end()
