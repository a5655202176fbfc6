"""What acts on a batch of poses, and in which configuration the robot reaches them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses
from postproc.effects import Conditions


@dataclass(frozen=True)
class LoadCase:
    """Of N poses of the tool.

    tool: TCP on the flange (N), or one pose for all; wrench (N, 6) [N, N m] on the tool at the TCP, robot base axes;
    conditions: what else is known of N states; branch (N,): that of the inverse kinematics; q_reference (N, n)
    [rad, m]: joint values by which the turns are chosen.
    """

    tool: Poses
    wrench: Floats
    conditions: Conditions
    branch: Ints
    q_reference: Floats

    def part(self, rows: Any) -> LoadCase:
        """Of some poses: numbers (K,), a mask (N,), or a slice, which copies nothing."""
        return LoadCase(
            self.tool if self.tool.position.ndim == 1 else self.tool[rows],
            self.wrench[rows],
            self.conditions.part(rows),
            self.branch[rows],
            self.q_reference[rows],
        )
