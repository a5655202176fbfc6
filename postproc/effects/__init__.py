"""The table of effects: a new one is a file here and a line below."""

from __future__ import annotations

from postproc.effects.backlash import Backlash
from postproc.effects.base_compliance import BaseCompliance
from postproc.effects.base_offset import BaseOffset
from postproc.effects.effect import (
    ChainState,
    ComplianceLaw,
    Conditions,
    Effect,
    EnergyLoad,
    Load,
    Offset,
    Parameter,
    Values,
)
from postproc.effects.force_sensor import ForceSensor
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.effects.gravity_sag import GravitySag
from postproc.effects.hysteresis import Hysteresis
from postproc.effects.joint_compliance import JointCompliance
from postproc.effects.joint_coupling import JointCoupling
from postproc.effects.joint_offset import JointOffset
from postproc.effects.joint_stiffening import JointStiffening
from postproc.effects.link_compliance import LinkCompliance
from postproc.effects.link_geometry import LinkGeometry
from postproc.effects.link_gravity import LinkGravity
from postproc.effects.payload import Payload
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.tool_compliance import ToolCompliance
from postproc.effects.tool_offset import ToolOffset
from postproc.effects.transmission_error import TransmissionError

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        JointCompliance,
        ToolCompliance,
        GravityCompensator,
        LinkGravity,
        GravitySag,
        Payload,
        BaseCompliance,
        LinkCompliance,
        JointStiffening,
        Backlash,
        Hysteresis,
        TransmissionError,
        JointOffset,
        LinkGeometry,
        JointCoupling,
        ToolOffset,
        BaseOffset,
        ThermalGrowth,
        ForceSensor,
    )
}

__all__ = [
    "EFFECTS",
    "ChainState",
    "ComplianceLaw",
    "Conditions",
    "Effect",
    "EnergyLoad",
    "Load",
    "Offset",
    "Parameter",
    "Values",
]
