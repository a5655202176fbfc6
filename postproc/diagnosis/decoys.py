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
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_compliance import LinkCompliance
from postproc.effects.link_geometry import LinkGeometry
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.transmission_error import TransmissionError
from postproc.identification.campaign import Campaign
from postproc.identification.unknowns import unknowns_of
from postproc.model import StiffnessModel
from postproc.robot.chain import Chain, generalized_force
from postproc.robot.geometries import Joint

HAS_DECOYS = ("gravity_compensator",)
"""Effects that stiffen one joint, more at one angle than at another."""

BENT = ((2, 1.0), (3, 1.0), (1, 0.2), (1, 0.4))
"""Powers of the load that a deflection may follow, and shares of the largest load that belong to these."""

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


class LeaningCompliance(AlternativeForm, ComplianceLaw):
    """theta_i = (s sin q_k + c cos q_k) tau_i beside the joint's own spring: a joint that gives more in one posture of
    the arm than in another; k is ``other``."""

    name = "joint_compliance"
    family = "elastic"

    def __init__(self, joints: Sequence[Joint], joint: int = 0, other: int = 0) -> None:
        self.joint, self.other = joint, other
        at, self.about = (
            joints[joint].name,
            f"a stiffness that varies with the angle of {joints[other].name}, of",
        )
        self.parameters = tuple(
            Parameter(axis, "rad/(N m)", 0.0, source="the first harmonic of any dependence", joint=at)
            for axis in "sc"
        )

    def described(self) -> dict[str, object]:
        return {"varies": f"with joint {self.other + 1}"}

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        row, angle = state.chain.motor_rows[self.joint], state.motors[self.other]
        compliance = values["s"] * np.sin(angle) + values["c"] * np.cos(angle)
        displacement[row] += compliance * force[row]
        slope[row] += compliance


class LoadedPlay(AlternativeForm, ComplianceLaw):
    """theta_i = -v d_i abs(tau_i), d_i as of ``hysteresis``: lost motion by friction that grows with the load, none
    without."""

    name = "hysteresis"
    family = "gear"
    by_direction = True
    about = "a lost motion in proportion to the load of"

    def __init__(self, joints: Sequence[Joint], joint: int = 0) -> None:
        self.joint = joint
        self.parameters = (
            Parameter("v", "rad/(N m)", 0.0, source="friction of loaded teeth", joint=joints[joint].name),
        )

    def described(self) -> dict[str, object]:
        return {"varies": "with its load"}

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        if state.conditions.direction is None:
            return
        row, came = state.chain.motor_rows[self.joint], state.conditions.direction.T[self.joint]
        displacement[row] -= values["v"] * came * np.abs(force[row])
        slope[row] -= values["v"] * came * np.sign(force[row])


class BentCompliance(AlternativeForm, ComplianceLaw):
    """theta = v tau (abs(tau) / load)^(power - 1) of the tilts of a joint or, with the power 1, v sign(tau)
    max(0, abs(tau) - load): what gives otherwise than in proportion, as teeth do, or what has clearance."""

    name = "link_compliance"
    family = "elastic"
    about = "a deflection out of proportion to the load of"

    def __init__(
        self,
        joints: Sequence[Joint],
        joint: int = 0,
        power: int = 2,
        load: float = 1000.0,
    ) -> None:
        at = joints[joint].name
        self.joint, self.power, self.load = joint, power, load
        self.coordinates = tuple(f"{at}.r{axis}" for axis in "xy")
        self.parameters = tuple(
            Parameter(f"v{axis}", "rad/(N m)", 0.0, source="next term of any smooth law", joint=at)
            for axis in "xy"
        )

    def rows(self, chain: Chain) -> list[int]:
        """Where the coordinates are in the chain."""
        return [chain.index[name] for name in self.coordinates]

    def described(self) -> dict[str, object]:
        return {"varies": f"with its load to the power {self.power}", "from": round(self.load, 3)}

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        rows, v = self.rows(state.chain), column(values, self.parameters)
        if self.power == 1:
            over = np.maximum(0.0, np.abs(force[rows]) - self.load)
            displacement[rows] += v * np.sign(force[rows]) * over
            slope[rows] += v * (over > 0)
            return
        compliance = v * (np.abs(force[rows]) / self.load) ** (self.power - 1)
        displacement[rows] += compliance * force[rows]
        slope[rows] += self.power * compliance


