"""Corners that the controller rounds off are corrected as the rounded paths that they are.

Where the force changes behind a vertex the correction turns there by k [m a m], and the parabola that the controller
makes of it passes d k / 4 beside the original's.  The points of the output there are moved so that its rounded path,
under load, follows the rounded path of the original: the path is linear in the points, so that what is off is taken
away by weighted least squares, the weights raised where most remains (Lawson 1961: the largest error is least), and
evaluated again.  Where the point alone is not enough, others are inserted beside it (``corner_points``).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import blocks, in_blocks
from postproc.base.geometry import Poses, lengths, product, rotation_from_vector
from postproc.base.units import MM
from postproc.compensation.approximations import approximations, as_stated, stated_alone
from postproc.compensation.corner_division import CornerDivision, with_corners
from postproc.compensation.corner_points import ALONE, ChosenPoints, PointChooser
from postproc.compensation.corners import compare_corners_at, evaluate_corners, find_corners, suspect_corners
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramp_fits import CloseFits
from postproc.compensation.ramp_points import NEVER, LeastPoints, choose_ramp_points
from postproc.compensation.rounded_path import Blend, Deviations, RoundedOutput
from postproc.compensation.subdivision import Limits, Subdivision
from postproc.toolpath import Role

ROUNDS, WEIGHINGS = 4, 24
"""How often the path is evaluated after a fit, and the weights raised within one."""

ALLOWED = 0.9
"""Share of the tolerance that a corner may take: the path is evaluated as it is run, and digits take little."""

ON_RAMPS, FITTED = 0.97, 0.945
"""The same on ramps of the force, where a smaller share takes more points (of more than the tolerance, once written,
further ones), and with which their points are fitted to a curve, which is a little simpler than the path."""

BETTER = 0.9
"""A fitted corner that keeps more of its error stays as it was."""

BEHIND = 1.0 * MM
"""[m] As far behind the end of a ramp its error is looked for."""

AS_WRITTEN = 1.05
"""By this factor a fit may be worse once its digits are written."""

RIDGE = 1e-3
"""Share of the weights that keeps a point that hardly shows where it is."""

BLOCK = 128
"""Corners fitted together."""


def fit_corners(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints | None = None,
) -> tuple[CorrectionResult, Subdivision]:
    """The result and the division with the points of approximated corners moved, where the path comes nearer to the
    original's; ``least``: of corners that were no better as they were written."""
    least = {} if least is None else least
    if task.gain != 1.0:
        return result, division
    close = CloseFits()
    fit, plain, rows = _fit_all(task, result, division, limits, least, np.empty(0, np.int64), close)
    if not len(rows):
        return fit, plain
    # what no points hold: those that come nearest to the ramps, or those of the corners alone
    before = _near_ramps(task, plain, rows)
    for _ in range(2):
        nearest, other, _ = _fit_all(task, result, division, limits, least, rows, close)
        better = _near_ramps(task, other, rows) < BETTER * before
        if better.all():
            return nearest, other
        if not better.any():
            return fit, plain
        rows, before = rows[better], before[better]
    return fit, plain


def _near_ramps(task: CompensationProblem, division: Subdivision, rows: Ints) -> Floats:
    """(L,) errors, in parts of the allowed one, beside the vertices where ``rows`` (L,) start and on their ramps."""
    found = np.zeros(len(rows))
    ramps = task.force.ramps
    if ramps is None:
        return found
    run = as_stated(task, division)
    length = task.desired_path.length
    end = ramps.length[np.searchsorted(ramps.row, rows)]
    for k, row in enumerate(rows.tolist()):
        first, vertex, last = np.searchsorted(division.source, [row - 1, row, row + 1])
        on_row = int(np.searchsorted(division.share[vertex:last] * length[row], end[k] + BEHIND))
        motions = np.arange(max(first, vertex - 3), min(vertex + on_row + 1, last))
        found[k] = _size(task, *RoundedOutput(*run, motions).largest(motions)).max()
    return found


def _fit_all(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints,
    anyhow: Ints,
    close: CloseFits,
) -> tuple[CorrectionResult, Subdivision, Ints]:
    """The result and the division with fitted ramps and corners, and the rows (L,) of the ramps that are left, but for
    those ``anyhow`` (A,)."""
    result, division, rows = _fit_ramps(task, result, division, limits, least, anyhow, close)
    return *_fit_alone(task, result, division, limits, least), rows


