"""Ramps of the wrench: where it steps inside a cut, it goes over along a stretch of the path.

A force does not jump in zero length: it changes while the engagement does, over about the tool's radius.  A step dw
at the vertex where a motion starts acts, at the path length s after that vertex, as

    w(s) = w_new(s) - dw max(0, 1 - s / r)

so that the motion before keeps its own force up to the vertex, and the new one is whole at s = r.  Steps that lie
nearer to each other than r add up.  Where the force changes inside of a motion, as at entries and exits, parts of the
same form add up to its profile.  A share of the step may go over before its vertex, along the motions that lead to it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Ramps:
    """E parts of ramps, one for each motion that a ramp leads over, ascending by motion.

    row (E,): the motion; start (E,) [m]: path length from the step to where the motion starts; extent (E,) [m]: length
    of the motion; length (E,) [m]: of the whole ramp, > 0; step (E, 6) [N, N m]: new minus old wrench, robot base axes,
    of ``before`` old minus new; inside (E,): part of the profile of its motion, no step; before (E,): it leads to its
    step: start is from where the motion ends.
    """

    row: Ints
    start: Floats
    extent: Floats
    length: Floats
    step: Floats
    inside: Bools
    before: Bools

    @staticmethod
    def of(rows: Ints, step: Floats, length: Floats, extent: Floats, carries: Bools) -> Ramps:
        """Ramps of ``length`` (K,) [m] that start with the motions ``rows`` (K,), where the wrench changes by ``step``
        (K, 6); extent (N,) [m]: lengths of all motions; carries (N,): motions with force: with the last of a cut ends
        its ramp."""
        n = len(carries)
        distance = np.concatenate([[0.0], np.cumsum(extent)])
        without = np.append(np.flatnonzero(~carries), n)
        stop = without[np.searchsorted(without, rows)]  # the first motion after the cut
        last = np.searchsorted(distance, distance[rows] + length, side="left")
        count = np.clip(last, rows + 1, stop) - rows
        row = np.repeat(rows, count) + (
            np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
        )
        start = distance[row] - np.repeat(distance[rows], count)
        order = np.argsort(row, kind="stable")
        return Ramps(
            row[order],
            start[order],
            extent[row[order]],
            np.repeat(length, count)[order],
            np.repeat(step, count, axis=0)[order],
            np.zeros(len(row), bool),
            np.zeros(len(row), bool),
        )

    @staticmethod
    def leading(rows: Ints, step: Floats, length: Floats, extent: Floats, carries: Bools) -> Ramps:
        """As ``of``, of ramps that end where the motions ``rows`` (K,) start: the same from the end of the program.
        step (K, 6) [N, Nm], length (K,) [m]; extent (N,) [m], carries (N,): of all motions.
        """
        last = len(carries) - 1
        back = Ramps.of(last + 1 - rows, -step, length, extent[::-1], carries[::-1])
        turned = Ramps(*(getattr(back, one.name)[::-1] for one in fields(back)))
        return replace(turned, row=last - turned.row, before=np.ones(len(turned.row), bool))

    @staticmethod
    def profile(row: Ints, share: Floats, rest: Floats, extent: Floats) -> Ramps:
        """Ramps that add up to the wrenches ``rest`` (P, 6) at the shares ``share`` (P,) of the motions ``row`` (P,),
        straight in between; ascending, from 0 to 1 in each motion, 0 at both ends.  extent (N,) [m]: of all motions.

        A function with the slopes m_1 .. m_k between s_0 = 0, s_1 .. s_k = 1 that ends at 0 is the sum of
        (m_(i+1) - m_i) s_i max(0, 1 - s / s_i), with m_(k+1) = 0.
        """
        same = row[1:] == row[:-1]
        apart = np.where(same, np.diff(share), 1.0)
        slope = np.where(same[:, None], np.diff(rest, axis=0) / np.maximum(apart, 1e-12)[:, None], 0.0)
        before, after = np.vstack([np.zeros(6), slope]), np.vstack([slope, np.zeros(6)])
        knot = share > 0
        row, share = row[knot], share[knot]
        length = share * extent[row]
        step = share[:, None] * (before - after)[knot]
        some = length > 0
        return Ramps(
            row[some],
            np.zeros(int(some.sum())),
            extent[row][some],
            length[some],
            step[some],
            np.ones(int(some.sum()), bool),
            np.zeros(int(some.sum()), bool),
        )

    def only(self, some: Bools) -> Ramps:
        """The parts ``some`` (E,)."""
        return Ramps(*(getattr(self, one.name)[some] for one in fields(self)))

    def places(self) -> tuple[Ints, Floats, Floats]:
        """Of profiles: the motions (P,), shares (P,) and wrenches (P, 6) that they were made of (see ``profile``)."""
        motions = np.unique(self.row)
        row = np.concatenate([self.row, motions])
        share = np.concatenate([self.length / self.extent, np.zeros(len(motions))])
        order = np.lexsort((share, row))
        row, share = row[order], share[order]
        return row, share, self.at(row, share)

    def joined(self, other: Ramps) -> Ramps:
        """Both, in their order."""
        order = np.argsort(np.concatenate([self.row, other.row]), kind="stable")
        pairs = ((getattr(self, one.name), getattr(other, one.name)) for one in fields(self))
        return Ramps(*(np.concatenate(pair)[order] for pair in pairs))

    def at(self, rows: Ints, share: Floats) -> Floats:
        """(K, 6) what the ramps add to the new wrench at the shares ``share`` (K,) of the motions ``rows`` (K,)."""
        added = np.zeros((len(rows), 6))
        first = np.searchsorted(self.row, rows, "left")
        count = np.searchsorted(self.row, rows, "right") - first
        for i in range(int(count.max(initial=0))):
            some = np.flatnonzero(count > i)
            part = first[some] + i
            ahead = np.where(self.before[part], 1.0 - share[some], share[some])
            distance = self.start[part] + ahead * self.extent[part]
            added[some] -= np.maximum(1.0 - distance / self.length[part], 0.0)[:, None] * self.step[part]
        return added

    def steps(self) -> tuple[Ints, Floats, Floats]:
        """Motions (K,) that start with a step, ascending, the lengths (K,) [m] of its ramps, and the shares (K,) of it
        that go over before."""
        at = np.flatnonzero((self.start == 0.0) & ~self.inside)
        vertex = self.row[at] + self.before[at]
        rows, whose = np.unique(vertex, return_inverse=True)
        length, size = np.zeros(len(rows)), np.linalg.norm(self.step[at], axis=1)
        np.maximum.at(length, whose, self.length[at])
        whole = np.bincount(whose, size, len(rows))
        early = np.bincount(whose, size * self.before[at], len(rows))
        return rows, length, early / np.where(whole > 0, whole, 1.0)

    def ends(self) -> tuple[Ints, Floats]:
        """Motions (E',) inside of which a ramp ends, ascending, and the shares of their length (E',) where it does."""
        remaining = self.length - self.start
        inside = (remaining > 0.0) & (remaining < self.extent)
        row, share = self.row[inside], remaining[inside] / self.extent[inside]
        share = np.where(self.before[inside], 1.0 - share, share)
        order = np.lexsort((share, row))
        return row[order], share[order]
