"""Numbers, parameters and expressions of LinuxCNC in many spellings, each with the value that it has.

    real       = number | parameter | "[" expression "]" | function | ("+" | "-") (parameter | "[" ... "]" | function)
    parameter  = "#" (integer | "<" name ">" | parameter | "[" expression "]")
    expression = real { operator real }, ** before * / MOD before + - before EQ NE GT GE LT LE before AND OR XOR, all
                 from left to right
    function   = SIN COS TAN ASIN ACOS ABS SQRT FIX FUP ROUND EXP LN "[" expression "]"
               | ATAN "[" expression "]" "/" "[" expression "]" | EXISTS "[" "#<" name ">" "]"

The values only guide the generator (an arc needs its start); no comparison rests on them.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import NamedTuple

LARGEST = 60.0
"""Of a value within an expression."""


class Real(NamedTuple):
    """A text and its value, None where the generator does not follow it."""

    text: str
    value: float | None


class Scope:
    """Parameters and their values; those of a subprogram are its own but for #31 and above and #<_name>."""

    def __init__(self, shared: dict[str, float | None] | None = None) -> None:
        self.shared: dict[str, float | None] = {} if shared is None else shared
        self.own: dict[str, float | None] = {}
        self.system = {name for name, value in self.shared.items() if value is None}

    def _of(self, name: str) -> dict[str, float | None]:
        return self.shared if name.startswith("<_") or (name.isdigit() and int(name) > 30) else self.own

    def set(self, name: str, value: float | None) -> None:
        self._of(name)[name] = value

    def forget(self) -> None:
        """Values may have changed where the generator did not follow."""
        for values in (self.shared, self.own):
            values.update(dict.fromkeys(values))

    @property
    def names(self) -> dict[str, float | None]:
        return {**self.shared, **self.own}

    @property
    def known(self) -> dict[str, float]:
        return {
            name: value for name, value in self.names.items() if value is not None and abs(value) < LARGEST
        }


def _whole(value: float) -> float:
    """As ROUND does: halves away from zero."""
    return float(int(value + math.copysign(0.5, value)))


_FUNCTIONS: dict[str, tuple[Callable[[float], float], float, float]] = {
    "SIN": (lambda x: math.sin(math.radians(x)), -720, 720),
    "COS": (lambda x: math.cos(math.radians(x)), -720, 720),
    "TAN": (lambda x: math.tan(math.radians(x)), -70, 70),
    "ASIN": (lambda x: math.degrees(math.asin(x)), -1, 1),
    "ACOS": (lambda x: math.degrees(math.acos(x)), -1, 1),
    "ABS": (abs, -50, 50),
    "SQRT": (math.sqrt, 0, 2000),
    "FIX": (lambda x: float(math.floor(x)), -50, 50),
    "FUP": (lambda x: float(math.ceil(x)), -50, 50),
    "ROUND": (_whole, -50, 50),
    "EXP": (math.exp, -3, 3),
    "LN": (math.log, 0.1, 50),
}
_LEVELS = (("OR", "AND", "XOR"), ("EQ", "NE", "GT", "GE", "LT", "LE"), ("+", "-"), ("*", "/", "MOD"), ("**",))


def _apply(operator: str, left: float, right: float) -> float:
    if operator == "MOD":
        rest = math.fmod(left, right)
        return rest + abs(right) if rest < 0 else rest
    plain: dict[str, Callable[[], float]] = {
        "+": lambda: left + right,
        "-": lambda: left - right,
        "*": lambda: left * right,
        "/": lambda: left / right,
        "**": lambda: left**right,
        "EQ": lambda: abs(left - right) < 1e-6,
        "NE": lambda: abs(left - right) >= 1e-6,
        "GT": lambda: left > right,
        "GE": lambda: left >= right,
        "LT": lambda: left < right,
        "LE": lambda: left <= right,
        "AND": lambda: left != 0 and right != 0,
        "OR": lambda: left != 0 or right != 0,
        "XOR": lambda: (left != 0) != (right != 0),
    }
    return float(plain[operator]())


