"""Comparisons of numbers that the controller keeps with fewer digits than they are computed with here."""

from __future__ import annotations

WHOLE = 2.0**23
"""Whole numbers below it are exact in the numbers of controllers (IEEE 754, single precision)."""
PARTS = 64.0
"""So are multiples of 1/64 below ``WHOLE`` / 64."""
APART = 1e-5
"""Numbers whose difference exceeds this share of them are different, however their computation was rounded."""


def are_comparable(one: float, other: float) -> bool:
    """Whether rounding cannot change which of two numbers is the larger one, or that they are equal."""
    if abs(one - other) > APART * max(1.0, abs(one), abs(other)):
        return True
    return _is_exact(one) and _is_exact(other)


def _is_exact(number: float) -> bool:
    """Whether the controller has the same number."""
    return abs(number) < WHOLE and (number.is_integer() or (number * PARTS).is_integer())
