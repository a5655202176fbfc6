"""Named causes of an error, each with what is known of it before, and their prediction.

Elastic parameters and forces count by the logarithm of their share, so that a product of two of them is a sum; turns of
the force in rad; dimensions in m.  Every cause has the mean 0 and a standard deviation before the part is measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from types import MappingProxyType

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.cell.tool_errors import ToolError
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.learning.surface_displacement import radius_share
from postproc.learning.touched_points import TouchedPoints
from postproc.model import StiffnessModel
from postproc.process.force_factors import axes_across
from postproc.robot.description import COVERAGE

UNSTATED = 0.25 / 3**0.5
"""Standard deviation of an elastic parameter as a share of it, where the robot file states no interval of 95 %: arms of
one type differ by up to a quarter, every share as likely as any other."""

FORCE_COMMON, FORCE_OWN = 0.17, 0.15
"""The same of the forces: what all operations share (material, wear), and each one's own (engagement); together a force
is off by up to 39 %, every share as likely as any other."""

FORCE_TURN = 0.1
"""[rad] of the direction of the force of an operation, about each of two axes across it."""

RADIUS, LENGTH = 0.02e-3, 0.05e-3
"""[m] of a tool that was measured in a tool setter."""

LEAST_CI95 = 1e-6
"""[m] A tool is not known better."""

BASE_SHIFT, BASE_TURN = 0.1e-3, 0.1e-3
"""[m], [rad] of a base that was touched off."""

STEP = 0.05
"""Step of the differences, in standard deviations."""

MOST = 1.2
"""The largest logarithm of a share that is believed."""


class CauseKind(Enum):
    """How a cause acts."""

    SHARE = "share"  # of a parameter of the model
    VALUE = "value"  # of a parameter of the model, null without the effect
    FORCE = "force"  # share of the force
    TURN_1 = "turn_1"  # of the force, about the first axis across it
    TURN_2 = "turn_2"
    SHIFT = "shift"  # of the surface


@dataclass(frozen=True, eq=False)
class Cause:
    """``name``; ``group``: robot, force, tool, base or effect; ``deviation``: before the measurement; ``unit``: "1" for
    a share.  ``term``, ``parameter`` and ``value``: of the model; ``value`` of a tool: what the cell states already, to
    which the cause adds.  ``weight`` (K,): how much of it acts at each point,
    of SHIFT the whole column [m].  ``place``: operation or tool that it belongs to;
    ``positive``: it has no negative values."""

    name: str
    group: str
    kind: CauseKind
    deviation: float
    unit: str = "1"
    term: int = -1
    parameter: str = ""
    value: float = 0.0
    weight: Floats = field(default_factory=lambda: np.zeros(0))
    place: str = ""
    positive: bool = False

    def part(self, rows: Ints) -> Cause:
        """The cause of some points (J,)."""
        return replace(self, weight=self.weight[rows]) if len(self.weight) else self

    def is_share(self) -> bool:
        """Whether its value is the logarithm of a share."""
        return self.kind in (CauseKind.SHARE, CauseKind.FORCE)


@dataclass(frozen=True, eq=False)
class CausePrediction:
    """What P causes do to K points.  ``mean`` (P,) and ``root`` (P, P): what is known of the causes before the part is
    measured is mean + root u with independent u of deviation 1; empty: zero, and each cause's own deviation."""

    points: TouchedPoints
    model: StiffnessModel
    causes: tuple[Cause, ...]
    mean: Floats = field(default_factory=lambda: np.zeros(0))
    root: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @cached_property
    def before(self) -> tuple[Floats, Floats]:
        """``mean`` (P,) and ``root`` (P, P), causes that joined later included."""
        known, size = len(self.mean), len(self.causes)
        mean, root = np.zeros(size), np.diag(self.deviations)
        mean[:known], root[:known, :known] = self.mean, self.root
        return mean, root

    def causes_at(self, u: Floats) -> Floats:
        """(P,) causes in their own units, of ``u`` (P,) in deviations, within what can be meant."""
        mean, root = self.before
        return self.bounded(mean + root @ u)

    @cached_property
    def deviations(self) -> Floats:
        """(P,) of the causes before the measurement."""
        return np.array([cause.deviation for cause in self.causes])

    def part(self, rows: Ints) -> CausePrediction:
        """Of some points (J,)."""
        causes = tuple(cause.part(rows) for cause in self.causes)
        return CausePrediction(self.points.part(rows), self.model, causes, self.mean, self.root)

    def with_causes(
        self, more: Sequence[Cause], model: StiffnessModel | None = None, wide: bool = False
    ) -> CausePrediction:
        """With further causes, of effects of another model; ``wide``: with the sides of wide gaps."""
        points = self.points.with_wide_gaps() if wide else self.points
        return CausePrediction(points, model or self.model, (*self.causes, *more), self.mean, self.root)

    def model_at(self, x: Floats) -> StiffnessModel:
        """The model with the values of the causes ``x`` (P,)."""
        values = {}
        for cause, one in zip(self.causes, x.tolist(), strict=True):
            if cause.kind is CauseKind.SHARE:
                values[cause.term, cause.parameter] = cause.value * float(np.exp(one))
            elif cause.kind is CauseKind.VALUE:
                values[cause.term, cause.parameter] = one
        return self.model.with_values(values)

    @cached_property
    def _sides(self) -> bool:
        return any(
            cause.kind is CauseKind.VALUE and self.model.terms[cause.term].effect.by_direction
            for cause in self.causes
        )

    @cached_property
    def _across(self) -> tuple[Floats, Floats]:
        return axes_across(self.points.wrench[:, :3], self.points.axes)

    def _force(self, x: Floats) -> tuple[Floats, Floats]:
        """Scale (K,) and rotation vector (K, 3) [rad] of the forces."""
        count = len(self.points)
        logarithm, turns = np.zeros(count), np.zeros((count, 3))
        for cause, one in zip(self.causes, x.tolist(), strict=True):
            if cause.kind is CauseKind.FORCE:
                logarithm += one * cause.weight
            elif cause.kind in (CauseKind.TURN_1, CauseKind.TURN_2):
                axis = self._across[0 if cause.kind is CauseKind.TURN_1 else 1]
                turns += (one * cause.weight)[:, None] * axis
        return np.exp(logarithm), turns

    def errors(self, x: Floats) -> Floats:
        """(K,) [m] along the normals with the causes at ``x`` (P,)."""
        scale, turn = self._force(x)
        errors = self.points.errors(self.model_at(x), scale, turn, self._sides)
        for cause, one in zip(self.causes, x.tolist(), strict=True):
            if cause.kind is CauseKind.SHIFT:
                errors = errors + (cause.value + one) * cause.weight
        return errors

    def columns(self, x: Floats) -> Floats:
        """(K, P) [m per unit] derivatives of ``errors`` at ``x`` (P,), by central differences."""
        scale, turn = self._force(x)
        model, points = self.model_at(x), self.points
        columns = np.zeros((len(points), len(self.causes)))
        step = STEP * 0.1
        by_force: dict[CauseKind, Floats] = {}
        kinds = {cause.kind for cause in self.causes}
        if CauseKind.FORCE in kinds:
            ends = [points.errors(model, scale * np.exp(s), turn, self._sides) for s in (-step, step)]
            by_force[CauseKind.FORCE] = (ends[1] - ends[0]) / (2 * step)
        for kind, axis in ((CauseKind.TURN_1, self._across[0]), (CauseKind.TURN_2, self._across[1])):
            if kind in kinds:
                ends = [points.errors(model, scale, turn + s * axis, self._sides) for s in (-step, step)]
                by_force[kind] = (ends[1] - ends[0]) / (2 * step)
        for number, cause in enumerate(self.causes):
            if cause.kind in by_force:
                columns[:, number] = by_force[cause.kind] * cause.weight
            elif cause.kind is CauseKind.SHIFT:
                columns[:, number] = cause.weight
            else:
                columns[:, number] = self._difference(number, x, scale, turn)
        return columns

    def _difference(self, number: int, x: Floats, scale: Floats, turn: Floats) -> Floats:
        cause = self.causes[number]
        low, high = x.copy(), x.copy()
        low[number] -= STEP * cause.deviation
        high[number] += STEP * cause.deviation
        if cause.positive:  # no bound is passed
            low[number] = max(low[number], 0.0)
        ends = [self.points.errors(self.model_at(one), scale, turn, self._sides) for one in (low, high)]
        return np.asarray((ends[1] - ends[0]) / (high[number] - low[number]))

    def bounded(self, x: Floats) -> Floats:
        """(P,) ``x`` (P,) within what can be meant."""
        most = np.array([MOST if c.is_share() else np.inf for c in self.causes])
        least = np.array([0.0 if c.positive else -np.inf for c in self.causes])
        return np.asarray(np.clip(x, np.maximum(-most, least), most))


