"""Gravity sag: what the arm's own weight turns its joints by, where neither weight nor compliance is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.effects.effect import Conditions, Offset, Parameter, Values
from postproc.robot.chain import Chain, cross
from postproc.robot.geometries import Joint

UPRIGHT = 1e-6
"""Of an axis and the vertical of the robot base: sine of the angle below which no weight turns about it."""


class GravitySag(Offset):
    """offset_i = z_i . (M x d) [rad], M = sum of sx_i_k x_k + sy_i_k y_k over the turning joint k = i and the next
    one; turning joints only.

    x_k, y_k, z_k: axes of the frame after motor k as commanded; d: unit vector of gravity.  sx, sy are a weight's first
    moment about an axis, times its weight and the compliance of joint i: the product of what ``link_gravity`` and
    ``joint_compliance`` state one by one, from the same static balance of a serial arm, to first order.  What follows
    behind the next joint counts where it is carried; moments along an axis count at the joint before it.  A first joint
    whose axis is the vertical of the base carries no weight.
    """

    name = "gravity_sag"
    family = "weight"
    by_gravity = True
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        turning = [i for i, joint in enumerate(joints) if joint.turns]
        chain = Chain(joints, Poses.identity())
        at_zero = chain.evaluate(chain.placed(np.zeros((1, len(joints)))), Poses.identity())
        first = at_zero.links[turning[0]][2][:, 0] if turning else np.zeros(3)
        carrying = turning[1:] if np.hypot(first[0], first[1]) < UPRIGHT else turning
        self._links = {i: [k for k in turning if k >= i][:2] for i in carrying}
        self.parameters = tuple(
            Parameter(
                f"s{axis}{i + 1}_{k + 1}", "rad", 0.0, -0.02, 0.02, "weight times compliance", joints[i].name
            )
            for i, links in self._links.items()
            for k in links
            for axis in "xy"
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        swept = chain.evaluate(chain.placed(motors.T), Poses.identity())
        down = np.array([[0.0], [0.0], [-1.0]]) if conditions.down is None else conditions.down.T
        for i, links in self._links.items():
            row = chain.motor_rows[i]
            for k in links:
                x, y, _ = swept.links[k]
                moment = values[f"sx{i + 1}_{k + 1}"] * x + values[f"sy{i + 1}_{k + 1}"] * y
                offset[row] += (swept.axes[row] * cross(moment, down)).sum(axis=0)
