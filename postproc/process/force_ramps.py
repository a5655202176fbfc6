"""Ramps of the wrench: where it steps inside a cut, it goes over along a stretch of the path.

A force does not jump in zero length: it changes while the engagement does, over about the tool's radius.  A step dw
at the vertex where a motion starts acts, at the path length s after that vertex, as

    w(s) = w_new(s) - dw max(0, 1 - s / r)

so that the motion before keeps its own force up to the vertex, and the new one is whole at s = r.  Steps that lie
nearer to each other than r add up.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Ramps:
    """E parts of ramps, one for each motion that a ramp leads over, ascending by motion.

    row (E,): the motion; start (E,) [m]: path length from the step to where the motion starts; extent (E,) [m]: length
    of the motion; length (E,) [m]: of the whole ramp, > 0; step (E, 6) [N, N m]: new minus old wrench, robot base axes.
    """

    row: Ints
    start: Floats
    extent: Floats
    length: Floats
    step: Floats

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
        )

    def at(self, rows: Ints, share: Floats) -> Floats:
        """(K, 6) what the ramps add to the new wrench at the shares ``share`` (K,) of the motions ``rows`` (K,)."""
        added = np.zeros((len(rows), 6))
        first = np.searchsorted(self.row, rows, "left")
        count = np.searchsorted(self.row, rows, "right") - first
        for i in range(int(count.max(initial=0))):
            some = np.flatnonzero(count > i)
            part = first[some] + i
            distance = self.start[part] + share[some] * self.extent[part]
            added[some] -= np.maximum(1.0 - distance / self.length[part], 0.0)[:, None] * self.step[part]
        return added

    def ends(self) -> tuple[Ints, Floats]:
        """Motions (E',) inside of which a ramp ends, ascending, and the shares of their length (E',) where it does."""
        remaining = self.length - self.start
        inside = (remaining > 0.0) & (remaining < self.extent)
        row, share = self.row[inside], remaining[inside] / self.extent[inside]
        order = np.lexsort((share, row))
        return row[order], share[order]
