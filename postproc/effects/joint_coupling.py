"""Joint coupling: in a wrist one motor turns another axis a little as well."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.base.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Parameter, Values
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class JointCoupling(Offset):
    """offset_i = sum of r_ik q_k [rad] for the last three joints, k < i, q_k [rad] the motor as commanded: an error of
    the ratios that the controller uses.  The offset adds to the joint: it is at q_i + offset_i."""

    name = "joint_coupling"
    family = "geometric"

    def __init__(self, joints: Sequence[Joint]) -> None:
        last = range(max(0, len(joints) - 3), len(joints))
        self._pairs = [(i, k) for i in last for k in last if k < i]
        self.parameters = tuple(
            Parameter(
                f"r{i + 1}{k + 1}",
                "1",
                0.0,
                -0.1,
                0.1,
                "coupling ratio of a wrist's gears",
                joints[i].name,
                size=3e-4,
            )
            for i, k in self._pairs
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        for parameter, (i, k) in zip(self.parameters, self._pairs, strict=True):
            offset[chain.motor_rows[i]] += values[parameter.name] * motors[k]
