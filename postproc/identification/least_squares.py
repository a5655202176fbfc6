"""Weighted non-linear least squares on the solved model: Gauss-Newton with bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.identification.bounded import bounded_least_squares
from postproc.identification.campaign import LARGEST_SCALE, REST, Campaign, Nuisances, PredictedReadings
from postproc.identification.noise import Weighting
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

MAX_STEPS = 30

CLOSE = 1e-3
"""A step that moves the prediction by less than this share of its scatter is the last."""

STRAIGHT = 0.01
"""Where a step's effect was foreseen to this share, the columns are reused."""

DAMPING, LOOSE = 1e-5, 1e-7
"""Of a column's length: what no reading sees stays where it is, parameters rather than tracker and targets."""


EXACT = 1e-6
"""Variance of readings over the assumed one below which they are exact."""

CURVED, CAREFUL = 0.3, 1e-4
"""Share of a step's effect that may come otherwise than foreseen, and the damping that the next step starts with
then."""


@dataclass(frozen=True)
class Point:
    """A model among the possible ones.  residual (R, 3 or 6) as ``Campaign.residual``; ``columns`` (R, 3 or 6, P) of
    the unknowns and ``nuisance`` (R, 3 or 6, U), taken here or at a point from which the path was straight."""

    model: StiffnessModel
    nuisances: Nuisances
    predicted: PredictedReadings
    residual: Floats
    columns: Floats | None = None
    nuisance: Floats | None = None
    settled: bool = False

    @property
    def required_columns(self) -> tuple[Floats, Floats]:
        """columns (R, 3 or 6, P) and nuisance (R, 3 or 6, U), which must have been taken.  Raises ValueError where they
        were not."""
        if self.columns is None or self.nuisance is None:
            raise ValueError("the columns of this point are not computed")
        return self.columns, self.nuisance

    def values(self, unknowns: Sequence[Unknown]) -> Floats:
        """(P,) [SI]"""
        return np.array([self.model.terms[u.term].values[u.parameter.name] for u in unknowns])


def at(
    campaign: Campaign,
    model: StiffnessModel,
    nuisances: Nuisances,
    start: Floats | None = None,
    tolerance: float = REST,
) -> Point:
    """The point of ``model`` with ``nuisances``; ``start`` (S, m) [rad, m]: displacements nearby; ``tolerance`` as of
    the equilibrium."""
    predicted = campaign.predicted(model, start, tolerance)
    return Point(model, nuisances, predicted, campaign.residual(predicted, nuisances))


def displacement_in(model: StiffnessModel, near: Point) -> Floats:
    """(S, m) [rad, m] displacements of a point as those of ``model``, whose coordinates may be more."""
    own, wider = near.model.chain, model.chain
    if own.names == wider.names:
        return near.predicted.displacement
    displacement = np.zeros((len(near.predicted.displacement), wider.size))
    both = [name for name in own.names if name in wider.index]
    displacement[:, [wider.index[name] for name in both]] = near.predicted.displacement[
        :, [own.index[name] for name in both]
    ]
    return displacement


def predicted_in(model: StiffnessModel, near: Point) -> PredictedReadings:
    """The prediction of a point as that of ``model``, which has more effects, all at their nulls."""
    return replace(near.predicted, displacement=displacement_in(model, near))


def with_columns(campaign: Campaign, point: Point, unknowns: Sequence[Unknown]) -> Point:
    """The point with its columns, taken here."""
    return replace(
        point,
        columns=columns(campaign, point.model, unknowns, point.predicted, point.nuisances),
        nuisance=campaign.nuisance_columns(point.predicted, point.nuisances),
    )


def scales(unknowns: Sequence[Unknown]) -> Floats:
    """(P,) [SI] the unit in which each unknown counts."""
    return np.array([unknown.parameter.scale for unknown in unknowns])


def prior_rows(unknowns: Sequence[Unknown]) -> Floats:
    """(P, P) diagonal: scale over standard deviation of the unknowns with a prior, 0 else."""
    return np.diag([0.0 if u.prior is None else u.parameter.scale / u.prior for u in unknowns])


