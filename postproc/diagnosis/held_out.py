"""What a choice is worth on readings that were left out: poses, regions, sessions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import Explained, Problem, scatter

FOLDS = 15
"""Parts that poses are left out in; each pose by itself where there are fewer."""

SEEN = 1e-8
"""Share of a column's squares that readings must show to predict others."""

OUTLIER_LIMIT = 5.0

SCATTERS = 0.01
"""Probability that scatter alone makes the largest residual of all poses larger."""

REGIONS, LLOYD = 4, 10
"""Regions of the joints' space that are left out in turn, and steps of their search."""

USUAL = 3.0
"""Times what was found of an effect that it is expected to be, of readings that were left out."""


def held_out_gain(search: Search, last: Explained, group: int, part: Ints | None) -> float:
    """Fall of -2 ln(likelihood) of readings left out, part by part, with the group; ``part`` (R,): the part of each
    reading, -1 in none; NaN without parts.

    A reading is predicted with the uncertainty of the fit of the others: where that has to extrapolate, it
    has little weight.  Outliers count up to 5 standard deviations.  A part that is more than half of all is never left
    out: a few poses measured later do not foretell a whole campaign.
    """
    if part is None:
        return np.nan
    large = np.flatnonzero(2 * np.bincount(part) > len(part))
    part = np.where(np.isin(part, large), -1, part)
    if not (part >= 0).any() or (len(large) == 0 and len(np.unique(part)) < 2):
        return np.nan
    variance = scatter(search.linear.problem, last)

    def surprise(groups: Sequence[int]) -> float:
        matrix, target, of = _with_expectations(search, last, groups, part)
        own, logarithms = _misfit(matrix, target, of, variance)
        return float(own.sum()) + logarithms

    return surprise([g for g in last.groups if g != group]) - surprise(last.groups)


def left_out_variance(search: Search, last: Explained, part: Ints) -> tuple[float, int]:
    """Variance of what is left out part by part and predicted from the rest, over that with which it is predicted, and
    the number of measured values; ``part`` (R,): as of ``held_out_gain``.

    What imitates something follows it where it was fitted, and not elsewhere.
    """
    matrix, target, of = _with_expectations(search, last, last.groups, part)
    own, _ = _misfit(matrix, target, of, 1.0)
    counts = int((target[of >= 0] != 0.0).sum())
    return float(own.sum()) / max(1, counts), counts


