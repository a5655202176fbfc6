"""The arm of a robot file as a MuJoCo model: the independent engine that the stiffness model is held against.

Built from the same physical description by MuJoCo's own means: nested bodies with hinges and slides, joint springs
(straight and cubic) about the motor angle, the gravity compensator as a spatial tendon between two sites, weights as
masses under gravity.  The arm is written down here once more (axes A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x; stretched
forward at zero) and nothing of ``postproc.robot.chain`` or of the effects' own physics is used.  Equilibria are found
by Newton's method on MuJoCo's generalized forces.

From the ground up: six coordinates of the base (three slides, three hinges); in front of every motor a bearing with
two hinges across the axis; at the TCP three slides along and across the spindle.  What has no spring stands still.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np

from postproc.base.geometry import Poses
from postproc.effects import Conditions
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.model import EffectInstance, StiffnessModel
from postproc.robot.description import Robot, find_robot, load_robot
from postproc.robot.geometries import KukaLengths

AXES = ("0 0 -1", "0 1 0", "0 1 0", "-1 0 0", "0 1 0", "-1 0 0")
ACROSS = (
    ("1 0 0", "0 -1 0"),
    ("0 0 1", "1 0 0"),
    ("0 0 1", "1 0 0"),
    ("0 0 1", "0 1 0"),
    ("0 0 1", "1 0 0"),
    ("0 0 1", "0 1 0"),
)
"""x and y of each joint's frame, its axis being z: x stands up where the axis lies, forward where it stands."""

BASE = [f"base.{word}" for word in ("x", "y", "z", "rx", "ry", "rz")]
MOTORS = [f"A{i}" for i in range(1, 7)]
TILTS = [f"A{i}.r{axis}" for i in range(1, 7) for axis in "xy"]
TIP = ["spindle.x", "spindle.y", "spindle.z"]

STEP_TOLERANCE = 1e-13
GRAVITY = 9.80665
_TINY = '<inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'

LINKS = (
    (180.0, (0.12, -0.03, 0.40)),
    (160.0, (0.55, 0.11, 0.02)),
    (140.0, (0.28, -0.06, 0.05)),
    (70.0, (-0.45, 0.01, -0.02)),
    (40.0, (0.03, 0.02, -0.04)),
    (15.0, (0.14, 0.01, 0.02)),
)
"""Mass [kg] and centre [m, from the joint, axes of the base at the zero pose] of each link, for a heavy arm."""


class Rest(NamedTuple):
    """A loaded state: coordinates (6,) [rad] of the joints, position (3,) [m] and rotation (3, 3) of the TCP in the
    base."""

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


NONE = np.zeros(12)
NONE.setflags(write=False)


@dataclass(frozen=True)
class Hardware:
    """What an arm may have beside joints that give way; SI, 0 = not there.

    compliance of base (6,), tilts (12,) and the tip across and along the spindle; cubic (6,) [N m/rad3] of the joints;
    links: mass and centre of each; hung: mass on the flange and centre in its axes; gap (6,) [rad] whole; width (6,)
    [rad] of hysteresis; zero (6,) [rad]; wave: (joint, harmonic, sine, cosine); ratio: (joint, of joint) -> share;
    sag: (joint, link) -> (2,) [rad] of a moment across the link's axis; growth: joint -> [m/K or m/s]; shift: joint ->
    (2,) [m] of its axis; turn (12,) [rad] of the axes; base and tool offset (6,); gauge: gain and bias (7,).
    """

    base: np.ndarray = field(default_factory=lambda: NONE[:6])
    tilts: np.ndarray = field(default_factory=lambda: NONE)
    radial: float = 0.0
    axial: float = 0.0
    cubic: np.ndarray = field(default_factory=lambda: NONE[:6])
    links: tuple[tuple[float, tuple[float, ...]], ...] = ()
    hung: tuple[tuple[float, tuple[float, ...]], ...] = ()
    gap: np.ndarray = field(default_factory=lambda: NONE[:6])
    width: np.ndarray = field(default_factory=lambda: NONE[:6])
    zero: np.ndarray = field(default_factory=lambda: NONE[:6])
    wave: tuple[tuple[int, float, float, float], ...] = ()
    ratio: Mapping[tuple[int, int], float] = field(default_factory=dict)
    sag: Mapping[tuple[int, int], np.ndarray] = field(default_factory=dict)
    growth: Mapping[int, float] = field(default_factory=dict)
    by_time: bool = False
    shift: Mapping[int, np.ndarray] = field(default_factory=dict)
    turn: np.ndarray = field(default_factory=lambda: NONE)
    base_offset: np.ndarray = field(default_factory=lambda: NONE[:6])
    tool_offset: np.ndarray = field(default_factory=lambda: NONE[:6])
    gauge: np.ndarray = field(default_factory=lambda: NONE[:7])


