"""What looks like an effect of the library and is an imitation of something that has no name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import (
    CHANCE,
    FAR,
    Explained,
    basis_of,
    counts,
    explained,
    outside,
    probability,
    residual_of,
    scatter,
)
from postproc.identification.fit import Estimate

MARGIN = 10.0
"""By how much -2 ln(likelihood) of the nearest other explanation must be worse: odds of 150 to 1."""

UNUSUAL = 3.0
"""Usual sizes from which on a parameter has to be determined well to be believed."""

CHANGES = 0.1
"""Share of what an effect explains that its change with another joint must explain to be no small inexactness."""

MOVES = 0.05
"""Range of the sine or cosine of an angle from which on a change with it can show."""


def changes_with_posture(search: Search, last: Explained, group: int) -> bool:
    """Whether a chosen ``group`` would have to be of another size at other angles of a joint that it is not of.

    Whatever has a place on the arm, a gear, a bearing, a weight, is of one size wherever the other joints are, as far
    as its own columns say.  A pull across several joints is not: what looks like the wave of one gear fades as another
    joint turns.  Added to the choice is what the group does times the sine and the cosine of each other joint; that
    parameters are the same everywhere is a score test of these (Breusch and Pagan, Econometrica 47 (1979), use the same
    of a variance), and it shows where the remaining squares as a whole do not.
    """
    linear, given = search.linear, search.linear.problem
    mine, q = linear.candidates[group], search.base.campaign.readings.q
    on = np.isin(last.columns, given.places[group])
    size = given.size[last.columns[on]]
    does = linear.columns[group] @ (last.coefficients[on] / size)
    rest = explained(given, [g for g in last.groups if g != group])
    variance, found = scatter(given, last), rest.squares - last.squares
    limit = FAR * np.sqrt(variance)
    residual = np.clip(residual_of(given, last), -limit, limit)
    taken = basis_of(given.matrix[:, last.columns])
    per_reading = (len(does) - linear.priors) // len(q)
    others = [k for k, one in enumerate(search.base.model.robot.joints) if one.name != mine.joint]
    for k in others:
        waves = np.stack([np.sin(q[:, k]), np.cos(q[:, k])], axis=1)
        waves = waves[:, np.ptp(waves, axis=0) > MOVES]
        of_rows = np.repeat(waves - waves.mean(axis=0), per_reading, axis=0)
        of_rows = np.concatenate([of_rows, np.zeros((linear.priors, waves.shape[1]))])
        more = basis_of(outside(taken, outside(linear.basis, does[:, None] * of_rows)))
        gain, rank = float(((more.T @ residual) ** 2).sum()), more.shape[1]
        chance = probability(given, gain, rank, variance, given.freedom - last.rank - rank)
        if gain > CHANGES * found and chance * len(others) * len(last.groups) < CHANCE:
            return True
    return False


def follows_another_course(search: Search, candidate: Candidate, limit: float) -> bool:
    """Whether another course over the same joint or time, one that no effect has, is a lesser explanation by less than
    ``limit``: below zero a clearly better one."""
    against = [r for r in search.rivals if r.of == candidate.key and r.is_decoy and r.fitted]
    return any(r.margin < limit for r in against)


def is_in_another_course(search: Search, last: Explained, group: int) -> bool:
    """Whether a chosen ``group`` explains nothing beside the courses without a name that took the places of others on
    its joint."""
    linear, given = search.linear, search.linear.problem
    mine = linear.candidates[group]
    others = [r for r in search.rivals if r.is_decoy and r.fitted and r.margin < -MARGIN]
    others = [r for r in others if r.candidate.joint == mine.joint and r.candidate.columns.any()]
    if not others:
        return False
    gone = {r.of for r in others}
    columns = np.concatenate([linear.weights(np.nan_to_num(r.candidate.columns)) for r in others], axis=1)
    columns = np.concatenate([columns, np.zeros((linear.priors, columns.shape[1]))])
    basis = basis_of(outside(linear.basis, columns))
    beside = replace(
        given,
        residual=outside(basis, given.residual[:, None])[:, 0],
        matrix=outside(basis, given.matrix),
        rank=given.rank + basis.shape[1],
    )
    rest = [g for g in last.groups if g != group and linear.candidates[g].key not in gone]
    without, with_ = explained(beside, rest), explained(beside, [*rest, group])
    return not counts(beside, without, with_, len(linear.candidates))


def laws_on_one_joint(several: Sequence[Candidate]) -> list[Candidate]:
    """Those that depend on the side of approach and are not alone with that on their joint: two such laws together look
    like a third."""
    lost = [c for c in several if c.effect.by_direction]
    return [c for c in lost if sum(c.joint == other.joint for other in lost) > 1]


def is_implausible(estimates: Sequence[Estimate]) -> bool:
    """Whether all that was found is beyond plausible sizes, with intervals of more than half of it: past the load at
    which a tooth changes sides, say, readings do not determine how wide its gap is."""
    sizes = [(abs(e.value - e.unknown.parameter.null), e.unknown.parameter.scale, e.ci95) for e in estimates]
    return bool(sizes) and all(size > UNUSUAL * scale and wide > 0.5 * size for size, scale, wide in sizes)


def is_out_of_bounds(estimate: Estimate) -> bool:
    """Whether the readings ask for more than the bound of a parameter, far beyond its usual size."""
    parameter = estimate.unknown.parameter
    away = abs(estimate.value - parameter.null)
    return estimate.at_bound and not parameter.hardware and away > UNUSUAL * parameter.scale
