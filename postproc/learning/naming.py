"""How much likelier deviations are with an effect than without it, and which effects explain them about as well.

With K the covariance of the deviations r without the effect, C its columns (m per standard deviation) and f its size,

    ln p(r | f) - ln p(r) = (b^T M^-1 b - ln |M|) / 2,   M = 1 + f^2 C^T K^-1 C,   b = f C^T K^-1 r

(Sylvester), averaged over the sizes: the mean pays for sizes that do not fit, as a maximum would not.  A parameter that
has no negative values has half of the normal distribution before, and its share above null after: ln(2 Phi(mean /
deviation)).  Effects are named by their probability among those that were looked for, all equally probable before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr, logsumexp

from postproc.base.arrays import Bools, Ints
from postproc.learning.candidates import FACTORS, MissingEffect
from postproc.learning.covariance import Explanation, choose_surface, without_field
from postproc.learning.excluded_points import MOST_OUTLIERS, OUTLIERS_EACH, find_outliers

TOUCHED = 3.0
"""An effect acts on a point where one standard deviation of it is so many times the scatter of the probe."""

NAMED = float(np.log(100.0))
"""Logarithm: how much likelier the deviations are with an effect that is named than without it; some twenty are looked
for."""

SURE = 0.95
"""Probability of an effect that is named among all, and of a set of effects which the part does not distinguish."""

REFINED = 4
"""The likeliest effects are compared with the smooth error that fits best beside each."""


@dataclass(frozen=True, eq=False)
class WeighedEffect:
    """``effect``; ``gain``: logarithm of how much likelier the deviations are with it; ``factor``: the size that fits
    best, in its standard deviations; kept (K,): points that are no outliers with it."""

    effect: MissingEffect
    gain: float
    factor: float
    kept: Bools


def weigh_effects(
    explained: Explanation, everything: Explanation, offered: Sequence[MissingEffect], kept: Bools
) -> list[WeighedEffect]:
    """The effects ``offered``, the likeliest first; kept (K,): points that are no outliers without
    them; everything: all K points.

    An outlier that an effect acts on may be none with it: points in corners, say, where only a force in corners shows.
    """
    starts = explained, without_field(explained)
    noise = float(np.median(everything.layout.sigma))
    present: dict[str, float] = {}

    def weighed(effect: MissingEffect, points: Bools, start: Explanation) -> WeighedEffect:
        gains = gains_with(start, effect, np.flatnonzero(points))
        gain = start.evidence + _outside(points) + float(logsumexp(gains) - np.log(len(gains)))
        return WeighedEffect(effect, gain - present[effect.name], FACTORS[int(np.argmax(gains))], points)

    found = []
    for effect in offered:
        present[effect.name] = explained.evidence + _outside(kept)
        more = (np.abs(effect.columns).max(axis=1) > TOUCHED * noise) & ~kept
        options = [(kept, start) for start in starts]
        if more.any():
            points = _kept_with(everything, effect, kept | more)
            own = everything.part(np.flatnonzero(points))
            bare = own, without_field(own)
            options += [(points, start) for start in bare]
            # points that are no outliers without the effect have no information on it either
            with_them = max(one.evidence for one in bare) + _outside(points)
            present[effect.name] = max(present[effect.name], with_them)
        found.append(max((weighed(effect, *one) for one in options), key=lambda one: one.gain))
    found = _averaged_widths(found)
    for i, one in enumerate(found[:REFINED]):
        rows = np.flatnonzero(one.kept)
        own = explained if one.kept is kept else everything.part(rows)
        with_it = own.with_noise(one.effect.column_sigma_at(rows, one.factor))
        full = choose_surface(with_it.with_columns(one.factor * one.effect.columns[rows]), 1)
        again = weighed(one.effect, one.kept, own.with_surface(full.surface))
        found[i] = replace(again, gain=max(one.gain, again.gain))
    return sorted(found, key=lambda one: -one.gain)


def _averaged_widths(weighed: Sequence[WeighedEffect]) -> list[WeighedEffect]:
    """One entry a name, the likeliest first: an effect that was tried with two widths of a gap has their mean."""
    by_name: dict[str, list[WeighedEffect]] = {}
    for one in weighed:
        by_name.setdefault(one.effect.name, []).append(one)
    found = []
    for same in by_name.values():
        gain = float(logsumexp([one.gain for one in same]) - np.log(len(same)))
        found.append(replace(max(same, key=lambda one: one.gain), gain=gain))
    return sorted(found, key=lambda one: -one.gain)


def _outside(kept: Bools) -> float:
    """Logarithm of the probability of the outliers."""
    return OUTLIERS_EACH * int((~kept).sum())


def _kept_with(everything: Explanation, effect: MissingEffect, kept: Bools) -> Bools:
    """(K,) those of the points ``kept`` (K,) that the causes and the effect do not contradict."""
    rows = np.flatnonzero(kept)
    part = everything.part(rows).with_noise(effect.column_sigma_at(rows, max(FACTORS)))
    with_it = part.with_columns(max(FACTORS) * effect.columns[rows])
    out = find_outliers(with_it, int(MOST_OUTLIERS * len(kept)) - int((~kept).sum()))
    found = kept.copy()
    found[rows[out]] = False
    return found


def gains_with(explained: Explanation, effect: MissingEffect, rows: Ints) -> list[float]:
    """ln p(r | size) - ln p(r) for each size of ``FACTORS``; rows (J,): the effect's rows of the explained points."""
    bounded = [i for i, cause in enumerate(effect.causes) if cause.positive]
    gains: list[float] = []
    gram = pull = np.zeros(0)
    for factor in FACTORS:
        gain = 0.0
        if effect.column_sigma is not None or not gains:
            own = explained.with_noise(effect.column_sigma_at(rows, factor))
            columns, rest = own.whiten(effect.columns[rows]), own.whiten(explained.rest)
            gram, pull = columns.T @ columns, columns.T @ rest
            gain = own.evidence - explained.evidence
        precision = np.eye(len(gram)) + factor**2 * gram
        mean = np.linalg.solve(precision, factor * pull)
        gain += 0.5 * factor * float(pull @ mean) - 0.5 * float(np.linalg.slogdet(precision)[1])
        if bounded:
            deviation = np.sqrt(np.diag(np.linalg.inv(precision)))
            gain += float(np.sum(np.log(2.0) + log_ndtr(mean[bounded] / deviation[bounded])))
        gains.append(gain)
    return gains


def probable_set(ranked: Sequence[WeighedEffect]) -> list[WeighedEffect]:
    """The fewest effects that have together the probability ``SURE`` among ``ranked``, the likeliest first."""
    gains = np.array([one.gain for one in ranked])
    share = np.cumsum(np.exp(gains - logsumexp(gains)))
    return list(ranked[: int(np.searchsorted(share, SURE)) + 1])
