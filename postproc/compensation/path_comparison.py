"""The path after the correction against the path before, cut by cut; what the transitions of an output are like.

An error along the feed makes the tool early or late: it marks the part only where the path starts, ends or turns.  What
a motion leaves on the part is the error across the feed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding
from postproc.base.geometry import lengths
from postproc.base.units import MM
from postproc.compensation.approximations import approximations
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.path_error import PathSegments, path_errors, programmed
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.toolpath import Role

WORTH = 1e-9
"""[m] End points that are not better by this are not better."""

ROUNDING = 1e-6
"""[m] What the digits of a program do to a path."""

HELP = "allow inserted motions (no --no-insert), raise max_growth, or loosen the tolerance"
LONGER_RAMP = "the force steps inside this cut: state a longer force_ramp if it changes more slowly"

SHORT = 0.9
"""Share of an interpolation cycle: a motion that lasts less is one at which the controller may slow down."""

PARTS = 8
"""Parts of a motion between which the correction on a ramp of the force is compared."""


def across_feed(task: CompensationProblem, rows: Ints, error: Floats) -> tuple[Floats, Floats]:
    """(K,) [m] the parts of ``error`` (K, 3) along the feed at the end points of motions ``rows`` (K,), with its sign,
    and (K,) across it; all of it is across where a motion has no direction."""
    along = np.nan_to_num(np.sum(error * task.desired_path.tangent(rows, np.ones(len(rows))), axis=1))
    return along, np.sqrt(np.maximum(np.einsum("ni,ni->n", error, error) - along**2, 0.0))


def along_and_across(task: CompensationProblem, result: CorrectionResult) -> tuple[Floats, Floats]:
    """(N,) [m] predicted errors before the correction at the end points, along and across the feed; NaN where nothing
    is predicted."""
    rows = np.flatnonzero(np.isfinite(result.deflection[:, 0]))
    errors = np.full((2, len(result.state)), np.nan, np.float32)

    def parted(part: slice) -> None:
        errors[:, rows[part]] = across_feed(task, rows[part], result.deflection[rows[part]])

    for _ in in_blocks(parted, len(rows)):
        pass
    return errors[0], errors[1]


def cuts_not_improved(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    between: Floats,
    before: Floats,
) -> dict[int, Finding]:
    """Of each cut on which the path after the correction is no better than the path before: its first row, and why it
    stays as it was.

    between (M,) [m]: largest error across the feed inside of each motion of ``division`` after the correction; before
    (N,) [m]: that at the end points without one.
    """
    rows = np.flatnonzero(result.corrected & task.carries)  # what moves in air leaves nothing on the part
    if not len(rows):
        return {}
    cuts, place = np.unique(result.cut[rows], return_inverse=True)

    def largest(values: Floats, at: Ints) -> Floats:
        maxima = np.zeros(len(cuts))
        np.fmax.at(maxima, at, values)
        return maxima

    def mean_square(values: Floats) -> Floats:
        size = np.nan_to_num(values, posinf=np.inf)
        return np.bincount(place, size**2, len(cuts)) / np.bincount(place)

    ends = result.across_after[rows]
    square = [mean_square(values[rows]) for values in (result.after, result.before)]
    motions = np.flatnonzero((result.corrected & task.carries)[division.source] & ~division.transitions)
    cut_of = place[np.searchsorted(rows, division.source[motions])]
    after = np.maximum(largest(ends, place), largest(between[motions], cut_of))
    first = largest(before[rows], place)
    angles = (largest(angle[rows], place) for angle in (result.after_angle, result.before_angle))
    turned = next(angles) > next(angles) + task.tolerance_angle
    profiled = np.zeros(len(cuts), bool)  # their force may act between the points alone
    if task.force.ramps is not None:
        profiled[place[np.isin(rows, task.force.ramps.row[task.force.ramps.inside])]] = True
    suspect = (after > first + ROUNDING) | profiled
    if suspect.any():  # the path before may be worse between its points than there
        some = rows[suspect[place]]
        first = np.maximum(
            first, largest(errors_between_as_programmed(task, some), np.searchsorted(cuts, result.cut[some]))
        )
    ends_not_better = (square[0] > square[1] - WORTH**2) & ~(profiled & (after < first - ROUNDING))
    worse = (after > first + ROUNDING) | ends_not_better | turned
    stepped = np.zeros(len(cuts), bool)
    if task.force.ramps is not None:
        stepped[place[np.isin(rows, task.force.ramps.steps()[0])]] = True
    findings = {}
    for k in np.flatnonzero(worse).tolist():
        row = int(rows[np.argmax(place == k)])
        what = (
            "the corrected orientation is worse than the uncorrected one"
            if turned[k]
            else f"the corrected path is not better: across the feed it is {after[k] / MM:.4f} mm off"
            f" and {first[k] / MM:.4f} without the correction"
        )
        line = int(task.toolpath.line[row])
        findings[row] = Finding(
            "COR016",
            what,
            task.file,
            line,
            help=HELP + (f"; {LONGER_RAMP}" if stepped[k] else ""),
        )
    return findings


def errors_between_as_programmed(task: CompensationProblem, rows: Ints) -> Floats:
    """(K,) [m] largest error across the feed inside of the motions ``rows`` (K,) as they are programmed."""

    def compare(part: slice) -> Floats:
        some = rows[part]
        known = task.desired_path.traceable[some]
        errors = np.zeros(len(some))
        at = some[known]
        errors[known], _ = path_errors(task, programmed(task, at))
        return errors

    return np.concatenate([np.empty(0), *in_blocks(compare, len(rows))])


def errors_inside(task: CompensationProblem) -> tuple[Ints, Floats]:
    """The motions (K,) inside of which the force changes, and the largest error (K,) [m] across the feed along each as
    it is programmed."""
    ramps = task.force.ramps
    rows = np.unique(ramps.row[ramps.inside]) if ramps is not None else np.empty(0, np.int64)
    return rows, errors_between_as_programmed(task, rows)


@dataclass(frozen=True)
class Transitions:
    """What an output does where its correction changes.

    rate: largest change of the correction, m per m of path, and ``rate_line`` where; speed [m/s]: the same at the
    programmed feed, NaN where no feed is known; backwards: motions in a cut that lead against the feed; stops: exact
    stops inside of cuts that the input does not have; lead_ins: motions in air that end where a cut starts corrected.
    """

    rate: float
    rate_line: int
    speed: float
    backwards: int
    stops: int
    lead_ins: int


def evaluate_transitions(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision
) -> Transitions:
    """Of the motions of ``division`` in corrected cuts."""
    source, desired_path = division.source, task.desired_path
    chosen = np.flatnonzero(result.corrected[source] & desired_path.traceable[source] & ~division.transitions)

    # there the correction is one of the rounded path, and not of its points
    rounded = np.zeros(len(division), bool)
    if division.fits is not None:
        rounded[division.fits.point] = rounded[division.fits.point + 1] = True
    ramps = task.force.ramps
    on_ramp = np.zeros(len(task.carries), bool)
    if ramps is not None:
        on_ramp[ramps.row] = True

    def compare(part: slice) -> tuple[float, int, float, int]:
        segments = subdivided_motions(task, division, chosen[part])
        first, last = (
            desired_path.at(segments.rows, share).position for share in (segments.first, segments.last)
        )
        change = lengths((segments.end.position - last) - (segments.start.position - first))
        extent = (segments.last - segments.first) * desired_path.length[segments.rows]
        moves = extent > 0
        even = moves & ~rounded[chosen[part]]
        rate = np.where(even, change / np.where(moves, extent, 1.0), 0.0)
        ramp = np.flatnonzero(moves & ~even & on_ramp[segments.rows])
        if len(ramp):
            rate[ramp] = _rates_on_ramps(task, segments[ramp])
        speed = rate * task.toolpath.feed[segments.rows]
        ahead = np.sum((segments.end.position - segments.start.position) * (last - first), axis=1)
        worst = int(np.argmax(rate))
        known = speed[np.isfinite(speed)]
        return (
            float(rate[worst]),
            int(segments.rows[worst]),
            float(known.max()) if len(known) else np.nan,
            int((moves & (ahead < 0)).sum()),
        )

    parts = list(in_blocks(compare, len(chosen)))
    if not parts:
        return Transitions(0.0, 0, np.nan, 0, 0, len(division.lead_ins))
    rate, row, _, _ = max(parts)
    speeds = [speed for _, _, speed, _ in parts if np.isfinite(speed)]
    return Transitions(
        rate,
        int(task.toolpath.line[row]),
        max(speeds, default=np.nan),
        sum(backwards for *_, backwards in parts),
        int(_stops(task, result, division).sum()),
        len(division.lead_ins),
    )


def short_motions(task: CompensationProblem, division: Subdivision, cycle: float) -> Ints:
    """The motions (S,) of ``division`` beside inserted points that are shorter than what the tool moves in ``cycle``
    [s] at the programmed feed: where a correction changes faster than the path goes on, points that are apart on the
    path are together in space.  Arcs are not looked at."""
    if len(division) < 2:
        return np.empty(0, np.int64)
    source, point = division.source, division.role == Role.INTERMEDIATE
    beside = point.copy()
    beside[1:] |= point[:-1] & (source[1:] == source[:-1])
    beside[0] = False
    chosen = np.flatnonzero(beside & np.isnan(division.sweep))
    ends = division.command[chosen].position, division.command[chosen - 1].position
    with np.errstate(invalid="ignore"):
        return np.asarray(
            chosen[lengths(ends[0] - ends[1]) < SHORT * task.toolpath.feed[source[chosen]] * cycle]
        )


def _rates_on_ramps(task: CompensationProblem, segments: PathSegments) -> Floats:
    """(S,) [m per m] the largest change of the correction that the paths of S segments need, by the path itself: their
    rounded points lie beside it."""
    count = len(segments)
    rows = np.repeat(segments.rows, PARTS + 1)
    part = np.tile(np.linspace(0.0, 1.0, PARTS + 1), count)
    share = np.repeat(segments.first, PARTS + 1) + part * np.repeat(segments.last - segments.first, PARTS + 1)
    wanted = task.desired_path.at(rows, share)
    goal = task.goal(rows, wanted, share)
    done = task.command(rows, wanted, task.force.along(rows, share), goal, share=share)
    shift = done.command.position - wanted.position
    change = np.linalg.norm(np.diff(shift.reshape(count, PARTS + 1, 3), axis=1), axis=2).max(axis=1)
    extent = (segments.last - segments.first) * task.desired_path.length[segments.rows] / PARTS
    return np.asarray(np.nan_to_num(change / extent))


def _stops(task: CompensationProblem, result: CorrectionResult, division: Subdivision) -> Bools:
    """(M,) inserted motions that stop inside of a cut: transition moves after a motion of the same cut, and points that
    the program's mode (G61), or an approximation of 0, passes exactly."""
    source = division.source
    before = np.maximum(source - 1, 0)
    inside = (source > 0) & (result.cut[before] == result.cut[source]) & (result.cut[source] >= 0)
    stops = (division.role == Role.TRANSITION) & inside
    inner = np.flatnonzero((division.role == Role.INTERMEDIATE) & task.carries[source])
    stops[inner] = approximations(task, division, inner) == 0.0
    return np.asarray(stops)
