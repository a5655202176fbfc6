"""Decimal numbers in bulk: literals as values with their decimals, and values as texts of fixed decimals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Bools, Floats, Ints
from postproc.document import sums

LARGEST = 2.0**53
"""Whole numbers below it are exact."""

MOST_DECIMALS = 12
_LONGEST = 16
"""Digits of a number below LARGEST."""


def literals(
    raw: NDArray[np.uint8],
    start: NDArray[Any],
    stop: NDArray[Any],
    other: Callable[[bytes], tuple[float, int]],
) -> tuple[Floats, Ints]:
    """Values and decimals (K,) of the literals ``raw[start:stop]``.

    Digits with a sign and a point are read here, exactly as ``float`` does; ``other`` reads any other form.
    """
    length = np.asarray(stop - start, dtype=np.int64)
    count, width = len(length), int(length.max(initial=0))
    value, decimals = np.zeros(count), np.zeros(count, dtype=np.int64)
    plain = length <= _LONGEST
    begin = np.asarray(start, dtype=np.int64)
    pointed = np.zeros(count, dtype=bool)
    first = np.zeros(count, dtype=np.uint8)
    for i in range(min(width, _LONGEST)):
        inside = i < length
        letter = raw[np.minimum(begin + i, len(raw) - 1)]
        letter = np.where(inside, letter, 0)
        if i == 0:
            first = letter
        digit = letter - np.uint8(48)  # wraps: what is no digit gives more than 9
        is_digit = digit <= 9
        value = np.where(is_digit, value * 10.0 + digit, value)
        decimals += is_digit & pointed
        point = letter == 46
        sign = ((letter == 45) | (letter == 43)) if i == 0 else np.zeros(1, dtype=bool)
        plain &= is_digit | (point & ~pointed) | sign | ~inside
        pointed |= point
    value = np.where(first == 45, -value, value) / 10.0**decimals
    plain &= (length > 1) | (first - np.uint8(48) <= 9)
    for k in np.flatnonzero(~plain).tolist():
        value[k], decimals[k] = other(raw[int(start[k]) : int(stop[k])].tobytes())
    return value, decimals


def fixed(values: Floats, decimals: Ints, apart: Bools | None = None) -> tuple[bytes, Ints]:
    """Numbers (K,) with their ``decimals`` (K,) after the point, as one text, and where each begins and ends (K + 1,).

    No minus zero; no point without decimals.  apart (K,): a blank stands before a number that has no minus.
    """
    apart = np.zeros(len(values), dtype=bool) if apart is None else apart
    lengths = np.zeros(len(values), dtype=np.int64)
    parts: list[tuple[Ints, NDArray[np.uint8]]] = []
    used = np.flatnonzero(np.bincount(decimals)) if len(decimals) else np.empty(0, np.int64)
    for count in used.tolist():
        rows = np.flatnonzero(decimals == count) if len(used) > 1 else np.arange(len(values))
        whole = np.rint(np.abs(values[rows]) * 10.0**count)
        easy = whole < LARGEST
        if not easy.all():
            for row in rows[~easy].tolist():
                text = fixed_one(float(values[row]), count)
                text = b" " + text if apart[row] and not text.startswith(b"-") else text
                lengths[row] = len(text)
                parts.append((np.array([row]), np.frombuffer(text, np.uint8)))
            rows, whole = rows[easy], whole[easy]
        letters, shown = _letters(whole.astype(np.int64), values[rows] < 0, apart[rows], count)
        lengths[rows] = shown.sum(axis=1)
        parts.append((rows, letters[shown]))
    ends = sums(lengths)
    if len(parts) == 1:
        return parts[0][1].tobytes(), ends
    result = np.empty(int(ends[-1]), np.uint8)
    for rows, letters in parts:
        own = lengths[rows]
        at = np.arange(len(letters)) + np.repeat(ends[rows] - sums(own)[:-1], own)
        result[at] = letters
    return result.tobytes(), ends


def _letters(whole: Ints, negative: Bools, apart: Bools, count: int) -> tuple[NDArray[np.uint8], Bools]:
    """(K, W) letters of whole / 10^count, and which of them are part of the text."""
    digits = max(len(str(int(whole.max(initial=0)))), count + 1)
    width = 1 + digits + (1 if count else 0)
    letters = np.empty((len(whole), width), np.uint8)
    shown = np.ones((len(whole), width), dtype=bool)
    minus = negative & (whole > 0)
    letters[:, 0] = np.where(minus, 45, 32)
    shown[:, 0] = minus | apart
    column, rest = width - 1, whole
    for place in range(digits):
        if place == count and count:
            letters[:, column] = 46
            column -= 1
        if place > count:
            shown[:, column] = rest > 0
        rest, digit = np.divmod(rest, 10)
        letters[:, column] = digit + 48
        column -= 1
    return letters, shown


def fixed_one(value: float, decimals: int) -> bytes:
    """One number with its decimals, as ``fixed`` writes many."""
    text = f"{value:.{decimals}f}"
    return (text[1:] if text.startswith("-") and not text.strip("-0.") else text).encode()
