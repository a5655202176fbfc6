"""What the readings determine of the unknowns: rank, columns that must be left out, sums, correlations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats
from postproc.identification.unknowns import Unknown

UNSEEN = 1e-4
"""Standard deviations of all readings together by which a parameter of its usual size must move them, also beside the
others: columns are no better."""

REDUNDANT = 1e-5
"""A column whose part outside of the others is smaller than this share of it adds nothing."""

FAR = 10.0
"""Usual sizes of a parameter."""

HARDLY = 3.0
"""What is plausible of geometry over what the readings leave uncertain of it, up to which it stays as it is stated: the
zero of the last axis, say, beside targets that may lie anywhere on the tool."""

PART = 1e-3
"""A smaller share of a dropped column is not worth naming."""

COVERAGE = 1.96


@dataclass(frozen=True)
class Dropped:
    """An unknown that the readings cannot give: ``why`` in words, and with which others (name -> weight) it only shows
    together."""

    name: str
    why: str
    together: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Identifiability:
    """observable: unknowns that the readings determine; dropped: the others; covariance (k, k) of the former in units
    of their ``scale``, for readings of unit variance; condition: of their columns, scaled to one length."""

    observable: tuple[int, ...]
    dropped: tuple[Dropped, ...]
    covariance: Floats
    condition: float


def identifiability(
    unknowns: Sequence[Unknown],
    columns: Floats,
    nuisance: Floats,
    nuisance_names: Sequence[str],
    prior: Floats,
    values: Floats,
    factor: float = 1.0,
    most: float = np.inf,
) -> Identifiability:
    """What whitened ``columns`` (n, P) of the unknowns, per scale, and ``nuisance`` (n, U) determine.

    prior (P, P): rows of the priors; values (P,) [SI] of the model; factor: variance of the readings over the assumed
    one, of which ``most`` at most is scatter by which an unknown is judged.  Columns are judged after what the
    nuisances explain is taken out, in their order: one that those before it can imitate is left out.  Then the least
    certain is, as long as one states nothing: its 95 % interval is wider than its value, and than the stated one or,
    where none is stated, ``FAR`` times the parameter's usual size.
    """
    frames = basis(nuisance)
    outside = np.concatenate([columns - frames @ (frames.T @ columns), prior])
    whole = np.concatenate([columns, prior])
    observable: list[int] = []
    dropped: list[Dropped] = []
    frame = np.empty((len(outside), 0))
    for k, unknown in enumerate(unknowns):
        size = float(np.linalg.norm(whole[:, k]))
        if size < UNSEEN:
            dropped.append(Dropped(unknown.name, "no reading depends on it"))
            continue
        own = float(np.linalg.norm(outside[: len(columns), k]))
        if unknown.gauge and own < max(REDUNDANT * size, UNSEEN, _hardly_told(unknown, min(factor, most))):
            dropped.append(_explained(k, unknowns, (), whole, nuisance, nuisance_names))
            continue
        rest = outside[:, k] - frame @ (frame.T @ outside[:, k])
        rest -= frame @ (frame.T @ rest)
        length = float(np.linalg.norm(rest))
        if length < (UNSEEN if unknown.gauge else max(REDUNDANT * size, UNSEEN)):
            dropped.append(_explained(k, unknowns, observable, whole, nuisance, nuisance_names))
            continue
        frame = np.column_stack([frame, rest / length])
        observable.append(k)
    while observable:
        part = outside[:, observable]
        covariance = _inverse(part) * factor
        wide = COVERAGE * np.sqrt(
            np.diag(covariance if most >= factor else _judged(part, prior, factor, most))
        )
        limit = np.array([_limit(unknowns[k], values[k]) / unknowns[k].parameter.scale for k in observable])
        worst = int(np.argmax(wide / limit))
        if wide[worst] <= limit[worst]:
            length = np.linalg.norm(part, axis=0)
            values_of = np.linalg.svd(part / length, compute_uv=False)
            return Identifiability(
                tuple(observable), tuple(dropped), covariance, float(values_of[0] / values_of[-1])
            )
        unknown = unknowns[observable[worst]]
        wider = wide[worst] * unknown.parameter.scale
        dropped.append(
            Dropped(unknown.name, f"is observable too weakly: +- {wider:.2g} {unknown.parameter.unit}")
        )
        del observable[worst]
    return Identifiability((), tuple(dropped), np.zeros((0, 0)), np.nan)


def _hardly_told(unknown: Unknown, factor: float) -> float:
    """Length of an unknown's column, per scale and outside of the nuisances, up to which the readings tell of it little
    beside what is plausible anyway, even if all else were known."""
    assert unknown.prior is not None
    return float(HARDLY * unknown.parameter.scale * np.sqrt(factor) / unknown.prior)


def _limit(unknown: Unknown, value: float) -> float:
    """[SI] An interval wider than this states nothing of the unknown; of geometry, what is not distinguished is in the
    interval."""
    if unknown.gauge:
        return np.inf
    null = unknown.parameter.null
    stated = unknown.stated
    usual = 0.0 if stated is None else abs(stated.value - null)
    if stated is not None and stated.interval and stated.interval > usual:
        usual = 0.0  # hardly another value than the null
    return max(abs(value - null), usual or FAR * unknown.parameter.scale)


def basis(columns: Floats) -> Floats:
    """(n, r) orthonormal columns that span ``columns`` (n, U), as far as they are independent."""
    length = np.linalg.norm(columns, axis=0)
    used = columns[:, length > 0] / length[length > 0]
    if not used.shape[1]:
        return np.zeros((len(columns), 0))
    u, s, _ = np.linalg.svd(used, full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s[0]])


def _judged(part: Floats, prior: Floats, factor: float, most: float) -> Floats:
    """The covariance of the columns ``part`` (n + P, k), whose last rows are of priors beside readings of the variance
    ``factor``, where that of the readings is ``most``."""
    weight = np.ones(len(part))
    weight[len(part) - len(prior) :] = np.sqrt(most / factor)
    return np.asarray(_inverse(part * weight[:, None]) * most)


def _inverse(part: Floats) -> Floats:
    """(A^T A)^-1 by the R of A's columns, each scaled to length one."""
    length = np.linalg.norm(part, axis=0)
    back = np.linalg.inv(np.linalg.qr(part / length, mode="r")) / length[:, None]
    return np.asarray(back @ back.T)


