"""What the robot and the process of one draw really are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from plant import Hardware, Plant, Spring, kr270

from postproc.effects.gravity_compensator import GravityCompensator
from postproc.model import StiffnessModel

C_OFF, FORCE_OFF = 0.25, 0.39
TURN_OFF = np.deg2rad(8.0)
RADIUS_OFF, LENGTH_OFF = 0.02e-3, 0.05e-3
SCATTER = 0.02
HIDDEN = ("hysteresis", "backlash", "corner_force", "base", "radial")
"""Hardware and process that no robot file of the benchmark knows."""


@dataclass(frozen=True)
class Truth:
    """compliance (6,) [rad/(N m)]; spring: K_c as a share; factor: operation -> of its force; turn: operation -> (2,)
    [rad]; radius, length [m] of the tool; hardware; corner: share of the force added in corners; wobble: amplitudes
    (3,) [m] and phases of a smooth displacement."""

    compliance: np.ndarray
    spring: float
    factor: dict[str, float]
    turn: dict[str, np.ndarray]
    radius: float
    length: float
    hidden: tuple[str, ...] = ()
    hardware: Hardware = field(default_factory=Hardware)
    corner: float = 0.0
    wobble: np.ndarray = field(default_factory=lambda: np.zeros((3, 2)))

    def without_hidden(self) -> Truth:
        """The same robot and process with nothing hidden."""
        return replace(self, hidden=(), hardware=Hardware(), corner=0.0)

    def names(self) -> dict[str, float]:
        """Name of each hidden effect, with the true value of a size that the learner estimates, NaN without one."""
        found = {}
        for effect, sizes in (("hysteresis", self.hardware.width), ("backlash", self.hardware.gap)):
            found |= {f"{effect} of A{i + 1}": float(sizes[i]) for i in np.flatnonzero(sizes).tolist()}
        if self.hardware.base.any():
            found["base_compliance"] = np.nan
        if self.hardware.radial:
            found["tool_compliance"] = np.nan
        if self.corner:
            found["corner_force"] = float(np.log1p(self.corner))
        return found

    def plant(self) -> Plant:
        """The arm that MuJoCo bends."""
        robot = kr270()
        term = next(
            t for t in StiffnessModel.from_robot(robot).terms if isinstance(t.effect, GravityCompensator)
        )
        values = {**term.values, "K_c": self.spring * term.values["K_c"]}
        spring = Spring(**values, zero=term.effect.zero, balanced=term.effect.preload == "balanced")
        return Plant(robot.arm, self.compliance, spring, self.hardware)


def filed_compliances() -> np.ndarray:
    """(6,) [rad/(N m)] of the robot file."""
    term = next(t for t in StiffnessModel.from_robot(kr270()).terms if t.effect.name == "joint_compliance")
    return np.array([term.values[f"c{i}"] for i in range(1, 7)])


def draw_forces(rng: np.random.Generator, operations: list[str]) -> dict[str, Any]:
    """``factor`` and ``turn`` of a truth."""
    return {
        "factor": {name: rng.uniform(1 - FORCE_OFF, 1 + FORCE_OFF) for name in operations},
        "turn": {name: rng.uniform(-TURN_OFF, TURN_OFF, 2) for name in operations},
    }


def draw_truth(
    rng: np.random.Generator,
    operations: list[str],
    hidden: tuple[str, ...] = (),
    smooth: float = 0.0,
    worn: float = 1.0,
) -> Truth:
    """A robot and a process; ``hidden``: of HIDDEN; ``smooth`` [m]: size of a displacement without a name; ``worn``:
    how many times larger the gaps and loops of the gears are than those of a new one."""
    filed = filed_compliances()
    truth = Truth(
        compliance=filed * rng.uniform(1 - C_OFF, 1 + C_OFF, 6),
        spring=rng.uniform(1 - C_OFF, 1 + C_OFF),
        **draw_forces(rng, operations),
        radius=rng.normal(0, RADIUS_OFF),
        length=rng.normal(0, LENGTH_OFF),
        hidden=hidden,
    )
    parts: dict[str, object] = {}
    for name in hidden:
        joint = int(rng.integers(3))
        one = np.zeros(6)
        if name == "hysteresis":
            one[joint] = worn * rng.uniform(3e-5, 8e-5)
            parts["width"] = one
        elif name == "backlash":
            one[joint] = worn * rng.uniform(3e-5, 8e-5)
            parts["gap"] = one
        elif name == "base":
            one[3:5] = rng.uniform(0.5e-7, 2e-7, 2)
            parts["base"] = one
        elif name == "radial":
            parts["radial"] = rng.uniform(1e-7, 4e-7)
    if "corner_force" in hidden:
        truth = replace(truth, corner=rng.uniform(0.3, 0.7))
    wobble = np.column_stack([rng.normal(0, smooth, 3), rng.uniform(0, 2 * np.pi, 3)])
    return replace(truth, hardware=Hardware(**parts), wobble=wobble)  # type: ignore[arg-type]
