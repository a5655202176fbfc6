"""Other candidates in the place of what a search chose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidate_fits import ChoiceFits, composed, point_without
from postproc.diagnosis.candidates import EVERY, Candidate, fewest_parameters
from postproc.diagnosis.decoys import decoys
from postproc.diagnosis.nonlinear_effects import evaluate_at_size
from postproc.diagnosis.search_result import Alternative, Linear
from postproc.diagnosis.selection import (
    Explained,
    Problem,
    basis_of,
    beside,
    complexity_penalty,
    explained,
    outside,
    residual_of,
    scatter,
)
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit
from postproc.identification.noise import Weighting

CLOSE, CLOSE_SHARE, RIVALS = 30.0, 0.05, 3
"""Alternatives are fitted where -2 ln(likelihood) is linearly worse by less than this, or than this share of the gain;
so many at most."""

TWIN, TWIN_SHARE = 0.0455, 0.05
"""An alternative predicts the same as a choice that misses less of what this does than this share, and no more than
chance makes of a parameter with this probability, four variances of a reading: of a choice for all joints, in which
those that do not have it fit scatter, of each parameter that the alternative lacks."""

LACKS = 0.1
"""Share of a parameter's column that must lie outside of those of an alternative for this to lack it."""

OUTLIER_LIMIT = 5.0
"""Standard deviations that a reading counts with at most."""


def squares_of(fitted: Fit, weights: Weighting, variance: float) -> float:
    """Squares that remain after a fit, of readings [their variance by ``weights``, outliers cut] and of priors;
    ``variance`` of the readings as they scatter."""
    level = np.sqrt(variance)
    residual = np.minimum(np.abs(weights(fitted.point.residual)), OUTLIER_LIMIT * level)
    values = fitted.point.values(fitted.unknowns)
    priors = sum(
        (level * (u.value - value) / u.prior) ** 2
        for u, value in zip(fitted.unknowns, values.tolist(), strict=True)
        if u.prior is not None and not u.gauge
    )
    return float(residual @ residual) + float(priors)


def find_alternatives(
    fits: ChoiceFits, fitted: Fit, linear: Linear, last: Explained
) -> tuple[Alternative, ...]:
    """Other candidates in the place of each choice that explain at least half of what it does, nearest first; the
    nearest are fitted: what is linear is only nearly so."""
    campaign, base = fits.campaign, fits.base
    given, chosen = linear.problem, [linear.candidates[g] for g in last.groups]
    variance = scatter(given, last)
    here = squares_of(fitted, fitted.weights, variance)
    alternatives: list[Alternative] = []
    for group in last.groups:
        mine = linear.candidates[group]
        rest = explained(given, tuple(g for g in last.groups if g != group))
        gain, residual = rest.squares - last.squares, residual_of(given, rest)

        def paid(columns: Floats, rest: Explained = rest, residual: Floats = residual) -> float:
            return complexity_penalty(beside(given, rest, columns), residual, variance)

        def scaled(g: int) -> Floats:
            return given.matrix[:, given.places[g]] * given.size[given.places[g]]

        signal, beyond = _signal(given, rest, last, group), linear.basis_with(rest.groups)
        whole_arm = given.matrix[:, given.places[group] if mine.joint == EVERY else []]
        fits_scatter = beside(given, rest, whole_arm)
        own, of_mine = paid(scaled(group)), []
        against = [
            *enumerate(linear.candidates),
            *((-1, decoy) for decoy in decoys(base.model, campaign, mine)),
        ]
        for other, candidate in against:
            if other in last.groups or candidate.contains(mine) or mine.contains(candidate):
                continue
            if candidate.nonlinear:
                instead, squares, columns = _instead(campaign, fitted, linear, rest, beyond, mine, candidate)
            else:
                instead, squares = candidate, explained(given, (*rest.groups, other)).squares
                columns = scaled(other)
            if rest.squares - squares > 0.5 * gain:
                worse = float(squares - last.squares) / variance
                twin = _predicts(beside(given, rest, columns), fits_scatter, signal, variance)
                of_mine.append(Alternative(mine.key, instead, worse, paid(columns) - own, False, twin))
        # of one effect the form with fewest parameters that predicts the same
        twins = fewest_parameters([a.candidate for a in of_mine if a.twin])
        of_mine = [a for a in of_mine if not a.twin or any(a.candidate is one for one in twins)]
        of_mine.sort(key=lambda alternative: (not alternative.twin, alternative.margin))
        for k, alternative in enumerate(of_mine[:RIVALS]):
            if alternative.margin < max(CLOSE, CLOSE_SHARE * gain / variance):
                there = fits.of([alternative.candidate if c is mine else c for c in chosen], exact=False)
                worse = float(squares_of(there, fitted.weights, variance) - here) / variance
                of_mine[k] = replace(alternative, worse=worse, fitted=True)
        alternatives += of_mine
    return tuple(sorted(alternatives, key=lambda alternative: alternative.margin))


def _signal(problem: Problem, rest: Explained, last: Explained, group: int) -> Floats:
    """(n,) what a chosen group does, outside of what the others explain."""
    on = np.isin(last.columns, problem.places[group])
    does = problem.matrix[:, last.columns[on]] @ last.coefficients[on]
    return beside(problem, rest, does[:, None])[:, 0]


def _predicts(columns: Floats, fits_scatter: Floats, signal: Floats, variance: float) -> bool:
    """Whether ``columns`` (n, p) can do what ``signal`` (n,) is, as far as the columns ``fits_scatter`` (n, k) that it
    is a sum of do not fit scatter."""
    from scipy.special import chdtri

    basis = basis_of(columns) if columns.any() else np.zeros((len(signal), 0))
    misses = outside(basis, signal[:, None])[:, 0]
    squares = float(misses @ misses)
    length = np.linalg.norm(fits_scatter, axis=0)
    lacks = outside(basis, fits_scatter[:, length > 0] / length[length > 0])
    lacking = int((np.linalg.svd(lacks, compute_uv=False) > LACKS).sum()) if lacks.size else 1
    chance = float(chdtri(max(1, lacking), TWIN))
    return squares < chance * variance and squares < TWIN_SHARE * float(signal @ signal)


def _instead(
    campaign: Campaign,
    fitted: Fit,
    linear: Linear,
    rest: Explained,
    beyond: Floats,
    mine: Candidate,
    other: Candidate,
) -> tuple[Candidate, float, Floats]:
    """``other``, that is not linear in its size, as large as explains the most in the place of ``mine`` beside
    ``rest``, whose basis is ``beyond`` (n, r); the squares that then remain, and its columns outside of what is
    explained anyway."""
    without = point_without(campaign, fitted, [mine])
    model, unknowns = composed(without.model, [other])

    def readings(columns: Floats) -> Floats:
        below = np.zeros((linear.priors, columns.shape[2]))
        return np.asarray(np.nan_to_num(np.concatenate([linear.weights(columns), below])))

    large = evaluate_at_size(
        campaign, without, model, unknowns, lambda columns: outside(beyond, readings(columns))
    )
    gain = float(large.target @ large.target - large.remaining @ large.remaining)
    alternative = replace(other, columns=large.columns, start=tuple(large.values.tolist()))
    return alternative, rest.squares - gain, outside(linear.basis, readings(large.columns))