class OtherWave(AlternativeForm, TransmissionError):
    """The error of a gear over its angle, of an order that is no harmonic of the library."""

    def __init__(self, joints: Sequence[Joint], harmonics: Sequence[float] = (1.0,)) -> None:
        super().__init__(joints, harmonics)
        self.about = f"an error that comes back {' and '.join(f'{h:g}' for h in harmonics)} times a turn of"


class DriftingBase(AlternativeForm, Offset):
    """Robot and tracker that move apart, by x, y, z [m/K, m/s] times the temperature over that of the first reading or
    the time since then: a stand that creeps, a foundation that warms up.  ``start`` [K, s]: of the first reading."""

    name = "base_offset"
    family = "geometric"
    about = "a drift of the whole arm"

    def __init__(self, joints: Sequence[Joint], variable: str = "time", start: float = 0.0) -> None:
        self.variable, self.start = variable, start
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
            offset[rows] += column(values, self.parameters) * (amount - self.start)


def decoys(model: StiffnessModel, campaign: Campaign, mine: Candidate) -> list[Candidate]:
    """What ``mine`` has to be distinguished from, in a ``model`` measured in ``campaign``; started at the null.

    Waves of all gears at once have those of one joint: each gear may have other orders beside, and what holds on poses
    that were left out (on a real UR5 0.089 instead of 0.100 mm) is not taken away by that; but what one course over one
    joint explains as well is no wave of all gears.
    """
    joints, q = model.robot.joints, campaign.readings.q
    if mine.name == TransmissionError.name:
        places = [one.name for one in joints] if mine.joint == EVERY else [mine.joint]
        return [_decoy(model, q, OtherWave(joints, (order,)), place) for place in places for order in ORDERS]
    if campaign.readings.deflection and mine.name in (JointOffset.name, LinkGeometry.name):
        # where axes lie moves no difference but by the lever of what deflects
        pairs = [(i, k) for i in range(len(joints)) for k in (i - 1, i + 1) if 0 <= k < len(joints)]
        return [_decoy(model, q, LeaningCompliance(joints, i, k), joints[i].name) for i, k in pairs]
    if mine.joint == EVERY:
        return []
    if mine.name == ThermalGrowth.name:
        variable = str(mine.effect.form()["variable"])
        given = campaign.readings.warmth if variable == "temperature" else campaign.readings.elapsed
        drift = DriftingBase(joints, variable, 0.0 if given is None else float(given[0]))
        return [_decoy(model, q, drift, "")]
    joint = next((i for i, one in enumerate(joints) if one.name == mine.joint), None)
    if joint is None:
        return []
    if mine.effect.by_direction:
        return [_decoy(model, q, LoadedPlay(joints, joint), mine.joint)]
    if mine.name == LinkCompliance.name:
        largest = _largest_load(campaign, model, BentCompliance(joints, joint))
        forms = [BentCompliance(joints, joint, n, share * largest) for n, share in BENT]
        return [_decoy(model, q, form, mine.joint) for form in forms]
    if mine.name not in HAS_DECOYS:
        return []
    middle = float(np.mean([q[:, joint].min(), q[:, joint].max()]))
    return [_decoy(model, q, VaryingCompliance(joints, joint, middle), mine.joint)]


def _largest_load(campaign: Campaign, model: StiffnessModel, form: BentCompliance) -> float:
    """[N m, N] of a wrench on the coordinates of ``form``."""
    chain, readings = model.with_effect(form).chain, campaign.readings
    swept = chain.evaluate(chain.placed(readings.q), campaign.tool)
    loads = generalized_force(swept, swept.position, readings.wrench.T)[form.rows(chain)]
    return max(1.0, float(np.abs(loads).max(initial=0.0)))


def _decoy(model: StiffnessModel, q: Floats, effect: AlternativeForm, joint: str) -> Candidate:
    wider = model.with_effect(effect)
    unknowns = tuple(u for u in unknowns_of(wider, len(model.terms)) if u.parameter.joint == joint)
    return Candidate(effect, joint, wider, unknowns, np.zeros((len(q), 3, len(unknowns))), True)
