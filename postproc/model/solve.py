"""The equilibrium of many loaded states at once, and the motors that lead to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses
from postproc.effects import ChainState, Conditions
from postproc.model.mechanics import NOTHING, Mechanics
from postproc.robot.chain import ChainKinematics, generalized_force

CHUNK = 3 << 12
"""States evaluated at once: small enough for the arrays of a sweep to stay in the cache."""

TOLERANCE = 1e-14
"""[rad] What may be left of the way to the equilibrium after its last step, by the rate of the steps before."""

ENOUGH = 1e-11
"""[rad] Last step of a state that is at rest after all, where it cannot come to the one that was asked for."""

MAX_STEPS = 60

SYMMETRY_BREAKING_OFFSET = 1e-9
"""[rad, m] Where an equilibrium starts: beside the unloaded pose, so that a column pressed exactly along its line falls
over instead of standing on its tip."""

ROUNDS = 3
"""Times that ``inverse_equilibrium`` looks at what depends on the motors."""


@dataclass(frozen=True)
class Equilibrium:
    """Loaded states: ``coordinates`` (N, m) [rad, m], of them ``displacement`` (N, m) by load; ``pose`` of the TCP in
    the robot base, ``mount`` (N, 3) [m] its place without the spindle's own give; ``converged`` (N,): a stable
    equilibrium was found; ``steps`` iterations of the slowest state."""

    coordinates: Floats
    displacement: Floats
    pose: Poses
    mount: Floats
    converged: Bools
    steps: int

    def part(self, rows: Ints) -> Equilibrium:
        """The states ``rows`` (K,)."""
        return Equilibrium(
            # component first, as they are computed
            self.coordinates.T.take(rows, axis=1).T,
            self.displacement.T.take(rows, axis=1).T,
            self.pose[rows],
            self.mount.T.take(rows, axis=1).T,
            self.converged[rows],
            self.steps,
        )


def _at_rest(
    swept: ChainKinematics, coordinates: Floats, theta: Floats, good: Bools, steps: int
) -> Equilibrium:
    """Of coordinates and displacements (m, N); none where the TCP is nowhere."""
    good = good & np.isfinite(swept.position).all(axis=0)
    return Equilibrium(coordinates.T, theta.T, swept.pose, swept.mount.T, good, steps)


def _join_states(count: int, parts: Sequence[tuple[Ints, Equilibrium]]) -> Equilibrium:
    """``count`` states of which each part has its own."""
    rows, order = np.concatenate([rows for rows, _ in parts]), np.empty(count, np.int64)
    order[rows] = np.arange(count)
    in_order = bool((rows[1:] > rows[:-1]).all())

    def whole(take: Callable[[Equilibrium], Any]) -> Any:
        joined = np.concatenate([take(rest) for _, rest in parts])
        return joined if in_order else joined.take(order, axis=0)

    return Equilibrium(
        whole(lambda rest: rest.coordinates),
        whole(lambda rest: rest.displacement),
        Poses(whole(lambda rest: rest.pose.rotation), whole(lambda rest: rest.pose.position)),
        whole(lambda rest: rest.mount),
        whole(lambda rest: rest.converged),
        max(rest.steps for _, rest in parts),
    )


@dataclass(frozen=True)
class _Problems:
    """N states to be solved, component first: motors (n, N), rest (m, N), wrench (6, N)."""

    motors: Floats
    rest: Floats
    wrench: Floats
    tool: Poses
    conditions: Conditions

    def part(self, rows: Ints) -> _Problems:
        return _Problems(
            self.motors.take(rows, axis=1),
            self.rest.take(rows, axis=1),
            self.wrench.take(rows, axis=1),
            self.tool if self.tool.position.ndim == 1 else self.tool[rows],
            self.conditions.part(rows),
        )


def solve_equilibrium(
    model: Mechanics,
    q: Floats,
    wrench: Floats,
    tool: Poses,
    conditions: Conditions = NOTHING,
    start: Floats | None = None,
    tolerance: float = TOLERANCE,
) -> Equilibrium:
    """Motors ``q`` (N, n) [rad, m], ``wrench`` (N, 6) [N, N m], ``start`` (N, m) [rad, m]: see
    ``StiffnessModel.equilibrium``."""
    conditions = model.completed(q, conditions)
    parts: list[tuple[Ints, Equilibrium]] = []
    for first in range(0, max(len(q), 1), CHUNK):
        rows = slice(first, first + CHUNK)
        motors, given = np.ascontiguousarray(q[rows].T), conditions.part(rows)
        there = _Problems(
            motors,
            model.rest(motors, given),
            np.ascontiguousarray(wrench[rows].T),
            tool if tool.position.ndim == 1 else tool[rows],
            given,
        )
        if start is None:
            aside = SYMMETRY_BREAKING_OFFSET * np.cos(np.arange(model.chain.size))
            theta = np.repeat(aside[:, None], motors.shape[1], axis=1)
        else:
            theta = np.array(start[rows].T, order="C")
        parts += ((first + ended, rest) for ended, rest in _solve_in_order(model, there, theta, tolerance))
    return parts[0][1] if len(parts) == 1 else _join_states(len(q), parts)


def _solve_in_order(
    model: Mechanics, problems: _Problems, theta: Floats, tolerance: float
) -> Iterator[tuple[Ints, Equilibrium]]:
    """The states in the order in which they come to rest: their numbers (K,) and where they do."""
    rows, steps = np.arange(theta.shape[1]), 0
    if not model.laws:
        swept = model.chain.evaluate(problems.rest, problems.tool, problems.conditions.spindle)
        yield rows, _at_rest(swept, problems.rest, np.zeros_like(problems.rest), np.ones(len(rows), bool), 0)
        return
    stable, last = np.ones(len(rows), bool), np.zeros(len(rows))
    while True:
        swept, step, holds = _step(model, problems, theta)
        theta += step
        steps += 1
        stable &= holds
        size = np.abs(step).max(axis=0)
        # of a geometric series; the first step states nothing of its rate
        remaining = np.where(size < last, size * size / np.where(size < last, last - size, 1.0), size)
        last, resting = size, remaining <= tolerance
        ends = ~(remaining > tolerance) if steps < MAX_STEPS else np.ones(len(rows), bool)
        if len(rows) and not ends.any():
            continue
        # The last step is so small that nothing has to be re-evaluated.  Each state stops at its own, whatever
        # the others do: its result does not depend on them.
        good = stable & (resting | (size <= ENOUGH))
        there = _at_rest(swept.first_order_update(step), problems.rest + theta, theta, good, steps)
        if ends.all():
            yield rows, there
            return
        ended, on = np.flatnonzero(ends), np.flatnonzero(~ends)
        yield rows[ended], there.part(ended)
        rows, stable, last = rows[on], stable[on], last[on]
        theta, problems = theta.take(on, axis=1), problems.part(on)


def _step(model: Mechanics, problems: _Problems, theta: Floats) -> tuple[ChainKinematics, Floats, Bools]:
    """The chain at displacement ``theta`` (m, N), the step (m, N) of the iteration from there, and whether the
    diagonal holds (N,)."""
    coordinates = problems.rest + theta
    swept = model.chain.evaluate(coordinates, problems.tool, problems.conditions.spindle)
    state = ChainState(
        model.chain,
        model.gravity,
        problems.motors,
        problems.rest,
        coordinates,
        swept,
        problems.wrench,
        problems.conditions,
    )
    force, slope = model.forces(state)
    target, compliance = model.displacement(state, force)
    # A load that pushes away faster than the joint holds (C dM/dq >= 1) has no equilibrium.
    stiffening = 1.0 - compliance * slope
    holds = stiffening > 0
    step = (target - theta) / np.where(holds, stiffening, np.inf)
    return swept, step, np.asarray(holds.all(axis=0))


def solve_motors(
    model: Mechanics, coordinates: Floats, wrench: Floats, tool: Poses, conditions: Conditions = NOTHING
) -> tuple[Floats, Floats]:
    """Motors (N, n) and displacement (N, m) [rad, m] of ``coordinates`` (N, n) [rad, m] under ``wrench`` (N, 6) [N, N
    m]: see ``StiffnessModel.inverse_equilibrium``."""
    conditions = model.completed(coordinates, conditions)
    state = model.state(coordinates, wrench, tool, conditions)
    rows, joints = model.chain.motor_rows, state.motors
    pushed = generalized_force(state.swept, state.swept.position, state.wrench)
    was, moved = joints, np.zeros_like(joints)
    for _ in range(ROUNDS):
        force, _ = model.loaded(state, pushed)
        theta, _ = model.displacement(state, force)
        motors = joints - theta[rows] - (state.rest[rows] - state.motors)
        before, moved = moved, motors - was
        if not moved.any():
            break
        state = replace(state, motors=motors, rest=model.rest(motors, conditions))
        was = motors
    # what is still to come, as the rest of a geometric series
    share = np.clip(moved / np.where(before == 0.0, np.inf, before), -0.5, 0.5)
    more = moved * share / (1.0 - share)
    theta[rows] -= more
    return np.asarray((motors + more).T), np.asarray(theta.T)
