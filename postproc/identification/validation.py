"""How a fit is on readings that it did not see, and whether its intervals hold without their assumptions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.identification.campaign import SCALE, Campaign, Nuisances
from postproc.identification.fit import NEAR, Fit
from postproc.identification.least_squares import at, bounded_step, descended, prior_equations, reach
from postproc.identification.registration import registered

SEED = 20260101

MANY = 2000
"""Readings from which on a fold that is left out hardly moves a fit."""

OTHER_STATION = 3.0
"""A registration that leaves so many times more than one of its own is not valid for other readings."""

WIDER = 1.4
"""Ratio of a bootstrap's interval to the one by covariance from which on it is worth reporting."""

Progress = Callable[[int, int], None]


def nothing(_done: int, _all: int) -> None:
    pass


def folds_of(campaign: Campaign, folds: int, seed: int = SEED) -> Ints:
    """(R,) the fold of each reading: poses are dealt out at random, all readings of one into one fold."""
    dealt = np.random.default_rng(seed).permutation(campaign.poses) % folds
    return np.asarray(dealt[campaign.pose])


def held_out(fitted: Fit, folds: int, progress: Progress = nothing) -> Floats:
    """(R, 3) [m] residuals of every reading, robot base axes, by a fit without its fold; NaN where it does not count.

    Each fold's fit starts from the one of all readings and keeps its columns: what is reported is to first order, as
    the residuals that leverages give (PRESS; Allen, Technometrics 16 (1974)).  Where the readings of the other folds
    hardly determine a parameter, a fit of its own might run far away along it, which describes more the fold than of
    the model.  Of thousands of readings, where a fold hardly moves the fit, one linear step does.
    """
    campaign = fitted.campaign
    fold = folds_of(campaign, folds)
    if len(campaign) > MANY:
        away = _linear_steps(fitted, fold, folds)
        residuals = campaign.in_base(away, fitted.point.nuisances)[:, :3]
        progress(folds, folds)
    else:
        residuals = np.full((len(campaign), 3), np.nan)
        for k in range(folds):
            rows = fold == k
            weights = fitted.weights.times((~rows).astype(float))
            point = descended(
                campaign, fitted.point, fitted.unknowns, weights, True, factor=fitted.factor, close=NEAR,
            )  # fmt: skip
            residuals[rows] = campaign.in_base(point.residual, point.nuisances)[rows, :3]
            progress(k + 1, folds)
    residuals[~counted(fitted)] = np.nan
    return residuals


