"""Rows that are copies of others digit by digit: a copy is no reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.measurements.readings import Readings, alike

COPIES = 3
"""So many equal rows of two files are no coincidence."""

LIKELY = 10.0
"""In one file, so many times the equal pairs that rounding makes of repeated readings are no coincidence."""

FINEST = 1e-3 * MM
"""[m] scatter of the best instrument, where none is stated."""

DIGITS = 9
"""Decimals of a millimetre beyond which a value is not written."""


def each_once(readings: Readings) -> Readings:
    """Without rows that another row has digit by digit (MEA012): of another file, or of the same one where repeated
    readings, rounded as they are written, would not be equal so often."""
    first = _first_like(readings, ())
    equal = (first < np.arange(len(readings))) & np.isfinite(readings.value).any(axis=1)
    elsewhere = readings.file != readings.file[first]
    copied = np.zeros(len(readings), bool)
    if (equal & elsewhere).sum() >= COPIES:
        copied |= equal & elsewhere
    within = equal & ~elsewhere
    if within.sum() >= COPIES and _pairs(_first_like(readings, (readings.file,))) > LIKELY * _expected_pairs(
        readings
    ):
        copied |= within
    return _without(readings, copied, readings, first, "they count once")


def not_fitted(readings: Readings, fitted: Readings) -> Readings:
    """What validates a fit: readings of the same robot that were not fitted.

    Rows that are fitted digit by digit are excluded (MEA012).  Raises Refusal MEA008 where a file is one of those
    fitted, where nothing else is in it, or where it names another robot."""
    where = str(readings.files[0]) if readings.files else ""
    if set(readings.digests) & set(fitted.digests):
        raise Refusal(
            Finding(
                "MEA008",
                "the file is one of those that are fitted: it validates nothing",
                where,
                help="use readings that are not fitted",
            )
        )
    named, known = readings.robot.casefold(), fitted.robot.casefold()
    if named and known and named != known:
        message = f"the readings are of the robot {readings.robot!r}, the fitted ones of {fitted.robot!r}"
        raise Refusal(Finding("MEA008", message, where, help="use readings of the same robot"))
    seen = {row: index for index, row in reversed(list(enumerate(_digits(fitted))))}
    first = np.array([seen.get(row, -1) for row in _digits(readings)])
    copied = (first >= 0) & np.isfinite(readings.value).any(axis=1)
    if copied.all():
        message = "all readings of the file are fitted: they validate nothing"
        raise Refusal(Finding("MEA008", message, where, help="use readings that are not fitted"))
    if copied.sum() < COPIES:
        return readings
    return _without(readings, copied, fitted, first, "they do not validate the fit")


def _without(readings: Readings, copied: Bools, others: Readings, first: np.ndarray, what: str) -> Readings:
    if not copied.any():
        return readings
    row = int(np.argmax(copied))
    file, line = others.where(int(first[row]))
    own, _ = readings.where(row)
    of = f"of line {line}" if file == own else f"of {file} (line {line})"
    message = f"{int(copied.sum())} readings are copies digit by digit, the first one {of}: {what}"
    finding = Finding("MEA012", message, *readings.where(row))
    return replace(readings.part(~copied), findings=(*readings.findings, finding))


def _digits(readings: Readings) -> list[tuple[object, ...]]:
    """What a row states, as keys."""
    one = readings
    names = one.targets or ("",)
    numbers = np.column_stack([one.q, one.wrench, np.nan_to_num(one.value), np.isnan(one.value)])
    if one.time is not None:
        numbers = np.column_stack([numbers, one.time])
    return [(names[target], *row) for target, row in zip(one.target.tolist(), numbers.tolist(), strict=True)]


def _first_like(readings: Readings, apart: Sequence[np.ndarray]) -> np.ndarray:
    """(R,) the first row that is equal digit by digit, and in what is ``apart``; a row of one file also in its session,
    approach and temperature."""
    one = readings
    columns = [one.q, one.wrench, np.nan_to_num(one.value), np.isnan(one.value), one.target, one.time, *apart]
    columns += [one.session, one.direction, one.temperature] if apart else []
    group = alike(*columns)
    first = np.arange(len(one))
    several = np.flatnonzero(group >= 0)
    _, at, of = np.unique(group[several], return_index=True, return_inverse=True)
    first[several] = several[at][of.reshape(-1)]
    return first


def _pairs(first: np.ndarray) -> float:
    """Pairs of rows with the same first row."""
    sizes = np.bincount(first).astype(float)
    return float((sizes * (sizes - 1) / 2).sum())


def _expected_pairs(readings: Readings) -> float:
    """Expected pairs of equal rows among repeats of one state, whose coordinates scatter by sigma and are written in
    steps r: with the probability r / (2 sqrt(pi) sigma) two of them are equal in a coordinate."""
    one = readings
    known = np.isfinite(one.value)
    state = alike(
        one.q, one.wrench, one.target, one.file, one.session, one.direction, one.temperature, one.time, known
    )
    sigma = np.where(np.isfinite(one.sigma), one.sigma, FINEST)
    same = np.minimum(_step(one.value[known]) / (2 * np.sqrt(np.pi) * sigma), 1.0) ** known.sum(axis=1)
    sizes = np.bincount(state[state >= 0]) if (state >= 0).any() else np.zeros(1, int)
    return float((same[state >= 0] * (sizes[state[state >= 0]] - 1) / 2).sum())


def _step(values: Floats) -> float:
    """[m] the last decimal that the values are written with."""
    for decimals in range(DIGITS):
        if np.allclose(values / MM, np.round(values / MM, decimals), rtol=0, atol=10.0**-DIGITS):
            return float(10.0**-decimals * MM)
    return float(10.0**-DIGITS * MM)
