"""What setups would show of the unknowns: the sensitivities that identification uses, in standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from postproc.base.arrays import Floats
from postproc.experiments.candidate_setups import CandidateSetups, Setups, readings_of
from postproc.identification.campaign import SCALE, SCALE_NAME, Campaign, Nuisances
from postproc.identification.identifiable import COVERAGE, Identifiability, identifiability
from postproc.identification.least_squares import prior_rows, scales
from postproc.identification.noise import Weighting, noise_of, weighting
from postproc.identification.registration import registered
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

MOVES = 1e-9
"""[m] An effect whose parameters move no reading further is dormant."""


@dataclass(frozen=True)
class Observability:
    """Whitened readings of C setups, r numbers each (0 where nothing is seen): ``columns`` (C, r, P) of the unknowns,
    per ``scale``, and ``nuisance`` (C, r, U) with its ``names``."""

    columns: Floats
    nuisance: Floats
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.columns)

    def __add__(self, other: Observability) -> Observability:
        return Observability(
            np.concatenate([self.columns, other.columns]),
            np.concatenate([self.nuisance, other.nuisance]),
            self.names,
        )

    def __getitem__(self, rows: Any) -> Observability:
        return Observability(self.columns[rows], self.nuisance[rows], self.names)


def observability(
    model: StiffnessModel, unknowns: Sequence[Unknown], candidates: CandidateSetups, setups: Setups
) -> Observability:
    """What ``setups`` show under ``model``; NaN where it has no equilibrium."""
    campaign = Campaign(readings_of(model, candidates, setups))
    predicted, given = campaign.predicted(model), _placed(campaign, candidates)
    derivatives = columns(campaign, model, unknowns, predicted, given)
    nuisance = campaign.nuisance_columns(predicted, given)
    return Observability(
        _whitened(candidates, setups, derivatives),
        _whitened(candidates, setups, nuisance),
        campaign.nuisance_names,
    )


def expected(model: StiffnessModel, candidates: CandidateSetups, setups: Setups) -> Floats:
    """(C, r) whitened, what the readings of ``setups`` would be; NaN where the model has no equilibrium."""
    campaign = Campaign(readings_of(model, candidates, setups))
    places = campaign.expected(campaign.predicted(model), _placed(campaign, candidates))[0]
    return _whitened(candidates, setups, places)


def _placed(campaign: Campaign, candidates: CandidateSetups) -> Nuisances:
    """Tracker in the robot base, targets where they are about."""
    given, into = campaign.start(), candidates.tool.inverse()
    return (
        replace(given, places=candidates.places @ into.rotation.T + into.position)
        if candidates.targets
        else given
    )


def _whitened(candidates: CandidateSetups, setups: Setups, values: Floats) -> Floats:
    """(C, r, ...) of ``values`` (R, 3, ...) [m] of the readings of ``setups``: in standard deviations, independent; 0
    of targets out of sight."""
    visible = np.tile(setups.visible, (1, setups.load.shape[1]))
    weight = np.repeat(visible.reshape(-1, 1), 3, axis=1) / candidates.sigma
    pose = np.repeat(np.arange(len(setups)), visible.shape[1])
    whitened = Weighting(weight, pose, candidates.shared)(values)
    return np.asarray(whitened.reshape(len(setups), 3 * visible.shape[1], *values.shape[2:]))


def measured(
    model: StiffnessModel, unknowns: Sequence[Unknown], campaign: Campaign, sigma: float
) -> Observability:
    """What readings that exist show: one setup of all.  ``sigma`` [m] where they do not state their own scatter."""
    noise = noise_of(campaign.readings)
    if not noise.known:
        noise = replace(noise, sigma=np.full(len(campaign), sigma))
    predicted = campaign.predicted(model)
    given = registered(campaign, predicted, np.ones(len(campaign), bool))
    weights = weighting(campaign, noise, campaign.residual(predicted, given))
    derivatives = weights(columns(campaign, model, unknowns, predicted, given))
    return Observability(
        derivatives[None], weights(campaign.nuisance_columns(predicted, given))[None], campaign.nuisance_names
    )


def influential(
    model: StiffnessModel, unknowns: Sequence[Unknown], candidates: CandidateSetups, setups: Setups
) -> StiffnessModel:
    """The model with the effects that move nothing where they are at the sizes of their parameters: a fit starts
    there too."""
    still = (
        np.nan_to_num(np.abs(observability(model, unknowns, candidates, setups).columns)).max(axis=(0, 1))
        == 0
    )
    dormant = {
        unknown.key: unknown.parameter.scale
        for unknown in unknowns
        if all(still[i] for i, other in enumerate(unknowns) if other.term == unknown.term)
        and model.terms[unknown.term].values[unknown.parameter.name] == unknown.parameter.null
    }
    if not dormant:
        return model
    moves = np.nan_to_num(
        np.abs(observability(model.with_values(dormant), unknowns, candidates, setups).columns)
    ).max(axis=(0, 1))
    wakes = {unknown.term for i, unknown in enumerate(unknowns) if moves[i] * candidates.sigma > MOVES}
    woken = {key: value for key, value in dormant.items() if key[0] in wakes}
    return model.with_values(woken) if woken else model


def judged(
    model: StiffnessModel,
    unknowns: Sequence[Unknown],
    some: Observability,
    before: Observability | None = None,
) -> tuple[Floats, Identifiability]:
    """The 95 % intervals (P,) [SI] that a fit to ``some`` setups, and to readings from ``before``, will state, NaN of
    what it must leave out; and why."""
    columns, nuisance, names = _rows(some)
    if before is not None:
        more, apart, others = _rows(before)
        columns = np.concatenate([columns, more])
        both = np.zeros((len(columns), len(names) + len(others)))
        both[: len(nuisance), : len(names)], both[len(nuisance) :, len(names) :] = nuisance, apart
        nuisance, names = both, (*names, *others)
    scales_of_trackers = [k for k, name in enumerate(names) if name == SCALE_NAME]
    known = np.zeros((len(scales_of_trackers), len(names)))
    known[np.arange(len(known)), scales_of_trackers] = 1.0 / SCALE
    columns = np.concatenate([columns, np.zeros((len(known), columns.shape[1]))])
    nuisance = np.concatenate([nuisance, known])
    values = np.array([model.terms[u.term].values[u.parameter.name] for u in unknowns])
    analysis = identifiability(unknowns, columns, nuisance, names, prior_rows(unknowns), values)
    ci95 = np.full(len(unknowns), np.nan)
    ci95[list(analysis.observable)] = COVERAGE * np.sqrt(np.diag(analysis.covariance))
    return ci95 * scales(unknowns), analysis


def _rows(some: Observability) -> tuple[Floats, Floats, tuple[str, ...]]:
    """(n, P) and (n, U): all readings below each other."""
    count = some.columns.shape[0] * some.columns.shape[1]
    columns, nuisance = (part.reshape(count, part.shape[2]) for part in (some.columns, some.nuisance))
    return columns, nuisance, some.names
