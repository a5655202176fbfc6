"""Expressions of constants: arithmetic, comparisons, KRL's functions, the geometric operator.

A value is an int, float or bool, an enumeration word or string (bytes), a point (Target), or UnknownValue.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from postproc.languages.core.rounded_numbers import are_comparable, computed
from postproc.languages.krl.lexing import NAME, is_integer, is_number, number
from postproc.languages.krl.spatial import inverse, product
from postproc.languages.krl.target import COMPONENTS, FrameEntry, KrlTarget, UnknownValue, known, parse, shown

Value = int | float | bool | bytes | KrlTarget | UnknownValue
Lookup = Callable[[bytes, bytes], Value | None]
"""The value of a variable: its name, and what follows it (``[2].X``), upper case, indices as numbers."""

_SHORT = 100
"""Bytes of an expression whose tokens are kept: some come again and again."""
DEEPEST = 40
"""Nesting of brackets; a deeper expression is no KRL that anybody wrote."""

TOKEN = re.compile(
    rb"[ \t]*(?:(?P<real>(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][-+]?\d{1,4})?)|(?P<int>\d+)"
    rb"|(?P<radix>'[ \t]*[HhBb][ \t]*[0-9A-Fa-f]+[ \t]*')|(?P<text>\"[^\"]*\")|(?P<enum>#[ \t]*"
    + NAME
    + rb")|(?P<name>"
    + NAME
    + rb")|(?P<op>==|<>|<=|>=|[-+*/:()\[\],.<>{}]))"
)
_NAME = re.compile(NAME + rb"\Z")
_PART = re.compile(rb"(" + NAME + rb")((?:\[\d{1,18}+\])?+(?:\." + NAME + rb")?+)\Z")
"""A component or an element with an index of digits: most of what is no number and no name."""
_COUNTED = re.compile(rb"(" + NAME + rb")[ \t]*+(==|<>|<=|>=|[-+*<>])[ \t]*+(\d{1,15})[ \t]*+\Z")
"""A variable and a whole number: most of what loops and branches compute and compare."""
_COMPARISONS = {
    b"==": lambda a, b: a == b, b"<>": lambda a, b: a != b, b"<": lambda a, b: a < b,
    b">": lambda a, b: a > b, b"<=": lambda a, b: a <= b, b">=": lambda a, b: a >= b,
}  # fmt: skip
_WHOLE: dict[bytes, Callable[[int, int], int]] = {
    **_COMPARISONS, b"+": lambda a, b: a + b, b"-": lambda a, b: a - b, b"*": lambda a, b: a * b,
}  # fmt: skip
_LOGIC = (
    {b"OR": lambda a, b: a or b, b"B_OR": lambda a, b: a | b},
    {b"EXOR": lambda a, b: a != b, b"B_EXOR": lambda a, b: a ^ b},
    {b"AND": lambda a, b: a and b, b"B_AND": lambda a, b: a & b},
)
"""From the weakest on; a comparison is weaker than all of them."""


def _deg(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda angle: function(math.radians(angle))


_FUNCTIONS: dict[bytes, Callable[..., float]] = {
    b"ABS": abs, b"SQRT": math.sqrt, b"SIN": _deg(math.sin), b"COS": _deg(math.cos), b"TAN": _deg(math.tan),
    b"ACOS": lambda x: math.degrees(math.acos(x)), b"ASIN": lambda x: math.degrees(math.asin(x)),
    b"ATAN": lambda x: math.degrees(math.atan(x)), b"ATAN2": lambda y, x: math.degrees(math.atan2(y, x)),
}  # fmt: skip
_SYSTEM = {b"TRUE": True, b"FALSE": False}
_WORDS = frozenset([*_SYSTEM, b"NOT", b"B_NOT"])
"""Names that are no variables where an operand is expected."""
_MOST = 2**31 - 1
"""An INT has 32 bits: what exceeds it overflows."""


class UntypedNumber(float):
    """A number of which it is not known whether it is an INT or a REAL: what it divides is not known."""


class _NotConstant(Exception):
    def __init__(self, why: UnknownValue) -> None:
        self.why = why


def evaluate(text: bytes, lookup: Lookup) -> Value:
    """The value of an expression; UnknownValue where it is not one of constants."""
    plain = _plain(text) if len(text) < 40 else None
    if plain is not None:
        return plain
    if _NAME.match(text) and text.upper() not in _SYSTEM:
        value = lookup(text.upper(), b"")
        return value if value is not None else _no_constant(text)
    counted = _COUNTED.match(text)
    if counted is not None and (name := counted[1].upper()) not in _WORDS:
        value = lookup(name, b"")
        if type(value) is int:
            result = _WHOLE[counted[2]](value, int(counted[3]))
            if abs(result) <= _MOST:
                return result
        elif value is None:
            return _no_constant(name)
        elif type(value) is UnknownValue:
            return value
    part = _PART.match(text.strip(b" \t"))
    if part is not None and (name := part[1].upper()) not in _SYSTEM:
        path = _path(part[2])
        value = lookup(name, path)
        return value if value is not None else _no_constant(name + path)
    try:
        parser = _Parser(text, lookup)
        value = parser.comparison(0)
        if parser.place < len(text.rstrip()):
            raise _NotConstant(UnknownValue("KRL002", f"'{shown(text)}' is not understood"))
    except _NotConstant as unknown:
        return unknown.why
    except (ArithmeticError, ValueError, TypeError):
        return UnknownValue("KRL002", f"'{shown(text)}' has no value")
    if isinstance(value, (int, float)) and not math.isfinite(value):
        return UnknownValue("KRL002", f"'{shown(text)}' has no value")
    return value


@lru_cache(maxsize=4096)
def _plain(text: bytes) -> int | float | None:
    """The value of a literal; None of what is none."""
    plain = number(text)
    if plain is None:
        return None
    return plain if b"." in text or (b"e" in text.lower() and b"'" not in text) else int(plain)


def index_text(text: bytes, lookup: Lookup) -> bytes | None:
    """The indices in the brackets of an element as numbers, without blanks; None where they are not constant."""
    digits = text.replace(b" ", b"").replace(b"\t", b"")
    if digits.replace(b",", b"").isdigit():
        return digits if len(digits) < 20 else None
    found = []
    for part in text.split(b","):
        value = evaluate(part, lookup) if part.strip() else None
        if not is_integer(value):
            return None
        found.append(b"%d" % value)
    return b",".join(found)


@lru_cache(maxsize=1024)
def _path(text: bytes) -> bytes:
    """What follows a name, upper case, its index without leading zeros."""
    index, bracket, rest = text.rpartition(b"]")
    return (b"[%d]" % int(index[1:]) if bracket else b"") + rest.upper()


@lru_cache(maxsize=1024)
def _no_constant(name: bytes) -> UnknownValue:
    return UnknownValue("KRL002", f"{shown(name)} is not a constant of the program")


def _token(text: bytes, at: int) -> tuple[str, bytes, int]:
    """Kind, token and end of what follows place ``at``."""
    found = TOKEN.match(text, at)
    if found is None:
        return "odd" if text[at:].strip() else "end", b"", at
    kind = found.lastgroup or ""
    return kind, found[kind].upper() if kind != "text" else found["text"], found.end()


_kept_token = lru_cache(maxsize=4096)(_token)


class _Parser:
    """Recursive descent; evaluates as it goes.  ``place``: after what was read; ``token``: what is there, of the
    ``kind`` by its first letter."""

    def __init__(self, text: bytes, lookup: Lookup) -> None:
        self.text, self.lookup = text, lookup
        self._read = _kept_token if len(text) <= _SHORT else _token
        self.place = 0
        self.kind, self.token = "", b""
        self.after = 0
        self._next()

    def _next(self) -> None:
        self.place = self.after
        self.kind, self.token, self.after = self._read(self.text, self.after)

    def _unknown(self, why: str) -> _NotConstant:
        return _NotConstant(UnknownValue("KRL002", why))

    def comparison(self, depth: int) -> Value:
        left = self._logic(depth, 0)
        while self.token in _COMPARISONS:
            operator = self.token
            self._next()
            right = self._logic(depth, 0)
            ordered = operator not in (b"==", b"<>")
            if (
                isinstance(left, KrlTarget | FrameEntry)
                or isinstance(right, KrlTarget | FrameEntry)
                or isinstance(left, bytes) != isinstance(right, bytes)
            ):
                raise self._unknown("it compares points and words")
            if isinstance(left, bool) != isinstance(right, bool) or (
                ordered and isinstance(left, (bool, bytes))
            ):
                raise self._unknown("it compares values of different kinds")
            if (isinstance(left, float) or isinstance(right, float)) and decided_by_digits(left, right):
                raise self._unknown("the last digits of the numbers that it compares decide")
            left = _COMPARISONS[operator](left, right)
        return left

    def _logic(self, depth: int, level: int) -> Value:
        if level == len(_LOGIC):
            return self._sum(depth)
        left = self._logic(depth, level + 1)
        while self.token in _LOGIC[level]:
            operator = self.token
            self._next()
            right = self._logic(depth, level + 1)
            wanted = int if operator.startswith(b"B_") else bool
            if type(left) is not wanted or type(right) is not wanted:
                raise self._unknown(f"{shown(operator)} is applied to a value of another kind")
            left = _LOGIC[level][operator](left, right)
        return left

    def _sum(self, depth: int) -> Value:
        left = self._product(depth)
        while self.token in (b"+", b"-"):
            operator = self.token
            self._next()
            right = self._product(depth)
            a, b = self._number(left), self._number(right)
            left = self._within(_of_type(a + b if operator == b"+" else a - b, a, b))
        return left

    def _product(self, depth: int) -> Value:
        left = self._unary(depth)
        while self.token in (b"*", b"/"):
            operator = self.token
            self._next()
            a, b = self._number(left), self._number(self._unary(depth))
            if operator == b"*":
                left = _of_type(a * b, a, b)
            elif isinstance(a, UntypedNumber) or isinstance(b, UntypedNumber):
                raise self._unknown("it divides a number whose type is not declared")
            elif isinstance(a, int) and isinstance(b, int):
                left = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)  # whole numbers stay whole
            else:
                left = computed(a / b, a, b)
            left = self._within(left)
        return left

    def _within(self, value: Value) -> Value:
        if isinstance(value, int) and abs(value) > _MOST:
            raise self._unknown("it overflows")
        return value

    def _unary(self, depth: int) -> Value:
        signs = negative = 0
        while self.token in (b"+", b"-"):
            signs += 1
            negative += self.token == b"-"
            self._next()
        if self.token in (b"NOT", b"B_NOT"):
            word, negations = self.token, 0
            while self.token == word:
                negations += 1
                self._next()
            value = self._geometric(depth)
            bits = word == b"B_NOT"
            if isinstance(value, bool) == bits or not isinstance(value, int):
                raise self._unknown("NOT is applied to a value of another kind")
            return value if negations % 2 == 0 else (~value if bits else not value)
        value = self._geometric(depth)
        if signs:
            plain = self._number(value)
            return _of_type(-plain, plain) if negative % 2 else plain
        return value

    def _geometric(self, depth: int) -> Value:
        left = self._operand(depth)
        while self.token == b":":
            self._next()
            right = self._operand(depth)
            second = right.numbers if isinstance(right, KrlTarget) else None
            if isinstance(left, FrameEntry) and second is not None:
                left = replace(left, within=product(left.within, second))
                continue
            for each in (left, right):
                if isinstance(each, FrameEntry):
                    raise self._unknown(each.message)
            if not isinstance(left, KrlTarget) or not isinstance(right, KrlTarget):
                raise self._unknown("':' is applied to something that is not a point")
            first = left.numbers
            if first is None or second is None:
                raise self._unknown("':' is applied to a point that is not known in all of X, Y, Z, A, B, C")
            values = known(product(first, second))
            left = KrlTarget(values.values, status=right.status, turn=right.turn, external=right.external)
        return left

    def _operand(self, depth: int) -> Value:
        if depth > DEEPEST:
            raise self._unknown("it is nested too deep")
        kind, token = self.kind, self.token
        if kind == "int":
            if len(token) > 18:
                raise self._unknown("it overflows")
            self._next()
            return int(token)
        if kind == "real":
            self._next()
            return float(token)
        if kind == "radix":
            value = number(token)
            if value is None:
                raise self._unknown(f"{shown(token)} is not a number")
            self._next()
            return int(value)
        if kind == "text":
            self._next()
            return token
        if kind == "enum":
            self._next()
            return b"#" + token[1:].lstrip()
        if token == b"(":
            self._next()
            inner = self.comparison(depth + 1)
            self._expect(b")")
            return inner
        if token == b"{":
            return self._aggregate()
        if kind == "name":
            return self._name(depth)
        raise self._unknown(f"'{shown(self.text)}' is not understood")

    def _aggregate(self) -> Value:
        stop = self.text.find(b"}", self.place)
        start = self.after - 1
        if stop < 0:
            raise self._unknown("its braces do not match")
        if b"{" in self.text[start + 1 : stop]:
            raise self._unknown("an aggregate within another one is not read; assign it as a component")
        found = parse(self.text[start : stop + 1], 0, -1, lambda inner: evaluate(inner, self.lookup))
        if isinstance(found, UnknownValue):
            raise _NotConstant(found)
        self.after = stop + 1
        self._next()
        return found.detached()

    def _name(self, depth: int) -> Value:
        name = self.token
        if name in _SYSTEM:
            self._next()
            return _SYSTEM[name]
        self._next()
        if self.token == b"(":
            return self._call(name, depth)
        path = b""
        while self.token in (b"[", b"."):
            if self.token == b".":
                self._next()
                if self.kind != "name":
                    raise self._unknown(f"'{shown(self.text)}' is not understood")
                path += b"." + self.token
                self._next()
                continue
            self._next()
            indices = []
            while True:
                index = self.comparison(depth + 1)
                if not is_integer(index):
                    raise self._unknown(f"an index of {shown(name)} is not a constant")
                indices.append(b"%d" % index)
                if self.token != b",":
                    break
                self._next()
            self._expect(b"]")
            path += b"[" + b",".join(indices) + b"]"
        value = self.lookup(name, path)
        if value is None:
            raise _NotConstant(_no_constant(name + path))
        if isinstance(value, UnknownValue) and not isinstance(value, FrameEntry):
            raise _NotConstant(value)
        return value

    def _call(self, name: bytes, depth: int) -> Value:
        function = _FUNCTIONS.get(name)
        if function is None and name != b"INV_POS":
            raise self._unknown(f"it calls {shown(name)}")
        self._next()
        if function is None:
            point = self.comparison(depth + 1)
            self._expect(b")")
            numbers = point.numbers if isinstance(point, KrlTarget) else None
            if numbers is None:
                raise self._unknown("INV_POS is applied to what is not known in all of X, Y, Z, A, B, C")
            return known(inverse(numbers))
        given = [self._number(self.comparison(depth + 1))]
        while self.token == b",":
            self._next()
            given.append(self._number(self.comparison(depth + 1)))
        self._expect(b")")
        if name == b"ABS":
            return _of_type(function(*given), *given)
        return computed(function(*given), *given)

    def _expect(self, token: bytes) -> None:
        if self.token != token:
            raise self._unknown(f"'{shown(self.text)}' is not understood")
        self._next()

    def _number(self, value: Value) -> int | float:
        if is_number(value):
            return value
        raise self._unknown("it calculates with something that is not a number")


def _of_type(result: int | float, *operands: int | float) -> int | float:
    """A result, whose type is as little known as that of its operands; a REAL has 32 bits on the controller."""
    if isinstance(result, float):
        result = computed(result, *operands)
    return UntypedNumber(result) if any(isinstance(each, UntypedNumber) for each in operands) else result


def decided_by_digits(one: object, other: object) -> bool:
    """Whether it depends on the digits of a REAL which of two numbers is the larger one, or that they are equal."""
    return is_number(one) and is_number(other) and not are_comparable(one, other)


def component(value: Value, path: bytes) -> Value | None:
    """The component ``.X`` of a point; None where the value has none of that name."""
    if not isinstance(value, KrlTarget) or not path.startswith(b"."):
        return None
    if value.unknown is not None and path[1:] in COMPONENTS:
        found = value.component(path[1:])
        return value.unknown if found is None else found
    return value.component(path[1:])
