"""How large things are in a search: what each candidate explains, what an effect moves, what would have shown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import EXCEEDED, SLIGHT, WORTH, explained, gain_by_chance, outside, scatter
from postproc.diagnosis.verdict import Named
from postproc.identification.fit import Fit
from postproc.identification.least_squares import at, displacement_in, scales

SURELY = 0.95
"""Probability with which an effect of the size that shows is taken in."""

TRIALS, NEAR, LEAP = 12, 0.03, 4.0
"""Of a size that shows: how often one is tried, the share within which it is met, and the largest ratio of two."""

OUTSIDE = 0.05
"""Share of a column that must lie outside of what is explained anyway; of the rest no size would show."""


class Gains(NamedTuple):
    """Fall of -2 ln(likelihood) with each of C candidates: ``alone`` (C,); ``beside`` (C,) what was chosen (a chosen
    one: beside the others).  ``needed`` (C,): from which on it counts."""

    alone: Floats
    beside: Floats
    needed: Floats


def gains(search: Search) -> Gains:
    given, last = search.linear.problem, search.explained
    alone, beside, needed = np.zeros((3, len(given.places)))
    for g in range(len(given.places)):
        single = explained(given, (g,))
        alone[g] = given.squares - single.squares
        if g in last.groups:
            beside[g] = explained(given, [k for k in last.groups if k != g]).squares - last.squares
        else:
            beside[g] = last.squares - explained(given, (*last.groups, g)).squares
        needed[g] = _needed(search, single.rank)
    variance = scatter(given, last)
    return Gains(np.maximum(alone, 0.0) / variance, np.maximum(beside, 0.0) / variance, needed)


def _needed(search: Search, rank: int) -> float:
    """The gain from which on a group of ``rank`` is taken in, one of all candidates."""
    given, last = search.linear.problem, search.explained
    by_chance = gain_by_chance(given, max(rank, 1), given.freedom - last.rank, len(given.places))
    worth = SLIGHT if given.known and scatter(given, last) <= EXCEEDED else WORTH
    return max(by_chance, worth / (1.0 - worth) * max(1, given.freedom - last.rank))


def moved(final: Fit, named: Named) -> Floats:
    """(R, 3) [m] what the effect, as ``final`` has it, moves of each reading beyond what tracker and targets that were
    elsewhere would; axes of the robot base."""
    nulls = {e.unknown.key: e.unknown.parameter.null for e in named.estimates}
    without = at(final.campaign, final.model.with_values(nulls), final.point.nuisances)
    by = without.residual - final.point.residual
    on = final.weights.weight > 0
    nuisance = np.nan_to_num(final.point.required_columns[1])
    step = np.linalg.lstsq(nuisance[on], by[on], rcond=None)[0]
    return final.campaign.in_base(by - nuisance @ step, final.point.nuisances)[:, :3]


@dataclass(frozen=True)
class Smallest:
    """The smallest of a candidate that would have shown with probability ``SURELY``.  rms [m]: of what it moves, of its
    parameter that is seen least; usual: times the usual size, of the one that is seen best; parameters (p,) [SI]: of
    each of ``candidate.shown`` from its null, the others at theirs.  Infinite where what is explained anyway does the
    same, or where its bounds allow no such size."""

    candidate: Candidate
    rms: float
    usual: float
    parameters: tuple[float, ...]


def smallest(search: Search) -> tuple[Smallest, ...]:
    """For each candidate that was not chosen.

    A group of rank p explains by chance chi2(p), and chi2(p) off its centre by the squares, in variances of a reading,
    of what it moves outside of what is explained anyway.
    """
    linear, given, last = search.linear, search.linear.problem, search.explained
    basis = np.linalg.qr(given.matrix[:, last.columns])[0]
    beyond = given.matrix - basis @ (basis.T @ given.matrix)
    variance = scatter(given, last)
    counts = search.base.weights.weight[:, :3] > 0
    sizes = []
    for g, candidate in enumerate(linear.candidates):
        if g in last.groups:
            continue
        outside_share = np.linalg.norm(beyond[:, given.places[g]], axis=0)
        size = np.linalg.norm(linear.columns[g], axis=0) * outside_share
        on = outside_share > OUTSIDE
        if not on.any():
            sizes.append(Smallest(candidate, np.inf, np.inf, (np.inf,) * len(on)))
            continue
        rank = int(on.sum())
        needed = np.sqrt(variance * _off_centre(rank, _needed(search, rank))) / size[on]
        moves = np.nan_to_num(candidate.columns[:, :3])[:, :, on][counts]
        rms = np.sqrt(3.0 * np.mean(moves**2, axis=0))
        alone = np.full(len(on), np.inf)
        alone[on] = needed
        room = np.abs(given.reach[given.places[g]] / given.size[given.places[g], None]).max(axis=1)
        alone = np.where(alone > room, np.inf, alone) * scales(candidate.shown)
        sizes.append(
            Smallest(candidate, float((needed * rms).max()), float(needed.min()), tuple(alone.tolist()))
        )
    return tuple(sizes)


def detection_limits(search: Search) -> tuple[Smallest, ...]:
    """As ``smallest``, of effects with one parameter that do not grow in proportion at the size itself, by trial."""
    return tuple(
        _tried(search, one) if one.candidate.nonlinear and len(one.parameters) == 1 else one
        for one in smallest(search)
    )


def _tried(search: Search, one: Smallest) -> Smallest:
    """The limit of an effect that is evaluated at each size; infinite where it does not come to it."""
    candidate, linear, base = one.candidate, search.linear, search.base
    (unknown,), size = candidate.shown, one.parameters[0]
    variance = scatter(linear.problem, search.explained)
    needed = np.sqrt(variance * _off_centre(1, _needed(search, 1)))
    basis = linear.basis_with(search.explained.groups)
    counts = base.weights.weight[:, :3] > 0
    room = max(
        unknown.parameter.upper - unknown.parameter.null, unknown.parameter.null - unknown.parameter.lower
    )
    away = 1.0 if unknown.parameter.upper > unknown.parameter.null else -1.0
    none = replace(one, rms=np.inf, usual=np.inf, parameters=(np.inf,))
    size = size if np.isfinite(size) else unknown.parameter.scale
    for _ in range(TRIALS):
        if size > room:
            return none
        model = candidate.model.with_values({unknown.key: unknown.parameter.null + away * size})
        there = at(base.campaign, model, base.point.nuisances, displacement_in(model, base.point))
        if not there.predicted.converged.all():
            return none
        does = np.nan_to_num(base.point.residual - there.residual)
        seen = np.concatenate([linear.weights(does), np.zeros(linear.priors)])
        length = float(np.linalg.norm(outside(basis, seen[:, None])))
        if abs(length / needed - 1.0) < NEAR:
            rms = float(np.sqrt(3.0 * np.mean(does[:, :3][counts] ** 2)))
            return Smallest(candidate, rms, size / unknown.parameter.scale, (size,))
        size *= float(np.clip(needed / max(length, 1e-300), 1.0 / LEAP, LEAP))
    return none


def _off_centre(rank: int, limit: float) -> float:
    """How far off its centre chi2(``rank``) must be to exceed ``limit`` with probability ``SURELY``; by bisection."""
    from scipy.special import chndtr

    low, high = 1e-6, 10.0 * limit + 100.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if 1.0 - chndtr(limit, rank, middle) < SURELY:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