class Plant:
    """The arm with a spring of 1 / compliance in every joint, and what ``hardware`` says."""

    def __init__(
        self,
        arm: KukaLengths,
        compliance: np.ndarray,
        spring: Spring | None = None,
        hardware: Hardware | None = None,
    ) -> None:
        self.balanced = spring is not None and spring.balanced
        self.arm, self.hardware = arm, hardware or Hardware()
        gives = self._compliances(np.asarray(compliance, float))
        self.model = mujoco.MjModel.from_xml_string(_xml(arm, gives, spring, self.hardware))
        self.data = mujoco.MjData(self.model)
        self.size = self.model.nv
        self.row_of = {name: int(self.model.joint(name).dofadr[0]) for name in (*BASE, *MOTORS, *TILTS, *TIP)}
        self.motor_rows = np.array([self.row_of[name] for name in MOTORS])
        self.compliances = np.array([gives[self.model.joint(i).name] for i in range(self.size)])
        self.free_rows = np.flatnonzero(self.compliances)
        self._bearings = [self.model.body(f"bearing{i}").id for i in range(1, 7)]
        self._places = self.model.body_pos[self._bearings].copy()
        self.last_body, self.tip_body = self.model.body("link6").id, self.model.body("tip").id
        self.d6 = arm.d6

    def _compliances(self, joints: np.ndarray) -> dict[str, float]:
        """Coordinate -> compliance; 0 where it is held."""
        have = self.hardware
        tip = (have.radial, have.radial, have.axial)
        pairs = ((BASE, have.base), (MOTORS, joints), (TILTS, have.tilts), (TIP, tip))
        return {name: float(c) for names, values in pairs for name, c in zip(names, values, strict=True)}

    @classmethod
    def of(cls, model: StiffnessModel, links: tuple[tuple[float, tuple[float, ...]], ...] = LINKS) -> Plant:
        """The plant of a model's robot with the values of its effects; weights of the links are those of ``links``."""
        compliance, spring, have = np.zeros(6), None, Hardware()
        for term in model.terms:
            name, values = term.effect.name, dict(term.values)
            if isinstance(term.effect, GravityCompensator):
                assert term.effect.joint == 1
                spring = Spring(**values, zero=term.effect.zero, balanced=term.effect.preload == "balanced")
            elif name == "joint_compliance":
                compliance = np.array([values[f"c{i}"] for i in range(1, 7)])
            elif name == "link_gravity":
                have = replace(have, links=links)
            else:
                have = replace(have, **PARTS[name](values, term.effect))
        return cls(model.robot.arm, compliance, spring, have)

    def first_moments(self, amount: float = 0.0) -> dict[str, float]:
        """The links' weights as a model is told of them: first moments about the joints, with the mass of all that
        follows at the next joint; ``amount``: kelvin or seconds since the calibration."""
        moments, follows = {}, 0.0
        places = [*self._placed(amount), np.zeros(3)]
        for i in range(6, 0, -1):
            mass, centre = self.hardware.links[i - 1]
            moment = mass * np.array(centre) + follows * places[i]
            moments |= dict(zip((f"m{axis}{i}" for axis in "xyz"), moment.tolist(), strict=True))
            follows += mass
        return {**moments, "mass": follows}

    def passive(self, coordinates: np.ndarray, motors: np.ndarray) -> np.ndarray:
        """(6,) [N m] torque of springs and weights on the joints (6,), motors at ``motors``."""
        self.place(self.coordinates_of(coordinates), self.coordinates_of(motors))
        return (self.data.qfrc_passive - self.data.qfrc_bias)[self.motor_rows]

    def rest(
        self,
        motors: np.ndarray,
        wrench: np.ndarray,
        tool: Poses,
        conditions: Conditions | None = None,
        row: int = 0,
    ) -> Rest:
        """The static equilibrium under ``wrench`` (6,) at the TCP, base axes; ``row`` of the conditions."""
        given, have = conditions or Conditions(), self.hardware
        along = np.array([0.0, 0, 1]) if given.spindle is None else given.spindle[row]
        amount = given.time if have.by_time else given.temperature
        self.model.body_pos[self._bearings] = self._placed(0.0 if amount is None else amount[row])
        self.set_tip(tool, along)
        if wrench.any():
            wrench = (1 + have.gauge[0]) * (wrench - have.gauge[1:])
        came = None if given.direction is None else given.direction[row]
        self.directions = np.zeros(len(self.motor_rows)) if came is None else came
        free = self._unloaded(motors, came)
        held = np.zeros(self.size)
        if self.balanced:
            # without load the joints' springs are slack: what is left is the tendon
            self.place(free, free)
            held = -self.data.qfrc_passive.copy()
        for slowed in (False, True):
            coordinates = self._equilibrium(slowed, free, held, wrench)
            if coordinates is not None:
                self.place(coordinates, free)
                return Rest(coordinates[self.motor_rows], *self.tcp())
        raise ArithmeticError(
            "no equilibrium was found, neither by Newton's method nor by an arm that creeps"
        )

    def _equilibrium(
        self, slowed: bool, free: np.ndarray, held: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray | None:
        """All coordinates at rest by Newton's method from the unloaded ones, None where it circles or ends between the
        sides of a gap, whence the arm would fall to one: about a gap the force does not fall evenly.

        ``slowed``: an arm that creeps under the load instead, a damper beside each spring, by steps of implicit Euler
        that lengthen as the force falls (Kelley and Keyes 1998, 10.1137/S0036142996304796).
        """
        moving, coordinates = self.free_rows, free.copy()
        damping, time, last = np.diag(1 / self.compliances[moving]), 0.1, np.inf
        for _ in range(400 if slowed else 40):
            force = self.residual(coordinates, free, held, wrench)[moving]
            slope = self.slope(coordinates, free, held, wrench)
            if slowed:
                size = float(np.linalg.norm(force))
                time *= min(last / size, 2.0) if 0 < size < np.inf and last < np.inf else 1.0
                slope, last = slope - damping / time, size
            step = np.linalg.solve(slope, -force)
            coordinates[moving] += step
            if np.abs(step).max() < STEP_TOLERANCE:
                falls = not slowed and self.hardware.gap.any() and np.linalg.eigvals(slope).real.max() > 0
                return None if falls else coordinates
        return None

    def energy(self, coordinates: np.ndarray, motors: np.ndarray) -> float:
        """[J] in all springs."""
        self.place(self.coordinates_of(coordinates), self.coordinates_of(motors))
        mujoco.mj_energyPos(self.model, self.data)
        return float(self.data.energy[0])

    def spring_length(self, coordinates: np.ndarray) -> float:
        """[m] from P0 to P1."""
        self.place(self.coordinates_of(coordinates), self.coordinates_of(coordinates))
        return float(self.data.ten_length[0])

    def coordinates_of(self, joints: np.ndarray) -> np.ndarray:
        whole = np.zeros(self.size)
        whole[self.motor_rows] = joints
        return whole

    def _unloaded(self, motors: np.ndarray, direction: np.ndarray | None) -> np.ndarray:
        """All coordinates without load: where the controller sends the motors, and what it does not know of."""
        have, stand = self.hardware, motors + self.hardware.zero
        for joint, harmonic, sine, cosine in have.wave:
            phase = harmonic * motors[joint]
            stand[joint] += sine * np.sin(phase) + cosine * np.cos(phase)
        for (joint, other), share in have.ratio.items():
            stand[joint] += share * motors[other]
        if have.sag:
            self.place(self.coordinates_of(motors), self.coordinates_of(motors))
            for (joint, link), (x, y) in have.sag.items():
                turned = self.data.body(f"link{link + 1}").xmat.reshape(3, 3)
                along, across = (np.array(axis.split(), float) for axis in ACROSS[link])
                moment = turned @ (x * along + y * across)
                axis = self.data.joint(MOTORS[joint]).xaxis
                stand[joint] += axis @ np.cross(moment, [0.0, 0.0, -1.0])
        if direction is not None:
            stand = stand - 0.5 * have.width * direction
        whole = self.coordinates_of(stand)
        whole[[self.row_of[name] for name in BASE]] = have.base_offset
        whole[[self.row_of[name] for name in TILTS]] = have.turn
        return whole

    def _placed(self, amount: float) -> np.ndarray:
        """(6, 3) place of each bearing on the link before: grown, and with its axis shifted."""
        places = self._places.copy()
        for joint, rate in self.hardware.growth.items():
            places[joint] *= 1 + rate * amount / np.linalg.norm(places[joint])
        for joint, way in self.hardware.shift.items():
            places[joint] += sum(
                w * np.array(axis.split(), float) for w, axis in zip(way, ACROSS[joint], strict=True)
            )
        return places

    def set_tip(self, tool: Poses, along: np.ndarray) -> None:
        """Put the tip's body at the TCP, with its z axis along the spindle."""
        x, y, z, *turns = self.hardware.tool_offset
        turned = tool.rotation
        for axis, angle in zip(np.eye(3), turns, strict=True):
            quaternion, matrix = np.zeros(4), np.zeros(9)
            mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
            mujoco.mju_quat2Mat(matrix, quaternion)
            turned = turned @ matrix.reshape(3, 3)
        flange = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # z out along the forearm
        centre = tool.position + tool.rotation @ [x, y, z]
        self.model.body_pos[self.tip_body] = [self.d6, 0, 0] + flange @ centre
        # any frame with this z axis: across the spindle all directions are alike
        frame = np.zeros(4)
        mujoco.mju_quatZ2Vec(frame, flange @ turned @ along)
        self.model.body_quat[self.tip_body] = frame
        self._tool_in_link = flange @ turned

    def place(self, coordinates: np.ndarray, motors: np.ndarray) -> None:
        self.model.qpos_spring[:] = motors
        self.data.qpos[:] = coordinates
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)

    def tcp(self) -> tuple[np.ndarray, np.ndarray]:
        turned = self.data.xmat[self.last_body].reshape(3, 3)
        return self.data.xpos[self.tip_body].copy(), turned @ self._tool_in_link

    def residual(
        self, coordinates: np.ndarray, free: np.ndarray, held: np.ndarray, wrench: np.ndarray
    ) -> np.ndarray:
        self.place(coordinates, free)
        linear, angular = np.zeros((3, self.size)), np.zeros((3, self.size))
        mujoco.mj_jac(self.model, self.data, linear, angular, self.data.xpos[self.tip_body], self.tip_body)
        force = self.data.qfrc_passive - self.data.qfrc_bias + held
        force += linear.T @ wrench[:3] + angular.T @ wrench[3:]
        if self.hardware.gap.any():
            # the torque on a joint's own spring shifts it to one side of its gap; friction of 20 N m holds it back
            rows = self.motor_rows
            stiffness = 1 / self.compliances[rows]
            torque = force[rows] + stiffness * (coordinates - free)[rows]
            sides = [np.tanh((torque - 20.0 * came) / 10.0) for came in (1.0, -1.0)]
            side = 0.5 * ((1 + self.directions) * sides[0] + (1 - self.directions) * sides[1])
            force[rows] += stiffness * 0.5 * self.hardware.gap * side
        return force

    def slope(self, coordinates: np.ndarray, *rest: np.ndarray) -> np.ndarray:
        step, columns = 1e-6, []
        for row in self.free_rows:
            move = np.zeros(self.size)
            move[row] = step
            ends = [self.residual(coordinates + sign * move, *rest)[self.free_rows] for sign in (1, -1)]
            columns.append((ends[0] - ends[1]) / (2 * step))
        return np.stack(columns, axis=1)