def _linear_steps(fitted: Fit, fold: Ints, folds: int) -> Floats:
    """(R, 3 or 6) residuals of each ``fold`` (R,) after one step to the least squares of the others."""
    campaign, point = fitted.campaign, fitted.point
    own, nuisance = (np.nan_to_num(part) for part in point.required_columns)
    columns = np.concatenate([own, nuisance], axis=2)
    # the rows of a fold as so many as there are columns, with the same information
    tall = np.column_stack([fitted.weights(columns), fitted.weights(point.residual)])
    part = np.repeat(fold, len(tall) // len(fold))
    reduced = [np.linalg.qr(tall[part == k], mode="r") for k in range(folds)]
    rows, asked = prior_equations(campaign, point, fitted.unknowns, fitted.factor)
    low, high = reach(campaign, point, fitted.unknowns)
    away = np.empty_like(point.residual)
    for k in range(folds):
        rest = np.concatenate(
            [*(block for j, block in enumerate(reduced) if j != k), np.column_stack([rows, asked])]
        )
        step = bounded_step(rest[:, :-1], rest[:, -1], low, high, own.shape[2])
        away[fold == k] = point.residual[fold == k] - columns[fold == k] @ step
    return away


def counted(fitted: Fit) -> Bools:
    """(R,) readings with a whole position that count in the fit."""
    return np.asarray((fitted.weights.weight[:, :3] > 0).all(axis=1))


@dataclass(frozen=True)
class Validation:
    """Readings that were not fitted: ``before``, ``after`` (R, 3) [m] residuals of the models before and after, robot
    base axes; ``registered_anew``: their tracker was elsewhere."""

    campaign: Campaign
    before: Floats
    after: Floats
    registered_anew: bool


def validated(before: Fit, after: Fit, campaign: Campaign) -> Validation:
    """What both fits predict of readings ``campaign`` that neither has used.

    Targets are where the fit found them.  The tracker is where it was for the fit, if it is the same session (or
    there is but one on either side) and that holds; else it is registered again from these readings.
    """
    refitted, residuals = False, []
    for fitted in (before, after):
        known = campaign.knowing(fitted.campaign, fitted.point.nuisances)
        point = at(known, fitted.model, known.start())
        given = registered(known, point.predicted, np.ones(len(known), bool))
        if known.tracked:
            same_station, others = _stations(fitted, known, given)
            own, there = (
                np.nanmean(known.residual(point.predicted, g)[:, :3] ** 2) for g in (given, same_station)
            )
            if there <= OTHER_STATION**2 * own:
                given, refitted = same_station, refitted or others
            else:
                refitted = True
        residuals.append(known.in_base(known.residual(point.predicted, given), given)[:, :3])
    return Validation(campaign, residuals[0], residuals[1], refitted)


def _stations(fitted: Fit, campaign: Campaign, nuisances: Nuisances) -> tuple[Nuisances, bool]:
    """``nuisances``, with the tracker of the fit for sessions that it knows, and whether there are others."""
    names, known = campaign.readings.sessions, fitted.campaign.readings.sessions
    pairs = [(k, known.index(name)) for k, name in enumerate(names) if name in known]
    if len(names) == len(known) == 1:
        pairs = [(0, 0)]
    rotation, position = nuisances.frames.rotation.copy(), nuisances.frames.position.copy()
    for k, other in pairs:
        rotation[k], position[k] = (
            fitted.point.nuisances.frames.rotation[other],
            fitted.point.nuisances.frames.position[other],
        )
    return replace(nuisances, frames=Poses(rotation, position)), len(pairs) < len(names)


@dataclass(frozen=True)
class Bootstrap:
    """deviation (k,) [SI] of each unknown over ``draws`` refits."""

    deviation: Floats
    draws: int


def bootstrap(fitted: Fit, draws: int, progress: Progress = nothing) -> Bootstrap:
    """Wild bootstrap (Liu 1988): each reading's residual, made as large as it was before the fit took its part, with a
    random sign on what is expected, and refitted.  Readings of one pose that share an error share the sign."""
    campaign, point = fitted.campaign, fitted.point
    rng = np.random.default_rng(SEED)
    values = point.values(fitted.unknowns)
    grown = point.residual / _free_share(fitted)[:, None]
    samples = np.empty((draws, len(fitted.unknowns)))
    for draw in range(draws):
        sign = rng.choice([-1.0, 1.0], campaign.poses)[campaign.pose]
        if fitted.weights.shared == 0:
            sign = rng.choice([-1.0, 1.0], len(campaign))
        moved = sign[:, None] * grown - point.residual
        drawn = campaign.shifted(moved)
        drawn.expected_scale = float(rng.normal(point.nuisances.scale, SCALE)) if campaign.scaled else 0.0
        start = replace(point, residual=point.residual + moved)
        # a prior is a reading like the others: it would have been another one
        unknowns = [
            u if u.prior is None else replace(u, value=float(rng.normal(value, u.prior)))
            for u, value in zip(fitted.unknowns, values, strict=True)
        ]
        ends = descended(drawn, start, unknowns, fitted.weights, True, 6, fitted.factor)
        samples[draw] = ends.values(unknowns)
        progress(draw + 1, draws)
    return Bootstrap(samples.std(axis=0, ddof=1), draws)


def _free_share(fitted: Fit) -> Floats:
    """(R,) root of the share of a reading's variance that its residual keeps, 1 - leverage."""
    point, weights = fitted.point, fitted.weights
    matrix = np.concatenate([weights(part) for part in point.required_columns], axis=1)
    length = np.linalg.norm(matrix, axis=0)
    u, s, _ = np.linalg.svd(matrix[:, length > 0] / length[length > 0], full_matrices=False)
    leverage = (u[:, s > 1e-8 * s[0]] ** 2).sum(axis=1).reshape(point.residual.shape)
    return np.asarray(np.sqrt(np.clip(1.0 - leverage.mean(axis=1), 0.05, 1.0)))
