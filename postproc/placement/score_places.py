"""What placements of a part are worth: feasibility of every motion, and the error that the force leaves on the part.

The deflection is linear at the unloaded posture, eq. (5): e = sum over the coordinates i of the chain of
c_i l_i (l_i . f + a_i . m), with the compliance c_i, the linear part l_i and the angular part a_i of the Jacobian's
column i.  Its part across the feed t is e - (e . t) t.  All in arrays over placements and motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.geometry import turned, wrapped
from postproc.effects import ChainState
from postproc.model import StiffnessModel
from postproc.placement.part_motions import PartMotions
from postproc.placement.room import TRACK, Room
from postproc.placement.singularity import singularity_angle
from postproc.robot.chain import ChainKinematics, cross
from postproc.robot.inverse import inverse

ACROSS, MAX, P95, UNCERTAINTY = "across", "max", "p95", "uncertainty"
OBJECTIVES = (ACROSS, MAX, P95, UNCERTAINTY)

TURNING = (-6, -3, -1)
"""Columns of A1, A4, A6 of a KUKA-type arm, which can make more than half a turn."""

STATES = 10_000
"""Poses evaluated at once."""

UNREACHABLE = 1.0
"""[rad] What a pose out of reach counts as, beside an axis that is so far beyond its limit."""

COVERAGE = 1.96


@dataclass(frozen=True, eq=False)
class InputSpread:
    """What the objective ``uncertainty`` varies: models with one figure a standard deviation larger; force: relative
    standard deviation of its size."""

    models: tuple[StiffnessModel, ...] = ()
    force: float = 0.0


@dataclass(frozen=True, eq=False)
class Scoring:
    """How placements are compared.  objective: one of ``OBJECTIVES``; limit, singular [rad]: margins; forces (K, R, 3)
    [N] of the motions (R) in world axes now, over which the objective is averaged; unloaded: the error contains what
    the robot does without load."""

    objective: str
    limit: float
    singular: float
    forces: Floats
    spread: InputSpread = InputSpread()
    unloaded: bool = False

    def take(self, rows: Ints) -> Scoring:
        """The same for the motions ``rows`` (K,)."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return Scoring(**{**values, "forces": self.forces[:, rows]})


@dataclass(frozen=True, eq=False)
class Scores:
    """Of P placements, places (P, 6): violation (P,) [rad], 0 where every motion is feasible; values (P, K) [m]: the
    objective under each set of forces, infinite where a motion is not feasible unless in detail; in detail: lack (P, R)
    [rad] by which each place falls short of its margins; error (P, R, K) [m]: of each scored place under each set of
    forces, 0 elsewhere; limit, singular (P, R) [rad]: distances from the next axis limit and singularity, -inf out of
    reach."""

    places: Floats
    violation: Floats
    values: Floats
    lack: Floats | None = None
    error: Floats | None = None
    limit: Floats | None = None
    singular: Floats | None = None

    @property
    def value(self) -> Floats:
        """(P,) [m] the objective, averaged over its sets of forces; infinite where a motion is not feasible."""
        mean = self.values.mean(axis=1)
        return np.where(self.violation > 0, np.inf, mean)

    def order(self) -> Ints:
        """(P,) best first; those that are not feasible last, by how far they are from it."""
        return np.lexsort((self.value, self.violation))

    def part(self, rows: Ints) -> Scores:
        """The placements ``rows`` (K,)."""
        return Scores(self.places[rows], self.violation[rows], self.values[rows])

    @staticmethod
    def join(parts: Sequence[Scores]) -> Scores:
        """All of several, one after the other."""
        return Scores(
            np.concatenate([one.places for one in parts]),
            np.concatenate([one.violation for one in parts]),
            np.concatenate([one.values for one in parts]),
        )


