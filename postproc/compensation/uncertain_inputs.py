"""The figures that predictions depend on: the parameters of the model and the force, and what is known of them."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.dataclass import dataclass
from postproc.cell import ForceVectorInterval
from postproc.model import StiffnessModel
from postproc.robot.description import COVERAGE

STEP = 0.1
"""Step of the differences, in standard deviations."""

FORCE = "force"
"""The scale of the wrenches, as a parameter."""

DIRECTION = "force_direction"
TURNS = ("turn_1", "turn_2")
"""Turns [rad] of the forces about two axes across them, as parameters of one name."""

COMPONENTS = ("force_fx", "force_fy", "force_fz")
"""A force [N] added to all others, along the axes of the programmed base."""


@dataclass(frozen=True)
class UncertainInput:
    """A figure that predictions depend on: ``name``; ``term`` of the model (-1: of the force); ``value`` and bounds
    (SI); standard ``deviation``, None where nothing states one."""

    name: str
    term: int
    parameter: str
    value: float
    lower: float
    upper: float
    deviation: float | None

    @property
    def step(self) -> float:
        """For differences: a share of the standard deviation, of the value where there is none."""
        return STEP * (0.1 * abs(self.value) if self.deviation is None else self.deviation)


@dataclass(frozen=True)
class InputUncertainties:
    """``entries``: figures with an interval, and their ``covariance`` (P, P); ``without_interval``: figures in use of
    which nothing is stated; ``level_unstated``: names of entries whose interval was taken for one of 95 %."""

    entries: tuple[UncertainInput, ...]
    covariance: Floats
    without_interval: tuple[UncertainInput, ...]
    level_unstated: tuple[str, ...]

    @property
    def lower_bound(self) -> bool:
        """Whether a total of the entries leaves something out."""
        return bool(self.without_interval)


def input_uncertainties(
    model: StiffnessModel,
    force_ci95: float | None = None,
    forced: bool = False,
    vector: ForceVectorInterval | None = None,
) -> InputUncertainties:
    """What is known of the figures that predictions of ``model`` depend on.

    ``force_ci95``: share of the force, 95 %; without it, and without components in ``vector``, a force that acts
    (``forced``) has no interval.  The model's
    covariance replaces what the robot file states of its parameters; others are taken as independent.  Raises
    ValueError where it has a name that the model does not have.
    """
    names, block = model.covariance or ((), np.zeros((0, 0)))
    known: list[UncertainInput] = []
    without: list[UncertainInput] = []
    unstated: list[str] = []
    seen: set[str] = set()
    for index, term in enumerate(model.terms):
        label = model.label(index)
        for parameter in term.effect.parameters:
            name, value = f"{label}.{parameter.name}", float(term.values[parameter.name])
            stated = term.stated.get(parameter.name)
            deviation = None
            if name in names:
                at = names.index(name)
                deviation = float(np.sqrt(block[at, at]))
            elif stated is not None and stated.interval is not None:
                deviation = stated.deviation
                if stated.level is None:
                    unstated.append(name)
            seen.add(name)
            entry = UncertainInput(
                name, index, parameter.name, value, parameter.lower, parameter.upper, deviation
            )
            if deviation is not None:
                known.append(entry)
            elif value != parameter.null:
                without.append(entry)
    has_components = vector is not None and vector.components is not None
    if force_ci95 is not None or (forced and not has_components):
        share = None if force_ci95 is None else force_ci95 / COVERAGE
        (without if share is None else known).append(
            UncertainInput(FORCE, -1, FORCE, 1.0, -np.inf, np.inf, share)
        )
    if vector is not None and forced:
        known += _vector_entries(vector)
    if set(names) - seen:
        raise ValueError(f"the covariance contains what the model does not have: {sorted(set(names) - seen)}")
    matrix = np.diag([entry.deviation or 0.0 for entry in known]) ** 2
    place = [[entry.name for entry in known].index(name) for name in names]
    matrix[np.ix_(place, place)] = block
    return InputUncertainties(tuple(known), matrix, tuple(without), tuple(unstated))


def _vector_entries(vector: ForceVectorInterval) -> list[UncertainInput]:
    """The turns and components of the force that have an interval."""
    turn = vector.direction / COVERAGE
    entries = [UncertainInput(DIRECTION, -1, name, 0.0, -np.inf, np.inf, turn) for name in TURNS if turn > 0]
    if vector.components is not None:
        each = (vector.components / COVERAGE).tolist()
        entries += [
            UncertainInput(name, -1, name, 0.0, -np.inf, np.inf, size)
            for name, size in zip(COMPONENTS, each, strict=True)
        ]
    return entries
