"""All steps from readings to a verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.diagnosis.agreement import AGREES, largest_disagreement, without_effects
from postproc.diagnosis.candidate_fits import ChoiceFits, with_effects
from postproc.diagnosis.candidates import EVERY, Candidate
from postproc.diagnosis.equivalent_models import cover_equivalent_models
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.sample import sample_of
from postproc.diagnosis.search import model_unknowns, search
from postproc.diagnosis.search_result import Key, Search
from postproc.diagnosis.unmoved_parameters import restore_unmoved_parameters
from postproc.diagnosis.unstated_geometry import take_in_unstated_geometry
from postproc.diagnosis.verdict import (
    AS_WELL,
    FORMLESS,
    ONLY_TOGETHER,
    SIZE_UNDETERMINED,
    Verdict,
    judge,
    refitted,
    with_estimates,
)
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.identification.noise import Weighting
from postproc.model import StiffnessModel

FEWEST_POSES = 8
"""Fewer allow no verdict."""

AGAIN = 3
"""Times that the search is done again without what did not hold."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """stated: the robot file as it is, tracker and targets found; where: patterns in its residuals; search, verdict;
    final: the final model, of what is named, or of its own parameters refitted (``base``); disagreement [m]: the
    largest over the workspace of what explanations predict that cannot be distinguished, one of each set; ``agreed``:
    it is so small that the correction is the same; clear_is_better: what is named without being ambiguous fits better
    by itself than the robot file does."""

    stated: Fit
    where: tuple[ResidualPattern, ...]
    search: Search
    verdict: Verdict
    final: Fit
    base: Fit
    disagreement: tuple[float, ...] = ()
    agreed: bool = False
    clear_is_better: bool = True


def diagnose(
    campaign: Campaign,
    model: StiffnessModel,
    stage: Callable[[str], None] = lambda name: None,
    goes_on: Callable[[Search], bool] = lambda found: True,
) -> Diagnosis:
    """Raises Refusal DIA001 with too few poses for any verdict, and as ``fit`` does.  ``goes_on``: whether a search of
    which something is rejected is done again without that."""
    if campaign.poses < FEWEST_POSES:
        raise Refusal(
            Finding(
                "DIA001",
                f"{campaign.poses} poses are too few for a verdict; at least {FEWEST_POSES} are needed",
                campaign.readings.where(0)[0],
                help="`compensate plan` proposes poses to measure",
            )
        )
    rows, own = np.ones(len(campaign), bool), model_unknowns(model)
    stage("comparing")
    stated = fit(campaign, model, (), rows)
    stage("fitting the model's own parameters")
    sample = sample_of(campaign)
    base = fit(sample, model, own, nuisances=stated.point.nuisances, complete=False)
    stage("looking for what is missing")
    fits = ChoiceFits(sample, base)
    result = search(fits)
    verdict = judge(result)
    rejected = list(verdict.rejected)
    for _ in range(AGAIN):
        # of what has no form that is known others would only be imitations
        if not verdict.rejected or any(why in FORMLESS for _, why in verdict.rejected):
            break
        if not goes_on(result):
            break
        result = search(fits, _banned(rejected))
        verdict = judge(result)
        rejected += verdict.rejected
    if sample is not campaign:
        stage("fitting all readings")
        base = _fitted_to(campaign, base)
        result = replace(result, whole=_fitted_to(campaign, result.final) if result.chosen else base)
        verdict = judge(result)
    if verdict.word == "nothing_missing" and any(why == SIZE_UNDETERMINED for _, why in rejected):
        verdict = replace(verdict, word="unknown")
    # zeros that belong to the geometry of the whole arm are fitted with it
    names = [
        named.candidate for named in verdict.named if named.candidate.key in {c.key for c in result.chosen}
    ]
    final = _of_names(base, result.confirmed, result, names)
    disagreement: tuple[float, ...] = ()
    agreed, clear_is_better = False, True
    if verdict.alternatives:
        stage("comparing the explanations over the workspace")
        # as it will be written: what the readings do not ask for makes no difference
        searched = restore_unmoved_parameters(_of_names(result.base, result.final, result, names))
        disagreement = tuple(
            largest_disagreement(sample, result.base, searched, names, one) for one in verdict.alternatives
        )
        scatter = np.sqrt(3 * np.mean(final.noise.sigma**2) * (1.0 if final.noise.known else final.factor))
        differ = [
            one[0]
            for one, by in zip(verdict.alternatives, disagreement, strict=True)
            if not by <= AGREES * scatter
        ]
        agreed = not differ
        if len(differ) == len(names):
            final = base
        elif differ:
            clear, bare = (without_effects(campaign, final, gone) for gone in (differ, names))
            left = [weighted_squares(one, stated.plain_weights) for one in (clear, bare, stated)]
            final, clear_is_better = clear, left[0] < left[2]
            if left[0] > left[1]:
                # half of an explanation, which makes the readings worse by itself
                rejected += [(one.candidate, ONLY_TOGETHER) for one in verdict.named]
                verdict = replace(verdict, word="unknown", named=(), alternatives=())
                final, disagreement, agreed = base, (), False
    before, every = {u.key for u in final.unknowns}, take_in_unstated_geometry(final)
    additional = {u.key for u in every.unknowns} - before
    final = restore_unmoved_parameters(every)
    # where an effect is missing in a model its own parameters compensate for that
    complete = verdict.word != "unknown" and (agreed or not verdict.alternatives)
    moved = refitted(final, additional) if complete else ()
    final = cover_equivalent_models(final, every, result.base, names)
    if moved:
        # that something has moved is clear; which of equivalent parameters it is may not be
        by_key = {e.unknown.key: e for e in final.estimates}
        moved = refitted(final, additional) or tuple(by_key[e.unknown.key] for e in moved)
    verdict = with_estimates(verdict, final, result)
    verdict = replace(verdict, rejected=tuple(rejected), refitted=moved)
    where = residual_patterns(stated, result.confirmed)
    return Diagnosis(stated, where, result, verdict, final, base, disagreement, agreed, clear_is_better)


def _banned(rejected: Sequence[tuple[Candidate, str]]) -> list[Key]:
    """Keys of what did not hold; where another course over its joint does as well, nor does it as one of all joints."""
    keys = [candidate.key for candidate, _ in rejected]
    return keys + [(candidate.key[0], EVERY) for candidate, why in rejected if why == AS_WELL]


def weighted_squares(fitted: Fit, weights: Weighting) -> float:
    """The squares that remain after a fit."""
    residual = weights(np.nan_to_num(fitted.point.residual))
    return float(residual @ residual)


def _fitted_to(campaign: Campaign, fitted: Fit) -> Fit:
    """A fit of some readings, fitted to all of them; what those do not give keeps its value."""
    found = fit(
        campaign,
        fitted.model,
        fitted.unknowns,
        nuisances=fitted.point.nuisances,
        near=True,
        factor=fitted.factor,
    )
    return replace(found, asked=fitted.asked, dropped=(*fitted.dropped, *found.dropped))


def _of_names(base: Fit, chosen: Fit, result: Search, names: Sequence[Candidate]) -> Fit:
    """The fit with those effects of ``result`` that are named: ``base`` without any, ``chosen`` with all."""
    if not names:
        return base
    return chosen if len(names) == len(result.chosen) else with_effects(base.campaign, base, names)