def _fit_alone(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints,
) -> tuple[CorrectionResult, Subdivision]:
    """The same with the corners that are on no fitted ramp."""
    if np.isnan(task.toolpath.approximation).all():
        return result, division
    motion = find_corners(task, result, division)
    if division.fits is not None:
        motion = np.setdiff1d(motion, division.fits.point)
    # points before an exact end go by the motion before it
    blend, source = task.toolpath.approximation, division.source[motion]
    inserted = (division.role[motion] == Role.INTERMEDIATE) & (blend[source] == 0)
    motion = motion[~np.isnan(blend[np.where(inserted, np.maximum(source - 1, 0), source)])]
    # what is in air ends elsewhere only where it leads to a corrected start
    source = division.source[motion]
    motion = motion[task.carries[source] | np.isin(source, division.lead_ins)]
    if least:
        place = zip(division.source[motion].tolist(), division.share[motion].tolist(), strict=True)
        motion = motion[np.array([least.get(one, 0) < NEVER for one in place], bool)]
    motion = suspect_corners(task, result, division, motion)
    task = stated_alone(task)
    corners = compare_corners_at(task, division, motion)
    size = _size(task, corners.difference, corners.angle)
    bad = (size > 1.0) & np.isfinite(size)
    if not bad.any():
        return result, division
    corners = corners.part(bad)
    free = np.full(len(task.toolpath), not limits.no_insert) & task.carries
    free[list(task.toolpath.constraints.no_insert_before)] = False
    chooser = PointChooser(task, division, limits, free, corners, size[bad])

    def fit(points: ChosenPoints) -> tuple[ChosenPoints, CornerDivision, Floats]:
        every = np.ones(len(points.corner), bool)
        return points, *_fitted(task, with_corners(task, result, division, points, every))

    chosen, fitted, after = fit(chooser.choose())
    beyond = after > 1.0 / ALLOWED
    if beyond.any():  # their own point took less away than was expected of it
        more = fit(chooser.choose(np.where(beyond, after / ALONE, 0.0)))
        still = more[2] > 1.0 / ALLOWED
        if still.sum() < beyond.sum() and more[2].max() <= after.max():
            chosen, fitted, after = more
    better = (after < BETTER * chosen.before) & ~fitted.flat
    if not better.any():
        return result, division
    if not better.all():  # without the points of the others the rest is where it was
        fitted = with_corners(task, result, division, chosen, better, fitted)
    return fitted.result(task, result), fitted.division


def _fit_ramps(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints,
    anyhow: Ints,
    close: CloseFits,
) -> tuple[CorrectionResult, Subdivision, Ints]:
    """The same with the points on ramps of the force, as few as hold the tolerance, and the rows (L,) of those left,
    but for ``anyhow`` (A,)."""
    least = dict(least)
    while True:
        part, chosen, left = choose_ramp_points(
            task, result, division, limits, least, FITTED * task.tolerance, anyhow, close
        )
        if chosen is None:
            return result, division, left
        chosen = replace(chosen, before=np.full(len(chosen.corner), 1.0 / ALLOWED))
        fitted = with_corners(task, result, part, chosen, np.ones(len(chosen.corner), bool))
        enough = ON_RAMPS / ALLOWED
        stated = stated_alone(task)
        fitted, _ = _fitted(stated, fitted, enough)
        at_vertex = part.share[chosen.corner] == 1.0  # else where the ramp ends
        taken = np.isin(part.source[chosen.corner] + at_vertex, anyhow)
        after = _largest(stated, fitted, taken)
        bad = (~(after <= enough) & ~taken) | fitted.flat
        if not bad.any():
            fits = fitted.division.fits
            assert fits is not None
            before = np.where(taken, np.maximum(1.0 / ALLOWED, AS_WRITTEN * after), 1.0 / ALLOWED)
            before = before[fitted.group]
            division = replace(fitted.division, fits=replace(fits, before=before))
            return fitted.result(task, result), division, left
        least |= _more_points(fitted.division, bad[fitted.group])


def corners_not_improved(task: CompensationProblem, division: Subdivision) -> LeastPoints:
    """The fitted corners that are no better as ``division`` was written, or whose approximation it does not state."""
    if division.fits is None:
        return {}
    point, before = division.fits.point, division.fits.before
    unknown = np.isnan(approximations(task, division, point))
    return _more_points(division, unknown | (_at_points(task, division, point) > before))


def _at_points(task: CompensationProblem, division: Subdivision, point: Ints) -> Floats:
    """(P,) the errors where the motions ``point`` (P,) are rounded off, in parts of the allowed one."""
    run = as_stated(task, division)

    def evaluated(part: slice) -> Floats:
        return _size(task, *evaluate_corners(RoundedOutput(*run, point[part]), point[part])[1:])

    return np.concatenate([np.empty(0), *in_blocks(evaluated, len(point), BLOCK)])


