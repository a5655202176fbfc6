"""How large things are in a search: what each candidate explains, what an effect moves, what would have shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.search_result import Search
from postproc.diagnosis.selection import EXCEEDED, SLIGHT, WORTH, explained, gain_by_chance, scatter
from postproc.diagnosis.verdict import Named
from postproc.identification.fit import Fit
from postproc.identification.least_squares import at

SURELY = 0.95
"""Probability with which an effect of the size that shows is taken in."""

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
    without = at(final.campaign, final.model.with_values(nulls), final.point.given)
    by = without.residual - final.point.residual
    on = final.weights.weight > 0
    nuisance = np.nan_to_num(final.point.taken[1])
    step = np.linalg.lstsq(nuisance[on], by[on], rcond=None)[0]
    return final.campaign.in_base(by - nuisance @ step, final.point.given)[:, :3]


@dataclass(frozen=True)
class Smallest:
    """The smallest of a candidate that would have shown with probability ``SURELY``.  rms [m]: of what it moves, of its
    parameter that is seen least; usual: times the usual size, of the one that is seen best.  Infinite where what is
    explained anyway does the same."""

    candidate: Candidate
    rms: float
    usual: float


def smallest(search: Search) -> tuple[Smallest, ...]:
    """For each candidate that was not chosen.

    A group of rank p explains by chance chi2(p), and chi2(p) off its centre by the squares, in variances of a reading,
    of what it moves outside of what is explained anyway.
    """
    linear, given, last = search.linear, search.linear.problem, search.explained
    basis = np.linalg.qr(given.matrix[:, last.columns])[0]
    outside = given.matrix - basis @ (basis.T @ given.matrix)
    variance = scatter(given, last)
    counts = search.base.weights.weight[:, :3] > 0
    sizes = []
    for g, candidate in enumerate(linear.candidates):
        if g in last.groups:
            continue
        outside_share = np.linalg.norm(outside[:, given.places[g]], axis=0)
        size = np.linalg.norm(linear.columns[g], axis=0) * outside_share
        on = outside_share > OUTSIDE
        if not on.any():
            sizes.append(Smallest(candidate, np.inf, np.inf))
            continue
        rank = int(on.sum())
        needed = np.sqrt(variance * _off_centre(rank, _needed(search, rank))) / size[on]
        moves = np.nan_to_num(candidate.columns[:, :3])[:, :, on][counts]
        rms = np.sqrt(3.0 * np.mean(moves**2, axis=0))
        sizes.append(Smallest(candidate, float((needed * rms).max()), float(needed.min())))
    return tuple(sizes)


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
