"""The search for what is missing: linear steps over all candidates, non-linear fits of what they choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.alternatives import find_alternatives
from postproc.diagnosis.candidate_fits import ChoiceFits, composed, in_scales, keys_of, point_without
from postproc.diagnosis.candidates import EVERY, Candidate, candidates, is_visible
from postproc.diagnosis.nonlinear_effects import Outside, broyden_update, evaluate_at_size
from postproc.diagnosis.search_result import Key, Linear, Search
from postproc.diagnosis.selection import (
    basis_of,
    counts,
    explained,
    outside,
    problem,
    selected,
)
from postproc.effects import ComplianceLaw
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit
from postproc.identification.least_squares import prior_rows, prior_weight, scales
from postproc.identification.noise import Weighting
from postproc.identification.unknowns import Unknown, unknowns_of, with_gauge
from postproc.model import StiffnessModel

PASSES = 4
"""Of choosing and fitting, until the choice no longer changes."""

LOOSE, BESIDE = 0.5, 0.05
"""Standard deviation of what a robot file states, as shares of the value and of the largest of its kind."""

IMITATED = 1e-3
"""Share of a column that must lie outside of what the robot file's own parameters do."""

FORM = 0.01
"""Share of what another effect explains that one must explain itself: no law of the library is exact, and what a large
effect does beside its law looks like small ones."""

EXACT = (JointOffset.name, LinkGeometry.name)
"""Where axes lie is no law that could be inexact: however wrong a drawing was, what is small beside it counts.  A whole
arm whose axes lie elsewhere is as usual as one axis, and no sum that happens to look like it."""

MOST = 0.5
"""Share of what otherwise remains from which on a place of an axis counts beside however large a law: what that does
beside its form looks a little like many things, and for the most part like none."""

SHARED = 1.0
"""Stated standard deviations that readings of a pose may share: of a robot that does not quite come back, of one
unloaded reading.  What they share beyond that is no scatter."""


def model_unknowns(model: StiffnessModel) -> tuple[Unknown, ...]:
    """The parameters that the robot file states: they may have changed since, but a known arm is not any arm.

    Each has a prior as wide as ``LOOSE`` of its value and ``BESIDE`` of the largest of its kind in the effect; none
    where all of a kind are stated as zero.  Dimensions of hardware keep the interval of the robot file.
    """
    unknowns: list[Unknown] = []
    for term in range(len(model.terms)):
        own = [u for u in unknowns_of(model, term) if u.stated is not None and not u.fixed]
        for unknown in own:
            parameter = unknown.parameter
            if parameter.hardware:
                unknowns.append(unknown)
                continue
            like = [abs(u.value - u.parameter.null) for u in own if u.parameter.unit == parameter.unit]
            wide = LOOSE * abs(unknown.value - parameter.null) + BESIDE * max(like)
            unknowns.append(replace(unknown, prior=wide or None))
    return with_gauge(unknowns)


def search(fits: ChoiceFits, banned: Sequence[Key] = ()) -> Search:
    """Chooses among all effects of the library those that the readings ask for, beyond the base of ``fits``: the model
    of the robot file with its own parameters refitted.  ``banned``: candidates that were found not to hold."""
    campaign, base = fits.campaign, fits.base
    chosen: tuple[Candidate, ...] = ()
    fitted = base
    tried: set[frozenset[Key]] = set()
    # what a missing effect does to all readings of a pose looks like an error that they share
    weights = replace(base.weights, shared=0.0)
    every = drop_confounded(
        campaign, base, weights, candidates(campaign, base.model, base.point.nuisances, near=base.point)
    )
    shown = [c for c in every if is_visible(c, weights) and c.key not in banned]
    hidden = tuple(c for c in every if not is_visible(c, weights))
    while True:
        if chosen:
            shown = _on_fitted_sides(campaign, fitted, shown)
        linear = _linear(campaign, base, weights, fitted, chosen, shown)
        if not chosen:
            shown = list(linear.candidates)
        before = {c.key for c in chosen}
        start = [i for i, c in enumerate(linear.candidates) if c.key in before]
        sums = {i for i, c in enumerate(linear.candidates) if _is_sum(c)}
        selection = selected(linear.problem, range(len(linear.candidates)), start, sums)
        now = tuple(linear.candidates[g] for g in selection.groups)
        keys = frozenset(c.key for c in now)
        if keys == before or keys in tried or len(tried) >= PASSES:
            last = explained(linear.problem, start)
            against = find_alternatives(fits, fitted, linear, last)
            better = next((r for r in against if r.fitted and not r.is_decoy and r.priced < -1.0), None)
            done = Search(base, fitted, chosen, hidden, linear, last, against)
            if better is None or len(tried) >= PASSES:
                return done
            now = tuple(better.candidate if c.key == better.of else c for c in chosen)
            keys = frozenset(c.key for c in now)
            if keys in tried:
                return done
        tried.add(keys)
        # a fit that is over says nothing of the parameters in the next one
        as_started = {c.key: c for c in shown}
        now = tuple(as_started[c.key] if c.only else c for c in now)
        chosen, fitted = _confirmed(fits, now, shown)
        weights = limit_shared_scatter(base, fitted)


