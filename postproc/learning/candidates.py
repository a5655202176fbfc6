"""Effects that a model may miss, as columns: what each of them would do to the measured points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM
from postproc.effects import EFFECTS
from postproc.learning.causes import Cause, CauseKind, CausePrediction
from postproc.model import StiffnessModel

SIZES = {
    "hysteresis": 4e-5,
    "backlash": 6e-5,
    "base_compliance": 3e-8,
    "tool_compliance": 1e-7,
}
"""Effect -> standard deviation of its parameters (SI) on a heavy arm."""

CORNER, ENGAGEMENT, DRIFT = 0.3, 1.5, 0.05 * MM
"""Share of the force added in corners; change of the force per mm of error, as a share; [m] over the whole program."""

FACTORS = (0.5, 1.0, 2.0, 4.0)
"""Sizes that are tried, in standard deviations."""

_OTHER_SIDE = 0.1
"""Share of a gap by which an axis must lie otherwise in a wide one for that to be tried too."""

_SEEN = 0.3
"""An effect that nowhere does as much as this share of the noise is not looked for."""


@dataclass(frozen=True, eq=False)
class MissingEffect:
    """``name``; ``causes``: those that it adds; ``model``: with its effect; ``columns`` (K, Q) [m per standard
    deviation]; ``transfers``: it holds at another place too; ``wide``: with the sides of axes in wide gaps;
    ``column_sigma`` (K,) [m per standard deviation] or nothing: standard deviation of what it does to each point, where
    it is not known whether it acts there."""

    name: str
    causes: tuple[Cause, ...]
    model: StiffnessModel
    columns: Floats
    transfers: bool
    wide: bool = False
    column_sigma: Floats | None = None

    @property
    def family(self) -> str:
        """The effect without its joint."""
        return self.name.split(" ")[0]

    def column_sigma_at(self, rows: Ints, factor: float) -> Floats | None:
        """(J,) [m] ``column_sigma`` of points ``rows`` (J,) at ``factor`` standard deviations."""
        return None if self.column_sigma is None else factor * self.column_sigma[rows]

    def widened(self, factor: float) -> MissingEffect:
        """With ``factor`` times the standard deviations of its causes, with ``column_sigma`` of that size, and the same
        columns."""
        wide = tuple(replace(cause, deviation=factor * cause.deviation) for cause in self.causes)
        return replace(
            self, causes=wide, column_sigma=None if self.column_sigma is None else factor * self.column_sigma
        )


@dataclass(frozen=True, eq=False)
class Circumstances:
    """Of K points: ``corner`` (K,) 0..1, how far the feed turns within the cutter's radius; ``corner_sigma`` (K,) its
    standard deviation, as it is not known from where on the force feels a corner; ``time`` (K,) 0..1, when they were
    cut."""

    corner: Floats
    corner_sigma: Floats
    time: Floats


def candidates(
    prediction: CausePrediction, x: Floats, around: Circumstances, noise: float, named: Sequence[str] = ()
) -> list[MissingEffect]:
    """Effects that the model does not have, or that ``named`` has not named, with what they would do at the causes
    ``x`` (P,); ``noise`` [m]: of a point."""
    found = []
    for name, size in SIZES.items():
        found += _of_effect(prediction, x, name, size)
    found += _of_process(prediction, x, around)
    return [
        candidate
        for candidate in found
        if candidate.name not in named
        and np.isfinite(candidate.columns).all()
        and np.abs(candidate.columns).max(initial=0.0) * max(FACTORS) > _SEEN * noise
    ]


def _of_effect(prediction: CausePrediction, x: Floats, name: str, size: float) -> list[MissingEffect]:
    """One candidate a joint, or one for all parameters of an effect that has none."""
    model = prediction.model
    if any(term.effect.name == name for term in model.terms):
        return []
    effect = EFFECTS[name](model.robot.joints)
    extended, term = model.with_effect(effect), len(model.terms)
    groups: dict[str, list[Cause]] = {}
    for parameter in effect.parameters:
        label = f"{name} of {parameter.joint}" if parameter.joint else name
        if name == "base_compliance" and parameter.unit != "rad/(N m)":
            continue  # shifts of the foot are far smaller than what its tilts do at the tool
        scale = size if parameter.unit != "rad/(N m)" or name != "base_compliance" else 5e-8
        groups.setdefault(label, []).append(
            Cause(
                f"{name}.{parameter.name}",
                "effect",
                CauseKind.VALUE,
                scale,
                parameter.unit,
                term,
                parameter.name,
                place=label,
                positive=True,
            )
        )
    found = []
    for label, causes in groups.items():
        start, sizes = np.append(x, np.zeros(len(causes))), [cause.deviation for cause in causes]
        narrow = prediction.with_causes(causes, extended)
        columns = _own_columns(narrow, start, len(causes)) * sizes
        found.append(MissingEffect(label, tuple(causes), extended, columns, transfers=True))
        if not effect.by_direction:
            continue
        joint = _joint_number(prediction, causes[0])
        sides = prediction.points.wide_direction[:, joint] - prediction.points.direction[:, joint]
        if np.abs(sides).max(initial=0.0) > _OTHER_SIDE:
            wide = prediction.with_causes(causes, extended, wide=True)
            columns = _own_columns(wide, start, len(causes)) * sizes
            found.append(MissingEffect(label, tuple(causes), extended, columns, transfers=True, wide=True))
    return found


def _joint_number(prediction: CausePrediction, cause: Cause) -> int:
    names = [joint.name for joint in prediction.model.robot.joints]
    return names.index(cause.place.split(" ")[-1])


def _own_columns(prediction: CausePrediction, x: Floats, count: int) -> Floats:
    """(K, count) derivatives by the last ``count`` causes, by one-sided differences from their null."""
    base = prediction.errors(x)
    columns = []
    for number in range(len(x) - count, len(x)):
        moved = x.copy()
        moved[number] = prediction.causes[number].deviation
        columns.append((prediction.errors(moved) - base) / moved[number])
    return np.stack(columns, axis=1)


def _of_process(prediction: CausePrediction, x: Floats, around: Circumstances) -> list[MissingEffect]:
    """Forces in corners, a force that changes with the error, and a drift with time."""
    model, points = prediction.model, prediction.points
    found = []
    for name, size, weight in (
        ("corner_force", CORNER, around.corner),
        ("engagement", ENGAGEMENT, -prediction.errors(x) / MM),
    ):
        unit = "1" if name == "corner_force" else "1/mm"
        cause = Cause(
            name, "effect", CauseKind.FORCE, size, unit, weight=weight, positive=name == "engagement"
        )  # a force falls where the tool leaves, and never rises
        one = CausePrediction(points, model, (*prediction.causes, cause))
        columns = _own_columns(one, np.append(x, 0.0), 1) * size
        sigma = None
        if name == "corner_force":
            full = replace(cause, weight=np.ones(len(weight)))
            everywhere = CausePrediction(points, model, (*prediction.causes, full))
            sigma = np.abs(_own_columns(everywhere, np.append(x, 0.0), 1)[:, 0] * size * around.corner_sigma)
        found.append(MissingEffect(name, (cause,), model, columns, transfers=True, column_sigma=sigma))
    if np.ptp(around.time) > 0.05:
        drifts = [
            Cause(f"drift {axis}", "effect", CauseKind.SHIFT, DRIFT, "m", weight=points.normal[:, i] * around.time,
                  parameter="xyz"[i], place="drift")
            for i, axis in enumerate("xyz")
        ]  # fmt: skip
        columns = np.stack([cause.weight * cause.deviation for cause in drifts], axis=1)
        found.append(MissingEffect("drift", tuple(drifts), model, columns, transfers=False))
    return found
