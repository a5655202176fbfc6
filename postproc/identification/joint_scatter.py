"""Intervals where joints do not come to rest at one angle.

All readings that are taken before the arm goes on share where its joints stand.  A joint that comes to rest at angles
that scatter moves them along its own direction, the more the longer its lever; an error of the same size in all
coordinates is only the mean of that.  What a joint does by itself, like its lost motion, is as uncertain as that joint
stands, and not as the mean of all.

The scatter z of readings, in assumed standard deviations, has three parts here, U the moves of a pose's readings by a
shift of all, and K those by the joints of what is read between two motions:

    cov z = phi I + s U U' + t K K'

Their sizes are those with which z'z, z'UU'z and z'KK'z of the residual take the values that they have (MINQUE: C. R.
Rao, J. Multivariate Anal. 1 (1971), 257), none negative.  A fit weighs by less than that, which does no harm, and its
parameters G z have the covariance G cov(z) G', whatever the weights (White, Econometrica 48 (1980), 817).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.effects.joint_offset import JointOffset
from postproc.identification.fit import Fit
from postproc.identification.identifiable import basis
from postproc.identification.least_squares import predicted_in, prior_weight, scales
from postproc.identification.noise import Weighting
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import unknowns_of

UNMOVED = 0.01
"""Mean square [assumed standard deviations] of the moves of all readings by the usual size of each joint's zero below
which joints move none: joints rest better than that, and in differences at one place of the joints it cancels."""


@dataclass(frozen=True)
class Part:
    """What of the scatter readings share: ``moves`` (n, r) of each number, in assumed standard deviations, by what is
    the same for all numbers of one ``group`` (n,)."""

    moves: Floats
    group: Ints

    def sums(self, values: Floats) -> Floats:
        """(G, r, k) sums over each group of moves times ``values`` (n, k)."""
        order = np.argsort(self.group, kind="stable")
        ordered, moves, values = self.group[order], self.moves[order], values[order]
        first = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
        return np.stack([np.add.reduceat(one[:, None] * values, first, axis=0) for one in moves.T], axis=1)

    @property
    def squares(self) -> float:
        return float((self.moves**2).sum())


@dataclass(frozen=True)
class Scatter:
    """Covariance of residuals in assumed standard deviations: ``own`` of each number, and ``parts`` with the variance
    ``sizes`` of each; ``weights``: with which they are whitened; ``factor``: of the covariance that the fit assumes."""

    own: float
    sizes: tuple[float, ...]
    parts: tuple[Part, ...]
    weights: Weighting
    factor: float

    def excess(self, gain: Floats) -> Floats:
        """(k, k) by how much the covariance of ``gain`` (k, n) times the whitened residuals is more than assumed."""
        shape = self.weights.weight.shape
        per_sigma = np.where(
            self.weights.weight > 0, 1.0 / np.where(self.weights.weight > 0, self.weights.weight, 1.0), 0.0
        )
        # whitening is symmetric within a pose
        back = self.weights(gain.T.reshape(*shape, -1) * per_sigma[..., None])
        found = self.own * (back.T @ back) - self.factor * (gain @ gain.T)
        for size, part in zip(self.sizes, self.parts, strict=True):
            if size > 0:
                moved = part.sums(back)
                moved = moved.reshape(-1, moved.shape[2])
                found += size * (moved.T @ moved)
        return np.asarray(found)


def scatter_of(fitted: Fit) -> Scatter | None:
    """What the residual of a fit shows of its scatter; None where joints move no reading, or nothing is left."""
    from scipy.optimize import nnls

    weights, point = fitted.weights, fitted.point
    on = weights.weight > 0
    width, count = on.shape[1], int(on.sum())

    def flat(values: Floats) -> Floats:
        return np.where(on[..., None], np.nan_to_num(values) * weights.weight[..., None], 0.0).reshape(
            on.size, -1
        )

    pose, moves = weights.pose, flat(_joints(fitted))
    # who comes back to a pose comes to rest anew
    parts = (
        Part(flat(_shifts(weights)), np.repeat(pose, width)),
        Part(moves, np.repeat(visits_of(pose), width)),
    )
    q = basis(flat(np.concatenate(point.required_columns, axis=2)))
    z = flat(point.residual[..., None])[:, 0]
    z = z - q @ (q.T @ z)
    if count <= q.shape[1] or not z.any() or parts[1].squares < UNMOVED * count:
        return None
    means, squares = moments(parts, q, z, count)
    unit = 1.0 / np.sqrt(np.diag(means))
    sizes = nnls(means * np.outer(unit, unit), squares * unit)[0] * unit
    assumed = fitted.factor * (count + weights.shared**2 * parts[0].squares)
    total = sizes[0] * count + sum(s * part.squares for s, part in zip(sizes[1:], parts, strict=True))
    if not total > 0:
        return None
    # how large all of it is, the fit has estimated
    own, *shared = (sizes * assumed / total).tolist()
    return Scatter(own, tuple(shared), parts, weights, fitted.factor)


def with_scatter_of_joints(fitted: Fit) -> Fit:
    """The fit with the covariance that its parameters have by the scatter of the joints too."""
    scatter = scatter_of(fitted) if fitted.unknowns else None
    if scatter is None:
        return fitted
    moves, nuisance = (np.nan_to_num(fitted.weights(x)) for x in fitted.point.required_columns)
    known = fitted.campaign.nuisance_prior(fitted.point.nuisances)[0] * prior_weight(fitted.factor)
    frames = basis(np.concatenate([nuisance, known]))
    outside = np.concatenate([moves, np.zeros((len(known), moves.shape[1]))])
    outside -= frames @ (frames.T @ outside)
    unit = scales(fitted.unknowns)
    gain = fitted.covariance / np.outer(unit, unit) / fitted.factor @ outside[: len(moves)].T
    return replace(fitted, covariance=fitted.covariance + scatter.excess(gain) * np.outer(unit, unit))


def visits_of(pose: Ints) -> Ints:
    """(R,) number of the visit of each reading, by their ``pose`` (R,): rows of one pose after each other are one."""
    return np.asarray(np.cumsum(np.append(0, np.diff(pose) != 0)))


def _shifts(weights: Weighting) -> Floats:
    """(R, 3 or 6, 3) what a shift along each axis does to a reading."""
    count, width = weights.weight.shape
    shifts = np.zeros((count, width, 3))
    shifts[:, :3] = np.eye(3)
    return shifts


def _joints(fitted: Fit) -> Floats:
    """(R, 3 or 6, m) [m, rad] what each joint does to a reading, per usual size of its zero."""
    campaign, point = fitted.campaign, fitted.point
    model = point.model
    if all(term.effect.name != JointOffset.name for term in model.terms):
        model = model.with_effect(JointOffset(model.robot.joints))
    of = next(i for i, term in enumerate(model.terms) if term.effect.name == JointOffset.name)
    return np.nan_to_num(
        columns(campaign, model, unknowns_of(model, of), predicted_in(model, point), point.nuisances)
    )


def moments(parts: Sequence[Part], q: Floats, z: Floats, count: int) -> tuple[Floats, Floats]:
    """(M, M) matrix that gives the means of squares of what is left, ``z`` (n,), by itself and along each of the
    ``parts`` of its scatter, M - 1 of them, of the sizes of these, and the squares (M,); ``q`` (n, k): what a fit has
    taken out; ``count``: how many of n numbers count."""
    size = 1 + len(parts)
    means, squares = np.zeros((size, size)), np.zeros(size)
    means[0, 0], squares[0] = count - q.shape[1], z @ z
    along = [part.sums(q) for part in parts]
    for i, part in enumerate(parts):
        squares[1 + i] = float((part.sums(z[:, None]) ** 2).sum())
        means[0, 1 + i] = means[1 + i, 0] = part.squares - float((along[i] ** 2).sum())
        for k in range(i + 1):
            other = parts[k]
            # both sums over the numbers that are in one group of each
            _, both = np.unique(np.stack([part.group, other.group]), axis=1, return_inverse=True)
            pairs = Part(part.moves, both).sums(other.moves)
            first = np.unique(both, return_index=True)[1]
            ones = [np.unique(p.group, return_inverse=True)[1][first] for p in (part, other)]
            crossed = float((pairs * np.einsum("gak,gbk->gab", along[i][ones[0]], along[k][ones[1]])).sum())
            grams = [np.einsum("gak,gal->kl", a, a) for a in (along[i], along[k])]
            value = float((pairs**2).sum()) - 2.0 * crossed + float((grams[0] * grams[1]).sum())
            means[1 + i, 1 + k] = means[1 + k, 1 + i] = value
    return means, squares
