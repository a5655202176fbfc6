"""Deflection of the TCP linearized at a pose, in axes of the robot base."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.effects import Conditions
from postproc.model.mechanics import NOTHING, Mechanics
from postproc.robot.chain import jacobian


def compute_linear_deflection(
    model: Mechanics, q: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
) -> Floats:
    """(N, 6) [m, rad] of ``q`` (N, n) [rad, m] and ``wrench`` (N, 6) [N, N m]: see
    ``StiffnessModel.linear_deflection``."""
    state = model.state(q, np.zeros((len(q), 6)), tool, conditions)
    j = jacobian(state.swept)
    torque = np.einsum("nij,ni->nj", j, wrench)
    return np.asarray(np.einsum("nij,nj->ni", j, model.compliance(state) * torque))
