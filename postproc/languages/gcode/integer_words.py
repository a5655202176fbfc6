"""Words without a decimal point, which some controls count in increments: what a program itself says of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.languages.gcode.control import Control
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.words import How, key

_LENGTHS = tuple(key(letter) for letter in "XYZIJKR")
FARTHER = 100.0
"""Integers that exceed all decimals by this factor are increments: these would be a thousandth of that."""
ALIKE = 3.0
SMALL = 500.0
"""As increments such an integer is half a millimetre at most: no program writes `X50.` beside a coordinate so small
without a point."""


class IntegerWords(NamedTuple):
    """increments: they are micrometres (or 0.0001 inch), else mm (or inch); ambiguous: the program does not say which;
    message: what is reported of it, "" for nothing."""

    increments: bool
    ambiguous: bool = False
    message: str = ""


PLAIN_INTEGERS = IntegerWords(False)
"""They are mm (or inch)."""


def integer_words(source: Source, control: Control, stated: str) -> IntegerWords:
    """What length words without a decimal point mean in a program; ``stated``: "mm" or "um" by the cell, or ""."""
    if not control.increments or stated:
        return IntegerWords(control.increments and stated == "um")
    columns = [source.column(one) for one in _LENGTHS]
    value = np.abs(np.concatenate([column.value for column in columns]))
    how = np.concatenate([column.how for column in columns])
    integers = value[(how == How.INTEGER) & (value > 0)]
    decimals = value[(how == How.NUMBER) & (value > 0)]
    if not len(integers):
        return IntegerWords(False)
    if not len(decimals):
        return IntegerWords(False, message="no length has a decimal point: X10 is read as 10 mm (or inch)")
    largest, farthest = integers.max(), max(decimals.max(), 1.0)
    if largest >= FARTHER * farthest:
        return IntegerWords(
            True, message="lengths without a decimal point are read as increments of 0.001 mm"
        )
    if not (decimals % 1 == 0).any() or largest <= max(ALIKE * farthest, SMALL):
        return IntegerWords(False, message="lengths without a decimal point are read as mm (or inch)")
    return IntegerWords(False, ambiguous=True)
