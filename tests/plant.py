"""The arm of a robot file as a MuJoCo model: the independent engine that the stiffness model is held against.

Built from the same physical description by MuJoCo's own means: nested bodies with hinges, joint springs about the
motor angle, the gravity compensator as a spatial tendon between two sites.  The arm is written down here once more
(axes A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x; stretched forward at zero) and nothing of ``postproc.robot.chain``
is used.  Equilibria are found by Newton's method on MuJoCo's generalized forces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import mujoco
import numpy as np

from postproc.effects.gravity_compensator import GravityCompensator
from postproc.geometry import Poses
from postproc.model import StiffnessModel, Term
from postproc.robot.description import KukaLengths, Robot, find_robot, load_robot

AXES = ("0 0 -1", "0 1 0", "0 1 0", "-1 0 0", "0 1 0", "-1 0 0")
STEP_TOLERANCE = 1e-13
_TINY = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-6 1e-6 1e-6"/>'


class Rest(NamedTuple):
    """A loaded state: coordinates (6,) [rad], position (3,) [m] and rotation (3, 3) of the TCP in the base."""

    coordinates: np.ndarray
    position: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class Spring:
    """The gravity compensator across A2 as the paper's Fig. 1 has it; SI."""

    K_c: float
    s0: float
    L: float
    a_x: float
    a_y: float
    h: float = 0.0
    zero: float = 0.0
    balanced: bool = True


class Plant:
    """The arm with a spring of 1 / compliance in every joint."""

    def __init__(self, arm: KukaLengths, compliance: np.ndarray, spring: Spring | None = None) -> None:
        self.balanced = spring is not None and spring.balanced
        self.model = mujoco.MjModel.from_xml_string(_xml(arm, compliance, spring))
        self.data = mujoco.MjData(self.model)
        self.last = self.model.body("link6").id
        self.d6 = arm.d6
        self.size = self.model.nv

    @classmethod
    def of(cls, model: StiffnessModel) -> Plant:
        """The plant of a model's robot with the values of its effects."""
        compliance, spring = np.zeros(6), None
        for term in model.terms:
            values = dict(term.values)
            if isinstance(term.effect, GravityCompensator):
                assert term.effect.joint == 1
                spring = Spring(**values, zero=term.effect.zero, balanced=term.effect.preload == "balanced")
            else:
                compliance = np.array([values[f"c{i}"] for i in range(1, 7)])
        return cls(model.robot.arm, compliance, spring)

    def passive(self, coordinates: np.ndarray, motors: np.ndarray) -> np.ndarray:
        """(6,) [N m] torque of all springs on the joints, motors at ``motors``."""
        self._place(coordinates, motors)
        return self.data.qfrc_passive - self.data.qfrc_bias

    def rest(self, motors: np.ndarray, wrench: np.ndarray, tool: Poses) -> Rest:
        """The static equilibrium under ``wrench`` (6,) at the TCP, base axes."""
        held = np.zeros(self.size)
        if self.balanced:
            # at the motor angles the joint springs are slack: what is left is the tendon
            held = -self.passive(motors, motors)
        coordinates = motors.copy()
        for _ in range(30):
            step = np.linalg.solve(
                self._slope(coordinates, motors, held, wrench, tool),
                -self._residual(coordinates, motors, held, wrench, tool),
            )
            coordinates = coordinates + step
            if np.abs(step).max() < STEP_TOLERANCE:
                self._place(coordinates, motors)
                return Rest(coordinates, *self._tcp(tool))
        raise ArithmeticError("Newton's method found no equilibrium")

    def energy(self, coordinates: np.ndarray, motors: np.ndarray) -> float:
        """[J] in all springs."""
        self._place(coordinates, motors)
        mujoco.mj_energyPos(self.model, self.data)
        return float(self.data.energy[0])

    def spring_length(self, coordinates: np.ndarray) -> float:
        """[m] from P0 to P1."""
        self._place(coordinates, coordinates)
        return float(self.data.ten_length[0])

    def _place(self, coordinates: np.ndarray, motors: np.ndarray) -> None:
        self.model.qpos_spring[:] = motors
        self.data.qpos[:] = coordinates
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)

    def _tcp(self, tool: Poses) -> tuple[np.ndarray, np.ndarray]:
        turned = self.data.xmat[self.last].reshape(3, 3)
        flange = turned @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # z out along the forearm
        centre = self.data.xpos[self.last] + self.d6 * turned[:, 0]
        return centre + flange @ tool.position, flange @ tool.rotation

    def _residual(
        self,
        coordinates: np.ndarray,
        motors: np.ndarray,
        held: np.ndarray,
        wrench: np.ndarray,
        tool: Poses,
    ) -> np.ndarray:
        springs = self.passive(coordinates, motors)
        linear, angular = np.zeros((3, self.size)), np.zeros((3, self.size))
        mujoco.mj_jac(self.model, self.data, linear, angular, self._tcp(tool)[0], self.last)
        return springs + held + linear.T @ wrench[:3] + angular.T @ wrench[3:]

    def _slope(self, coordinates: np.ndarray, *rest: object) -> np.ndarray:
        step = 1e-6
        columns = [
            (self._residual(coordinates + step * e, *rest) - self._residual(coordinates - step * e, *rest))
            / (2 * step)
            for e in np.eye(self.size)
        ]
        return np.stack(columns, axis=1)


