"""Which motions of a second program end where one of the original ends, and which statements follow them.

Motions whose statements are the same as text are distinguished here by their places on the original's path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.problem import CompensationProblem
from postproc.verification.differences import NEAR, ComparedMotions, end_rows
from postproc.verification.simulator import Simulation, Simulator
from postproc.verification.stated_texts import MOTION, Statements


@dataclass(frozen=True, eq=False)
class MotionEnds:
    """N motions of the original and M of the second program.

    row (N,): the row of the second program that ends where this one ends, -1 where it is not known; stretch (N,) and
    arc (N,) [m]: the divided cut that a motion belongs to, -1 for none, and where along it the motion ends; near (N,)
    [m]: how far from there a motion may end that represents it; spots (N + 1,): how many motions before each one only
    turn the tool or external axes.
    run_stretch (M,), run_arc (M,), run_spots (M,): the same of the second program's motions on divided cuts.
    """

    row: Ints
    stretch: Ints
    arc: Floats
    near: Floats
    spots: Ints
    run_stretch: Ints
    run_arc: Floats
    run_spots: Ints

    @staticmethod
    def of(simulator: Simulator, run: CompensationProblem, simulation: Simulation) -> MotionEnds:
        original, pairing, grid = simulator.original, simulator.pairing, simulator.grid
        cuts, n, m = pairing.stretches, len(original.toolpath), len(run.toolpath)
        row = np.full(n, -1)
        row[pairing.air] = pairing.run_air
        row[simulation.fixed_rows] = simulation.fixed
        nearest = end_rows(simulator, simulation.samples)
        row = np.where(nearest >= 0, nearest, row)

        stretch, arc = np.full(n, -1), np.full(n, np.nan)
        on_cuts = np.flatnonzero(cuts.length)
        first, stop = simulation.start[on_cuts], simulation.stop[on_cuts]
        divided = (stop - first) != (cuts.stop - cuts.start)[on_cuts]
        end = np.flatnonzero(grid.gap)
        own = np.repeat(np.arange(len(on_cuts)), np.diff(grid.first))[end]
        stretch[grid.row[end]] = np.where(divided[own], own, -1)
        arc[grid.row[end]] = grid.arc[end]
        near = np.full(n, NEAR)
        ramps = original.force.ramps
        if ramps is not None:  # there the points are where the rounded path wants them
            steps = ramps.steps()[0]
            steps = steps[steps > 0]
            near[steps - 1] = np.maximum(NEAR, simulator.path.reach[steps])
        spots = np.append(0, np.cumsum(grid.on_the_spot))

        motions, place = ComparedMotions.of(simulation.samples), simulation.samples.place
        run_stretch, run_arc, run_spots = np.full(m, -1), np.full(m, np.nan), np.zeros(m, np.int64)
        run_stretch[motions.row] = np.where(divided[motions.stretch], motions.stretch, -1)
        run_arc[motions.row] = place.arc[motions.end]
        there = place.row[motions.end] + (place.share[motions.end] > 0.5)
        run_spots[motions.row] = spots[there]
        return MotionEnds(row, stretch, arc, near, spots, run_stretch, run_arc, run_spots)

    def same(self, rows: Ints, run_rows: Ints) -> Bools:
        """(K,) whether motions ``run_rows`` (K,) of the second program end where ``rows`` (K,) of the original do; -1
        is before all motions."""
        none, run_none = rows < 0, run_rows < 0
        same = (self.row[rows] == run_rows) | (self.row[rows] < 0)
        cut = (self.stretch[rows] >= 0) & (self.stretch[rows] == self.run_stretch[run_rows])
        beside = np.abs(self.arc[rows] - self.run_arc[run_rows]) <= self.near[rows]
        same |= cut & beside & (self.spots[rows + 1] == self.run_spots[run_rows])
        return np.asarray(np.where(none | run_none, none & run_none, same))


def elsewhere(
    pairs: Ints, sides: tuple[Statements, Statements], lines: tuple[Ints, Ints], ends: MotionEnds
) -> Ints:
    """Those (L, 2) of the statements ``pairs`` (K, 2), numbers in both programs, that follow another motion than in the
    original.

    ``lines``: of the motions, (N,) and (M,).  Of statements that run several times the first and the last motion count.
    """
    found = np.zeros(len(pairs), bool)
    for last in (False, True):
        one, two = (
            _rows_before(side, own, last)[numbers]
            for side, own, numbers in zip(sides, lines, pairs.T, strict=True)
        )
        found |= ~ends.same(one, two)
    return pairs[found]


def _rows_before(statements: Statements, lines: Ints, last: bool) -> Ints:
    """(U,) the row of the motion that precedes each statement in the text, -1 for none: of those of one statement the
    first, or the last."""
    starts = np.array(statements.lines)
    moving = np.array([text.startswith(MOTION) for text in statements.texts])
    numbers = np.arange(len(starts))
    order = np.argsort(starts, kind="stable")  # a comment within a statement precedes it in the list
    place = np.searchsorted(starts[order], lines, side="right") - 1
    # of several statements in a line those of motions count, the last one of them
    latest = np.maximum.accumulate(np.where(moving[order], numbers, -1))[place]
    same_line = (latest >= 0) & (starts[order[latest]] == starts[order[place]])
    number = order[np.where(same_line, latest, place)]
    row = np.full(len(starts), -1)
    rows = np.arange(len(lines)) if last else np.arange(len(lines))[::-1]
    row[number[rows]] = rows  # the last assignment of a statement counts
    known = np.maximum.accumulate(np.where(row >= 0, numbers, -1))
    before = np.append(-1, known)[: len(starts)]
    return np.where(before < 0, -1, row[before])
