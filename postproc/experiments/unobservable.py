"""Why a parameter is not observable, or only weakly: what the offered loads and poses do to its joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.units import DEG, MM
from postproc.effects import ComplianceLaw
from postproc.experiments.candidate_setups import CandidateSetups, Setups, readings_of
from postproc.identification.campaign import Campaign
from postproc.identification.identifiable import UNSEEN
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown
from postproc.measurements import Readings
from postproc.model import StiffnessModel
from postproc.robot.chain import generalized_force

SAMPLE = 300
"""Poses that are checked."""

NO_LEVER = 1e-6
"""[m] A load at less turns nothing."""

UPRIGHT = 1e-9

ALIKE = 30.0
"""What moves places so many times as much as deflections is measured as places."""


def reason(
    model: StiffnessModel, unknown: Unknown, candidates: CandidateSetups, setups: Setups, still: bool
) -> str:
    """What prevents the observation of an unknown at the ``setups`` that are offered, in words; ``still``: no reading
    moves with it."""
    some = setups[np.linspace(0, len(setups) - 1, min(SAMPLE, len(setups))).astype(int)]
    given = readings_of(model, candidates, some)
    here = _size(model, unknown, given)
    if candidates.deflection:
        places = _size(model, unknown, readings_of(model, replace(candidates, deflection=False), some))
        if places > max(ALIKE * here, UNSEEN * candidates.sigma):
            return "it moves the loaded and the unloaded arm alike: measure places (--kind absolute)"
    if still:
        warming = np.linspace(0.0, 30.0, len(given))
        warm = replace(given, temperature=warming, time=60.0 * warming)
        if _size(model, unknown, warm) > UNSEEN * candidates.sigma:
            return "it is observable while the robot warms up: measure one pose repeatedly, with TEMP or T"
    effect = model.terms[unknown.term].effect
    by_load = isinstance(effect, ComplianceLaw) or effect.family == "elastic"
    if still and by_load and not candidates.loads.any():
        return "it is observable only under a load (--loads)"
    names = [joint.name for joint in model.robot.joints]
    if unknown.parameter.joint not in names:
        return "attached weights do not act on it" if still and by_load else ""
    joint = names.index(unknown.parameter.joint)
    name, unit = names[joint], MM if model.robot.joints[joint].kind == "prismatic" else DEG
    angle = some.q[:, joint] / unit
    moves = f"{name} moves within {angle.min():.0f} .. {angle.max():.0f} {'deg' if unit == DEG else 'mm'}"
    if not by_load or not candidates.loads.any():
        return moves
    torque, upright = _torques(model, candidates, some, joint)
    if torque < NO_LEVER * candidates.loads.max() * np.linalg.norm(model.gravity):
        if upright:
            return f"{name} is vertical, so an attached weight applies 0 N m to it: pull sideways"
        return (
            f"the load is on the axis of {name} and applies 0 N m to it: move the TCP off that axis (--tool)"
        )
    return f"{moves}, the load applies at most {torque:.0f} N m to it"


def _torques(
    model: StiffnessModel, candidates: CandidateSetups, setups: Setups, joint: int
) -> tuple[float, bool]:
    """The largest torque [N m, N] that the loads put on a joint, and whether its axis is always along gravity."""
    wrench = np.zeros((len(setups), 6))
    wrench[:, :3] = candidates.loads.max() * model.gravity
    state = model.state(setups.q, wrench, candidates.tool)
    row = model.chain.motor_rows[joint]
    force = generalized_force(state.swept, state.swept.position, state.wrench)[row]
    along = np.cross(state.swept.axes[row].T, model.gravity)
    return float(np.abs(force).max()), bool(np.linalg.norm(along, axis=1).max() < UPRIGHT)


def _size(model: StiffnessModel, unknown: Unknown, readings: Readings) -> float:
    """[m] by which a parameter of its usual size moves all readings together."""
    campaign = Campaign(readings)
    derivative = columns(campaign, model, [unknown], campaign.predicted(model), campaign.start())
    return float(np.linalg.norm(np.nan_to_num(derivative)))
