"""What two programs differ in beside their places: stops, backward motions, points that are missing, frames, feeds,
air."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, FewRows, Floats, Ints
from postproc.base.batches import each_block
from postproc.base.geometry import lengths, turn_between
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Kind, Toolpath, external_at
from postproc.verification.pairing import SAME
from postproc.verification.path_samples import PathSamples
from postproc.verification.run_path import RunPath
from postproc.verification.simulator import Simulation, Simulator

SAME_TURN = 3e-5
"""[rad] Orientations that are the same as far as written digits go."""

SAME_EXTERNAL = 2e-3
"""External axes that are, in mm and deg as the text has them."""

NEAR = 0.05 * MM
"""How far from a point of the original, along the path, the motion may end that represents it."""

AGAINST = 5e-6
"""[m] A motion that leads against the feed by less does so by digits."""

IDLE, IDLE_TURN = 1e-6, 1e-6
"""[m], [rad] A motion that is not longer leads nowhere."""


@dataclass(frozen=True, eq=False)
class ComparedMotions:
    """R motions of a program on the original's cuts, in their order: row (R,); stretch (R,); start, end (R,): numbers
    of the samples where they start and end."""

    row: Ints
    stretch: Ints
    start: Ints
    end: Ints

    @property
    def middle(self) -> Ints:
        """(R,) numbers of the samples in the middle."""
        return np.asarray((self.start + self.end + 1) // 2)

    @staticmethod
    def of(samples: PathSamples) -> ComparedMotions:
        end = np.flatnonzero(samples.end)
        stretch = samples.stretch[end]
        same = np.append(False, stretch[1:] == stretch[:-1])[: len(end)]
        opening = np.searchsorted(samples.stretch, stretch)
        return ComparedMotions(
            samples.motion[end], stretch, np.where(same, np.append(0, end[:-1])[: len(end)], opening), end
        )


@dataclass(frozen=True)
class Difference:
    """One motion of the second program (``run`` True) or of the original that differs: what it is, and where."""

    row: int
    run: bool
    what: str


@dataclass(frozen=True, eq=False)
class PathManner:
    """How a program runs its cuts: rows, (K,) each, that stop inside of one (``stops`` (K,)), lead against the feed
    (``backwards`` (K,)), or lead nowhere (``idle`` (K,))."""

    stops: Ints
    backwards: Ints
    idle: Ints

    @staticmethod
    def of(simulator: Simulator, run: CompensationProblem, simulation: Simulation) -> PathManner:
        motions = ComparedMotions.of(simulation.samples)
        inside = np.append(motions.stretch[1:] == motions.stretch[:-1], False)[: len(motions.row)]
        rests = stops(run.toolpath)[motions.row] & inside
        short = run.desired_path.length[motions.row] < IDLE
        row = motions.row[short]
        turn = lengths(turn_between(run.desired_path.start[row].rotation, run.wanted[row].rotation))
        back = _against_feed(simulator, run, simulation.samples, motions)
        return PathManner(motions.row[rests], motions.row[back], row[turn < IDLE_TURN])


def stops(path: Toolpath) -> Bools:
    """(N,) the controller comes to rest at the end point."""
    return np.asarray(getattr(path, "stops", path.approximation == 0.0))


def _against_feed(
    simulator: Simulator, run: CompensationProblem, samples: PathSamples, motions: ComparedMotions
) -> Bools:
    """(R,) straight motions against the original's feed where they start, in their middle and where they end."""
    row = motions.row
    back = ~run.desired_path.arc[row]
    for at in (motions.start, motions.middle, motions.end):
        asked = np.flatnonzero(back)

        def ask(block: slice, asked: Ints = asked, at: Ints = at) -> None:
            some = asked[block]
            path = run.wanted[row[some]].position - run.desired_path.start[row[some]].position
            place = at[some]
            feed = simulator.path.tangent(samples.place.row[place], samples.place.share[place])
            back[some] = np.sum(path * feed, axis=1) < -AGAINST

        each_block(ask, len(asked))
    return np.asarray(back)