# Parameters of an effect -> fields of Hardware.


def _list(values: Mapping[str, float], *names: str) -> np.ndarray:
    return np.array([values[name] for name in names])


def _joints(values: Mapping[str, float], letter: str) -> np.ndarray:
    return _list(values, *(f"{letter}{i}" for i in range(1, 7)))


PARTS = {
    "base_compliance": lambda v, e: {"base": _list(v, "c_x", "c_y", "c_z", "c_rx", "c_ry", "c_rz")},
    "link_compliance": lambda v, e: {"tilts": _list(v, *(f"c{i}{a}" for i in range(1, 7) for a in "xy"))},
    "tool_compliance": lambda v, e: {"radial": v["radial"], "axial": v["axial"]},
    "joint_stiffening": lambda v, e: {"cubic": _joints(v, "k")},
    "payload": lambda v, e: {"hung": ((v["mass"], (v["x"], v["y"], v["z"])),)},
    "backlash": lambda v, e: {"gap": _joints(v, "b")},
    "hysteresis": lambda v, e: {"width": _joints(v, "w")},
    "joint_offset": lambda v, e: {"zero": _joints(v, "o")},
    "transmission_error": lambda v, e: {
        "wave": tuple(
            (i, h, v[f"s{i + 1}_{h:g}"], v[f"c{i + 1}_{h:g}"]) for i in range(6) for h in e.harmonics
        )
    },
    "gravity_sag": lambda v, e: {
        "sag": {
            (int(s[2]) - 1, int(s[4]) - 1): np.array([v[f"s{a}{s[2:]}"] for a in "xy"])
            for s in v
            if s[1] == "x"
        }
    },
    "joint_coupling": lambda v, e: {"ratio": {(int(r[1]) - 1, int(r[2]) - 1): x for r, x in v.items()}},
    "thermal_growth": lambda v, e: {
        "growth": {int(g[1]) - 1: x for g, x in v.items()},
        "by_time": e.variable == "time",
    },
    "link_geometry": lambda v, e: {
        "shift": {i: np.array([v.get(f"d{a}{i + 1}", 0.0) for a in "xy"]) for i in range(6)},
        "turn": np.array([v.get(f"r{a}{i}", 0.0) for i in range(1, 7) for a in "xy"]),
    },
    "base_offset": lambda v, e: {"base_offset": _list(v, "x", "y", "z", "rx", "ry", "rz")},
    "tool_offset": lambda v, e: {"tool_offset": _list(v, "x", "y", "z", "rx", "ry", "rz")},
    "force_sensor": lambda v, e: {"gauge": _list(v, "gain", "fx", "fy", "fz", "mx", "my", "mz")},
}


