"""On which side of its gap each axis lies, along a program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.effects import play as operator

CROSSED = 1.0 - 1e-9
"""Share of a gap or a band that counts as all of it."""

INSIDE = 1.0 - 1e-6
"""Share of half a gap from which on a motor counts as at its end, but for rounding."""

NO_LENGTH = 1.0
"""[m] Counts as the length of a jump, or of a turn on the spot."""


@dataclass(frozen=True, eq=False)
class GapSides:
    """Stations (S) along the paths of motions, in order, so dense that between two of them every axis is monotone.

    key (S,): twice the motion, plus the share of its path; motor, joint (S, n) [rad, m]: the motors, and what follows
    them after its gap; gap (n,) or (S, n) [rad, m].
    """

    key: Floats
    motor: Floats
    joint: Floats
    gap: Floats

    @staticmethod
    def of(key: Floats, motor: Floats, gap: Floats, restart: Bools) -> GapSides:
        """``key`` (S,) the place of each station, ``motor`` (S, n) [rad, m], ``gap`` (n,) [rad, m]; ``restart`` (S,):
        it is not known how the motors came there."""
        return GapSides(key, motor, operator.play_output(motor, gap, restart), gap)

    def at(self, rows: Ints, along: Floats | None = None) -> Floats:
        """(K, n) -1..1 by how much of half the gap each motor is ahead at the shares ``along`` (K,) of the paths of the
        motions ``rows`` (K,), at their ends without; 0 where nothing is known."""
        if not len(self.key):
            return np.zeros((len(rows), self.motor.shape[1]))
        start = 2.0 * rows
        key = start + (1.0 if along is None else along)
        last = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        first = np.maximum(last - 1, 0)
        since = np.maximum(self.key[first], start)
        length = self.key[last] - since
        part = np.where(length > 0, (key - since) / np.where(length > 0, length, 1.0), 1.0)
        part = np.clip(part, 0.0, 1.0)[:, None]
        motor = self.motor[first] + part * (self.motor[last] - self.motor[first])
        gap = self.gap if self.gap.ndim == 1 else self.gap[last]
        joint = np.clip(self.joint[first], motor - 0.5 * gap, motor + 0.5 * gap)
        whole = (part == 1.0)[:, 0]  # there it may also have started again
        motor[whole], joint[whole] = self.motor[last[whole]], self.joint[last[whole]]
        known = np.floor(0.5 * self.key[last]) == rows
        return np.where(known[:, None], operator.share(motor, joint, gap), 0.0)

    @property
    def shares(self) -> Floats:
        """(S, n) as ``at``, of the stations."""
        return operator.share(self.motor, self.joint, self.gap)

    def inside(self, axes: Bools) -> Ints:
        """Motions (K,) on which one of ``axes`` (n,) is inside of its gap."""
        crossing = (np.abs(self.shares[:, axes]) < INSIDE).any(axis=1)
        motions = np.unique(np.floor(0.5 * self.key[crossing]).astype(np.int64))
        return motions[motions >= 0]


@dataclass(frozen=True, eq=False)
class MotorPath:
    """The motions of a program one after the other: start, length (N,) [m] of each; what has no length of its own has
    one that keeps their order."""

    start: Floats
    length: Floats

    @staticmethod
    def of(length: Floats) -> MotorPath:
        """Of motions of ``length`` (N,) [m]."""
        length = np.where(length > 0, length, NO_LENGTH)
        return MotorPath(np.cumsum(length) - length, length)

    def position(self, rows: Ints, along: Floats | float) -> Floats:
        """(K,) [m] of the shares ``along`` of the motions ``rows`` (K,); row -1 is the place before the first one."""
        return np.where(rows < 0, -1.0, self.start[rows] + along * self.length[rows])

    def place(self, position: Floats) -> tuple[Ints, Floats]:
        """Motion (K,) and share (K,) of its path, of positions (K,) [m]."""
        rows = np.maximum(np.searchsorted(self.start, position, "right") - 1, 0)
        return rows, np.clip((position - self.start[rows]) / self.length[rows], 0.0, 1.0)

    def drawn(self, position: Floats, spacing: Floats) -> Floats:
        """Positions (K,) [m] of ``position`` (K,), those that are nearer than ``spacing`` (N,) [m] to an end of their
        motion moved there."""
        rows, along = self.place(position)
        near = np.minimum(along, 1.0 - along) * self.length[rows] < 0.999 * spacing[rows]
        return np.where(near, self.start[rows] + np.round(along) * self.length[rows], position)


@dataclass(frozen=True, eq=False)
class Reversals:
    """The side on which each of n axes is to be, -1, 0 or 1: first (n,), and how it changes: axis (T,); since, until
    (T,) [m] the places on the line between which it changes evenly from ``old`` to ``new`` (T,); in order, axis by
    axis."""

    line: MotorPath
    first: Floats
    axis: Ints
    since: Floats
    until: Floats
    old: Floats
    new: Floats

    @staticmethod
    def of(line: MotorPath, position: Floats, shares: Floats, restart: Bools, spacing: Floats) -> Reversals:
        """Of ``shares`` (S, n) of dead bands at stations at ``position`` (S,) [m], ``restart`` (S,) where nothing is
        known of how the motors came: a side holds until the band is crossed in the other sense, and what comes first
        holds from the start.  ``spacing`` (N,) [m]: no change is shorter, and none starts or ends so near to a
        target."""
        by_axis: list[tuple[Floats, ...]] = []
        start = np.zeros(shares.shape[1])
        again = np.maximum.accumulate(np.where(restart, np.arange(len(restart)), -1))
        for axis, share in enumerate(shares.T):
            crossed = np.abs(share) > CROSSED
            events = np.flatnonzero(crossed)
            value = np.sign(share[events])
            start[axis] = value[0] if len(value) else 0.0
            turns = np.flatnonzero(value[1:] != value[:-1])
            first, last = events[turns], events[turns + 1]
            # nothing is known of a side in between: it changes there
            first, last = np.maximum(first, again[last] - 1), np.where(again[last] > first, again[last], last)
            # to and fro at one place is nothing, once more is once
            since, starts, times = np.unique(
                line.drawn(position[first], spacing), return_index=True, return_counts=True
            )
            odd = times % 2 == 1
            since, last, old = since[odd], last[(starts + times - 1)[odd]], value[turns[starts[odd]]]
            least = since + spacing[line.place(since)[0]]
            reached = np.maximum(position[last], least)
            until = line.drawn(reached, spacing)
            row, _ = line.place(reached)
            until = np.where(until > since, until, line.start[row] + line.length[row])
            until = np.minimum(until, np.maximum(np.append(since[1:], np.inf), since))
            by_axis.append((np.full(len(since), axis), since, until, old, -old))
        whole = [np.concatenate(parts) for parts in zip(*by_axis, strict=True)]
        return Reversals(line, start, whole[0].astype(np.int64), *whole[1:])

    def at(self, rows: Ints, along: Floats | None = None) -> Floats:
        """(K, n) at the shares ``along`` (K,) of the paths of the motions ``rows`` (K,), at their ends without."""
        position = self.line.position(rows, 1.0 if along is None else along)
        values = np.tile(self.first, (len(rows), 1))
        for axis in np.unique(self.axis).tolist():
            own = self.axis == axis
            knots = np.stack([self.since[own], self.until[own]], axis=1).ravel()
            sides = np.stack([self.old[own], self.new[own]], axis=1).ravel()
            values[:, axis] = np.interp(position, knots, sides)
        return values


@dataclass(frozen=True, eq=False)
class LostMotion:
    """The play of n axes at stations (S) of a program.

    programmed: as the uncorrected program runs.  wanted: the sides that corrections are made for.  A joint that is to
    turn round wants its motor on the other side of the gap at once, so they follow the sense of the joint's own motion,
    but for what is less than a dead band.
    row, share (S,): the stations; axes (S, n): programmed; aim (S, n): where the motors of a correction go, but for the
    lost motion itself; moved (S,): a correction is made there; restart (S,): it is not known how the motors came there;
    gap (n,) [rad, m] lost by each axis, 0 where none is.
    """

    programmed: GapSides
    wanted: Reversals
    row: Ints
    share: Floats
    axes: Floats
    aim: Floats
    moved: Bools
    restart: Bools
    gap: Floats

    def run(self, gain: float) -> GapSides:
        """As the program runs with the share ``gain`` of its correction made: the motors are not where a joint is
        wanted before they have crossed the gap."""
        return GapSides.of(self.programmed.key, self.motors(gain), self.programmed.gap, self.restart)

    def motors(self, gain: float) -> Floats:
        """(S, n) [rad, m] where they are at the stations then."""
        ahead = self.aim + 0.5 * self.gap * self.wanted.at(self.row, self.share) - self.axes
        return self.axes + np.where(self.moved[:, None], gain * ahead, 0.0)
