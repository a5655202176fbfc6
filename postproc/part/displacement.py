"""By what the predicted tool is displaced from where the program wants it, along every motion, in the axes of a
stock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import Poses, turned
from postproc.compensation.mirror import Prediction, pose_error
from postproc.compensation.path_error import PathSegments, programmed
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions


@dataclass(frozen=True, eq=False)
class Displacements:
    """Of the tools of a program as it is posted, or with ``division`` as it is compensated.

    in_stock (N, 3, 3): rotation of the programmed base of each motion to the stock; wrench: of motions (K,) at shares
    (K,) the wrench (K, 6) in path axes, that of the task where it is None.
    """

    task: CompensationProblem
    in_stock: Floats
    division: Subdivision | None = None
    wrench: Callable[[Ints, Floats], Floats] | None = None

    def __call__(self, motion: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Shift (K, 3) [m] and turn (K, 3) [rad] of the tool at the shares (K,) of motions (K,), in the axes of the
        stock; NaN where no equilibrium is known, zero where the path is not."""
        shift, turn = np.zeros((len(motion), 3)), np.zeros((len(motion), 3))
        known = np.flatnonzero(self.task.desired_path.traceable[motion])

        def look(part: slice) -> None:
            at = known[part]
            real, goal = self.predicted(motion[at], share[at])
            to_stock = self.to_stock(motion[at])
            lost = ~(real.reachable & real.settled)
            for values, part_of in zip((shift, turn), pose_error(real.pose, goal), strict=True):
                values[at] = turned(to_stock, part_of)
                values[at[lost]] = np.nan

        each_block(look, len(known))
        return shift, turn

    def to_stock(self, motion: Ints) -> Floats:
        """(K, 3, 3) from the robot base to the stock, of motions (K,)."""
        return np.asarray(self.in_stock[motion] @ np.swapaxes(self.task.base[motion].rotation, 1, 2))

    def wrench_at(self, motion: Ints, share: Floats) -> Floats:
        """(K, 6) [N, N m] the wrench at the shares (K,) of motions (K,), in path axes."""
        return (self.task.force.along if self.wrench is None else self.wrench)(motion, share)

    def predicted(
        self, motion: Ints, share: Floats, wrench: Floats | None = None
    ) -> tuple[Prediction, Poses]:
        """Where the tool is, and where it is to be, at the shares (K,) of motions (K,); under ``wrench`` (K, 6) where
        it is given."""
        segments = self._segments(motion, share)
        wide = segments.last - segments.first
        inside = np.where(wide > 0, (share - segments.first) / np.where(wide > 0, wide, 1.0), 0.0)
        task = self.task
        real = task.simulated(
            motion,
            segments.commands(task, inside),
            self.wrench_at(motion, share) if wrench is None else wrench,
            share=share,
            corrected=self.division is not None,
        )
        return real, task.goal(motion, task.desired_path.at(motion, share), share)

    def _segments(self, motion: Ints, share: Floats) -> PathSegments:
        if self.division is None:
            return programmed(self.task, motion)
        own, ends = self._ends
        place = np.searchsorted(ends, motion + np.clip(share, 0.0, 1.0) * (1 - 1e-9) - 1e-12)
        return subdivided_motions(self.task, self.division, own[place])

    @cached_property
    def _ends(self) -> tuple[Ints, Floats]:
        """Motions (L,) of the division without transition moves, and where they end as row plus share."""
        division = self.division
        assert division is not None
        own = np.flatnonzero(~division.transitions)
        return own, division.source[own] + division.share[own] * (1 - 1e-9)

    @property
    def traceable(self) -> Bools:
        """(N,) motions whose displacement is known."""
        return self.task.desired_path.traceable