def score_places(
    model: StiffnessModel,
    motions: PartMotions,
    room: Room,
    scoring: Scoring,
    places: Floats,
    detailed: bool = False,
) -> Scores:
    """The scores of ``places`` (P, 6); ``detailed``: with those of every motion."""
    each = max(1, STATES // max(len(motions), 1))
    blocks = list(
        in_blocks(
            lambda part: _score(model, motions, scoring, places[part], detailed), len(places), rows=each
        )
    )
    outside = room.outside(places)
    violation, values, *details = (
        np.concatenate([block[k] for block in blocks]) for k in range(len(blocks[0]))
    )
    return Scores(places, violation + outside, values, *details)


def _score(
    model: StiffnessModel, motions: PartMotions, scoring: Scoring, places: Floats, detailed: bool
) -> tuple[Floats, ...]:
    """Violation (P,), values (P, K), and in detail lack, error, limit, singular (P, R)."""
    q, limit, singular = joint_margins(model, motions, places)
    lack = np.maximum(scoring.limit - limit, 0.0) + np.maximum(scoring.singular - singular, 0.0)
    lack = np.where(np.isfinite(lack), lack, UNREACHABLE)
    violation = lack.max(axis=1) + lack.mean(axis=1)
    asked = np.arange(len(places)) if detailed else np.flatnonzero(violation == 0)
    values = np.full((len(places), len(scoring.forces)), np.inf)
    error = np.zeros((*lack.shape, len(scoring.forces)))
    if len(asked):
        values[asked], error[asked] = _values(model, motions, scoring, places[asked], q[asked])
    return (violation, values, *((lack, error, limit, singular) if detailed else ()))


def joint_margins(
    model: StiffnessModel, motions: PartMotions, places: Floats
) -> tuple[Floats, Floats, Floats]:
    """Joint values (P, R, n) [rad, m], those of now where a pose is out of reach, and distances (P, R) [rad] from the
    next limit of an axis and from the next singularity, -inf out of reach, with the part at ``places`` (P, 6)."""
    robot, count, rows = model.robot, len(places), len(motions)
    near = np.tile(motions.q, (count, 1))
    if motions.track_joint is not None:
        near[:, motions.track_joint] = np.repeat(places[:, TRACK], rows)
    solution = inverse(robot.nominal, motions.flanges(places), np.tile(motions.branch, count), near)
    reached = solution.reachable.reshape(count, rows)
    q = np.where(solution.reachable[:, None], solution.q, near).reshape(count, rows, -1)
    _choose_turns(motions, q)
    low, high = robot.limits.T
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    room = np.minimum(q - low, high - q)
    # a linear axis may use all of its travel
    room[..., ~turns] = np.where(room[..., ~turns] >= -1e-9, np.inf, room[..., ~turns])
    limit = np.where(reached, room.min(axis=2), -np.inf)
    singular = singularity_angle(robot, q.reshape(count * rows, -1)).reshape(count, rows)
    return q, limit, np.where(reached, singular, -np.inf)


def _choose_turns(motions: PartMotions, q: Floats) -> None:
    """Sets the turns of A1, A4 and A6 of ``q`` (P, R, n) in place: of heads as anchor or T state them, of other places
    so that they differ from now by as much as their head does, to half a turn."""
    heads = np.unique(motions.head)
    for axis in TURNING:
        values = q[..., axis]
        anchor, sign = motions.anchor[heads, axis], motions.sign[heads, axis]
        chosen = anchor + wrapped(values[:, heads] - anchor)
        by_sign = wrapped(values[:, heads])
        by_sign += 2 * np.pi * ((sign > 0) & (by_sign < 0)) - 2 * np.pi * ((sign < 0) & (by_sign > 0))
        values[:, heads] = np.where(sign != 0, by_sign, np.where(np.isnan(anchor), values[:, heads], chosen))
        moved = values - motions.q[:, axis]
        beside = moved - moved[:, motions.head]
        values -= 2 * np.pi * np.round(beside / (2 * np.pi))


def _values(
    model: StiffnessModel, motions: PartMotions, scoring: Scoring, places: Floats, q: Floats
) -> tuple[Floats, Floats]:
    """The objective (P, K) [m] and the errors (P, R, K) [m] under each set of forces."""
    rows = np.flatnonzero(motions.scored)
    count = len(places)
    shape = (count, len(rows))
    error = np.zeros((count, len(motions), len(scoring.forces)))
    chosen = np.tile(rows, count)
    angles = q[:, rows].reshape(count * len(rows), -1)
    given = motions.conditions.part(chosen)
    state = model.state(angles, np.zeros((len(angles), 6)), motions.tool[chosen], given)
    moment = _flat(motions.in_robot(places, rows, motions.moment[rows], motions.world[rows]))
    tangent = _flat(motions.in_robot(places, rows, motions.tangent[rows], ~motions.moves[rows]))
    _turn_approaches(motions, places, rows, tangent)
    lines = [_lever(state.swept, i) for i in range(model.chain.size)]
    turns = [axis if turn else None for axis, turn in zip(state.swept.axes, state.swept.turns, strict=True)]
    for row, leader, ratio in model.chain.couplings:
        lines[leader] = lines[leader] + ratio * lines[row]
        more, own = turns[row], turns[leader]
        if more is not None:
            turns[leader] = ratio * more if own is None else own + ratio * more
    gives = model.compliance(state).T
    start = np.zeros((3, len(angles)))
    if scoring.unloaded:
        flange = motions.flanges(places)
        wanted = flange.position + turned(
            flange.rotation, motions.tool.position[np.tile(np.arange(len(motions)), count)]
        )
        rest = model.equilibrium(angles, np.zeros((len(angles), 6)), motions.tool[chosen], given)
        start = rest.pose.position.T - _flat(wanted.reshape(count, -1, 3)[:, rows])

    values = np.empty((count, len(scoring.forces)))
    for k, force in enumerate(scoring.forces):
        pushed = _flat(motions.in_robot(places, rows, force[rows], motions.world[rows]))
        torque = [
            _dot(line, pushed) + (0.0 if turn is None else _dot(turn, moment))
            for line, turn in zip(lines, turns, strict=True)
        ]
        moved = start + _sum(gives, torque, lines)
        size = np.sqrt(_dot(moved, moved))
        if scoring.objective == ACROSS:
            size = _across(moved, tangent)
        if scoring.objective == UNCERTAINTY:
            size = _half_width(model, scoring.spread, state, gives, torque, lines)
        each = size.reshape(shape)
        values[:, k] = np.percentile(each, 95, axis=1) if scoring.objective == P95 else each.max(axis=1)
        error[:, rows, k] = each
    return values, error


def _turn_approaches(motions: PartMotions, places: Floats, rows: Ints, tangent: Floats) -> None:
    """Sets in ``tangent`` (3, P K) of the motions ``rows`` (K,) those that start where the part does not move."""
    some = np.flatnonzero(np.isfinite(motions.start[rows, 0]))
    if len(some):
        feed = motions.positions(places, rows[some]) - motions.start[rows[some]]
        feed /= np.maximum(np.linalg.norm(feed, axis=2, keepdims=True), 1e-9)
        tangent.reshape(3, len(places), len(rows))[:, :, some] = np.moveaxis(feed, 2, 0)


def _half_width(
    model: StiffnessModel,
    spread: InputSpread,
    state: ChainState,
    gives: Floats,
    torque: Sequence[Floats],
    lines: Sequence[Floats],
) -> Floats:
    """(N,) [m] half width of the 95 % interval of what a correction leaves: 1.96 times the root of the sum of squares
    of what each figure moves the tool by a standard deviation."""
    moved = _sum(gives, torque, lines)
    square = (spread.force**2) * _dot(moved, moved)
    for stepped in spread.models:
        change = stepped.compliance(state).T - gives
        step = _sum(change, torque, lines)
        square = square + _dot(step, step)
    return np.asarray(COVERAGE * np.sqrt(square))


def _across(moved: Floats, tangent: Floats) -> Floats:
    along = _dot(moved, tangent)
    return np.asarray(np.sqrt(np.maximum(_dot(moved, moved) - along * along, 0.0)))


def _lever(swept: ChainKinematics, i: int) -> Floats:
    """(3, N) what coordinate ``i`` moves the TCP by."""
    if not swept.turns[i]:
        return swept.axes[i]
    return cross(swept.axes[i], swept.position - swept.origins[i])


def _sum(weights: Floats, torque: Sequence[Floats], lines: Sequence[Floats]) -> Floats:
    """(3, N) sum of weight * torque * line."""
    total = np.zeros_like(lines[0])
    for weight, one, line in zip(weights, torque, lines, strict=True):
        total += (weight * one) * line
    return total


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _flat(vectors: Floats) -> Floats:
    """(3, N) of vectors (P, R, 3)."""
    return np.ascontiguousarray(vectors.reshape(-1, 3).T)
