"""Joint stiffening: gears that grow stiffer with load, a cubic spring beside the joint's own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import EnergyLoad, State, Values, column, per_joint
from postproc.robot.geometries import Joint


class JointStiffening(EnergyLoad):
    """tau_i = -k_i d_i^3, U = k_i d_i^4 / 4, with d_i the displacement of joint i under load (a gap's
    included).

    Together with joint_compliance the joint holds tau = d / c + k d^3; on a rigid joint it does nothing.
    """

    name = "joint_stiffening"
    family = "elastic"
    slack = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "cubic term of a gear's torsion curve"
        self.parameters = per_joint(joints, "k", ("N m/rad3", "N/m3"), 0.0, 1e15, source)

    def _displacement(self, state: State) -> Floats:
        motors = state.chain.motors
        return np.asarray(state.coordinates[motors] - state.rest[motors])

    def add_force(self, values: Values, state: State, force: Floats, slope: Floats) -> None:
        k, bent, motors = column(values, self.parameters), self._displacement(state), state.chain.motors
        square = bent * bent
        force[motors] -= k * square * bent
        slope[motors] -= 3 * k * square

    def energy(self, values: Values, state: State) -> Floats:
        return np.asarray((column(values, self.parameters) * self._displacement(state) ** 4 / 4).sum(axis=0))
