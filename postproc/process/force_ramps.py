"""Ramps of the wrench: where it steps inside a cut, it goes over along a stretch of the path.

A force does not jump in zero length: it changes while the engagement does, over about the tool's radius.  A step dw
at the vertex where a motion starts acts, at the path length s after that vertex, as

    w(s) = w_new(s) - max(0, 1 - s / r) C(s) C(0)^T dw

so that the motion before keeps its own force up to the vertex, and the new one is whole at s = r.  C is the frame in
which the new force is stated: where it turns with the path, what remains of the old force turns too, and none between
is larger than both.  At a vertex where the frame turns the mean of both sides acts, as of the wrench itself; between
the ends of a straight motion what is added is straight, from its last vertex where the ramp ends in it.  Behind the
next step, or where forces are stated in another frame, the step stays as it came there.  Steps that lie nearer to each
other than r add up.  Where the force changes inside of a motion, as at entries and exits, parts of the same form add up
to its profile.  A share of the step may go over before its vertex, along the motions that lead to it: the same, read
backwards.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.process.force_turning import Turning


@dataclass(frozen=True, eq=False)
class Ramps:
    """E parts of ramps, one for each motion that a ramp leads over, ascending by motion.

    row (E,): the motion; start (E,) [m]: path length from the step to where the motion starts; extent (E,) [m]: length
    of the motion; length (E,) [m]: of the whole ramp, > 0; step, end (E, 6) [N, N m]: new minus old wrench where the
    motion starts and where it ends, robot base axes, of ``before`` old minus new; inside (E,): part of the profile of
    its motion, no step; before (E,): it leads to its step: start and step are of where the motion ends.
    vertex (E,): the motion that starts with the step; share (E,): how much of the step goes over in this ramp.
    on_arc (E,): between its ends the step turns with the arc, by ``turning``.
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
    on_arc: Bools
    turning: Turning | None = None

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
        count = np.minimum(last, stop) - rows
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
        turned = replace(back, **{name: getattr(back, name)[::-1] for name in _COLUMNS})
        ahead = np.ones(len(turned.row), bool)
        return replace(turned, row=last - turned.row, vertex=last + 1 - turned.vertex, before=ahead)

    def shared(self, rows: Ints, early: Floats) -> Ramps:
        """The same, of steps at the start of ``rows`` (K,), ascending, of which the shares ``early`` (K,) go over
        before them."""
        place = early[np.searchsorted(rows, self.vertex)]
        return replace(self, share=np.where(self.before, place, 1.0 - place))

    def turned(self, turning: Turning, breaks: Bools) -> Ramps:
        """The same with steps that turn with the frames of the motions that the ramps lead over.

        breaks (N,): motions that do not continue the frame of the motion before, or start with a step.
        """
        first = self.vertex - self.before  # the motion of the vertex, in whose frame the step is
        some = np.flatnonzero(turning.turns[first])
        row, first, before = self.row[some], first[some], self.before[some]
        broken = np.append(np.flatnonzero(breaks), len(breaks))
        stop = broken[np.searchsorted(broken, first, "right")]
        begin = broken[np.searchsorted(broken, first, "right") - 1]
        last = np.clip(row, begin, stop - 1)
        stays = last != row

        step = self.step[some].reshape(-1, 2, 3)
        side = before.astype(int)
        own = _ends(turning, first, side) @ np.swapaxes(step, 1, 2)

        def at_end(side: Ints) -> Floats:
            """(E', 6) the steps where the motions ``last`` start (``side`` 0) or end (1)."""
            here = np.swapaxes(_ends(turning, last, side), 1, 2) @ own
            beside = np.clip(np.where(side, last + 1, last - 1), begin, stop - 1)
            inner = np.flatnonzero(beside != last)
            there = np.swapaxes(_ends(turning, beside[inner], 1 - side[inner]), 1, 2) @ own[inner]
            here[inner] = 0.5 * (here[inner] + there)
            return np.swapaxes(here, 1, 2).reshape(-1, 6)

        far = at_end(1 - side)
        near = np.where(stays[:, None], far, at_end(side))
        steps, ends, on_arc = self.step.copy(), self.end.copy(), self.on_arc.copy()
        known = np.isfinite(near + far).all(axis=1)
        steps[some[known]], ends[some[known]] = near[known], far[known]
        on_arc[some] = turning.mask[row] & ~stays & known
        return replace(self, step=steps, end=ends, on_arc=on_arc, turning=turning)

    @staticmethod
    def profile(row: Ints, share: Floats, rest: Floats, extent: Floats) -> Ramps:
        """Ramps that add up to the wrenches ``rest`` (P, 6) at the shares ``share`` (P,) of the motions ``row`` (P,),
        straight in between; ascending, from 0 to 1 in each motion, 0 at both ends.  extent (N,) [m]: of all motions.

        A function with the slopes m_1 .. m_k between s_0 = 0, s_1 .. s_k = 1 that ends at 0 is the sum of
        (m_(i+1) - m_i) s_i max(0, 1 - s / s_i), with m_(k+1) = 0.
        """
        same = row[1:] == row[:-1]
        apart = np.maximum(np.diff(share), 1e-12)  # from one motion to the next none is asked for
        slope = np.where(same[:, None], np.diff(rest, axis=0) / apart[:, None], 0.0)
        before, after = np.vstack([np.zeros(6), slope]), np.vstack([slope, np.zeros(6)])
        length = share * extent[row]
        step = share[:, None] * (before - after)
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
        return replace(self, **{name: getattr(self, name)[some] for name in _COLUMNS})

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
        pairs = {name: (getattr(self, name), getattr(other, name)) for name in _COLUMNS}
        turning = other.turning if self.turning is None else self.turning
        return Ramps(**{name: np.concatenate(pair)[order] for name, pair in pairs.items()}, turning=turning)

    def at(self, rows: Ints, share: Floats) -> Floats:
        """(K, 6) what the ramps add to the new wrench at the shares ``share`` (K,) of the motions ``rows`` (K,)."""
        added = np.zeros((len(rows), 6))
        first = np.searchsorted(self.row, rows, "left")
        count = np.searchsorted(self.row, rows, "right") - first
        for i in range(int(count.max(initial=0))):
            some = np.flatnonzero(count > i)
            part = first[some] + i
            ahead = np.where(self.before[part], 1.0 - share[some], share[some])[:, None]
            start, extent, length = (a[part, None] for a in (self.start, self.extent, self.length))
            step, end = self.step[part], self.end[part]
            here = np.maximum(1.0 - (start + ahead * extent) / length, 0.0)
            there = np.maximum(1.0 - (start + extent) / length, 0.0)
            rest = here * step + ahead * there * (end - step)
            arc = np.flatnonzero(self.on_arc[part])
            if self.turning is not None and len(arc):
                at, back = some[arc], self.before[part[arc], None]
                begin, stop = np.where(back, end[arc], step[arc]), np.where(back, step[arc], end[arc])
                rest[arc] = here[arc] * self.turning.along(rows[at], share[at], begin, stop)
            added[some] -= rest
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


_COLUMNS = tuple(one.name for one in fields(Ramps) if one.name != "turning")


def _ends(turning: Turning, rows: Ints, side: Ints) -> Floats:
    """(K, 3, 3) the frames of the motions ``rows`` (K,) where they start (``side`` (K,) 0) or end (1)."""
    frames = np.empty((len(rows), 3, 3))
    for which in (0, 1):
        some = np.flatnonzero(side == which)
        frames[some] = turning.ends(rows[some], which)
    return frames
