"""Readings that belong to nothing: a broken beam, a reflector mistaken for another, a wrong row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.identification.fit import Fit, fit, lengths, spread_of

CHANCE = 0.01
"""Probability that among all readings of a campaign without outliers any is reported as one."""

CLEARLY = 0.2
"""With an explanation at most this share remains of what there is without it."""


MANY = 2000
"""Readings from which on no robust fit is needed to detect a few outliers."""


@dataclass(frozen=True)
class Outlier:
    """A reading ``distance`` [m] from where it should be, ``sigmas`` of its scatter; ``what`` it may be, in words."""

    row: int
    file: str
    line: int
    distance: float
    sigmas: float
    what: str


def outliers(fitted: Fit, rows: Bools) -> tuple[tuple[Outlier, ...], Fit]:
    """The outliers among ``rows`` (R,) of a campaign, worst first, and the fit that detects them: a robust one where
    the least squares look as if there were any, else ``fitted``.

    The scatter is that of most readings (by the median), so that a model in which something is missing does not make
    outliers of all that it does not explain.
    """
    length, _, limit = _lengths(fitted, rows)
    # a fit pulls an outlier towards it by its leverage, in the mean the share of unknowns in the readings
    share = (len(fitted.unknowns) + len(fitted.campaign.nuisance_names)) / max(fitted.weights.counts, 1)
    if not np.any(rows & (length > max(0.7, 1.0 - 5.0 * share) * limit)):
        return (), fitted
    campaign = fitted.campaign
    # thousands of readings a few do not pull
    robust = fitted
    if len(campaign) <= MANY:
        robust = fit(
            campaign, fitted.start, fitted.asked, rows, robust=True, nuisances=fitted.point.nuisances
        )
    length, level, limit = _lengths(robust, rows)
    entries = []
    for row in np.flatnonzero(rows & (length > limit)):
        file, line = campaign.readings.where(int(row))
        distance = float(np.linalg.norm(np.nan_to_num(robust.point.residual[row, :3])))
        what = _explained(robust, int(row), limit)
        entries.append(Outlier(int(row), file, line, distance, float(length[row] / level), what))
    return tuple(sorted(entries, key=lambda o: -o.sigmas)), robust


def _limit(count: int) -> float:
    """Length of a residual [its standard deviation] that one of ``count`` normal ones in space exceeds by chance."""
    from scipy.special import chdtri

    return float(np.sqrt(chdtri(3, 1.0 - (1.0 - CHANCE) ** (1.0 / max(count, 1)))))


def _lengths(fitted: Fit, rows: Bools) -> tuple[Floats, float, float]:
    """Length of each residual [assumed standard deviations] (R,), one standard deviation of most, and the length from
    which on a reading is an outlier."""
    length = lengths(fitted.point.residual, fitted.plain_weights)
    level, limit = spread_of(length[rows], fitted.noise.known), _limit(int(rows.sum()))
    if level == 1.0:
        return length, level, limit
    # a median of n lengths has a relative deviation of 0.56 / sqrt(n), by which tails beyond the limit are heavier
    pose = fitted.campaign.pose[rows]
    count = len(pose) if fitted.plain_weights.shared == 0 else len(np.unique(pose))
    return length, level, limit * level * (1.0 + 0.5 * (0.56 * limit) ** 2 / count)


def _explained(fitted: Fit, row: int, limit: float) -> str:
    """What the reading ``row`` fits better, in words."""
    campaign, readings = fitted.campaign, fitted.campaign.readings
    sigma = float(fitted.noise.sigma[row])
    expected, _ = campaign.expected(fitted.point.predicted, fitted.point.nuisances)
    measured = readings.value[row]
    here = float(np.linalg.norm(measured - expected[row]))
    close = max(limit * sigma, CLEARLY * here * 0.1)
    same = (campaign.at == campaign.at[row]) & (np.arange(len(campaign)) != row)
    away = np.linalg.norm(measured - expected, axis=1)
    names = campaign.targets
    others = np.flatnonzero(same & (readings.target != readings.target[row]) & (away < close))
    if len(others):
        other = others[np.argmin(away[others])]
        return (
            f"fits target {names[readings.target[other]]} (line {readings.where(int(other))[1]}) instead of"
            f" {names[readings.target[row]]}: are they mistaken for each other?"
        )
    if readings.deflection and np.linalg.norm(measured + expected[row]) < close:
        return "fits with the opposite sign: is it unloaded minus loaded?"
    for a, b in ((0, 1), (0, 2), (1, 2)):
        turned = measured.copy()
        turned[[a, b]] = turned[[b, a]]
        if np.linalg.norm(turned - expected[row]) < close:
            return f"fits with {'XYZ'[a]} and {'XYZ'[b]} exchanged"
    # last, because of so many one may fit by chance
    rest = ~same & (np.arange(len(campaign)) != row) & (campaign.pose != campaign.pose[row]) & (away < close)
    if rest.any() and _distinct(expected, campaign.pose, close):
        other = int(np.argmin(np.where(rest, away, np.inf)))
        return f"fits the state of line {readings.where(other)[1]}: is the row in the wrong place?"
    return "fits no other value: was the beam interrupted, or a joint at another angle than in the row?"


def _distinct(expected: Floats, pose: Ints, close: float) -> bool:
    """Whether places are far enough apart for a coincidence to be significant: few pairs of poses are as close as
    ``close``."""
    some = np.linspace(0, len(expected) - 1, min(len(expected), 200)).astype(int)
    apart = np.linalg.norm(expected[some][:, None] - expected[some][None], axis=2)
    others = pose[some][:, None] != pose[some][None]
    return bool((apart[others] < close).mean() < 0.05)
