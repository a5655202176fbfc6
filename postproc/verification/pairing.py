"""Which motions of two programs belong together: air moves one by one, cuts as a whole, in their order.

Nothing but air moves shows where a cut of the second program ends: their targets are those of the original, except of
the last one before a cut, which may lead to where the cut starts corrected.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import lengths
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.toolpath import Kind

SAME = 2e-6
"""[m] Targets that are the same as far as written digits go."""

_JUMPS = (Kind.PTP, Kind.AXIS, Kind.OTHER)
_OTHER_MOTION = 5 * MM
"""[m] What a motion of another kind, feed or frame counts as, beside its distance, where it means one in air."""


class Different(ValueError):
    """The second program does not make the motions of the first; ``line`` of the first program where it is seen."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True, eq=False)
class Stretches:
    """K stretches of motions under force: rows ``start`` to before ``stop`` (K,); length (K,): their path is known; of
    the others (points of splines, a motion that comes from an unknown place) only the end points are.  lost (L,):
    motions under force of which neither is known.  air (K,): stretches in air between the others, of which the end
    points alone count; there are such where every target is corrected."""

    start: Ints
    stop: Ints
    length: Bools
    lost: Ints
    air: Bools

    @staticmethod
    def of(task: CompensationProblem) -> Stretches:
        path, n = task.toolpath, len(task.toolpath)
        on_path = np.isin(path.kind, (Kind.LIN, Kind.CIRC))
        moved = task.carries if task.process else task.carries | on_path
        # without any force all that moves along a path is looked at
        in_air = moved & ~task.carries & task.force.any
        can = moved & path.known & (task.track.branch >= 0) & ~np.isin(path.kind, _JUMPS)
        form = np.where(can, np.where(in_air, 3, 1 + (task.desired_path.traceable & on_path)), 0)
        change = np.ones(n, bool)
        change[1:] = (form[1:] != form[:-1]) | ~path.continues[1:]
        start = np.flatnonzero(change)
        stop = np.append(start[1:], n)[: len(start)]
        some = form[start] > 0
        start, stop = start[some], stop[some]
        lost = np.flatnonzero(moved & ~in_air & (form == 0))
        return Stretches(start, stop, form[start] == 2, lost, form[start] == 3)


@dataclass(frozen=True, eq=False)
class Pairing:
    """K stretches of the original and their counterparts, rows ``start`` to before ``stop`` (K,) of the second
    program; air, run_air (A,): rows of both that correspond one to one."""

    stretches: Stretches
    start: Ints
    stop: Ints
    air: Ints
    run_air: Ints


def pair_motions(original: CompensationProblem, run: CompensationProblem) -> Pairing:
    """Raises Different where the two programs do not belong together."""
    one, other = original.toolpath, run.toolpath
    jumps = [np.flatnonzero(np.isin(path.kind, _JUMPS)) for path in (one, other)]
    shared = min(len(jump) for jump in jumps)
    wrong = np.flatnonzero(one.kind[jumps[0][:shared]] != other.kind[jumps[1][:shared]])
    if len(wrong) or len(jumps[0]) != len(jumps[1]):
        at = int(wrong[0]) if len(wrong) else min(shared, max(len(jumps[0]) - 1, 0))
        line = int(one.line[jumps[0][at]]) if len(jumps[0]) else 0
        raise Different("the two programs do not have the same jumps (PTP, G0, axis motions)", line)
    edges = [
        np.concatenate([[-1], jump, [len(path)]]) for jump, path in zip(jumps, (one, other), strict=True)
    ]
    count, run_count = (np.diff(edge) - 1 for edge in edges)
    fewer = np.flatnonzero(run_count < count)
    if len(fewer):
        raise Different(
            f"the second program has {run_count[fewer[0]]} motions where the first has {count[fewer[0]]}",
            int(one.line[min(edges[0][fewer[0]] + 1, len(one) - 1)]),
        )
    stretches = Stretches.of(original)
    # the row of the second program, less that of the first, at the end of each motion
    shift = np.repeat(edges[1][:-1] - edges[0][:-1], np.diff(edges[0]))[1:]
    shift = np.append(shift, 0)[: len(one)]
    at_jump = edges[0][1:-1]
    shift[at_jump] = edges[1][1:-1] - at_jump
    start, stop = stretches.start + shift[stretches.start], stretches.stop + shift[stretches.stop - 1]
    for section in np.flatnonzero(run_count > count):
        first, last = edges[0][section] + 1, edges[0][section + 1]
        inside = np.flatnonzero((stretches.start >= first) & (stretches.start < last))
        extra = int(run_count[section] - count[section])
        if not len(inside):
            line = int(one.line[min(max(first, 0), len(one) - 1)])
            raise Different("the second program has motions where the first has none", line)
        before = np.append(0, _extras(original, run, stretches, inside, last, int(shift[first]), extra))
        start[inside] += before[:-1]
        stop[inside] += before[1:]
        ends = np.append(stretches.start[inside][1:], last)
        for number, (here, to) in enumerate(zip(stretches.stop[inside], ends, strict=True)):
            shift[here:to] += before[number + 1]
    air = np.ones(len(one), bool)
    for first, last in zip(stretches.start, stretches.stop, strict=True):
        air[first:last] = False
    rows = np.flatnonzero(air)
    return Pairing(stretches, start, stop, rows, rows + shift[rows])


