"""Which of many groups of columns explain a residual: arrays only, nothing of robots.

Everything is whitened (independent readings of unit variance) and is outside of what is explained anyway: tracker,
targets, refitted parameters.  A group is in or out as a whole.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.identification.bounded import bounded_least_squares

WORTH = 0.19
"""Share of the remaining squares that an effect must explain where more than scatter remains, a tenth of the root mean
square: what is not understood follows the joints as well, and by chance looks a little like any effect."""

SLIGHT = 0.03
"""The same where no more than scatter remains, a sixth of it: less is not worth a name, however many readings show
it."""

FAR = 3.0
"""A residual counts for an effect up to so many standard deviations."""

CHANCE = 0.001
"""Probability that among all groups any is taken in although none is there."""

APART = 1e-3
"""A column whose part outside of the others is smaller than this share of it cannot be distinguished from them."""

EXCEEDED = 1.5
"""Remaining variance over the stated one from which on more than scatter is taken to remain."""

CLIP = 2.5
"""Residuals count up to this many standard deviations, so that a few outliers do not decide."""

CLIPPED = 0.9468
"""Mean square of a normal variable clipped there."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Groups of columns and a residual, outside of what is explained anyway, whose rank is ``rank``.

    residual (n,); matrix (n, P): all columns, each as long as 1 before its explained part was taken out; places: the
    columns of each group; reach (P, 2): how far each coefficient may go down and up from zero; size (P,): coefficient
    over parameter in its scale; ``known``: the residual is in its standard deviations, else only ratios count;
    ``clusters``: of readings that may share errors, whose number limits what is known of chance; 0: each for itself.
    """

    residual: Floats
    matrix: Floats
    places: tuple[Ints, ...]
    reach: Floats
    size: Floats
    rank: int
    known: bool
    clusters: int = 0

    @property
    def freedom(self) -> int:
        return len(self.residual) - self.rank

    @cached_property
    def gram(self) -> Floats:
        """(P, P) matrix^T matrix."""
        return self.matrix.T @ self.matrix

    @cached_property
    def aim(self) -> Floats:
        """(P,) matrix^T residual."""
        return self.matrix.T @ self.residual

    @cached_property
    def squares(self) -> float:
        return float(self.residual @ self.residual)


def basis_of(common: Floats) -> Floats:
    """(n, r) orthonormal columns of ``common`` (n, k), however long those are."""
    length = np.linalg.norm(common, axis=0)
    u, s, _ = np.linalg.svd(common[:, length > 0] / length[length > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s.max(initial=0.0)])


def outside(basis: Floats, columns: Floats) -> Floats:
    """(n, p) ``columns`` (n, p) without what lies in ``basis`` (n, r)."""
    remaining = columns - basis @ (basis.T @ columns)
    return np.asarray(remaining - basis @ (basis.T @ remaining))


def problem(
    residual: Floats,
    basis: Floats,
    groups: Sequence[tuple[Floats, Floats]],
    rows: int,
    known: bool,
    clusters: int = 0,
) -> Problem:
    """Of whitened ``residual`` (n,), a ``basis`` (n, r) of what is explained anyway, and (columns (n, p), reach (p, 2))
    of the groups.  ``rows`` of n count: the others are zero."""
    columns = (
        np.concatenate([columns for columns, _ in groups], axis=1) if groups else np.zeros((len(residual), 0))
    )
    reach = np.concatenate([reach for _, reach in groups]) if groups else np.zeros((0, 2))
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    ends = np.cumsum([columns.shape[1] for columns, _ in groups])
    places = tuple(
        np.arange(end - columns.shape[1], end) for end, (columns, _) in zip(ends, groups, strict=True)
    )
    remaining = outside(basis, residual[:, None])[:, 0]
    rank = basis.shape[1] + len(residual) - rows
    return Problem(
        remaining, outside(basis, columns / size), places, reach * size[:, None], size, rank, known, clusters
    )


@dataclass(frozen=True, eq=False)
class Explained:
    """A residual with some ``groups`` taken in: remaining squares, ``rank`` of what they added, their ``columns`` (p,)
    of the matrix and ``coefficients`` (p,)."""

    groups: tuple[int, ...]
    squares: float
    rank: int
    columns: Ints
    coefficients: Floats


def explained(problem: Problem, groups: Sequence[int]) -> Explained:
    """The least squares of the residual over ``groups``, each coefficient within its reach."""
    chosen = tuple(groups)
    if not chosen:
        return Explained((), problem.squares, 0, np.zeros(0, np.int64), np.zeros(0))
    at = np.concatenate([problem.places[g] for g in chosen])
    gram, aim = problem.gram[np.ix_(at, at)], problem.aim[at]
    value, vector = np.linalg.eigh(gram)
    on = value > APART**2
    inverse = vector[:, on] / value[on]
    coefficients = inverse @ (vector[:, on].T @ aim)
    low, high = problem.reach[at].T
    if np.any(coefficients < low - 1e-9) or np.any(coefficients > high + 1e-9):
        coefficients = _bounded(value, vector, aim, low, high)
    squares = problem.squares - float(coefficients @ (2 * aim - gram @ coefficients))
    return Explained(chosen, max(squares, 0.0), int(on.sum()), at, coefficients)


def _bounded(value: Floats, vector: Floats, aim: Floats, low: Floats, high: Floats) -> Floats:
    """min x^T G x - 2 aim^T x within bounds, of G by its eigenvalues, hardly observable directions fixed."""
    root = np.sqrt(np.maximum(value, (0.1 * APART) ** 2))
    matrix, right = root[:, None] * vector.T, (vector.T @ aim) / root
    return bounded_least_squares(matrix, right, np.minimum(low, 0.0), np.maximum(high, 0.0))


def beside(problem: Problem, rest: Explained, columns: Floats) -> Floats:
    """(n, p) ``columns`` (n, p) without what the groups of ``rest`` do as well."""
    return outside(basis_of(problem.matrix[:, rest.columns]), columns) if len(rest.columns) else columns


def complexity_penalty(columns: Floats, residual: Floats, variance: float) -> float:
    """What an effect has to pay for the parameters that it fits: by how much -2 ln(likelihood) falls more in the fit
    than it does on the average over all that its parameters might have been.  ``columns`` (n, p) per scale,
    ``residual`` (n,): outside of what is explained anyway.

    The parameters might have been of any size u, all alike in their scales.  With l the eigenvalues of the information
    that the readings give of them, and b the gradients along its axes, that average is

        max over u of  sum b^2 u^2 / (1 + u^2 l) - ln(1 + u^2 l)

    A parameter that the readings do not show costs nothing, and one that they would have shown, but is not there, does.
    """
    value, vector = np.linalg.eigh(columns.T @ columns / variance)
    on = value > 1e-12 * max(1.0, float(value.max(initial=0.0)))
    if not on.any():
        return 0.0
    information = value[on]
    gradient = (vector[:, on].T @ (columns.T @ residual)) / variance
    # from sizes that nobody would see to those that nobody could miss
    u = np.geomspace(
        1e-3 / np.sqrt(information.max()), 1e3 * (1.0 + np.abs(gradient / information).max()), 200
    )
    spread = 1.0 + np.outer(u * u, information)
    average = (gradient**2 * (u * u)[:, None] / spread - np.log(spread)).sum(axis=1).max()
    return float((gradient**2 / information).sum() - average)


def residual_of(problem: Problem, last: Explained) -> Floats:
    """(n,) what remains of the residual."""
    return np.asarray(problem.residual - problem.matrix[:, last.columns] @ last.coefficients)


def clipped_squares(problem: Problem, last: Explained) -> float:
    """The remaining squares, outliers clipped, as large as those of normal ones would be."""
    residual = residual_of(problem, last)
    rows = np.abs(residual[residual != 0])
    # the median gives the level from which on readings are outliers
    level = float(np.median(rows)) / 0.6745 if len(rows) else 0.0
    clipped = np.clip(residual, -CLIP * level, CLIP * level)
    return min(last.squares, float(clipped @ clipped) / CLIPPED)


def scatter(problem: Problem, last: Explained) -> float:
    """Variance of the residual; at least 1 where that is what was stated."""
    variance = clipped_squares(problem, last) / max(1, problem.freedom - last.rank)
    return max(1.0, variance) if problem.known else max(variance, 1e-300)


def probability(problem: Problem, squares: float, rank: int, variance: float, freedom: int) -> float:
    """That ``rank`` columns explain ``squares`` by chance.

    Where readings come in clusters, what those share adds to the scatter, and is known from so many of them only: the F
    distribution with one degree of freedom less than there are clusters (Cameron and Miller, J. Human Resources 50
    (2015), Sec. VI).
    """
    from scipy.special import chdtrc, fdtrc

    if rank == 0 or squares <= 0:
        return 1.0
    if problem.clusters:
        freedom = min(freedom, problem.clusters - 1)
    elif problem.known and variance == 1.0:
        return float(chdtrc(rank, squares))
    return float(fdtrc(rank, max(1, freedom), squares / rank / variance))


def gain_by_chance(problem: Problem, rank: int, freedom: int, among: int) -> float:
    """The gain, in variances of a reading, that ``rank`` columns have with probability ``CHANCE`` by chance in any of
    ``among`` groups."""
    from scipy.special import chdtri, fdtri

    if not problem.clusters:
        return float(chdtri(rank, CHANCE / among))
    return float(rank * fdtri(rank, max(1, min(freedom, problem.clusters - 1)), 1.0 - CHANCE / among))


def selected(
    problem: Problem,
    candidates: Sequence[int],
    start: Sequence[int] = (),
    sums: Collection[int] = (),
    limit: int = 12,
) -> Explained:
    """Groups taken in one by one from ``start`` on, the one with the best evidence first, exchanged and left out again
    as long as that is better.  A group stays if by chance, among all ``candidates``, its gain has a probability below
    ``CHANCE``.

    A group of ``sums`` that was the best by itself may be a sum of others: without it, and grown again from what else
    was chosen, the choice may explain as much with fewer columns.
    """
    now = _grown(problem, explained(problem, start), candidates, candidates, limit)
    for gone in now.groups:
        if gone not in now.groups or gone not in sums:
            continue
        rest, others = [g for g in now.groups if g != gone], [g for g in candidates if g != gone]
        instead = _grown(problem, explained(problem, rest), others, candidates, limit)
        variance, penalty = scatter(problem, now), np.log(problem.freedom)
        if _score(instead, variance, penalty) < _score(now, variance, penalty) - 1.0:
            now = instead
    return now


def _grown(
    problem: Problem, start: Explained, others: Sequence[int], candidates: Sequence[int], limit: int
) -> Explained:
    """``start`` and what of ``others`` counts beside it, for as many ``candidates`` tried."""
    now = _pruned(problem, start, len(candidates))
    penalty = np.log(problem.freedom)
    for _ in range(limit):
        tried = [(explained(problem, (*now.groups, g)), g) for g in others if g not in now.groups]
        if not tried:
            break
        least = _least(problem, tried)
        best = min(tried, key=lambda pair: _score(pair[0], least, penalty))[0]
        if not counts(problem, now, best, len(candidates)):
            two = _two(problem, now, [g for _, g in tried], penalty)
            if two is None:
                break
            best = two
        grown = _pruned(problem, _exchanged(problem, best, others, penalty), len(candidates))
        if set(grown.groups) == set(now.groups):
            break
        now = grown
    return now


def _two(problem: Problem, now: Explained, others: Sequence[int], penalty: float) -> Explained | None:
    """``now`` with two of ``others`` where no single one counts, but more than scatter remains: each of two large
    effects is scatter for the other.  None where no two count, among all pairs."""
    if problem.known and scatter(problem, now) <= EXCEEDED:
        return None
    pairs = list(combinations(others, 2))
    tried = [(explained(problem, (*now.groups, *pair)), 0) for pair in pairs]
    if not tried:
        return None
    least = _least(problem, tried)
    best = min((one for one, _ in tried), key=lambda one: _score(one, least, penalty))
    return best if counts(problem, now, best, len(pairs)) else None


def _score(one: Explained, variance: float, penalty: float) -> float:
    """-2 ln(likelihood) with scatter of ``variance``, up to a constant, and what each column costs."""
    return one.squares / variance + penalty * one.rank


def _least(problem: Problem, tried: Sequence[tuple[Explained, int]]) -> float:
    """The variance in which gains of this round count: that of the best."""
    return scatter(problem, min((e for e, _ in tried), key=lambda e: e.squares))


def counts(problem: Problem, without: Explained, with_: Explained, among: int) -> bool:
    """Whether what ``with_`` has more than ``without`` is no chance, for ``among`` groups tried."""
    freedom = problem.freedom - with_.rank
    if freedom < 3:
        return False
    variance, gain = scatter(problem, with_), without.squares - with_.squares
    if gain < (WORTH if variance > EXCEEDED or not problem.known else SLIGHT) * without.squares:
        return False
    # what a few readings far out ask for is no effect
    limit = FAR * np.sqrt(variance)
    far = [np.clip(residual_of(problem, one), -limit, limit) for one in (without, with_)]
    gain = min(gain, float(far[0] @ far[0] - far[1] @ far[1]))
    return probability(problem, gain, with_.rank - without.rank, variance, freedom) * among < CHANCE


def _exchanged(problem: Problem, now: Explained, candidates: Sequence[int], penalty: float) -> Explained:
    """With one group exchanged for another where that explains more."""
    best = now
    variance = scatter(problem, now)
    for gone in now.groups[:-1]:
        rest = tuple(g for g in now.groups if g != gone)
        for g in candidates:
            if g in now.groups:
                continue
            other = explained(problem, (*rest, g))
            if _score(other, variance, penalty) < _score(best, variance, penalty) - 1.0:
                best = other
    return best


def _pruned(problem: Problem, now: Explained, among: int) -> Explained:
    """Without the groups that the others make unnecessary."""
    while now.groups:
        without = [explained(problem, tuple(g for g in now.groups if g != gone)) for gone in now.groups]
        needless = [w for w in without if not counts(problem, w, now, among)]
        if not needless:
            return now
        now = min(needless, key=lambda w: w.squares)
    return now