@dataclass(frozen=True)
class PriorKnowledge:
    """``force_ci95``: half width of the 95 % interval of all forces as a share, None where nothing states one;
    ``direction`` [rad]: the same of their direction."""

    force_ci95: float | None = None
    direction: float = 0.0


def robot_causes(model: StiffnessModel) -> list[Cause]:
    """The elastic parameters of the model that are not null."""
    causes = []
    for index, term in enumerate(model.terms):
        effect = term.effect
        if effect.family != "elastic" and not isinstance(effect, GravityCompensator):
            continue
        for parameter in effect.parameters:
            value, stated = float(term.values[parameter.name]), term.stated.get(parameter.name)
            if value == parameter.null or value <= 0.0 or (parameter.hardware and parameter.name != "K_c"):
                continue
            if isinstance(effect, GravityCompensator) and parameter.name != "K_c":
                continue
            deviation = UNSTATED
            if stated is not None and stated.level and stated.deviation:
                deviation = min(stated.deviation / value, 0.5)
            name = f"{model.label(index)}.{parameter.name}"
            causes.append(Cause(name, "robot", CauseKind.SHARE, deviation, "1", index, parameter.name, value))
    return causes


def force_causes(which: Ints, names: Sequence[str], known: PriorKnowledge) -> list[Cause]:
    """Of the points (K,) of the operations ``which`` (K,), by their ``names``."""
    total = float(np.hypot(FORCE_COMMON, FORCE_OWN))
    ratio = 1.0 if known.force_ci95 is None else max(known.force_ci95, 0.002) / COVERAGE / total
    turn = known.direction / COVERAGE if known.direction > 0 else FORCE_TURN * min(ratio, 1.0) ** 0.5
    causes = [Cause("force", "force", CauseKind.FORCE, FORCE_COMMON * ratio, weight=np.ones(len(which)))]
    for index in np.unique(which).tolist():
        mask, name = (which == index).astype(float), names[index]
        causes.append(
            Cause(f"force of {name}", "force", CauseKind.FORCE, FORCE_OWN * ratio, weight=mask, place=name)
        )
        causes += [
            Cause(f"{word} of the force of {name}", "force", kind, turn, "rad", weight=mask, place=name)
            for word, kind in (("lift", CauseKind.TURN_1), ("swing", CauseKind.TURN_2))
        ]
    return causes


