"""Which motions get what they need where all together need more than may be inserted: against a scalar walk."""

from __future__ import annotations

import numpy as np
import pytest
from spring_cases import MM, corrected, spring

from postproc.compensation.divisible_motions import DivisibleMotions
from postproc.compensation.refinement import enforce_budget
from postproc.compensation.subdivision import Limits


def drawn(seed: int, spare: int) -> DivisibleMotions:
    """Lines in one to three parts, some of which need transition moves, with points inserted into their parts."""
    chance = np.random.default_rng(seed)
    n = 9
    points = np.stack([np.arange(n) * 30.0, 0.0 * np.arange(n), 0.0 * np.arange(n)], axis=1) * MM
    job = spring(points, [False] + [True] * (n - 1))
    motions = DivisibleMotions(job, corrected(job, np.zeros((n, 3))), Limits(max_growth=1.0, least=spare))
    count = len(motions.rows)
    parts = chance.integers(1, 4, count)
    parts[chance.random(count) < 0.4] = 1
    bounds = [np.concatenate([[0.0], np.sort(chance.uniform(0.1, 0.9, k - 1)), [1.0]]) for k in parts]
    motions.owner = np.repeat(np.arange(count), parts).astype(np.int32)
    motions.low, motions.high = (np.concatenate([b[k : len(b) - 1 + k] for b in bounds]) for k in (0, 1))
    motions.least = motions.least_segments()
    motions.count = motions.least + chance.integers(0, 4, parts.sum())
    motions.error = chance.uniform(0.0, 9.0, parts.sum())
    motions.needs_transition = chance.random(count) < 0.5
    motions.step = chance.uniform(0.0, 9.0, count)
    motions.split_error = chance.uniform(0.0, 9.0, count)
    return motions


def expected(motions: DivisibleMotions, spare: int) -> tuple[list[bool], list[tuple[int, float, float, int]]]:
    """Which transition moves stay; and of each interval its motion, low, high and count."""
    intervals = [
        [(low, high, int(c), int(least), error)
         for o, low, high, c, least, error in zip(
             motions.owner, motions.low, motions.high, motions.count, motions.least, motions.error, strict=True)
         if o == row]
        for row in range(len(motions.rows))
    ]  # fmt: skip
    needs = motions.needs_transition.tolist()
    cost = [int(need) + len(own) - 1 for need, own in zip(needs, intervals, strict=True)]
    wanted = sum(cost) + sum(c - least for own in intervals for _, _, c, least, _ in own)
    if wanted > spare:
        needed = np.maximum(motions.step * motions.needs_transition, motions.split_error)
        asked, left = 0, spare
        for row in np.argsort(-needed, kind="stable").tolist():
            asked += cost[row]
            if cost[row] and asked > spare:  # nor what needs less
                needs[row] = False
                if len(intervals[row]) > 1:
                    intervals[row] = [(0.0, 1.0, 1, 1, motions.split_error[row])]
            else:
                left -= cost[row]
        every = [(row, k) for row, own in enumerate(intervals) for k in range(len(own))]
        every.sort(key=lambda place: -intervals[place[0]][place[1]][4])
        for row, k in every:
            low, high, count, least, error = intervals[row][k]
            gets = min(left, count - least)
            intervals[row][k] = low, high, least + gets, least, error
            left -= gets
    return needs, [(row, *one[:3]) for row, own in enumerate(intervals) for one in own]


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("spare", [0, 3, 6, 9, 14, 1000])
def test_what_shows_most_is_inserted_first(seed: int, spare: int) -> None:
    """Transition moves and parts before points; a motion that does not get all its parts stays in one."""
    motions = drawn(seed, spare)
    needs, intervals = expected(motions, motions.limits.inserted(motions.n))
    enforce_budget(motions)
    assert motions.needs_transition.tolist() == needs
    columns = (motions.owner, motions.low, motions.high, motions.count)
    assert list(zip(*(column.tolist() for column in columns), strict=True)) == intervals
