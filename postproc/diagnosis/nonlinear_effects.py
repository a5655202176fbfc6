"""Effects that do not grow in proportion: their columns where they are as large as the readings ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.identification.bounded import bounded_least_squares
from postproc.identification.campaign import Campaign
from postproc.identification.least_squares import Point, at, displacement_in, scales, with_columns
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

STEPS = 8

SAME = 1e-3
"""Share of the remaining squares by which a step must gain to be followed by another."""

STRAIGHT = 0.01
"""Share of a step's effect that may come otherwise than foreseen, where another step gains nothing more."""

ROUGH = 1e-11
"""[rad, m] What may remain of the displacement to an equilibrium while a size is searched for."""

DAMPING = 1e-3
"""Of a column's length."""

Outside = Callable[[Floats], Floats]
"""Columns (R, 3 or 6, p), whitened, without what is explained anyway (n, p)."""


class NonlinearColumns(NamedTuple):
    """values (P,) [SI]; columns (R, 3 or 6, P) there, per scale; target (n,), remaining (n,): what there is to explain,
    outside of what is explained anyway, without the effect and with it."""

    values: Floats
    columns: Floats
    target: Floats
    remaining: Floats


def evaluate_at_size(
    campaign: Campaign,
    point: Point,
    model: StiffnessModel,
    unknowns: Sequence[Unknown],
    outside: Outside,
) -> NonlinearColumns:
    """``unknowns`` of ``model`` (that of ``point`` with an effect at its null) as large as explains the most of what
    ``point`` leaves.

    Gauss-Newton from the usual size within the bounds, on what is outside of what is explained anyway; then
    ``whole``, so that columns times values are what the effect does.
    """
    scale, null = scales(unknowns), np.array([u.parameter.null for u in unknowns])
    low = (np.array([u.parameter.lower for u in unknowns]) - null) / scale
    high = (np.array([u.parameter.upper for u in unknowns]) - null) / scale
    target = outside(point.residual[:, :, None])[:, 0]

    def evaluate(x: Floats, start: Floats) -> tuple[Point, Floats]:
        values = {u.key: v for u, v in zip(unknowns, (null + x * scale).tolist(), strict=True)}
        there = at(campaign, model.with_values(values), point.nuisances, start, ROUGH)
        does = np.nan_to_num(point.residual - there.residual)
        return there, does

    x = np.clip(np.ones(len(unknowns)), low, high)
    there, does = evaluate(x, displacement_in(model, point))
    remaining = target - outside(does[:, :, None])[:, 0]
    for _ in range(STEPS):
        there = with_columns(campaign, there, unknowns)
        matrix = outside(np.nan_to_num(there.required_columns[0]))
        step, before = _step(matrix, remaining, low - x, high - x), remaining @ remaining
        for _ in range(6):
            trial = np.clip(x + step, low, high)
            moved, did = evaluate(trial, there.predicted.displacement)
            rest = target - outside(did[:, :, None])[:, 0]
            if rest @ rest < before:
                break
            step = 0.3 * step
        else:
            break
        foreseen = matrix @ (trial - x)
        astray = remaining - foreseen - rest
        x, there, does, remaining = trial, moved, did, rest
        straight = astray @ astray < STRAIGHT**2 * (foreseen @ foreseen)
        if straight or before - remaining @ remaining < SAME * before:
            break
    if there.columns is None:
        there = with_columns(campaign, there, unknowns)
    return NonlinearColumns(
        null + x * scale, broyden_update(np.nan_to_num(there.required_columns[0]), does, x), target, remaining
    )


def _step(matrix: Floats, remaining: Floats, low: Floats, high: Floats) -> Floats:
    """(P,) least squares of ``matrix`` (n, P) @ step - ``remaining`` (n,) between ``low`` and ``high`` (P,)."""
    damping = DAMPING * np.diag(np.linalg.norm(matrix, axis=0) + 1e-9)
    tall = np.block([[matrix, remaining[:, None]], [damping, np.zeros((len(low), 1))]])
    # many rows to as many as there are columns, with the same information
    reduced = np.asarray(np.linalg.qr(tall, mode="r"))
    step = np.linalg.lstsq(reduced[:-1, :-1], reduced[:-1, -1], rcond=None)[0]
    if np.any(step < low) or np.any(step > high):
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        step = bounded_least_squares(reduced[:-1, :-1], reduced[:-1, -1], low, high)
    return np.asarray(step)


def broyden_update(columns: Floats, does: Floats, values: Floats) -> Floats:
    """(R, k, P): the ``columns`` (R, k, P) nearest to those given for which columns times ``values`` (P,) is ``does``
    (R, k): the rank-one update of Broyden."""
    square = float(values @ values)
    if square == 0.0:
        return columns
    return np.asarray(columns + (does - columns @ values)[:, :, None] * (values / square))
