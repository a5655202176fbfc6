"""Joint stiffening: gears that grow stiffer with load, a cubic spring beside the joint's own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.effects.effect import ChainState, EnergyLoad, Values, column, per_joint
from postproc.robot.geometries import Joint


class JointStiffening(EnergyLoad):
    """tau_i = -k_i d_i^3, U = k_i d_i^4 / 4, dtau_i/dd_i = -3 k_i d_i^2, k_i [N m/rad3] (a sliding joint: [N/m3]), with
    d_i [rad, m] the displacement of joint i under load: its coordinate less that without load, which is motor and
    offsets (a gap's share is part of d_i).

    Together with joint_compliance (c) the joint holds tau = d / c + k d^3; on a rigid joint it does nothing.
    """

    name = "joint_stiffening"
    family = "elastic"
    by_rest = True
    zero_without_load = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "cubic term of a gear's torsion curve"
        self.parameters = per_joint(joints, "k", ("N m/rad3", "N/m3"), 0.0, 1e15, source)

    def _displacement(self, state: ChainState) -> Floats:
        motors = state.chain.motors
        return np.asarray(state.coordinates[motors] - state.rest[motors])

    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        k, displacement, motors = (
            column(values, self.parameters),
            self._displacement(state),
            state.chain.motors,
        )
        square = displacement * displacement
        force[motors] -= k * square * displacement
        slope[motors] -= 3 * k * square

    def energy(self, values: Values, state: ChainState) -> Floats:
        return np.asarray((column(values, self.parameters) * self._displacement(state) ** 4 / 4).sum(axis=0))
