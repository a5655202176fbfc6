"""Setups with what they show, and the search for the best choice of them: random poses first, then poses near the
chosen ones, nearer and nearer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.units import DEG
from postproc.experiments.candidate_setups import CandidateSetups, Setups, around
from postproc.experiments.observability import Observability
from postproc.model import StiffnessModel

CANDIDATES = 4000
"""Random poses to choose from."""

SHARES = (0.1, 0.05, 0.025, 0.012, 0.006)
"""Shares of the ranges of the axes by which poses near the chosen ones are moved, one search after the other."""

NEARBY = 1200
"""Such poses together, about."""

Stage = Callable[[str], None]
"""Receives the name of each stage as it starts."""

Choice = Mapping[int, Sequence[int]]
"""Number of setups -> their rows in a pool."""

Evaluated = Callable[["Setups"], "Pool"]
"""What setups show, of those under which the robot comes to rest."""


def silent(_stage: str) -> None:
    """Nobody watches."""


@dataclass(frozen=True)
class Pool:
    """Setups, and what they show."""

    setups: Setups
    shown: Observability

    def __len__(self) -> int:
        return len(self.setups)

    def __getitem__(self, rows: Sequence[int]) -> Pool:
        return Pool(self.setups[list(rows)], self.shown[list(rows)])

    def __add__(self, other: Pool) -> Pool:
        return Pool(self.setups + other.setups, self.shown + other.shown)


def pooled(setups: Setups, shown: Observability) -> Pool:
    """The setups under which the robot comes to rest."""
    rests = np.isfinite(shown.columns).all(axis=(1, 2)) & np.isfinite(shown.nuisance).all(axis=(1, 2))
    return Pool(setups[rests], shown[rests])


def rested(model: StiffnessModel, setups: Setups, evaluated: Evaluated) -> Pool:
    """The first pool.  Raises Refusal PLN003 where the robot never comes to rest."""
    pool = evaluated(setups)
    if not len(pool):
        message = f"none of {len(setups)} poses has an equilibrium under these loads"
        raise Refusal(Finding("PLN003", message, str(model.robot.path)))
    return pool


def enough(model: StiffnessModel, candidates: CandidateSetups, wanted: int, count: int) -> None:
    """Raises Refusal PLN004 where fewer distinct poses than wanted were found."""
    if count < wanted:
        message = (
            f"{count} poses differ by {candidates.spacing / DEG:g} deg in one axis at least, and"
            f" {wanted} are requested"
        )
        raise Refusal(Finding("PLN004", message, str(model.robot.path)))


def refined(
    model: StiffnessModel,
    candidates: CandidateSetups,
    start: Pool,
    evaluated: Evaluated,
    chosen_from: Callable[[Pool, Choice], Choice],
    rng: np.random.Generator,
    stage: Stage,
) -> tuple[Pool, Choice]:
    """The best choices, and the pool that they are of.  ``chosen_from``: the best choices out of a pool, never worse
    than those at the start."""
    stage("choosing poses")
    pool, chosen = start, chosen_from(start, {})
    for share in SHARES if chosen else ():
        stage(f"trying poses nearby, {100 * share:g} % of the ranges")
        used = sorted({row for rows in chosen.values() for row in rows})
        best = pool[used]
        place = {row: len(start) + i for i, row in enumerate(used)}
        near = around(model, candidates, best.setups, share, max(2, NEARBY // len(used)), rng)
        pool = start + best + evaluated(near) if len(near) else start + best
        chosen = chosen_from(pool, {size: [place[row] for row in rows] for size, rows in chosen.items()})
    return pool, chosen