def _with_expectations(
    search: Search, last: Explained, groups: Sequence[int], part: Ints
) -> tuple[Floats, Floats, Ints]:
    """matrix (n, k), target (n,) and part (n,) of readings, and of rows of what is known besides, which are never left
    out: -1."""
    linear, given = search.linear, search.linear.problem
    rows = len(linear.residual) - linear.priors
    of = np.append(np.repeat(part, rows // len(part)), np.full(linear.priors, -1))
    matrix = np.concatenate([linear.common, *(linear.columns[g] for g in groups)], axis=1)
    own = np.concatenate([np.zeros(linear.common.shape[1]), *(_expected(given, last, g) for g in groups)])
    matrix = np.concatenate([matrix, np.diag(own)[own > 0]])
    more = len(matrix) - len(of)
    return matrix, np.append(linear.residual, np.zeros(more)), np.append(of, np.full(more, -1))


def worst_ratio(search: Search, last: Explained, group: int, part: Ints) -> float:
    """The largest residual of a pose left out with the group, over that without it; part (R,): as of
    ``held_out_gain``.  Where the scatter is known, what it makes of the largest pose is no growth; nor is it where each
    pose is as near as its prediction is certain: without the few poses that show a parameter the others hardly
    determine it, and the truth predicts them badly.
    """
    from scipy.special import chdtri

    linear, known = search.linear, search.linear.problem.known
    rows = len(linear.residual) - linear.priors
    of = np.append(np.repeat(part, rows // len(part)), np.full(linear.priors, -1))
    pose = np.repeat(search.base.campaign.pose, rows // len(part))

    def predicted(groups: Sequence[int]) -> Iterator[tuple[Bools, Floats, Floats]]:
        matrix = np.concatenate([linear.common, *(linear.columns[g] for g in groups)], axis=1)
        for on, away, b in _left_out(matrix, linear.residual, of):
            yield on[:rows], away, b

    def largest(groups: Sequence[int]) -> float:
        squares = np.zeros(int(pose.max()) + 1)
        for on, away, _ in predicted(groups):
            np.add.at(squares, pose[on], away**2)
        return float(np.sqrt(squares.max()))

    counts = np.bincount(pose[linear.residual[:rows] != 0.0], minlength=1).max()
    floor = np.sqrt(chdtri(counts, SCATTERS / search.base.campaign.poses)) if known else 0.0
    without = max(largest([g for g in last.groups if g != group]), floor)
    ratio = max(largest(last.groups), floor) / without if without > 0 else 1.0
    if ratio > 1.0 and all(_surprise(away, b, pose[on]) <= floor for on, away, b in predicted(last.groups)):
        return 1.0
    return float(ratio)


def _left_out(matrix: Floats, target: Floats, part: Ints) -> Iterator[tuple[Bools, Floats, Floats]]:
    """Of each part of ``target`` (n,), predicted from the others by ``matrix`` (n, k): where it is (n,), what remains
    (m,), and b (m, k): the covariance of that is 1 + b b'."""
    size = np.linalg.norm(matrix, axis=0)
    scaled = matrix[:, size > 0] / size[size > 0]
    whole, aim = scaled.T @ scaled, scaled.T @ target
    for k in np.unique(part[part >= 0]):
        out = scaled[part == k]
        value, vector = np.linalg.eigh(whole - out.T @ out)
        root = vector / np.sqrt(np.maximum(value, SEEN))
        b = out @ root
        yield part == k, target[part == k] - b @ (root.T @ (aim - out.T @ target[part == k])), b


def _surprise(away: Floats, b: Floats, pose: Ints) -> float:
    """The largest of what remains ``away`` (m,) at any ``pose`` (m,), in standard deviations of its prediction, whose
    covariance is 1 + ``b`` b'."""
    largest = 0.0
    for one in np.unique(pose):
        own, mine = away[pose == one], b[pose == one]
        largest = max(largest, float(own @ np.linalg.solve(np.eye(len(own)) + mine @ mine.T, own)))
    return float(np.sqrt(largest))


def _expected(problem: Problem, last: Explained, group: int) -> Floats:
    """(p,) one over the deviation that is expected of each parameter of a chosen group, in its scale: ``USUAL`` times
    the largest that was found of it."""
    on = np.isin(last.columns, problem.places[group])
    largest = np.abs(last.coefficients[on] / problem.size[problem.places[group]]).max(initial=0.0)
    return np.full(len(problem.places[group]), 1.0 / (USUAL * largest) if largest > 0 else 0.0)


def _misfit(matrix: Floats, target: Floats, part: Ints, variance: float) -> tuple[Floats, float]:
    """-2 ln(likelihood) of ``target`` (n,), each part predicted from the others by ``matrix`` (n, k): squares of the
    parts (K,), outliers cut, and the logarithms of their variances."""
    size = np.linalg.norm(matrix, axis=0)
    scaled = matrix[:, size > 0] / size[size > 0]
    whole, aim, squares, logarithms = scaled.T @ scaled, scaled.T @ target, [], 0.0
    for k in np.unique(part[part >= 0]):
        out = scaled[part == k]
        value, vector = np.linalg.eigh(whole - out.T @ out)
        root = vector / np.sqrt(np.maximum(value, SEEN))
        away = target[part == k] - out @ (root @ (root.T @ (aim - out.T @ target[part == k])))
        # of a part that is left out as a whole what all share, as where its tracker is, is uncertain together:
        # the covariance is variance (1 + B B'), B = out root
        b = out @ root
        gram = np.eye(b.shape[1]) + b.T @ b
        shared = np.linalg.solve(gram, b.T @ away)
        own = (away - b @ shared) ** 2 / variance
        together = min(float(shared @ shared) / variance, OUTLIER_LIMIT**2 * len(shared))
        squares.append(float(np.minimum(own, OUTLIER_LIMIT**2).sum()) + together)
        logarithms += float(len(own) * np.log(variance) + np.linalg.slogdet(gram)[1])
    return np.array(squares), logarithms


def regions_of(search: Search) -> Ints | None:
    """(R,) a region of the joints' space for each reading; None with too few poses."""
    campaign = search.base.campaign
    if campaign.poses < 24:
        return None
    q = campaign.readings.q
    spread = np.where(np.ptp(q, axis=0) > 1e-9, np.ptp(q, axis=0), 1.0)
    label = _clusters(q / spread, REGIONS)
    return label if min(np.bincount(label, minlength=REGIONS)) > 0 else None


def _clusters(points: Floats, count: int) -> Ints:
    """(R,) of ``count`` clusters of ``points`` (R, n), by Lloyd's iteration from points far from each other."""
    away = np.linalg.norm(points - points.mean(axis=0), axis=1)
    first: list[int] = []
    for _ in range(count):
        first.append(int(np.argmax(away)))
        to_last = np.linalg.norm(points - points[first[-1]], axis=1)
        away = to_last if len(first) == 1 else np.minimum(away, to_last)
    centres = points[first]
    label = np.zeros(len(points), np.int64)
    for _ in range(LLOYD):
        label = np.argmin(((points[:, None] - centres) ** 2).sum(axis=2), axis=1)
        own = [points[label == k] for k in range(count)]
        centres = np.array([one.mean(axis=0) if len(one) else centres[k] for k, one in enumerate(own)])
    return label


def sessions_of(search: Search) -> Ints | None:
    """(R,) the session of each reading; None where there is one."""
    session = search.base.campaign.readings.session
    return session if len(np.unique(session)) > 1 else None
