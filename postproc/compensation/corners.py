"""Corners that the controller rounds off: the path of the output there against that of the original.

The tool of the output, deflected by the force that belongs to the place, is compared with the original's path as it
would be cut without any deflection, both with the parabolas of their approximated points (``rounded_path``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import each_block, in_blocks
from postproc.base.geometry import lengths
from postproc.compensation.approximations import Run, approximations, as_stated
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.rounded_path import RoundedOutput, extents, original_reach
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.toolpath import Role

SAMPLES = np.linspace(-1.0, 1.0, 17)
"""Where the output's corner is evaluated: shares of the reach before and after its point."""

FEW = np.linspace(-1.0, 1.0, 5)
"""The same where the force changes over no ramp, as long as the tool is off by no more than ``CLOSE`` there."""

CLOSE = 0.25
"""Share of the tolerance."""

ALWAYS = 32
"""Corners that are evaluated closely in any case: those with the largest difference."""

LITTLE = 0.1
"""Share of the tolerance: corners that round off less, of the original and of the output, are not evaluated."""

MOST = 2000
"""Corners evaluated: those that round off most."""

BLOCK = 256
"""Corners evaluated together."""


@dataclass(frozen=True)
class Corners:
    """motion (K,): motions of the output that end in an approximated corner; row (K,): of the program, to which they
    belong; distance (K,) [m]: of the approximation, as far as half of either motion; unknown (K,): nothing states it;
    difference (K,) [m] and angle (K,) [rad]: of the output's tool from the original's path there."""

    motion: Ints
    row: Ints
    distance: Floats
    unknown: Bools
    difference: Floats
    angle: Floats

    def part(self, chosen: Bools) -> Corners:
        """Those that are ``chosen`` (K,)."""
        return Corners(*(getattr(self, each.name)[chosen] for each in fields(self)))


def compare_corners(task: CompensationProblem, result: CorrectionResult, division: Subdivision) -> Corners:
    """The approximated corners inside of corrected cuts that round off more than ``LITTLE`` of the tolerance: those of
    the original, and those that corrections and inserted points make of its motions."""
    return compare_corners_at(task, division, find_corners(task, result, division))


def compare_corners_at(task: CompensationProblem, division: Subdivision, motion: Ints) -> Corners:
    """The corners at the ends of ``motion`` (K,)."""
    source = division.source[motion]
    unknown = np.isnan(approximations(task, division, motion))
    distance, difference, angle = (np.zeros(len(motion)) for _ in range(3))
    known = as_stated(task, division) if not unknown.all() else (task, division)

    def compare(some: Ints, samples: Floats) -> None:
        # what is stated is not taken for what an unknown one beside it may be
        for among, run in ((some[~unknown[some]], known), (some[unknown[some]], (task, division))):

            def compared(part: slice, among: Ints = among, run: Run = run) -> None:
                at = among[part]
                output = RoundedOutput(*run, motion[at])
                distance[at], difference[at], angle[at] = evaluate_corners(output, motion[at], samples)

            each_block(compared, len(among), BLOCK)

    close = np.zeros(len(motion), bool)
    if task.force.ramps is not None:
        ramp = task.force.ramps.row
        close = np.isin(source, ramp) | np.isin(source + 1, ramp)
    few = np.flatnonzero(~close)
    if len(few) > ALWAYS:
        compare(few, FEW)
        # a turn that no word can correct is the same at all of them
        turns = task.toolpath.constraints.orientation_programmed[source]
        size = np.fmax(difference / task.tolerance, np.where(turns, angle / task.tolerance_angle, 0.0))
        close[few] = ~(size[few] <= CLOSE)
        few = few[np.argsort(-size[few], kind="stable")[:ALWAYS]]
    close[few] = True
    compare(np.flatnonzero(close), SAMPLES)
    return Corners(motion, source, distance, unknown, difference, angle)


def evaluate_corners(
    output: RoundedOutput, motions: Ints, samples: Floats = SAMPLES
) -> tuple[Floats, Floats, Floats]:
    """Of the corners at whose ends ``motions`` (K,) are: their reach (K,) [m], and how far (K,) [m] and (K,) [rad] the
    tool is from the original's path there, at ``samples`` (S,) as ``SAMPLES``, and where these are ``SAMPLES`` closer
    to the largest."""
    at = output.place(motions)
    reach, later = output.reach[at], samples > 0
    segment = np.where(later, np.minimum(at + 1, len(output.extent) - 1)[:, None], at[:, None])
    away = reach[:, None] * samples / output.extent[segment]
    share = np.where(later, away, 1.0 + away)
    if samples is SAMPLES:
        off, angle = output.peaks(segment, share)
    else:
        off, angle = output.peaks(segment, share, closer=0)
    return reach, np.where(reach > 0, off, 0.0), np.where(reach > 0, angle, 0.0)


