"""Intervals that hold what else predicts the same readings.

The covariance of a fit holds the scatter of the readings alone.  What was not estimated stands at its stated value or
at its null, as if that were exact: a parameter that is observable too weakly, a twist that others imitate, a zero that
no robot file states.  Here such parameters c count beside the estimated ones x, each with its plausible size as the
standard deviation of a prior.  One linear step from the fit gives the posterior of both, whose mean is d away from the
values that are reported.  The mean square error of these is then

    E (x - reported)(x - reported)^T = covariance of x in the posterior + d d^T

The readings scatter there as joints do not come to rest at one angle either (``identification.joint_scatter``).

Considered parameters: Schmidt, Adv. Control Systems 3 (1966), 293; posterior mean square error of any estimate: Berger,
Statistical Decision Theory and Bayesian Analysis (1985), Sec. 4.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidate_fits import term_of
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.search import BESIDE, LOOSE
from postproc.diagnosis.selection import basis_of, outside
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.identification.fit import Fit
from postproc.identification.joint_scatter import scatter_of
from postproc.identification.least_squares import predicted_in, prior_rows, prior_weight, scales
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown, unknowns_of, with_gauge
from postproc.model import StiffnessModel

ROUNDING = 1e-9
"""Share of the largest singular value below which one is rounding."""

SHOWS = 4.5
"""Standard deviations of all readings together from which on a parameter of plausible size would have been found: odds
of 1 to 100,000 by chance, one to a thousand among a hundred candidates."""


def cover_equivalent_models(fitted: Fit, full: Fit, base: Fit, named: Sequence[Candidate]) -> Fit:
    """``fitted`` with intervals that hold what these readings do not tell from it.

    That is what ``full``, the fit of all parameters, and ``base`` left out because it is observable too weakly; and as
    far as none would show in its plausible size, what the ``named`` effects have beside what was fitted, and lengths,
    twists and zeros that nothing states.
    """
    if not full.unknowns:
        return fitted
    model, others = _not_estimated(full, base, named)
    covariance, mean = _posterior(full, model, others)
    places = {u.key: k for k, u in enumerate(full.unknowns)}
    here = [k for k, u in enumerate(fitted.unknowns) if u.key in places]
    there = [places[fitted.unknowns[k].key] for k in here]
    away = (fitted.point.values(fitted.unknowns)[here] - mean[there])[:, None]
    wider = fitted.covariance.copy()
    wider[np.ix_(here, here)] = covariance[np.ix_(there, there)] + away @ away.T
    return replace(fitted, covariance=wider)


def _not_estimated(
    full: Fit, base: Fit, named: Sequence[Candidate]
) -> tuple[StiffnessModel, dict[Unknown, bool]]:
    """A model that has all lengths, twists and zeros too, and its unknowns that ``full`` did not estimate; whether they
    were asked for and left out again."""
    model = full.model
    for effect in (LinkGeometry, JointOffset):
        if all(term.effect.name != effect.name for term in model.terms):
            model = model.with_effect(effect(model.robot.joints))
    new: list[Unknown] = []
    for candidate in named:
        at = term_of(model, candidate)
        if at is not None:
            own = {u.parameter.joint for u in candidate.unknowns}
            new += [u for u in unknowns_of(model, at) if u.parameter.joint in own]
    for index, term in enumerate(model.terms):
        if term.effect.name in (LinkGeometry.name, JointOffset.name):
            new += unknowns_of(model, index)
    known = {u.key for u in full.unknowns}
    others: dict[Unknown, bool] = {}
    for several, asked in (((*base.asked, *full.asked), True), (new, False)):
        for unknown in with_gauge(several):
            if unknown.key not in known and not unknown.fixed:
                known.add(unknown.key)
                others[_as_plausible(unknown, several)] = asked
    return model, others


def _as_plausible(unknown: Unknown, several: Sequence[Unknown]) -> Unknown:
    """A stated parameter with a prior as wide as it is plausible on its joint: a wrist weighs less than the arm.

    It is one of ``several``, whose priors look at the largest of the arm; where its joint states none, that one stays.
    """
    stated, parameter = unknown.stated, unknown.parameter
    if stated is None or unknown.prior is None or unknown.gauge or parameter.hardware:
        return unknown
    like = [
        abs(u.value - u.parameter.null)
        for u in several
        if (u.term, u.parameter.joint, u.parameter.unit) == (unknown.term, parameter.joint, parameter.unit)
    ]
    wide = LOOSE * abs(unknown.value - parameter.null) + BESIDE * max(like)
    return replace(unknown, prior=min(unknown.prior, wide)) if wide > 0 else unknown


def _posterior(full: Fit, model: StiffnessModel, others: Mapping[Unknown, bool]) -> tuple[Floats, Floats]:
    """(k, k) covariance and (k,) mean [SI] of the unknowns of ``full``, with ``others`` in ``model`` beside them."""
    campaign, point, own = full.campaign, full.point, list(full.unknowns)
    beside = list(others)
    moves = columns(campaign, model, beside, predicted_in(model, point), point.nuisances)
    parts = [np.nan_to_num(full.weights(part)) for part in (*point.required_columns, moves)]
    wide = [u.parameter.scale if u.prior is None else u.prior for u in beside]
    size = np.array(wide) / scales(beside)
    # what would have shown in its plausible size, and was not found, is not there
    shown = np.linalg.norm(outside(basis_of(np.concatenate(parts[:2], axis=1)), parts[2]), axis=0) * size
    counts = np.array(list(others.values())) | (shown < SHOWS * np.sqrt(full.factor))
    matrix = np.concatenate([parts[0], parts[2][:, counts], parts[1]], axis=1)
    weight = prior_weight(full.factor)
    known, offset = campaign.nuisance_prior(point.nuisances)
    k, c = len(own), int(counts.sum())
    rows = np.zeros((k + c + len(known), matrix.shape[1]))
    rows[:k, :k] = prior_rows(own) * weight
    rows[k : k + c, k : k + c] = np.diag(1.0 / size[counts]) * weight
    rows[k + c :, k + c :] = known * weight
    away = np.array([u.value for u in own]) - point.values(own)
    asked = np.concatenate([prior_rows(own) @ (away / scales(own)), np.zeros(c), offset])
    whole = np.concatenate([matrix, rows])
    target = np.concatenate([full.weights(np.nan_to_num(point.residual)), asked * weight])
    length = np.linalg.norm(whole, axis=0)
    length[length == 0] = 1.0
    u, s, v = np.linalg.svd(whole / length, full_matrices=False)
    on = s > ROUNDING * s[0]
    back = (v[on].T / s[on])[:k] / length[:k, None]
    unit = scales(own)
    covariance = back @ back.T * full.factor
    scatter = scatter_of(full)
    if scatter is not None:
        count = len(whole) - len(rows)
        covariance += scatter.excess(back @ u[:count, on].T)
    covariance *= np.outer(unit, unit)
    mean = point.values(own) + (back @ (u[:, on].T @ target)) * unit
    return np.asarray(covariance), np.asarray(mean)
