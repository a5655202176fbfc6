"""Deflection and compliance of the TCP, in axes of the robot base."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.effects import Conditions
from postproc.model.mechanics import NOTHING, Mechanics
from postproc.model.sensitivity import compute_curvature
from postproc.model.solve import solve_equilibrium
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


def compute_cartesian_compliance(
    model: Mechanics, q: Floats, wrench: Floats | None, tool: Poses, conditions: Conditions = NOTHING
) -> Floats:
    """(N, 6, 6) [m/N, rad/(N m), ...] at ``q`` (N, n) [rad, m] under ``wrench`` (N, 6) [N, N m]: see
    ``StiffnessModel.cartesian_compliance``."""
    if wrench is None:
        state = model.state(q, np.zeros((len(q), 6)), tool, conditions)
        j = jacobian(state.swept)
        return np.asarray(np.einsum("nij,nj,nkj->nik", j, model.compliance(state), j))
    rest = solve_equilibrium(model, q, wrench, tool, conditions)
    state = model.state(q, wrench, tool, conditions, rest.displacement)
    j = jacobian(state.swept)
    force, _ = model.forces(state)
    _, gives = model.displacement(state, force)
    c = gives.T[:, :, None] * np.eye(model.chain.size)
    every = np.arange(model.chain.size)
    inner = np.linalg.solve(np.eye(model.chain.size) - c @ compute_curvature(model, state, tool, every), c)
    return np.asarray(j @ inner @ np.swapaxes(j, 1, 2))
