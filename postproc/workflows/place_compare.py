"""What else a search for places reports: regret, each freedom alone, the score over x and y."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.placement.force_turns import SCENARIOS, turned_forces
from postproc.placement.room import FREEDOMS, TOOL_TURN, X, Y
from postproc.placement.score_places import P95, score_places
from postproc.report.placement import ScoreGrid, SingleFreedom
from postproc.workflows.place_problem import PlaceProblem

STEPS, BEST = 201, 8
"""Places along a freedom that is compared alone, and how many of the best are looked at on all motions."""

TURNED = 20 * DEG
"""By how much the force is turned for the regret."""

MANY = 20_000
"""Motions from which on fewer places are looked at."""

GRID = 33
"""Places along x and along y of the picture."""

SPIN_STEP, MOST_SPUN = 10, 4000
"""[deg] Turns of the tool that are looked at, and motions."""


def regret_of(problem: PlaceProblem, places: Floats, pool: Floats) -> Floats:
    """(P,) by what share the best place of ``pool`` (Q, 6) is better than each of ``places`` (P, 6) where the force is
    turned, in the worst sense; places and pool are feasible."""
    part, some = problem.motions.take(problem.few), problem.scoring.take(problem.few)
    turned = replace(some, forces=turned_forces(some.forces[0], TURNED, SCENARIOS))
    both = score_places(problem.model, part, problem.room, turned, np.concatenate([places, pool]))
    return np.asarray((both.values[: len(places)] / both.values.min(axis=0)).max(axis=1) - 1.0)


def compare_freedoms(problem: PlaceProblem) -> tuple[SingleFreedom, ...]:
    """What each freedom brings alone, the others as they are now."""
    room, few = problem.room, problem.few
    part, some = problem.motions.take(few), problem.scoring.take(few)
    anywhere = replace(
        room, lower=np.minimum(room.lower, room.present), upper=np.maximum(room.upper, room.present)
    )
    found = []
    for at in room.free.tolist():
        places = np.tile(room.present, (STEPS, 1))
        places[:, at] = np.linspace(room.lower[at], room.upper[at], STEPS)
        scanned = score_places(problem.model, part, anywhere, some, places)
        best = places[scanned.order()[:BEST]]
        whole = score_places(
            problem.model,
            problem.motions,
            anywhere,
            problem.scoring,
            np.concatenate([room.present[None], best]),
            detailed=True,
        )
        one = 1 + int(np.argmin(whole.value[1:]))
        feasible = bool(np.isfinite(whole.value[one]))
        assert whole.limit is not None
        reached = bool(np.isfinite(whole.limit[0]).all())
        ratio = float(whole.value[one] / whole.values[0].mean()) if reached else np.nan
        found.append(
            SingleFreedom(
                FREEDOMS[at],
                float(whole.places[one, at]) if feasible else np.nan,
                ratio if feasible else np.nan,
            )
        )
    return tuple(found)


def spin_bound(problem: PlaceProblem, place: Floats) -> float:
    """[m] the least that the objective could become if the tool turned about its spindle along the path, each motion as
    it is best for it: no smooth turn brings more.  NaN where the tool may not be turned.  The part stays at ``place``
    (6,)."""
    if TOOL_TURN not in problem.room.free:
        return np.nan
    rows = np.flatnonzero(problem.motions.scored)
    rows = rows[:: max(1, len(rows) // MOST_SPUN)]
    few = problem.motions.with_heads(rows)
    part, some = problem.motions.take(few), problem.scoring.take(few)
    angles = np.append(place[TOOL_TURN], np.arange(-180, 180, SPIN_STEP) * DEG)
    places = np.tile(place, (len(angles), 1))
    places[:, TOOL_TURN] = angles
    scores = score_places(problem.model, part, problem.room, some, places, detailed=True)
    assert scores.error is not None
    assert scores.lack is not None
    error = np.where(scores.lack > 0, np.inf, scores.error.mean(axis=2))[:, part.scored]
    each = error.min(axis=0)
    return float(np.percentile(each, 95) if some.objective == P95 else each.max())


def score_grid(problem: PlaceProblem, place: Floats) -> ScoreGrid | None:
    """The score over x and y, all else as at ``place`` (6,); None where not both may change."""
    room = problem.room
    if not {X, Y} <= set(room.free.tolist()):
        return None
    count = GRID if len(problem.motions) <= MANY else GRID // 2
    x, y = (np.linspace(room.lower[axis], room.upper[axis], count) for axis in (X, Y))
    places = np.tile(place, (count * count, 1))
    places[:, X], places[:, Y] = (part.ravel() for part in np.meshgrid(x, y, indexing="ij"))
    few = problem.few
    scores = score_places(problem.model, problem.motions.take(few), room, problem.scoring.take(few), places)
    value = np.where(scores.violation > 0, np.nan, scores.values.mean(axis=1))
    return ScoreGrid(x, y, value.reshape(count, count))
