"""What is implausible about a model itself."""

from __future__ import annotations

import numpy as np

from postproc.base.findings import Finding
from postproc.base.geometry import Poses
from postproc.base.units import DEG
from postproc.effects import Load
from postproc.model.mechanics import Mechanics

IMPLAUSIBLE_SAG = 0.5 * DEG
"""A joint that its own balancer deflects this far is not balanced: some ten times what weight does to a heavy arm."""


def find_implausible(model: Mechanics) -> list[Finding]:
    """``StiffnessModel.plausibility_findings``: see there."""
    limits = model.robot.limits
    angles = np.linspace(limits[:, 0], limits[:, 1], 181)
    state = model.state(angles, np.zeros((len(angles), 6)), Poses.identity())
    findings = []
    for term in model.terms:
        if not isinstance(term.effect, Load):
            continue
        force, slope = np.zeros_like(state.rest), np.zeros_like(state.rest)
        term.effect.add_force(term.values, state, force, slope)
        sag, _ = model.displacement(state, force)
        sag = np.abs(sag[model.chain.motor_rows])
        force = force[model.chain.motor_rows]
        joint, at = np.unravel_index(np.argmax(sag), sag.shape)
        if sag[joint, at] > IMPLAUSIBLE_SAG:
            findings.append(
                Finding(
                    "MOD001",
                    f"{term.effect.name}: {abs(force[joint, at]):.0f} N m on {model.robot.joints[joint].name} at"
                    f" {angles[at, joint] / DEG:.0f} deg would deflect it by {sag[joint, at] / DEG:.2f} deg",
                    str(model.robot.path),
                    term.line,
                    help="state `preload: balanced` if only the change of its torque acts",
                )
            )
    return findings
