"""What an effect is: a named piece of physics with parameters, added to one chain.

An effect acts on the generalized coordinates of the chain in one of three forms: as an *offset* of coordinates, as a
*load* on them, or as a *compliance law* (displacement under a generalized force).  The solver in ``model`` only sums:

    z = motors + sum of offsets(motors) + theta,    theta = sum of laws(F),    F = J(z)^T w + sum of loads(z)

Coordinates z are in the order of ``robot.chain``, whatever the order of the effects; effects on one coordinate add.
Offsets follow from the motors as commanded, not from each other.  The wrench w acts at the TCP where it comes to lie,
in axes of the robot base that do not turn with it.

Arrays are component first: n joints, m coordinates, N states.  A parameter at its null value is the same as no effect.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.yaml_section import YamlSection
from postproc.robot.chain import Chain, ChainKinematics
from postproc.robot.geometries import Joint

Values = Mapping[str, float]

WORN = (0.0, 4e-3)
"""[rad] Lost motion of a gear: a new one has some 3e-4 (one minute of arc), a worn-out one ten times that."""

SIZES = {
    "1": 0.05,
    "m": 1e-3,
    "rad": 3e-4,
    "kg": 60.0,
    "kg m": 100.0,
    "N": 30.0,
    "N m": 10.0,
    "N/m": 2e6,
    "m/N": 2e-8,
    "rad/(N m)": 1e-7,
    "N m/rad3": 1e11,
    "N/m3": 1e15,
    "m/K": 1e-5,
    "m/s": 1e-7,
}
"""SI unit of a parameter -> a size that matters on a heavy arm, and does not let it collapse."""


@dataclass(frozen=True)
class Parameter:
    """Name, SI unit, null value (effect absent), bounds, where its definition comes from, and the joint it is of.

    ``hardware``: a dimension of built hardware, known from a drawing rather than from how the robot deflects.
    ``size``: one that is felt, the unit in which fits count; 0 takes that of the SI unit.  ``plausible``: magnitudes
    between which built hardware has it, if it has it at all.
    """

    name: str
    unit: str
    null: float
    lower: float = -math.inf
    upper: float = math.inf
    source: str = ""
    joint: str = ""
    hardware: bool = False
    size: float = 0.0
    plausible: tuple[float, float] = (0.0, math.inf)

    @property
    def scale(self) -> float:
        """``size``, or that of the unit."""
        return self.size or SIZES[self.unit]


@dataclass(frozen=True)
class Conditions:
    """What else is known of N states; None where it is not.

    spindle (N, 3): unit vector of the spindle, tip-ward, in tool axes; direction (N, n): how far each motor is ahead
    of its joint, -1..1, as a share of half the gap; -1, 0, 1 where only the sense in which it came is known;
    temperature (N,) [K] over that of the calibration; time (N,) [s] since then; payload_mass (N,) [kg] and payload_com
    (N, 3) [m, flange axes]: what is mounted on the flange; down (N, 3): unit vector of gravity, axes of the robot base,
    of which only an effect ``by_gravity`` knows; straight down where it is None.
    """

    spindle: Floats | None = None
    direction: Floats | None = None
    temperature: Floats | None = None
    time: Floats | None = None
    payload_mass: Floats | None = None
    payload_com: Floats | None = None
    down: Floats | None = None

    def part(self, rows: Any) -> Conditions:
        """The conditions of some states."""
        given = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{name: None if v is None else v[rows] for name, v in given.items()})


@dataclass(frozen=True)
class ChainState:
    """N states of a chain as an effect sees them.

    motors (n, N): as commanded; rest (m, N): coordinates without load, motors and offsets; coordinates (m, N): where
    they are now; swept: the chain there; wrench (6, N) at the TCP, robot base axes; gravity (3,) [m/s2].
    """

    chain: Chain
    gravity: Floats
    motors: Floats
    rest: Floats
    coordinates: Floats
    swept: ChainKinematics
    wrench: Floats
    conditions: Conditions

    def part(self, rows: Ints) -> ChainState:
        """Copies of the states ``rows`` (K,); ``swept`` is still that of all."""
        return replace(
            self,
            motors=self.motors[:, rows],
            rest=self.rest[:, rows],
            coordinates=self.coordinates[:, rows],
            wrench=self.wrench[:, rows],
            conditions=self.conditions.part(rows),
        )


class Effect:
    """Base of all effects.

    ``family``: what a controller may already correct (``geometric``, ``weight``), or ``elastic``, ``gear``.
    ``coordinates``: extra coordinates of the chain that it needs.  ``by_direction``: it asks how joints came to their
    place, ``by_gravity``: where down is.  ``whole``: an arm that was never calibrated has it in all of its joints.
    ``apart``: it may be there on one joint and not on another.  ``zero_without_load``: without a wrench it moves
    nothing.
    """

    name: ClassVar[str]
    family: ClassVar[str]
    by_direction: ClassVar[bool] = False
    by_gravity: ClassVar[bool] = False
    whole: ClassVar[bool] = False
    apart: ClassVar[bool] = True
    zero_without_load: bool = False
    parameters: tuple[Parameter, ...]
    coordinates: tuple[str, ...] = ()

    @classmethod
    def from_options(cls, options: YamlSection, joints: Sequence[Joint]) -> Self:
        """The effect as the ``options:`` of a robot file describe it.  Raises Refusal with the line."""
        options.only()
        return cls(joints)

    def __init__(self, joints: Sequence[Joint]) -> None:
        """The effect without options, on an arm with ``joints``."""

    @classmethod
    def of_mechanism(cls, joints: Sequence[Joint], joint: str | None, quantities: Values) -> Self:
        """The effect of hardware that a robot file describes under ``mechanisms:`` with ``quantities`` (SI)."""
        return cls(joints)

    @classmethod
    def variants(cls, joints: Sequence[Joint]) -> tuple[Self, ...]:
        """The forms in which the effect is searched for where nothing is known of it."""
        return (cls(joints),)

    def described(self) -> dict[str, object]:
        """All options, as a robot file states them."""
        return {}

    def form(self) -> dict[str, object]:
        """The options that make it another effect: of the rest one model has one value alone."""
        return self.described()

    def gaps(self, values: Values) -> Floats:
        """(n,) [rad, m] by which a motor turns round before its joint does; of an effect ``by_direction``."""
        return column(values, self.parameters)[:, 0]


class Offset(Effect, ABC):
    """Coordinates that are elsewhere than the controller believes."""

    @abstractmethod
    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        """Add to ``offset`` (m, N) [rad, m], in place, at ``motors`` (n, N) [rad, m] as commanded."""


class ComplianceLaw(Effect, ABC):
    """Displacement of coordinates as a function of the generalized force on them."""

    @abstractmethod
    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        """Add to ``displacement`` (m, N) [rad, m] under ``force`` (m, N) [N m, N], and its derivative to ``slope`` (m,
        N) [rad/(N m), m/N], coordinate by coordinate; both in place."""


class LinearCompliance(ComplianceLaw):
    """theta_i = c_i tau_i, dtheta_i/dtau_i = c_i: one parameter a coordinate of ``coordinates``, in that order; tau_i
    the whole generalized force on it, of the wrench and of the loads, at the deflected pose."""

    zero_without_load = True

    def rows(self, chain: Chain) -> Any:
        """Where the coordinates are in the chain."""
        return [chain.index[name] for name in self.coordinates]

    def add_displacement(
        self, values: Values, state: ChainState, force: Floats, displacement: Floats, slope: Floats
    ) -> None:
        rows, compliance = self.rows(state.chain), column(values, self.parameters)
        displacement[rows] += compliance * force[rows]
        slope[rows] += compliance


class Load(Effect, ABC):
    """A generalized force on coordinates.  ``by_rest``: it asks where the coordinates are without load."""

    by_rest: ClassVar[bool] = False

    @abstractmethod
    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        """Add to ``force`` (m, N) [N m, N] and its derivative by the own coordinate to ``slope`` (m, N) [N m/rad, N/m];
        both in place."""


class EnergyLoad(Load):
    """A load that is the negative gradient of an energy."""

    @abstractmethod
    def energy(self, values: Values, state: ChainState) -> Floats:
        """Energy (N,) [J]."""


def per_joint(
    joints: Sequence[Joint],
    letter: str,
    units: tuple[str, str],
    lower: float,
    upper: float,
    source: str,
    null: float = 0.0,
    plausible: tuple[float, float] = (0.0, math.inf),
) -> tuple[Parameter, ...]:
    """One parameter a joint, ``letter`` and number; ``units`` of a turning and of a sliding joint, ``plausible`` of a
    turning one."""
    return tuple(
        Parameter(
            f"{letter}{i}",
            units[not joint.turns],
            null,
            lower,
            upper,
            source,
            joint.name,
            plausible=plausible if joint.turns else (0.0, math.inf),
        )
        for i, joint in enumerate(joints, 1)
    )


def column(values: Values, parameters: Sequence[Parameter]) -> Floats:
    """The values of ``parameters`` as a column (k, 1)."""
    return np.array([values[parameter.name] for parameter in parameters])[:, None]
