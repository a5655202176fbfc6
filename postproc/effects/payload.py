"""Payload: what is mounted on the flange deflects the arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.effects.effect import ChainState, EnergyLoad, Parameter, Values
from postproc.robot.chain import weight_about
from postproc.robot.geometries import Joint


class Payload(EnergyLoad):
    """A weight on the flange: ``mass`` [kg] with its centre at ``x``, ``y``, ``z`` [m] in flange axes, besides the tool
    that the cell states (its mass and centre come with the conditions).

    U = -m g . p_c, p_c = p_flange + R_flange (x, y, z)

    A weight acts on every coordinate up to the last joint, with g [m/s2] and axis z_i in the robot base: tau_i = m z_i
    . ((p_c - p_i) x g) on a turn, m z_i . g on a shift.  Tool and spindle coordinates carry none.
    """

    name = "payload"
    family = "weight"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "a point mass on the flange"
        self.parameters = (
            Parameter("mass", "kg", 0.0, 0.0, 5000.0, source),
            *(Parameter(axis, "m", 0.0, -5.0, 5.0, source, size=0.1) for axis in "xyz"),
        )

    def _weights(self, values: Values, state: ChainState) -> list[tuple[Floats, Floats]]:
        """Mass (N,) or scalar and centre (3, N) in the robot base of each weight."""
        columns, position = state.swept.flange
        centre = sum((values[axis] * column for axis, column in zip("xyz", columns, strict=True)), position)
        weights = [(np.asarray(values["mass"]), np.asarray(centre))]
        given = state.conditions
        if given.payload_mass is not None and given.payload_com is not None:
            hung = sum((x * column for x, column in zip(given.payload_com.T, columns, strict=True)), position)
            weights.append((given.payload_mass, np.asarray(hung)))
        return weights

    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        swept, g = state.swept, state.gravity
        before = state.chain.motor_rows[-1] + 1  # what is before the flange carries it
        for mass, centre in self._weights(values, state):
            for i in range(before):
                axis = swept.axes[i]
                if swept.turns[i]:
                    torque, change = weight_about(axis, centre - swept.origins[i], g)
                    force[i] += mass * torque
                    slope[i] += mass * change
                else:
                    force[i] += mass * (g @ axis)

    def energy(self, values: Values, state: ChainState) -> Floats:
        return np.asarray(
            sum(-mass * (state.gravity @ centre) for mass, centre in self._weights(values, state))
        )
