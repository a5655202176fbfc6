"""Expressions of G-code evaluated: numbers, variables, functions and operators in the languages of three controls.

A value is NaN where it is not known: a name without a known value, a function that controls compute differently, a
comparison that the last digits of a sum would decide.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

from postproc.languages.core.rounded_numbers import are_comparable, computed

LONGEST = 400
"""Characters of an expression; a longer one is not evaluated."""
DEEPEST = 20
NEAR = 2e-4
"""Numbers this near to each other and not the same: controls differ in whether they are equal."""
LAST_DIGITS = 1e-9
"""Of a value or of 1: so near to a step of a function, and not on it, the last digits of a control decide."""

Lookup = Callable[[str], float]
"""Name of a variable -> its value, NaN where it is not known."""

_COMPARING = ("EQ", "NE", "GT", "GE", "LT", "LE")


def _truth(value: bool) -> float:
    return 1.0 if value else 0.0


def _compare(operator: str, a: float, b: float) -> float:
    if 0 < abs(a - b) < (NEAR if operator in ("EQ", "NE") else LAST_DIGITS * max(1.0, abs(a))):
        return math.nan
    return _truth(
        {"EQ": a == b, "NE": a != b, "GT": a > b, "GE": a >= b, "LT": a < b, "LE": a <= b}[operator]
    )


def _is_near_step(value: float) -> bool:
    """Whether a value is beside a whole number by its last digits alone."""
    return 0 < abs(value - round(value)) < LAST_DIGITS * max(1.0, abs(value))


def _stepped(function: Callable[[float], float]) -> Callable[[float], float]:
    """A function that jumps at whole numbers: NaN where the last digits decide."""
    return lambda value: math.nan if _is_near_step(value) else function(value)


def _rounded(value: float) -> float:
    halves = round(2.0 * value)
    return math.nan if halves % 2 and _is_near_step(2.0 * value) else _half_away(value)


def _whole(operator: str, a: float, b: float) -> float:
    """MOD and DIV of whole numbers that are not negative: of others controls round or divide differently."""
    fine = a >= 0 and b > 0 and a == math.floor(a) and b == math.floor(b)
    return _calculate(operator, a, b) if fine else math.nan


def _modulo(a: float, b: float) -> float:
    if _is_near_step(a / b):
        return math.nan
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0 else rest


def _calculate(operator: str, a: float, b: float) -> float:
    match operator:
        case "+":
            return a + b
        case "-":
            return a - b
        case "*":
            return a * b
        case "/":
            return a / b
        case "**":
            return float(a**b)
        case "MOD":
            return _modulo(a, b)
        case "DIV":
            return math.nan if _is_near_step(a / b) else float(math.trunc(a / b))
        case "AND":
            return _truth(a != 0 and b != 0)
        case "OR":
            return _truth(a != 0 or b != 0)
        case "XOR":
            return _truth((a != 0) != (b != 0))
    return _compare(operator, a, b)


def _calculate_rounded(operator: str, a: float, b: float) -> float:
    """The same where controls round further: they decide whether numbers that they compute are equal."""
    if operator in ("AND", "OR", "XOR") and not {a, b} <= {0.0, 1.0}:
        return math.nan  # bit by bit in a value, which a condition is not
    result = _calculate(operator, a, b)
    if operator in _COMPARING:
        return result if abs(a - b) > LAST_DIGITS * max(1.0, abs(a)) or are_comparable(a, b) else math.nan
    return computed(result, a, b) if operator in "+-*/" else result


def _half_away(value: float) -> float:
    return math.copysign(math.floor(abs(value) + 0.5), value)


def _unless_negative(function: Callable[[float], float]) -> Callable[[float], float]:
    """A function whose range below zero is a setting of the control."""

    def called(value: float) -> float:
        result = function(value)
        return result if result >= 0 else math.nan

    return called


_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ABS": abs,
    "SQRT": math.sqrt,
    "EXP": math.exp,
    "LN": math.log,
    "ROUND": _rounded,
}
_BRACKETED_LEVELS = {
    **dict.fromkeys(("AND", "OR", "XOR"), 1),
    **dict.fromkeys(_COMPARING, 2),
    **dict.fromkeys("+-", 3),
    **dict.fromkeys(("*", "/", "MOD"), 4),
    "**": 5,
}


@dataclass(frozen=True)
class ExpressionLanguage:
    """levels: operator -> how closely it binds; functions by name; brackets: of sub-expressions and arguments;
    numbered: variables are ``#`` and a number; logical: operands of AND and OR need brackets of their own, as controls
    differ in what they bind; rounds: some controls have fewer digits than double precision; counts: MOD and DIV are
    those of counts alone."""

    levels: Mapping[str, int]
    functions: Mapping[str, Callable[[float], float]]
    brackets: tuple[str, str]
    numbered: bool
    logical: bool = False
    rounds: bool = False
    counts: bool = False


LINUXCNC = ExpressionLanguage(
    _BRACKETED_LEVELS,
    {
        **_FUNCTIONS,
        "FIX": _stepped(lambda x: float(math.floor(x))),
        "FUP": _stepped(lambda x: float(math.ceil(x))),
    },
    ("[", "]"),
    True,
)
FANUC = ExpressionLanguage(
    {name: level for name, level in _BRACKETED_LEVELS.items() if name != "**"},
    {
        **_FUNCTIONS,
        "ASIN": _unless_negative(_FUNCTIONS["ASIN"]),
        "SQR": math.sqrt,
        "FIX": _stepped(lambda x: float(math.trunc(x))),
        "FUP": _stepped(lambda x: math.copysign(math.ceil(abs(x)), x)),
    },
    ("[", "]"),
    True,
    logical=True,
    rounds=True,
    counts=True,
)
SINUMERIK = ExpressionLanguage(
    {
        "OR": 1,
        "XOR": 2,
        "AND": 3,
        **dict.fromkeys(("==", "<>", ">", ">=", "<", "<="), 4),
        **dict.fromkeys("+-", 5),
        **dict.fromkeys(("*", "/", "DIV", "MOD"), 6),
    },
    {**_FUNCTIONS, "TRUNC": _stepped(lambda x: float(math.trunc(x))), "POT": lambda x: x * x},
    ("(", ")"),
    False,
    counts=True,
)
_SAME = {"==": "EQ", "<>": "NE", ">": "GT", ">=": "GE", "<": "LT", "<=": "LE"}

_TOKENS = {
    True: re.compile(
        # Without blanks a function may follow an operator at once.
        r"(?P<number>\d+\.?\d*|\.\d+)|(?P<name><[^<>]*>)|(?P<sign>\*\*|[-+*/\[\]#,])"
        r"|(?P<word>EXISTS|ROUND|ATAN|ASIN|ACOS|SQRT|SQR|SIN|COS|TAN|ABS|FIX|FUP|EXP|LN|BIN|BCD|RND|POW|ADP"
        r"|AND|XOR|OR|MOD|EQ|NE|GT|GE|LT|LE)"
    ),
    False: re.compile(
        r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:EX[-+]?\d+)?)|(?P<word>[$A-Z_][$A-Z0-9_.]*)"
        r"|(?P<sign>==|<>|>=|<=|[-+*/()\[\],<>])|(?P<blank>[ \t]++)"
    ),
}
EXPRESSIONS = 1 << 16
"""Texts of which the tokens are remembered: fewer than a loop has, and none of them would be found in its next pass."""
_BLANKS = str.maketrans("", "", " \t\x0b\x0c")


def evaluate(text: str, language: ExpressionLanguage, lookup: Lookup) -> float:
    """The value of an expression, NaN where it is not known or not finite."""
    if len(text) > LONGEST:
        return math.nan
    tokens = _tokens(text, language.numbered)
    if not tokens:
        return math.nan
    try:
        value, end = _ExpressionParser(tokens, language, lookup).binary(0, 0, 0)
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return math.nan
    return value if end == len(tokens) and math.isfinite(value) else math.nan


@lru_cache(maxsize=EXPRESSIONS)
def _tokens(text: str, numbered: bool) -> tuple[tuple[str, str], ...]:
    """Kind and text of every token; none where a part of the text is no token.  The same text comes again in each pass
    of a loop."""
    pattern, text = _TOKENS[numbered], text.strip().upper()
    if numbered:
        text = text.translate(_BLANKS)
    found, at = [], 0
    while at < len(text):
        token = pattern.match(text, at)
        if token is None:
            return ()
        kind = token.lastgroup or ""
        if kind != "blank":
            found.append((kind, token[kind]))
        at = token.end()
    return tuple(found)


class _ExpressionParser:
    """Precedence climbing; every method gives a value and the token after it.  Raises ValueError on other text."""

    def __init__(
        self, tokens: tuple[tuple[str, str], ...], language: ExpressionLanguage, lookup: Lookup
    ) -> None:
        self._tokens, self._language, self._lookup = tokens, language, lookup

    def _at(self, at: int) -> str:
        return self._tokens[at][1] if at < len(self._tokens) else ""

    def _expect(self, at: int, sign: str) -> int:
        if self._at(at) != sign:
            raise ValueError(sign)
        return at + 1

    def binary(self, at: int, level: int, depth: int) -> tuple[float, int]:
        language = self._language
        start = at
        value, at = self.primary(at, depth)
        while (binds := language.levels.get(operator := self._at(at), 0)) > level:
            other, end = self.binary(at + 1, binds, depth)
            if language.logical and operator in ("AND", "OR", "XOR"):
                edges = (self._at(start), self._at(at - 1), self._at(at + 1), self._at(end - 1))
                if edges != ("[", "]", "[", "]"):
                    raise ValueError(operator)
            name = _SAME.get(operator, operator)
            if math.isnan(value) or math.isnan(other):
                value = math.nan
            elif language.counts and name in ("MOD", "DIV"):
                value = _whole(name, value, other)
            elif language.rounds:
                value = _calculate_rounded(name, value, other)
            else:
                value = _calculate(name, value, other)
            at = end
        return value, at

    def primary(self, at: int, depth: int) -> tuple[float, int]:
        if depth > DEEPEST or at >= len(self._tokens):
            raise ValueError
        kind, text = self._tokens[at]
        opens, closes = self._language.brackets
        if kind == "number":
            return float(text.replace("EX", "E")), at + 1
        if text == opens:
            value, at = self.binary(at + 1, 0, depth + 1)
            return value, self._expect(at, closes)
        if text in ("+", "-"):
            value, at = self.primary(at + 1, depth + 1)
            return (-value if text == "-" else value), at
        if text == "#":
            return self.numbered(at + 1, depth)
        if kind == "word":
            return self.word(text, at + 1, depth)
        raise ValueError(text)

    def numbered(self, at: int, depth: int) -> tuple[float, int]:
        """The variable of a number, of a name or of a value, after its ``#``."""
        if at < len(self._tokens) and self._tokens[at][0] == "name":
            return self._lookup("#" + self._at(at)), at + 1
        if at < len(self._tokens) and self._tokens[at][0] == "number":
            value, at = float(self._at(at)), at + 1
        else:
            value, at = self.primary(at, depth + 1)
        return self._lookup(f"#{value:.0f}") if value == math.floor(value) else math.nan, at

    def word(self, name: str, at: int, depth: int) -> tuple[float, int]:
        """A function and its arguments, or a variable."""
        opens, closes = self._language.brackets
        if name == "NOT":
            value, at = self.primary(at, depth + 1)
            return math.nan if math.isnan(value) else _truth(value == 0), at
        if self._at(at) != opens:
            if self._language.numbered:
                raise ValueError(name)
            if self._at(at) == "[":
                value, at = self.binary(at + 1, 0, depth + 1)
                at = self._expect(at, "]")
                return self._lookup(f"{name}{value:.0f}" if name == "R" else f"{name}[{value:g}]"), at
            return {"TRUE": 1.0, "FALSE": 0.0}.get(name, self._lookup(name)), at
        arguments = []
        while True:
            value, at = self.binary(at + 1, 0, depth + 1)
            arguments.append(value)
            if self._at(at) != ",":
                break
        at = self._expect(at, closes)
        if name == "ATAN" and self._language.numbered:
            value, at = self.primary(self._expect(at, "/"), depth + 1)
            arguments.append(value)
        if name in ("ATAN", "ATAN2"):
            angle = math.degrees(math.atan2(*arguments))
            return (math.nan if self._language.logical and angle < 0 else angle), at
        if any(math.isnan(one) for one in arguments):
            return math.nan, at
        function = self._language.functions.get(name)
        if function is None or len(arguments) != 1:
            return math.nan, at
        return function(arguments[0]), at
