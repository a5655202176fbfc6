"""The value of an expression."""

from __future__ import annotations

import math
from collections.abc import Callable

from .values import FRAME, UNDETERMINED, Stop, inverse, product

Resolve = Callable[[tuple], object]
Call = Callable[[str, list], object]

_FUNCTIONS: dict[str, Callable] = {
    "SIN": lambda x: math.sin(math.radians(x)), "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)), "ACOS": lambda x: math.degrees(math.acos(x)),
    "ATAN2": lambda y, x: math.degrees(math.atan2(y, x)), "SQRT": math.sqrt, "ABS": abs,
}  # fmt: skip
_COMPARE: dict[str, Callable] = {
    "==": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b,
    ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
}  # fmt: skip
_LOGIC: dict[str, Callable] = {"AND": bool.__and__, "OR": bool.__or__, "EXOR": bool.__xor__}
_BITS: dict[str, Callable] = {"B_AND": int.__and__, "B_OR": int.__or__, "B_EXOR": int.__xor__}


def evaluate(tree: tuple, resolve: Resolve, call: Call) -> object:
    """``resolve``: the value of a place (("name", ..), ("element", ..), ("member", ..)); ``call``: that of a function
    of the program, with its arguments as trees."""

    def of(tree: tuple) -> object:
        kind = tree[0]
        if kind == "value":
            return tree[1]
        if kind in ("name", "element", "member"):
            value = resolve(tree)
            if value is None:
                raise Stop("a variable without a value is read")
            return value
        if kind == "aggregate":
            return {key: of(item) for key, item in tree[1].items()}
        if kind == "product":
            return product(_frame(of(tree[1])), _frame(of(tree[2])))
        if kind == "unary":
            return _unary(tree[1], of(tree[2]))
        if kind == "binary":
            return _binary(tree[1], of(tree[2]), of(tree[3]))
        name, arguments = tree[1:]
        if name == "INV_POS":
            return inverse(_frame(of(arguments[0])))
        if name in _FUNCTIONS:
            values = [_number(of(argument)) for argument in arguments]
            if UNDETERMINED in values:
                return UNDETERMINED
            try:
                return _FUNCTIONS[name](*values)
            except (ValueError, TypeError) as error:
                raise Stop(str(error)) from None
        return call(name, arguments)

    return of(tree)


def _frame(value: object) -> dict:
    if not isinstance(value, dict) or not set(FRAME) & set(value):
        raise Stop("':' between what are no frames")
    return value


def _number(value: object) -> object:
    if value is UNDETERMINED or (isinstance(value, int | float) and not isinstance(value, bool)):
        return value
    raise Stop("no number")


def _unary(operator: str, value: object) -> object:
    if value is UNDETERMINED:
        return value
    if operator == "NOT":
        if not isinstance(value, bool):
            raise Stop("NOT of what is no BOOL")
        return not value
    if operator == "B_NOT":
        if not isinstance(value, int) or isinstance(value, bool):
            raise Stop("B_NOT of what is no INT")
        return ~value
    value = _number(value)
    return -value if operator == "-" else value


def _binary(operator: str, a: object, b: object) -> object:
    if a is UNDETERMINED or b is UNDETERMINED:
        return UNDETERMINED
    if operator in _COMPARE:
        kinds = [str if isinstance(v, str) else bool if isinstance(v, bool) else float for v in (a, b)]
        if isinstance(a, dict) or isinstance(b, dict) or kinds[0] != kinds[1]:
            raise Stop("values of different kinds are compared")
        if kinds[0] is not float and operator not in ("==", "<>"):
            raise Stop("words have no order")
        return _COMPARE[operator](a, b)
    if operator in _LOGIC:
        if not isinstance(a, bool) or not isinstance(b, bool):
            raise Stop(f"{operator} of what is no BOOL")
        return _LOGIC[operator](a, b)
    if operator in _BITS:
        if any(isinstance(v, bool) or not isinstance(v, int) for v in (a, b)):
            raise Stop(f"{operator} of what is no INT")
        return _BITS[operator](a, b)
    a, b = _number(a), _number(b)
    if operator == "/":
        if b == 0:
            raise Stop("division by zero")
        if isinstance(a, int) and isinstance(b, int):
            whole = abs(a) // abs(b)
            return whole if (a < 0) == (b < 0) else -whole
        return a / b
    out = a + b if operator == "+" else a - b if operator == "-" else a * b
    if abs(out) > 2**31 - 1:
        raise Stop("overflow")
    return out