def tool_causes(
    points: TouchedPoints,
    number: Ints,
    ball: Sequence[int],
    spring: bool,
    stated: Mapping[int, ToolError] = MappingProxyType({}),
) -> list[Cause]:
    """Radius and length of the tools ``number`` (K,); ``ball``: numbers of those with a ball; ``stated``: what the cell
    states of them already.

    A larger radius moves the surface of the cutter by dr |n across the spindle|, of a ball with its tip in place by
    dr (1 + n . a), a longer tool by dl (n . a), with a the spindle, tip-ward; where it cuts deeper less is left.
    """
    causes = []
    along = np.sum(points.normal * points.spindle, axis=1)
    for tool in np.unique(number).tolist():
        own, known = (number == tool).astype(float), stated.get(tool, ToolError())
        radial = own * radius_share(points.normal, points.spindle, tool in ball)
        for name, weight, value, ci95, usual in (
            ("radius", -radial, known.radius, known.radius_ci95, 2 * RADIUS if spring else RADIUS),
            ("length", own * along, known.length, known.length_ci95, LENGTH),
        ):
            if np.abs(weight).max() <= 0.05:
                continue
            deviation = usual if ci95 is None else max(ci95, LEAST_CI95) / COVERAGE
            cause = Cause(f"{name} of tool {tool}", "tool", CauseKind.SHIFT, deviation, "m")
            causes.append(replace(cause, parameter=name, value=value, weight=weight, place=f"tool {tool}"))
    return causes


def rigid_columns(points: TouchedPoints, in_base: Floats, centre: Floats) -> Floats:
    """(K, 6) [m per m, m per rad] what a shift and a turn of the part about ``centre`` (3,) [m] along the axes
    ``in_base`` (3, 3) of the base do to the points."""
    normal = points.normal @ in_base
    place = (points.point - centre) @ in_base
    return np.concatenate([normal, np.cross(place, normal)], axis=1)


def base_causes(columns: Floats, fixed: Sequence[int]) -> list[Cause]:
    """Of the freedoms ``fixed`` (0 to 5: x, y, z and turns about them) in which the part was not aligned to its own
    points; columns (K, 6) as of ``rigid_columns``."""
    names = ("base x", "base y", "base z", "base turn x", "base turn y", "base turn z")
    return [
        Cause(
            names[one],
            "base",
            CauseKind.SHIFT,
            BASE_SHIFT if one < 3 else BASE_TURN,
            "m" if one < 3 else "rad",
            parameter="xyzuvw"[one],
            weight=columns[:, one],
            place="base",
        )
        for one in fixed
    ]
