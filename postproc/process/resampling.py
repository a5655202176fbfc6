"""Readings along a path brought to its motions: a straight line for each, its peak and its standard error."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_blocks

FEW = 3
"""Readings that half a motion needs for a force that changes along it."""

AROUND = 10
"""Readings before and after that show the scatter of a motion that has few of its own."""

CLEAR = 3.0
"""Means differ where they do by more than so many standard errors."""

UNEVEN = 0.1
"""A motion's force is not even where it leaves its line by more than this share of the largest force."""


FORCE, MOMENT = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class ForceReadings:
    """M readings that lie on N motions, in the order of their places.

    own (M,): the motion of each; at (M,): its place, ``values`` (M, 6) [N, N m]; start, end (N,): of the motions, on
    the same scale.
    """

    own: Ints
    at: Floats
    values: Floats
    start: Floats
    end: Floats

    def of(self, rows: slice) -> slice:
        """The readings that lie on the motions ``rows``."""
        return slice(*np.searchsorted(self.own, [rows.start, rows.stop]).tolist())

    @cached_property
    def second(self) -> tuple[Floats, Floats]:
        """(M - 2,) the squares of the second differences of force and moment."""
        differences = np.zeros((2, max(len(self.at) - 2, 0)))

        def differ(part: slice) -> None:
            values = self.values[part.start : part.stop + 2]
            squares = (values[:-2] - 2 * values[1:-1] + values[2:]) ** 2
            differences[0, part], differences[1, part] = (
                np.sum(squares[:, kind], axis=1) for kind in (FORCE, MOMENT)
            )

        for _ in in_blocks(differ, differences.shape[1]):
            pass
        return differences[0], differences[1]

    @cached_property
    def total(self) -> tuple[Floats, Floats]:
        """(M - 1,) their sums from the first one on."""
        force, moment = (np.append(0.0, np.cumsum(second)) for second in self.second)
        return force, moment

    def scatter(self, rows: slice, kind: int) -> Floats:
        """(K,) of the readings of the motions ``rows``, of their forces (``kind`` 0) or moments (1), from their second
        differences: sigma^2 = mean square / 6.  Of motions with few readings, from those around them."""
        second, total = self.second[kind], self.total[kind]
        count = rows.stop - rows.start
        if not len(second):
            return np.zeros(count)
        part = self.of(rows)
        first = np.arange(part.start, min(part.stop, len(second)))
        first = first[self.own[first + 2] == self.own[first]]
        each, square = means(self.own[first] - rows.start, second[first, None], count)
        middle = np.searchsorted(self.at, 0.5 * (self.start[rows] + self.end[rows]))
        low, high = (np.clip(middle + side * AROUND, 0, len(second)) for side in (-1, 1))
        around = (total[high] - total[low]) / np.maximum(high - low, 1)
        return np.sqrt(np.where(each >= FEW, square[:, 0], around) / 6)


def means(group: Ints, values: Floats, groups: int) -> tuple[Ints, Floats]:
    """How many of the rows of ``values`` (M, K), in ``group`` (M,), each group has (``groups``,), and their means
    (``groups``, K)."""
    count = np.bincount(group, minlength=groups)
    total = [np.bincount(group, column, groups) for column in values.T]
    return count, np.stack(total, axis=1) / np.maximum(count, 1)[:, None]


def resampled(readings: ForceReadings) -> tuple[Floats, Floats, Floats, Floats]:
    """Wrench at the start and at the end (N, 6), the largest force, and the standard error of the ends (N,) [N].

    A motion gets its mean; where its halves differ clearly, the line through the mean points of both; and the readings
    around it where it has none of its own.
    """
    n = len(readings.end)
    start, value, peak, error = np.empty((n, 6)), np.empty((n, 6)), np.empty(n), np.empty(n)

    def brought(rows: slice) -> None:
        start[rows], value[rows], peak[rows], error[rows] = _resampled(readings, rows)

    for _ in in_blocks(brought, n):
        pass
    return start, value, peak, error


