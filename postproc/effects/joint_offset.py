"""Joint offset: the zero of a joint is not where the controller believes."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.base.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Values, column, per_joint
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class JointOffset(Offset):
    """offset_i = o_i [rad] (a sliding joint: [m]): joint i is at what the controller believes, plus o_i."""

    name = "joint_offset"
    family = "geometric"
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.parameters = per_joint(
            joints, "o", ("rad", "m"), -0.2, 0.2, "kinematic calibration: mastering error"
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        offset[chain.motors] += column(values, self.parameters)
