"""What may be missing: every effect of the library that the model does not have, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Floats
from postproc.effects import EFFECTS, Effect
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.columns import columns
from postproc.identification.noise import Weighting
from postproc.identification.unknowns import Unknown, unknowns_of, with_mechanism
from postproc.model import StiffnessModel

EVERY = "all joints"

UNSEEN = 0.1
"""Standard deviations by which a group of its usual size must move all readings together to be testable."""


@dataclass(frozen=True)
class Candidate:
    """An effect on one joint ("" where it has none, or ``EVERY``) that the model may lack.

    ``unknowns``: its parameters in ``model``, the model with the effect added at its null; columns (R, 3 or 6, p) what
    they move, per scale; ``shapes``: taken at their usual size, since nothing moves at the null.
    """

    effect: Effect
    joint: str
    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    columns: Floats
    shapes: bool = False
    only: tuple[Unknown, ...] = ()

    @property
    def shown(self) -> tuple[Unknown, ...]:
        """The unknowns that the columns are of."""
        return self.only or self.unknowns

    def fitted(self, columns: Floats, unknowns: Sequence[Unknown]) -> Candidate:
        """The candidate with the columns of those ``unknowns`` that a fit found."""
        return replace(self, columns=columns, only=tuple(unknowns))

    def contains(self, other: Candidate) -> bool:
        """Whether ``other`` is the same effect on one of these joints."""
        return self.key[0] == other.key[0] and self.joint == EVERY

    @property
    def key(self) -> tuple[str, str]:
        """The form of the effect, and its joint."""
        return f"{self.name} {self.effect.described()}", self.joint

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def label(self) -> str:
        """As people say it: effect, its options where they tell two forms apart, and joint."""
        options, words = self.effect.described(), self.name
        if "harmonics" in options:
            words += f" (harmonic {str(options['harmonics']).strip('[]').replace('.0', '')})"
        if "variable" in options:
            words += f" (by {options['variable']})"
        return f"{words} on {self.joint}" if self.joint else words


def candidates(campaign: Campaign, model: StiffnessModel, given: Nuisances) -> tuple[Candidate, ...]:
    """All that ``model`` may lack, with what it would move in ``campaign``; also what would move nothing there."""
    found: list[Candidate] = []
    for name, effect in EFFECTS.items():
        if name == "base_offset" and campaign.tracked:
            continue  # the registration itself
        known = [index for index, term in enumerate(model.terms) if term.effect.name == name]
        for term in known:
            lacking = [
                u for u in unknowns_of(model, term) if u.stated is None and u.value == u.parameter.null
            ]
            found += _by_joint(campaign, model, given, [u for u in lacking if not u.held])
        for wider in () if known else _widened(model, effect):
            found += _by_joint(
                campaign, wider, given, [u for u in unknowns_of(wider, len(model.terms)) if not u.held]
            )
    return tuple(found)


def _widened(model: StiffnessModel, effect: type[Effect]) -> list[StiffnessModel]:
    """The model with ``effect`` in each form in which it may be there."""
    if any(mechanism.kind == effect.name for mechanism in model.robot.mechanisms):
        return [with_mechanism(model, effect)]
    return [model.added(form) for form in effect.variants(model.robot.joints)]


def _by_joint(
    campaign: Campaign, model: StiffnessModel, given: Nuisances, unknowns: Sequence[Unknown]
) -> list[Candidate]:
    """The unknowns of one effect, joint by joint."""
    if not unknowns:
        return []
    effect = model.terms[unknowns[0].term].effect
    shown = model
    moves = np.nan_to_num(columns(campaign, shown, unknowns, campaign.seen(shown), given))
    still = ~moves.any(axis=(0, 1))
    if still.any():
        # a parameter may show only where others have a size: a length where the spring has a stiffness
        sized = model.changed({u.key: u.parameter.scale for u in unknowns})
        there = np.nan_to_num(columns(campaign, sized, unknowns, campaign.seen(sized), given))
        if there[:, :, still].any():
            shown, moves = sized, there
    found = []
    if not effect.apart:
        return [Candidate(effect, "", model, tuple(unknowns), moves, shown is not model)]
    joints = list(dict.fromkeys(u.parameter.joint for u in unknowns))
    # a whole arm may be off at once, as a geometry that was never calibrated
    for joint in [*joints, EVERY] if effect.whole and len(joints) > 1 else joints:
        own = [i for i, u in enumerate(unknowns) if joint in (EVERY, u.parameter.joint)]
        mine = tuple(unknowns[i] for i in own)
        found.append(Candidate(effect, joint, model, mine, moves[:, :, own], shown is not model))
    return found


def testable(candidate: Candidate, weights: Weighting) -> bool:
    """Whether the readings would show the effect at all."""
    return bool(np.linalg.norm(weights(candidate.columns)) > UNSEEN)


def names_of(found: Sequence[Candidate]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(candidate.name for candidate in found))
