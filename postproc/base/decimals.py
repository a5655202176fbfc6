"""Decimal numbers in bulk: literals as values with their decimals, and values as texts of fixed decimals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints, sums

LARGEST = 2.0**53
"""Whole numbers below it are exact."""

MOST_DECIMALS = 12
_LONGEST = 15
"""Letters of a number that is below LARGEST with a digit in the place of its point."""

_ZEROS, _HIGHEST, _ABOVE_NINE = (np.uint64(byte * 0x0101010101010101) for byte in (0x30, 0x80, 0x76))
"""One byte in all eight places; 0x76 and more than 9 have the highest bit."""

Fours = NDArray[np.uint32]
"""Letters by fours, in the order in which they are in memory; a zero is no letter."""

BLOCK = 1 << 14
"""Numbers that are written at a time."""


def literals(
    raw: NDArray[np.uint8],
    start: NDArray[Any],
    stop: NDArray[Any],
    other: Callable[[bytes], tuple[float, int]],
) -> tuple[Floats, Ints]:
    """Values and decimals (K,) of the literals ``raw[start:stop]``: raw (B,) the bytes of the text; start, stop (K,)
    offsets.

    Digits with a sign and a point are read here, exactly as ``float`` does; ``other`` reads any other form.
    """
    value, decimals = np.empty(len(start)), np.empty(len(start), np.int64)
    for low in range(0, len(start), BLOCK):
        part = slice(low, low + BLOCK)
        value[part], decimals[part], plain = plain_decimals(raw, start[part], stop[part])
        for k in (low + np.flatnonzero(~plain)).tolist():
            value[k], decimals[k] = other(raw[int(start[k]) : int(stop[k])].tobytes())
    return value, decimals


def decimals_of(literal: bytes) -> int:
    """The decimals that a literal is written with, its exponent considered."""
    mantissa, _, exponent = literal.upper().partition(b"E")
    written = len(mantissa.partition(b".")[2].strip())
    return min(max(written - int(exponent or b"0"), 0), MOST_DECIMALS)


def other_literal(literal: bytes) -> tuple[float, int]:
    """Value and decimals of a literal in any form that ``float`` reads."""
    return float(literal), decimals_of(literal)


def plain_decimals(
    raw: NDArray[np.uint8], start: NDArray[Any], stop: NDArray[Any], point: bytes = b"."
) -> tuple[Floats, Ints, Bools]:
    """Values and decimals (K,) of literals near each other, and which of them (K,) are digits with a sign and a
    ``point``. raw (B,): bytes of the text; start, stop (K,): offsets.

    Their letters are packed in words of eight, the last one in the highest byte, and read all at once.
    """
    if not len(start):
        return np.empty(0), np.empty(0, np.int64), np.empty(0, bool)
    low, high = int(start.min()), int(stop.max())
    letters = np.full(-(-(high - low) // 8) * 8 + 3 * 8, ord("0"), np.uint8)
    letters[16 : 16 + high - low] = raw[low:high]
    words = letters.view("<u8")
    first = raw.take(start, mode="clip")
    minus = first == ord("-")
    length = np.asarray(stop - start, np.int64) - (minus | (first == ord("+")))
    plain = (length > 0) & (length <= _LONGEST)
    value, decimals = np.zeros(len(start)), np.zeros(len(start), np.int64)
    dotted, size = np.zeros(len(start), np.uint8), 1.0
    eight = np.uint64(point[0] * 0x0101010101010101)
    for after in range(0, int(length[plain].max(initial=0)), 8):  # letters after those of the word
        at = np.asarray(stop - (low + after) + 8, np.int64)
        shift = (at.astype(np.uint64) & 7) << 3
        word = (words.take(at >> 3) >> shift) | (words.take((at >> 3) + 1) << (64 - shift))
        missing = np.clip(8 - (length - after), 0, 8).astype(np.uint64) << 3
        word = ((word ^ _ZEROS) >> missing << missing) ^ _ZEROS
        points = _bytes_that_are_zero(word ^ eight)
        word ^= (points >> 7) * np.uint64(point[0] ^ ord("0"))
        word ^= _ZEROS
        plain &= ((word + _ABOVE_NINE) | word) & _HIGHEST == 0
        dotted += np.bitwise_count(points)
        decimals += np.where(points > 0, after + 7 - (np.bitwise_count(points - 1) >> 3), 0)
        word = (word * 10 + (word >> 8)) & 0x00FF00FF00FF00FF
        word = (word * 100 + (word >> 16)) & 0x0000FFFF0000FFFF
        word = (word * 10000 + (word >> 32)) & 0xFFFFFFFF
        value += word * size
        size *= 1e8
    plain &= (dotted <= 1) & (length > dotted)
    # the point is there as a digit 0
    power = 10.0**decimals
    value -= np.where(dotted > 0, 9.0 * power * np.floor(value / (10.0 * power)), 0.0)
    value /= power
    return np.where(minus, -value, value), decimals, plain


def _bytes_that_are_zero(words: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The highest bit of every byte that is zero, and no other."""
    return ~(((words & ~_HIGHEST) + ~_HIGHEST) | words) & _HIGHEST


