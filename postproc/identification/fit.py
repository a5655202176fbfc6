"""Parameters of effects from a campaign, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.findings import Finding, Refusal
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.identifiable import Dropped, Identifiability, basis, identifiability
from postproc.identification.least_squares import (
    CLOSE,
    MAX_STEPS,
    Point,
    at,
    descended,
    prior_rows,
    prior_weight,
    scales,
    with_columns,
)
from postproc.identification.noise import Noise, Weighting, noise_of, shared_error, weighting
from postproc.identification.registration import registered
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

UNLIKELY = 0.01
"""Probability below which the residuals are taken to be more than the stated scatter."""

OVERSTATED = 0.5
"""Variance over the assumed one below which readings scatter by less, where chance hardly leaves as little."""

ROUNDING = 1e-3
"""Standard deviations below which residuals are no scatter, but rounding."""

PRIOR_ROUNDS, SAME_FACTOR = 5, 0.1
"""How often the variance of the readings is estimated again, because priors count against it, and the logarithm of its
change from which on."""

NEAR_STEPS, NEAR = 6, 0.03
"""Of a fit that starts near its end: steps, and the last one of these, in standard deviations of a reading."""

MANY = 20
"""Rows for each column from which on they are reduced first."""

AT_BOUND = 1e-9
"""Of a parameter's size."""

HUBER = 2.795
"""Length of a residual [its standard deviation] from which a robust fit weighs it down: 95 % of a normal one in space
are shorter."""


@dataclass(frozen=True)
class Estimate:
    """A parameter as found (SI), its 95 % interval (half width), and whether it lies at a bound."""

    unknown: Unknown
    value: float
    ci95: float
    at_bound: bool


@dataclass(frozen=True)
class Fit:
    """A campaign fitted.

    start, asked: the model to start with and the unknowns asked for; weights: as used, plain_weights: before a robust
    fit changed them; point: the fitted model and its residual; unknowns (k,): found; dropped: asked for, and unchanged;
    covariance (k, k) [SI]; condition: see ``Insight``; factor: variance of the readings over what ``noise``
    states, scatter_exceeded if that is clearly more; freedom: of the residuals; quantile: half width of an interval
    over its deviation; variance: of the residuals over the stated one, whether or not that is clearly another.
    """

    campaign: Campaign
    start: StiffnessModel
    asked: tuple[Unknown, ...]
    noise: Noise
    weights: Weighting
    plain_weights: Weighting
    point: Point
    unknowns: tuple[Unknown, ...]
    dropped: tuple[Dropped, ...]
    covariance: Floats
    condition: float
    factor: float
    scatter_exceeded: bool
    freedom: int
    quantile: float
    variance: float

    @property
    def model(self) -> StiffnessModel:
        return self.point.model

    @cached_property
    def residual(self) -> Floats:
        """(R, 3) [m] residual of each position, axes of the robot base."""
        return self.campaign.in_base(self.point.residual, self.point.nuisances)[:, :3]

    @property
    def shared_error(self) -> float:
        """[m] one sigma of what readings of one pose have in common in each coordinate; 0 where nothing is detected."""
        return self.weights.shared * float(np.sqrt(self.factor))

    @property
    def is_overstated(self) -> bool:
        """Whether the residual is so small that the assumed scatter would hardly ever leave it."""
        from scipy.special import chdtr

        return bool(
            self.variance < OVERSTATED and chdtr(self.freedom, self.freedom * self.variance) < UNLIKELY
        )

    @property
    def times_stated(self) -> float:
        """Root mean square residual over the stated scatter of single readings, where that is clearly more because
        readings of a pose share an error: one of the model looks like that; 0 elsewhere."""
        from scipy.special import chdtri

        if not (self.noise.known and self.weights.shared > 0 and self.freedom > 0):
            return 0.0
        alone = replace(self.plain_weights, shared=0.0)
        squares = float((alone(np.nan_to_num(self.point.residual)) ** 2).sum())
        exceeds = squares > chdtri(self.freedom, UNLIKELY)
        return float(np.sqrt(squares / self.freedom)) if exceeds else 0.0

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        deviation = np.sqrt(np.diag(self.covariance))
        estimates = []
        values = self.point.values(self.unknowns)
        for unknown, value, wide in zip(self.unknowns, values.tolist(), deviation.tolist(), strict=True):
            p = unknown.parameter
            edge = min(value - p.lower, p.upper - value) < AT_BOUND * p.scale
            estimates.append(Estimate(unknown, value, self.quantile * wide, edge))
        return tuple(estimates)


