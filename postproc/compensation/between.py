"""How far the tool is from the wanted way between the points that a controller is sent to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.compensation.mirror import difference
from postproc.compensation.task import Task
from postproc.compensation.ways import between
from postproc.geometry import Poses, arc_in_plane, arc_through, lengths, on_arc
from postproc.units import DEG, MM

SHARES = (0.25, 0.5, 0.75)
"""Where the way between two points is looked at; an error that grows from both of them is largest in the middle."""

SHORT, LITTLE = 30 * MM, 3 * DEG
"""Of a piece that is shorter and turns by less the middle tells enough."""


@dataclass(frozen=True)
class Pieces:
    """K pieces of ways, as a controller makes them.

    rows (K,): the motion each belongs to; first, last (K,): the shares of its way where the piece begins and ends;
    begin, end: TCP commands in the robot base; centre, normal (K, 3), sweep (K,): of arcs, NaN for straight pieces.
    """

    rows: Ints
    first: Floats
    last: Floats
    begin: Poses
    end: Poses
    centre: Floats
    normal: Floats
    sweep: Floats

    @staticmethod
    def straight(rows: Ints, first: Floats, last: Floats, begin: Poses, end: Poses) -> Pieces:
        none = np.full((len(rows), 3), np.nan)
        return Pieces(rows, first, last, begin, end, none, none, np.full(len(rows), np.nan))

    @staticmethod
    def round(
        rows: Ints, first: Floats, last: Floats, begin: Poses, via: Poses, end: Poses, normal: Floats
    ) -> Pieces:
        """Arcs through ``via``; about ``normal`` (K, 3), with what is left along it in proportion, or where that is NaN
        in the plane of the three points."""
        points = begin.position, via.position, end.position
        axis = np.where(np.isnan(normal), arc_through(*points)[1], normal)
        return Pieces(rows, first, last, begin, end, *arc_in_plane(*points, axis))

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, chosen: Ints) -> Pieces:
        return Pieces(
            self.rows[chosen],
            self.first[chosen],
            self.last[chosen],
            self.begin[chosen],
            self.end[chosen],
            self.centre[chosen],
            self.normal[chosen],
            self.sweep[chosen],
        )

    def at(self, share: Floats) -> Poses:
        """Commands (K) at the shares (K,) of the pieces."""
        found = between(self.begin, self.end, share)
        bent = np.flatnonzero(np.isfinite(self.sweep))
        if len(bent):
            found.position[bent] = on_arc(
                self.begin.position[bent],
                self.end.position[bent],
                self.centre[bent],
                self.normal[bent],
                self.sweep[bent],
                share[bent],
            )
        return found


def errors_between(
    task: Task, pieces: Pieces, from_begin: Bools | None = None, left: float = 0.0
) -> tuple[Floats, Floats]:
    """Largest distance (K,) [m] of the predicted tool from the wanted way, and largest angle (K,) [rad] from the wanted
    orientation, inside of each piece; infinite where the robot can not be there.

    Along the way the tool may be early or late: only what it is beside the way counts.  ``from_begin`` (K,): pieces
    that are looked at where they begin as well (another ended there in its own place).  ``left``: the share of the
    error without a correction that is meant to stay, and is none.
    """
    length = lengths(pieces.end.position - pieces.begin.position)
    _, turn = difference(pieces.end, pieces.begin)
    long = (length > SHORT) | (lengths(turn) > LITTLE) | np.isfinite(pieces.sweep)
    off, angle = np.zeros(len(pieces)), np.zeros(len(pieces))
    for share in SHARES:
        chosen = np.flatnonzero(long | (share == 0.5))
        if len(chosen):
            here = _errors(task, pieces if len(chosen) == len(pieces) else pieces[chosen], share, left)
            off[chosen] = np.maximum(off[chosen], here[0])
            angle[chosen] = np.maximum(angle[chosen], here[1])
    if from_begin is not None and from_begin.any():
        chosen = np.flatnonzero(from_begin)
        here = _errors(task, pieces[chosen], 0.0, left)
        off[chosen], angle[chosen] = np.maximum(off[chosen], here[0]), np.maximum(angle[chosen], here[1])
    return off, angle


def _errors(task: Task, pieces: Pieces, share: float, left: float) -> tuple[Floats, Floats]:
    """As ``errors_between``, at one share of each piece."""
    rows = pieces.rows
    along = pieces.first + share * (pieces.last - pieces.first)
    wanted = task.ways.at(rows, along)
    wrench = task.force.along(rows, along)
    real = task.real(rows, pieces.at(np.full(len(rows), share)), wrench)
    goal = task.goal(rows, wanted)
    shift, turn = task.off(rows, real.pose, goal)
    if left:
        without = task.off(rows, task.real(rows, wanted, wrench).pose, goal)
        shift, turn = shift - left * without[0], turn - left * without[1]
    tangent = task.ways.tangent(rows, along)
    shift = shift - np.sum(shift * tangent, axis=1, keepdims=True) * tangent
    good = real.reachable & real.settled
    off, angle = (np.where(good, lengths(part), np.inf) for part in (shift, turn))
    return off, angle