def _on_fitted_sides(campaign: Campaign, fitted: Fit, shown: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, those of gaps with their columns where ``fitted`` has the loads of the joints: weights that stood
    in for a missing effect had put teeth on the other side."""
    gaps = [c for c in shown if _is_gap(c)]
    if not gaps:
        return list(shown)
    model, nuisances = fitted.model, fitted.point.nuisances
    new = {c.key: c for c in candidates(campaign, model, nuisances, by_direction=True, near=fitted.point)}
    moved: dict[Key, Candidate] = {}
    for c in gaps:
        there = new.get(c.key)
        places = {} if there is None else {u.parameter.name: k for k, u in enumerate(there.unknowns)}
        at = [places[u.parameter.name] for u in c.unknowns if u.parameter.name in places]
        if there is not None and len(at) == len(c.unknowns):
            moved[c.key] = replace(c, columns=there.columns[:, :, at])
    return [moved.get(c.key, c) for c in shown]


def _is_sum(candidate: Candidate) -> bool:
    """Whether a candidate moves several joints at once, so that what others do on one each may look like it: waves of
    all gears, or all weights of an arm, which are also a load on the flange and a wave of one gear together."""
    joints = {u.parameter.joint for u in candidate.unknowns} - {""}
    return candidate.name not in EXACT and (candidate.joint == EVERY or len(joints) > 1)


def _is_gap(candidate: Candidate) -> bool:
    """Whether the load of a joint decides on which side of a gap it lies."""
    return candidate.effect.by_direction and isinstance(candidate.effect, ComplianceLaw)


def drop_confounded(
    campaign: Campaign, base: Fit, weights: Weighting, every: Sequence[Candidate]
) -> list[Candidate]:
    """The candidates without those parameters that, in their usual size, do nothing observable but what parameters of
    the robot file, or tracker and targets, do as well: a gain of the force is a softer arm.

    Only within what is known of those: a zero and a twist about nearly the same line, half a radian against each other,
    do whatever one likes.
    """
    known, _ = _priors(campaign, base, base)
    taken = np.nan_to_num(np.concatenate([weights(part) for part in base.point.required_columns], axis=1))
    basis = basis_of(np.concatenate([taken, known]))
    remaining = []
    for c in every:
        columns = np.nan_to_num(weights(c.columns))
        size = np.linalg.norm(columns, axis=0)
        beyond = outside(basis, np.concatenate([columns, np.zeros((len(known), columns.shape[1]))]))
        own = np.linalg.norm(beyond[: len(taken)], axis=0) > np.maximum(IMITATED * size, c.least)
        if own.any():
            # those that only shape what another does are not judged by themselves
            own |= np.array([u.parameter.name in c.dormant_parameters for u in c.unknowns])
        if own.any() and not own.all():
            c = replace(
                c,
                unknowns=tuple(u for u, alone in zip(c.unknowns, own.tolist(), strict=True) if alone),
                columns=c.columns[:, :, own],
            )
        remaining.append(c if own.any() else replace(c, columns=np.zeros_like(c.columns)))
    return remaining


def _confirmed(
    fits: ChoiceFits, chosen: tuple[Candidate, ...], shown: Sequence[Candidate]
) -> tuple[tuple[Candidate, ...], Fit]:
    """Those of ``chosen`` that count as well where what readings of a pose share is taken from a fit without them, and
    that are not small beside others; the weakest first.  And the fit with them."""
    campaign, base = fits.campaign, fits.base
    fitted, among = fits.of(chosen), len(shown)
    while chosen:
        linear = _linear(campaign, base, limit_shared_scatter(base, base), fitted, chosen, chosen)
        places = range(len(chosen))
        without = [explained(linear.problem, [g for g in places if g != gone]).squares for gone in places]
        gains = [squares - explained(linear.problem, places).squares for squares in without]
        of_laws = [gain for gain, c in zip(gains, chosen, strict=True) if c.name not in EXACT]
        floor = FORM * max(of_laws, default=0.0)
        small = [
            k
            for k, c in enumerate(chosen)
            if gains[k] < floor and not (c.name in EXACT and gains[k] > MOST * without[k])
        ]
        weakest = min(small or places, key=lambda k: gains[k])
        rest = tuple(c for k, c in enumerate(chosen) if k != weakest)
        fit_of_rest = fits.of(rest, exact=False)
        weights = limit_shared_scatter(base, fit_of_rest)
        given = _linear(campaign, base, weights, fitted, chosen, chosen).problem
        others = [g for g in places if g != weakest]
        if not small and counts(given, explained(given, others), explained(given, places), among):
            break
        chosen, fitted = rest, fit_of_rest
    return chosen, fits.of(chosen)


def limit_shared_scatter(base: Fit, fitted: Fit) -> Weighting:
    """The weights of ``fitted`` for what was fitted; readings of a pose share no more than scatter can be."""
    shared = fitted.weights.shared
    if base.noise.known:
        shared = min(shared, SHARED * float(np.median(base.noise.sigma)))
    return replace(fitted.plain_weights, shared=shared)


def _linear(
    campaign: Campaign,
    base: Fit,
    weights: Weighting,
    fitted: Fit,
    chosen: Sequence[Candidate],
    shown: Sequence[Candidate],
) -> Linear:
    """The problem that the candidates' columns make of the residual of ``fitted`` without what was chosen; priors of
    the model's own parameters count as rows."""
    own, nuisance = base.point.required_columns
    prior, away = _priors(campaign, base, fitted)

    def tall(columns: Floats, below: Floats) -> Floats:
        return np.asarray(np.nan_to_num(np.concatenate([weights(columns), below])))

    def readings(columns: Floats) -> Floats:
        return tall(columns, np.zeros((len(prior), columns.shape[2])))

    p = own.shape[2]
    common = np.concatenate([tall(own, prior[:, :p]), tall(nuisance, prior[:, p:])], axis=1)
    basis = basis_of(common)
    current = _as_fitted(campaign, fitted, chosen, shown)
    with_chosen = [readings(c.columns) for c in current if c.only]
    beyond = basis
    if with_chosen:
        more = basis_of(outside(basis, np.concatenate(with_chosen, axis=1)))
        beyond = np.concatenate([basis, more], axis=1)
    current = tuple(
        _as_grown(campaign, fitted, c, lambda columns: outside(beyond, readings(columns)))
        if c.nonlinear and not c.only and not (c.start and chosen)
        else c
        for c in current
    )
    # so that with the value of each the same residual remains as of the fit
    contributions = [c.columns @ in_scales(fitted, c.only) for c in current if c.only]
    residual = tall(sum(contributions, fitted.point.residual), away)
    columns = tuple(readings(c.columns) for c in current)
    groups = [(own, _reach(c)) for own, c in zip(columns, current, strict=True)]
    rows = weights.counts + len(prior)
    linear_problem = problem(residual, basis, groups, rows, base.noise.known, campaign.poses)
    return Linear(current, linear_problem, residual, common, columns, len(prior), weights)


def _priors(campaign: Campaign, base: Fit, fitted: Fit) -> tuple[Floats, Floats]:
    """Rows (k, P + U) of what is known of the unknowns of ``base`` and of the nuisances besides readings, and how far
    ``fitted`` is from it (k,), in standard deviations."""
    own = prior_rows(base.unknowns)
    away = np.array([u.value for u in base.unknowns]) - _values(fitted.model, base.unknowns)
    known, offset = campaign.nuisance_prior(fitted.point.nuisances)
    stated = own.any(axis=1)
    rows = np.block(
        [
            [own[stated], np.zeros((int(stated.sum()), known.shape[1]))],
            [np.zeros((len(known), own.shape[1])), known],
        ]
    )
    offsets = np.concatenate([(own @ (away / scales(base.unknowns)))[stated], offset])
    return rows * prior_weight(fitted.factor), offsets * prior_weight(fitted.factor)


def _as_grown(campaign: Campaign, fitted: Fit, candidate: Candidate, beyond: Outside) -> Candidate:
    """The candidate with its columns at the size that explains the most of the residual of ``fitted``."""
    model, unknowns = composed(fitted.model, [candidate])
    large = evaluate_at_size(campaign, fitted.point, model, unknowns, beyond)
    return replace(candidate, columns=large.columns, start=tuple(large.values.tolist()))


def _values(model: StiffnessModel, unknowns: Sequence[Unknown]) -> Floats:
    return np.array([model.terms[u.term].values[u.parameter.name] for u in unknowns])


def _as_fitted(
    campaign: Campaign, fitted: Fit, chosen: Sequence[Candidate], current: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """The candidates, those chosen with their columns at the fit instead of at their null."""
    own, _ = fitted.point.required_columns
    values = in_scales(fitted, fitted.unknowns)
    there: dict[Key, Candidate] = {}
    counted: set[tuple[int, str]] = set()
    for candidate in chosen:
        keys = keys_of(fitted.model, candidate).keys() - counted
        counted |= keys
        at = [i for i, u in enumerate(fitted.unknowns) if u.key in keys]
        if not at:
            continue
        columns = np.nan_to_num(own[:, :, at])
        if candidate.nonlinear:
            does = point_without(campaign, fitted, [candidate]).residual - fitted.point.residual
            columns = broyden_update(columns, np.nan_to_num(does), values[at])
        there[candidate.key] = candidate.fitted(columns, [fitted.unknowns[i] for i in at])
    return tuple(there.get(c.key, c) for c in current)


def _reach(candidate: Candidate) -> Floats:
    """(p, 2) how far each parameter may go from its null, in its scale."""
    return np.array(
        [
            [
                (u.parameter.lower - u.parameter.null) / u.parameter.scale,
                (u.parameter.upper - u.parameter.null) / u.parameter.scale,
            ]
            for u in candidate.shown
        ]
    )
