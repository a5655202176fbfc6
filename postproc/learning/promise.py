"""What the next program promises: the error that remains where a point was not measured, with an interval.

    V = P (K_f - K_f K^-1 K_f) P,   K_f: causes and field,   P: takes the freedoms of the alignment out
    v_i = V_ii + (P K_f K^-1)_ii^2 / (K^-1)_ii + scatter^2

v_i: of a measured place without its own measurement, which is taken out of K again (one row: C. E. Rasmussen, C. K. I.
Williams: Gaussian Processes for Machine Learning, MIT Press 2006, eq. 5.12); few points know themselves well and their
surroundings badly.  The covariance believes its own assumptions; parts that were cut by other physics have errors
larger by about ``HOPE`` (``python -m tests.blind_parts``), and the upper end of the interval is ``UPPER`` of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.learning.attribution import Attribution
from postproc.learning.covariance import SCATTER, Explanation

HOPE, UPPER, LOWER = 1.1, 3.0, 0.38
"""Ratios: what remains to what the covariance says, and the ends of its 95 % interval."""

STAYS = 0.3
"""Half width of the 95 % interval of an error that is not corrected, as a share of it: what a force is known to."""


@dataclass(frozen=True)
class Promise:
    """RMS [m] at places like the measured ones, without the scatter of the probe: ``before`` as measured; ``after``,
    with the ends ``lower`` and ``upper`` of its 95 % interval."""

    before: float
    after: float
    lower: float
    upper: float

    @property
    def better(self) -> bool:
        """Whether the next part is expected to be better by more than it may be worse."""
        return self.after < 0.9 * self.before

    def with_remaining(self, error: Floats, free: Floats) -> Promise:
        """The same where ``error`` (J,) [m] of the places of the part that was cut last stays beside what is not known;
        free (J, A): freedoms of the alignment."""
        left = float(np.sqrt(np.mean(aligned(error, alignment_basis(free)) ** 2)))
        ends = ((self.after, 1.0), (self.lower, 1.0 - STAYS), (self.upper, 1.0 + STAYS))
        after, lower, upper = (float(np.hypot(end, by * left)) for end, by in ends)
        return Promise(self.before, after, lower, upper)

    def with_uncorrected(self, error: Floats, corrected: Bools, free: Floats) -> Promise:
        """The same of a program that does not correct all places (J,) of the part that was cut last: ``error`` (J,) [m]
        of those that are not ``corrected`` (J,) stays; free (J, A): freedoms of the alignment.

            after^2 = share of corrected places * after^2 + mean(stays^2)
        """
        share = np.sqrt(float(np.mean(corrected)))
        less = Promise(self.before, share * self.after, share * self.lower, share * self.upper)
        return less.with_remaining(np.where(corrected, 0.0, error), free)


def promise(result: Attribution, last: Bools, gain: float = 1.0) -> Promise:
    """What remains on a part like those at the points ``last`` (K,), the part that was cut last, if ``gain`` of all
    that was learnt is applied."""
    own = np.flatnonzero(last[result.kept])
    rows, taken = result.kept_rows[own], alignment_basis(result.layout.free[result.kept_rows[own]])
    variance = (
        held_out_variance(result.explained, own, taken) + (SCATTER * result.explained.by_force[own]) ** 2
    )
    # where it is not known whether an effect acts, it may or may not on the next part
    variance += result.explained.layout.sigma[own] ** 2 - result.layout.sigma[rows] ** 2
    withheld = (1 - gain) * (result.by_learning + result.by_field)[rows]
    after = float(np.sqrt(HOPE**2 * np.mean(variance) + np.mean(aligned(withheld, taken) ** 2)))
    return Promise(measured_rms(result, last), after, LOWER * after, UPPER * after)


def held_out_variance(explained: Explanation, own: Ints, basis: Floats) -> Floats:
    """(J,) [m2] of causes and field at the points ``own`` (J,), each without its own measurement, after the alignment
    of all J by the orthonormal columns ``basis`` (J, A)."""
    prior = explained.columns @ explained.columns.T + explained.layout.field(explained.surface)
    follows = prior @ explained.inverse

    remains = aligned((prior - follows @ prior)[np.ix_(own, own)], basis)
    remains = remains - (remains @ basis) @ basis.T
    itself = np.diag(aligned(follows[np.ix_(own, own)], basis)) ** 2 / np.diag(explained.inverse)[own]
    return np.asarray(np.maximum(np.diag(remains), 0.0) + itself)


def measured_rms(result: Attribution, of: Bools) -> float:
    """[m] root mean square of the deviations of the points ``of`` (K,) that are no outliers, after the best alignment
    of the freedoms that were fitted and without the scatter of the probe; 0 without points."""
    own = np.flatnonzero(of[result.kept])
    if not len(own):
        return 0.0
    layout = result.layout.part(result.kept_rows)
    rest = aligned(result.deviation[result.kept_rows[own]], alignment_basis(layout.free[own]))
    return float(np.sqrt(max(float(np.mean(rest**2)) - float(np.mean(layout.sigma[own] ** 2)), 0.0)))


def alignment_basis(free: Floats) -> Floats:
    """(J, A) orthonormal columns of the freedoms (J, A) that the alignment of these points takes out."""
    own = free[:, np.abs(free).any(axis=0)]
    return np.linalg.qr(own)[0] if own.shape[1] else np.zeros((len(free), 0))


def aligned(values: Floats, basis: Floats) -> Floats:
    """(J, ...) values (J, ...) without what the orthonormal columns ``basis`` (J, A) of an alignment take out."""
    return np.asarray(values - basis @ (basis.T @ values))
