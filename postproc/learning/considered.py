"""What effects that have no name may have done to the causes: their intervals consider them.

An arm has gaps, loops and a compliant base whether a part shows them or not.  What is too small to be named goes
into forces and tool, and the covariance of the causes alone does not know of it.  As in orbit determination (B. D.
Tapley, B. E. Schutz, G. H. Born: Statistical Orbit Determination, 2004, ch. 6, "consider" parameters) it is widened by
what the effects may have moved,

    P_c = P + sum_F p(F | r) G_F (V_F + m_F m_F^T) G_F^T,     G_F = S^T K^-1 C_F
    M = 1 + C_F^T K^-1 C_F,   V_F = M^-1,   m_F = M^-1 C_F^T K^-1 r,   p(F | r) ~ exp(m_F^T M m_F / 2) / |M|^1/2

S: causes, C: effects (m per standard deviation), r: deviations, K: their covariance without the effects, m and V: mean
and covariance of the sizes after the measurement.  Each family (backlash of all joints, say) is there or not, one as
likely as the other, and F runs over all sets of families (J. A. Hoeting et al.: Bayesian Model Averaging, Stat. Sci.
14, 1999, doi:10.1214/ss/1009212519).  The causes keep their values: they are those of the next program.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.learning.candidates import MissingEffect
from postproc.learning.covariance import Explanation


def considered_covariance(explained: Explanation, offered: Sequence[MissingEffect], rows: Ints) -> Floats:
    """(P, P) what effects without a name add to the covariance of the causes, in standard deviations before; rows
    (J,): the points that are explained among those of the effects ``offered``."""
    count = explained.columns.shape[1]
    usual = [one for one in offered if not one.wide]
    if not usual:
        return np.zeros((count, count))
    columns = explained.whiten(np.concatenate([one.columns[rows] for one in usual], axis=1))
    owner = np.concatenate([[one.family] * one.columns.shape[1] for one in usual])
    moved = explained.whiten(explained.columns).T @ columns
    gram, pull = columns.T @ columns, columns.T @ explained.whiten(explained.rest)
    families, logarithms, added = np.unique(owner), [], []
    for size in range(len(families) + 1):
        for chosen in combinations(families.tolist(), size):
            own = np.flatnonzero(np.isin(owner, chosen))
            precision = np.eye(len(own)) + gram[np.ix_(own, own)]
            mean, spread = np.linalg.solve(precision, pull[own]), np.linalg.inv(precision)
            logarithms.append(0.5 * float(pull[own] @ mean - np.linalg.slogdet(precision)[1]))
            added.append(moved[:, own] @ (spread + np.outer(mean, mean)) @ moved[:, own].T)
    share = np.exp(np.array(logarithms) - max(logarithms))
    return np.asarray(np.tensordot(share / share.sum(), np.array(added), axes=1))