def fixed(values: Floats, decimals: Ints, apart: Bools | None = None) -> tuple[bytes, Ints]:
    """Numbers (K,) with their ``decimals`` (K,) after the point, as one text, and where each starts and ends (K + 1,).

    No minus zero; no point without decimals.  apart (K,): a blank is before a number that has no minus.
    """
    texts, lengths = [], np.zeros(len(values), dtype=np.int64)
    for low in range(0, len(values), BLOCK):
        block = slice(low, low + BLOCK)
        columns = _of_any_decimals(values[block], decimals[block])
        if apart is not None:
            columns[0][apart[block] & (columns[0] == 0)] = fours(b" ")
        for column in columns:
            lengths[block] += _count(column)
        texts.append(text_of(columns))
    return b"".join(texts), sums(lengths)


def _of_any_decimals(values: Floats, decimals: Ints) -> list[Fours]:
    """The letters of numbers (K,) with as many decimals each (K,)."""
    used = np.flatnonzero(np.bincount(decimals)).tolist()
    if len(used) == 1:
        return number_letters(values, used[0])
    columns: list[Fours] = []
    for count in used:
        rows = np.flatnonzero(decimals == count)
        for place, part in enumerate(number_letters(values[rows], count)):
            if place == len(columns):
                columns.append(np.zeros(len(values), np.uint32))
            columns[place][rows] = part
    return columns


def number_letters(values: Floats, decimals: int, before: bytes = b"") -> list[Fours]:
    """Numbers (K,) with ``decimals`` after the point, as columns (K,) of fours; nothing of one that is not finite.

    ``before``: a letter that is before each.
    """
    known = np.isfinite(values)
    every = bool(known.all())
    size = np.abs(values if every else np.where(known, values, 0.0))
    whole = np.rint(size * 10.0**decimals)
    minus = (values < 0) & (whole > 0) & known
    hard = np.flatnonzero(whole >= LARGEST)
    whole[hard] = 0.0
    columns = _digits(whole.astype(np.int64), decimals)
    for row in hard.tolist():
        text = fixed_one(float(size[row]), decimals)
        for place in range(max(len(columns), -(-len(text) // 4))):
            if place == len(columns):
                columns.append(np.zeros(len(values), np.uint32))
            columns[place][row] = fours(text[4 * place : 4 * place + 4])
    if not every:
        for column in columns:
            column[~known] = 0
    return [np.where(minus, fours(before + b"-"), fours(before)), *columns]


def _digits(whole: Ints, decimals: int) -> list[Fours]:
    """The letters (K,) of whole / 10^decimals."""
    columns: list[Fours] = []
    ends = [0, *range(3, decimals, 4), decimals]  # the first four of decimals starts with the point
    rest = whole
    for start, end in zip(ends[-2::-1], ends[:0:-1], strict=True):
        if end:
            rest, part = _parted(rest, 10 ** (end - start))
            columns.append(_decimals(end - start, start == 0)[part])
    last = True
    while True:
        rest, part = _parted(rest, 10**4)
        further = bool(rest.any())
        if further:
            part += 10**4 * (rest > 0)
        columns.append(_whole(last)[part])
        if not further:
            return columns[::-1]
        last = False


def _parted(whole: Ints, size: int) -> tuple[Ints, Ints]:
    rest = whole // size
    return rest, whole - size * rest


@cache
def _decimals(digits: int, pointed: bool) -> Fours:
    """Of the numbers 0 .. 10^digits - 1 all digits, after a point or not."""
    table = np.zeros((10**digits, 4), np.uint8)
    table[:, 0] = ord(".")
    start = int(pointed)
    powers = 10 ** np.arange(digits)[::-1]
    table[:, start : start + digits] = np.arange(10**digits)[:, None] // powers % 10 + ord("0")
    return table.view(np.uint32)[:, 0]


@cache
def _whole(last: bool) -> Fours:
    """Of the numbers 0 .. 9999 the digits without leading zeros, a zero of 0 only where they are the ``last`` ones of
    a number; after them all four digits of each."""
    every = _decimals(4, False)
    shown = np.arange(10**4)[:, None] >= [1000, 100, 10, 0 if last else 1]
    return np.concatenate([(every.view(np.uint8).reshape(-1, 4) * shown).view(np.uint32)[:, 0], every])


def fours(text: bytes) -> np.uint32:
    """Up to four letters as one of ``Fours``."""
    return np.uint32(np.frombuffer(text.ljust(4, b"\0"), np.uint32)[0])


def text_of(columns: Sequence[Fours]) -> bytes:
    """The letters of the rows of columns (K,), one row after the other."""
    return np.stack(columns, axis=1).tobytes().translate(None, b"\0")


def _count(letters: Fours) -> NDArray[np.uint8]:
    """How many letters each four has; none of them has its highest bit."""
    there = (letters + np.uint32(0x7F7F7F7F) >> 7) & 0x01010101
    return (there * np.uint32(0x01010101) >> 24).astype(np.uint8)


def fixed_one(value: float, decimals: int) -> bytes:
    """One number with its decimals, as ``fixed`` writes many."""
    text = f"{value:.{decimals}f}"
    return (text[1:] if text.startswith("-") and not text.strip("-0.") else text).encode()
