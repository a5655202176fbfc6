"""How far readings scatter: what is stated, what repeats show, and what readings of one pose share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.identification.campaign import Campaign
from postproc.identification.identifiable import basis
from postproc.measurements import Readings

NOMINAL = 1e-5
"""[m] Replaces the scatter while nothing is known of it: only ratios count then."""

LEVER = 0.3
"""[m] A turn counts as the shift that it makes at this distance, until the fit knows better."""

CLEARLY_SHARED = 3.3
"""Standard deviations by which readings of one pose must go together before that counts."""

SMALLEST = 0.01
"""Share of all variance that readings have each for itself at least, beside what they share."""


@dataclass(frozen=True)
class Noise:
    """``sigma`` (R,) [m] of each coordinate, ``sigma_turn`` (R,) [rad]; ``known``: stated or estimated from repeats,
    or else only ratios count; ``source``: in words; ``repeats`` [m] one sigma of repeated readings (NaN without), of
    ``freedom``."""

    sigma: Floats
    sigma_turn: Floats
    known: bool
    source: str
    repeats: float
    freedom: int

    @property
    def rms(self) -> float:
        """[m] length of the scatter of a position, root mean square."""
        return float(np.sqrt(3 * np.mean(self.sigma**2))) if self.known else np.nan


def noise_of(readings: Readings) -> Noise:
    """The scatter: the stated SIGMA, else that of repeats, else unknown."""
    repeats, freedom = _pure_error(readings)
    stated = np.isfinite(readings.sigma)
    if stated.any():
        sigma = np.where(stated, readings.sigma, np.median(readings.sigma[stated]))
        known, source = True, "stated" if stated.all() else "stated, its median where it is not"
    elif freedom >= 6:
        sigma, known, source = np.full(len(readings), repeats), True, "repeats"
    else:
        sigma, known, source = np.full(len(readings), NOMINAL), False, "residuals"
    turn = sigma / LEVER if readings.sigma_turn is None else np.full(len(readings), readings.sigma_turn)
    return Noise(sigma, turn, known, source, repeats, freedom)


def _pure_error(readings: Readings) -> tuple[float, int]:
    """One sigma [m] of a coordinate within rows that repeat one state, and its degrees of freedom."""
    total, freedom = 0.0, 0
    for coordinate in readings.value.T:
        rows = (readings.repeat >= 0) & np.isfinite(coordinate)
        if not rows.any():
            continue
        _, group = np.unique(readings.repeat[rows], return_inverse=True)
        count = np.bincount(group)
        mean = np.bincount(group, coordinate[rows]) / count
        total += float(((coordinate[rows] - mean[group]) ** 2).sum())
        freedom += int((count - 1).sum())
    return (float(np.sqrt(total / freedom)) if freedom else np.nan), freedom


@dataclass(frozen=True, eq=False)
class Weighting:
    """Residuals and columns in standard deviations.

    weight (R, 3 or 6): 1 / sigma of each coordinate, 0 where it does not count.  pose (R,): readings of one pose also
    share an error of ``shared`` [m] in each coordinate: their covariance is sigma^2 I + shared^2 1 1^T.
    """

    weight: Floats
    pose: Ints
    shared: float = 0.0

    def __call__(self, values: Floats) -> Floats:
        """(R * k, ...), k 3 or 6, of ``values`` (R, 3 or 6, ...): independent, of unit variance; 0 where nothing
        counts."""
        extra = (None,) * (values.ndim - 2)
        weight = self.weight[(..., *extra)]
        scaled = np.where(weight > 0, values * weight, 0.0)
        if self.shared > 0:
            u = self.weight[:, :3]
            square = _by_pose(self.pose, u * u)
            total = _by_pose(self.pose, u[(..., *extra)] * scaled[:, :3])
            less = (1.0 - 1.0 / np.sqrt(1.0 + self.shared**2 * square)) / np.where(square > 0, square, 1.0)
            scaled[:, :3] -= u[(..., *extra)] * (less[(..., *extra)] * total)[self.pose]
        return scaled.reshape(scaled.shape[0] * scaled.shape[1], *values.shape[2:])

    @property
    def counts(self) -> int:
        """Number of coordinates that count."""
        return int((self.weight > 0).sum())

    def times(self, share: Floats) -> Weighting:
        """With the weight of each reading (R,) changed: 0 leaves it out."""
        return replace(self, weight=self.weight * share[:, None])


def weighting(campaign: Campaign, noise: Noise, measured: Floats) -> Weighting:
    """The weights of the coordinates of ``measured`` (R, 3 or 6) that are not NaN."""
    sigma = np.repeat(noise.sigma[:, None], 3, axis=1)
    if measured.shape[1] == 6:
        sigma = np.concatenate([sigma, np.repeat(noise.sigma_turn[:, None], 3, axis=1)], axis=1)
    return Weighting(np.where(np.isfinite(measured), 1.0 / sigma, 0.0), campaign.pose)


def shared_error(residual: Floats, weights: Weighting, columns: Floats, known: bool) -> float:
    """[m] ``shared`` of a weighting: one sigma of what readings of one pose have in common; 0 where that is not clear.

    Two moments of the ``residual`` (R, 3 or 6) [m, rad], z [standard deviations] separate it from what each reading
    has for itself, phi: z'z, and z'Vz of the pairs of one pose.  A fit with ``columns`` (R, 3 or 6, k), Q of which is
    a basis, leaves M = 1 - Q Q' of what was there, and their means are

        E z'z  = phi tr M   + shared^2 tr M U        U = V + D: u_i u_j within a pose, D its diagonal
        E z'Vz = phi tr V M + shared^2 tr V M U M

    ``shared`` is relative to the sigma that ``weights`` assume.  Where that is not ``known``, or clearly too small,
    both are to be made larger alike, so that their ratio is the estimated one.
    """
    u = weights.weight[:, :3]
    z = np.where(u > 0, residual[:, :3] * u, 0.0)
    square = u * u
    pairs = float((_by_pose(weights.pose, square) ** 2 - _by_pose(weights.pose, square**2)).sum())
    count = float((u > 0).sum())
    q = basis(np.where(u[..., None] > 0, columns[:, :3] * u[..., None], 0.0).reshape(z.size, -1))
    if pairs == 0 or count <= q.shape[1]:
        return 0.0
    # what a prior pulled is no scatter
    z = z - (q @ (q.T @ z.reshape(-1))).reshape(z.shape)
    q = q.reshape(*z.shape, -1)
    uz, uq = (_together(weights.pose, u, x) for x in (z[..., None], q))
    vz, vq = uz - square[..., None] * z[..., None], uq - square[..., None] * q
    qvq, quq = np.tensordot(q, vq, ((0, 1), (0, 1))), np.tensordot(q, uq, ((0, 1), (0, 1)))
    means = np.array(
        [
            [count - q.shape[-1], square.sum() - np.trace(quq)],
            [-np.trace(qvq), pairs - 2.0 * (uq * vq).sum() + (qvq * quq.T).sum()],
        ]
    )
    squares, together = float((z * z).sum()), float((z[..., None] * vz).sum())
    alone = squares / means[0, 0]
    if together - alone * means[1, 0] < CLEARLY_SHARED * alone * np.sqrt(2.0 * pairs):
        return 0.0
    own, share = np.linalg.solve(means, [squares, together])
    if not known:
        own = max(own, SMALLEST * alone)
    elif own < 1.0 + CLEARLY_SHARED * np.sqrt(2.0 / count):
        own = 1.0
    return float(np.sqrt(max(share, 0.0) / own)) if own > 0 else 0.0


def _together(pose: Ints, u: Floats, values: Floats) -> Floats:
    """u_i times the sum of u_j values_j (R, 3, k) of its pose."""
    return np.asarray(u[..., None] * _by_pose(pose, u[..., None] * values)[pose])


def _by_pose(pose: Ints, values: Floats) -> Floats:
    """Sums (poses, ...) of ``values`` (R, ...)."""
    total = np.zeros((int(pose.max()) + 1, *values.shape[1:]))
    order = np.argsort(pose, kind="stable")
    ordered = pose[order]
    first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
    total[ordered[first]] = np.add.reduceat(values[order], first, axis=0)
    return total
