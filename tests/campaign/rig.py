"""The arm, what hangs on it, and what the tracker reads: by MuJoCo."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from plant import GRAVITY, Plant, kr270

from postproc.base.geometry import Poses
from postproc.base.units import DEG
from postproc.experiments.candidate_setups import CandidateSetups, Setups, drawn, readings_of, usable_limits
from postproc.experiments.precision import DesignProblem, designs
from postproc.identification.unknowns import asked_for
from postproc.measurements import Readings
from postproc.model import StiffnessModel
from postproc.robot.description import COVERAGE, robot_of

TABLE_1 = {"c2": 1.3, "c3": 2.0, "c4": 4.0, "c5": 5.0, "c6": 4.0, "K_c": 22.0, "s0": 6.0}
"""Half widths of Table 1's intervals [% of the value], of an unstated level; k_c is 1/K_c, and an interval of one is
an interval of the other."""

POINTS = {"L": 0.06, "a_x": 0.70, "a_y": 0.69}
"""[mm] of the compensator's attachment points."""

KNOWN = ("joint_compliance", "gravity_compensator.K_c", "gravity_compensator.s0")
"""What is asked for where the attachment points are known."""

WITHIN = ("joint_compliance", "gravity_compensator")
"""What is asked for where they are known to the intervals of the robot file."""

WEIGHT, TWO_WEIGHTS = (265.0,), (250.0, 280.0)
"""[kg]"""

LEVER = Poses(np.eye(3), np.array([0.0, 0.5, 0.3]))
"""Where the weight hangs, on the flange: half a metre beside the axis of A6."""

REFLECTORS = np.array([[0.3, 0.0, 0.1], [-0.15, 0.26, 0.1], [-0.15, -0.26, 0.1]])
"""[m] on the flange."""

SIGMA = 3e-5
"""[m] one standard deviation of each coordinate of loaded minus unloaded."""

ROOM = 0.5
"""[m] Flange, reflectors and weight stay so far above the ground."""

OFF = 0.7, 1.4
"""By such factors a robot file is wrong before the campaign."""

CANDIDATES = 2500
"""Poses that the planner chooses from at first."""


@cache
def truth() -> StiffnessModel:
    """Table 1, as the robot file has it."""
    return StiffnessModel.from_robot(kr270())


@cache
def plant() -> Plant:
    return Plant.of(truth())


def values_of(model: StiffnessModel) -> dict[str, float]:
    """(SI) of the parameters that are looked for."""
    both = {**model.terms[0].values, **model.terms[1].values}
    return {name: both[name] for name in TABLE_1}


def wrong_file(rng: np.random.Generator, points: bool = False) -> bytes:
    """A robot file before the campaign: what is looked for is off by a factor within ``OFF``, and the attachment
    ``points`` are as far off as their intervals say."""
    change = {name: (rng.uniform(*OFF), 0.0) for name in TABLE_1}
    if points:
        change |= {name: (1.0, rng.normal(0.0, half / COVERAGE)) for name, half in POINTS.items()}
    text = kr270().path.read_text(encoding="utf-8")
    for name, (factor, shift) in change.items():
        before, number, after = _around_value(text, name)
        text = f"{before}{np.format_float_scientific(number * factor + shift, 9, exp_digits=1)}{after}"
    return text.encode()


def _around_value(text: str, name: str) -> tuple[str, float, str]:
    """What stands before and after the value of a parameter in the text of a robot file, and the value."""
    found = re.search(rf"\b{name}:\s*\{{?\s*value: ([-+0-9.e]+)", text)
    assert found
    return text[: found.start(1)], float(found[1]), text[found.end(1) :]


def model_of(raw: bytes) -> StiffnessModel:
    return StiffnessModel.from_robot(robot_of(raw, kr270().path))


def offer(loads: Sequence[float] = WEIGHT) -> CandidateSetups:
    """``loads`` [kg] are hung at every configuration, one after the other."""
    anywhere = [-np.inf, np.inf]
    return CandidateSetups(
        tool=LEVER,
        targets=("M1", "M2", "M3"),
        places=REFLECTORS,
        rough=False,
        loads=np.array(loads),
        each_load=True,
        deflection=True,
        sigma=SIGMA,
        limits=usable_limits(kr270(), {}),
        box=np.array([anywhere, anywhere, [ROOM, np.inf]]),
        tracker=None,
        cone=np.pi,
        spacing=5 * DEG,
    )


def planned(model: StiffnessModel, count: int, loads: Sequence[float] = WEIGHT, seed: int = 1) -> Setups:
    """The best ``count`` configurations for the intervals of Table 1, as far as the values of ``model`` are right."""
    asked = asked_for(model, KNOWN)
    counts = np.array([unknown.parameter.name in TABLE_1 for unknown in asked.unknowns])
    shares = np.array([TABLE_1.get(unknown.parameter.name, 100.0) / 100 for unknown in asked.unknowns])
    wanted = shares * np.array([unknown.value for unknown in asked.unknowns])
    task = DesignProblem(asked.model, asked.unknowns, offer(loads), wanted, counts)
    return designs(task, count, seed=seed, candidates=CANDIDATES).chosen[count].setups


def at_random(count: int, rng: np.random.Generator, loads: Sequence[float] = WEIGHT) -> Setups:
    return drawn(truth(), offer(loads), count, rng)


def read_off(setups: Setups, loads: Sequence[float] = WEIGHT) -> Readings:
    """What a tracker without noise reads: each reflector under load minus the same without, by MuJoCo."""
    readings = readings_of(truth(), offer(loads), setups)
    into = LEVER.inverse()
    reflectors = REFLECTORS @ into.rotation.T + into.position
    value, idle = np.empty((len(readings), 3)), {}
    for row, (q, wrench, target) in enumerate(zip(readings.q, readings.wrench, readings.target, strict=True)):
        assert np.array_equal(wrench, [0, 0, wrench[2], 0, 0, 0])
        assert np.min(np.abs(wrench[2] + np.array(loads) * GRAVITY)) < 1e-9
        if q.tobytes() not in idle:
            idle[q.tobytes()] = plant().rest(q, np.zeros(6), LEVER)
        there = plant().rest(q, wrench, LEVER), idle[q.tobytes()]
        loaded, unloaded = (rest.position + rest.rotation @ reflectors[target] for rest in there)
        value[row] = loaded - unloaded
    return replace(readings, value=value)
