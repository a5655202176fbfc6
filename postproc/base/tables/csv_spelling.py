"""What a cell means: a number, nothing, or a text that a spreadsheet would take for a formula."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?\Z")
_FORMULA = re.compile(r"'*[=+\-@]")
_MISSING = frozenset(("", "-", "nan", "n/a"))


def is_missing(cell: str) -> bool:
    """Whether a cell is empty, or states that there is nothing: ``-``, ``nan``, ``n/a`` in any case."""
    return cell.lower() in _MISSING


def is_number(text: str) -> bool:
    """Whether ``text`` is a number with a decimal point; float() would also take nan, inf, 1_0 and other digits."""
    return bool(_NUMBER.match(text))


def finite_number(text: str) -> float | None:
    """The number that ``text`` is, with a decimal point; None if it is none, or too large."""
    return float(text) if is_number(text) and math.isfinite(float(text)) else None


def mixes_decimals(words: Sequence[str]) -> bool:
    """Whether some of the words have a decimal comma and others a point: 1.000 beside 0,5 may be one or a thousand."""
    return any("," in word for word in words) and any("." in word for word in words)


def as_cell(text: str) -> str:
    """``text`` as a spreadsheet takes for no formula, with an apostrophe before its = + - @; ``read_table`` takes it
    off.  Numbers stay as they are."""
    return f"'{text}" if _FORMULA.match(text) and finite_number(text) is None else text


def as_text(cell: str) -> str:
    """What ``as_cell`` was given."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
