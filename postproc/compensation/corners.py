"""Corners that the controller rounds off: the path of the output there against that of the original.

An approximated motion leaves its line the distance d before its end point and joins the next one d after it (d: the
approximation, no more than half of either motion), on a parabola: at its parameter t it is at (1 - t) a + t b, with a
the place d (1 - t) before the end point on the one motion, b the place d t after it on the other.  Of straight motions
that is the quadratic Bezier curve with the end point as its control point.  The tool of the output, deflected by the
force that belongs to the place, is compared with the original's corner as it would be cut without any deflection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.geometry import Poses, lengths
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.path_error import PathSegments, programmed
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.toolpath import Role

SAMPLES = np.linspace(0.0, 1.0, 9)
"""Where the output's corner is evaluated."""

DRAWN = 24
"""Straight segments by which the original's parabola is drawn: off by less than a thousandth of what it rounds off."""

LITTLE = 0.1
"""Share of the tolerance: corners that round off less are not evaluated."""

MOST = 2000
"""Corners evaluated: those that round off most."""


@dataclass(frozen=True)
class Corners:
    """row (K,): motions that end in an approximated corner, or in which one was inserted; distance (K,) [m]: of the
    approximation, as far as half of either motion; unknown (K,): nothing states it; difference (K,) [m]: of the
    output's tool from the original's path there."""

    row: Ints
    distance: Floats
    unknown: Bools
    difference: Floats


def compare_corners(task: CompensationProblem, result: CorrectionResult, division: Subdivision) -> Corners:
    """The approximated corners inside of corrected cuts that round off more than ``LITTLE`` of the tolerance: those of
    the original, and those that inserted points make of a straight or round motion."""
    row, distance, unknown = _rounded(task, result)
    own = np.searchsorted(division.source, row, side="right") - 1

    def of_original(part: slice) -> Floats:
        sides = (
            subdivided_motions(task, division, own[part]),
            subdivided_motions(task, division, own[part] + 1),
        )
        return _differences(task, *sides, distance[part], _original(task, row[part], distance[part]))

    differences = [np.empty(0), *in_blocks(of_original, len(row), rows=256)]
    inserted, inner, free = _inserted(task, result, division)

    def of_inserted(part: slice) -> Floats:
        sides = (
            subdivided_motions(task, division, inserted[part]),
            subdivided_motions(task, division, inserted[part] + 1),
        )
        return _differences(task, *sides, inner[part], _through(task, *sides, inner[part]))

    differences += in_blocks(of_inserted, len(inserted), rows=256)
    return Corners(
        np.concatenate([row, division.source[inserted]]),
        np.concatenate([distance, inner]),
        np.concatenate([unknown, free]),
        np.concatenate(differences),
    )


def _rounded(task: CompensationProblem, result: CorrectionResult) -> tuple[Ints, Floats, Bools]:
    """Rows (K,) that end in such corners, the distance (K,) [m] of their approximation, and where it is not known."""
    path, desired_path = task.toolpath, task.desired_path
    on = result.corrected & desired_path.traceable & (desired_path.length > 0) & task.carries
    goes_on = on[:-1] & on[1:] & (path.tool[:-1] == path.tool[1:]) & (result.cut[:-1] == result.cut[1:])
    row = np.flatnonzero(goes_on & ~(path.approximation[:-1] <= 0))

    def size(part: slice) -> tuple[Floats, Floats]:
        some = row[part]
        half = 0.5 * np.minimum(desired_path.length[some], desired_path.length[some + 1])
        distance = np.fmin(path.approximation[some], half)
        arcs = desired_path.arc[some] | desired_path.arc[some + 1]
        off = (
            0.25 * distance * lengths(_direction(task, some + 1) - _direction(task, some))
        )  # of straight ones
        at = some[arcs]
        off[arcs] = _cut_off(programmed(task, at), programmed(task, at + 1), distance[arcs])
        return distance, off

    parts = [(np.empty(0), np.empty(0)), *in_blocks(size, len(row))]
    distance, off = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    chosen = _largest(off, task.tolerance)
    return row[chosen], distance[chosen], np.isnan(path.approximation[row[chosen]])


def _direction(task: CompensationProblem, rows: Ints) -> Floats:
    """(K, 3) unit vectors from the start of motions to their end, NaN for those that lead nowhere."""
    step = task.wanted[rows].position - task.desired_path.start[rows].position
    with np.errstate(invalid="ignore"):
        return np.asarray(step / lengths(step)[:, None])


def _inserted(
    task: CompensationProblem, result: CorrectionResult, division: Subdivision
) -> tuple[Ints, Floats, Bools]:
    """Inserted motions (K,) of ``division`` at whose end the output turns, the distance (K,) [m] of their
    approximation, and where it is not known."""
    source = division.source
    motions = np.flatnonzero((division.role == Role.INTERMEDIATE) & (result.corrected & task.carries)[source])
    blend = (
        task.toolpath.approximation[source[motions]] if division.blend is None else division.blend[motions]
    )
    motions, blend = motions[~(blend <= 0)], blend[~(blend <= 0)]
    if not len(motions):
        return motions, blend, blend > 0
    before, after = (
        subdivided_motions(task, division, motions),
        subdivided_motions(task, division, motions + 1),
    )
    distance = np.fmin(blend, 0.5 * np.minimum(_extent(before), _extent(after)))
    chosen = _largest(_cut_off(before, after, distance), task.tolerance)
    return motions[chosen], distance[chosen], np.isnan(blend[chosen])


def _cut_off(before: PathSegments, after: PathSegments, distance: Floats) -> Floats:
    """(K,) [m] from the vertices at which ``before`` and ``after`` (K) meet to the middle of their parabolas."""
    middle = _parabola(before, after, distance, np.array([0.5]))[:, 0]
    return lengths(middle - before.end.position)


