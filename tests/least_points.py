"""``python -m tests.least_points [PROGRAM]``: how many points its ramps of the force need at least, wherever they are.

Between its ends a motion without a point in between is a straight line, but for the parabolas at its ends.  On a ramp
the wanted command turns where the force has gone over.  Where, of three places in a row, the middle one is off the line
between the others by more than twice the tolerance, no straight line is within the tolerance of all three, and the
motion has a point at least.  With one point, rounded off from d on, the path beside it is a line, a parabola over 2 d,
and a line; where the best of these for every place of the point, by a linear programme over both lines, is further off
than the tolerance, the motion has two points at least.  Points at vertices are taken to be no further than ``SHIFTED``
from them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

from postproc.compensation.corner_division import commands_on_path
from postproc.compensation.problem import CompensationProblem
from postproc.workflows.preparation import Request, prepare

MM = 1e-3
TAUGHT = Path(__file__).parents[1] / "samples" / "kr270_taught" / "taught.src"
SHIFTED = 1.5 * MM
STEP = 0.02 * MM
"""Of the places of a point; between two of them the error changes by half of it times the turn at most."""


def curve(task: CompensationProblem, row: int, away: np.ndarray) -> np.ndarray:
    """(K, 3) [m] the wanted commands across the feed, at path lengths ``away`` (K,) [m] on a straight motion."""
    share = away / task.desired_path.length[row]
    place = commands_on_path(task, np.full(len(away), row), share).position
    feed = task.desired_path.tangent(np.array([row]), np.array([0.5]))[0]
    return place - np.outer(place @ feed, feed)


def off_line(task: CompensationProblem, row: int, away: np.ndarray) -> float:
    """[m] the largest error of the best straight line at three places."""
    one, two, three = curve(task, row, away)
    share = (away[1] - away[0]) / (away[2] - away[0])
    return float(np.linalg.norm(two - (1 - share) * one - share * three) / 2)


def off_one_point(task: CompensationProblem, row: int, end: float, vertex: float, reach: float) -> float:
    """[m] by how much the best path with one point on the motion, rounded off from ``reach`` [m] on, is off at least,
    in the plane in which the correction turns where the ramp ends, at ``end`` [m]; from ``vertex`` [m] on the motion's
    start is rounded off."""
    length = float(task.desired_path.length[row])
    shifted = SHIFTED if vertex > 0 else 0.0  # an exact end stays
    away = np.arange(vertex + shifted, min(3 * end, length / 2), 0.1 * MM)
    place = curve(task, row, away)
    at = int(np.searchsorted(away, end))
    before, after = (
        (place[last] - place[first]) / (away[last] - away[first]) for first, last in ((0, at), (at, -1))
    )
    turn = float(np.linalg.norm(after - before))
    wanted = place @ ((after - before) / turn)
    least = np.inf
    for point in np.arange(shifted + STEP, away[-1], STEP):
        rounded = min(reach, 0.5 * (point - shifted), 0.5 * (length - point))
        known = rounded == reach or not shifted  # else its line may be so short, or longer
        x = away - point
        bend = np.where(np.abs(x) < rounded, (x + rounded) ** 2 / (4 * rounded), np.maximum(x, 0.0))
        # the line before the point, its turn, and the largest error
        basis = np.stack([np.ones(len(x)), x, bend], axis=1)
        some = np.full(len(x), True) if known else x >= reach
        basis, asked = basis[some], wanted[some] / MM
        rows = np.block([[basis, -np.ones((len(asked), 1))], [-basis, -np.ones((len(asked), 1))]])
        sides = [(None, None)] * 3 + [(0, None)]
        least = min(least, MM * linprog([0, 0, 0, 1], rows, np.append(asked, -asked), bounds=sides).fun)
    return least - 0.5 * STEP * turn


def least_points(task: CompensationProblem) -> dict[int, tuple[int, float, float]]:
    """By the row of each ramp: the points that it has at least, and the least errors [m] with none and with one."""
    found = {}
    assert task.force.ramps is not None
    rows, ends, _ = task.force.ramps.steps()
    for row, end in zip(rows.tolist(), ends.tolist(), strict=True):
        length = float(task.desired_path.length[row])
        vertex, behind = (float(task.toolpath.approximation[k]) for k in (row - 1, row))
        stated = float(task.toolpath.constraints.inserted_approximation[row])
        # as far from the ends as their parabolas reach, wherever their points are
        none = off_line(task, row, np.array([0.75 * end, end, length - behind - SHIFTED]))
        one = off_one_point(task, row, end, vertex, behind if behind > 0 else stated)
        found[row] = (0 if none <= task.tolerance else 1 if one <= task.tolerance else 2, none, one)
    return found


def main(words: list[str]) -> int:
    program = Path(words[0]) if words else TAUGHT
    task = prepare(Request(program, force="")).task
    found = least_points(task)
    print("line  without a point  with one  points at least   (least error, mm)")
    for row, (count, none, one) in found.items():
        print(f"{int(task.toolpath.line[row]):4} {none / MM:16.3f} {one / MM:9.3f} {count:16}")
    motions = len(task.toolpath)
    total = sum(count for count, _, _ in found.values())
    print(
        f"{motions} motions, {total} points at least: {(motions + total) / motions:.3f} times the motions or more"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