def _xml(arm: KukaLengths, compliance: np.ndarray, spring: Spring | None) -> str:
    places = [(0, 0, 0), (arm.a1, 0, arm.d1), (arm.a2, 0, 0), (arm.d4, 0, arm.a3), (0, 0, 0), (0, 0, 0)]
    body, sites, tendon = "", {}, ""
    if spring is not None:
        # P0 on link 1 behind and below axis 2; P1 on link 2 along the upper arm, which falls as A2 grows
        p0 = (arm.a1 - spring.a_x, 0.0, arm.d1 - spring.a_y)
        p1 = (spring.L * np.cos(spring.zero), spring.h, spring.L * np.sin(spring.zero))
        sites = {1: _site("P0", p0), 2: _site("P1", p1)}
        tendon = (
            f'<tendon><spatial name="spring" stiffness="{spring.K_c!r}" springlength="{spring.s0!r} {spring.s0!r}">'
            '<site site="P0"/><site site="P1"/></spatial></tendon>'
        )
    for i in range(6, 0, -1):
        stiffness = float(1.0 / compliance[i - 1])
        body = (
            f'<body name="link{i}" pos="{_words(places[i - 1])}">'
            f'<joint name="A{i}" type="hinge" axis="{AXES[i - 1]}" stiffness="{stiffness!r}"/>'
            f"{_TINY}{sites.get(i, '')}{body}</body>"
        )
    return (
        '<mujoco><compiler angle="radian" autolimits="false"/>'
        '<option gravity="0 0 0"><flag contact="disable" energy="enable"/></option>'
        f"<worldbody>{body}</worldbody>{tendon}</mujoco>"
    )


def _site(name: str, place: tuple[float, ...]) -> str:
    return f'<site name="{name}" pos="{_words(place)}"/>'


def _words(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


# The robot of the tests, and states for it.


def kr270() -> Robot:
    return load_robot(find_robot("kuka_kr270"))


def with_compensator(model: StiffnessModel, **change: object) -> StiffnessModel:
    """The model with another compensator: ``preload``, ``sign``, ``zero``, or any of its values."""
    terms = []
    for term in model.terms:
        if isinstance(term.effect, GravityCompensator):
            old = term.effect
            effect = GravityCompensator(
                model.robot.joints,
                old.joint,
                str(change.get("preload", old.preload)),
                str(change.get("sign", old.sign)),
                float(change.get("zero", old.zero)),  # type: ignore[arg-type]
            )
            values = {name: change.get(name, value) for name, value in term.values.items()}
            term = Term(effect, values, {})  # type: ignore[arg-type]
        terms.append(term)
    return replace(model, terms=tuple(terms))


SOFTER = {"K_c": 1.0e5, "preload": "acting"}
"""A compensator that a heavy arm could carry: up to some 8 kN m where Table 1's would pull with 343."""


def random_angles(robot: Robot, count: int, rng: np.random.Generator) -> np.ndarray:
    """(N, 6) within the axis limits."""
    low, high = robot.limits.T
    return rng.uniform(low, high, (count, 6))


def random_wrenches(count: int, rng: np.random.Generator) -> np.ndarray:
    """(N, 6) as milling has them: forces to 1 kN, moments to 100 N m, any direction."""
    unit = rng.normal(size=(count, 2, 3))
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    size = rng.uniform(0.0, 1.0, (count, 2)) * [1000.0, 100.0]
    return (unit * size[..., None]).reshape(count, 6)


def random_tools(count: int, rng: np.random.Generator) -> Poses:
    """TCPs up to half a metre off the flange, turned any way."""
    turns, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    turns *= np.linalg.det(turns)[:, None, None]
    return Poses(turns, rng.uniform(-0.5, 0.5, (count, 3)))
