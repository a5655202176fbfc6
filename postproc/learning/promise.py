"""What the next program promises: the error that remains at the measured points, with an interval.

    V = P (K_f - K_f K^-1 K_f) P + scatter,   K_f: causes and field,   P: takes the freedoms of the alignment out

The covariance believes its own assumptions; parts that were cut by other physics have errors larger by about
``HOPE`` (``python -m tests.blind_parts``), and the upper end of the interval is ``UPPER`` of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.learning.attribution import Attribution
from postproc.learning.covariance import SCATTER

HOPE, UPPER, LOWER = 1.1, 3.0, 0.38
"""Ratios: what remains to what the covariance says, and the ends of its 95 % interval."""


@dataclass(frozen=True)
class Promise:
    """RMS [m] at the measured points without the scatter of the probe: ``before`` as measured; ``after``, with the ends
    ``lower`` and ``upper`` of its 95 % interval."""

    before: float
    after: float
    lower: float
    upper: float

    @property
    def better(self) -> bool:
        """Whether the next part is expected to be better by more than it may be worse."""
        return self.after < 0.9 * self.before


def promise(result: Attribution, last: Bools, gain: float = 1.0) -> Promise:
    """What remains on a part like those at the points ``last`` (K,), the part that was cut last, if ``gain`` of all
    that was learnt is applied."""
    explained, layout = result.explained, result.explained.layout
    own = np.flatnonzero(last[result.kept])
    rows = result.kept_rows[own]
    prior = explained.columns @ explained.columns.T + layout.field(explained.surface)
    known = (prior - prior @ explained.inverse @ prior)[np.ix_(own, own)]
    taken = _taken(layout.free[own])
    remains = known - taken @ (taken.T @ known)
    remains = remains - (remains @ taken) @ taken.T
    scatter = SCATTER * explained.by_force[own]
    variance = np.maximum(np.diag(remains), 0.0) + scatter**2
    withheld = (1 - gain) * (result.by_learning + result.by_field)[rows]
    after = float(np.sqrt(HOPE**2 * np.mean(variance) + np.mean(_aligned(withheld, taken) ** 2)))
    return Promise(measured_rms(result, last), after, LOWER * after, UPPER * after)


def measured_rms(result: Attribution, of: Bools) -> float:
    """[m] root mean square of the deviations of the points ``of`` (K,) that are no outliers, after the best alignment
    of the freedoms that were fitted and without the scatter of the probe; 0 without points."""
    own = np.flatnonzero(of[result.kept])
    if not len(own):
        return 0.0
    layout = result.explained.layout
    aligned = _aligned(result.deviation[result.kept_rows[own]], _taken(layout.free[own]))
    return float(np.sqrt(max(float(np.mean(aligned**2)) - float(np.mean(layout.sigma[own] ** 2)), 0.0)))


def _taken(free: Floats) -> Floats:
    """(J, A) orthonormal columns of the freedoms (J, A) that the alignment of these points takes out."""
    own = free[:, np.abs(free).any(axis=0)]
    return np.linalg.qr(own)[0] if own.shape[1] else np.zeros((len(free), 0))


def _aligned(values: Floats, taken: Floats) -> Floats:
    return np.asarray(values - taken @ (taken.T @ values))