def on_cuts(simulator: Simulator, run: CompensationProblem, simulation: Simulation) -> list[Difference]:
    """What the motions on the cuts differ in from those of the original at their places."""
    original, samples = simulator.original, simulation.samples
    motions = ComparedMotions.of(samples)
    # a motion from one place to another represents what lies between: in its middle, but short ones at a vertex
    owners = [samples.place.row[at] for at in (motions.middle, motions.start, motions.end)]
    owners += [np.minimum(owners[1] + 1, len(original.toolpath) - 1)]
    differences: list[Difference] = []
    for what, same in _TRAITS:
        wrong = np.ones(len(motions.row), bool)
        for owner in owners:
            remaining = np.flatnonzero(wrong)
            wrong[remaining] = ~same(original, run, owner[remaining], motions.row[remaining])
        differences += [Difference(int(row), True, what) for row in motions.row[wrong]]
    differences += _other_external(simulator, run, samples, motions)
    for what, same in (*_TRAITS, _EXTERNAL):
        wrong = ~same(original, run, simulation.point_rows, simulation.points)
        differences += [Difference(int(row), True, what) for row in simulation.points[wrong]]
    differences += _new_stops(simulator, run, samples, motions)
    differences += [
        Difference(int(row), True, "the motion belongs to no motion of the original")
        for row in simulation.added
    ]
    return differences


def _new_stops(
    simulator: Simulator, run: CompensationProblem, samples: PathSamples, motions: ComparedMotions
) -> list[Difference]:
    """Motions that stop where those of the original flow: anywhere but at the end of one that stops as well, or on one
    whose mode (G61) passes all points exactly."""
    original = simulator.original.toolpath
    inside = np.append(motions.stretch[1:] == motions.stretch[:-1], False)[: len(motions.row)]
    if original.constraints.exact_stays:
        inside &= ~stops(original)[samples.place.row[motions.end]]
    rests = motions.row[stops(run.toolpath)[motions.row] & inside]
    place, end = samples.place, motions.end
    # several motions may end at one place, where one only turns the tool
    row, share, rest = place.row[end], place.share[end], stops(original)
    length = simulator.original.desired_path.length[row]
    at_end = rest[row] & ((1.0 - share) * length <= NEAR)
    may = np.append(end_rows(simulator, samples)[stops(original)], motions.row[at_end])
    return [
        Difference(int(row), True, "the motion stops where the original flows")
        for row in np.setdiff1d(rests, may)
    ]


def missing(simulator: Simulator, samples: PathSamples) -> list[Difference]:
    """Motions of the original at whose end none of the program ends; of a program that is within the tolerance."""
    what = "no motion of the output ends where this motion ends"
    rows = np.union1d(_missing(simulator, samples), _unfinished(simulator, samples))
    return [Difference(int(row), False, what) for row in rows]


def _unfinished(simulator: Simulator, samples: PathSamples) -> Ints:
    """Rows of the original that only move external axes at one place, and to whose end no motion moves them."""
    path = simulator.original.toolpath
    rows = np.flatnonzero(simulator.grid.on_the_spot)
    way = np.abs(external_at(path, rows, np.ones(len(rows))) - external_at(path, rows, np.zeros(len(rows))))
    way = np.nan_to_num(way).max(axis=1, initial=0.0)
    reached, end = np.zeros(len(path)), np.flatnonzero(samples.end)
    np.maximum.at(reached, samples.place.row[end], samples.place.share[end])
    return np.asarray(rows[(1.0 - reached[rows]) * way > SAME_EXTERNAL])


def _missing(simulator: Simulator, samples: PathSamples) -> Ints:
    """Rows of the original, on cuts, at whose end no motion of the program ends."""
    rows, _, away, apart = _nearest_ends(simulator, samples)
    # where the force steps at a vertex that is rounded, its points are where the rounded path wants them
    ramps = simulator.original.force.ramps
    stepped = np.isin(rows + 1, ramps.steps()[0]) if ramps is not None else np.zeros(len(rows), bool)
    passed = np.where(stepped, np.append(simulator.path.reach, 0.0)[rows + 1], 0.0)
    near = np.maximum(passed, max(NEAR, simulator.original.tolerance))
    # nearer than to its neighbours; a motion that only turns the tool ends where another one does
    limit = np.minimum(near, 0.45 * apart)
    return rows[away > np.where(apart > NEAR * 1e-3, limit, NEAR)]


def end_rows(simulator: Simulator, samples: PathSamples) -> Ints:
    """(N,) the row of the program that ends where a motion of the original ends: on a cut to which none was added the
    one of the same number, else that which ends nearest to it; -1 off the cuts."""
    rows, nearest, _, _ = _nearest_ends(simulator, samples)
    cuts, motions = simulator.pairing.stretches, ComparedMotions.of(samples)
    stretch = np.repeat(np.arange(cuts.length.sum()), (cuts.stop - cuts.start)[cuts.length])
    own = np.searchsorted(motions.stretch, np.arange(cuts.length.sum() + 1))
    same = (np.diff(own) == (cuts.stop - cuts.start)[cuts.length])[stretch]
    number = own[stretch] + np.arange(len(rows)) - np.searchsorted(stretch, stretch)
    ends = np.full(len(simulator.original.toolpath), -1)
    ends[rows] = np.where(same, motions.row[np.minimum(number, len(motions.row) - 1)], nearest)
    return ends