def _resampled(readings: ForceReadings, rows: slice) -> tuple[Floats, Floats, Floats, Floats]:
    n, part = rows.stop - rows.start, readings.of(rows)
    motion_start, end = readings.start[rows], readings.end[rows]
    at, values, own = readings.at[part], readings.values[part], readings.own[part] - rows.start
    half = 2 * own + (at >= 0.5 * (motion_start + end)[own])
    count, mean = means(half, np.column_stack([at, values]), 2 * n)
    both, x, y = count.reshape(n, 2), mean[:, 0].reshape(n, 2), mean[:, 1:].reshape(n, 2, 6)
    some = both.any(axis=1)

    low, high = (
        np.searchsorted(readings.at, motion_start[0]),
        np.searchsorted(readings.at, end[-1], side="right"),
    )
    near = slice(max(int(low) - 1, 0), int(high) + 1)
    start, value = (
        np.stack([np.interp(to, readings.at[near], channel) for channel in readings.values[near].T], axis=1)
        for to in (motion_start, end)
    )
    total, whole = means(own, values, n)
    start[some], value[some] = whole[some], whole[some]

    scatter = np.stack([readings.scatter(rows, kind) for kind in (0, 1)], axis=1)
    apart = np.linalg.norm((y[:, 1] - y[:, 0]).reshape(n, 2, 3), axis=2)
    expected = scatter * np.sqrt((1 / np.maximum(both, 1)).sum(axis=1))[:, None]
    clear = np.any(apart > CLEAR * expected, axis=1) & np.all(both >= FEW, axis=1)
    line = np.flatnonzero(clear & (x[:, 1] > x[:, 0]))
    slope = (y[line, 1] - y[line, 0]) / (x[line, 1] - x[line, 0])[:, None]
    start[line] = y[line, 0] + slope * (motion_start[line] - x[line, 0])[:, None]
    value[line] = y[line, 1] + slope * (end[line] - x[line, 1])[:, None]

    # the mean points lie a quarter of the length from the ends: there the line has 5 / total of the scatter's variance
    variance = np.ones(n)
    variance[line] = 5.0
    error = scatter[:, 0] * np.sqrt(variance / np.maximum(total, 1))
    peak = np.maximum(np.linalg.norm(value[:, FORCE], axis=1), np.linalg.norm(start[:, FORCE], axis=1))
    largest = np.zeros(n)
    np.maximum.at(largest, own, np.linalg.norm(values[:, FORCE], axis=1))
    return start, value, np.where(some, largest, peak), error


def uneven(readings: ForceReadings, start: Floats, value: Floats) -> tuple[Ints, Floats]:
    """Motions (K,) whose mean force in one of four parts is off the line from ``start`` to ``value`` (N, 6), and by how
    much [N]; by more than its scatter explains."""
    n = len(readings.end)
    largest = max(in_blocks(lambda rows: np.linalg.norm(value[rows, FORCE], axis=1).max(), n), default=0.0)
    worst = np.empty(n)

    def off(rows: slice) -> None:
        worst[rows] = _off(readings, rows, start[rows, FORCE], value[rows, FORCE], largest)

    for _ in in_blocks(off, n):
        pass
    motions = np.flatnonzero(worst > 0)
    return motions, worst[motions]


def _off(readings: ForceReadings, rows: slice, start: Floats, value: Floats, largest: float) -> Floats:
    """(K,) how far off the motions ``rows`` are, 0 where they are even."""
    part = readings.of(rows)
    own, motion_start = readings.own[part] - rows.start, readings.start[rows]
    length = (readings.end[rows] - motion_start)[own]
    share = (readings.at[part] - motion_start[own]) / np.where(length > 0, length, 1.0)
    line = (1 - share)[:, None] * start[own] + share[:, None] * value[own]
    off = readings.values[part, FORCE] - line
    quarter = 4 * own + np.clip(4 * share, 0, 3).astype(np.int64)
    count, both = means(quarter, np.column_stack([off, off**2]), 4 * len(motion_start))
    mean, square = both[:, :3], both[:, 3:]
    error = np.sqrt(np.maximum(square - mean**2, 0).sum(axis=1) / np.maximum(count - 1, 1))
    distance = np.linalg.norm(mean, axis=1)
    clear = (count >= FEW) & (distance > UNEVEN * largest) & (distance > CLEAR * error)
    return np.asarray(np.where(clear, distance, 0.0).reshape(-1, 4).max(axis=1))
