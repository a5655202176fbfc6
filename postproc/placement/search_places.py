"""The search for the best placement: a coarse look at the whole room, then a population that contracts, on few motions
that are added to until the winners are feasible and as good on all of them.

Differential evolution (Storn and Price 1997, doi:10.1023/A:1008202821328) with the rule that a feasible placement wins
over one that is not, and of two that are not the one nearer to it (Deb 2000, doi:10.1016/S0045-7825(99)00389-8).
Everything is drawn with one seed: the same input gives the same places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_blocks
from postproc.model import StiffnessModel
from postproc.placement.collisions import CollisionShapes, colliding_rows
from postproc.placement.part_motions import PartMotions
from postproc.placement.refine_places import refine_place
from postproc.placement.room import Room
from postproc.placement.score_places import P95, Scores, Scoring, score_places

COARSE = 2048
"""Placements of the coarse look."""

NICHES, MEMBERS, GENERATIONS = 12, 14, 25
"""Populations side by side, of so many places each: the valleys of the objective are nearly as deep as each other, and
one population finds one of them."""

LEADERS, CROSSOVER = 3, 0.9
"""Each member moves towards one of the best of its population (Zhang and Sanderson 2009,
doi:10.1109/TEVC.2009.2014613)."""

FAR = 0.2
"""Share of a range by which populations start apart."""

SEED = 20260101

AGAIN, SPREAD = 512, 200
"""Of the best placements of a round that are scored again in the next, and of the best that are apart."""

FEW = 64
"""Motions that the search starts with."""

REFINED = 6
"""Valleys in which the search ends with linear programs."""

ROUNDS = 6
CANDIDATES = 12
"""Placements that are looked at on all motions after each round."""

AGREES = 1.002
"""Of the objective on all motions over that on the few: the round was the last one."""

APART = 0.08
"""Two places differ where they are farther apart than this share of a range."""


@dataclass(frozen=True, eq=False)
class SearchResult:
    """few (K,): motions that the search ended with; pool: all placements that it looked at, scored on these, best
    first; looked: how many it scored; rounds: how often motions were added."""

    few: Ints
    pool: Scores
    looked: int
    rounds: int


Score = Callable[[Floats], Scores]


def search_places(
    model: StiffnessModel,
    motions: PartMotions,
    room: Room,
    scoring: Scoring,
    progress: Callable[[str], None],
    shapes: CollisionShapes | None = None,
) -> SearchResult:
    """The placements of a ``room`` by their scores on all ``motions``; with ``shapes`` one that collides is not
    feasible."""
    few = choose_motions(motions, FEW if scoring.objective != P95 else 4 * FEW)
    looked, pool = 0, None
    for round_number in range(1, ROUNDS + 1):
        progress(f"searching, round {round_number}")
        part, part_scoring = motions.take(few), scoring.take(few)

        def score(places: Floats, part: PartMotions = part, some: Scoring = part_scoring) -> Scores:
            return _clear(shapes, model, part, score_places(model, part, room, some, places))

        def detailed(places: Floats, part: PartMotions = part, some: Scoring = part_scoring) -> Scores:
            return _clear(shapes, model, part, score_places(model, part, room, some, places, detailed=True))

        known = score(start_places(room) if pool is None else _next_places(room, pool))
        niches = NICHES if pool is None and len(room.free) > 2 else NICHES // 3
        pool = Scores.join([known, evolve(room, score, known, niches)])
        if scoring.objective != P95:
            pool = _refined(room, part_scoring, detailed, pool)
        looked += len(pool.places)
        pool = pool.part(pool.order())
        chosen = distinct(room, pool.places, CANDIDATES if len(motions) < 20_000 else CANDIDATES // 3)
        progress(f"checking all motions, round {round_number}")
        whole = score_places(model, motions, room, scoring, pool.places[chosen], detailed=True)
        added = _decisive(motions, whole, few)
        if shapes is not None:
            hits = colliding_rows(shapes, model, motions, whole.places)
            added = np.union1d(added, np.setdiff1d(hits[hits >= 0], few))
            whole = replace(whole, violation=whole.violation + (hits >= 0))
        agrees = whole.violation[0] == 0 and whole.value[0] <= AGREES * pool.value[chosen[0]]
        if (agrees and round_number > 1) or (not len(added) and round_number > 1):
            break
        few = motions.with_heads(np.union1d(few, added))
    assert pool is not None
    return SearchResult(few, pool, looked, round_number)


def _clear(
    shapes: CollisionShapes | None, model: StiffnessModel, motions: PartMotions, scores: Scores
) -> Scores:
    """``scores`` with the feasible places that collide counted as not feasible by 1."""
    feasible = np.flatnonzero(scores.violation == 0)
    if shapes is None or not len(feasible):
        return scores
    violation = scores.violation.copy()
    violation[feasible] += colliding_rows(shapes, model, motions, scores.places[feasible]) >= 0
    return replace(scores, violation=violation)


def _next_places(room: Room, pool: Scores) -> Floats:
    """(P, 6) of the ``pool``, best first, what the next round goes on with: the best, and others that are apart."""
    return pool.places[
        np.union1d(np.arange(min(AGAIN, len(pool.places))), distinct(room, pool.places, SPREAD))
    ]


def _refined(room: Room, scoring: Scoring, score: Score, pool: Scores) -> Scores:
    """``pool`` and what linear programs lead to from the best of it that are far from each other."""
    order = pool.order()
    starts = pool.places[order[distinct(room, pool.places[order], REFINED, FAR)]]

    def refine(one: slice) -> Scores:
        return refine_place(room, scoring, score, starts[one.start])

    return Scores.join([pool, *in_blocks(refine, len(starts), rows=1)])


def start_places(room: Room) -> Floats:
    """(P, 6) placements spread evenly over the room, with the present one where it lies in it."""
    free = len(room.free)
    count = COARSE if free > 2 else 32**2 if free == 2 else 201
    if free == 1:
        shares = np.linspace(0.0, 1.0, count)[:, None]
    else:
        shares = qmc.Sobol(free, scramble=False).random(count) + 0.5 / count
    places = room.places(shares)
    if room.polygon is not None:
        inside = room.outside(places) == 0
        places = places[inside] if inside.any() else places
    return np.concatenate([np.clip(room.present, room.lower, room.upper)[None], places])


def evolve(room: Room, score: Score, known: Scores, niches: int) -> Scores:
    """All placements that populations visit, each of which starts around one of the best of ``known`` that are far from
    each other; they live side by side and do not mix."""
    rng = np.random.default_rng(SEED)
    here = known.part(_niches(room, known, niches))
    visited = [here]
    count, free = len(here.places), len(room.free)
    first = np.arange(count) - np.arange(count) % MEMBERS  # of the own population
    for _ in range(GENERATIONS):
        shares = room.shares(here.places)
        by_niche = here.order()
        by_niche = by_niche[np.argsort(first[by_niche], kind="stable")]
        leader = by_niche[first + rng.integers(LEADERS, size=count)]
        one, other = (first + rng.integers(MEMBERS, size=count) for _ in range(2))
        weight = rng.uniform(0.3, 0.9, (count, 1))
        mutant = shares + weight * (shares[leader] - shares + shares[one] - shares[other])
        mutant = np.clip(mutant, 0.0, 1.0)
        keep = rng.random((count, free)) > CROSSOVER
        keep[np.arange(count), rng.integers(free, size=count)] = False
        trial = score(room.places(np.where(keep, shares, mutant)))
        better = (trial.violation < here.violation) | (
            (trial.violation == here.violation) & (trial.value < here.value)
        )
        visited.append(trial)
        here = Scores(
            np.where(better[:, None], trial.places, here.places),
            np.where(better, trial.violation, here.violation),
            np.where(better[:, None], trial.values, here.values),
        )
    return Scores.join(visited)


def _niches(room: Room, known: Scores, niches: int) -> Ints:
    """(N MEMBERS,) the best of ``known`` around each of its best that are far apart, population by population."""
    order = known.order()
    shares = room.shares(known.places[order])
    centres = distinct(room, known.places[order], niches, FAR)
    members = []
    for centre in centres.tolist():
        away = np.abs(shares - shares[centre]).max(axis=1)
        near = np.flatnonzero(away <= FAR)
        near = near if len(near) >= MEMBERS else np.argsort(away, kind="stable")[:MEMBERS]
        members.append(np.resize(near[:MEMBERS], MEMBERS))
    return np.asarray(order[np.concatenate(members)])


def distinct(room: Room, places: Floats, count: int, apart_by: float = APART) -> Ints:
    """(K,) the first of ``places`` (P, 6), best first, and up to ``count`` in all that are apart from those before
    them."""
    shares, chosen = room.shares(places), [0]
    apart = np.full(len(places), np.inf)
    while len(chosen) < count:
        apart = np.minimum(apart, np.abs(shares - shares[chosen[-1]]).max(axis=1))
        later = np.flatnonzero(apart > apart_by)
        later = later[later > chosen[-1]]
        if not len(later):
            break
        chosen.append(int(later[0]))
    return np.array(chosen)


def choose_motions(motions: PartMotions, count: int) -> Ints:
    """(K,) motions that represent all of them: the outermost ones, those with the largest forces in each direction, and
    others evenly along the programs; with their heads."""
    chosen = [np.unique(motions.head)[:count]]
    rows = np.flatnonzero(motions.moves)
    if len(rows):
        chosen += [rows[_outermost(motions.target.position[rows])]]
        chosen += [rows[_outermost(motions.target.rotation[rows][:, :, 2])]]
    scored = np.flatnonzero(motions.scored)
    chosen += [scored[_outermost(motions.force[scored])], scored[_outermost(motions.target.position[scored])]]
    beside = np.cross(motions.tangent[scored], motions.force[scored])
    chosen += [scored[_outermost(beside)]]
    chosen += [scored[np.linspace(0, len(scored) - 1, min(count, len(scored))).round().astype(np.int64)]]
    return motions.with_heads(np.unique(np.concatenate(chosen)))


def _outermost(points: Floats) -> Ints:
    """The rows of ``points`` (N, 3) that lie farthest in each of 26 directions."""
    steps = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    steps = steps[np.any(steps != 0, axis=1)]
    return np.unique((points @ steps.T).argmax(axis=0))


def _decisive(motions: PartMotions, whole: Scores, few: Ints) -> Ints:
    """(K,) motions that are not among the ``few`` yet and lack most, or have the largest error, at a placement."""
    assert whole.lack is not None
    assert whole.error is not None
    assert whole.limit is not None
    rows = [whole.error.max(axis=2).argmax(axis=1)]
    bad = np.flatnonzero(whole.violation > 0)
    if len(bad):
        rows += [whole.lack[bad].argmax(axis=1), whole.limit[bad].argmin(axis=1)]
        assert whole.singular is not None
        rows += [whole.singular[bad].argmin(axis=1)]
    return np.setdiff1d(np.concatenate(rows), few)
