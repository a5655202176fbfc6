"""Poses that distinguish two effects: where each, fitted to what the other would show, fails most (T-optimal)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats
from postproc.experiments.candidate_setups import CandidateSetups, Setups, drawn, spacings, spreads
from postproc.experiments.criteria import Disagreement
from postproc.experiments.exchange import CandidateSet, exchanged, grown
from postproc.experiments.observability import Observability, expected, observability
from postproc.experiments.pool import (
    CANDIDATES,
    Choice,
    Pool,
    Stage,
    enough,
    pooled,
    refined,
    rested,
    silent,
)
from postproc.identification.campaign import Campaign, Nuisances
from postproc.identification.identifiable import basis
from postproc.identification.least_squares import prior_rows
from postproc.identification.noise import Weighting
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

LOOSE = 1e-4
"""Length of the rows that hold what is fitted, columns of length one: what no setup shows is fitted to nothing."""


@dataclass(frozen=True)
class CompetingModel:
    """An explanation at C setups, whitened: ``pattern`` (C, r, k) that it would show, or several where nothing is known
    but sizes; ``columns`` (C, r, P): what a fit of it can imitate."""

    pattern: Floats
    columns: Floats


@dataclass(frozen=True)
class Chosen:
    """setups: rows of the choice; separation: standard deviations by which it shows that the first is no case of the
    second, and vice versa."""

    setups: tuple[int, ...]
    separation: tuple[float, float]


def rivalry(
    first: CompetingModel,
    second: CompetingModel,
    common: Floats,
    q: Floats,
    spacing: Floats,
    spread: Floats | None = None,
    before: Floats | None = None,
) -> tuple[CandidateSet, Disagreement]:
    """The choices, and what is to be maximized: ``common`` (C, r, U) is fitted by both; q (C, n), spacing (n,) and
    spread (n,) as in ``CandidateSet``; ``before`` (b, p): the same of what is known already, both patterns, common and
    both columns side by side."""
    fitted = np.concatenate([common, first.columns, second.columns], axis=2)
    length = np.linalg.norm(fitted, axis=(0, 1))
    length = np.where(length > 0, length, 1.0)
    fitted = fitted / length
    k, u = (first.pattern.shape[2], second.pattern.shape[2]), common.shape[2]
    p, shown = (first.columns.shape[2], second.columns.shape[2]), sum(k)
    shared = np.arange(shown, shown + u)
    own = np.arange(shown + u, shown + u + p[0])
    other = np.arange(shown + u + p[0], shown + u + sum(p))
    pairs = (
        (np.arange(k[0]), np.concatenate([shared, other])),
        (np.arange(k[0], shown), np.concatenate([shared, own])),
    )
    base = np.diag(np.repeat([0.0, LOOSE**2], [shown, fitted.shape[2]]))
    if before is not None:
        known = before / np.concatenate([np.ones(shown), length])
        base = base + known.T @ known
    rows = np.concatenate([first.pattern, second.pattern, fitted], axis=2)
    return CandidateSet(rows, q, spacing, base, spread), Disagreement(pairs)


def discriminating(
    first: CompetingModel,
    second: CompetingModel,
    common: Floats,
    q: Floats,
    spacing: Floats,
    count: int,
    start_choice: Sequence[int] = (),
    spread: Floats | None = None,
    before: Floats | None = None,
) -> Chosen:
    """The ``count`` setups that keep the two furthest apart, the smaller of both separations; ``common`` (C, r, U),
    ``q`` (C, n), ``spacing`` (n,), ``spread`` (n,), ``before`` (b, p) as of ``rivalry``.

    ``start_choice``: a choice to start with.
    """
    choices, criterion = rivalry(first, second, common, q, spacing, spread, before)
    chosen, _ = exchanged(choices, criterion, grown(choices, criterion, start_choice, count))
    one, two = np.sqrt(criterion.separations(choices.information(chosen))).tolist()
    return Chosen(tuple(chosen), (one, two))


@dataclass(frozen=True)
class Discrimination:
    """Poses that distinguish two effects, by their number, and the separations [standard deviations]: that the first is
    no case of the second, and vice versa.  candidates: number of poses to choose from."""

    candidates: int
    chosen: dict[int, Setups]
    separation: dict[int, tuple[float, float]]


def apart(
    model: StiffnessModel,
    first: Sequence[Unknown],
    second: Sequence[Unknown],
    common: Sequence[Unknown],
    candidate_setups: CandidateSetups,
    sizes: Iterable[int],
    seed: int = 1,
    candidates: int = CANDIDATES,
    stage: Stage = silent,
    before: KnownReadings | None = None,
) -> Discrimination:
    """Poses at which two effects, given by their parameters in ``model``, disagree most when each is fitted, together
    with ``common`` and the nuisances, to what the other would show.

    An effect shows what its values in the model make of it; one without values shows each of its parameters at its
    usual size, in the mean.  Dimensions of hardware that are known are not fitted.  ``before``: what was read already,
    which the new readings are fitted together with, and what is known of ``common``, whose priors count then.

    Raises Refusal PLN001 (no pose can be measured), PLN003 (no rest), PLN004 (not enough distinct poses).
    """
    rng = np.random.default_rng(seed)
    stage("looking for poses")
    setups = drawn(model, candidate_setups, candidates, rng)
    one, two, both = ([u for u in unknowns if u.prior is None] for unknowns in (first, second, common))
    if before is not None:
        both = list(common)
    spacing, spread = spacings(model.robot, candidate_setups.spacing), spreads(candidate_setups)
    widths = [_patterns(model, one), _patterns(model, two), len(one), len(two)]
    separation: dict[int, tuple[float, float]] = {}

    def evaluated(some: Setups) -> Pool:
        alternatives = (
            _alternative(model, one, two, candidate_setups, some),
            _alternative(model, two, one, candidate_setups, some),
        )
        fitted = observability(model, both, candidate_setups, some)
        parts = [alternative.pattern for alternative in alternatives] + [
            alternative.columns for alternative in alternatives
        ]
        columns = np.concatenate([*parts, fitted.columns, fitted.nuisance], axis=2)
        return pooled(some, Observability(columns, columns[:, :, :0], ()))

    def chosen_from(pool: Pool, start_choice: Choice) -> Choice:
        parts = np.split(pool.shown.columns, np.cumsum(widths), axis=2)
        alternatives = CompetingModel(parts[0], parts[2]), CompetingModel(parts[1], parts[3])
        by_size: dict[int, Sequence[int]] = {}
        last: Sequence[int] = ()
        for size in sorted(sizes):
            done = discriminating(
                *alternatives,
                parts[4],
                pool.setups.q,
                spacing,
                size,
                start_choice.get(size, last),
                spread,
                known,
            )
            by_size[size] = last = done.setups
            separation[size] = done.separation
        return by_size

    stage("computing what poses show")
    start = rested(model, setups, evaluated)
    known = None
    if before is not None:
        nuisances = start.shown.columns.shape[2] - sum(widths) - len(both)
        known = before.rows(model, one, two, both, nuisances)
    pool, chosen = refined(model, candidate_setups, start, evaluated, chosen_from, rng, stage)
    for size, rows in chosen.items():
        enough(model, candidate_setups, size, len(rows))
    return Discrimination(
        len(start), {size: pool.setups[list(rows)] for size, rows in chosen.items()}, separation
    )


@dataclass(frozen=True)
class KnownReadings:
    """Readings that were taken already: ``campaign``, where tracker and targets were found, ``nuisances``, and the
    ``weights`` that they count with."""

    campaign: Campaign
    nuisances: Nuisances
    weights: Weighting

    def rows(
        self,
        model: StiffnessModel,
        one: Sequence[Unknown],
        two: Sequence[Unknown],
        common: Sequence[Unknown],
        apart: int,
    ) -> Floats:
        """(n + k, p) as of ``rivalry``, outside of what tracker and targets explain, and the k priors of ``common``;
        ``apart`` columns of nothing for tracker and targets of the new readings, that may be others."""
        at_fit = self.campaign.predicted(model)
        nuisance = self._whitened(self.campaign.nuisance_columns(at_fit, self.nuisances))
        parts: list[Floats] = []
        for own, other in ((one, two), (two, one)):
            without = model.with_values({u.key: u.parameter.null for u in other})
            there = self.campaign.predicted(without)
            bare = self.campaign.predicted(without.with_values({u.key: u.parameter.null for u in own}))
            does = self.campaign.residual(bare, self.nuisances) - self.campaign.residual(
                there, self.nuisances
            )
            moves = columns(self.campaign, without, own, there, self.nuisances)
            parts += [
                self._whitened(does[:, :, None] if _has_values(model, own) else moves),
                self._whitened(moves),
            ]
        every = self._whitened(columns(self.campaign, model, common, at_fit, self.nuisances))
        stacked = np.concatenate([parts[0], parts[2], every, parts[1], parts[3]], axis=1)
        frames = basis(nuisance)
        stacked = stacked - frames @ (frames.T @ stacked)
        before = [parts[0].shape[1] + parts[2].shape[1], parts[1].shape[1] + parts[3].shape[1]]
        priors = prior_rows(common)
        known = np.concatenate(
            [np.zeros((len(priors), before[0])), priors, np.zeros((len(priors), before[1]))], axis=1
        )
        both = np.concatenate([stacked, known[priors.any(axis=1)]])
        place = before[0] + len(common)
        return np.concatenate([both[:, :place], np.zeros((len(both), apart)), both[:, place:]], axis=1)

    def _whitened(self, values: Floats) -> Floats:
        return np.nan_to_num(self.weights(values))


def _patterns(model: StiffnessModel, own: Sequence[Unknown]) -> int:
    """How many patterns an effect may show: one where it has values."""
    return 1 if _has_values(model, own) else len(own)


def _has_values(model: StiffnessModel, own: Sequence[Unknown]) -> bool:
    return any(model.terms[u.term].values[u.parameter.name] != u.parameter.null for u in own)


def _alternative(
    model: StiffnessModel,
    own: Sequence[Unknown],
    other: Sequence[Unknown],
    candidates: CandidateSetups,
    setups: Setups,
) -> CompetingModel:
    """One explanation, in a model without the other."""
    without = model.with_values({u.key: u.parameter.null for u in other})
    if not _has_values(model, own):
        columns = observability(
            without.with_values({u.key: u.parameter.scale for u in own}), own, candidates, setups
        ).columns
        return CompetingModel(columns, columns)
    bare = without.with_values({u.key: u.parameter.null for u in own})
    pattern = expected(without, candidates, setups) - expected(bare, candidates, setups)
    return CompetingModel(pattern[:, :, None], observability(without, own, candidates, setups).columns)
