"""What really stands there, and the robot file that is wrong about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path

import numpy as np
from plant import LINKS, PARTS, Hardware, Plant, Spring

from postproc.effects import EFFECTS
from postproc.model import StiffnessModel
from postproc.robot.description import Robot, robot_of
from postproc.robot.geometries import KukaLengths

from .outside import Beyond, Hose, Law

ARM = KukaLengths(d1=0.72, a1=0.33, a2=1.22, a3=-0.04, d4=1.08, d6=0.22)
"""A heavy arm of the benchmark's own."""

COMPLIANCE = np.array([1.1e-6, 3.4e-7, 4.3e-7, 2.7e-6, 3.1e-6, 2.6e-6])
"""[rad/(N m)] as the robot file has it."""

LIMITS = ((-185, 185), (-146, -2), (-119, 155), (-350, 350), (-125, 125), (-350, 350))
"""[deg]"""

POINTS = {"L": 0.19, "a_x": 0.67, "a_y": 0.13}
"""[m] attachment points of the balancer, by its drawing."""

STIFFNESS_OFF = 0.7, 1.4
MASS_OFF = 0.25
SHIFT_OFF, TURN_OFF = 5e-4, 5e-4
"""[m], [rad] one standard deviation of the arm's geometry."""

POINT_OFF = 5e-4
"""[m] the same of the attachment points."""


@dataclass(frozen=True)
class Scene:
    """An arm: ``compliance`` (6,) of its joints, what it has beside them, and what no library has."""

    compliance: np.ndarray
    hardware: Hardware = field(default_factory=Hardware)
    spring: Spring | None = None
    laws: tuple[Law, ...] = ()
    hose: Hose | None = None
    eccentric: tuple[float, float] = (0.0, 0.0)
    """Sine and cosine [rad] by which the tracker's horizontal encoder is off over a turn."""
    geometry: Mapping[str, float] = field(default_factory=dict)
    """effect.parameter -> by how much the arm's geometry is off (SI)."""

    def plant(self) -> Plant:
        return Beyond(ARM, self.compliance, self.spring, self.hardware, self.laws, self.hose)

    def true(self) -> dict[str, float]:
        """Parameters (SI) of what is there, hidden or not, as effect.parameter."""
        found = {f"joint_compliance.c{i}": float(c) for i, c in enumerate(self.compliance, 1)}
        if self.hardware.links:
            found |= {f"link_gravity.{name}": value for name, value in self.plant().first_moments().items()}
        return {**found, **self.geometry}

    def having(self, parts: Mapping[str, object]) -> Scene:
        """With more hardware: fields of ``Hardware``, added to what is there."""
        old = {f.name: getattr(self.hardware, f.name) for f in fields(Hardware)}
        return replace(
            self, hardware=replace(self.hardware, **{k: _sum(old[k], v) for k, v in parts.items()})
        )


def _sum(old, new):
    if isinstance(new, bool):
        return new
    if isinstance(new, Mapping):
        return {**old, **{k: old[k] + v if k in old else v for k, v in new.items()}}
    return old + new


def as_filed(weights: bool) -> Scene:
    """The arm that the robot file describes; ``weights``: its links have some."""
    return Scene(COMPLIANCE, Hardware(links=LINKS if weights else ()))


def cluttered(rng: np.random.Generator, weights: bool, spared: Sequence[tuple[str, str]] = ()) -> Scene:
    """An arm that is not quite the file's; ``spared``: (effect, joint) of geometry that is as the file says."""
    compliance = COMPLIANCE * np.exp(rng.uniform(*np.log(STIFFNESS_OFF), 6))
    links = tuple(
        (mass * rng.uniform(1 - MASS_OFF, 1 + MASS_OFF), tuple(np.array(centre) + rng.normal(0, 0.01, 3)))
        for mass, centre in LINKS
    )
    scene = Scene(compliance, Hardware(links=links if weights else ()))
    for name in ("link_geometry", "joint_offset"):
        effect = EFFECTS[name](joints())
        off = {
            p.name: rng.normal(0.0, SHIFT_OFF if p.unit == "m" else TURN_OFF)
            * ((name, p.joint) not in spared)
            for p in effect.parameters
        }
        scene = scene.having(PARTS[name](off, effect))
        scene = replace(
            scene, geometry={**scene.geometry, **{f"{name}.{key}": value for key, value in off.items()}}
        )
    return scene


# The robot file.


def joints():
    return _robot(_text({}, mechanism=False).encode()).joints


@cache
def _robot(raw: bytes) -> Robot:
    return robot_of(raw, Path("arm.yaml"))


def model_of(raw: bytes) -> StiffnessModel:
    return StiffnessModel.from_robot(_robot(raw))


@cache
def filed_moments() -> dict[str, float]:
    """First moments of the links as the file has them."""
    return as_filed(weights=True).plant().first_moments()


def robot_file(geometry: bool, weights: bool, lacking: Sequence[tuple[str, str]] = ()) -> bytes:
    """The robot file: stiffness of the joints always, ``geometry`` and ``weights`` where they matter; ``lacking``:
    (effect, joint) that it does not know of, joint "" for a whole effect."""
    stated: dict[str, dict[str, float]] = {
        "joint_compliance": {f"c{i}": c for i, c in enumerate(COMPLIANCE, 1)}
    }
    if geometry:
        for name in ("link_geometry", "joint_offset"):
            stated[name] = {p.name: 0.0 for p in EFFECTS[name](joints()).parameters}
    if weights:
        stated["link_gravity"] = filed_moments()
    for name, joint in lacking:
        if name in stated:
            of = {p.name: p.joint for p in EFFECTS[name](joints()).parameters}
            stated[name] = {key: v for key, v in stated[name].items() if joint and of[key] != joint}
    return _text({name: values for name, values in stated.items() if values}, mechanism=True).encode()


def _text(stated: Mapping[str, Mapping[str, float]], mechanism: bool) -> str:
    lines = [
        "name: blind_arm",
        "maker_name: a heavy arm of the benchmark",
        "geometry:",
        "  source: drawing",
        "  kuka: {unit: mm, "
        + ", ".join(f"{key}: {1e3 * getattr(ARM, key):.6g}" for key in ("d1", "a1", "a2", "a3", "d4", "d6"))
        + "}",
        "joints:",
        "  source: data sheet",
        "  unit: deg",
        *(f"  A{i}: [{low}, {high}]" for i, (low, high) in enumerate(LIMITS, 1)),
        "effects:" if stated else "effects: []",
    ]
    for name, values in stated.items():
        lines += [f"  - effect: {name}", "    parameters:"]
        units = {p.name: p.unit for p in EFFECTS[name](joints()).parameters}
        source = {"joint_compliance": "data sheet of the gears", "link_gravity": "drawing"}.get(
            name, "nominal"
        )
        lines += [
            f"      {key}: {{value: {float(value)!r}, unit: {units[key]}, source: {source}}}"
            for key, value in values.items()
        ]
    if mechanism:
        lines += [
            "mechanisms:",
            "  - name: balancer",
            "    kind: gravity_compensator",
            "    joint: A2",
            "    source: drawing",
        ]
        lines += [f"    {key}: {{value: {1e3 * value:.6g}, unit: mm}}" for key, value in POINTS.items()]
    return "\n".join(lines) + "\n"
