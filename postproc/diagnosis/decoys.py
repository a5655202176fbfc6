"""What an effect has to be distinguished from, although it is never searched for by itself: other courses over the
same joint, or over the same time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.effects import (
    ChainState,
    ComplianceLaw,
    Conditions,
    Effect,
    Offset,
    Parameter,
    Values,
)
from postproc.effects.effect import column
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.transmission_error import TransmissionError
from postproc.identification.unknowns import unknowns_of
from postproc.model import StiffnessModel
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint

HAS_DECOYS = ("gravity_compensator",)
"""Effects that stiffen one joint, more at one angle than at another."""

ORDERS = (0.5, 1.5, 2.5, 3.0, 4.0)
"""Of waves over a joint's angle that are no harmonics of the library: between them, and beyond."""


class AlternativeForm(Effect):
    """A course that has no name; ``about``: in words, up to the joint."""

    about: str


class VaryingCompliance(AlternativeForm, ComplianceLaw):
    """theta_i = (v1 x + v2 x^2) tau_i beside the joint's own spring, x = q_i - ``middle`` [rad]: a gear that deflects
    more at one end of its range than at the other."""

    name = "joint_compliance"
    family = "elastic"
    about = "a stiffness that varies freely with the angle of"

    def __init__(self, joints: Sequence[Joint], joint: int = 0, middle: float = 0.0) -> None:
        self.joint, self.middle = joint, middle
        at, source = joints[joint].name, "the first terms of any smooth dependence"
        # over a radian as much as is felt of a joint's own
        self.parameters = (
            Parameter("v1", "rad/(N m)", 0.0, source=source, joint=at),
            Parameter("v2", "rad/(N m)", 0.0, source=source, joint=at),
        )

    def described(self) -> dict[str, object]:
        return {"varies": "with its angle"}

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        row = state.chain.motor_rows[self.joint]
        x = state.motors[self.joint] - self.middle
        compliance = (values["v1"] + values["v2"] * x) * x
        displacement[row] += compliance * force[row]
        slope[row] += compliance


class OtherWave(AlternativeForm, TransmissionError):
    """The error of a gear over its angle, of an order that is no harmonic of the library."""

    def __init__(self, joints: Sequence[Joint], harmonics: Sequence[float] = (1.0,)) -> None:
        super().__init__(joints, harmonics)
        self.about = f"an error that comes back {' and '.join(f'{h:g}' for h in harmonics)} times a turn of"


class DriftingBase(AlternativeForm, Offset):
    """Robot and tracker that move apart, by x, y, z [m/K, m/s] times the temperature over that of the start or the
    time since then: a stand that creeps, a foundation that warms up."""

    name = "base_offset"
    family = "geometric"
    about = "a drift of the whole arm"

    def __init__(self, joints: Sequence[Joint], variable: str = "time") -> None:
        self.variable = variable
        unit = "m/K" if variable == "temperature" else "m/s"
        self.coordinates = ("base.x", "base.y", "base.z")
        self.parameters = tuple(Parameter(axis, unit, 0.0, source="drift of a stand") for axis in "xyz")

    def described(self) -> dict[str, object]:
        return {"variable": self.variable}

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        amount = conditions.temperature if self.variable == "temperature" else conditions.time
        if amount is not None:
            rows = [chain.index[name] for name in self.coordinates]
            offset[rows] += column(values, self.parameters) * amount


def decoys(model: StiffnessModel, q: Floats, mine: Candidate) -> list[Candidate]:
    """What ``mine`` has to be distinguished from, in a ``model`` measured at ``q`` (R, n); started at the null.

    Waves of all gears at once have those of one joint: each gear may have other orders beside, and what holds on poses
    that were left out (on a real UR5 0.089 instead of 0.100 mm) is not taken away by that; but what one course over one
    joint explains as well is no wave of all gears.
    """
    joints = model.robot.joints
    if mine.name == TransmissionError.name:
        places = [one.name for one in joints] if mine.joint == EVERY else [mine.joint]
        return [_decoy(model, q, OtherWave(joints, (order,)), place) for place in places for order in ORDERS]
    if mine.joint == EVERY:
        return []
    if mine.name == ThermalGrowth.name:
        return [_decoy(model, q, DriftingBase(joints, str(mine.effect.described()["variable"])), "")]
    if mine.name not in HAS_DECOYS:
        return []
    joint = next(i for i, one in enumerate(joints) if one.name == mine.joint)
    middle = float(np.mean([q[:, joint].min(), q[:, joint].max()]))
    return [_decoy(model, q, VaryingCompliance(joints, joint, middle), mine.joint)]


def _decoy(model: StiffnessModel, q: Floats, effect: AlternativeForm, joint: str) -> Candidate:
    wider = model.with_effect(effect)
    unknowns = tuple(u for u in unknowns_of(wider, len(model.terms)) if u.parameter.joint == joint)
    return Candidate(effect, joint, wider, unknowns, np.zeros((len(q), 3, len(unknowns))), True)
