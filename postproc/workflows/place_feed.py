"""What cutting in another direction would bring: of the whole path, and of each operation of the programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import DEG
from postproc.placement.part_motions import PartMotions
from postproc.placement.score_places import P95, score_places
from postproc.report.placement import FeedTurn
from postproc.workflows.cell_force_factors import operations_of
from postproc.workflows.place_problem import PlaceProblem

STEP = 15
"""[deg] Between the directions that are looked at; a force and its opposite deflect alike, so half a turn is all."""

MOST_SHOWN = 30
"""Operations that are reported, those with the largest errors."""


def feed_turns(problem: PlaceProblem, place: Floats) -> tuple[FeedTurn, ...]:
    """What cutting in another direction would change at ``place`` (6,): of the whole path and of each operation, turned
    about the vertical where it is.

    The cutting force turns with the feed, in whatever axes it is stated; the robot's postures are taken as they are:
    another program would be needed, and this is what it could bring, to the size of the part against the robot's.
    """
    scoring = problem.scoring
    chosen = problem.motions.with_heads(np.flatnonzero(problem.motions.scored))
    part = problem.motions.take(chosen)
    rows = np.flatnonzero(part.scored)
    angles = np.arange(-90, 90, STEP)
    forces = scoring.take(chosen).forces[:1]
    errors = np.empty((len(angles), len(rows)))
    for k, angle in enumerate(angles.tolist()):
        turn = _about_z(angle * DEG)
        turned = replace(
            part,
            tangent=part.tangent @ turn.T,
            start=np.full_like(part.start, np.nan),
            moment=part.moment @ turn.T,
        )
        some = replace(scoring, forces=forces @ turn.T)
        scores = score_places(problem.model, turned, problem.room, some, place[None], detailed=True)
        assert scores.error is not None
        errors[k] = scores.error[0, rows, 0]
    values = np.percentile(errors, 95, axis=1) if scoring.objective == P95 else errors.max(axis=1)
    found = [FeedTurn("", "", 0, 0, *_best(angles, values))]
    names, which = _operations(problem, part, rows)
    line, program = part.line[rows], part.program[rows]
    each = []
    for k, name in enumerate(names):
        own = which == k
        values = errors[:, own].max(axis=1)
        file = str(problem.request.programs[int(program[own][0])])
        first, last = int(line[own].min()), int(line[own].max())
        each.append(FeedTurn(file, name, first, last, *_best(angles, values)))
    each.sort(key=lambda one: -one.before)
    return (*found, *each[:MOST_SHOWN])


def _best(angles: Ints, values: Floats) -> tuple[float, float, float]:
    """[m] the value (A,) as it is, [rad] the best angle, and [m] the value there."""
    best = int(values.argmin())
    return float(values[angles == 0][0]), float(angles[best]) * DEG, float(values[best])


def _operations(problem: PlaceProblem, part: PartMotions, rows: Ints) -> tuple[list[str], Ints]:
    """Names of the operations of all programs, and that of each of the motions ``rows`` (K,) of ``part``.

    An operation is named by the process file or by a comment; of a program that names none each cut is one, without a
    name: motions under force with no other motion between them.
    """
    names: list[str] = []
    which = np.empty(len(rows), np.int64)
    for k, ready in enumerate(problem.prepared):
        own = np.flatnonzero(part.program[rows] == k)
        row = part.row[rows[own]]
        known = operations_of(ready.cell, ready.task.force, ready.task.toolpath)
        labels = known.which[row]
        words = [known.names[label] for label in np.unique(labels).tolist()]
        if all(word.startswith("tool ") for word in words):
            labels = np.cumsum(np.diff(row, prepend=row[:1]) > 1)
            words = [""] * len(np.unique(labels))
        _, order = np.unique(labels, return_inverse=True)
        which[own] = order + len(names)
        names += words
    return names, which


def _about_z(angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
