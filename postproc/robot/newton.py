"""Inverse kinematics of any serial arm, numerically, for whole batches.

    J dq = e,  dq = (J^T J + (|e|^2 / 2 + w) I)^-1 J^T e        (damping after Sugihara, IEEE T-RO 27, 2011)

e: what remains to the target, position over the arm's size and rotation vector.  The damping goes with the error, so
that the last steps are Newton's own.  A target that is far is gone to in steps along the straight path to it, so that
the solution stays in the branch of its start.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector, vector_from_rotation
from postproc.robot.chain import TOOL, Chain, jacobian
from postproc.robot.geometries import Joint, SerialArm

TOLERANCE = 5e-13
"""[m, rad] what may be left of a solved pose."""

STEP = 0.05
"""Way to a target gone at once: rad, and parts of the arm's size."""

FINE_STEP = 0.005
"""The same where axes turn far."""

FAR = 0.3
"""A target farther than this from ``near`` is another posture: any branch will do."""

_CHUNK = 4096
_WEIGHT = 1e-16
_STARTS = 24


class Solver:
    """One arm: its chain, the columns that move, its size [m]."""

    def __init__(self, arm: SerialArm) -> None:
        names = [axis.name for axis in arm.axes]
        limits = [(axis.lower, axis.upper) for axis in arm.axes]
        joints = arm.joints(names, limits)
        self.chain = Chain(joints, arm.flange())
        self.free = np.array([i for i in range(len(joints)) if i != arm.fixed])
        self.low, self.high = arm.limits.T
        self.turns = np.array([joint.kind == "revolute" for joint in joints])
        lengths = [_length(joint) for joint in joints[1:]] + [float(np.linalg.norm(arm.flange().position))]
        self.size = sum(lengths)
        self.first = int(self.free[0])
        after = lengths[self.first :]
        travels = np.maximum(np.abs(self.low), np.abs(self.high))[self.first :]
        self.reach = float(sum(after) + travels[~self.turns[self.first :]].sum())

    def residual(self, q: Floats, target: Poses) -> tuple[Floats, Floats]:
        """What remains to the targets, e (N, 6), and the Jacobian (N, 6, k) of the moving columns, both scaled."""
        swept = self.chain.evaluate(self.chain.placed(q), TOOL)
        here = swept.pose
        turn = vector_from_rotation(target.rotation @ np.swapaxes(here.rotation, 1, 2))
        error = np.concatenate([(target.position - here.position) / self.size, turn], axis=1)
        slope = jacobian(swept)[:, :, self.chain.motor_rows[self.free]]
        slope[:, :3] /= self.size
        return error, slope

    def solve(self, q: Floats, target: Poses, steps: int = 40, done: float = 0.0) -> tuple[Floats, Bools]:
        """From ``q`` (N, n) [rad, m] to ``target`` (N): the joint values (N, n), and where (N,) what remains is below
        the tolerance.

        ``done``: stop at this error instead of the tolerance.  Rows that make no headway are given up.
        """
        q, good = q.copy(), np.zeros(len(q), bool)
        active = np.flatnonzero(np.isfinite(q).all(axis=1) & np.isfinite(target.position).all(axis=1))
        before = np.full(len(q), np.inf)
        for step in range(steps):
            if not len(active):
                break
            error, slope = self.residual(q[active], target[active])
            size = np.maximum(
                np.linalg.norm(error[:, :3], axis=1) * self.size, np.linalg.norm(error[:, 3:], axis=1)
            )
            reached = size <= max(TOLERANCE, done)
            good[active[reached]] = True
            keep = ~reached
            if step % 8 == 7:
                keep &= size < 0.5 * before[active]
                before[active] = size
            active, error, slope = active[keep], error[keep], slope[keep]
            transposed = np.swapaxes(slope, 1, 2)
            damping = 0.5 * np.sum(error * error, axis=1) + _WEIGHT
            normal = transposed @ slope + damping[:, None, None] * np.eye(slope.shape[2])
            move = np.linalg.solve(normal, transposed @ error[:, :, None])[:, :, 0]
            q[np.ix_(active, self.free)] += move
        return q, good

    def distance(self, q: Floats, target: Poses) -> Floats:
        """(N,) how far the flange at ``q`` (N, n) is from its target: rad, and parts of the arm's size."""
        error = self.residual(q, target)[0]
        return np.asarray(
            np.maximum(np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1))
        )

    def beyond(self, q: Floats, target: Poses) -> Bools:
        """(N,) ``target`` (N) is farther from the first joint that moves than all links and travels after it together;
        ``q`` (N, n) states where that joint is."""
        swept = self.chain.evaluate(self.chain.placed(q), TOOL)
        away = np.linalg.norm(target.position - swept.origins[self.chain.motor_rows[self.first]].T, axis=1)
        return np.asarray(away > 1.001 * self.reach)

    def follow(self, q: Floats, target: Poses, stride: float = STEP) -> tuple[Floats, Bools, Bools]:
        """Joint values (N, n) and where (N,) they hold, as ``solve``, along the straight path from where the flange is
        at ``q`` (N, n), in steps of ``stride``; third (N,), where no step failed along the path."""
        swept = self.chain.evaluate(self.chain.placed(q), TOOL)
        here = swept.pose
        translation = target.position - here.position
        turn = vector_from_rotation(target.rotation @ np.swapaxes(here.rotation, 1, 2))
        length = np.maximum(np.linalg.norm(translation, axis=1) / self.size, np.linalg.norm(turn, axis=1))
        pieces = np.ceil(np.nan_to_num(length, nan=0.0) / stride).astype(np.int64)
        q, smooth = q.copy(), ~self.beyond(q, target)
        for piece in range(1, int(pieces.max(initial=0))):
            rows = np.flatnonzero(smooth & (pieces > piece))
            if not len(rows):
                break
            share = (piece / pieces[rows])[:, None]
            rotation = rotation_from_vector(share * turn[rows]) @ here.rotation[rows]
            between = Poses(rotation, here.position[rows] + share * translation[rows])
            q[rows], smooth[rows] = self.solve(q[rows], between, steps=7, done=1e-4)
        solution, good = self.solve(q, target)
        return solution, good, smooth & good

    def search(self, near: Floats, target: Poses) -> tuple[Floats, Bools]:
        """Solutions (N, n) in any branch, and where there is one (N,): within the limits if there is one, and of those
        the nearest to ``near`` (N, n) [rad, m]."""
        best, good = near.copy(), np.zeros(len(near), bool)
        rows = np.flatnonzero(~self.beyond(near, target))
        best[rows], good[rows] = self._search(near[rows], target[rows])
        return best, good

    def _search(self, near: Floats, target: Poses) -> tuple[Floats, Bools]:
        best, good = near.copy(), np.zeros(len(near), bool)
        cost = np.full(len(near), np.inf)
        draws = np.random.default_rng(0).random((_STARTS, len(self.low)))
        low = np.where(self.turns, np.maximum(self.low, -np.pi), self.low)
        high = np.where(self.turns, np.minimum(self.high, np.pi), self.high)
        for draw in draws:
            start = near.copy()
            start[:, self.free] = (low + draw * (high - low))[self.free]
            candidate, fine = self.solve(start, target)
            candidate = self.inside(candidate, near)
            away = np.abs(candidate - near).max(axis=1) + 1e3 * ~self.within(candidate)
            better = fine & (away < cost)
            best[better], cost[better], good[better] = candidate[better], away[better], True
        return best, good

    def inside(self, q: Floats, near: Floats) -> Floats:
        """(N, n) [rad, m] ``q`` (N, n), each turning axis at the whole turns nearest to ``near`` (N, n) within its
        limits, nearest at all without any."""
        q = q.copy()
        for i in self.free[self.turns[self.free]]:
            turns = np.round((near[:, i] - q[:, i]) / (2 * np.pi))
            least = np.ceil((self.low[i] - q[:, i]) / (2 * np.pi) - 1e-12)
            most = np.floor((self.high[i] - q[:, i]) / (2 * np.pi) + 1e-12)
            q[:, i] += 2 * np.pi * np.where(least <= most, np.clip(turns, least, most), turns)
        return q

    def within(self, q: Floats) -> Bools:
        """(N,) all joints of ``q`` (N, n) [rad, m] are within their limits."""
        return np.asarray(((q >= self.low - 1e-9) & (q <= self.high + 1e-9)).all(axis=1))


