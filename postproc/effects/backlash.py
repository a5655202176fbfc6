"""Backlash: a gap in the gear, in which the joint lies on one side or the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import ComplianceLaw, State, Values, column, per_joint
from postproc.robot.description import Joint

TRANSITION = 10.0
"""[N m, N] load over which the joint crosses its gap (tanh): the friction that holds it there."""


class Backlash(ComplianceLaw):
    """theta_i = (b_i / 2) tanh(tau_i / TRANSITION), b_i [rad] the whole gap: the load chooses the side."""

    name = "backlash"
    family = "gear"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "gap of a gear; the side follows the sign of the load"
        self.parameters = per_joint(joints, "b", ("rad", "m"), 0.0, 0.02, source)

    def add_displacement(
        self, values: Values, state: State, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        half, motors = 0.5 * column(values, self.parameters), state.chain.motors
        side = np.tanh(force[motors] / TRANSITION)
        displacement[motors] += half * side
        slope[motors] += half * (1 - side * side) / TRANSITION