def _extras(
    original: CompensationProblem,
    run: CompensationProblem,
    stretches: Stretches,
    inside: Ints,
    end: int,
    shift: int,
    extra: int,
) -> Ints:
    """(K,) how many motions are added up to the end of each of the stretches ``inside`` (K,), one after another.

    For each air move between two of them: the rows of the second program that lead where it leads, and of these
    the choice, in their order, that leads nearest.
    """
    before: dict[int, tuple[float, tuple[int, ...]]] = {0: (0.0, ())}
    for here, following in pairwise(inside.tolist()):
        rows = np.arange(stretches.stop[here], stretches.start[following])
        off = _away(original, run, rows, int(stretches.stop[here]), shift, extra)
        best: dict[int, tuple[float, tuple[int, ...]]] = {}
        for more in np.flatnonzero(np.isfinite(off)).tolist():
            earlier = [
                (cost + off[more], (*path, more)) for less, (cost, path) in before.items() if less <= more
            ]
            if earlier:
                best[more] = min(earlier)
        if not best:
            line = int(original.toolpath.line[min(stretches.stop[here], len(original.toolpath) - 1)])
            near = f"{original.max_correction / MM:g} mm (max_correction of the cell)"
            raise Different(
                f"no motion of the second program leads within {near} of where this one leads", line
            )
        before = best
    _, path = min(before.values())
    return np.array([*path, extra])


def _away(
    original: CompensationProblem, run: CompensationProblem, rows: Ints, stop: int, shift: int, extra: int
) -> Floats:
    """(extra + 1,) [m] how far the targets of the air moves ``rows`` are from those of the rows of ``run`` that
    correspond to them with so many motions added before; infinite where they are not the same.  The last of them leads
    to a cut and may be moved.  Where two stretches meet without a move in air, the last point of the one before has to
    serve."""
    more = np.arange(extra + 1)
    total = np.zeros(extra + 1)
    probes, movable = (rows, rows[-1:]) if len(rows) else (np.array([stop - 1]), np.array([stop - 1]))
    for row in probes:
        feasible = more[np.isfinite(total)]
        at = row + shift + feasible
        distance = _apart(original, run, np.full(len(at), row), at)
        # in air targets are corrected as well where not the process alone is
        limit = SAME if original.process and row not in movable else original.max_correction
        other = ~_alike(original, run, np.full(len(at), row), at)
        total[feasible] += np.where(distance <= limit, distance + _OTHER_MOTION * other, np.inf)
    return total


def _apart(original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints) -> Floats:
    """(K,) [m] between targets; 0 where neither is known."""
    one, other = original.wanted[rows].position, run.wanted[run_rows].position
    unknown = np.isnan(one[:, 0])
    distance = lengths(other - one)
    return np.where(
        unknown, np.where(np.isnan(other[:, 0]), 0.0, np.inf), np.nan_to_num(distance, nan=np.inf)
    )


def _alike(original: CompensationProblem, run: CompensationProblem, rows: Ints, run_rows: Ints) -> Bools:
    one, other = original.toolpath, run.toolpath
    same = (one.kind[rows] == other.kind[run_rows]) & (one.tool[rows] == other.tool[run_rows])
    same &= np.isclose(one.feed[rows], other.feed[run_rows], equal_nan=True)
    return np.asarray(
        same & np.isclose(one.approximation[rows], other.approximation[run_rows], equal_nan=True)
    )
