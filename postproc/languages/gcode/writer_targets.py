"""Targets as numbers: which are rewritten, and where a control that reads what is written arrives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints

SLACK = 1e-9
"""Programmed units by which a number may miss half a step, as a part of its rounding."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """M motions, K columns, programmed units.

    wanted: where the motion is to end; source: where it ends in the source, NaN for what is inserted; own: the number
    that is in its block, NaN where there is none; relative, decimals: see ``Stated``.  fixed (M,): its block must
    stay as it is.  closed (M, K): it has to end exactly where it starts, with as many decimals as that takes.
    What is not known (NaN wanted) keeps its text.  origin (M, K): where the motion starts in the source; a fixed
    one that ends there inherits where the motion before came to.  resumes (M, K): it starts there whatever the motion
    before does: what is between states it, or leaves it unknown (NaN).
    """

    wanted: Floats
    source: Floats
    own: Floats
    relative: Bools
    decimals: Ints
    fixed: Bools
    closed: Bools
    origin: Floats
    resumes: Bools

    @staticmethod
    def resumed(origin: Floats, before: Floats) -> Bools:
        """(M, K) where motions start, at ``origin`` (M, K), elsewhere than the one ``before`` (M, K) ends in the
        source; NaN states nothing."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.isfinite(before) & ~(np.abs(origin - before) <= 1e-6))


@dataclass(frozen=True, eq=False)
class Followed:
    """start, end (M, K): where the written motions start and end; write (M, K): the number is rewritten; number (M,
    K): it."""

    start: Floats
    end: Floats
    write: Bools
    number: Floats

    @staticmethod
    def nothing(motions: Wanted) -> Followed:
        shape = motions.wanted.shape
        nan = np.full(shape, np.nan)
        return Followed(nan, nan.copy(), np.zeros(shape, dtype=bool), motions.own.copy())


def follow(motions: Wanted, start: Floats, a: int, b: int, into: Followed) -> None:
    """Follows the motions a .. b - 1, which share a frame, from ``start`` (K,), NaN where unknown; fills ``into``.

    A number that is there stays where it leads within half a step; a missing one is inherited where that does.
    """
    for column in range(motions.wanted.shape[1]):
        _follow_column(motions, float(start[column]), a, b, column, into)


def _half_steps(decimals: Ints) -> Floats:
    """(M,) half of the last digit of numbers with so many ``decimals`` (M,)."""
    return np.asarray(0.5 * 10.0**-decimals + SLACK, dtype=np.float64)


def _follow_column(motions: Wanted, start: float, a: int, b: int, column: int, into: Followed) -> None:
    want, own = motions.wanted[a:b, column], motions.own[a:b, column]
    decimals = motions.decimals[a:b, column]
    closed, known = motions.closed[a:b, column], np.isfinite(want)
    half = _half_steps(decimals)
    alone = np.isfinite(own) & ~motions.relative[a:b, column] & ~motions.fixed[a:b] & ~closed
    with np.errstate(invalid="ignore"):
        write = alone & known & ~(np.abs(want - own) <= half)
    number = np.where(write, _rounded(want, decimals), own)
    end = np.where(alone, number, want)
    led = np.flatnonzero(~alone & (~motions.fixed[a:b] | np.isnan(own)) & known)
    into.end[a:b, column], into.write[a:b, column], into.number[a:b, column] = end, write, number
    if len(led):
        _follow_led(motions, start, a, b, column, led, into)
    _begun(motions, start, a, b, slice(column, column + 1), into)


def _begun(motions: Wanted, start: Floats | float, a: int, b: int, columns: slice, into: Followed) -> None:
    begin = into.start[a:b, columns]
    begin[0], begin[1:] = start, into.end[a : b - 1, columns]
    resumes = motions.resumes[a:b, columns]
    begin[resumes] = motions.origin[a:b, columns][resumes]