class Expressions:
    """Makes up reals; ``rich``: expressions beside numbers; ``loose``: blanks within numbers and words."""

    def __init__(self, chance: random.Random, rich: bool, loose: bool) -> None:
        self.chance, self.rich, self.loose = chance, rich, loose

    def case(self, text: str) -> str:
        shape = self.chance.random()
        return text.lower() if shape < 0.3 else text.title() if shape < 0.35 else text

    def name(self, name: str) -> str:
        """A parameter: names are in any case, with blanks, and any parameter may have blanks."""
        if self.loose and self.chance.random() < 0.15:
            name = name.replace("<", "< ") if self.chance.random() < 0.5 else " " + name
        return "#" + (self.case(name) if self.chance.random() < 0.3 else name)

    def number(self, value: float, decimals: int | None = None) -> Real:
        """``+1.``, ``.5``, ``-0.2500``, ``007``, ``1 2.5``"""
        chance = self.chance
        digits = chance.choice((0, 1, 2, 3, 3, 4)) if decimals is None else decimals
        text = f"{abs(value):.{digits}f}"
        value = math.copysign(float(text), value)
        shape = chance.random()
        if shape < 0.25 and "." in text:
            text = text.rstrip("0")
        elif shape < 0.3 and "." not in text:
            text += "."
        elif shape < 0.35:
            text = "0" + text
        elif shape < 0.5 and text.startswith("0."):
            text = text[1:] if len(text) > 2 else text
        sign = "-" if value < 0 else "+" if chance.random() < 0.08 else ""
        if text == ".":
            text = "0."
        if self.loose and chance.random() < 0.04:
            at = chance.randint(0, len(text))
            text = text[:at] + " " + text[at:]
        return Real(sign + text, value + 0.0)

    def term(self, scope: Scope, depth: int) -> tuple[str, float, int]:
        """Text, value and level of an expression; level 5: a real."""
        chance = self.chance
        shape = chance.random()
        known = scope.known
        if depth <= 0 or shape < 0.2:
            if known and chance.random() < 0.5:
                name = chance.choice(sorted(known))
                return self.name(name), known[name], 5
            real = self.number(chance.uniform(-20, 20))
            return real.text, real.value or 0.0, 5
        if shape < 0.4:
            return self.call(scope, depth)
        if shape < 0.5:
            inner, value, _ = self.term(scope, depth - 1)
            return f"[{inner}]", value, 5
        if shape < 0.57:
            inner, value, _ = self.term(scope, depth - 1)
            return f"-[{inner}]", -value, 5
        level = chance.choices(range(5), (1, 1, 6, 5, 1))[0]
        operator = chance.choice(_LEVELS[level])
        left, one, left_level = self.term(scope, depth - 1)
        right, two, right_level = self.term(scope, depth - 1)
        if left_level < level:
            left = f"[{left}]"
        if right_level <= level:
            right = f"[{right}]"
        if operator == "**":
            right, two = "2", 2.0
        if operator in ("/", "MOD") and abs(two) < 0.05:
            right, two = "2.5", 2.5
        blank = chance.choice(("", "", " "))
        value = _apply(operator, one, two)
        if abs(value) > LARGEST:
            return left, one, left_level
        return left + blank + self.case(operator) + blank + right, value, level

    def call(self, scope: Scope, depth: int) -> tuple[str, float, int]:
        chance = self.chance
        if chance.random() < 0.1:
            one, two = (self.number(chance.uniform(1, 9)) for _ in range(2))
            value = math.degrees(math.atan2(one.value or 0.0, two.value or 0.0))
            return f"{self.case('ATAN')}[{one.text}]/[{two.text}]", value, 5
        named = [name for name in scope.names if name.startswith("<") and name not in scope.system]
        if named and chance.random() < 0.1:
            return f"{self.case('EXISTS')}[#{chance.choice(named)}]", 1.0, 5
        name = chance.choice(sorted(_FUNCTIONS))
        function, low, high = _FUNCTIONS[name]
        inner, value, _ = self.term(scope, depth - 1)
        if not low <= value <= high or (name in ("ROUND", "FIX", "FUP") and abs(value % 0.5) < 1e-6):
            real = self.number(chance.uniform(low, high), 2)
            inner, value = real.text, min(max(real.value or 0.0, low), high)
            if name in ("ROUND", "FIX", "FUP", "LN"):
                inner, value = "12.3", 12.3
        return f"{self.case(name)}[{inner}]", function(value), 5

    def real(self, value: float, scope: Scope, decimals: int | None = None) -> Real:
        """A real near ``value``."""
        chance = self.chance
        if not self.rich or chance.random() < 0.55:
            return self.number(value, decimals)
        known = scope.known
        near = [name for name, one in known.items() if abs(one - value) < 30 and decimals is None]
        shape = chance.random()
        if near and shape < 0.3:
            name = chance.choice(near)
            return Real(self.reference(name, known), known[name])
        if near and shape < 0.4:
            name = chance.choice(near)
            other = chance.choice(("-", "+"))
            return Real(other + self.name(name), -known[name] if other == "-" else known[name])
        unknown = [name for name, one in scope.names.items() if one is None and decimals is None]
        if unknown and shape < 0.5:
            name = self.name(chance.choice(unknown))
            return Real(chance.choice((name, f"[{name}+{self.number(value).text}]")), None)
        inner, one, level = self.term(scope, chance.randint(1, 3))
        if level < 2:
            inner = f"[{inner}]"
        rest = round(value - one, 3)
        sign = "-" if rest < 0 else "+"
        text = f"[{inner}{sign}{self.number(abs(rest), 3).text.lstrip('+')}]"
        result = one + rest
        if chance.random() < 0.1:
            return Real(f"-[-{text}]", result)
        return Real(text, result)

    def reference(self, name: str, known: dict[str, float]) -> str:
        """The parameter ``name``, sometimes by way of another that holds its number."""
        if name.isdigit() and self.chance.random() < 0.15:
            via = [other for other, value in known.items() if value == int(name)]
            if via:
                return "#" + self.name(self.chance.choice(via))
            return f"#[{int(name) - 1}+1]"
        return self.name(name)

    def truth(self, scope: Scope) -> tuple[str, bool]:
        """An expression in brackets that is true or false."""
        for _ in range(20):
            left, one, level = self.term(scope, 1)
            right, two, other = self.term(scope, 1)
            if abs(one - two) > 0.01:
                break
        operator = self.chance.choice(_LEVELS[1])
        left = left if level > 1 else f"[{left}]"
        right = right if other > 1 else f"[{right}]"
        return f"[{left} {self.case(operator)} {right}]", bool(_apply(operator, one, two))