def fit(
    campaign: Campaign,
    model: StiffnessModel,
    unknowns: Sequence[Unknown],
    rows: Bools | None = None,
    robust: bool = False,
    nuisances: Nuisances | None = None,
    near: bool = False,
    factor: float = 1.0,
    exact: bool = True,
    complete: bool = True,
) -> Fit:
    """The weighted least squares of the readings ``rows`` (R,) (all without it) over the unknowns and nuisances.

    Unknowns that the readings cannot give stay as they are and are named.  Intervals come from the covariance of the
    linearized problem at the solution; where the residuals are clearly larger than the stated scatter, or none is
    stated, they are as wide as the residuals ask for.  ``robust``: readings far off are weighed down (Huber).
    ``nuisances``: tracker and targets to start with, where they are about known; ``near``: so is the model, the columns
    at which serve all through.  ``factor``: about the variance of the readings over the assumed one, to start with.
    Where it need not be ``exact`` the last step may be one of ``NEAR``, a thousandth of a variance.  Of a model that
    is not ``complete`` what exceeds the stated scatter is no scatter: what this would leave observable stays unknown.

    Raises Refusal IDN002 with fewer readings than unknowns, IDN003 where the model to start with has no rest.
    """
    noise, start = noise_of(campaign.readings), model
    rows = np.ones(len(campaign), bool) if rows is None else rows
    point = at(campaign, model, campaign.start())
    if not point.predicted.converged.all():
        lost = int((~point.predicted.converged).sum())
        raise Refusal(
            Finding(
                "IDN003", f"{lost} of {len(campaign.q)} states have no equilibrium", str(model.robot.path)
            )
        )
    if nuisances is None:
        nuisances = registered(campaign, point.predicted, rows)
    point = replace(point, nuisances=nuisances, residual=campaign.residual(point.predicted, nuisances))
    weights = plain = weighting(campaign, noise, point.residual).times(rows.astype(float))
    _enough(campaign, weights, unknowns)
    point = _influential(campaign, point, unknowns)
    start_point = point
    # while weights and unknowns still change a fit need not be exact
    steps, close, last = NEAR_STEPS if near else MAX_STEPS, NEAR, near or not exact
    free, dropped = list(unknowns), list[Dropped]()
    again = PRIOR_ROUNDS if any(u.prior is not None for u in unknowns) else 0
    sought = factor
    while True:
        # the last round finds the same minimum more exactly: weights or a variance estimated anew would move it
        exactly = close != NEAR
        sought = sought if exactly else factor
        point = descended(campaign, point, free, plain, near, steps, sought, close)
        updated = _with_turns(campaign, point, noise, plain)
        together = np.concatenate(point.required_columns, axis=2)
        updated = replace(updated, shared=shared_error(point.residual, updated, together, noise.known))
        if not exactly and (updated.shared != plain.shared or updated.weight is not plain.weight):
            plain, point = updated, descended(campaign, point, free, updated, near, steps, sought, close)
        weights = plain
        if robust:
            point, weights = _robust(campaign, point, free, plain, rows, factor, noise.known)
        if not (point.settled or near):
            point = with_columns(campaign, point, free)
        judged = 1.0 if not complete and noise.known else np.inf
        analysis, before = _insight(campaign, point, free, weights, factor, judged), factor
        factor, exceeded, freedom, quantile, variance = _variance(
            campaign, point, free, weights, plain, noise, analysis
        )
        if again and not exactly and abs(np.log(factor / before)) > SAME_FACTOR:
            again -= 1
            continue
        analysis = _insight(campaign, point, free, weights, factor, judged)
        if not analysis.dropped:
            if last:
                break
            close, last = CLOSE, True
            continue
        dropped += analysis.dropped
        gone = [free[i] for i in range(len(free)) if i not in analysis.observable]
        free = [free[i] for i in analysis.observable]
        observable, values = list(analysis.observable), {u.key: u.value for u in gone}
        if all(point.model.terms[t].values[name] == value for (t, name), value in values.items()):
            point = replace(point, columns=point.required_columns[0][:, :, observable])
        else:
            point = at(
                campaign, point.model.with_values(values), point.nuisances, start_point.predicted.displacement
            )
    scale = scales(free)
    return Fit(
        campaign, start, tuple(unknowns), noise, weights, plain, point, tuple(free), tuple(dropped),
        analysis.covariance * np.outer(scale, scale), analysis.condition, factor, exceeded, freedom, quantile,
        variance,
    )  # fmt: skip


