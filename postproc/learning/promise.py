"""What the next program promises: the error that remains at the measured points, with an interval.

    V = P (K_f - K_f K^-1 K_f) P + scatter,   K_f: causes and field,   P: takes the freedoms of the alignment out

The covariance believes its own assumptions; parts that were cut by other physics have errors larger by about
``HOPE`` (``python -m tests.blind_parts``), and the upper end of the interval is ``UPPER`` of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats
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


def promise(result: Attribution, gain: float = 1.0) -> Promise:
    """What remains if ``gain`` of all that was learnt is corrected."""
    explained, layout = result.explained, result.explained.layout
    prior = explained.columns @ explained.columns.T + layout.field(explained.surface)
    known = prior - prior @ explained.inverse @ prior
    taken = np.linalg.qr(layout.free)[0] if layout.free.shape[1] else np.zeros((len(prior), 0))
    remains = known - taken @ (taken.T @ known)
    remains = remains - (remains @ taken) @ taken.T
    scatter = SCATTER * explained.by_force
    variance = np.maximum(np.diag(remains), 0.0) + scatter**2
    found = _aligned(result.by_causes[result.kept] + result.by_field[result.kept], taken)
    measured = _aligned(result.deviation[result.kept], taken)
    noise = float(np.mean(layout.sigma**2))
    before = float(np.sqrt(max(float(np.mean(measured**2)) - noise, 0.0)))
    after = float(np.sqrt(HOPE**2 * np.mean(variance) + np.mean(((1 - gain) * found) ** 2)))
    return Promise(before, after, LOWER * after, UPPER * after)


def _aligned(values: Floats, taken: Floats) -> Floats:
    return np.asarray(values - taken @ (taken.T @ values))
