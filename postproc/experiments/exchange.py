"""The best choice of setups out of many: one after the other, then exchanged as long as that helps (Fedorov).

Which setups are tried is decided by the first derivative of the criterion, batched over all of them; which one is
taken, by the criterion itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.experiments.criteria import Criterion

TRIED = 48
"""Setups evaluated exactly at each choice."""

BETTER = 1e-9
"""A smaller improvement is rounding."""

BLOCK = 128
"""Rows multiplied together: so few that BLAS leaves them to one core, which is faster than waking the others."""

ENOUGH = 1e-3
"""A sweep over all setups of a choice that improves the score, a logarithm, by less is the last."""


@dataclass(frozen=True)
class CandidateSet:
    """C setups: rows (C, r, p) whitened; axes q (C, n), by ``spacing`` (n,) of which two chosen ones differ in one at
    least; base (p, p): information that is there before, positive definite.  ``spread`` (n,): differences of two chosen
    ones, each over that of its axis, sum up to 1 at least; None: nothing more than the spacing is asked for."""

    rows: Floats
    q: Floats
    spacing: Floats
    base: Floats
    spread: Floats | None = None

    def information(self, chosen: Sequence[int]) -> Floats:
        """(p, p) of a choice, with the base."""
        rows = self.rows[list(chosen)].reshape(-1, self.base.shape[0])
        return np.asarray(self.base + rows.T @ rows)

    def near(self, setup: int) -> Bools:
        """(C,) setups that are too like this one to be chosen beside it."""
        away = np.abs(self.q - self.q[setup])
        alike = (away < self.spacing).all(axis=1)
        if self.spread is not None:
            alike |= (away / self.spread).sum(axis=1) < 1.0
        return np.asarray(alike)

    def blocked(self, chosen: Sequence[int]) -> Bools:
        """(C,) setups that cannot be chosen beside ``chosen``."""
        is_blocked = np.zeros(len(self.q), bool)
        for setup in chosen:
            is_blocked |= self.near(setup)
        return is_blocked

    @cached_property
    def blocks(self) -> Floats:
        """(b, BLOCK, p) all rows below each other, filled up with zeros."""
        flat = self.rows.reshape(-1, self.base.shape[0])
        return np.pad(flat, ((0, -len(flat) % BLOCK), (0, 0))).reshape(-1, BLOCK, flat.shape[1])

    def gains(self, directions: Floats) -> Floats:
        """(C,) squared lengths of J directions (p, k)."""
        moved = self.blocks @ directions
        squares = np.einsum("bnk,bnk->bn", moved, moved).reshape(-1)[
            : self.rows.shape[0] * self.rows.shape[1]
        ]
        return np.asarray(squares.reshape(self.rows.shape[:2]).sum(axis=1))


def best(
    choices: CandidateSet, criterion: Criterion, information: Floats, blocked: Bools
) -> tuple[int, float]:
    """The setup to add to a choice with ``information`` (p, p), -1 where all are ``blocked`` (C,), and the score with
    it."""
    gain = choices.gains(criterion.directions(information))
    gain[blocked] = -1.0
    tried = np.argpartition(-gain, min(TRIED, len(gain) - 1))[:TRIED]
    tried = tried[gain[tried] >= 0]
    if not len(tried):
        return -1, np.inf
    rows = choices.rows[tried]
    score = criterion.score(information + np.swapaxes(rows, 1, 2) @ rows)
    at = int(np.argmin(score))
    return int(tried[at]), float(score[at])


def grown(choices: CandidateSet, criterion: Criterion, chosen: Sequence[int], count: int) -> list[int]:
    """``chosen`` with the best setup added until there are ``count``, or no other is distinct enough."""
    chosen = list(chosen)
    blocked, information = choices.blocked(chosen), choices.information(chosen)
    while len(chosen) < count:
        setup, _ = best(choices, criterion, information, blocked)
        if setup < 0:
            break
        chosen.append(setup)
        blocked |= choices.near(setup)
        information += choices.rows[setup].T @ choices.rows[setup]
    return chosen


def exchanged(choices: CandidateSet, criterion: Criterion, chosen: Sequence[int]) -> tuple[list[int], float]:
    """``chosen`` after each of its setups was exchanged for a better one as long as there is any; and the score, which
    is never larger than that of ``chosen``."""
    chosen = list(chosen)
    score = float(criterion.score(choices.information(chosen)))
    near = np.array([choices.near(setup) for setup in chosen])
    crowd = near.sum(axis=0)
    before = np.inf
    while score < before - ENOUGH:
        before = score
        for place in range(len(chosen)):
            rest = chosen[:place] + chosen[place + 1 :]
            crowd -= near[place]
            setup, new_score = best(choices, criterion, choices.information(rest), crowd > 0)
            if new_score < score - BETTER:
                chosen[place], score, near[place] = setup, new_score, choices.near(setup)
            crowd += near[place]
    return chosen, score


def random_choice(choices: CandidateSet, count: int, rng: np.random.Generator) -> list[int]:
    """``count`` setups at random that are distinct enough, or as many as there are."""
    chosen: list[int] = []
    for setup in rng.permutation(len(choices.q)).tolist():
        if len(chosen) == count:
            break
        if not choices.near(setup)[chosen].any():
            chosen.append(setup)
    return chosen