def with_rounded_ends(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision
) -> CorrectionResult:
    """The result with the errors at the corners of ``division`` that were fitted, where no motion leads to its end."""
    if division.fits is None:
        return result
    point = division.fits.point[division.role[division.fits.point] == Role.ORIGINAL]
    point = point[task.carries[division.source[point]]]
    values = {name: getattr(result, name).copy() for name in ("after", "after_angle", "across_after")}
    row, run = division.source[point], as_stated(task, division)

    def evaluated(part: slice) -> None:
        _, off, angle = evaluate_corners(RoundedOutput(*run, point[part]), point[part])
        values["after"][row[part]] = values["across_after"][row[part]] = off
        values["after_angle"][row[part]] = angle

    each_block(evaluated, len(point), BLOCK)
    return replace(result, **values)


def rounded_errors(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision
) -> tuple[Ints, Floats, Floats]:
    """Motions (K,) of a division that start or end in points of fitted corners, or on which the force changes over a
    ramp, and by how much (K,) [m], (K,) [rad] the tool is off along them at most, as they are rounded; on ramps without
    where no distance is stated."""
    on = result.corrected & task.desired_path.traceable & (task.desired_path.length > 0) & task.carries
    fitted = changing = np.empty(0, np.int64)
    if division.fits is not None:
        fitted = np.unique(np.concatenate([division.fits.point, division.fits.point + 1]))
    if task.force.ramps is not None:
        changing = np.flatnonzero(np.isin(division.source, task.force.ramps.row))
        changing = np.setdiff1d(changing, fitted)
    found = []
    run = as_stated(task, division)
    for motion in (fitted, changing):
        some = motion[on[division.source[motion]] & ~division.transitions[motion]]

        def largest(part: slice, some: Ints = some) -> tuple[Floats, Floats]:
            return RoundedOutput(*run, some[part]).largest(some[part])

        parts = [(np.empty(0),) * 2, *in_blocks(largest, len(some), BLOCK)]
        found.append((some, *(np.concatenate([part[i] for part in parts]) for i in range(2))))
    motion, off, angle = (np.concatenate([part[i] for part in found]) for i in range(3))
    return motion, off, angle


def find_corners(task: CompensationProblem, result: CorrectionResult, division: Subdivision) -> Ints:
    """Motions (K,) of a division that end in corners to be evaluated, ascending."""
    source = division.source
    on = result.corrected & task.desired_path.traceable & (task.desired_path.length > 0) & task.carries
    motion = _candidates(task, on, result, division)
    known = motion + 1 < len(division)
    motion = motion[known]
    one, two = source[motion], source[motion + 1]
    path = task.toolpath
    goes_on = on[one] & on[two] & (path.tool[one] == path.tool[two]) & (result.cut[one] == result.cut[two])
    motion = motion[goes_on & ~(approximations(task, division, motion) <= 0)]
    motion = np.union1d(motion, _ends_of_cuts(task, on, division))

    def size(part: slice) -> Floats:
        return _cut_off(task, division, motion[part])

    off = np.concatenate([np.empty(0), *in_blocks(size, len(motion))])
    return np.asarray(motion[_largest(off, task.tolerance)])


def _candidates(
    task: CompensationProblem, on: Bools, result: CorrectionResult, division: Subdivision
) -> Ints:
    """Motions that may round off something: of those between which nothing is inserted, what the directions of the
    original's and the change of the correction say; all others."""
    path, length = task.toolpath, task.desired_path.length
    own = np.flatnonzero(division.role == Role.ORIGINAL)
    parted = np.diff(own, prepend=-1) > 1
    row = np.flatnonzero(on[:-1] & on[1:] & ~(path.approximation[:-1] <= 0))
    plain = ~parted[row] & ~parted[row + 1] & ~task.desired_path.arc[row] & ~task.desired_path.arc[row + 1]

    def rounds(part: slice) -> Bools:
        some = row[part]
        # of the output's directions by which its motions differ from those of the program, the program's included
        step = [_direction(task, at) for at in (some, some + 1)]
        change = [_slope(result, at, length) for at in (some, some + 1)]
        distance = np.fmin(path.approximation[some], 0.5 * np.minimum(length[some], length[some + 1]))
        turned = lengths(step[1] - step[0]) + lengths(change[1] - change[0])
        # a part of a motion that is corrected by itself starts elsewhere than the one before it ends
        return ~(0.25 * distance * turned <= LITTLE * task.tolerance)

    chosen = np.concatenate([np.empty(0, bool), *in_blocks(rounds, len(row))])
    inserted = np.flatnonzero((division.role == Role.INTERMEDIATE) & on[division.source])
    return np.unique(np.concatenate([own[row[chosen | ~plain]], inserted]))


