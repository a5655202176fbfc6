"""Measured parts that are one part: the same deviations at the same points, in files that differ in order or digits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.learning.measured_part import MeasuredPart

COPIED = 0.9
"""Share of the rows of the shorter file that occur in the other one: two parts differ in far more of them."""

DIGITS = 9
"""Of coordinates and deviations [m] that are compared."""


def refuse_copied_parts(parts: Sequence[MeasuredPart]) -> None:
    """Raises Refusal LRN001 for a file that repeats the rows of another one: the scatter of its probe would count as
    what both parts have in common."""
    rows = [_rows(part) for part in parts]
    for (one, own), (other, its) in combinations(zip(parts, rows, strict=True), 2):
        same = len(own & its)
        if same < COPIED * min(len(own), len(its)):
            continue
        message = f"{same} of {len(other)} rows are those of {one.file.name}, with the same deviations"
        help = "name each part once; of a part that was measured again name the better file"
        raise Refusal(Finding("LRN001", message, str(other.file), help=help))


def _rows(part: MeasuredPart) -> frozenset[tuple[float, ...]]:
    values = np.round(np.column_stack([part.point, part.deviation]), DIGITS) + 0.0
    return frozenset(map(tuple, values.tolist()))