def _explained(
    k: int,
    unknowns: Sequence[Unknown],
    observable: Sequence[int],
    columns: Floats,
    nuisance: Floats,
    nuisance_names: Sequence[str],
) -> Dropped:
    """Which of the observable columns and nuisances the column ``k`` is made of."""
    padded = np.concatenate([nuisance, np.zeros((len(columns) - len(nuisance), nuisance.shape[1]))])
    others = np.concatenate([columns[:, list(observable)], padded], axis=1)
    length = np.linalg.norm(others, axis=0)
    length[length == 0] = 1.0
    share = np.linalg.lstsq(others / length, columns[:, k], rcond=1e-9)[0]
    size = np.linalg.norm(columns[:, k])
    names = [unknowns[i].name for i in observable]
    weights = share / length
    parts = [i for i in np.argsort(-np.abs(share)) if abs(share[i]) > PART * size]
    own = unknowns[k].parameter.scale
    together = tuple(
        (names[i], float(weights[i] * unknowns[observable[i]].parameter.scale / own))
        for i in parts
        if i < len(observable)
    )
    frames = sorted(
        {nuisance_names[i - len(observable)].split(".")[0] for i in parts if i >= len(observable)}
    )
    words = [name for name, _ in together] + [f"the {frame}" for frame in frames]
    return Dropped(unknowns[k].name, f"is observable only together with {', '.join(words)}", together)


def strong_correlations(
    names: Sequence[str], covariance: Floats, above: float
) -> tuple[tuple[str, str, float], ...]:
    """Pairs of ``covariance`` (P, P) with a correlation of more than ``above``, strongest first."""
    deviation = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    pairs = [
        (names[i], names[k], float(correlation[i, k]))
        for i in range(len(names))
        for k in range(i)
        if abs(correlation[i, k]) > above
    ]
    return tuple(sorted(pairs, key=lambda pair: -abs(pair[2])))
