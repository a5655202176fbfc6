"""Link gravity: the weight of the arm bends it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import Load, Parameter, State, Values
from postproc.geometry import Poses
from postproc.robot.chain import Chain, cross
from postproc.robot.description import Joint


class LinkGravity(Load):
    """Weight of the links from their first moments m c [kg m]: of link i about its joint, axes of the robot base at the
    zero pose, with the mass of all that follows counted at the next joint.

    U = -sum of g . R_i (m c)_i; a link's mass itself is seen by no turn.  ``mass`` [kg], of the whole arm, acts on
    shifts before it (base, linear axis).
    """

    name = "link_gravity"
    family = "weight"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "static balance of a serial arm: first moments of the links"
        self.parameters = (
            *(
                Parameter(f"m{axis}{i}", "kg m", 0.0, -5000.0, 5000.0, source, joint.name)
                for i, joint in enumerate(joints, 1)
                for axis in "xyz"
            ),
            Parameter("mass", "kg", 0.0, 0.0, 1e5, source),
        )
        chain = Chain(joints, Poses.identity())
        at_zero = chain.sweep(np.zeros((len(joints), 1)), Poses.identity())
        self._frames = [np.stack([c[:, 0] for c in columns], axis=1) for columns in at_zero.links]

    def _moments(self, values: Values, state: State) -> Floats:
        """(n, 3, N) first moment of all links from each joint on, robot base axes."""
        own = []
        for i, columns in enumerate(state.swept.links):
            moment = np.array([values[f"m{axis}{i + 1}"] for axis in "xyz"])
            x, y, z = self._frames[i].T @ moment
            own.append(x * columns[0] + y * columns[1] + z * columns[2])
        return np.cumsum(np.array(own)[::-1], axis=0)[::-1]

    def add_force(self, values: Values, state: State, force: Floats, slope: Floats) -> None:
        moments = self._moments(values, state)
        g, swept = state.gravity[:, None], state.swept
        follows = np.searchsorted(state.chain.motor_rows, np.arange(len(swept.turns)))
        for i, turns in enumerate(swept.turns):
            if follows[i] == len(moments):
                continue
            axis, moment = swept.axes[i], moments[follows[i]]
            if turns:
                force[i] += np.sum(axis * cross(moment, g), axis=0)
                slope[i] += np.sum(axis * cross(cross(axis, moment), g), axis=0)
            else:
                force[i] += values["mass"] * np.sum(axis * g, axis=0)

    def energy(self, values: Values, state: State) -> Floats:
        lifted = values["mass"] * np.zeros(state.motors.shape[1])
        for i, turns in enumerate(state.swept.turns):
            if not turns and i < state.chain.motor_rows[-1]:
                along = state.gravity @ state.swept.axes[i]
                lifted = lifted - values["mass"] * along * state.coordinates[i]
        return np.asarray(lifted - state.gravity @ self._moments(values, state)[0])