def _length(joint: Joint) -> float:
    """[m] from the joint before to this one, at most."""
    places = [joint.placement, *(passive.placement for passive in joint.passive)]
    return float(sum(np.linalg.norm(place.position) for place in places))


@lru_cache(maxsize=16)
def solver_of(arm: SerialArm) -> Solver:
    return Solver(arm)


def solve_near(arm: SerialArm, flange: Poses, near: Floats) -> tuple[Floats, Bools]:
    """(N, n) [rad, m] the solution that ``near`` (N, n) leads to, and where (N,) there is one.

    The fixed joint has its value of ``near``.  A target near to the pose at ``near`` is solved in its branch or not
    at all; for one that is ``FAR`` any branch will do, within the limits and near to ``near`` if there is a choice.
    """
    solver = solver_of(arm)
    return _chunked(lambda rows: _inverse_near(solver, flange[rows], near[rows]), near)


def _inverse_near(solver: Solver, flange: Poses, near: Floats) -> tuple[Floats, Bools]:
    known = np.isfinite(near).all(axis=1) & np.isfinite(flange.position).all(axis=1)
    q, good = np.full(near.shape, np.nan), np.zeros(len(near), bool)
    rows = np.flatnonzero(known)
    q[rows], good[rows], _ = solver.follow(near[rows], flange[rows])
    far = rows[solver.distance(near[rows], flange[rows]) > FAR]
    q[far] = solver.inside(q[far], near[far])
    again = far[~good[far] | ~solver.within(q[far])]
    if len(again):
        candidate, fine = solver.search(near[again], flange[again])
        better = fine & (~good[again] | solver.within(candidate))
        q[again[better]], good[again[better]] = candidate[better], True
    q[~good] = np.nan
    return q, good


