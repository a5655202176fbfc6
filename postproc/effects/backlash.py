"""Backlash: a gap in the gear, in which the joint lies on one side or the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.yaml_section import YamlSection
from postproc.effects.effect import WORN, ChainState, ComplianceLaw, Values, column, per_joint
from postproc.robot.geometries import Joint


class Backlash(ComplianceLaw):
    """theta_i = (b_i / 2) ((1 + d_i) L(-1) + (1 - d_i) L(1)) / 2, L(s) = tanh(2 (tau_i / friction + s)), b_i [rad] the
    whole gap.

    The load chooses the side; one below the ``friction`` [N m, N] of the joint leaves it where the motor brought it: at
    -tanh(2) d_i b_i / 2.  d_i in -1..1 is the share of half the gap by which the motor is ahead (see ``play``): -1 or 1
    after a motion larger than the gap, 0 where nothing is known, which is the mean of both.

    theta_i adds to the displacement of the joint's own coordinate; tau_i [N m, N] is the whole generalized force on it,
    wrench and loads.  dtheta_i/dtau_i = (b_i / 2) ((1 + d_i) (1 - L(-1)^2) + (1 - d_i) (1 - L(1)^2)) / friction.
    """

    name = "backlash"
    family = "gear"
    by_direction = True

    def __init__(self, joints: Sequence[Joint], friction: float = 20.0) -> None:
        self.friction = friction
        source = "gap of a gear; the side follows the load, or the approach where there is none"
        self.parameters = per_joint(joints, "b", ("rad", "m"), 0.0, 0.02, source, plausible=WORN)

    @classmethod
    def from_options(cls, options: YamlSection, joints: Sequence[Joint]) -> Self:
        options.only("friction")
        return cls(joints, options.number("friction", 20.0, 0.1, 1e5))

    def described(self) -> dict[str, object]:
        return {"friction": self.friction}

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        half, motors = 0.5 * column(values, self.parameters), state.chain.motors
        came = 0.0 if state.conditions.direction is None else state.conditions.direction.T
        forward, backward = (np.tanh(2.0 * (force[motors] / self.friction + side)) for side in (-1.0, 1.0))
        displacement[motors] += half * 0.5 * ((1 + came) * forward + (1 - came) * backward)
        rises = (1 + came) * (1 - forward * forward) + (1 - came) * (1 - backward * backward)
        slope[motors] += half * rises / self.friction