def _more_points(division: Subdivision, bad: Bools) -> LeastPoints:
    """What has to become of the corners of the points ``bad`` (P,): one point more on a ramp, the others stay."""
    if division.fits is None:
        return {}
    corner, inserted = division.fits.corner[bad], division.fits.inserted[bad]
    count = np.where(inserted > 0, inserted + 1, NEVER).tolist()
    return dict(
        zip(
            zip(division.source[corner].tolist(), division.share[corner].tolist(), strict=True),
            count,
            strict=True,
        )
    )


def _size(task: CompensationProblem, off: Floats, angle: Floats) -> Floats:
    """(K,) errors in parts of those that are allowed."""
    return np.asarray(np.maximum(off / task.tolerance, angle / task.tolerance_angle) / ALLOWED)


@dataclass(frozen=True)
class _CornerSamples:
    """S places of the output, by ascending group (S,): at (S,), the segment; share (S,)."""

    group: Ints
    at: Ints
    share: Floats
    segments: int

    @property
    def by_segment(self) -> tuple[Ints, Ints, Floats]:
        """Group (K,), and at and share (K, S / K), of each of the segments."""
        at, share = self.at.reshape(self.segments, -1), self.share.reshape(self.segments, -1)
        return self.group.reshape(self.segments, -1)[:, 0], at, share


def _fitted(
    task: CompensationProblem, fitted: CornerDivision, enough: float = 0.0
) -> tuple[CornerDivision, Floats]:
    """The best poses that were found for the points of each corner, and what remains (G,), in parts of the allowed
    error; none is looked for where ``enough`` or less remains of all."""
    best, least = fitted.poses.copy(), np.full(len(fitted.group_start) - 1, np.inf)
    for number in range(ROUNDS + 1):
        steps = (np.zeros((len(fitted.motion), 3)), np.zeros((len(fitted.motion), 3)))
        size = np.full(len(least), np.inf)
        for part in blocks(len(least), BLOCK):
            _evaluate(task, fitted, part, size, steps)
        won = size < least
        least[won] = size[won]
        points = np.flatnonzero(won[fitted.group])
        best.put(points, fitted.poses[points])
        if number == ROUNDS or least.max(initial=0.0) <= enough:
            break
        moved = Poses(
            product(rotation_from_vector(steps[1]), fitted.poses.rotation), fitted.poses.position + steps[0]
        )
        fitted = fitted.moved(task, moved)
    return fitted.moved(task, best), least


def _largest(task: CompensationProblem, fitted: CornerDivision, accepted: Bools) -> Floats:
    """(G,) the largest errors of the corners, looked for closely, in parts of the allowed one; those on motions beside
    a corner that is ``accepted`` (G,) anyhow are its own: no points of the next corner make them less."""
    largest = np.zeros(len(fitted.group_start) - 1)
    points = fitted.motion[accepted[fitted.group]]
    beside = np.union1d(points, points + 1)
    for part in blocks(len(largest), BLOCK):
        output, samples = _sampled(task, fitted, part)
        group, at, share = samples.by_segment
        own = accepted[group] | ~np.isin(output.motions[at[:, 0]], beside)
        size = _size(task, *output.peaks(at[own], share[own]))
        np.maximum.at(largest, group[own], size)
    return largest


def _evaluate(
    task: CompensationProblem,
    fitted: CornerDivision,
    part: slice,
    size: Floats,
    steps: tuple[Floats, Floats],
) -> None:
    """Puts the largest errors of the groups ``part`` into ``size`` (G,), and by how much their points should move
    (P, 3) [m] and turn (P, 3) [rad] into ``steps``."""
    first, last = fitted.group_start[part.start], fitted.group_start[part.stop]
    output, samples = _sampled(task, fitted, part)
    found = output.deviations(samples.at, samples.share)
    samples, found = _with_turns(samples, output, found)
    off, angle = lengths(found.shift), lengths(found.turn)
    largest = np.zeros(part.stop - part.start)
    np.maximum.at(largest, samples.group - part.start, _size(task, off, angle))
    size[part] = largest
    if not np.isfinite(largest).all():
        return
    weights = _weights(fitted, output, samples, part)
    steps[0][first:last] = _least_largest(weights, found.shift, samples, fitted, part)
    if task.turn_freely(fitted.row[first:last]):
        steps[1][first:last] = _least_largest(weights, found.turn, samples, fitted, part)


def _sampled(
    task: CompensationProblem, fitted: CornerDivision, part: slice
) -> tuple[RoundedOutput, _CornerSamples]:
    """The rounded path about the points of the groups ``part``, and the samples on it."""
    motions = fitted.motion[fitted.group_start[part.start] : fitted.group_start[part.stop]]
    output = RoundedOutput(task, fitted.division, np.unique(np.concatenate([motions, motions + 1])))
    return output, _samples(fitted, output, part)


