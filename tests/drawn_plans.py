"""Plans for a program that tests write: a motion more, or one elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.base.geometry import rotation_from_vector
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program, WritingSettings
from postproc.toolpath import Kind, Plan, Role


def divided(program: Program, row: int, role: Role, flows: bool, external: np.ndarray | None = None) -> Plan:
    """A motion in the middle of, or before, a row."""
    path = program.toolpath
    n = len(path)
    at = np.arange(n + 1) - (np.arange(n + 1) > row)
    roles = np.zeros(n + 1)
    roles[row] = role
    position, rotation = path.position[at].copy(), path.rotation[at].copy()
    arcs = path.arcs
    centre, normal, sweep = arcs.centre[at].copy(), arcs.normal[at].copy(), arcs.sweep[at].copy()
    if path.kind[row] == Kind.CIRC and role == Role.INTERMEDIATE:
        sweep[[row, row + 1]] /= 2
        half = rotation_from_vector(-sweep[row] * normal[row])
        position[row] = centre[row] + half @ (position[row + 1] - centre[row])
    else:
        position[row] = (path.position[row] + path.position[max(row - 1, 0)]) / 2
        if role == Role.TRANSITION:
            centre[row], normal[row], sweep[row] = np.nan, np.nan, np.nan
    flowing, share = np.zeros(n + 1, bool), np.ones(n + 1)
    flowing[row], share[row] = flows, 0.5
    return Plan(at, roles, position, rotation, centre, normal, sweep, flowing, share, external)


def refuse_what_may_not_move(program: Program) -> None:
    """Asserts that no edit is made for plans that move row 0, or divide row 1."""
    dialect, writing = DIALECTS[program.dialect], WritingSettings(mm=3, deg=3)
    plan = Plan.of(program.toolpath)
    position = plan.position[:].copy()
    position[0] = 1.0
    moved = Plan(plan.source, plan.role, position, plan.rotation, plan.centre, plan.normal, plan.sweep)
    with pytest.raises(ValueError, match="cannot be corrected"):
        dialect.edit_targets(program, moved, writing)
    with pytest.raises(ValueError, match="cannot be divided"):
        dialect.edit_targets(program, divided(program, 1, Role.INTERMEDIATE, True), writing)