def _enough(campaign: Campaign, weights: Weighting, unknowns: Sequence[Unknown]) -> None:
    priors = sum(unknown.prior is not None for unknown in unknowns)
    wanted = len(unknowns) - priors + len(campaign.nuisance_names)
    # a state that is read twice gives no more information on unknowns
    rows = weights.weight.any(axis=1)
    state = campaign.at * len(campaign.targets) + campaign.readings.target
    _, first = np.unique(np.where(rows, state, -1), return_index=True)
    counts = int((weights.weight[first] > 0).sum())
    if counts < wanted:
        raise Refusal(
            Finding(
                "IDN002",
                f"{counts} different measured numbers are too few for {wanted} unknowns:"
                f" {len(unknowns) - priors} parameters and"
                f" {len(campaign.nuisance_names)} of the tracker and its targets",
                campaign.readings.where(0)[0],
                help="measure more poses, or identify fewer effects with --effects",
            )
        )


def _influential(campaign: Campaign, point: Point, unknowns: Sequence[Unknown]) -> Point:
    """The point with its columns; effects that move nothing at all where they are are put to the sizes of their
    parameters first."""
    point = with_columns(campaign, point, unknowns)
    moves = np.abs(np.nan_to_num(point.required_columns[0])).max(axis=(0, 1), initial=0.0) > 0
    moving = {u.term for u, moved in zip(unknowns, moves, strict=True) if moved}
    dormant = {
        u.key: u.parameter.scale for u in unknowns if u.term not in moving and u.value == u.parameter.null
    }
    return at(campaign, point.model.with_values(dormant), point.nuisances) if dormant else point


def _robust(
    campaign: Campaign,
    point: Point,
    free: Sequence[Unknown],
    weights: Weighting,
    rows: Bools,
    factor: float,
    known: bool,
) -> tuple[Point, Weighting]:
    """Reweighted until the weights no longer change: those of Huber for the length of a reading's residual."""
    plain = weights
    share = np.ones(len(rows))
    for _ in range(20):
        length = lengths(point.residual, plain)
        level = spread_of(length[rows], known)
        now = np.minimum(1.0, HUBER * level / np.maximum(length, 1e-300))
        if np.abs(now - share).max() < 1e-3:
            break
        share = now
        # squares of residuals count by the weight: its root goes to the row
        weights = plain.times(np.sqrt(share))
        point = descended(campaign, point, free, weights, factor=factor)
    return point, weights


def lengths(residual: Floats, weights: Weighting) -> Floats:
    """(R,) length of each ``residual`` (R, 3 or 6) in standard deviations of one coordinate, made that of three where
    fewer count."""
    on = weights.weight > 0
    square = np.where(on, np.nan_to_num(residual) * weights.weight, 0.0) ** 2
    return np.asarray(np.sqrt(3.0 * square.sum(axis=1) / np.maximum(on.sum(axis=1), 1)))


