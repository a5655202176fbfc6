"""The table of effects: a new one is a file here and a line below."""

from __future__ import annotations

from postproc.effects.effect import ComplianceLaw, Effect, Load, Parameter, Values
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.effects.joint_compliance import JointCompliance

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        JointCompliance,
        GravityCompensator,
    )
}

__all__ = ["EFFECTS", "ComplianceLaw", "Effect", "Load", "Parameter", "Values"]