def prior_weight(factor: float) -> float:
    """What rows of priors count by, beside readings whose variance is ``factor`` times the assumed one: however exact
    those are, priors choose among values that predict the same."""
    return float(np.sqrt(max(factor, EXACT)))


def reach(campaign: Campaign, point: Point, unknowns: Sequence[Unknown]) -> tuple[Floats, Floats]:
    """(P + U,) each: the lowest and the highest step of unknowns, in their scales, and of nuisances from ``point``."""
    scale, values = scales(unknowns), point.values(unknowns)
    low = np.concatenate(
        [
            (np.array([u.parameter.lower for u in unknowns]) - values) / scale,
            np.full(len(campaign.nuisance_names), -np.inf),
        ]
    )
    high = np.concatenate(
        [
            (np.array([u.parameter.upper for u in unknowns]) - values) / scale,
            np.full(len(campaign.nuisance_names), np.inf),
        ]
    )
    if campaign.scaled:
        low[-1], high[-1] = -LARGEST_SCALE - point.nuisances.scale, LARGEST_SCALE - point.nuisances.scale
    return low, high


def prior_equations(
    campaign: Campaign, point: Point, unknowns: Sequence[Unknown], factor: float
) -> tuple[Floats, Floats]:
    """Rows (k, P + U) of the priors of unknowns and nuisances, and what they ask for from ``point`` (k,), in standard
    deviations; ``factor`` as of ``descended``."""
    prior, scale = prior_rows(unknowns), scales(unknowns)
    known, offset = campaign.nuisance_prior(point.nuisances)
    wanted = np.array([u.value for u in unknowns])
    rows = np.block(
        [[prior, np.zeros((len(prior), known.shape[1]))], [np.zeros((len(known), len(prior))), known]]
    )
    asked = np.concatenate([prior @ ((wanted - point.values(unknowns)) / scale), offset])
    return rows * prior_weight(factor), asked * prior_weight(factor)


def bounded_step(
    matrix: Floats, target: Floats, low: Floats, high: Floats, parameters: int, careful: float = 0.0
) -> Floats:
    """(k,) least squares of ``matrix`` (n, k) @ step - ``target`` (n,) between ``low`` and ``high`` (k,), damped by a
    share of each column's length; the first ``parameters`` of k are not tracker and targets."""
    length = np.linalg.norm(matrix, axis=0)
    length[length == 0] = 1.0
    damping = np.maximum(np.repeat([DAMPING, LOOSE], [parameters, len(length) - parameters]), careful)
    # many rows to as many as there are columns, with the same information
    tall = np.block([[matrix / length, target[:, None]], [np.diag(damping), np.zeros((len(length), 1))]])
    reduced = np.asarray(np.linalg.qr(tall, mode="r"))
    system, right = reduced[:-1, :-1], reduced[:-1, -1]
    step = np.linalg.lstsq(system, right, rcond=None)[0]
    low, high = low * length, high * length
    if np.any(step < low) or np.any(step > high):
        step = bounded_least_squares(system, right, np.minimum(low, 0.0), np.maximum(high, 0.0))
    return np.asarray(step / length)


class Linearized(NamedTuple):
    """A linear problem: ``whitened`` columns (n, k) of readings and ``rows`` (p, k) of priors.  Where columns serve for
    many problems they are ``rotation`` (n, k) times ``reduced`` (k, k); None where they do not."""

    whitened: Floats
    rows: Floats
    rotation: Floats
    reduced: Floats | None

    def step(self, target: Floats, within: tuple[Floats, Floats], parameters: int, careful: float) -> Floats:
        """(k,) as of ``bounded_step`` for ``target`` (n + p,), ``within`` the lowest and the highest (k,) each."""
        if self.reduced is None:
            return bounded_step(
                np.concatenate([self.whitened, self.rows]), target, *within, parameters, careful
            )
        count = len(self.whitened)
        short = np.concatenate([self.rotation.T @ target[:count], target[count:]])
        return bounded_step(np.concatenate([self.reduced, self.rows]), short, *within, parameters, careful)