def _nearest_ends(simulator: Simulator, samples: PathSamples) -> tuple[Ints, Ints, Floats, Floats]:
    """Of the rows (R,) of the original on its cuts: the program's row that ends nearest to where they end, how far that
    is along the path [m], and how far they are from their neighbours [m]."""
    grid, end = simulator.grid, np.flatnonzero(samples.end)
    last = np.flatnonzero(grid.gap)
    if not len(last):
        return last, last, np.zeros(0), np.zeros(0)
    # one axis for all stretches: far apart on it
    far = 2 * float(grid.arc.max()) + 1.0
    stretch = np.repeat(np.arange(len(grid.first) - 1), np.diff(grid.first))
    wanted = stretch[last] * far + grid.arc[last]
    ends = samples.stretch[end] * far + samples.place.arc[end]
    order = np.argsort(ends, kind="stable")
    at = np.searchsorted(ends[order], wanted)
    around = np.stack([order[np.maximum(at - 1, 0)], order[np.minimum(at, len(ends) - 1)]])
    away = np.abs(ends[around] - wanted)
    nearer = np.argmin(away, axis=0)
    nearest, numbers = around[nearer, np.arange(len(last))], np.arange(len(last))
    before = np.abs(np.diff(wanted, prepend=wanted[0] - far))
    apart = np.minimum(before, np.append(before[1:], far))
    return grid.row[last], samples.motion[end[nearest]], away[nearer, numbers], apart


def in_air(simulator: Simulator, run: CompensationProblem, simulation: Simulation) -> list[Difference]:
    """What the motions in air differ in from those of the original.

    All targets are the original's, but of one that leads to a cut: that may lead to where the cut starts corrected, as
    the simulation of the cut shows, where nothing else leads there.
    """
    original, pairing = simulator.original, simulator.pairing
    rows, run_rows = pairing.air, pairing.run_air
    if not len(rows):
        return []
    cuts = pairing.stretches
    path, other = original.toolpath, run.toolpath
    differences = []
    for what, same in (*_TRAITS, _EXTERNAL):
        differences += [
            Difference(int(row), True, what) for row in run_rows[~same(original, run, rows, run_rows)]
        ]
    wrong = (stops(path)[rows] != stops(other)[run_rows]) & np.isin(path.kind[rows], (Kind.LIN, Kind.CIRC))
    what = "the air move stops where the original flows, or flows where it stops"
    differences += [Difference(int(row), True, what) for row in run_rows[wrong]]
    wrong = ~_same_target(original, run, rows, run_rows)
    if not original.process:
        wrong &= ~(path.known[rows] & ~path.on_axes[rows])  # these are corrected in air as well
    led = np.isin(run_rows + 1, simulation.approaches)
    moved = np.isin(rows + 1, cuts.start) & ~led & path.known[rows]
    one, two = original.wanted[rows].position, run.wanted[run_rows].position
    wrong &= ~(moved & (lengths(two - one) <= original.max_correction))
    return differences + [
        Difference(int(row), True, "the air move has another end than in the original")
        for row in run_rows[wrong]
    ]


def _same_target(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints
) -> Bools:
    one, two = original.wanted[rows], run.wanted[run_rows]
    unknown = np.isnan(one.position[:, 0])
    same = lengths(two.position - one.position) <= SAME
    same &= lengths(turn_between(one.rotation, two.rotation)) <= SAME_TURN
    same |= unknown & np.isnan(two.position[:, 0])
    axes, others = original.toolpath.axes[rows], run.toolpath.axes[run_rows]
    same &= np.isclose(axes, others, rtol=0, atol=1e-9, equal_nan=True).all(axis=1)
    path, other = original.toolpath, run.toolpath
    arcs = np.isfinite(path.arcs.sweep[rows])
    return np.asarray(
        same & (~arcs | np.isclose(path.arcs.sweep[rows], other.arcs.sweep[run_rows], rtol=0, atol=1e-4))
    )


