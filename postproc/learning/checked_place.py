"""A place of the part that was looked at again by hand: it shows what a positive DEV means."""

from __future__ import annotations

import re

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.tables import CsvTable, mixes_decimals
from postproc.learning.deviation_signs import SIGNS

NEAR = 0.5
"""[mm] from a point of the file, within which a place is this point."""

TELLING = 4.0
"""Standard deviations of the probe from which on a deviation shows its sign: one in 30,000 does not."""

HELP = (
    "write `# checked: X Y Z material_left` (or material_missing): a point of this file with a large deviation, and"
    " what a second look at the part, by a gauge or a caliper, found there"
)

_WORDS = re.compile(r"[\s;]+|,\s+")


def check_by_hand(
    table: CsvTable, stated: tuple[int, str], point: Floats, deviation: Floats, sigma: Floats, rows: Ints
) -> bool:
    """Whether the comment ``stated`` (its line and value) shows the sign of the deviations (J,) [mm] of the ``rows``
    (J,), positive where material is left, with the scatter sigma (J,) [mm]; point (K, 3) [mm].  Raises Refusal LRN001
    for a comment that is not understood, belongs to no point, says nothing, or contradicts the deviations."""
    line, value = stated
    if not value:
        return False
    *numbers, word = (one for one in _WORDS.split(value.strip().lower()) if one)
    if len(numbers) == 1:
        numbers = numbers[0].split(",")
    try:
        if mixes_decimals(numbers):
            raise ValueError
        place = np.array([float(one.replace(",", ".")) for one in numbers])
    except ValueError:
        place = np.zeros(0)
    if place.shape != (3,) or not np.isfinite(place).all() or word not in SIGNS:
        raise _wrong(table, line, f"# checked: {value[:40]!r} is not understood", HELP)
    near = np.flatnonzero(np.linalg.norm(point[rows] - place, axis=1) <= NEAR)
    if not len(near):
        message = f"# checked: no point with a deviation lies within {NEAR:g} mm of {value[:40]}"
        raise _wrong(table, line, message, HELP)
    if (np.abs(deviation[near]) < TELLING * sigma[near]).any():
        least = float(np.abs(deviation[near]).min())
        message = (
            f"# checked: the deviation {least:.3f} mm there is below {TELLING:g} times the scatter of the probe, and"
            " shows no sign"
        )
        raise _wrong(table, line, message, "check the point with the largest deviation")
    if np.any((deviation[near] > 0) != (word == SIGNS[0])):
        other = SIGNS[1] if word == SIGNS[0] else SIGNS[0]
        message = f"`# checked:` states {word} where DEV shows {other} by `# positive:`"
        help = "one of the two lines is wrong: look at that place of the part again, then at the measuring report"
        raise _wrong(table, line, message, help)
    return True


def _wrong(table: CsvTable, line: int, message: str, help: str) -> Refusal:
    return Refusal(Finding("LRN001", message, str(table.path), line, help=help))
