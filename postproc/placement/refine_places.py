"""The last steps to the best placement of a valley: a sequence of linear programs.

The objective is the largest of many errors, and its best place mostly lies where several of them and some margins meet:
errors e and margins m of all motions are linearised by differences, and

    minimise the mean of t_k    with    e_rk + de_rk . d <= t_k,    m_r + dm_r . d >= 0,    |d| <= trust

gives the step d; the trust region grows after a step that helps, and shrinks after one that does not (Madsen 1975,
doi:10.1093/imamat/16.3.321).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.placement.room import Room
from postproc.placement.score_places import Scores, Scoring

STEPS = 25
"""Linear programs of one start at most."""

FIRST, LAST = 0.05, 2e-5
"""Trust region at the start, and the one at which nothing more is to be gained, as shares of the ranges."""

DIFFERENCE = 1e-4
"""Step of the differences, as a share of a range."""

SLACK = 0.01 * DEG
"""By so much the linear program stays farther from the margins than it must."""

TIGHT = 0.6
"""Errors below this share of the largest one are left out of the linear program."""


def refine_place(room: Room, scoring: Scoring, score: Callable[[Floats], Scores], start: Floats) -> Scores:
    """The scores of ``start`` (6,) and of all better placements that the search passes; ``score``: in detail."""
    here = score(start[None])
    visited = [here]
    trust = FIRST
    for _ in range(STEPS):
        step = _step(room, scoring, score, here, trust)
        if step is None:
            break
        share = np.clip(room.shares(here.places)[0] + step, 0.0, 1.0)
        trial = score(room.places(share[None]))
        if _better(trial, here):
            little = trial.value[0] > (1.0 - 1e-5) * here.value[0]
            here, trust = trial, min(2.0 * trust, 0.2) * (0.25 if little else 1.0)
            visited.append(here)
        else:
            trust *= 0.3
        if trust < LAST:
            break
    return Scores.join(visited)


def _better(one: Scores, other: Scores) -> bool:
    if one.violation[0] != other.violation[0]:
        return bool(one.violation[0] < other.violation[0])
    return bool(one.value[0] < other.value[0])


def _step(
    room: Room, scoring: Scoring, score: Callable[[Floats], Scores], here: Scores, trust: float
) -> Floats | None:
    """(D,) the step, as shares of the ranges; None where the linear program has no solution."""
    share = room.shares(here.places)[0]
    free = len(share)
    side = np.where(share > 0.5, -DIFFERENCE, DIFFERENCE)
    around = score(room.places(share + np.diag(side)))

    def slope(name: str) -> tuple[Floats, Floats]:
        """Values (M,) here, and their derivatives (M, D)."""
        values, there = getattr(here, name)[0].ravel(), getattr(around, name).reshape(free, -1)
        with np.errstate(invalid="ignore"):  # out of reach
            return values, ((there - values) / side[:, None]).T

    error, by_share = slope("error")
    sets = here.error.shape[2] if here.error is not None else 1
    which = np.tile(np.arange(sets), len(error) // sets)
    tight = error > TIGHT * error.max()
    rows = [np.hstack([by_share[tight], -np.eye(sets)[which[tight]]])]
    bounds = [-error[tight]]
    for name, margin in (("limit", scoring.limit), ("singular", scoring.singular)):
        values, by_share = slope(name)
        known = np.isfinite(values) & np.isfinite(by_share).all(axis=1) & (values < margin + 0.5)
        rows.append(np.hstack([-by_share[known], np.zeros((int(known.sum()), sets))]))
        bounds.append(values[known] - margin - SLACK)
    cost = np.concatenate([np.zeros(free), np.full(sets, 1.0 / sets)])
    box = [(max(-trust, -one), min(trust, 1.0 - one)) for one in share.tolist()]
    limits = np.concatenate(bounds)
    # a margin that is not kept here may not be reached in one step: as much of it as the trust region allows
    matrix = np.vstack(rows)
    reach = np.abs(matrix[:, :free]).sum(axis=1) * trust
    free_rows = ~matrix[:, free:].any(axis=1)
    limits = np.where(free_rows, np.maximum(limits, -0.5 * reach), limits)
    scale = max(float(error.max()), 1e-12)
    matrix[~free_rows, :free] /= scale
    limits = np.where(free_rows, limits, limits / scale)
    found = linprog(cost, matrix, limits, bounds=[*box, *([(0.0, None)] * sets)], method="highs")
    return np.asarray(found.x[:free]) if found.status == 0 else None
