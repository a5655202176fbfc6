"""Comparisons of numbers that the controller keeps with fewer digits than they are computed with here."""

from __future__ import annotations

import math
from ctypes import c_float

WHOLE = 2.0**23
"""Whole numbers below it are exact in the numbers of controllers (IEEE 754, single precision)."""
APART = 1e-5
"""Numbers whose difference exceeds this share of them are different, however their computation was rounded."""


def are_comparable(one: float, other: float) -> bool:
    """Whether rounding cannot change which of two numbers is the larger one, or that they are equal."""
    if abs(one - other) > APART * max(1.0, abs(one), abs(other)):
        return True
    return _is_exact(one) and _is_exact(other)


def computed(result: float, *operands: float) -> float:
    """The ``result`` of an operation.  Where the controller rounds its operands, it rounds the result too: if it is a
    number of single precision here, it is one by chance, and its neighbour, which is none, is returned."""
    if _is_exact(result) and not all(map(_is_exact, operands)):
        return math.nextafter(result, math.inf)
    return result


def _is_exact(number: float) -> bool:
    """Whether the controller has the same number."""
    return c_float(number).value == number
