"""Problems whose tool yields by a constant times the force, at every place alike: what is off has a closed form."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from path_cases import task

from postproc.base.geometry import Poses, product, rotation_from_vector
from postproc.compensation.correct import CorrectionResult, MotionOutcome
from postproc.compensation.mirror import Correction, Prediction
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.process.force_ramps import Ramps
from postproc.toolpath import Kind, Role

MM = 1e-3
AT = np.array([1.6, 0.0, 0.5])
"""Where the hand-made paths are [m]."""


class SpringProblem(CompensationProblem):
    """Without a force the tool is where the controller is sent; else ``COMPLIANCE`` times the force beside it."""

    COMPLIANCE = np.zeros((3, 3))

    def simulated(self, rows, command, wrench, start=None, q=None, share=None, corrected=False, came=None):
        pose = Poses(command.rotation.copy(), command.position + wrench[:, :3] @ self.COMPLIANCE.T)
        yes = np.ones(len(rows), bool)
        return Prediction(pose, self.track.q[rows], np.zeros((len(rows), 6)), yes, yes)

    def goal(self, rows, wanted, share=None):
        return wanted

    def start_command(self, rows, wanted, wrench, goal, q=None, share=None):
        return wanted.copy(), np.zeros((len(rows), 6))

    def command(self, rows, wanted, wrench, goal, start=None, share=None):
        n, yes, zero = len(rows), np.ones(len(rows), bool), np.zeros(len(rows))
        pose = Poses(goal.rotation.copy(), goal.position - wrench[:, :3] @ self.COMPLIANCE.T)
        first = np.linalg.norm(wrench[:, :3] @ self.COMPLIANCE.T, axis=1)
        history = np.stack([first, zero])
        return Correction(pose, self.track.q[rows], history, zero, zero, np.zeros((n, 3)),
                          np.ones(n, int), yes, yes, yes)  # fmt: skip

    def unloaded(self, rows, wanted, share=None):
        return self.simulated(rows, wanted, np.zeros((len(rows), 6)))


def spring(points, carries, compliance=None, force=(0.0, 0.0, 0.0), **words) -> SpringProblem:
    """Motions to ``points`` (N, 3) [m from AT]; ``compliance`` (3, 3) [m/N]; ``force`` (3,) or (N, 3) [N]."""
    points = AT + np.asarray(points, float)
    wrench = np.zeros((len(points), 6))
    wrench[:, :3] = force
    words = {"kind": [Kind.PTP] + [Kind.LIN] * (len(points) - 1)} | words
    plain = task(points, carries, wrench=wrench, **words)
    kept = {one.name: getattr(plain, one.name) for one in fields(plain)}
    kind = type("_Spring", (SpringProblem,), {"COMPLIANCE": np.zeros((3, 3) if compliance is None else 0)})
    if compliance is not None:
        kind.COMPLIANCE = np.asarray(compliance, float)
    return kind(**kept)


def with_ramp(job: SpringProblem, rows, steps, lengths) -> SpringProblem:
    """The force goes over by ``steps`` (K, 3) [N] from the starts of ``rows`` (K,) on, over ``lengths`` (K,) [m]."""
    step = np.zeros((len(rows), 6))
    step[:, :3] = steps
    extent = job.desired_path.length
    ramps = Ramps.of(np.array(rows), step, np.array(lengths, float), extent, job.carries)
    return replace(job, force=replace(job.force, ramps=ramps))


def output(job: SpringProblem, shifts, inserted=(), turns=None) -> Subdivision:
    """The motions of ``job`` with ends moved by ``shifts`` (N, 3) [m] and turned by ``turns`` (N,) [rad] about z; and
    ``inserted`` points: (row, share, shift (3,), turn) each."""
    n = len(job.toolpath)
    turns = np.zeros(n) if turns is None else np.asarray(turns, float)
    places = [(row, 1.0, np.asarray(shifts)[row], turns[row], Role.ORIGINAL) for row in range(n)]
    places += [
        (row, share, np.asarray(shift), turn, Role.INTERMEDIATE) for row, share, shift, turn in inserted
    ]
    places.sort(key=lambda one: (one[0], one[1]))
    source = np.array([one[0] for one in places])
    share = np.array([one[1] for one in places])
    position, rotation = np.empty((len(places), 3)), np.empty((len(places), 3, 3))
    for k, (row, at, shift, turn, role) in enumerate(places):
        on = (
            job.wanted[np.array([row])]
            if role == Role.ORIGINAL
            else job.desired_path.at(np.array([row]), np.array([at]))
        )
        position[k] = on.position[0] + shift
        rotation[k] = product(rotation_from_vector(np.array([[0.0, 0.0, turn]])), on.rotation)[0]
    none = np.full((len(places), 3), np.nan)
    return Subdivision(
        source,
        np.array([one[4] for one in places], np.int8),
        share,
        Poses(rotation, position),
        none,
        none,
        np.full(len(places), np.nan),
        np.ones(len(places), bool),
    )


def corrected(job: SpringProblem, shifts, turns=None) -> CorrectionResult:
    """As if the ends of all motions with force were corrected by ``shifts`` (N, 3) [m] and ``turns`` (N,) about z."""
    n = len(job.toolpath)
    state = np.where(job.carries, MotionOutcome.CORRECTED, MotionOutcome.AIR)
    turn = np.zeros((n, 3))
    turn[:, 2] = 0.0 if turns is None else turns
    zero = np.zeros(n)
    return CorrectionResult(
        state=state,
        cut=np.where(job.carries, 0, -1),
        command=Poses(job.wanted.rotation, job.wanted.position + shifts),
        correction=np.asarray(shifts, float),
        turn=turn,
        deflection=np.zeros((n, 3)),
        before=zero,
        before_angle=zero,
        after=zero.copy(),
        after_angle=zero.copy(),
        iterations=np.zeros(n, int),
        history=np.zeros((1, n)),
        findings=(),
        across_after=zero.copy(),
    )


def drawn(points: np.ndarray, reach: np.ndarray, count: int = 401) -> tuple[np.ndarray, np.ndarray]:
    """The polygon through ``points`` (K, D), of which the first three numbers are places, each point rounded off from
    ``reach`` (K,) [m] on, no farther than half of either line, by ``count`` places (odd) a piece: places (S, D), and to
    which line (S,) they belong: the middle of a parabola, once each, to both."""
    length = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
    d = np.zeros(len(points))
    d[1:-1] = np.minimum(reach[1:-1], 0.5 * np.minimum(length[:-1], length[1:]))
    t = np.linspace(0.0, 1.0, count)[:, None]
    places, lines = [], []
    for k, size in enumerate(length):
        unit = (points[k + 1] - points[k]) / size
        start, end = points[k] + d[k] * unit, points[k + 1] - d[k + 1] * unit
        places.append(start + t * (end - start))
        lines.append(np.full(count, k))
        if k + 2 < len(points):
            after = points[k + 1] + d[k + 1] * (points[k + 2] - points[k + 1]) / length[k + 1]
            curve = (1 - t) ** 2 * end + 2 * t * (1 - t) * points[k + 1] + t**2 * after
            half = count // 2
            places += [curve[: half + 1], curve[half:]]
            lines += [np.full(half + 1, k), np.full(half + 1, k + 1)]
    return np.concatenate(places), np.concatenate(lines)


def places_along(lengths, reach, position, spacing):
    """Places (S, D) on a path of motions of ``lengths`` (K,) [m] and their distances (S,) [m] along it; rounded off
    from ``reach`` (K,) [m] before the end of each on; ``position``(k, share) gives (S, D) on one motion."""
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    found, at = [], []
    for k, length in enumerate(lengths):
        before = reach[k - 1] if k else 0.0
        s = np.linspace(before, length - reach[k], max(int((length - before - reach[k]) / spacing), 33))
        found.append(position(k, s / length))
        at.append(ends[k] + s)
        d = reach[k]
        if k + 1 < len(lengths) and d > 0:
            t = np.linspace(0.0, 1.0, max(int(2 * d / spacing), 65))[1:-1, None]
            one = position(k, 1.0 - d * (1.0 - t[:, 0]) / length)
            two = position(k + 1, d * t[:, 0] / lengths[k + 1])
            found.append((1.0 - t) * one + t * two)
            at.append(ends[k + 1] + d * (2.0 * t[:, 0] - 1.0))
    return np.concatenate(found), np.concatenate(at)


def largest_error(job: SpringProblem, division: Subdivision, rows, blend, around, spacing=0.01 * MM):
    """[m] by how much the tool is off within ``around`` [m] of the start of the last of ``rows``, by brute force: the
    original and the output drawn place by place, the force of the place that the tool is square to looked for among
    all.  ``blend`` (N,) [m]: of the motions of the program, and of what is inserted into them."""
    rows = np.asarray(rows)
    length = job.desired_path.length[rows]
    reach = np.append(np.minimum(blend[rows[:-1]], 0.5 * np.minimum(length[:-1], length[1:])), 0.0)
    base, s = places_along(
        length, reach, lambda k, t: job.desired_path.at(np.full(len(t), rows[k]), t).position, spacing
    )
    motions = np.flatnonzero(np.isin(division.source, rows))
    pieces = subdivided_motions(job, division, motions)
    size = np.linalg.norm(pieces.end.position - pieces.start.position, axis=1)
    arc = np.isfinite(pieces.sweep)
    radius = np.linalg.norm(pieces.start.position - pieces.centre, axis=1)
    size[arc] = (pieces.sweep * radius)[arc]
    stated = blend[division.source[motions]]
    round_ = np.append(np.minimum(stated[:-1], 0.5 * np.minimum(size[:-1], size[1:])), 0.0)
    sent, _ = places_along(size, round_, lambda k, t: pieces[np.full(len(t), k)].at(t).position, 4 * spacing)
    start = np.cumsum(length)[-2] if len(rows) > 1 else 0.0
    vertex = job.desired_path.at(rows[-1:], np.zeros(1)).position[0]
    sent = sent[np.linalg.norm(sent - vertex, axis=1) < around]
    near = np.abs(s - start) < around + 2 * MM
    base, s = base[near], s[near]
    row = np.minimum(np.searchsorted(np.cumsum(length), s, side="right"), len(rows) - 1)
    share = (s - np.concatenate([[0.0], np.cumsum(length)])[row]) / length[row]
    yields = job.force.along(rows[row], np.clip(share, 0.0, 1.0))[:, :3] @ job.COMPLIANCE.T
    tangent = np.gradient(base, axis=0)
    largest = 0.0
    for one in sent:
        away = one + yields - base
        gap = np.sum(away * tangent, axis=1)
        at = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0))
        if len(at):
            part = (gap[at] / (gap[at] - gap[at + 1]))[:, None]
            here = away[at] + part * (away[at + 1] - away[at])
            largest = max(largest, float(np.linalg.norm(here, axis=1).min()))
    return largest