def _same_kind(original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints) -> Bools:
    one, two = original.toolpath, run.toolpath
    path = (Kind.LIN, Kind.CIRC)  # an arc may be divided into straight motions, and vice versa
    kind, other = one.kind[rows], two.kind[run_rows]
    return np.asarray((kind == other) | (np.isin(kind, path) & np.isin(other, path)))


def _same_feed(original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints) -> Bools:
    one, two = original.toolpath, run.toolpath
    same = np.isclose(one.feed[rows], two.feed[run_rows], rtol=1e-6, equal_nan=True)
    return np.asarray(same | (one.inverse_time_feed[rows] & two.inverse_time_feed[run_rows]))


def _same_frames(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints
) -> Bools:
    same = np.ones(len(rows), bool)
    for one, two in ((original.base, run.base), (original.tool, run.tool)):
        first, second = one[rows], two[run_rows]
        known = np.isfinite(first.position[:, 0]) | np.isfinite(second.position[:, 0])
        apart = lengths(first.position - second.position) > 1e-9
        apart |= np.abs(first.rotation - second.rotation).max(axis=(1, 2)) > 1e-9
        apart |= ~np.isfinite(first.position[:, 0] - second.position[:, 0])
        same &= ~(known & apart)
    return same


def _same_branch(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints
) -> Bools:
    return np.asarray(original.track.branch[rows] == run.track.branch[run_rows])


def _same_approximation(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints
) -> Bools:
    """An end point is approximated as the one that it represents; one that is inserted into a motion that stops, as the
    language writes it."""
    one, two, limits = original.toolpath, run.toolpath, original.toolpath.constraints
    number, other = one.sequence.approximation_number[rows], two.sequence.approximation_number[run_rows]
    distance, own = one.approximation[rows], two.approximation[run_rows]
    inserted = limits.inserted_approximation[rows]
    same = _equal(number, other) & _equal(distance, own)
    # where a control may stop or not, the distance is not known at the last part of a motion alone
    same |= np.isnan(distance) & np.isnan(number) & np.isnan(other) & np.isfinite(own)
    named = np.isfinite(own) & np.isnan(other) | np.isnan(own) & np.isnan(inserted)
    if limits.inserted_number is not None:
        same |= stops(one)[rows] & named & (other == limits.inserted_number)
    else:
        same |= stops(one)[rows] & named & np.isnan(other)
    return np.asarray(same | stops(two)[run_rows])


def _equal(one: Floats, two: Floats) -> Bools:
    return np.isclose(one, two, rtol=1e-6, atol=1e-9, equal_nan=True)


def _same_external(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints
) -> Bools:
    one, two = _external(original.toolpath), _external(run.toolpath)
    if one is None or two is None:
        return np.ones(len(rows), bool)
    same = np.isclose(one[rows], two[run_rows], rtol=0, atol=SAME_EXTERNAL, equal_nan=True)
    return np.asarray(same.all(axis=1))


def _other_external(
    simulator: Simulator, run: CompensationProblem, samples: PathSamples, motions: ComparedMotions
) -> list[Difference]:
    """Motions whose external axes are not those of their place: these go evenly from target to target."""
    one, two = _external(simulator.original.toolpath), _external(run.toolpath)
    if one is None or two is None:
        return []
    row, share = samples.place.row[motions.end], samples.place.share[motions.end][:, None]
    start, end, here = one[np.maximum(row - 1, 0)], one[row], two[motions.row]
    start = np.where(np.isfinite(start), start, end)
    rate = np.abs(end - start) / np.maximum(simulator.original.desired_path.length[row], NEAR)[:, None]
    # where the run misses the point that it states, the axes miss theirs
    passed = np.append(RunPath.of(run).reach, 0.0)[motions.row + 1]
    near = np.maximum(passed, simulator.original.tolerance)[:, None]
    apart = np.abs(here - start - share * (end - start)) > SAME_EXTERNAL + rate * near
    apart |= np.isfinite(here) != np.isfinite(end)
    return [Difference(int(at), True, _EXTERNAL[0]) for at in motions.row[apart.any(axis=1)]]


def _external(path: Toolpath) -> Floats | FewRows | None:
    """(N, k) external axes [mm, deg], where the motions have them."""
    return getattr(path, "external", None)


_TRAITS = (
    ("the motion is of another kind", _same_kind),
    ("the motion has another base or tool", _same_frames),
    ("the motion has another feed", _same_feed),
    ("the motion has another configuration of the robot", _same_branch),
    ("the motion has another approximation", _same_approximation),
)
"""What a motion shares with the one of the original that it means."""

_EXTERNAL = ("the motion has other values of external axes", _same_external)