def spread_of(length: Floats, known: bool) -> float:
    """One standard deviation of a coordinate by the median of ``length`` (R,) in space (1.538: the median of chi with 3
    degrees of freedom); at least the assumed one where that is ``known``."""
    return max(1.0 if known else ROUNDING, float(np.median(length)) / 1.538)


def _with_turns(campaign: Campaign, point: Point, noise: Noise, weights: Weighting) -> Weighting:
    """Where no scatter of rotations is stated, their scatter is estimated, relative to the positions."""
    if not campaign.posed or campaign.readings.sigma_turn is not None:
        return weights
    scaled = np.nan_to_num(point.residual) * weights.weight
    on = weights.weight > 0
    place, turn = (
        np.sqrt((scaled[:, s] ** 2).sum() / max(1, on[:, s].sum())) for s in (slice(0, 3), slice(3, 6))
    )
    like = (max(place, 1.0) if noise.known else place) / turn if turn > 0 and place > 0 else 1.0
    if abs(like - 1.0) < 0.05:
        return weights
    weight = weights.weight.copy()
    weight[:, 3:] *= like
    return replace(weights, weight=weight)


def _insight(
    campaign: Campaign,
    point: Point,
    free: Sequence[Unknown],
    weights: Weighting,
    factor: float,
    most: float,
) -> Identifiability:
    """What is observable where the readings scatter as ``factor`` has it, and by ``most`` at most."""
    columns, nuisance = (np.nan_to_num(weights(part)) for part in point.required_columns)
    if len(columns) > MANY * (columns.shape[1] + nuisance.shape[1]):
        # as many rows as there are columns, with the same information
        reduced = np.asarray(np.linalg.qr(np.concatenate([columns, nuisance], axis=1), mode="r"))
        columns, nuisance = reduced[:, : columns.shape[1]], reduced[:, columns.shape[1] :]
    known = campaign.nuisance_prior(point.nuisances)[0] * prior_weight(factor)
    columns = np.concatenate([columns, np.zeros((len(known), columns.shape[1]))])
    nuisance = np.concatenate([nuisance, known])
    prior, values = prior_rows(free) * prior_weight(factor), point.values(free)
    return identifiability(free, columns, nuisance, campaign.nuisance_names, prior, values, factor, most)


def _variance(
    campaign: Campaign,
    point: Point,
    free: Sequence[Unknown],
    weights: Weighting,
    plain: Weighting,
    noise: Noise,
    analysis: Identifiability,
) -> tuple[float, bool, int, float, float]:
    """Variance of the readings over the assumed one, at least 1 unless it is clearly more, whether it is, degrees of
    freedom, the 97.5 % quantile that goes with them, and that variance as it is.

    It is that of what no values of the unknowns would take away, so that a prior that contradicts the readings does
    not make them worse.  A residual that a robust fit weighs down counts with as much as it pulls, and its reading as a
    part of one (Huber, Robust Statistics, Sec. 7.6).
    """
    from scipy.special import chdtri, ndtri, stdtrit

    counts = plain.weight > 0
    share = np.where(counts, weights.weight / np.where(counts, plain.weight, 1.0), 0.0) ** 2
    columns, nuisance = point.required_columns
    q = basis(
        np.nan_to_num(weights(np.concatenate([columns[:, :, list(analysis.observable)], nuisance], axis=2)))
    )
    residual = weights(point.residual)
    residual = (residual - q @ (q.T @ residual)) * np.sqrt(share).reshape(-1)
    squares = float(residual @ residual)
    freedom = max(0, round(share.sum()) - q.shape[1])
    if freedom == 0:
        return 1.0, False, 0, float(ndtri(0.975)), 1.0
    exceeded = bool(noise.known and squares > chdtri(freedom, UNLIKELY))
    if noise.known and not exceeded:
        least = 1.0 if weights is plain else max(1.0, squares / freedom)
        return least, False, freedom, float(ndtri(0.975)), squares / freedom
    return squares / freedom, exceeded, freedom, float(stdtrit(freedom, 0.975)), squares / freedom