def descended(
    campaign: Campaign,
    point: Point,
    unknowns: Sequence[Unknown],
    weights: Weighting,
    keep_columns: bool = False,
    max_steps: int = MAX_STEPS,
    factor: float = 1.0,
    close: float = CLOSE,
) -> Point:
    """The least squares of ``weights(residual)`` and the priors, from ``point``.

    ``keep_columns``: those of ``point`` serve all through, for fits that end close by.  ``factor``: variance of the
    readings over the one of ``weights``; priors count the more against it.  Each linear problem is solved within the
    bounds; steps are halved until the squares fall.  ``close``: step that is the last, in standard deviations of a
    reading.
    """
    scale = scales(unknowns)

    def residuals(candidate: Point) -> tuple[Floats, int]:
        asked = prior_equations(campaign, candidate, unknowns, factor)[1]
        lost = (weights.weight > 0) & ~np.isfinite(candidate.residual)
        return np.concatenate([weights(candidate.residual), asked]), int(lost.sum())

    residual, lost = residuals(point)
    fresh, careful = point.columns is not None, 0.0
    whitened = rotation = reduced = np.empty((0, 0))
    for _ in range(max_steps):
        if not fresh or not len(whitened):
            point = point if fresh else with_columns(campaign, point, unknowns)
            fresh = True
            whitened = np.nan_to_num(
                np.concatenate([weights(part) for part in point.required_columns], axis=1)
            )
            # columns that serve all through are reduced once
            rotation, reduced = np.linalg.qr(whitened) if keep_columns else (rotation, whitened)
        rows = prior_equations(campaign, point, unknowns, factor)[0]
        matrix = np.concatenate([whitened, rows])
        if matrix.shape[1] == 0:
            return replace(point, settled=True)
        # a column of nothing may grow with the others, however straight their path is
        awake = matrix[:, : len(scale)].any(axis=0)
        linear = Linearized(whitened, rows, rotation, reduced if keep_columns else None)
        whole = linear.step(residual, reach(campaign, point, unknowns), len(scale), careful)
        share, moved, after, gone = 1.0, point, residual, lost
        freedom = max(1, len(residual) - matrix.shape[1])
        # where there is nothing to gain no part of the step is tried either
        ending = np.linalg.norm(matrix @ whole) < close * np.sqrt(residual @ residual / freedom)
        for _ in range(1 if ending else 12):
            moved = _stepped(campaign, point, unknowns, share * whole, scale)
            after, gone = residuals(moved)
            if gone <= lost and after @ after <= residual @ residual * (1 + 1e-12):
                break
            share *= 0.5
        else:
            return replace(point, settled=True)
        foreseen = matrix @ (share * whole)
        size = float(np.linalg.norm(foreseen))
        astray = float(np.linalg.norm(residual - foreseen - after))
        fresh = keep_columns or (share == 1.0 and astray < STRAIGHT * size and bool(awake.all()))
        # a step that went astray went too far along what is hardly observable (Levenberg)
        curved = share < 1.0 or astray > CURVED * size
        careful = min(max(30.0 * careful, CAREFUL), 0.1) if curved else careful / 10.0
        scatter = np.sqrt(after @ after / freedom)
        point, residual, lost = moved, after, gone
        if share == 1.0 and (size < close * scatter or size <= 1e-9):
            return replace(point, settled=True)
    return point


def _stepped(
    campaign: Campaign, point: Point, unknowns: Sequence[Unknown], step: Floats, scale: Floats
) -> Point:
    count = len(unknowns)
    values = point.values(unknowns) + step[:count] * scale
    bounded = {
        u.key: float(np.clip(value, u.parameter.lower, u.parameter.upper))
        for u, value in zip(unknowns, values, strict=True)
    }
    model = point.model.with_values(bounded) if bounded else point.model
    moved = at(campaign, model, campaign.moved(point.nuisances, step[count:]), point.predicted.displacement)
    return replace(moved, columns=point.columns, nuisance=point.nuisance)
