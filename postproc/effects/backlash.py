"""Backlash: a gap in the gear, in which the joint lies on one side or the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import ComplianceLaw, State, Values, column, per_joint
from postproc.robot.geometries import Joint
from postproc.yamlfile import Section


class Backlash(ComplianceLaw):
    """theta_i = (b_i / 2) tanh(2 (tau_i / friction - d_i)), b_i [rad] the whole gap.

    The load chooses the side; a load below the ``friction`` [N m, N] of the joint leaves it on the side that it came
    from (d_i = -1, 0, 1 the sense of approach, 0 where it is not known).
    """

    name = "backlash"
    family = "gear"
    by_direction = True

    def __init__(self, joints: Sequence[Joint], friction: float = 20.0) -> None:
        self.friction = friction
        source = "gap of a gear; the side follows the load, or the approach where there is none"
        self.parameters = per_joint(joints, "b", ("rad", "m"), 0.0, 0.02, source)

    @classmethod
    def from_options(cls, options: Section, joints: Sequence[Joint]) -> Self:
        options.only("friction")
        return cls(joints, options.number("friction", 20.0, 0.1, 1e5))

    def described(self) -> dict[str, object]:
        return {"friction": self.friction}

    def add_displacement(
        self, values: Values, state: State, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        half, motors = 0.5 * column(values, self.parameters), state.chain.motors
        came = 0.0 if state.conditions.direction is None else state.conditions.direction.T
        side = np.tanh(2.0 * (force[motors] / self.friction - came))
        displacement[motors] += half * side
        slope[motors] += half * (1 - side * side) * 2.0 / self.friction
