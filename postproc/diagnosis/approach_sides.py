"""From which side each joint came, where the readings do not state it: unknown, in the order of the rows, or as the
residuals show it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding
from postproc.diagnosis.candidates import candidates
from postproc.diagnosis.diagnosis import Diagnosis, diagnose
from postproc.diagnosis.residual_patterns import patterns
from postproc.diagnosis.sample import sample_of
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import basis_of, outside
from postproc.diagnosis.verdict import AS_WELL, FORMLESS
from postproc.identification.campaign import Campaign, sense_of
from postproc.identification.joint_scatter import visits_of
from postproc.model import StiffnessModel

SOUND = ("nothing_missing", "named")
"""Verdicts that no side of approach has to mend."""

BIT = 2.0 * np.log(2.0)
"""What the choice of one of two sides costs, as -2 ln(likelihood)."""

SMALLER = 0.9
"""Share of the residual that must remain at most where sides of approach are taken from somewhere."""

WORTH_TRYING = 0.08
"""Share of the remaining squares that effects of approach must explain together before sides are tried; ``SMALLER``
asks for 0.19."""

JOINTS = 2
"""Of the joints whose sides the residuals show best, so many are tried."""


def diagnose_sides(
    campaign: Campaign, model: StiffnessModel, stage: Callable[[str], None] = lambda name: None
) -> tuple[Diagnosis, tuple[Finding, ...]]:
    """The diagnosis, and what was assumed of the sides of approach where the columns DIR do not state them.

    They are unknown first: every gear lies in the middle of its gap, or where its load puts it.  Where that leaves
    something that effects of approach may explain, however much scatter may be like it (readings of a pose share the
    side of its approach, as they share an error), the order of the rows is tried.  Where more than scatter is left,
    then sides by the residuals of one joint, each at the price of a bit for every visit of a pose; these only where an
    effect of approach then explains all of it.
    """
    readings = campaign.readings
    if readings.direction is not None:
        return diagnose(campaign, model, stage), ()
    unknown = Campaign(replace(readings, direction=np.zeros_like(readings.q)), campaign.stated_tool)
    done = diagnose(unknown, model, stage)
    if may_explain(campaign, done):
        stage("trying sides of approach")
        ordered = replace(readings, direction=sense_of(readings))
        other = diagnose(Campaign(ordered, campaign.stated_tool), model, goes_on=by_approach)
        if _is_better(other, done):
            return other, (_finding(readings.where(0)[0], "they are taken from the order of the rows"),)
    if done.verdict.conditional or done.verdict.word in SOUND:
        return done, ()
    if any(why in (AS_WELL, *FORMLESS) for _, why in done.verdict.rejected):
        return done, ()  # sides that are free to follow a course over the angles imitate it
    for joint, sides in _shown(done):
        direction = np.zeros_like(readings.q)
        direction[:, joint] = sides
        sided = Campaign(replace(readings, direction=direction), campaign.stated_tool)
        if not may_explain(sided, done):
            continue
        tried = diagnose(sided, model, goes_on=lambda found: False)
        if tried.verdict.word in (*SOUND, "ambiguous") and _is_better(tried, done):
            name = readings.joints[joint][0]
            words = f"those of {name} are taken from the residuals, which lie on two sides"
            return tried, (_finding(readings.where(0)[0], words),)
    return done, ()


def by_approach(found: Search) -> bool:
    """Whether an effect that depends on the side of approach was chosen."""
    return any(candidate.effect.by_direction for candidate in found.chosen)


def may_explain(campaign: Campaign, done: Diagnosis) -> bool:
    """Whether all effects of the sides of approach of ``campaign`` together, beside what was chosen without them,
    explain enough of the residual for a diagnosis of its own."""
    if by_approach(done.search):
        return True  # it does something else on other sides
    fitted = done.search.final
    sample = sample_of(campaign)
    found = candidates(sample, fitted.model, fitted.point.nuisances, by_direction=True)
    if any(c.nonlinear and c.columns.any() for c in found):
        return True  # what they do does not show in their columns
    weights = fitted.plain_weights
    basis = basis_of(
        np.nan_to_num(np.concatenate([weights(part) for part in fitted.point.required_columns], axis=1))
    )
    columns = [weights(np.nan_to_num(c.columns)) for c in found if c.columns.any()]
    if not columns:
        return False
    more = basis_of(outside(basis, np.concatenate(columns, axis=1)))
    residual = outside(basis, weights(fitted.point.residual)[:, None])[:, 0]
    remaining = 1.0 - float(((more.T @ residual) ** 2).sum()) / max(float(residual @ residual), 1e-300)
    # of few readings that many columns explain a part by chance
    freedom = weights.counts - basis.shape[1]
    remaining *= freedom / max(1, freedom - more.shape[1])
    return bool(remaining < 1.0 - WORTH_TRYING)


def _finding(file: str, words: str) -> Finding:
    return Finding(
        "DIA003",
        f"the sides of approach are not stated (DIR1, DIR2, ...): {words}",
        file,
        help="state in DIR1, DIR2, ... whether each axis came up (1) or down (-1) to its place",
    )


def _is_better(other: Diagnosis, done: Diagnosis) -> bool:
    """Whether an effect of approach is there, and leaves clearly less."""
    by_direction = any(
        candidate.effect.by_direction
        for candidate in [n.candidate for n in other.verdict.named]
        + [c for one in other.verdict.alternatives for c in one]
    )
    rms = [float(np.sqrt(np.nanmean(one.search.confirmed.residual**2))) for one in (other, done)]
    return by_direction and rms[0] < SMALLER * rms[1]


def _shown(done: Diagnosis) -> list[tuple[int, Floats]]:
    """Joints whose turn by one width, to one side or the other at each visit, explains the residual best, and the
    sides (R,): -1 where the joint stopped above its place.

    Where an effect of approach was found with every gear in the middle of its gap, residuals are those from there; of
    a deflection the side is that of the unloaded joint, which is subtracted."""
    gaps = by_approach(done.search)
    fitted = done.search.confirmed if gaps else done.base
    above = -1.0 if fitted.campaign.readings.deflection and gaps else 1.0
    campaign = fitted.campaign
    weight = fitted.plain_weights.weight[:, :3] ** 2
    visit = visits_of(campaign.pose)
    residual = np.nan_to_num(fitted.point.residual[:, :3])
    names = [joint.name for joint in fitted.model.robot.joints]
    squares, coordinates = float((weight * residual**2).sum()), int((weight > 0).sum())
    entries = []
    for variable, _, turn, _ in patterns(fitted, campaign):
        if turn is None or not variable.endswith("over its angle"):
            continue
        along = np.bincount(visit, (weight * turn * residual).sum(axis=1))
        size = np.bincount(visit, (weight * turn * turn).sum(axis=1))
        taken = float(np.abs(along).sum()) ** 2 / max(float(size.sum()), 1e-300)
        rest = max(squares - taken, 1e-12 * squares)
        # of any residual free sides take a part: what remains is the scatter that this counts in
        gain = coordinates * np.log(max(squares, 1e-300) / max(rest, 1e-300)) - BIT * len(along)
        if rest < SMALLER**2 * squares:
            entries.append((gain, names.index(variable.split(" over ")[0]), -above * np.sign(along)[visit]))
    entries.sort(key=lambda entry: -entry[0])
    return [(joint, sides) for gain, joint, sides in entries[:JOINTS] if gain > 0]