def _follow_led(
    motions: Wanted, start: float, a: int, b: int, column: int, led: Ints, into: Followed
) -> None:
    """The motions a + ``led`` (K,), which depend on where the motion before ended: absent words, increments, circles
    that close."""
    write, number = into.write[a:b, column], into.number[a:b, column]
    wants, owns = motions.wanted[a:b, column].tolist(), motions.own[a:b, column].tolist()
    relatives, closed = motions.relative[a:b, column].tolist(), motions.closed[a:b, column].tolist()
    sources, halves = (
        motions.source[a:b, column].tolist(),
        _half_steps(motions.decimals[a:b, column]).tolist(),
    )
    origins, resumes = motions.origin[a:b, column].tolist(), motions.resumes[a:b, column].tolist()
    digits = motions.decimals[a:b, column].tolist()
    ends, fixed = into.end[a:b, column].tolist(), motions.fixed[a:b].tolist()
    for k in led.tolist():
        begin = origins[k] if resumes[k] else ends[k - 1] if k else start
        want, own, d, within = wants[k], owns[k], digits[k], halves[k]
        if fixed[k]:
            # Nothing is written; what it leaves out goes on as it is.
            ends[k] = begin if begin == begin and abs(want - origins[k]) <= SLACK else want
            continue
        if begin != begin and (relatives[k] or abs(want - sources[k]) <= within):
            continue  # not known where it starts, and not moved
        if closed[k] and begin == begin:
            want = begin
        if own != own and abs(want - begin) <= within:
            ends[k] = begin
            continue
        origin = begin if relatives[k] else 0.0
        if closed[k] and not relatives[k]:
            d = max(d, _decimals_of(want))
            into_place = abs(want - own) <= SLACK
        else:
            into_place = abs(want - origin - own) <= within
        value = own if into_place else round(want - origin, d)
        write[k] = not into_place
        number[k] = value
        motions.decimals[a + k, column] = d
        ends[k] = origin + value
    into.end[a:b, column] = ends


def _rounded(values: Floats, decimals: Ints) -> Floats:
    scale = 10.0**decimals
    return np.asarray(np.rint(values * scale) / scale)


def _decimals_of(value: float) -> int:
    """The decimals that a number needs, as far as they can be written."""
    return len(f"{value:.9f}".rstrip("0").partition(".")[2])


def follow_whole(motions: Wanted, start: Floats, a: int, b: int, into: Followed, vector: bool) -> None:
    """As ``follow``, from ``start`` (K,), for words that are one whole (a vector): all are rewritten or none,
    missing ones are zero where another is, and where none is those of the motion before hold; a vector's length
    states nothing."""
    has = np.isfinite(motions.own[a:b]).any(axis=1)
    present = has & ~motions.fixed[a:b]
    want, own = motions.wanted[a:b], np.nan_to_num(motions.own[a:b])
    half = 0.5 * 10.0 ** -motions.decimals[a:b] + SLACK
    with np.errstate(invalid="ignore"):
        changed = present[:, None] & np.isfinite(want) & ~(np.abs(want - own) <= half)
    number = np.where(changed, _rounded(want, motions.decimals[a:b]), motions.own[a:b])
    end = np.where(present[:, None], np.nan_to_num(number), want)
    write = changed
    for k in np.flatnonzero(~has & ~motions.fixed[a:b] & np.isfinite(want).all(axis=1)).tolist():
        begin = np.where(motions.resumes[a + k], motions.origin[a + k], end[k - 1] if k else start)
        source = motions.source[a + k]
        known = np.isfinite(begin).all()
        other = begin if known else source
        if _near(_unit(want[k]), _unit(other), half[k]) if vector else _near(want[k], other, half[k]):
            end[k] = begin if known else want[k]
            continue
        number[k] = end[k] = _rounded(want[k], motions.decimals[a + k])
        write[k] = True
    into.end[a:b], into.write[a:b], into.number[a:b] = end, write, number
    _begun(motions, start, a, b, slice(None), into)


def _unit(values: Floats) -> Floats:
    return np.asarray(values / (np.linalg.norm(values) or 1.0))


def _near(one: Floats, other: Floats, half: Floats) -> bool:
    return bool((np.abs(one - other) <= half).all())