def _samples(fitted: CornerDivision, output: RoundedOutput, part: slice) -> _CornerSamples:
    """Of the groups ``part``: along all segments beside their points, but for the parabolas at the far ends of the
    first and the last: these are of other corners."""
    low, high = (fitted.group_start[part.start : part.stop + 1][k:] for k in (0, 1))
    start, stop = fitted.motion[low[: len(high)]], fitted.motion[high - 1] + 1
    count = stop - start + 1
    group = np.repeat(np.arange(part.start, part.stop), count)
    number = np.arange(len(group)) - np.repeat(np.cumsum(count) - count, count)
    at = output.place(start[group - part.start] + number)
    share = output.samples(at)
    last = number == count[group - part.start] - 1
    before = np.where(at > 0, output.reach[np.maximum(at - 1, 0)], 0.0) / output.extent[at]
    after = 1.0 - output.reach[at] / output.extent[at]
    share = np.maximum(share, np.where(number == 0, before, 0.0)[:, None])
    share = np.minimum(share, np.where(last, after, 1.0)[:, None])
    many = share.shape[1]
    return _CornerSamples(np.repeat(group, many), np.repeat(at, many), share.ravel(), len(at))


def _with_turns(
    samples: _CornerSamples, output: RoundedOutput, found: Deviations
) -> tuple[_CornerSamples, Deviations]:
    """The same with the places where the force turns, and what is ``found`` (S) there: the error has a peak there."""
    owner, at, share = samples.by_segment
    nearer = list(output.where_force_turns(at, share, found))
    if not nearer:
        return samples, found
    which, segment, between, there = nearer[-1]
    group = np.concatenate([samples.group, owner[which]])
    order = np.argsort(group, kind="stable")
    more = (np.concatenate([samples.at, segment])[order], np.concatenate([samples.share, between])[order])
    both = (
        np.concatenate([getattr(one, f.name) for one in (found, there)])[order] for f in fields(Deviations)
    )
    return _CornerSamples(group[order], *more, samples.segments), Deviations(*both)


def _weights(fitted: CornerDivision, output: RoundedOutput, samples: _CornerSamples, part: slice) -> Floats:
    """(S, W) by how much each of the points of its group moves a sample; W: points of the largest group."""
    blend: Blend = output.blend(samples.at, samples.share)
    t, a, b = blend.t, blend.before, blend.after
    parts = ((-1, (1.0 - t) * (1.0 - a)), (0, (1.0 - t) * a + t * (1.0 - b)), (1, t * b))
    size = np.diff(fitted.group_start[part.start : part.stop + 1])
    points = np.arange(size.max())
    first = fitted.group_start[samples.group]
    inside = points < size[samples.group - part.start][:, None]
    index = np.minimum(first[:, None] + points, len(fitted.motion) - 1)
    own = np.where(inside, fitted.motion[index], -1)
    motion = output.motions[blend.first]
    weights = np.zeros(own.shape)
    for side, value in parts:
        weights += np.where(own == (motion + side)[:, None], value[:, None], 0.0)
    return weights


def _least_largest(
    weights: Floats, error: Floats, samples: _CornerSamples, fitted: CornerDivision, part: slice
) -> Floats:
    """(P, 3) steps of the points of the groups ``part`` with which the largest of ``error`` (S, 3) + ``weights`` (S, W)
    steps is least in each."""
    groups, width = part.stop - part.start, weights.shape[1]
    edges = np.searchsorted(samples.group, np.arange(part.start, part.stop))
    group = samples.group - part.start
    given = np.ones(len(group))
    best, least = np.zeros((groups, width, 3)), np.full(groups, np.inf)
    for _ in range(WEIGHINGS):
        heavy = weights * given[:, None]
        matrix = np.add.reduceat(heavy[:, :, None] * weights[:, None, :], edges, axis=0)
        side = np.add.reduceat(heavy[:, :, None] * error[:, None, :], edges, axis=0)
        ridge = RIDGE * np.maximum(np.trace(matrix, axis1=1, axis2=2) / width, 1e-12)
        matrix += ridge[:, None, None] * np.eye(width)
        step = -np.linalg.solve(matrix, side)
        remains = lengths(error + np.einsum("sw,swk->sk", weights, step[group]))
        largest = np.maximum(np.maximum.reduceat(remains, edges), 1e-12)
        won = largest < least
        best[won], least[won] = step[won], largest[won]
        given = given * (remains / largest[group])
        given = np.maximum(given / np.maximum(np.maximum.reduceat(given, edges), 1e-300)[group], 1e-6)
    size = np.diff(fitted.group_start[part.start : part.stop + 1])
    inside: Bools = np.arange(width) < size[:, None]
    return np.asarray(best[inside])