# The XML.


def _xml(arm: KukaLengths, gives: Mapping[str, float], spring: Spring | None, have: Hardware) -> str:
    places = [(0, 0, 0), (arm.a1, 0, arm.d1), (arm.a2, 0, 0), (arm.d4, 0, arm.a3), (0, 0, 0), (0, 0, 0)]
    sites, tendon = {}, ""
    if spring is not None:
        # P0 behind and below axis 2, on what carries it; P1 along the upper arm, which falls as A2 grows
        p0 = (-spring.a_x, 0.0, -spring.a_y)
        p1 = (spring.L * np.cos(spring.zero), spring.h, spring.L * np.sin(spring.zero))
        sites = {"bearing2": _site("P0", p0), "link2": _site("P1", p1)}
        tendon = (
            f'<tendon><spatial name="spring" stiffness="{spring.K_c!r}" springlength="{spring.s0!r} {spring.s0!r}">'
            '<site site="P0"/><site site="P1"/></spatial></tendon>'
        )
    # the flange's x, y, z are -z, y, x of the last link
    hung = "".join(
        f'<body pos="{_words((arm.d6 + z, y, -x))}">{_weight(mass, (0, 0, 0))}</body>'
        for mass, (x, y, z) in have.hung
    )
    tip = "".join(_joint(name, "slide", axis, gives) for name, axis in zip(TIP, _UNITS, strict=True))
    body = f'<body name="tip">{tip}{_TINY}</body>{hung}'
    for i in range(6, 0, -1):
        weight = _weight(*have.links[i - 1]) if have.links else _TINY
        motor = _joint(f"A{i}", "hinge", AXES[i - 1], gives, have.cubic[i - 1])
        tilts = "".join(
            _joint(f"A{i}.r{a}", "hinge", axis, gives) for a, axis in zip("xy", ACROSS[i - 1], strict=True)
        )
        body = f'<body name="link{i}">{motor}{weight}{sites.get(f"link{i}", "")}{body}</body>'
        body = (
            f'<body name="bearing{i}" pos="{_words(places[i - 1])}">'
            f"{tilts}{_TINY}{sites.get(f'bearing{i}', '')}{body}</body>"
        )
    ground = "".join(
        _joint(name, "hinge" if ".r" in name else "slide", axis, gives)
        for name, axis in zip(BASE, (*_UNITS, *_UNITS), strict=True)
    )
    return (
        '<mujoco><compiler angle="radian" autolimits="false"/>'
        f'<option gravity="0 0 {-GRAVITY}"><flag contact="disable" energy="enable"/></option>'
        f'<worldbody><body name="ground">{ground}{_TINY}{body}</body></worldbody>{tendon}</mujoco>'
    )


_UNITS = ("1 0 0", "0 1 0", "0 0 1")


def _joint(name: str, kind: str, axis: str, gives: Mapping[str, float], cubic: float = 0.0) -> str:
    stiffness = 1.0 / gives[name] if gives[name] else 0.0
    return f'<joint name="{name}" type="{kind}" axis="{axis}" stiffness="{stiffness!r} 0 {float(cubic)!r}"/>'


def _weight(mass: float, centre: tuple[float, ...]) -> str:
    return f'<inertial pos="{_words(centre)}" mass="{mass!r}" diaginertia="1 1 1"/>'


def _site(name: str, place: tuple[float, ...]) -> str:
    return f'<site name="{name}" pos="{_words(place)}"/>'


def _words(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


# The robot of the tests, and states for it.


@cache
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
            term = EffectInstance(effect, values, {})  # type: ignore[arg-type]
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
