"""What looks like an effect of the library and is an imitation of something that has no name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import Explained, basis_of, counts, explained, outside

MARGIN = 10.0
"""By how much -2 ln(likelihood) of the nearest other explanation must be worse: odds of 150 to 1."""


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
