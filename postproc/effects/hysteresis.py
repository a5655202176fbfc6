"""Hysteresis: friction in the gear lets a joint stop short of its place, on the side it came from."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.base.arrays import Floats
from postproc.effects.effect import WORN, Conditions, Offset, Values, column, per_joint
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class Hysteresis(Offset):
    """offset_i = -(w_i / 2) d_i with w_i [rad] the whole width and d_i in -1..1 the share of half of it by which the
    motor of joint i is ahead (see ``play``): -1 or 1 the sense in which it came, where that was further than the width.

    The offset adds to the joint's own coordinate; it is none where the conditions know no direction.  Along a path it
    follows from the order of the motions, of measured states where it is not stated with them.
    """

    name = "hysteresis"
    family = "gear"
    by_direction = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "width of the hysteresis loop of a gear at reversal"
        self.parameters = per_joint(joints, "w", ("rad", "m"), 0.0, 0.02, source, plausible=WORN)

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        if conditions.direction is not None:
            offset[chain.motors] -= 0.5 * column(values, self.parameters) * conditions.direction.T