def follow_rows(
    arm: SerialArm,
    flange: Poses,
    is_start: Bools,
    starts: Floats,
    jumps: Bools,
    fixed_values: Floats | None = None,
) -> tuple[Floats, Bools]:
    """Rows in order, each solved from the one before; (M, n) [rad, m] NaN where not reached, and (M,) reached.

    ``is_start`` (M,): the row before is not the last solution but ``starts`` (M, n); it must be set in row 0.
    ``jumps`` (M,): point to point, so that another branch or turn may be taken where the one so far has no path or
    exceeds the limits.  A path, on the contrary, that leads through a singular place or out of reach is not followed
    into another branch: its end counts as not reached.  A row that is not reached is passed over.  ``fixed_values``
    (M,) [rad, m]: of the fixed joint at the end of each row; without, it stays.

    Solved in about sqrt(M) stretches side by side.  A quick run over the ends of the stretches guesses where each
    starts; then all march together, one row at a time; a stretch that turns out to have started elsewhere than the one
    before it ends is marched again.  So the result is that of one march from the first row to the last.
    """
    solver = solver_of(arm)
    count = len(starts)
    stride = max(1, int(np.ceil(np.sqrt(count))))
    heads = np.arange(0, count, stride)
    q, good = np.full(starts.shape, np.nan), np.zeros(count, bool)

    last_start = np.maximum.accumulate(np.where(is_start, np.arange(count), 0))
    state = np.empty((len(heads), starts.shape[1]))
    state[0] = starts[0]
    for k in range(1, len(heads)):
        before = heads[k] - 1
        fresh = last_start[before] >= heads[k - 1]
        base = starts[last_start[before]] if fresh else state[k - 1]
        one = slice(before, before + 1)
        there, fine = _stepped(
            solver, _with_fixed_joint(arm, base[None], fixed_values, one), flange[one], jumps[one]
        )
        state[k] = there[0] if fine[0] else base
    ends = state.copy()
    dirty = np.ones(len(heads), bool)
    while dirty.any():
        todo = np.flatnonzero(dirty)
        ends[todo] = state[todo]
        for offset in range(stride):
            part = todo[heads[todo] + offset < count]
            rows = heads[part] + offset
            base = np.where(is_start[rows, None], starts[rows], ends[part])
            solution, fine = _stepped(
                solver, _with_fixed_joint(arm, base, fixed_values, rows), flange[rows], jumps[rows]
            )
            ends[part] = np.where(fine[:, None], solution, base)
            q[rows], good[rows] = np.where(fine[:, None], solution, np.nan), fine
        moved = np.abs(ends[:-1] - state[1:]).max(axis=1, initial=0.0) > 1e-7
        dirty = np.concatenate([[False], moved & ~is_start[heads[1:]]])
        state[1:][dirty[1:]] = ends[:-1][dirty[1:]]
    return q, good


def _with_fixed_joint(
    arm: SerialArm, base: Floats, fixed_values: Floats | None, rows: Ints | slice
) -> Floats:
    """The angles ``base`` (K, n) with the fixed joint where it is in ``rows``."""
    if fixed_values is None or arm.fixed is None:
        return base
    base = base.copy()
    base[:, arm.fixed] = fixed_values[rows]
    return base


def _stepped(solver: Solver, base: Floats, flange: Poses, jumps: Bools) -> tuple[Floats, Bools]:
    """One motion on from ``base``: a path in its own branch or not at all, a jump in another one if need be."""
    solution, fine, smooth = solver.follow(base, flange)
    rows = np.flatnonzero(~jumps & fine & ~smooth)
    if len(rows):
        solution[rows], _, fine[rows] = solver.follow(base[rows], flange[rows], FINE_STEP)
    rows = np.flatnonzero(jumps & fine)
    solution[rows] = solver.inside(solution[rows], solution[rows])
    again = np.flatnonzero(jumps & ~(fine & solver.within(solution)) & np.isfinite(base).all(axis=1))
    if len(again):
        other, well = solver.search(base[again], flange[again])
        better = well & (~fine[again] | solver.within(other))
        solution[again[better]], fine[again[better]] = other[better], True
    return solution, fine


def weakest(arm: SerialArm, q: Floats) -> Floats:
    """(N,) smallest singular value of the Jacobian of the moving joints at ``q`` (N, n) [rad, m], lengths as parts of
    the arm's size."""
    solver = solver_of(arm)
    swept = solver.chain.evaluate(solver.chain.placed(np.nan_to_num(q)), TOOL)
    slope = jacobian(swept)[:, :, solver.chain.motor_rows[solver.free]]
    slope[:, :3] /= solver.size
    return np.asarray(np.linalg.svd(slope, compute_uv=False)[:, -1])


def _chunked(solve: Callable[[slice], tuple[Floats, Bools]], like: Floats) -> tuple[Floats, Bools]:
    q, good = np.empty_like(like), np.empty(len(like), bool)
    for start in range(0, len(like), _CHUNK):
        rows = slice(start, start + _CHUNK)
        q[rows], good[rows] = solve(rows)
    return q, good
