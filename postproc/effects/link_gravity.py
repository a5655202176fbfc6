"""Link gravity: the weight of the arm deflects it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.effects.effect import ChainState, EnergyLoad, Parameter, Values
from postproc.robot.chain import Chain, weight_about
from postproc.robot.geometries import Joint


class LinkGravity(EnergyLoad):
    """Weight of the links from their first moments m c [kg m]: of link i about the origin of its joint's frame, axes of
    the robot base at the zero pose, with the mass of all that follows counted at the next joint.

    U = -g . (sum of R_i (m c)_i + m p_1), R_i the turn of link i from the zero pose (all joints at the controller's 0)
    to where it is; from the first turning joint on, masses themselves are seen by no turn.

    ``mass`` m [kg], of the whole arm, acts at the origin p_1 of that joint, on what is before it (base, linear
    axis): on such a shift m z_i . g.  On a turn z_i . (M x g) with M the sum of R_k (m c)_k of the links after it, and
    before the first turning joint m (p_1 - p_i) besides.  Shifts after that joint carry nothing here.
    """

    name = "link_gravity"
    family = "weight"
    apart = False

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
        at_zero = chain.evaluate(chain.placed(np.zeros((1, len(joints)))), Poses.identity())
        self._frames = [np.stack([c[:, 0] for c in columns], axis=1) for columns in at_zero.links]

    def _moments(self, values: Values, state: ChainState) -> Floats:
        """(n, 3, N) first moment of all links from each joint on, robot base axes."""
        own = []
        for i, columns in enumerate(state.swept.links):
            moment = np.array([values[f"m{axis}{i + 1}"] for axis in "xyz"])
            x, y, z = self._frames[i].T @ moment
            own.append(x * columns[0] + y * columns[1] + z * columns[2])
        return np.cumsum(np.array(own)[::-1], axis=0)[::-1]

    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        moments = self._moments(values, state)
        swept, chain = state.swept, state.chain
        first = _first_turn(chain)
        follows = np.searchsorted(chain.motor_rows, np.arange(chain.motor_rows[-1] + 1))
        for i, joint in enumerate(follows):
            axis, moment = swept.axes[i], moments[joint]
            if i < first:
                moment = moment + values["mass"] * (swept.origins[first] - swept.origins[i])
            if swept.turns[i]:
                torque, change = weight_about(axis, moment, state.gravity)
                force[i] += torque
                slope[i] += change
            elif i < first:
                force[i] += values["mass"] * (state.gravity @ axis)

    def energy(self, values: Values, state: ChainState) -> Floats:
        origin = state.swept.origins[_first_turn(state.chain)]
        return np.asarray(-state.gravity @ (self._moments(values, state)[0] + values["mass"] * origin))


def _first_turn(chain: Chain) -> int:
    """The coordinate of the first turning joint."""
    rows = chain.motor_rows
    return int(rows[np.argmax(chain.turns[rows])])
