"""Lengths, twists, zeros, compliances and weights that the readings do not ask for stay as the robot file states them:
each one that is fitted along adds its scatter to every prediction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.selection import basis_of, outside
from postproc.identification.fit import Fit, fit
from postproc.identification.least_squares import scales
from postproc.identification.unknowns import Unknown

LEAST = 4.0
"""Variances of a reading that a parameter must at least explain; of many that are tried, 2 ln(how many): the risk
inflation criterion (Foster and George, Ann. Stat. 22 (1994))."""

TOGETHER = 0.05
"""Probability that what is left out would explain as much by chance."""


def restore_unmoved_parameters(fitted: Fit) -> Fit:
    """The fit with those parameters alone, of geometry and of what the robot file states, that the readings ask for,
    the others as stated or at their null.

    Parameters are taken in one after the other, that first which explains most beside what is in already; then those
    that the others make unnecessary leave again.  Intervals stay those of the fit of all: they hold what the others may
    be.  Unchanged where all are needed, where a joint that has parameters of its own that nothing states would keep
    none, or where the others together explain more than chance: an arm that is a little off everywhere.
    """
    from scipy.special import chdtri

    places = [k for k, u in enumerate(fitted.unknowns) if _may_stay(u)]
    if len(places) < 2:
        return fitted
    own = [fitted.unknowns[k] for k in places]
    matrix, target = _problem(fitted, places, own)
    penalty = max(LEAST, 2.0 * np.log(len(own))) * max(fitted.factor, 1e-300)
    chosen = _chosen(matrix, target, penalty)
    new = {(u.term, u.parameter.joint) for u in own if u.stated is None}
    if len(chosen) == len(own) or not new <= {(own[k].term, own[k].parameter.joint) for k in chosen}:
        return fitted
    gone = {own[k].key: _before(own[k]) for k in range(len(own)) if k not in chosen}
    # what all of these together leave undetermined is not determined by taking others as stated
    rest = [u for u in fitted.unknowns if u.key not in gone]
    model = fitted.model.with_values(gone)
    found = fit(fitted.campaign, model, rest, nuisances=fitted.point.nuisances, factor=fitted.factor)
    worse = (_squares(found, fitted) - _squares(fitted, fitted)) / max(fitted.factor, 1e-300)
    if worse > chdtri(len(gone), TOGETHER):
        return fitted
    asked = tuple(u for u in fitted.asked if u.key not in gone)
    dropped = (*fitted.dropped, *found.dropped)
    return replace(found, asked=asked, dropped=dropped, covariance=_covariance(found, fitted))


def _covariance(refitted: Fit, fitted: Fit) -> Floats:
    """(k, k) of what was ``refitted``, as of ``fitted``: that a parameter is not asked for does not make it exact, and
    what it may be is in the intervals of the others."""
    places = {u.key: k for k, u in enumerate(fitted.unknowns)}
    here = [k for k, u in enumerate(refitted.unknowns) if u.key in places]
    there = [places[refitted.unknowns[k].key] for k in here]
    covariance = np.diag(np.diag(refitted.covariance))
    covariance[np.ix_(here, here)] = fitted.covariance[np.ix_(there, there)]
    return covariance


def _may_stay(unknown: Unknown) -> bool:
    """Whether a parameter is of geometry, or one that the robot file states and that is no dimension of hardware."""
    own = unknown.stated is not None and not unknown.parameter.hardware
    return not unknown.fixed and (own or unknown.plausible is not None)


def _before(unknown: Unknown) -> float:
    return unknown.parameter.null if unknown.stated is None else unknown.stated.value


def _squares(one: Fit, like: Fit) -> float:
    residual = like.weights(np.nan_to_num(one.point.residual))
    return float(residual @ residual)


def _problem(fitted: Fit, places: Sequence[int], own: Sequence[Unknown]) -> tuple[Floats, Floats]:
    """Columns (n, k), whitened, of the parameters and what they explain together with the residual (n,), all outside of
    what everything else in the fit explains."""
    columns, nuisance = (np.nan_to_num(fitted.weights(part)) for part in fitted.point.required_columns)
    others = [k for k in range(columns.shape[1]) if k not in places]
    basis = basis_of(np.concatenate([columns[:, others], nuisance], axis=1))
    moved = (fitted.point.values(own) - np.array([_before(u) for u in own])) / scales(own)
    matrix = columns[:, list(places)]
    target = fitted.weights(np.nan_to_num(fitted.point.residual)) + matrix @ moved
    return outside(basis, matrix), outside(basis, target[:, None])[:, 0]


def _chosen(matrix: Floats, target: Floats, penalty: float) -> list[int]:
    """Columns of ``matrix`` (n, k) that explain more of ``target`` (n,) than their ``penalty``."""
    chosen: list[int] = []
    while len(chosen) < matrix.shape[1]:
        basis = basis_of(matrix[:, chosen]) if chosen else np.zeros((len(target), 0))
        beside = outside(basis, matrix)
        length = np.linalg.norm(beside, axis=0)
        seen = length > 1e-3 * np.linalg.norm(matrix, axis=0)
        along = (beside.T @ outside(basis, target[:, None])[:, 0]) / np.where(seen, length, 1.0)
        gain = np.where(seen, along**2, 0.0)
        best = int(np.argmax(gain))
        if gain[best] < penalty:
            break
        chosen.append(best)
    while chosen:
        rest = [_remaining(matrix[:, [c for c in chosen if c != gone]], target) for gone in chosen]
        least = int(np.argmin(rest))
        if rest[least] - _remaining(matrix[:, chosen], target) > penalty:
            break
        del chosen[least]
    return chosen


def _remaining(matrix: Floats, target: Floats) -> float:
    left = outside(basis_of(matrix), target[:, None]) if matrix.shape[1] else target
    return float((left**2).sum())
