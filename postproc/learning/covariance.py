"""The covariance of measured deviations beside their causes, and what it makes of them.

    K = S D^2 S^T + scatter + alignment + field + noise

S D: causes in standard deviations; scatter: the force of each operation differs from part to part; alignment: freedoms
in which the part was laid on its own points (marginalised, without a prior); field: a smooth displacement of the
surface, a Gaussian process with independent components, k(d) = s^2 exp(-d^2 / (2 l^2)) (n . n'); noise: of the probe,
and an error w that no two points share.  s, l and w are chosen by the evidence (C. E. Rasmussen, C. K. I. Williams:
Gaussian Processes for Machine Learning, MIT Press 2006, eq. 5.8); single deviations left out have the standardised
residual alpha_i / sqrt(K^-1_ii) (eq. 5.12).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM

SCATTER = 0.02
"""Standard deviation of the force of one operation from part to part, as a share."""

FREE_SHIFT, FREE_TURN = 5 * MM, 0.02
"""[m], [rad] of a freedom that the alignment takes out: as good as without a prior."""

FIELDS = np.array([0.0, 5, 10, 20, 40, 80, 160]) * 1e-6
LENGTHS = np.array([25.0, 60.0, 140.0]) * MM
WHITES = np.array([0.0, 3, 6, 12, 25, 50, 100]) * 1e-6
FIELD_SIZE, WHITE_SIZE = 40e-6, 20e-6
"""[m] Sizes of field and white error that are expected; larger ones have to earn their place."""


@dataclass(frozen=True)
class SmoothField:
    """What no cause explains: ``size`` and ``length`` [m] of the smooth field; ``white`` [m] that no two points
    share."""

    size: float = 0.0
    length: float = 60 * MM
    white: float = 0.0

    @property
    def logarithm(self) -> float:
        """Of its probability before the measurement."""
        return -self.size / FIELD_SIZE - self.white / WHITE_SIZE


@dataclass(frozen=True, eq=False)
class Layout:
    """K points: place (K, 3) [m], normal (K, 3), sigma (K,) [m]; free (K, A): columns of the freedoms taken out by the
    alignment, in m per standard deviation; group (K,): operation and part, within which the scatter of the force is
    one."""

    place: Floats
    normal: Floats
    sigma: Floats
    free: Floats
    group: Ints

    def part(self, rows: Ints) -> Layout:
        """Of some points (J,)."""
        return Layout(
            self.place[rows], self.normal[rows], self.sigma[rows], self.free[rows], self.group[rows]
        )

    def with_noise(self, more: Floats | None) -> Layout:
        """With an error of standard deviation ``more`` (K,) [m] beside that of the probe, or the same."""
        return self if more is None else replace(self, sigma=np.hypot(self.sigma, more))

    @cached_property
    def _square(self) -> Floats:
        inner = self.place @ self.place.T
        own = np.diag(inner)
        return np.maximum(own[:, None] + own[None] - 2 * inner, 0.0)

    @cached_property
    def _facing(self) -> Floats:
        return self.normal @ self.normal.T

    @cached_property
    def _free(self) -> Floats:
        return self.free @ self.free.T

    def field(self, surface: SmoothField) -> Floats:
        """(K, K) [m2] covariance of the smooth field along the normals."""
        if surface.size == 0.0:
            return np.zeros((len(self.sigma), len(self.sigma)))
        return np.asarray(surface.size**2 * np.exp(-self._square / (2 * surface.length**2)) * self._facing)

    def fields_at(self, surface: SmoothField, place: Floats) -> Floats:
        """(J, K) covariance of the field at places (J, 3) [m] with that at the points, without their normals."""
        square = (
            (place**2).sum(axis=1)[:, None] + (self.place**2).sum(axis=1)[None] - 2 * place @ self.place.T
        )
        return np.asarray(surface.size**2 * np.exp(-np.maximum(square, 0.0) / (2 * surface.length**2)))

    def scatter(self, by_force: Floats) -> Floats:
        """(K, K) [m2] of the force from part to part; ``by_force`` (K,) [m]: error per share of the force."""
        moved = SCATTER * by_force
        return np.where(self.group[:, None] == self.group[None], moved[:, None] * moved[None], 0.0)

    def covariance(self, surface: SmoothField, by_force: Floats) -> Floats:
        """(K, K) [m2] of everything but the causes; ``by_force`` (K,) [m]: error per share of the force."""
        whole = self.field(surface) + self.scatter(by_force) + self._free
        whole[np.diag_indices_from(whole)] += self.sigma**2 + surface.white**2
        return whole


@dataclass(frozen=True, eq=False)
class Explanation:
    """Deviations ``rest`` (K,) [m] with their causes at the mean, ``columns`` (K, P) [m per standard deviation], and
    the covariance of all else; ``by_force`` (K,) [m]: error per share of the force.  Raises
    numpy.linalg.LinAlgError where that is not positive."""

    layout: Layout
    surface: SmoothField
    rest: Floats
    columns: Floats
    by_force: Floats

    @cached_property
    def factor(self) -> tuple[Floats, bool]:
        whole = self.layout.covariance(self.surface, self.by_force) + self.columns @ self.columns.T
        lower, below = cho_factor(whole, lower=True, check_finite=False)
        return np.asarray(lower), bool(below)

    def whiten(self, values: Floats) -> Floats:
        """(K, ...) L^-1 of ``values`` (K, ...), with K = L L^T."""
        return np.asarray(solve_triangular(self.factor[0], values, lower=True, check_finite=False))

    @cached_property
    def alpha(self) -> Floats:
        """(K,) K^-1 rest."""
        return np.asarray(cho_solve(self.factor, self.rest, check_finite=False))

    @cached_property
    def inverse(self) -> Floats:
        """(K, K) K^-1."""
        return np.asarray(cho_solve(self.factor, np.eye(len(self.rest)), check_finite=False))

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the probability of the deviations, and of the surface before them."""
        logarithm = 2 * float(np.log(np.diag(self.factor[0])).sum())
        count = len(self.rest)
        return float(-0.5 * self.rest @ self.alpha - 0.5 * logarithm - 0.5 * count * np.log(2 * np.pi)) + (
            self.surface.logarithm
        )

    def causes(self) -> tuple[Floats, Floats]:
        """Mean (P,) and covariance (P, P) of the causes, in standard deviations before."""
        mean = self.columns.T @ self.alpha
        solved = cho_solve(self.factor, self.columns, check_finite=False)
        covariance = np.eye(self.columns.shape[1]) - self.columns.T @ solved
        return mean, 0.5 * (covariance + covariance.T)

    def standardised(self) -> Floats:
        """(K,) residual of each deviation predicted from all others, over its standard deviation."""
        return np.asarray(self.alpha / np.sqrt(np.diag(self.inverse)))

    def left_out(self) -> Floats:
        """(K,) [m] residual of each deviation predicted from all others."""
        return np.asarray(self.alpha / np.diag(self.inverse))

    def with_surface(self, surface: SmoothField) -> Explanation:
        """The same with another surface."""
        return Explanation(self.layout, surface, self.rest, self.columns, self.by_force)

    def with_columns(self, more: Floats) -> Explanation:
        """The same with further causes (K, Q) [m per standard deviation]."""
        return Explanation(
            self.layout, self.surface, self.rest, np.concatenate([self.columns, more], axis=1), self.by_force
        )

    def with_noise(self, more: Floats | None) -> Explanation:
        """With an error of standard deviation ``more`` (K,) [m] beside that of the probe, or the same."""
        return self if more is None else replace(self, layout=self.layout.with_noise(more))

    def part(self, rows: Ints) -> Explanation:
        """Of some points (J,)."""
        return Explanation(
            self.layout.part(rows), self.surface, self.rest[rows], self.columns[rows], self.by_force[rows]
        )


def choose_surface(explained: Explanation, rounds: int = 2) -> Explanation:
    """The surface with the greatest evidence, one of its three figures after another."""
    best = explained
    for _ in range(rounds):
        before = best.surface
        for size, length in [(0.0, best.surface.length), *((s, n) for s in FIELDS[1:] for n in LENGTHS)]:
            best = _better(best, replace(best.surface, size=float(size), length=float(length)))
        for white in WHITES:
            best = _better(best, replace(best.surface, white=float(white)))
        if best.surface == before:
            break
    return best


def without_field(explained: Explanation) -> Explanation:
    """The greatest evidence without a smooth error."""
    length = explained.surface.length
    every = [explained.with_surface(SmoothField(0.0, length, float(white))) for white in WHITES]
    return max(every, key=lambda one: one.evidence)


def _better(best: Explanation, surface: SmoothField) -> Explanation:
    if surface == best.surface:
        return best
    other = best.with_surface(surface)
    return other if other.evidence > best.evidence else best
