"""What may be missing: every effect of the library that the model does not have, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.effects import EFFECTS, ComplianceLaw, Effect
from postproc.effects.gravity_sag import GravitySag
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.least_squares import Point, predicted_in
from postproc.identification.noise import Weighting
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown, unknowns_of, with_mechanism
from postproc.model import StiffnessModel

EVERY = "all joints"

UNSEEN = 1.5
"""Standard deviations by which a parameter of its usual size must move all readings together to be testable: of less,
only a size that is implausible would show."""

ANY_ARM = ("rad", "m", "1", "m/K", "m/s")
"""Units of what is about as large on any arm: places and angles.  How stiff or heavy an arm is depends on the arm."""

UNCERTAIN = 0.01
"""Share of ``UNSEEN`` that will do for a parameter with another unit: its usual size is that of a heavy arm."""

STRAIGHT = 0.05
"""Share of what an effect of its usual size does that its columns may not foresee."""


@dataclass(frozen=True)
class Candidate:
    """An effect on one joint ("" where it has none, or ``EVERY``) that may be missing in the model.

    ``unknowns``: its parameters in ``model``, the model with the effect added at its null; columns (R, 3 or 6, p) what
    they move, per scale; ``nonlinear``: in its usual size it does not do what its columns at the null predict;
    ``up_to_joint``: of an effect that is there on no joint alone, the last joint whose parameters it has; start (p,)
    [SI]: values that a fit may start with, () at the null; ``dormant_parameters``: names of parameters that move
    nothing where the others are at the null.
    """

    effect: Effect
    joint: str
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    columns: Floats
    nonlinear: bool = False
    up_to_joint: str = ""
    start: tuple[float, ...] = ()
    dormant_parameters: frozenset[str] = frozenset()
    only: tuple[Unknown, ...] = ()

    @property
    def shown(self) -> tuple[Unknown, ...]:
        """The unknowns that the columns are of."""
        return self.only or self.unknowns

    def fitted(self, columns: Floats, unknowns: Sequence[Unknown]) -> Candidate:
        """The candidate with the columns (R, k, P) of those ``unknowns`` that a fit found."""
        return replace(self, columns=columns, only=tuple(unknowns))

    @property
    def least(self) -> Floats:
        """(p,) standard deviations by which each parameter must move all readings together in its usual size."""
        known = np.array([u.parameter.unit in ANY_ARM for u in self.shown])
        return UNSEEN * np.where(known, 1.0, UNCERTAIN)

    def contains(self, other: Candidate) -> bool:
        """Whether ``other`` is the same effect with some of these parameters."""
        return self.key[0] == other.key[0] and {u.parameter.name for u in other.unknowns} <= {
            u.parameter.name for u in self.unknowns
        }

    @property
    def key(self) -> tuple[str, str]:
        """The form of the effect, and its joint."""
        return f"{self.name} {self.effect.form()}", self.joint or self.up_to_joint

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def label(self) -> str:
        """In words: effect, its options where they distinguish two forms, and joint."""
        options, words = self.effect.form(), self.name
        if "harmonics" in options:
            words += f" (harmonic {str(options['harmonics']).strip('[]').replace('.0', '')})"
        if "variable" in options:
            words += f" (by {options['variable']})"
        if "varies" in options:
            words += f" varying {options['varies']}"
        if self.up_to_joint:
            words += f" (up to {self.up_to_joint})"
        return f"{words} on {self.joint}" if self.joint else words


def candidates(
    campaign: Campaign,
    model: StiffnessModel,
    nuisances: Nuisances,
    by_direction: bool = False,
    near: Point | None = None,
) -> tuple[Candidate, ...]:
    """All that may be missing in ``model``, with what it would move in ``campaign``; also what would move nothing
    there.  ``by_direction``: only what depends on the sense of approach; ``near``: the point of ``model`` in
    ``campaign``, where it is known."""
    entries: list[Candidate] = []
    for name, effect in EFFECTS.items():
        if name == "base_offset" and campaign.tracked:
            continue  # the registration itself
        if by_direction and not effect.by_direction:
            continue
        if name == GravitySag.name and any(isinstance(term.effect, ComplianceLaw) for term in model.terms):
            continue  # weights show by themselves
        known = [index for index, term in enumerate(model.terms) if term.effect.name == name]
        for term in known:
            missing = [
                u for u in unknowns_of(model, term) if u.stated is None and u.value == u.parameter.null
            ]
            entries += _by_joint(campaign, model, nuisances, [u for u in missing if not u.fixed], near)
        for wider in () if known else _widened(model, effect):
            unknowns = [u for u in unknowns_of(wider, len(model.terms)) if not u.fixed]
            entries += _by_joint(campaign, wider, nuisances, unknowns, near)
    return tuple(entries)


def _widened(model: StiffnessModel, effect: type[Effect]) -> list[StiffnessModel]:
    """The model with ``effect`` in each form in which it may be there."""
    if any(mechanism.kind == effect.name for mechanism in model.robot.mechanisms):
        return [with_mechanism(model, effect)]
    return [model.with_effect(form) for form in effect.variants(model.robot.joints)]


def _by_joint(
    campaign: Campaign,
    model: StiffnessModel,
    nuisances: Nuisances,
    unknowns: Sequence[Unknown],
    near: Point | None,
) -> list[Candidate]:
    """The unknowns of one effect, joint by joint."""
    if not unknowns:
        return []
    effect = model.terms[unknowns[0].term].effect
    here = campaign.predicted(model) if near is None else predicted_in(model, near)
    moves = np.nan_to_num(columns(campaign, model, unknowns, here, nuisances))
    sized = model.with_values({u.key: u.parameter.null + u.parameter.scale for u in unknowns})
    there = campaign.predicted(sized, here.displacement)
    still = np.asarray(~moves.any(axis=(0, 1)))
    nonlinear = _is_nonlinear(
        campaign.residual(here, nuisances) - campaign.residual(there, nuisances), moves.sum(axis=2)
    )
    if still.any() and nonlinear:
        # a parameter may show only where others have a size: a length where the spring has a stiffness
        moves[:, :, still] = np.nan_to_num(columns(campaign, sized, unknowns, there, nuisances))[:, :, still]
    dormant = frozenset(
        u.parameter.name for u, rests in zip(unknowns, still.tolist(), strict=True) if rests and nonlinear
    )
    named = dict.fromkeys(u.parameter.joint for u in unknowns)
    if not effect.apart:
        whole = Candidate(effect, "", model, tuple(unknowns), moves, nonlinear, dormant_parameters=dormant)
        return _in_steps(whole, [j for j in named if j])
    entries = []
    # a whole arm may be off at once, as a geometry that was never calibrated
    for joint in [*named, EVERY] if effect.whole and len(named) > 1 else named:
        own = [i for i, u in enumerate(unknowns) if joint in (EVERY, u.parameter.joint)]
        mine = tuple(unknowns[i] for i in own)
        entries.append(
            Candidate(effect, joint, model, mine, moves[:, :, own], nonlinear, dormant_parameters=dormant)
        )
    return entries


def _is_nonlinear(does: Floats, foreseen: Floats) -> bool:
    """Whether what an effect does (R, 3 or 6) is clearly not what was foreseen."""
    does = np.nan_to_num(does)
    return bool(np.linalg.norm(does - foreseen) > STRAIGHT * np.linalg.norm(does))


def _in_steps(whole: Candidate, joints: Sequence[str]) -> list[Candidate]:
    """The candidate with the parameters of its joints up to each one that adds something, and the whole."""
    steps: list[Candidate] = []
    for last in range(len(joints) - 1):
        own = [i for i, u in enumerate(whole.unknowns) if u.parameter.joint in joints[: last + 1]]
        if not whole.columns[:, :, own].any():
            continue
        some = tuple(whole.unknowns[i] for i in own)
        steps.append(
            replace(whole, unknowns=some, columns=whole.columns[:, :, own], up_to_joint=joints[last])
        )
    return [*steps, whole]


def is_visible(candidate: Candidate, weights: Weighting) -> bool:
    """Whether the readings would show the effect at all."""
    size = np.linalg.norm(weights(candidate.columns), axis=0)
    return bool((size > candidate.least).any())


def fewest_parameters(several: Sequence[Candidate]) -> list[Candidate]:
    """Of candidates of one effect those with fewest parameters; of those that have the same the first."""

    def goes(k: int, one: Candidate) -> bool:
        return any(
            j != k and one.contains(other) and (j < k or not other.contains(one))
            for j, other in enumerate(several)
        )

    return [one for k, one in enumerate(several) if not goes(k, one)]


def names_of(choices: Sequence[Candidate]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(candidate.name for candidate in choices))
