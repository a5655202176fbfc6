"""The points of a part worth measuring: those with the most information on the errors of the whole surface.

Errors f of M points have the covariance K = S D^2 S^T + field before a measurement; a probe reads f with its scatter,
after an alignment that adds free columns A.  Points are chosen one after another, each the one that takes most from the
mean variance of f (greedy A-optimal design; A. C. Atkinson, A. N. Donev, R. D. Tobias: Optimum Experimental Designs,
with SAS, Oxford University Press 2007, ch. 10):

    gain_i = sum_j C_ji^2 / (G_ii + s^2),   C = cov(f, f + A a),   G = cov(f + A a)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Ints
from postproc.learning.causes import CausePrediction
from postproc.learning.covariance import Layout, SmoothField

FIELD = SmoothField(20e-6, 0.06)
"""The smooth error that is expected where nothing is known of it."""


@dataclass(frozen=True)
class PointPlan:
    """chosen (N,): numbers of the points, the most informative first; ``before``, ``after`` [m]: RMS of the errors that
    the surface may have, before and after they are measured."""

    chosen: Ints
    before: float
    after: float


def plan_points(prediction: CausePrediction, layout: Layout, count: int) -> PointPlan:
    """``count`` points of those of the prediction (M)."""
    zero = np.zeros(len(prediction.causes))
    columns = prediction.columns(zero) * prediction.deviations
    prior = columns @ columns.T + layout.field(FIELD)
    cross, own = prior.copy(), prior + layout.free @ layout.free.T
    noise = layout.sigma**2
    chosen: list[int] = []
    variance = np.diag(prior).copy()
    for _ in range(min(count, len(noise))):
        spread = np.maximum(np.diag(own), 0.0) + noise
        gain = np.sum(cross**2, axis=0) / spread
        gain[chosen] = -1.0
        best = int(np.argmax(gain))
        chosen.append(best)
        variance -= cross[:, best] ** 2 / spread[best]
        to_f, to_g = cross[:, best].copy(), own[:, best].copy()
        cross -= np.outer(to_f, to_g) / spread[best]
        own -= np.outer(to_g, to_g) / spread[best]
    return PointPlan(
        np.array(chosen),
        float(np.sqrt(np.mean(np.diag(prior)))),
        float(np.sqrt(np.mean(np.maximum(variance, 0.0)))),
    )
