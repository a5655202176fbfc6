"""A push test: a weight or a scale and a dial at some poses, which separates compliances from forces.

The displacements d = x(q, w) - x(q, 0) under known forces have the elastic parameters as their only causes.
Gauss-Newton to the maximum a posteriori gives their mean and covariance, with which the part is then explained:

    P = (D^-2 + sum S^T S / s^2)^-1,   S: derivatives of d by the causes
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.learning.causes import CauseKind, CausePrediction
from postproc.measurements import Readings

ROUNDS = 4
CONTRADICTS = 3.0
"""Times their scatter by which readings may remain."""

LEAST = 3
"""Readings of a push test."""


def with_push_test(prediction: CausePrediction, readings: Readings) -> CausePrediction:
    """The prediction with what a push test says of its elastic parameters.  Raises Refusal LRN001."""
    file = str(readings.files[0])
    if not readings.deflection:
        message = "a push test has the columns DX,DY,DZ: the displacement from without load to under load"
        raise Refusal(Finding("LRN001", message, file))
    if len(readings) < LEAST or not readings.wrench.any(axis=1).all():
        message = f"a push test needs at least {LEAST} readings, each with a force (FX, FY, FZ)"
        raise Refusal(Finding("LRN001", message, file))
    if not np.isfinite(readings.sigma).all():
        help = "add # sigma_mm: 0.01, the standard deviation of the dial"
        raise Refusal(Finding("LRN001", "the scatter of the push test is missing", file, help=help))
    if readings.places:
        message = (
            "a push test reads the tool centre point; targets elsewhere on the flange are not known here"
        )
        raise Refusal(Finding("LRN001", message, file))
    shares = [i for i, cause in enumerate(prediction.causes) if cause.kind is CauseKind.SHARE]
    weight = 1.0 / np.repeat(readings.sigma, 3)
    seen = np.isfinite(readings.value).ravel()
    weight[~seen] = 0.0
    measured = np.nan_to_num(readings.value).ravel()
    prior = np.diag(1.0 / prediction.deviations[shares] ** 2)
    x = np.zeros(len(prediction.causes))
    normal = prior
    for _ in range(ROUNDS):
        rest, columns = _linearised(prediction, readings, x, shares, measured)
        scaled = columns * weight[:, None]
        normal = prior + scaled.T @ scaled
        step = np.linalg.solve(normal, scaled.T @ (rest * weight) - prior @ x[shares])
        x[shares] += step
        x = prediction.bounded(x)
    rest, _ = _linearised(prediction, readings, x, shares, measured)
    size = float(np.sqrt(np.sum((rest * weight) ** 2) / max(int(seen.sum()), 1)))
    if size > CONTRADICTS:
        message = f"the compliances cannot explain the push test: {size:.1f} times its scatter remains"
        help = "check forces (N), displacements (mm, robot base) and joint values (deg) of its rows"
        raise Refusal(Finding("LRN001", message, file, help=help))
    root = np.diag(prediction.deviations)
    root[np.ix_(shares, shares)] = np.linalg.cholesky(np.linalg.inv(normal))
    return replace(prediction, mean=x, root=root)


def _linearised(
    prediction: CausePrediction, readings: Readings, x: Floats, shares: list[int], measured: Floats
) -> tuple[Floats, Floats]:
    """What remains (3R,) [m] of R readings at the causes ``x`` (P,), and the derivatives (3R, S) by the shares."""
    columns = []
    for number in shares:
        ends = []
        for sign in (-1.0, 1.0):
            moved = x.copy()
            moved[number] += 0.005 * sign
            ends.append(_displacements(prediction, readings, moved))
        columns.append((ends[1] - ends[0]) / 0.01)
    return measured - _displacements(prediction, readings, x), np.stack(columns, axis=1)


def _displacements(prediction: CausePrediction, readings: Readings, x: Floats) -> Floats:
    """(3R,) [m] from without load to under load, robot base axes."""
    model = prediction.model_at(x)
    tool = Poses.identity() if readings.tool is None else readings.tool
    ends = [model.equilibrium(readings.q, wrench, tool) for wrench in (0 * readings.wrench, readings.wrench)]
    return np.asarray((ends[1].pose.position - ends[0].pose.position).ravel())
