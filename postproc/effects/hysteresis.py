"""Hysteresis: friction in the gear lets a joint stop short of its place, on the side it came from."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Values, column, per_joint
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class Hysteresis(Offset):
    """offset_i = -(w_i / 2) d_i with w_i [rad] the whole width and d_i = -1, 0, 1 the sense in which joint i came.

    Where the sense is not measured it follows from the order of the states.
    """

    name = "hysteresis"
    family = "gear"
    by_direction = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "width of the hysteresis loop of a gear at reversal"
        self.parameters = per_joint(joints, "w", ("rad", "m"), 0.0, 0.02, source)

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        if conditions.direction is not None:
            offset[chain.motors] -= 0.5 * column(values, self.parameters) * conditions.direction.T
