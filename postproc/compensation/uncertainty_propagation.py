"""The uncertainty of errors, from that of the figures which they depend on.

The largest error of a program exceeds that of any one motion more often than this motion alone does.  Its bound is
therefore a joint statement: sets of parameters are drawn, each goes through the sensitivities of all motions, and the
largest error of each set is compared with the predicted one (Monte Carlo propagation, JCGM 101:2008).
"""

from __future__ import annotations

from functools import cache
from statistics import NormalDist

import numpy as np

from postproc.base.arrays import Floats, Ints, frozen
from postproc.robot.description import COVERAGE

DRAWS, FIRST, SEED = 10_000, 500, 20240229
"""Sets of parameters drawn for the bound of the largest error: all, the first of them, and where they come from."""

MOST = 200
"""Motions that go through all draws."""

NUMBERS = 100_000
"""Numbers that go through the draws at once."""

_CHI_SQUARE = (
    (1.0, 3.84146),
    (1.25, 4.43224),
    (1.5, 4.98020),
    (2.0, 5.99146),
    (2.5, 6.92808),
    (3.0, 7.81473),
)
"""95 % quantile of chi-square by degrees of freedom."""


def covariances(sensitivity: Floats, covariance: Floats) -> Floats:
    """S C S^T (N, 3, 3) [m^2] of S (N, 3, P) and C (P, P)."""
    return np.asarray(sensitivity @ covariance @ np.swapaxes(sensitivity, 1, 2))


def expanded_uncertainty(error: Floats, spread: Floats) -> Floats:
    """(N,) [m] half width of the 95 % interval of the length of ``error`` (N, 3) [m] with covariance ``spread`` (N, 3,
    3) [m2].

    Of an error that exceeds its uncertainty: along its own direction.  Elsewhere, as after a correction, the length
    that the deviation keeps below with 95 %.
    """
    size, half_width = np.linalg.norm(error, axis=1), length_quantile(spread)
    clear = size > half_width
    unit = error[clear] / size[clear, None]
    along = np.einsum("ni,nij,nj->n", unit, spread[clear], unit)
    half_width[clear] = COVERAGE * np.sqrt(np.maximum(along, 0.0))
    return half_width


def length_quantile(spread: Floats) -> Floats:
    """(N,) [m] 95 % quantile of the length of a deviation with covariance (N, 3, 3).

    Its square is a sum of lambda_i chi-square_1, lambda the eigenvalues, taken for g chi-square_h of the same mean and
    variance (Satterthwaite 1946; Welch 1947): g = sum lambda^2 / sum lambda, h = (sum lambda)^2 / sum lambda^2.  For
    one direction this is 1.96 sqrt(lambda), for three alike 2.80 sqrt(lambda): both exact, between them to about 1 %.
    """
    total, squares = np.trace(spread, axis1=1, axis2=2), (spread**2).sum(axis=(1, 2))
    quantile, some = 0.0 * total, squares > 0  # NaN where nothing is known
    total, squares = total[some], squares[some]
    quantile[some] = np.sqrt(squares / total * np.interp(total**2 / squares, *np.transpose(_CHI_SQUARE)))
    return np.asarray(quantile)


def expanded_uncertainty_of_largest(error: Floats, sensitivity: Floats, covariance: Floats) -> float:
    """[m] by what the largest length of ``error`` (M, 3) [m] + S dp, over all motions, differs from that of ``error``
    in 95 % of all cases at most; S = ``sensitivity`` (M, 3, P), dp of ``covariance`` (P, P).  After a correction, where
    the predicted error is next to nothing, their sum is what the largest error stays below with 95 %.

    ``DRAWS`` sets dp, always the same ones, each principal axis sampled evenly (Latin hypercube): few give a quantile
    that one or two axes dominate.  They go through the ``MOST`` motions that have the largest error most often in the
    first ``FIRST``.
    """
    values, vectors = np.linalg.eigh(covariance)
    rooted = sensitivity @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    # along the principal axes of what the parameters do to all motions: those that do nothing drop out
    weight, axes = np.linalg.eigh(np.einsum("nip,niq->pq", rooted, rooted))
    rooted = rooted @ axes[:, weight > 1e-8 * weight.max(initial=0.0)]
    if not rooted.shape[2]:
        return 0.0
    rng = np.random.default_rng(SEED)
    drawn = np.stack([rng.permutation(_even()) for _ in range(rooted.shape[2])])
    first, _ = _largest(error, rooted, drawn[:, :FIRST])
    often = np.bincount(first, minlength=len(error))
    motions = np.sort(np.argsort(-often, kind="stable")[: min(MOST, np.count_nonzero(often))])
    _, size = _largest(error[motions], rooted[motions], drawn)
    return float(np.quantile(np.abs(size - np.linalg.norm(error, axis=1).max()), 0.95))


@cache
def _even() -> Floats:
    """(``DRAWS``,) standard normal figures, one of the middle of each of as many equal parts of all cases."""
    normal = NormalDist()
    return frozen([normal.inv_cdf((i + 0.5) / DRAWS) for i in range(DRAWS)])


def _largest(error: Floats, rooted: Floats, drawn: Floats) -> tuple[Ints, Floats]:
    """Of every draw (P, D) of standard normal figures the motion (D,) with the largest error, and its size (D,) [m];
    ``error`` (M, 3), ``rooted`` (M, 3, P) what a standard deviation of each figure adds."""
    count = drawn.shape[1]
    motion, most = np.zeros(count, np.int64), np.full(count, -np.inf)
    each = max(1, NUMBERS // (3 * count))
    for start in range(0, len(error), each):
        part = slice(start, start + each)
        moved = (rooted[part].reshape(-1, len(drawn)) @ drawn).reshape(
            -1, 3, count
        )  # one product of matrices
        moved += error[part, :, None]
        moved *= moved
        square = moved[:, 0]
        square += moved[:, 1]
        square += moved[:, 2]
        for number, size in enumerate(square, start):
            motion[size > most] = number
            np.maximum(most, size, out=most)
    return motion, np.sqrt(most)


def variance_shares(sensitivity: Floats, covariance: Floats) -> Floats:
    """(P,) share of each figure in the variance tr(S C S^T) of one motion, S = ``sensitivity`` (3, P), C =
    ``covariance`` (P, P); their sum is 1.

    With correlated figures: (C S^T S)_pp / tr, which can be negative.  Zeros where there is no variance.
    """
    parts = np.einsum("ip,pq,iq->p", sensitivity, covariance, sensitivity)
    total = float(parts.sum())
    return parts / total if total > 0 else np.zeros_like(parts)
