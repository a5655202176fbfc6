"""Candidates in a model: the model with them, and its fit to the readings."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.identification.least_squares import Point, at, scales, with_columns
from postproc.identification.unknowns import Unknown, unknowns_of, with_gauge, with_mechanism
from postproc.model import StiffnessModel

INDIFFERENT = 1.0
"""Squares, in variances of a reading, by which a value may fit worse and be as good."""


def in_scales(fitted: Fit, unknowns: Sequence[Unknown]) -> Floats:
    """(P,) what was found of unknowns, from their nulls, in their scales."""
    nulls = np.array([u.parameter.null for u in unknowns])
    return np.asarray((fitted.point.values(unknowns) - nulls) / scales(unknowns))


def with_effects(campaign: Campaign, base: Fit, chosen: Sequence[Candidate], exact: bool = True) -> Fit:
    """The non-linear fit with the effects ``chosen`` added to ``base``, its own unknowns fitted along; ``exact`` as of
    ``fit``."""
    model, unknowns = composed(base.model, chosen)
    start: dict[tuple[int, str], float] = {}
    for candidate in chosen:
        start |= _begun(campaign, base, model, candidate)
    own = [u for u in base.asked if u.key in {b.key for b in base.unknowns}]
    # what turns out to be unobservable stays at its start value: without a length a spring is none
    additional = [
        replace(u, value=start.get(u.key, u.value)) if u.prior is None else u for u in with_gauge(unknowns)
    ]
    fitted = fit(
        campaign,
        model.with_values(start),
        [*own, *additional],
        nuisances=base.point.nuisances,
        factor=base.factor,
        exact=exact,
    )
    if not any(candidate.effect.by_direction for candidate in chosen):
        return fitted
    return put_back(campaign, fitted, {u.key for u in own})


class ChoiceFits:
    """Fits of choices of effects beside ``base``, each done once: a search that is done again without a candidate comes
    by the same choices again."""

    def __init__(self, campaign: Campaign, base: Fit) -> None:
        self.campaign, self.base = campaign, base
        self._done: dict[tuple[frozenset[object], bool], Fit] = {}

    def of(self, chosen: Sequence[Candidate], exact: bool = True) -> Fit:
        """``with_effects`` of ``chosen``; ``base`` of none.  Where squares are compared it need not be ``exact``."""
        if not chosen:
            return self.base
        key = frozenset((c.key, tuple(u.parameter.name for u in c.unknowns), c.start) for c in chosen)
        if (key, True) in self._done:
            return self._done[key, True]
        if (key, exact) not in self._done:
            self._done[key, exact] = with_effects(self.campaign, self.base, chosen, exact)
        return self._done[key, exact]


def put_back(campaign: Campaign, fitted: Fit, own: Set[tuple[int, str]]) -> Fit:
    """The fit with those parameters of the robot file, ``own``, at their stated values that are clearly elsewhere by
    their intervals, but fit as well there: where the sides of a gap change, an interval by derivatives is too narrow.
    It reaches to the value that was found."""

    def squares(point: Point) -> float:
        residual = fitted.plain_weights(np.nan_to_num(point.residual, nan=np.inf))
        return float(residual @ residual) / fitted.factor

    point, covariance = fitted.point, fitted.covariance.copy()
    for k, estimate in enumerate(fitted.estimates):
        unknown, off = estimate.unknown, abs(estimate.value - estimate.unknown.value)
        if unknown.key not in own or not off > estimate.ci95 > 0:
            continue
        model = point.model.with_values({unknown.key: unknown.value})
        there = at(campaign, model, point.nuisances, point.predicted.displacement)
        if squares(there) < squares(point) + INDIFFERENT:
            point = there
            covariance[k] *= off / estimate.ci95
            covariance[:, k] *= off / estimate.ci95
    if point is fitted.point:
        return fitted
    return replace(fitted, point=with_columns(campaign, point, fitted.unknowns), covariance=covariance)


def _begun(
    campaign: Campaign, base: Fit, model: StiffnessModel, candidate: Candidate
) -> dict[tuple[int, str], float]:
    """Values to start a fit of ``candidate`` in ``model`` with; those that no reading sees stay at their null."""
    term = term_of(model, candidate)
    if term is None or not candidate.start:
        return {}
    nulls = {(term, u.parameter.name): u.parameter.null for u in candidate.unknowns}
    start = dict(zip(nulls, candidate.start, strict=True))
    there = at(campaign, model.with_values(start), base.point.nuisances)
    if not there.predicted.converged.all():
        return {}
    for key, null in nulls.items():
        without = at(
            campaign,
            model.with_values({**start, key: null}),
            base.point.nuisances,
            there.predicted.displacement,
        )
        moved = np.linalg.norm(base.weights(np.nan_to_num(without.residual - there.residual)))
        if without.predicted.converged.all() and moved < 1.0:
            start[key] = null
    return start


def composed(
    model: StiffnessModel, chosen: Sequence[Candidate]
) -> tuple[StiffnessModel, tuple[Unknown, ...]]:
    """``model`` with the effects of ``chosen``, and their unknowns in it."""
    unknowns: list[Unknown] = []
    for candidate in chosen:
        term = term_of(model, candidate)
        if term is None:
            if any(mechanism.kind == candidate.name for mechanism in model.robot.mechanisms):
                model = with_mechanism(model, type(candidate.effect))
            else:
                model = model.with_effect(candidate.effect)
            term = len(model.terms) - 1
        names = {u.parameter.name for u in candidate.unknowns}
        known = {u.key for u in unknowns}
        unknowns += [u for u in unknowns_of(model, term) if u.parameter.name in names and u.key not in known]
        if has_zeros(candidate):
            term = _term(model, JointOffset.name, {})
            if term is None:
                model = model.with_effect(JointOffset(model.robot.joints))
                term = len(model.terms) - 1
            known = {u.key for u in unknowns}
            unknowns += [u for u in unknowns_of(model, term) if u.stated is None and u.key not in known]
    return model, tuple(unknowns)


def has_zeros(candidate: Candidate) -> bool:
    """Whether the zeros of the joints belong to a candidate: of a geometry that is wrong in all joints they are the
    more plausible part, and what they do its twists and shifts would do as well."""
    return candidate.name == LinkGeometry.name and candidate.joint == EVERY


def keys_of(model: StiffnessModel, candidate: Candidate) -> dict[tuple[int, str], float]:
    """The parameters in ``model`` that belong to a candidate, and their nulls."""
    term = term_of(model, candidate)
    if term is None:
        return {}
    keys = {(term, u.parameter.name): u.parameter.null for u in candidate.unknowns}
    zeros = _term(model, JointOffset.name, {}) if has_zeros(candidate) else None
    if zeros is not None:
        keys |= {u.key: u.parameter.null for u in unknowns_of(model, zeros) if u.stated is None}
    return keys


def term_of(model: StiffnessModel, candidate: Candidate) -> int | None:
    return _term(model, candidate.name, candidate.effect.form())


def _term(model: StiffnessModel, name: str, options: dict[str, object]) -> int | None:
    for index, term in enumerate(model.terms):
        if (term.effect.name, term.effect.form()) == (name, options):
            return index
    return None


def point_without(campaign: Campaign, fitted: Fit, chosen: Sequence[Candidate]) -> Point:
    """The fitted model with what was chosen put back to its null: what there is to explain."""
    nulls: dict[tuple[int, str], float] = {}
    for candidate in chosen:
        nulls |= keys_of(fitted.model, candidate)
    if not nulls:
        return fitted.point
    return at(campaign, fitted.model.with_values(nulls), fitted.point.nuisances)