def _ends_of_cuts(task: CompensationProblem, on: Bools, division: Subdivision) -> Ints:
    """Motions at whose end a cut is entered from the air, or left, without a stop."""
    path, traceable = task.toolpath, task.desired_path.traceable & (task.desired_path.length > 0)
    ends = (on[1:] & ~task.carries[:-1]) | (on[:-1] & ~task.carries[1:])
    ends &= traceable[1:] & traceable[:-1] & path.continues[1:] & (path.tool[1:] == path.tool[:-1])
    motion = np.flatnonzero(division.original)[np.flatnonzero(ends & ~(path.approximation[:-1] <= 0))]
    return np.asarray(motion[~division.transitions[motion + 1]])


def _turning(task: CompensationProblem, result: CorrectionResult, rows: Ints) -> Floats:
    """(K, 3) change of the correction's turn, rad a m, along motions ``rows`` (K,)."""
    change = result.turn[rows] - result.turn[np.maximum(rows - 1, 0)]
    return np.asarray(change / np.maximum(task.desired_path.length[rows], 1e-9)[:, None])


def _slope(result: CorrectionResult, rows: Ints, length: Floats) -> Floats:
    """(K, 3) change of the correction, m a m, along motions ``rows`` (K,)."""
    before = np.maximum(rows - 1, 0)
    return (result.correction[rows] - result.correction[before]) / np.maximum(length[rows], 1e-9)[:, None]


def _direction(task: CompensationProblem, rows: Ints) -> Floats:
    """(K, 3) unit vectors from the start of motions to their end, NaN for those that lead nowhere."""
    step = task.wanted[rows].position - task.desired_path.start[rows].position
    with np.errstate(invalid="ignore"):
        return np.asarray(step / lengths(step)[:, None])


def suspect_corners(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision, motion: Ints
) -> Ints:
    """(L,) those of the corners ``motion`` (K,) that may exceed the tolerance: all near ramps of the force and at
    inserted points, of others those that are rounded off by more than ``CLOSE`` of it otherwise than in the program.

    Where the deflection changes evenly, the tool in the middle of a rounded corner is as far off as the output's corner
    is cut off otherwise than the program's.
    """
    source = division.source[motion]
    close = division.role[motion] != Role.ORIGINAL
    later = np.minimum(source + 1, len(task.toolpath) - 1)
    close |= ~task.carries[source] | ~task.carries[later]
    if task.force.ramps is not None:
        close |= np.isin(source, task.force.ramps.row) | np.isin(source + 1, task.force.ramps.row)
    close |= task.desired_path.arc[source] | task.desired_path.arc[later]
    few = np.flatnonzero(~close)

    def differs(part: slice) -> Bools:
        at = motion[few[part]]
        rows = division.source[at]
        quarter = 0.25 * original_reach(task, rows)[:, None]
        turned = lengths(quarter * (_turning(task, result, rows + 1) - _turning(task, result, rows)))
        program = quarter * (_direction(task, rows + 1) - _direction(task, rows))
        off = lengths(_cut_off_vectors(task, division, at) - program)
        return ~(off <= CLOSE * task.tolerance) | ~(turned <= CLOSE * task.tolerance_angle)

    close[few] = np.concatenate([np.empty(0, bool), *in_blocks(differs, len(few))])
    return np.asarray(motion[close])


def _cut_off_vectors(task: CompensationProblem, division: Subdivision, motions: Ints) -> Floats:
    """(K, 3) [m] from the corners at the ends of ``motions`` (K,) to the middle of the parabolas of the output."""
    before, after = (subdivided_motions(task, division, motions + k) for k in (0, 1))
    half = 0.5 * np.minimum(extents(before), extents(after))
    distance = np.fmin(approximations(task, division, motions), half)
    middle = [
        side.at(np.clip(share, 0.0, 1.0)).position
        for side, share in (
            (before, 1.0 - 0.5 * distance / extents(before)),
            (after, 0.5 * distance / extents(after)),
        )
    ]
    return np.asarray(0.5 * (middle[0] + middle[1]) - before.end.position)


def _cut_off(task: CompensationProblem, division: Subdivision, motions: Ints) -> Floats:
    """(K,) [m] by how much the corners at the ends of ``motions`` (K,) are rounded off at most: in the output, or in
    the program."""
    off = lengths(_cut_off_vectors(task, division, motions))
    own = np.flatnonzero(division.role[motions] == Role.ORIGINAL)
    rows = division.source[motions[own]]
    first = _direction(task, rows)
    last = _direction(task, rows + 1)
    program = np.zeros(len(motions))
    program[own] = 0.25 * original_reach(task, rows) * np.nan_to_num(lengths(last - first))
    return np.fmax(off, program)


def _largest(off: Floats, tolerance: float) -> Ints:
    """Places of the ``MOST`` largest of ``off`` (K,) that count, ascending."""
    chosen = np.flatnonzero(off > LITTLE * tolerance)
    if len(chosen) > MOST:
        chosen = np.sort(chosen[np.argsort(-off[chosen], kind="stable")[:MOST]])
    return chosen
