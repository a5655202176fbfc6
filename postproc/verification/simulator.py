"""A program that runs in the place of the original: how far its tool is beside the path, and what else is another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints, sums
from postproc.base.batches import each_block
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Kind
from postproc.verification.nearest_segments import largest_of_nearest
from postproc.verification.pairing import SAME, Pairing
from postproc.verification.path_grid import PathGrid
from postproc.verification.path_samples import PathSamples, places_between
from postproc.verification.run_path import RunPath
from postproc.verification.tool_placement import PlacedTool, judged, place_tool

STEP = 4.0 * MM
"""Distance of the first samples along a motion."""

LEAST = 1
"""Intervals of a motion at first, at least."""

STILL, STILL_SHARE = 2e-7, 0.02
"""[m] and share by which twice as many samples may change the largest and the mean error."""

DOUBLINGS, MOST = 6, 4_000_000
"""How often the samples are doubled at most, and how many they may become."""

SHOWS, SHOWS_TURN = 8e-7, 8e-6
"""[m], [rad] by which a parabola departs at least from the polygon, where its halves have samples of their own.  Its
middle and its ends have samples anyhow; from the line between these it departs by a quarter of it: ``STILL``."""

BESIDE = 2 * STEP
"""[m] How far before and after the place of a point the path of the tool is looked at for the way past it."""

WORST, FINER = 12, 16
"""Motions with the largest errors, and in how many times as many parts as others they and their parabolas are
divided."""

SEARCHES = 8
"""How often it is looked between samples for a larger error than any of theirs."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A program along the original's cuts.

    samples; start, stop (K,): its rows in the place of each stretch, without ``approaches``; fixed, fixed_rows (F,):
    rows of the program and of the original, of stretches without a known path, that correspond one to one; change [m],
    change_angle [rad]: what the last doubling of the samples changed of the largest error; missed [m]: the largest
    distance of an end point of the original from the path of the tool; approaches (K,): rows that lead from where a cut
    starts in the original to where it starts corrected, or back, in air; approach_length [m]; points (P,): rows of the
    program whose end point alone is looked at, point_rows (P,) those of the original, point_error (P,) [m] and
    point_turn (P,) [rad] theirs; added (A,): rows before such points without a counterpart; unknown: vertices that are
    passed at a distance that is not known, taken as they are programmed; skipped: motions under force that cannot be
    simulated.
    """

    samples: PathSamples
    start: Ints
    stop: Ints
    fixed: Ints
    fixed_rows: Ints
    change: float
    change_angle: float
    missed: float
    approaches: Ints
    approach_length: float
    added: Ints
    points: Ints
    point_rows: Ints
    point_error: Floats
    point_turn: Floats
    unknown: int
    skipped: int

    @property
    def converged(self) -> bool:
        return bool(self.samples.place.settled.all() and np.isfinite(self.point_error).all())

    @property
    def largest(self) -> float:
        """[m] The largest distance of the tool from the wanted path, or of that from the path of the tool; NaN where it
        is not known."""
        if not self.converged or not len(self.samples.motion) + len(self.points):
            return float("nan")
        return float(
            max(self.samples.distance.max(initial=0.0), self.point_error.max(initial=0.0), self.missed)
        )


@dataclass(frozen=True, eq=False)
class Simulator:
    """The original with its grid, which programs are compared with."""

    original: CompensationProblem
    pairing: Pairing
    path: RunPath
    grid: PathGrid

    @staticmethod
    def of(original: CompensationProblem, pairing: Pairing) -> Simulator:
        path, cuts = RunPath.of(original), pairing.stretches
        return Simulator(
            original,
            pairing,
            path,
            PathGrid.of(original, path, cuts.start[cuts.length], cuts.stop[cuts.length]),
        )

    def run(self, run: CompensationProblem, start: Ints, stop: Ints, step: float = STEP) -> Simulation:
        """``run`` with the rows ``start`` to before ``stop`` (K,) in the place of each stretch."""
        cuts, has_length = self.pairing.stretches, self.pairing.stretches.length
        path = self.path if run is self.original else RunPath.of(run)
        first, last = start.copy(), stop.copy()
        added = (stop - start) > (cuts.stop - cuts.start)
        for number in np.flatnonzero(added & ~cuts.air):
            first[number] += self._leads(run, int(start[number]), int(cuts.start[number]))
        for number in np.flatnonzero(added & (stop - first > cuts.stop - cuts.start) & has_length):
            last[number] -= self._leads_back(run, int(stop[number]) - 1, int(cuts.stop[number]) - 1)
        outside = np.concatenate([_rows(start, first), _rows(last, stop)])
        half = self.original.track.half_turns.rows  # of which one part is added, in air as well
        turned = np.searchsorted(half, cuts.stop) > np.searchsorted(half, cuts.start)
        alone = ~has_length & ~(cuts.air & turned)
        points, wanted, error, turn = self._points(run, first, last)
        samples, change, change_angle = self._dense(run, path, first[has_length], last[has_length], step)
        fixed = [self._lone(first, last), *self._air(first, last)]
        return Simulation(
            samples,
            first,
            last,
            np.concatenate([part[1] for part in fixed]),
            np.concatenate([part[0] for part in fixed]),
            change,
            change_angle,
            self._missed(samples),
            outside,
            float(run.desired_path.length[outside].sum()),
            _rows(first[alone], (last - cuts.stop + cuts.start)[alone]),
            points,
            wanted,
            error,
            turn,
            int(path.unknown[samples.motion[samples.end]].sum()),
            len(cuts.lost),
        )

    def _leads(self, run: CompensationProblem, row: int, wanted: int) -> int:
        """1 where ``row`` of the run leads from where ``wanted`` of the original starts to where that starts corrected;
        such a motion is in air, where nothing but its two ends counts."""
        rows, at = np.array([row]), np.array([wanted])
        start = run.desired_path.start[rows].position - self.original.desired_path.start[at].position
        if (
            not np.linalg.norm(start) <= self._same_in_air
            or run.desired_path.length[row] > self.original.max_correction
        ):
            return 0
        return int(self._arrives(run, rows, run.wanted[rows], at, 0.0))

    def _leads_back(self, run: CompensationProblem, row: int, wanted: int) -> int:
        """The same after the end of a cut."""
        rows, at = np.array([row]), np.array([wanted])
        end = run.wanted[rows].position - self.original.wanted[at].position
        if (
            not np.linalg.norm(end) <= self._same_in_air
            or run.desired_path.length[row] > self.original.max_correction
        ):
            return 0
        return int(self._arrives(run, rows, run.desired_path.start[rows], at, 1.0))

    @property
    def _same_in_air(self) -> float:
        """[m] how far places in air may be from those of the original."""
        return SAME if self.original.process else self.original.max_correction

    def _arrives(self, run: CompensationProblem, rows: Ints, command: Poses, at: Ints, share: float) -> bool:
        """Whether the tool is where ``at`` of the original starts (share 0) or ends, under the force there."""
        there = np.full(len(at), share)
        real = run.simulated(rows, command, self.original.force.along(at, there))
        goal = self.original.goal(at, self.path.at(at, there), there)
        away = lengths(real.pose.position - goal.position)
        return bool((away <= self.original.tolerance).all())

    def _air(self, first: Ints, last: Ints) -> list[tuple[Ints, Ints]]:
        """Of each stretch in air, its rows and those of the run, ``first`` to before ``last`` (K,), that correspond to
        them: what is added lies before the first motion that turns the tool by half a turn, else before all."""
        cuts, pairs = self.pairing.stretches, []
        for number in np.flatnonzero(cuts.air).tolist():
            rows = np.arange(cuts.start[number], cuts.stop[number])
            half = np.isin(rows, self.original.track.half_turns.rows)
            before = np.arange(len(rows)) < (np.argmax(half) if half.any() else 0)
            pairs.append(
                (rows, np.where(before, first[number] - rows[0], last[number] - rows[-1] - 1) + rows)
            )
        return pairs

    def _lone(self, first: Ints, last: Ints) -> tuple[Ints, Ints]:
        """Rows of the stretches under force of which the end points alone count, and those of the run."""
        cuts = self.pairing.stretches
        lone = ~cuts.length & ~cuts.air
        return _rows(cuts.start[lone], cuts.stop[lone]), _rows(
            (last - cuts.stop + cuts.start)[lone], last[lone]
        )

    def _points(self, run: CompensationProblem, first: Ints, last: Ints) -> tuple[Ints, Ints, Floats, Floats]:
        """Rows of the run whose end points alone are looked at, those of the original, and how far these are off [m]
        and turned [rad]."""
        original, cuts = self.original, self.pairing.stretches
        wanted, rows = ([part] for part in self._lone(first, last))
        if not original.process:  # in air as well, every target is corrected
            path = original.toolpath
            in_air = np.concatenate([self.pairing.air, *(part[0] for part in self._air(first, last))])
            there = np.concatenate([self.pairing.run_air, *(part[1] for part in self._air(first, last))])
            # a motion that leads to a cut ends where that starts, which is looked at there
            leads = np.isin(in_air + 1, cuts.start[cuts.length]) & (path.kind[in_air] == Kind.LIN)
            some = path.known & ~path.on_axes & (original.track.branch >= 0)
            some = some[in_air] & ~leads
            wanted.append(in_air[some])
            rows.append((in_air if run is original else there)[some])
        row, at = np.concatenate(rows), np.concatenate(wanted)
        if not len(row):
            return row, at, np.zeros(0), np.zeros(0)
        real = run.simulated(row, run.wanted[row], original.wrench[at])
        goal = original.goal(at, original.wanted[at])
        good = real.reachable & real.settled
        away = np.where(good, lengths(real.pose.position - goal.position), np.nan)
        return (
            row,
            at,
            away,
            lengths(judged(original, at, goal.rotation, turn_between(goal.rotation, real.pose.rotation))),
        )

    def _dense(
        self, run: CompensationProblem, path: RunPath, start: Ints, stop: Ints, step: float
    ) -> tuple[PathSamples, float, float]:
        """Samples so dense that twice as many change nothing, and what the last doubling changed."""
        stretch, rows = np.repeat(np.arange(len(start)), stop - start), _rows(start, stop)
        parts = np.maximum(LEAST, np.ceil(run.desired_path.length[rows] / step)).astype(np.int64)
        halves = self._rounded(path, rows)
        samples = self._sampled(run, path, stretch, rows, parts, halves)
        change = change_angle = float("nan")
        for _ in range(DOUBLINGS):
            parts, halves = 2 * parts, 2 * halves
            if not len(rows) or parts.sum() > MOST or not samples.place.settled.all():
                break
            often = _often(samples, rows)
            finer = self._sampled(run, path, stretch, rows, parts * often, halves * often, samples)
            old, new = samples.distance, finer.distance
            change = abs(float(new.max() - old.max()))
            mean = abs(finer.rms - samples.rms)
            turns = [float(one.place.turn.max()) for one in (samples, finer)]
            change_angle = abs(turns[1] - turns[0])
            samples = finer
            if max(change, mean) <= max(STILL, STILL_SHARE * float(new.max())):
                break
        # of the original alone, which nothing is judged by, that would take a third of the time
        for _ in range(SEARCHES if run is not self.original else 0):
            if not len(rows) or not samples.place.settled.all():
                break
            number, share = places_between(samples, rows)
            if not len(number):
                break
            finer = self._with_more(run, path, (stretch, rows), samples, (rows[number], share))
            change = abs(float(finer.distance.max() - samples.distance.max()))
            change_angle = abs(float(finer.place.turn.max() - samples.place.turn.max()))
            samples = finer
        return samples, change, change_angle

    @staticmethod
    def _rounded(path: RunPath, rows: Ints) -> Ints:
        """(R,) 1 for motions ``rows`` (R,) on which a parabola shows: elsewhere the path is as good as its polygon."""
        count = len(path.reach)
        vertices = np.union1d(rows, rows + 1)
        vertices = vertices[vertices < count]
        shows = np.zeros(count + 1, bool)

        def fill(block: slice) -> None:
            off, turn = path.departure(vertices[block])
            shows[vertices[block]] = (off > SHOWS) | (turn > SHOWS_TURN)

        each_block(fill, len(vertices))
        return (shows[rows] | shows[rows + 1]).astype(np.int64)

    def _sampled(
        self,
        run: CompensationProblem,
        path: RunPath,
        stretch: Ints,
        rows: Ints,
        parts: Ints,
        halves: Ints,
        coarser: PathSamples | None = None,
    ) -> PathSamples:
        """Samples at the ends of ``parts`` (R,) even parts of the motions ``rows`` (R,), of ``halves`` (R,) even parts
        of the halves of parabolas on them, and where each stretch starts; those of ``coarser`` are not solved again."""
        opens = np.append(True, stretch[1:] != stretch[:-1])[: len(rows)]
        return self._placed(run, path, (stretch, rows), path.shares(rows, parts, halves, opens), coarser)

    def _with_more(
        self,
        run: CompensationProblem,
        path: RunPath,
        motions: tuple[Ints, Ints],
        samples: PathSamples,
        more: tuple[Ints, Floats],
    ) -> PathSamples:
        """``samples`` of the ``motions``, stretches (R,) and rows (R,), and those at shares (M,) of the rows (M,)
        ``more``; the stretches of these alone are placed again."""
        stretch, rows = motions
        some = np.isin(stretch, stretch[np.searchsorted(rows, more[0])])
        stretch, rows = stretch[some], rows[some]
        touched = np.isin(samples.stretch, stretch)
        coarser = samples.at(np.flatnonzero(touched))
        number = np.searchsorted(rows, np.append(coarser.motion, more[0]))
        share = np.append(coarser.share, more[1])
        order = np.lexsort((share, number))
        finer = self._placed(run, path, (stretch, rows), (number[order], share[order]), coarser)
        return samples.at(np.flatnonzero(~touched)).joined(finer)

    def _placed(
        self,
        run: CompensationProblem,
        path: RunPath,
        motions: tuple[Ints, Ints],
        at: tuple[Ints, Floats],
        coarser: PathSamples | None,
    ) -> PathSamples:
        """Samples ``at`` numbers (S,) of the ``motions``, stretches (R,) and rows (R,), and shares (S,) of them."""
        stretch, rows = motions
        opens = np.append(True, stretch[1:] != stretch[:-1])[: len(rows)]
        closes = np.append(stretch[1:] != stretch[:-1], True)[: len(rows)]
        number, share = at
        end = share == 1.0
        motion, where = rows[number], stretch[number]
        known = None if coarser is None else _among(coarser, rows, number, share)
        place = place_tool(self.grid, path, where, (motion, share), known)
        before = np.append(0.0, np.where(number[1:] == number[:-1], share[:-1], 0.0))[: len(share)]
        distance = (share - before) * run.desired_path.length[motion]
        return PathSamples(
            where, motion, share, place, end, (share == 0) & opens[number], end & closes[number], distance
        )

    def _missed(self, samples: PathSamples) -> float:
        """[m] the largest distance of an end point of the original from the path of the tool, near where it passes:
        what is skipped where a place leaps over a corner."""
        grid, place = self.grid, samples.place
        if not len(samples.motion) or not place.settled.all():
            return float("nan") if len(samples.motion) else 0.0
        far = 2 * float(grid.arc.max()) + 1.0
        passed = np.maximum.accumulate(samples.stretch * far + place.arc)
        some = grid.gap | np.append(True, grid.gap[:-1])
        node = (np.repeat(np.arange(len(grid.first) - 1), np.diff(grid.first)) * far + grid.arc)[some]
        # all that the program runs from BESIDE before it passes the place until as far after
        gone = np.cumsum(samples.distance_along)
        near = [np.minimum(np.searchsorted(passed, node, side), len(gone) - 1) for side in ("left", "right")]
        first = np.searchsorted(gone, gone[near[0]] - BESIDE) - 3
        stop = np.searchsorted(gone, gone[near[1]] + BESIDE) + 3
        last = np.searchsorted(samples.stretch, samples.stretch, side="right") - 1
        return largest_of_nearest(place.tool, last, grid.goal_at[some], (near[0] - 1, first, stop))


def _rows(start: Ints, stop: Ints) -> Ints:
    """The rows ``start`` to before ``stop`` (K,), one range after another."""
    count = stop - start
    return np.repeat(start - sums(count)[:-1], count) + np.arange(count.sum())


def _among(coarser: PathSamples, rows: Ints, number: Ints, share: Floats) -> tuple[PlacedTool, Ints]:
    """Places of ``coarser``, and which of the samples at the shares (S,) of the motions ``number`` (S,) among ``rows``
    (R,) they are; parts of parts end at the very same shares."""
    old = np.searchsorted(rows, coarser.motion)
    at = np.minimum(np.searchsorted(2.0 * number + share, 2.0 * old + coarser.share), len(share) - 1)
    same = np.flatnonzero((number[at] == old) & (share[at] == coarser.share))
    return coarser.place.at(same), at[same]


def _often(samples: PathSamples, rows: Ints) -> Ints:
    """(R,) how many times as often the motions ``rows`` (R,) are to be sampled: those about the largest errors
    more, as a peak between two samples would be missed there."""
    often = np.ones(len(rows), np.int64)
    largest = np.zeros(len(rows))
    np.maximum.at(largest, np.searchsorted(rows, samples.motion), samples.distance)
    at = np.argsort(-largest, kind="stable")[:WORST]
    for beside in (at - 1, at, at + 1):
        often[np.clip(beside, 0, len(rows) - 1)] = FINER
    return often