def _largest(off: Floats, tolerance: float) -> Ints:
    """Places of the ``MOST`` largest of ``off`` (K,) that count, ascending."""
    chosen = np.flatnonzero(off > LITTLE * tolerance)
    if len(chosen) > MOST:
        chosen = np.sort(chosen[np.argsort(-off[chosen], kind="stable")[:MOST]])
    return chosen


def _extent(segments: PathSegments) -> Floats:
    """(K,) [m] how long they are."""
    step = segments.end.position - segments.start.position
    length = lengths(step)
    arc = np.flatnonzero(np.isfinite(segments.sweep))
    rise = np.sum(step[arc] * segments.normal[arc], axis=1)
    length[arc] = np.hypot(
        segments.sweep[arc] * lengths(segments.start.position[arc] - segments.centre[arc]), rise
    )
    return np.maximum(length, 1e-12)


def _places(segments: PathSegments, share: Floats) -> Floats:
    """(K, S, 3) [m] places at the shares (K, S) of the segments."""
    each = np.repeat(np.arange(len(segments)), share.shape[1])
    return segments[each].at(share.ravel()).position.reshape(*share.shape, 3)


def _parabola(before: PathSegments, after: PathSegments, distance: Floats, t: Floats) -> Floats:
    """(K, S, 3) [m] places at the parameters ``t`` (S,) of the parabolas that lead from ``before`` to ``after`` (K)."""
    reach = distance[:, None] * np.stack([1.0 - t, t])[:, None]
    leaving = _places(before, 1.0 - reach[0] / _extent(before)[:, None])
    joining = _places(after, reach[1] / _extent(after)[:, None])
    return (1.0 - t)[:, None] * leaving + t[:, None] * joining


def _differences(
    task: CompensationProblem, before: PathSegments, after: PathSegments, distance: Floats, drawn: Floats
) -> Floats:
    """(K,) [m] of the output's tool from the lines through ``drawn`` (K, P, 3), where the motions ``before`` and
    ``after`` (K) meet."""
    many, vertex = len(SAMPLES), before.end.position
    long_back, long_ahead = _extent(before), _extent(after)
    reach = np.minimum(distance, 0.5 * np.minimum(long_back, long_ahead))
    curve = _parabola(before, after, reach, SAMPLES)

    # the force belongs to the place of the wanted path that a command is made for
    exit_share = before.last - (before.last - before.first) * reach / long_back
    entry_share = after.first + (after.last - after.first) * reach / long_ahead
    part, back = np.abs(2.0 * SAMPLES - 1.0), SAMPLES <= 0.5
    rows = np.where(back, before.rows[:, None], after.rows[:, None]).ravel()
    ends = np.where(back, exit_share[:, None], entry_share[:, None])
    meet = np.where(back, before.last[:, None], after.first[:, None])
    share = (meet + part * (ends - meet)).ravel()
    command = Poses(np.repeat(before.end.rotation, many, axis=0), curve.reshape(-1, 3))
    real = task.simulated(rows, command, task.force.along(rows, share), share=share, corrected=True)
    there = task.desired_path.at(before.rows, before.last)
    carried = task.goal(before.rows, there, before.last).position - there.position
    tool = real.pose.position - np.repeat(carried, many, axis=0)
    tool = np.where((real.reachable & real.settled)[:, None], tool, np.inf)
    return np.asarray(_distance(tool.reshape(len(vertex), many, 3), drawn).max(axis=1))


def _original(task: CompensationProblem, row: Ints, distance: Floats) -> Floats:
    """(K, P, 3) [m] the original's corner as it is run: along the one motion, round, along the other."""
    before, after = programmed(task, row), programmed(task, row + 1)
    curve = _parabola(before, after, distance, np.linspace(0.0, 1.0, DRAWN + 1))
    more = 0.5 * np.linspace(1.0, 0.0, DRAWN + 1)[:-1] ** 2  # nearer to each other beside the corner
    beside = [distance[:, None] / _extent(side)[:, None] for side in (before, after)]
    first = _places(before, 1.0 - beside[0] - more * (2.0 - 2.0 * beside[0]))
    last = _places(after, beside[1] + more[::-1] * (2.0 - 2.0 * beside[1]))
    return np.concatenate([first, curve, last], axis=1)


def _through(
    task: CompensationProblem, before: PathSegments, after: PathSegments, distance: Floats
) -> Floats:
    """(K, P, 3) [m] the wanted path around an inserted point, which lies on it."""
    reach = 2.0 * distance / np.maximum(task.desired_path.length[before.rows], 1e-12)
    low, high = np.maximum(before.last - reach, before.first), np.minimum(before.last + reach, after.last)
    share = low + np.linspace(0.0, 1.0, DRAWN + 1)[:, None] * (high - low)
    points = task.desired_path.at(np.tile(before.rows, DRAWN + 1), share.ravel()).position
    return np.swapaxes(points.reshape(DRAWN + 1, -1, 3), 0, 1)


def _distance(points: Floats, drawn: Floats) -> Floats:
    """(K, S) [m] of points (K, S, 3) from the lines through ``drawn`` (K, P, 3)."""
    start, step = drawn[:, None, :-1], np.diff(drawn, axis=1)[:, None]
    square = np.maximum(np.sum(step**2, axis=-1), 1e-24)
    away = points[:, :, None] - start
    share = np.clip(np.sum(away * step, axis=-1) / square, 0.0, 1.0)
    away = away - share[..., None] * step
    return np.asarray(np.sqrt(np.sum(away**2, axis=-1)).min(axis=2))
