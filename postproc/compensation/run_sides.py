"""On which side of its gap each axis lies while a controller runs a path, with its approximated corners rounded off.

While a motor crosses its gap the joint is at rest, wherever in the gap the motor is.  Where it starts and ends to cross
follows from the path that is run: on the parabola of an approximated point the motor sets out for the other side before
the point and is there after the next one.  Sides of the polygon together with places on its parabolas would be states
that no machine passes, with errors of the whole rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.compensation.gap_sides import GapSides, LostMotion
from postproc.compensation.problem import CompensationProblem
from postproc.robot.inverse import inverse

ON_LINE, ON_PARABOLA = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9)
"""Where motions near a crossing have stations: shares of their length, and of the reach of the parabolas at their
ends."""


SAME_PLACE = 1e-12
"""Share of a motion that is none."""


@dataclass(frozen=True, eq=False)
class Stations:
    """S places on motions, in order.  motion, share (S,): of the run and of its path; row, along (S,): of the program
    that the task has, and of its path; motor (S, n) [rad, m]; restart (S,): it is not known how the motors came there.
    """

    motion: Ints
    share: Floats
    row: Ints
    along: Floats
    motor: Floats
    restart: Bools

    def joined(self, other: Stations) -> Stations:
        """Both, in order."""
        motion, share = (
            np.concatenate([getattr(one, name) for one in (self, other)]) for name in ("motion", "share")
        )
        order = np.argsort(2.0 * motion + share, kind="stable")
        both = (
            np.concatenate([getattr(one, name) for one in (self, other)])[order]
            for name in self.__dataclass_fields__
        )
        return Stations(*both)

    def with_ends(self, motion: Ints, row: Ints, along: Floats) -> Stations:
        """These and the ends of the motions ``motion`` (K,), at the shares ``along`` (K,) of the paths of ``row`` (K,),
        between two stations of their paths: there every axis is monotone.  Of a motion without a station no side would
        be known."""
        key, end = 2.0 * self.row + self.along, 2.0 * row + along
        later = np.minimum(np.searchsorted(key, end - SAME_PLACE), len(key) - 1)
        before = np.maximum(later - 1, 0)
        new = (self.row[later] == row) & (key[later] > end + SAME_PLACE) & (later > 0)
        new &= (self.row[before] == row) | ~self.restart[later]
        later, before, end = later[new], before[new], end[new]
        since = np.maximum(key[before], 2.0 * row[new])
        part = ((end - since) / (key[later] - since))[:, None]
        motor = self.motor[before] + part * (self.motor[later] - self.motor[before])
        count = int(new.sum())
        return self.joined(
            Stations(motion[new], np.ones(count), row[new], along[new], motor, np.zeros(count, bool))
        )

    def sides(self, lost: LostMotion) -> GapSides:
        """The play of the motors."""
        key = 2.0 * self.motion + self.share
        return GapSides.of(key, self.motor, lost.programmed.gap, self.restart)

    def crossing(self, lost: LostMotion) -> Ints:
        """Motions (K,) on which an axis is inside of its gap, and those beside them."""
        inside = self.sides(lost).inside(lost.gap > 0)
        return np.unique(np.concatenate([inside - 1, inside, inside + 1]))


def rounded_sides(
    task: CompensationProblem,
    stations: Stations,
    motions: Ints,
    added: Stations,
    commands: Callable[[Ints, Floats], Poses],
) -> GapSides:
    """The play along ``stations`` and what is ``added`` to them, with the motors where the ``commands`` at motions (K,)
    and shares (K,) are of all that lie on ``motions`` (K,)."""
    assert task.lost_motion is not None
    known, order = task.lost_motion.programmed, task.lost_motion.row >= 0
    both = stations.joined(added)
    some = np.flatnonzero(np.isin(both.motion, motions) & (both.row >= 0))
    row, along = both.row[some], both.along[some]
    near = np.stack(
        [np.interp(2.0 * row + along, known.key[order], column[order]) for column in known.motor.T], axis=1
    )
    axes = axes_at(task, row, along, commands(both.motion[some], both.share[some]), near)
    motor = both.motor.copy()
    motor[some] = axes
    good = np.isfinite(motor).all(axis=1)
    moved = replace(both, motor=motor)
    return Stations(*(getattr(moved, name)[good] for name in moved.__dataclass_fields__)).sides(
        task.lost_motion
    )


def axes_at(task: CompensationProblem, row: Ints, along: Floats, command: Poses, near: Floats) -> Floats:
    """(S, n) [rad, m] axes of which the controller brings the tool to ``command`` (S) at the shares ``along`` (S,) of
    the paths of ``row`` (S,), of the branch of these motions and the turns nearest to ``near`` (S, n); NaN where they
    are out of reach."""
    flange = command @ task.tool.shared(row).inverse()
    if (placed := task.robot_from_path(row, along)) is not None:
        flange = placed @ flange
    solution = inverse(task.model.robot.nominal, flange, task.track.branch[row], near)
    return np.where(solution.reachable[:, None], solution.q, np.nan)
