"""Forces stated in a frame that turns along the path: on an arc linear in that frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import turn_beside, turning
from postproc.process.feed_frames import FeedFrames


@dataclass(frozen=True, eq=False)
class Turning:
    """The frames that turn along the path.  ``mask`` (N,): arcs with such a frame; ``feed``, ``turns`` (N,): where the
    force is stated in the feed frame, and in any frame that turns and is known; ``base_in_robot``, ``tool_in_base``
    (N, 3, 3): frames at the ends; ``arc_turn``: as of ``PathLength``."""

    mask: Bools
    feed: Bools
    turns: Bools
    frames: FeedFrames | None
    base_in_robot: Floats
    tool_in_base: Floats
    arc_turn: Callable[[Ints], Floats]

    def breaks(self) -> Bools:
        """(N,) motions that do not continue the frame of the motion before."""
        kind = np.where(self.turns, 1 + self.feed, 0)
        return np.append(True, kind[1:] != kind[:-1])[: len(kind)]

    def ends(self, rows: Ints, side: int) -> Floats:
        """(K, 3, 3) the frames of the motions ``rows`` (K,) where they start (``side`` 0) or end (1): the rows of a
        matrix are its axes, in the robot's."""
        at = rows - (1 - side)
        matrices = np.swapaxes(self.base_in_robot[at] @ self.tool_in_base[at], 1, 2)
        chosen = np.flatnonzero(self.feed[rows])
        if self.frames is not None:
            matrices[chosen] = self.frames.end(rows[chosen], side)
        return matrices

    def along(self, rows: Ints, fraction: Floats, start: Floats, values: Floats) -> Floats:
        """(K, 6) C(t) ((1 - t) C(0)^T start + t C(1)^T values) [N, N m] at the shares ``fraction`` (K,) of motions
        ``rows`` (K,), ``start`` and ``values`` (K, 6), with the frame C in the robot's axes."""
        # tool in the robot where the motion starts, and how it turns along the path
        first_rotation, last_rotation = (
            self.base_in_robot[at] @ self.tool_in_base[at] for at in (rows - 1, rows)
        )
        arc = self.arc_turn(rows)
        turn = turn_beside(first_rotation, last_rotation, arc)

        def axes(share: Floats) -> Floats:
            """(K, 3, 3): the rows of a matrix are the axes of the frame."""
            matrices = np.swapaxes(turning(first_rotation, turn, arc, share), 1, 2)
            chosen = np.flatnonzero(self.feed[rows])
            if self.frames is not None:
                matrices[chosen] = self.frames.along(rows[chosen], share[chosen])
            return matrices

        first, here, last = axes(np.zeros_like(fraction)), axes(fraction), axes(np.ones_like(fraction))
        share = fraction[:, None, None]
        inside = (1 - share) * (start.reshape(-1, 2, 3) @ np.swapaxes(first, 1, 2))
        inside += share * (values.reshape(-1, 2, 3) @ np.swapaxes(last, 1, 2))
        return np.asarray((inside @ here).reshape(-1, 6))
