"""Ramps of the wrench: where it steps inside a cut, it goes over along a stretch of the path.

A force does not jump in zero length: it changes while the engagement does, over about the tool's radius.  At the path
length s after the vertex where a motion starts, the force w_old that ends there still acts with the rest of the ramp,

    w(s) = w_new(s) - max(0, 1 - s / r) D(s),    D(s) = w_new(s) - w_old

so that the motion before keeps its own force up to the vertex, the new one is whole at s = r, and no force between
is larger than both.  D follows what w_new does: on an arc along which it turns as written here; along other motions
the product is straight between their ends, and D that of the last vertex where the ramp ends between them.  Steps that
lie nearer to each other than r add up, and behind the next one D stays.  Where the force changes inside of a motion, as
at entries and exits, parts of the same form with a constant D add up to its profile.  A share of the step may go over
before its vertex, along the motions that lead to it: the same, read backwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints

Sides = Callable[[Ints], tuple[Floats, Floats, Bools]]
"""Of motions (M,): the wrench (M, 6) [N, N m] where each starts and where it ends, and whether it turns (M,)."""


@dataclass(frozen=True, eq=False)
class Ramps:
    """E parts of ramps, one for each motion that a ramp leads over, ascending by motion.

    row (E,): the motion; start (E,) [m]: path length from the step to where the motion starts; extent (E,) [m]: length
    of the motion; length (E,) [m]: of the whole ramp, > 0; step, end (E, 6) [N, N m]: new minus old wrench where the
    motion starts and where it ends, robot base axes, of ``before`` old minus new; inside (E,): part of the profile of
    its motion, no step; before (E,): it leads to its step: start and step are of where the motion ends.
    vertex (E,): the motion that starts with the step; share (E,): how much of the step goes over in this ramp.
    turning (E,): along the motion the wrench turns: there the difference is ``step`` + ``share`` times the wrench.
    """

    row: Ints
    start: Floats
    extent: Floats
    length: Floats
    step: Floats
    end: Floats
    inside: Bools
    before: Bools
    vertex: Ints
    share: Floats
    turning: Bools

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
        row, whose = row[order], np.repeat(np.arange(len(rows)), count)[order]
        never = np.zeros(len(row), bool)
        constant = step[whose]
        return Ramps(
            row,
            start[order],
            extent[row],
            length[whose],
            constant,
            constant,
            never,
            never,
            rows[whose],
            np.ones(len(row)),
            never,
        )

    @staticmethod
    def leading(rows: Ints, step: Floats, length: Floats, extent: Floats, carries: Bools) -> Ramps:
        """As ``of``, of ramps that end where the motions ``rows`` (K,) start: the same from the end of the program.
        step (K, 6) [N, Nm], length (K,) [m]; extent (N,) [m], carries (N,): of all motions.
        """
        last = len(carries) - 1
        back = Ramps.of(last + 1 - rows, -step, length, extent[::-1], carries[::-1])
        turned = Ramps(*(getattr(back, one.name)[::-1] for one in fields(back)))
        ahead = np.ones(len(turned.row), bool)
        return replace(turned, row=last - turned.row, vertex=last + 1 - turned.vertex, before=ahead)

    def following(self, rows: Ints, early: Floats, sides: Sides) -> Ramps:
        """The same with differences that follow the wrench of the motions that the ramps lead over.

        rows (K,): all motions that start with a step, ascending; early (K,): how much of each goes over before it;
        sides: as of ``Sides``, without any ramps.
        """
        if not len(self.row):
            return self
        place = np.searchsorted(rows, self.vertex)
        share = np.where(self.before, early[place], 1.0 - early[place])
        motions = np.unique(self.row)
        begin, end, turns = sides(motions)
        changed = np.vstack([np.zeros(6), np.cumsum(end - begin, axis=0)])
        # behind the next step a difference stays
        first, stop = np.append(0, rows)[place], np.append(rows, motions[-1] + 1)[place + 1]
        follows = np.where(self.before, self.row >= first, self.row < stop)
        near = np.where(self.before, np.maximum(self.row + 1, first), np.minimum(self.row, stop))
        far = np.where(follows, np.where(self.before, self.row, self.row + 1), near)
        origin, near, far = (changed[np.searchsorted(motions, at)] for at in (self.vertex, near, far))
        step = self.step + share[:, None] * (near - origin)
        last = step + share[:, None] * (far - near)
        at = np.searchsorted(motions, self.row)
        turning = np.flatnonzero(follows & turns[at])
        side = np.where(self.before[turning, None], end[at[turning]], begin[at[turning]])
        step[turning] -= share[turning, None] * side
        last[turning] = step[turning]
        mask = np.zeros(len(self.row), bool)
        mask[turning] = True
        return replace(self, step=step, end=last, share=share, turning=mask)

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
        row, length, step = row[some], length[some], step[some]
        never = np.zeros(len(row), bool)
        return Ramps(
            row,
            np.zeros(len(row)),
            extent[row],
            length,
            step,
            step,
            ~never,
            never,
            row,
            np.ones(len(row)),
            never,
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
        return row, share, self.at(row, share, np.zeros((len(row), 6)))

    def joined(self, other: Ramps) -> Ramps:
        """Both, in their order."""
        order = np.argsort(np.concatenate([self.row, other.row]), kind="stable")
        pairs = ((getattr(self, one.name), getattr(other, one.name)) for one in fields(self))
        return Ramps(*(np.concatenate(pair)[order] for pair in pairs))

    def at(self, rows: Ints, share: Floats, wrench: Floats) -> Floats:
        """(K, 6) what the ramps add to the new wrench ``wrench`` (K, 6) at the shares ``share`` (K,) of the motions
        ``rows`` (K,)."""
        added = np.zeros((len(rows), 6))
        first = np.searchsorted(self.row, rows, "left")
        count = np.searchsorted(self.row, rows, "right") - first
        for i in range(int(count.max(initial=0))):
            some = np.flatnonzero(count > i)
            part = first[some] + i
            ahead = np.where(self.before[part], 1.0 - share[some], share[some])[:, None]
            start, extent, length = (a[part, None] for a in (self.start, self.extent, self.length))
            step, end = self.step[part], self.end[part]
            turned = np.where(self.turning[part], self.share[part], 0.0)[:, None] * wrench[some]
            here = np.maximum(1.0 - (start + ahead * extent) / length, 0.0) * (step + turned)
            there = np.maximum(1.0 - (start + extent) / length, 0.0)
            added[some] -= here + ahead * there * (end - step)
        return added

    def steps(self) -> tuple[Ints, Floats, Floats]:
        """Motions (K,) that start with a step, ascending, the lengths (K,) [m] of its ramps, and the shares (K,) of it
        that go over before."""
        rows, at = np.unique(self.vertex[~self.inside], return_inverse=True)
        length, early = np.zeros(len(rows)), np.zeros(len(rows))
        np.maximum.at(length, at, self.length[~self.inside])
        early[at] = np.where(self.before, self.share, 1.0 - self.share)[~self.inside]
        return rows, length, early

    def ends(self) -> tuple[Ints, Floats]:
        """Motions (E',) inside of which a ramp ends, ascending, and the shares of their length (E',) where it does."""
        remaining = self.length - self.start
        inside = (remaining > 0.0) & (remaining < self.extent)
        row, share = self.row[inside], remaining[inside] / self.extent[inside]
        share = np.where(self.before[inside], 1.0 - share, share)
        order = np.lexsort((share, row))
        return row[order], share[order]
