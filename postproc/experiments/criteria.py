"""What makes one choice of setups better than another.

A criterion looks at the information M (p, p) of a choice: the sum of J^T J over its setups and of what is known before,
J the whitened columns in units of the wanted standard deviations, so that a diagonal entry of M^-1 is the square of a
ratio: interval over wanted interval.  Nuisances are coordinates of M that do not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints

SHARP = 8
"""Power in which ratios count while the worst of them is looked for."""

SHARE = 0.01
"""Of the mean ratio in the score of the worst: what decides between equals."""

NOTHING = 1e-12
"""Replaces a separation of zero."""


class Criterion(Protocol):
    """What is to be minimized."""

    def score(self, information: Floats) -> Floats:
        """(...) a logarithm, of ``information`` (..., p, p): more of it never makes this larger."""
        ...

    def directions(self, information: Floats) -> Floats:
        """(p, k) of ``information`` (p, p): a setup J lowers the score, in the first order, in proportion to the
        squared length of J directions."""
        ...


@dataclass(frozen=True)
class Minimax:
    """The largest ratio of those coordinates that count, ``counts`` (p,)."""

    counts: Bools

    def score(self, information: Floats) -> Floats:
        """(...) the logarithm of the largest ratio, of ``information`` (..., p, p)."""
        ratio = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=-2, axis2=-1)[..., self.counts])
        return np.asarray(np.log(ratio.max(axis=-1) + SHARE * ratio.mean(axis=-1)))

    def directions(self, information: Floats) -> Floats:
        """(p, k) directions in which a setup lowers the score of ``information`` (p, p): see ``Criterion``."""
        covariance = np.linalg.inv(information)[:, self.counts]
        variance = np.diag(covariance[self.counts])
        return np.asarray(covariance * np.sqrt((variance / variance.max()) ** (SHARP - 1)))


@dataclass(frozen=True)
class Determinant:
    """D-optimal: the logarithm of the volume of the joint interval, per coordinate that counts, ``counts`` (p,)."""

    counts: Bools

    def score(self, information: Floats) -> Floats:
        """(...) the logarithm of the volume, of ``information`` (..., p, p)."""
        rest = information[..., ~self.counts, :][..., ~self.counts]
        volume = np.linalg.slogdet(information)[1] - np.linalg.slogdet(rest)[1]
        return np.asarray(-0.5 * volume / self.counts.sum())

    def directions(self, information: Floats) -> Floats:
        """(p, k) directions in which a setup lowers the score of ``information`` (p, p): see ``Criterion``."""
        covariance = np.linalg.inv(information)[:, self.counts]
        cross = information[np.ix_(self.counts, ~self.counts)]
        rest = information[np.ix_(~self.counts, ~self.counts)]
        own = information[np.ix_(self.counts, self.counts)] - cross @ np.linalg.solve(rest, cross.T)
        values, axes = np.linalg.eigh(own)
        return np.asarray(covariance @ (axes * np.sqrt(np.maximum(values, 0.0))))


@dataclass(frozen=True)
class AtTestPoses:
    """Test-pose criterion: root mean square of the error by the covariance at given poses, tr(S C S^T).

    ``root`` (k, p): its R^T R is the mean of S^T S over them.
    """

    root: Floats

    def score(self, information: Floats) -> Floats:
        """(...) the logarithm of the error at the test poses, of ``information`` (..., p, p)."""
        covariance = np.linalg.inv(information)
        return np.asarray(0.5 * np.log(np.einsum("ki,...ij,kj->...", self.root, covariance, self.root)))

    def directions(self, information: Floats) -> Floats:
        """(p, k) directions in which a setup lowers the score of ``information`` (p, p): see ``Criterion``."""
        return np.asarray(np.linalg.inv(information) @ self.root.T)


@dataclass(frozen=True)
class Disagreement:
    """T-optimal: how far two explanations stay apart when each is fitted to what the other would show.

    pairs: (shows (k,), fits (f,)) of each as coordinates of M: its own pattern, and what the fit of the other consists
    of. The separation is the mean square over the patterns, in standard deviations, that remain after the fit: M_ss -
    M_sf M_ff^-1 M_fs.
    """

    pairs: tuple[tuple[Ints, Ints], ...]

    def separations(self, information: Floats) -> Floats:
        """(..., 2) noncentrality of each of the two, at ``information`` (..., p, p)."""
        return np.stack([self._fit_patterns(information, *pair)[0] for pair in self.pairs], axis=-1)

    def score(self, information: Floats) -> Floats:
        """(...) the logarithm of the smaller separation, with the sign turned, of ``information`` (..., p, p)."""
        return np.asarray(-0.5 * np.log(self.separations(information).min(axis=-1) + NOTHING))

    def directions(self, information: Floats) -> Floats:
        """(p, k) directions in which a setup lowers the score of ``information`` (p, p): see ``Criterion``."""
        size = self.separations(information) + NOTHING
        columns = []
        for (shows, fits), weight in zip(self.pairs, size.min() / size, strict=True):
            direction = np.zeros((len(information), len(shows)))
            direction[shows, range(len(shows))] = weight / np.sqrt(len(shows))
            direction[fits] = (
                -(weight / np.sqrt(len(shows))) * self._fit_patterns(information, shows, fits)[1]
            )
            columns.append(direction)
        return np.concatenate(columns, axis=1)

    @staticmethod
    def _fit_patterns(information: Floats, shows: Ints, fits: Ints) -> tuple[Floats, Floats]:
        """Mean square that remains of the patterns, and the fits (..., f, k) of the others to them."""
        own = information[..., shows, :][..., shows]
        cross = information[..., fits, :][..., shows]
        fitted = np.linalg.solve(information[..., fits, :][..., fits], cross)
        remaining = np.diagonal(own, axis1=-2, axis2=-1) - (cross * fitted).sum(axis=-2)
        return np.maximum(remaining, 0.0).mean(axis=-1), np.asarray(fitted)
