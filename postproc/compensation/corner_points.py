"""Where points are inserted around an approximated corner, so that its rounded path can follow the original's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import lengths
from postproc.compensation.corners import LITTLE, Corners
from postproc.compensation.path_error import PathSegments
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.rounded_path import RoundedOutput, original_reach
from postproc.compensation.subdivision import Limits, Subdivision

ALONE = 0.5
"""Share of a corner's error that remains where its own point is moved: the rest changes sides."""

WITH_OTHERS = 0.375
"""And with a point inserted on each side of it, as far from it as it is rounded twice."""

AIM = 0.9
"""Share of the allowed error that a choice of points aims at."""

SAGITTA = 0.1
"""Share of the tolerance by which an arc leaves its chord at least: less is lost in the digits of its points."""


@dataclass(frozen=True)
class ChosenPoints:
    """G corners to be fitted.  corner (G,): motions of the division that end in them; before (G,): their errors in
    parts of the allowed one; inner (G,): their own points are moved onto the rounded path.  Inserted (A,): group (A,),
    the corner; row (A,), share (A,): where.  own_place (G, 3), place (A, 3) [m]: commands at which the points
    are to be, where they were fitted already, on ramps of the force."""

    corner: Ints
    before: Floats
    inner: Bools
    group: Ints
    row: Ints
    share: Floats
    own_place: Floats | None = None
    place: Floats | None = None


class PointChooser:
    """Chooses points for one corner after the other; segments that have points of two corners have room for both."""

    def __init__(
        self,
        task: CompensationProblem,
        division: Subdivision,
        limits: Limits,
        free: Bools,
        corners: Corners,
        before: Floats,
    ) -> None:
        """free (N,): motions before whose end something may be inserted; before (K,): errors of the ``corners`` (K), in
        parts of the allowed one."""
        self.task, self.division, self.limits, self.free = task, division, limits, free
        self.corners, self.before = corners, before
        self.output = RoundedOutput(task, division, corners.motion)
        # of each segment, what the corners at its start and at its end take of its length [m]
        self.taken = np.zeros((2, len(self.output.motions)))

    def choose(self, remaining: Floats | float = 0.0) -> ChosenPoints:
        """Points of all corners, the worst first, as many as may be inserted; where ``remaining`` (K,) is more than the
        error before, by that, and outside of what the program rounds off where that is shorter than a motion."""
        errors = np.maximum(self.before, remaining)
        self.taken[1], self.taken[0, 1:] = 2.0 * self.output.reach, 2.0 * self.output.reach[:-1]
        spare = self.limits.inserted(len(self.task.toolpath)) - self.division.inserted
        places = self.output.place(self.corners.motion)
        own = original_reach(self.task, self.corners.row)
        at_end = self.division.share[self.corners.motion] == 1.0
        own = np.where(at_end & (self._rounded_off(places, own) > LITTLE * self.task.tolerance), own, 0.0)
        inner = np.zeros(len(places), bool)
        found: list[tuple[int, int, float]] = []
        for k in np.argsort(-errors, kind="stable").tolist():
            if errors[k] * ALONE <= AIM or spare < 1:
                continue
            outside = errors[k] > self.before[k] and 2.0 * own[k] < self._least(int(places[k]))
            rounding = 0.0 if outside else float(own[k])
            points, inside = self._around(int(places[k]), rounding, float(errors[k]))
            if 0 < len(points) <= spare:
                found += [(k, *point) for point in points]
                inner[k], spare = inside, spare - len(points)
        group, row, share = zip(*found, strict=True) if found else ((), (), ())
        return ChosenPoints(
            self.corners.motion,
            self.before,
            inner,
            np.array(group, np.int64),
            np.array(row, np.int64),
            np.array(share, float),
        )

    def _rounded_off(self, places: Ints, reach: Floats) -> Floats:
        """(K,) [m] by how much the program rounds off the corners at the ends of the segments ``places`` (K,), from
        ``reach`` (K,) [m] on: straight on there is nothing to follow."""
        path, segments = self.task.desired_path, self.output.segments
        rows, ones = segments.rows[places], np.ones(len(places))
        later = np.minimum(rows + 1, len(path.length) - 1)
        return 0.25 * reach * lengths(path.tangent(later, 0.0 * ones) - path.tangent(rows, ones))

    def _around(self, at: int, rounding: float, before: float) -> tuple[list[tuple[int, float]], bool]:
        """Rows and shares of points around the corner at the end of the segment ``at``, which the original rounds off
        from ``rounding`` [m] on; and whether some of them are inside of what it rounds off."""
        segments, reach = self.output.segments, float(self.output.reach[at])
        sides = [self._side(segments, at + k, k) for k in (0, 1)]
        least = max(side[0] for side in sides)
        wanted = 2.0 * reach * min(1.0, AIM / (WITH_OTHERS * before))
        pieces = 1
        if rounding > 0:
            pieces = int(np.ceil(2.0 * rounding / max(wanted, 1e-9))) // 2 * 2 + 1
            while pieces > 1 and 2.0 * rounding / pieces < least:
                pieces -= 2
            step = 2.0 * rounding / pieces
        else:
            step = max(wanted, least)
        while True:
            count = (pieces - 1) // 2 + 1
            if step < least:
                return [], False
            if all(count * step + least <= side[1] for side in sides) or pieces == 1:
                break
            pieces -= 2
            step = 2.0 * rounding / pieces
        points: list[tuple[int, float]] = []
        for side, (_, room, row, share, length) in enumerate(sides):
            if count * step + least > room:
                continue
            for number in range(1, count + 1):
                away = number * step / length
                points.append((row, share + away if side else share - away))
            self.taken[1 - side, at + side] = count * step + least
        return points, pieces > 1 and len(points) == 2 * count

    def _least(self, at: int) -> float:
        """[m] the shortest motion beside the corner at the end of the segment ``at``."""
        return max(self._side(self.output.segments, at + k, k)[0] for k in (0, 1))

    def _side(self, segments: PathSegments, at: int, later: int) -> tuple[float, float, int, float, float]:
        """Of the segment ``at``, before a corner or ``later`` than it: the shortest step [m], the room [m] for points,
        its row, the share where the corner is, and the length [m] of the row's path."""
        row = int(segments.rows[at])
        length = float(self.task.desired_path.length[row])
        first, last = float(segments.first[at]), float(segments.last[at])
        least = self._spacing(row)
        if np.isfinite(segments.sweep[at]):
            radius = float(self.output.extent[at] / abs(segments.sweep[at]))
            least = max(least, float(_with_sagitta(radius, self.task.tolerance)))
        room = (last - first) * length - float(self.taken[later, at])
        return least, room if self.free[row] else 0.0, row, first if later else last, length

    def _spacing(self, row: int) -> float:
        feed = float(np.nan_to_num(self.task.toolpath.feed[row]))
        return max(self.limits.ramp_end, feed * self.limits.cycle)


def shortest_arc(task: CompensationProblem, rows: Ints) -> Floats:
    """(K,) [m] the shortest pieces of the arcs ``rows`` (K,)."""
    centre = task.desired_path.circles(rows)[0]
    radius = lengths(task.desired_path.at(rows, np.zeros(len(rows))).position - centre)
    return np.asarray(_with_sagitta(radius, task.tolerance))


def _with_sagitta(radius: Floats | float, tolerance: float) -> Floats:
    """(...) [m] the shortest arcs that are distinguished from their chords."""
    return np.asarray(np.sqrt(8.0 * SAGITTA * tolerance * np.asarray(radius)))
