"""All steps from readings to a verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.diagnosis.agreement import AGREES, largest_disagreement, without_effects
from postproc.diagnosis.candidate_fits import with_effects
from postproc.diagnosis.residual_patterns import ResidualPattern, residual_patterns
from postproc.diagnosis.search import model_unknowns, search
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.verdict import OTHER_COURSE, SIZE_UNDETERMINED, Verdict, judge, refitted
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.model import StiffnessModel

FEWEST_POSES = 8
"""Fewer allow no verdict."""

AGAIN = 3
"""Times that the search is done again without what did not hold."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """stated: the robot file as it is, tracker and targets found; where: patterns in its residuals; search, verdict;
    final: the final model, of what is named, or of its own parameters refitted; disagreement [m]: the largest over the
    workspace of what explanations predict that cannot be distinguished, one of each set; ``agreed``: it is so small
    that the correction is the same."""

    stated: Fit
    where: tuple[ResidualPattern, ...]
    search: Search
    verdict: Verdict
    final: Fit
    disagreement: tuple[float, ...] = ()
    agreed: bool = False


def diagnose(
    campaign: Campaign, model: StiffnessModel, stage: Callable[[str], None] = lambda name: None
) -> Diagnosis:
    """Raises Refusal DIA001 with too few poses for any verdict, and as ``fit`` does."""
    if campaign.poses < FEWEST_POSES:
        raise Refusal(
            Finding(
                "DIA001",
                f"{campaign.poses} poses are too few for a verdict; at least {FEWEST_POSES} are needed",
                campaign.readings.where(0)[0],
                help="`compensate plan` proposes poses to measure",
            )
        )
    every = np.ones(len(campaign), bool)
    stage("comparing")
    stated = fit(campaign, model, (), every)
    stage("fitting the model's own parameters")
    base = fit(campaign, model, model_unknowns(model), every, given=stated.point.given)
    stage("looking for what is missing")
    result = search(campaign, base)
    verdict = judge(result)
    rejected = list(verdict.rejected)
    for _ in range(AGAIN):
        # of what has no form that is known others would only be imitations
        if not verdict.rejected or any(why == OTHER_COURSE for _, why in verdict.rejected):
            break
        result = search(campaign, base, [candidate.key for candidate, _ in rejected])
        verdict = judge(result)
        rejected += verdict.rejected
    if verdict.word == "nothing_missing" and any(why == SIZE_UNDETERMINED for _, why in rejected):
        verdict = replace(verdict, word="unknown")
    # zeros that belong to the geometry of the whole arm are fitted with it
    names = [
        named.candidate for named in verdict.named if named.candidate.key in {c.key for c in result.chosen}
    ]
    final = result.base
    disagreement: tuple[float, ...] = ()
    agreed = False
    if names:
        final = (
            result.final if len(names) == len(result.chosen) else with_effects(campaign, result.base, names)
        )
    if verdict.alternatives:
        stage("comparing the explanations over the workspace")
        disagreement = tuple(
            largest_disagreement(campaign, result.base, final, names, one) for one in verdict.alternatives
        )
        scatter = np.sqrt(3 * np.mean(final.noise.sigma**2) * (1.0 if final.noise.known else final.factor))
        differ = [
            one[0]
            for one, by in zip(verdict.alternatives, disagreement, strict=True)
            if not by <= AGREES * scatter
        ]
        agreed = not differ
        if differ:
            final = without_effects(campaign, final, differ)
    # where an effect is missing in a model its own parameters compensate for that
    moved = refitted(final) if verdict.word not in ("ambiguous", "unknown") else ()
    verdict = replace(verdict, rejected=tuple(rejected), refitted=moved)
    where = residual_patterns(stated, result.final)
    return Diagnosis(stated, where, result, verdict, final, disagreement, agreed)
