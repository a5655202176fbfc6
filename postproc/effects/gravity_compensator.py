"""Gravity compensator: a spring between two neighbouring links, from its energy.

Klimchik, Caro, Wu, Chablat, Furet, Pashkevich, "Stiffness modeling of robotic manipulator with gravity
compensator", Computational Kinematics (CK 2013), Springer 2014, eqs (1) to (4).  The spring runs from P0 on link i - 1
to P1 on link i:

    s^2 = a^2 + L^2 + 2 a L cos(alpha + q) + h^2        (1), h = 0 there
    U   = K_c (s - s0)^2 / 2
    M_c = -dU/dq = K_c (1 - s0/s) a L sin(alpha + q)     (2)
    d2U/dq2 = -K_c a L eta_q                             eta_q as in (4)

The stiffness of the joint with the spring is K + d2U/dq2 = K - K_c a L eta_q.  Eq. (3) prints a plus; that
reading is available as the option ``sign: as_printed`` and is no spring.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.base.yaml_section import YamlSection
from postproc.effects.effect import ChainState, EnergyLoad, Parameter, Values
from postproc.robot.chain import sine_and_cosine
from postproc.robot.geometries import Joint

_SOURCE = "Klimchik et al., Fig. 1 and eqs (1)-(4)"

SIGNS = {"energy": 1.0, "as_printed": -1.0}
"""Of the change of the torque, by the option ``sign``."""

SPRING, LEVER = (1e3, 1e9), (0.01, 10.0)
"""[N/m], [m] Springs and lengths of built compensators lie between these."""


class SpringState(NamedTuple):
    """The spring at joint angles (N,), with its stiffness and rest length.  ``stiffness`` K_c [N/m]; ``rest`` s0 [m];
    ``length`` (N,) s [m]; ``ratio`` (N,) s0 / s; ``product`` a L [m2]; ``sine``, ``cosine`` (N,) of alpha + q."""

    stiffness: float
    rest: float
    product: float
    length: Floats
    ratio: Floats
    sine: Floats
    cosine: Floats

    @property
    def energy(self) -> Floats:
        """(N,) U [J]."""
        return np.asarray(0.5 * self.stiffness * (self.length - self.rest) ** 2)

    @property
    def torque(self) -> Floats:
        """(N,) M_c = -dU/dq [N m]."""
        return np.asarray(self.stiffness * self.product * (1 - self.ratio) * self.sine)

    @property
    def slope(self) -> Floats:
        """(N,) dM_c/dq = K_c a L eta_q [N m/rad]."""
        share = self.product / (self.length * self.length) * self.sine * self.sine
        return np.asarray(self.stiffness * self.product * (self.cosine - self.ratio * (share + self.cosine)))


class GravityCompensator(EnergyLoad):
    """A spring across one joint.  Seen from the joint's axis, P0 lies at (-a_x, -a_y) on the link before and P1 at
    distance L along the link after it: a = hypot(a_x, a_y), alpha = atan2(a_y, a_x), and q of the paper is the joint's
    angle, displaced by the load, less ``zero`` [rad].  Only the sum alpha + q counts: no more of the frames is asked
    for.  ``h`` [m] is the distance of P0 and P1 along the axis.

    On the joint's own coordinate acts, with q_0 its angle without load (motor and offsets):

        tau = M_c(q) - M_c(q_0), U(q) + M_c(q_0) q      ``preload: balanced``: cancelled at the unloaded pose
        tau = M_c(q), U(q)                              ``preload: acting``: the whole torque
        tau = M_c(q_0) [acting] - (M_c(q) - M_c(q_0))   ``sign: as_printed``: the change with the other sign
    """

    name = "gravity_compensator"
    family = "elastic"
    by_rest = True

    def __init__(
        self,
        joints: Sequence[Joint],
        joint: int = 1,
        preload: str = "balanced",
        sign: str = "energy",
        zero: float = 0.0,
    ) -> None:
        self.joint = joint
        self.joint_name = joints[joint].name
        self.preload = preload
        self.zero_without_load = preload == "balanced"
        self.sign = sign
        self.zero = zero
        at, along = self.joint_name, "distance of the two ends along the joint axis"
        self.parameters = (
            Parameter("K_c", "N/m", 0.0, 0.0, 1e9, _SOURCE, at, plausible=SPRING),
            Parameter("s0", "m", 0.0, 0.0, 10.0, _SOURCE, at, size=0.3, plausible=LEVER),
            Parameter("L", "m", 0.0, 0.0, 10.0, _SOURCE, at, hardware=True, size=0.3, plausible=LEVER),
            Parameter("a_x", "m", 0.0, -10.0, 10.0, _SOURCE, at, hardware=True, size=0.3),
            Parameter("a_y", "m", 0.0, -10.0, 10.0, _SOURCE, at, hardware=True, size=0.3),
            Parameter("h", "m", 0.0, -10.0, 10.0, along, at, hardware=True, size=0.3),
        )

    @classmethod
    def from_options(cls, options: YamlSection, joints: Sequence[Joint]) -> Self:
        options.only("joint", "preload", "sign", "zero_deg")
        names = [joint.name for joint in joints if joint.turns]
        name = options.text("joint", choices=names)
        return cls(
            joints,
            [joint.name for joint in joints].index(name),
            options.text("preload", "balanced", ("balanced", "acting")),
            options.text("sign", "energy", tuple(SIGNS)),
            options.number("zero_deg", 0.0, -360.0, 360.0) * DEG,
        )

    @classmethod
    def of_mechanism(cls, joints: Sequence[Joint], joint: str | None, quantities: Values) -> Self:
        names = [one.name for one in joints]
        return cls(joints, 1 if joint is None else names.index(joint), zero=quantities.get("zero", 0.0))

    @classmethod
    def variants(cls, joints: Sequence[Joint]) -> tuple[Self, ...]:
        # across the shoulder, whatever carries the arm
        turning = [index for index, joint in enumerate(joints) if joint.turns]
        return (cls(joints, turning[1]),) if len(turning) > 1 else ()

    def described(self) -> dict[str, object]:
        return {
            "joint": self.joint_name,
            "preload": self.preload,
            "sign": self.sign,
            "zero_deg": self.zero / DEG,
        }

    def spring(self, values: Values, angle: Floats) -> SpringState:
        """The spring at joint angles ``angle`` (N,) [rad], as the controller counts them."""
        k, s0, length = values["K_c"], values["s0"], values["L"]
        a, alpha = math.hypot(values["a_x"], values["a_y"]), math.atan2(values["a_y"], values["a_x"])
        phi = alpha + angle - self.zero
        product = a * length
        sine, cosine = sine_and_cosine(phi)
        s = np.sqrt(np.maximum(a * a + length * length + 2 * product * cosine + values["h"] ** 2, 1e-18))
        return SpringState(k, s0, product, s, s0 / s, sine, cosine)

    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        row = state.chain.motor_rows[self.joint]
        here = self.spring(values, state.coordinates[row])
        rest = self.spring(values, state.rest[row]).torque
        sign = SIGNS[self.sign]
        force[row] += sign * (here.torque - rest) + (0.0 if self.zero_without_load else rest)
        slope[row] += sign * here.slope

    def energy(self, values: Values, state: ChainState) -> Floats:
        row = state.chain.motor_rows[self.joint]
        rest = self.spring(values, state.rest[row]).torque if self.zero_without_load else 0.0
        return np.asarray(self.spring(values, state.coordinates[row]).energy + rest * state.coordinates[row])
