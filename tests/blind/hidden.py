"""What is hidden in an arm: effects of the library, and others, each of a size that is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from plant import PARTS, Spring

from postproc.effects import EFFECTS, Effect

from .arm import ARM, COMPLIANCE, POINT_OFF, POINTS, Scene, joints
from .outside import Hose, Law

DEFLECTION = (
    "joint_compliance",
    "tool_compliance",
    "gravity_compensator",
    "base_compliance",
    "link_compliance",
    "joint_stiffening",
    "backlash",
    "force_sensor",
)
ABSOLUTE = (
    "link_gravity",
    "payload",
    "hysteresis",
    "transmission_error",
    "joint_offset",
    "link_geometry",
    "joint_coupling",
    "tool_offset",
    "base_offset",
    "thermal_growth",
)
EVERY = (*DEFLECTION, *ABSOLUTE)
"""All effects of the library, by the readings in which they are hidden: what differences can not show is in places."""

OUTSIDE = {
    "leaning_stiffness": True,
    "quadratic_bending": True,
    "loose_flange": True,
    "hose_package": False,
    "half_harmonic": False,
    "tracker_eccentricity": False,
    "windup": False,
}
"""What no library has, and whether it hides in deflections."""

JOINTS = {
    "joint_compliance": "23456",
    "gravity_compensator": "2",
    "link_compliance": "123456",
    "joint_stiffening": "23456",
    "backlash": "23456",
    "hysteresis": "123456",
    "transmission_error": "123456",
    "joint_offset": "2345",
    "link_geometry": "23456",
    "joint_coupling": "56",
    "thermal_growth": "234",
    "leaning_stiffness": "2345",
    "quadratic_bending": "23",
    "loose_flange": "234",
    "half_harmonic": "146",
    "windup": "23456",
}
"""Joints that may have it.  Vertical loads do not turn A1; its zero, and that of A6, is registration."""


@dataclass(frozen=True)
class Hidden:
    """An ``effect`` on a ``joint`` ("" where it is of none).  values: its parameters (SI) at size 1, ``fixed`` ones of
    any size; cap: the largest plausible size; made: the effect of the library, None of one outside; put: how it comes
    into a scene, where its parameters do not say that."""

    effect: str
    joint: str
    values: Mapping[str, float] = field(default_factory=dict)
    fixed: Mapping[str, float] = field(default_factory=dict)
    cap: float = np.inf
    made: Effect | None = None
    put: Callable[[Scene, float], Scene] | None = None

    @property
    def outside(self) -> bool:
        return self.made is None

    def at(self, size: float) -> dict[str, float]:
        """All parameters (SI) of the effect."""
        assert self.made is not None
        nulls = {p.name: p.null for p in self.made.parameters}
        return {**nulls, **self.fixed, **{name: size * value for name, value in self.values.items()}}

    def true(self, size: float) -> dict[str, float]:
        """Parameters (SI) that are not at their null, as effect.parameter."""
        own = {} if self.outside else {**self.fixed, **{k: size * v for k, v in self.values.items()}}
        return {f"{self.effect}.{name}": float(value) for name, value in own.items()}

    def into(self, scene: Scene, size: float) -> Scene:
        """The scene with it."""
        if self.put is not None:
            return self.put(scene, size)
        values = self.at(size)
        if self.effect == "joint_compliance":
            own = np.array([values[f"c{i}"] for i in range(1, 7)])
            return replace(scene, compliance=np.where(own > 0, own, scene.compliance))
        if self.effect == "gravity_compensator":
            return replace(scene, spring=Spring(**values))
        return scene.having(PARTS[self.effect](values, self.made))

    def absent(self, scene: Scene) -> Scene:
        """The scene as it would be without: a joint that is not said to give way is rigid."""
        if self.effect != "joint_compliance":
            return scene
        rigid = scene.compliance.copy()
        rigid[int(self.joint[1]) - 1] = 0.0
        return replace(scene, compliance=rigid)


def drawn(effect: str, rng: np.random.Generator, joint: str = "") -> Hidden:
    """One of its kind; on a random joint where it is of one and none is said."""
    if not joint and effect in JOINTS:
        joint = f"A{rng.choice(list(JOINTS[effect]))}"
    i = int(joint[1]) if joint else 0
    return _DRAWN[effect](rng, joint, i)


def _of(effect: str, *options: object) -> Effect:
    return EFFECTS[effect](joints(), *options)


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _joint_compliance(rng, joint, i):
    return Hidden("joint_compliance", joint, {f"c{i}": 1e-7}, cap=100.0, made=_of("joint_compliance"))


def _tool_compliance(rng, joint, i):
    values = {"radial": 1e-8, "axial": 1e-8 * rng.uniform(0.2, 0.6)}
    return Hidden("tool_compliance", joint, values, cap=10.0, made=_of("tool_compliance"))


def _gravity_compensator(rng, joint, i):
    fixed = {name: value + rng.normal(0.0, POINT_OFF) for name, value in POINTS.items()}
    fixed |= {"s0": rng.uniform(0.3, 0.5)}
    return Hidden("gravity_compensator", joint, {"K_c": 1e6}, fixed, 10.0, _of("gravity_compensator"))


def _link_gravity(rng, joint, i):
    # a drive, a valve block or a reel of hose that somebody has bolted to a link
    link, centre = int(rng.choice([2, 3, 4])), rng.uniform([-0.2, -0.3, 0.0], [0.4, 0.3, 0.4])
    places = np.array([[0, 0, 0], [ARM.a1, 0, ARM.d1], [ARM.a2, 0, 0], [ARM.d4, 0, ARM.a3]])
    values = {"mass": 10.0}
    for k in range(1, link + 1):
        # what follows counts at the next joint
        moment = 10.0 * (centre if k == link else places[k])
        values |= dict(zip((f"m{axis}{k}" for axis in "xyz"), moment.tolist(), strict=True))

    def put(scene, size):
        links = [(1e-9, (0.0, 0.0, 0.0))] * 6
        links[link - 1] = (10.0 * size, tuple(centre))
        return scene.having({"links": tuple(links)})

    return Hidden("link_gravity", "", values, cap=20.0, made=_of("link_gravity"), put=put)


def _payload(rng, joint, i):
    place = dict(zip("xyz", rng.uniform([-0.2, -0.2, 0.0], [0.2, 0.2, 0.4]), strict=True))
    return Hidden("payload", "", {"mass": 10.0}, place, 15.0, _of("payload"))


def _base_compliance(rng, joint, i):
    # pads at some distance from the middle: their shift and the tilt that goes with it
    c, way = rng.uniform(0.5, 2.0, 3) * 1e-8, rng.uniform(0.3, 1.5, 3)
    values = dict(zip(("c_x", "c_y", "c_z"), c, strict=True))
    values |= {f"c_r{axis}": c.mean() / r**2 for axis, r in zip("xyz", way, strict=True)}
    return Hidden("base_compliance", "", values, cap=10.0, made=_of("base_compliance"))


def _link_compliance(rng, joint, i):
    values = {f"c{i}{axis}": 1e-7 * rng.uniform(0.3, 1.0) for axis in "xy"}
    return Hidden("link_compliance", joint, values, cap=10.0, made=_of("link_compliance"))


def _joint_stiffening(rng, joint, i):
    # as much as the joint's own spring under a large torque
    stiffness, torque = 1 / COMPLIANCE[i - 1], 4000.0 if i < 4 else 1000.0
    k = stiffness / (torque / stiffness) ** 2
    return Hidden("joint_stiffening", joint, {f"k{i}": k}, cap=3.0, made=_of("joint_stiffening"))


def _backlash(rng, joint, i):
    return Hidden("backlash", joint, {f"b{i}": 1e-4}, cap=10.0, made=_of("backlash"))


def _force_sensor(rng, joint, i):
    # no gain: it can not be told from a softer arm
    values = dict(zip(("fx", "fy", "fz"), rng.normal(0.0, 20.0, 3), strict=True))
    values |= dict(zip(("mx", "my", "mz"), rng.normal(0.0, 10.0, 3), strict=True))
    return Hidden("force_sensor", "", values, cap=5.0, made=_of("force_sensor"))


def _hysteresis(rng, joint, i):
    return Hidden("hysteresis", joint, {f"w{i}": 1e-4}, cap=10.0, made=_of("hysteresis"))


def _transmission_error(rng, joint, i):
    harmonic, phase = float(rng.choice([1.0, 2.0])), rng.uniform(0.0, 2 * np.pi)
    values = {f"s{i}_{harmonic:g}": 1e-4 * np.sin(phase), f"c{i}_{harmonic:g}": 1e-4 * np.cos(phase)}
    return Hidden("transmission_error", joint, values, cap=20.0, made=_of("transmission_error", (harmonic,)))


def _joint_offset(rng, joint, i):
    return Hidden("joint_offset", joint, {f"o{i}": 1e-3 * _sign(rng)}, cap=10.0, made=_of("joint_offset"))


def _link_geometry(rng, joint, i):
    made = _of("link_geometry")
    own = [p.name for p in made.parameters if p.joint == joint]
    return Hidden(
        "link_geometry",
        joint,
        {name: 1e-3 * rng.uniform(0.3, 1.0) * _sign(rng) for name in own},
        cap=10.0,
        made=made,
    )


def _joint_coupling(rng, joint, i):
    made = _of("joint_coupling")
    own = [p.name for p in made.parameters if p.joint == joint]
    values = {name: 1e-4 * rng.uniform(0.3, 1.0) * _sign(rng) for name in own}
    return Hidden("joint_coupling", joint, values, cap=50.0, made=made)


def _frame_offset(effect):
    def draw(rng, joint, i):
        values = dict(zip(("x", "y", "z", "rx", "ry", "rz"), rng.normal(0.0, 1e-3, 6), strict=True))
        return Hidden(effect, "", values, cap=5.0, made=_of(effect))

    return draw


def _thermal_growth(rng, joint, i):
    variable = str(rng.choice(["temperature", "time"]))
    unit = 1e-6 if variable == "temperature" else 1e-8
    return Hidden(
        "thermal_growth", joint, {f"g{i}": unit * _sign(rng)}, cap=50.0, made=_of("thermal_growth", variable)
    )


# What no library has.


def _law(effect, joint, cap, shift, coordinate="", gives=0.0):
    """``shift``: size -> the displacement; ``coordinate``: where, the joint itself by default, a bearing that ``gives``
    a little by itself."""

    def put(scene, size):
        if coordinate:
            tilts = np.zeros(12)
            tilts[2 * (int(joint[1]) - 1) + "xy".index(coordinate[-1])] = gives
            scene = scene.having({"tilts": tilts})
        return replace(scene, laws=(*scene.laws, Law(coordinate or joint, shift(size))))

    return Hidden(effect, joint, cap=cap, put=put)


def _leaning_stiffness(rng, joint, i):
    other = {2: 3, 3: 2, 4: 5, 5: 4}[i]
    phase, c = rng.uniform(0.0, 2 * np.pi), COMPLIANCE[i - 1]

    def shift(size):
        return lambda torque, q, came: 0.1 * size * c * np.sin(q[other - 1] + phase) * torque

    return _law("leaning_stiffness", joint, 8.0, shift)


def _quadratic_bending(rng, joint, i):
    c = COMPLIANCE[i - 1]
    return _law(
        "quadratic_bending",
        joint,
        20.0,
        lambda size: lambda torque, q, came: 0.1 * size * c / 4000.0 * torque * abs(torque),
    )


def _loose_flange(rng, joint, i):
    preload, axis = rng.uniform(0.3, 0.6) * (2500.0 if i < 4 else 800.0), rng.choice(["x", "y"])

    def shift(size):
        return lambda torque, q, came: 1e-7 * size * np.sign(torque) * max(0.0, abs(torque) - preload)

    return _law("loose_flange", joint, 100.0, shift, f"{joint}.r{axis}", 1e-10)


def _hose_package(rng, joint, i):
    start = np.array([-0.4, rng.uniform(-0.4, 0.4), rng.uniform(1.8, 2.6)])
    end = np.array([0.0, rng.uniform(-0.15, 0.15), 0.2])

    def put(scene, size):
        return replace(scene, hose=Hose(start, end, 50.0 * size, 0.8))

    return Hidden("hose_package", "", cap=40.0, put=put)


def _half_harmonic(rng, joint, i):
    phase = rng.uniform(0.0, 2 * np.pi)

    def put(scene, size):
        wave = (i - 1, 0.5, 1e-4 * size * np.sin(phase), 1e-4 * size * np.cos(phase))
        return scene.having({"wave": (wave,)})

    return Hidden("half_harmonic", joint, cap=20.0, put=put)


def _tracker_eccentricity(rng, joint, i):
    phase = rng.uniform(0.0, 2 * np.pi)

    def put(scene, size):
        return replace(scene, eccentric=(1e-4 * size * np.sin(phase), 1e-4 * size * np.cos(phase)))

    return Hidden("tracker_eccentricity", "", cap=50.0, put=put)


def _windup(rng, joint, i):
    c = COMPLIANCE[i - 1]
    return _law(
        "windup",
        joint,
        20.0,
        lambda size: lambda torque, q, came: -0.05 * size * c * abs(torque) * came[i - 1],
    )


_DRAWN = {
    "joint_compliance": _joint_compliance,
    "tool_compliance": _tool_compliance,
    "gravity_compensator": _gravity_compensator,
    "link_gravity": _link_gravity,
    "payload": _payload,
    "base_compliance": _base_compliance,
    "link_compliance": _link_compliance,
    "joint_stiffening": _joint_stiffening,
    "backlash": _backlash,
    "force_sensor": _force_sensor,
    "hysteresis": _hysteresis,
    "transmission_error": _transmission_error,
    "joint_offset": _joint_offset,
    "link_geometry": _link_geometry,
    "joint_coupling": _joint_coupling,
    "tool_offset": _frame_offset("tool_offset"),
    "base_offset": _frame_offset("base_offset"),
    "thermal_growth": _thermal_growth,
    "leaning_stiffness": _leaning_stiffness,
    "quadratic_bending": _quadratic_bending,
    "loose_flange": _loose_flange,
    "hose_package": _hose_package,
    "half_harmonic": _half_harmonic,
    "tracker_eccentricity": _tracker_eccentricity,
    "windup": _windup,
}
