"""Readings along a path brought to its motions: a straight line for each, its peak and its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Floats, Ints

FEW = 3
"""Readings that half a motion needs for a force that changes along it."""

AROUND = 10
"""Readings before and behind that tell the scatter of a motion that has few of its own."""

CLEAR = 3.0
"""Means differ where they do by more than so many standard errors."""

UNEVEN = 0.1
"""A motion's force is not even where it leaves its line by more than this share of the largest force."""


@dataclass(frozen=True)
class Readings:
    """M readings that lie on N motions.

    own (M,): the motion of each; at (M,): its place, ``values`` (M, 6) [N, N m]; begin, end (N,): of the motions, on
    the same scale.
    """

    own: Ints
    at: Floats
    values: Floats
    begin: Floats
    end: Floats

    def means(self, group: Ints, values: Floats, each: int = 1) -> tuple[Ints, Floats]:
        """How many readings each of ``each`` groups a motion has (N each,), and the means of ``values`` (M, K)."""
        groups = each * len(self.end)
        count = np.bincount(group, minlength=groups)
        total = [np.bincount(group, column, groups) for column in values.T]
        return count, np.stack(total, axis=1) / np.maximum(count, 1)[:, None]

    def scatter(self, part: slice) -> Floats:
        """(N,) of the readings of each motion, from their second differences: sigma^2 = mean square / 6.

        Of motions with few readings, from those around them.
        """
        values = self.values[:, part]
        if len(values) < 3:
            return np.zeros(len(self.end))
        second = np.sum((values[:-2] - 2 * values[1:-1] + values[2:]) ** 2, axis=1)
        inside = self.own[2:] == self.own[:-2]
        count, square = self.means(self.own[:-2][inside], second[inside, None])
        total = np.append(0.0, np.cumsum(second))
        middle = np.searchsorted(self.at, 0.5 * (self.begin + self.end))
        first, last = (np.clip(middle + side * AROUND, 0, len(second)) for side in (-1, 1))
        around = (total[last] - total[first]) / np.maximum(last - first, 1)
        return np.sqrt(np.where(count >= FEW, square[:, 0], around) / 6)


def resampled(readings: Readings) -> tuple[Floats, Floats, Floats, Floats]:
    """Wrench at the begin and at the end (N, 6), the largest force, and the standard error of the ends (N,) [N].

    A motion gets its mean; where its halves differ clearly, the line through the mean points of both; and the readings
    around it where it has none of its own.
    """
    begin, end, at, values, own = readings.begin, readings.end, readings.at, readings.values, readings.own
    n = len(end)
    half = 2 * own + (at >= 0.5 * (begin + end)[own])
    count, mean = readings.means(half, np.column_stack([at, values]), 2)
    both, x, y = count.reshape(n, 2), mean[:, 0].reshape(n, 2), mean[:, 1:].reshape(n, 2, 6)
    some = both.any(axis=1)

    start, value = (
        np.stack([np.interp(to, at, channel) for channel in values.T], axis=1) for to in (begin, end)
    )
    total, whole = readings.means(own, values)
    start[some], value[some] = whole[some], whole[some]

    force, moment = slice(0, 3), slice(3, 6)
    scatter = np.stack([readings.scatter(force), readings.scatter(moment)], axis=1)
    apart = np.linalg.norm((y[:, 1] - y[:, 0]).reshape(n, 2, 3), axis=2)
    expected = scatter * np.sqrt((1 / np.maximum(both, 1)).sum(axis=1))[:, None]
    clear = np.any(apart > CLEAR * expected, axis=1) & np.all(both >= FEW, axis=1)
    line = np.flatnonzero(clear & (x[:, 1] > x[:, 0]))
    slope = (y[line, 1] - y[line, 0]) / (x[line, 1] - x[line, 0])[:, None]
    start[line] = y[line, 0] + slope * (begin[line] - x[line, 0])[:, None]
    value[line] = y[line, 1] + slope * (end[line] - x[line, 1])[:, None]

    # the mean points lie a quarter of the way from the ends: there the line has 5 / total of the scatter's variance
    variance = np.ones(n)
    variance[line] = 5.0
    error = scatter[:, 0] * np.sqrt(variance / np.maximum(total, 1))
    peak = np.maximum(np.linalg.norm(value[:, force], axis=1), np.linalg.norm(start[:, force], axis=1))
    largest = np.zeros(n)
    np.maximum.at(largest, own, np.linalg.norm(values[:, force], axis=1))
    return start, value, np.where(some, largest, peak), error


def uneven(readings: Readings, start: Floats, value: Floats) -> tuple[Ints, Floats]:
    """Motions (K,) whose mean force in one of four parts is off the line from ``start`` to ``value`` (N, 6), and by how
    much [N]; by more than its scatter explains."""
    own = readings.own
    length = (readings.end - readings.begin)[own]
    share = (readings.at - readings.begin[own]) / np.where(length > 0, length, 1.0)
    line = (1 - share)[:, None] * start[own, :3] + share[:, None] * value[own, :3]
    off = readings.values[:, :3] - line
    part = 4 * own + np.clip(4 * share, 0, 3).astype(np.int64)
    count, both = readings.means(part, np.column_stack([off, off**2]), 4)
    mean, square = both[:, :3], both[:, 3:]
    error = np.sqrt(np.maximum(square - mean**2, 0).sum(axis=1) / np.maximum(count - 1, 1))
    distance = np.linalg.norm(mean, axis=1)
    largest = np.linalg.norm(value[:, :3], axis=1).max(initial=0.0)
    clear = (count >= FEW) & (distance > UNEVEN * largest) & (distance > CLEAR * error)
    worst = np.where(clear, distance, 0.0).reshape(-1, 4).max(axis=1)
    rows = np.flatnonzero(worst > 0)
    return rows, worst[rows]
