"""The only conversions between file units (mm, deg) and the SI units used inside.

Everything inside is SI and radians.  A unit is a word of a file; ``to_si`` gives the factor
that turns a number with that word into SI, and refuses a word of another dimension.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

MM = 1e-3
"""Metres in a millimetre."""

DEG = math.pi / 180.0
"""Radians in a degree."""

WHOLE_TURN = 360.0
"""[deg] No part and no tool is turned farther."""

# word in a file -> (SI unit, factor to SI)
UNITS: dict[str, tuple[str, float]] = {
    "1": ("1", 1.0),
    "m": ("m", 1.0),
    "mm": ("m", MM),
    "um": ("m", 1e-6),
    "rad": ("rad", 1.0),
    "deg": ("rad", DEG),
    "mrad": ("rad", 1e-3),
    "urad": ("rad", 1e-6),
    "kg": ("kg", 1.0),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "N m": ("N m", 1.0),
    "N/m": ("N/m", 1.0),
    "N/mm": ("N/m", 1e3),
    "m/N": ("m/N", 1.0),
    "mm/N": ("m/N", MM),
    "um/N": ("m/N", 1e-6),
    "N m/rad": ("N m/rad", 1.0),
    "kN m/rad": ("N m/rad", 1e3),
    "rad/(N m)": ("rad/(N m)", 1.0),
    "urad/(N m)": ("rad/(N m)", 1e-6),
    "N m/rad3": ("N m/rad3", 1.0),
    "N/m3": ("N/m3", 1.0),
    "kg m": ("kg m", 1.0),
    "m/K": ("m/K", 1.0),
    "mm/K": ("m/K", MM),
    "um/K": ("m/K", 1e-6),
    "m/s": ("m/s", 1.0),
}


def to_si(word: str, si_unit: str) -> float | None:
    """Factor from the unit ``word`` of a file to ``si_unit``; None if it is not a unit of that dimension."""
    unit = UNITS.get(" ".join(word.split()))
    return unit[1] if unit is not None and unit[0] == si_unit else None


def words_for(si_unit: str) -> list[str]:
    """The words that a file may use for ``si_unit``."""
    return [word for word, (si, _) in UNITS.items() if si == si_unit]


_ROUND_PARTS = tuple(math.pi / part for part in (1, 2, 3, 4, 6))
_TWO_DECIMALS = (3.14, 1.57)


def are_radians(values: Iterable[float]) -> bool:
    """Whether angles, which a file states in deg, are round only in radians: each is 0 or a round part of pi written
    with digits, and not all are 0."""
    angles = [abs(value) for value in values if value]
    return bool(angles) and all(
        angle in _TWO_DECIMALS or any(abs(angle - part) < 6e-4 for part in _ROUND_PARTS) for angle in angles
    )
