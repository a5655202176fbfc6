"""Points that all others and the causes contradict, found one at a time.

A point that is left out has the standardised residual alpha_i / sqrt(P_ii), P = K^-1, alpha = P r (Rasmussen and
Williams 2006, eq. 5.12); without it P loses the row, and P_i P_i^T / P_ii.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.units import MM
from postproc.learning.covariance import Explanation

OUTLIER, MOST_OUTLIERS = 4.0, 0.1
"""Standardised residual of an outlier, times the scatter of all where that is larger; share of points at most."""

OUTLIERS_EACH = float(np.log(0.01) + np.log(1.0 / (1.0 * MM)))
"""Logarithm of the probability density of an outlier: one in a hundred, anywhere within a millimetre."""

FEWEST = 6
"""Points that remain."""


def find_outliers(explained: Explanation, most: int) -> Ints:
    """(J,) numbers of at most ``most`` points, in their order."""
    inside = np.arange(len(explained.rest))
    inverse, alpha = explained.inverse, explained.alpha
    out: list[int] = []
    while len(out) < most and len(inside) > FEWEST:
        size = np.abs(alpha[inside]) / np.sqrt(np.diag(inverse)[inside])
        scatter = max(1.0, 1.4826 * float(np.median(size)))
        worst = int(np.argmax(size))
        if size[worst] <= OUTLIER * scatter:
            break
        number = int(inside[worst])
        row = inverse[number] / inverse[number, number]
        alpha = alpha - row * alpha[number]
        inverse = inverse - np.outer(row, inverse[number])
        out.append(number)
        inside = np.delete(inside, worst)
    return np.array(sorted(out), np.int64)
