"""Mirror correction: move each command in the opposite direction until the predicted tool lies where it is wanted.

    x_cmd <- x_cmd (-) (x_real(x_cmd) (-) x_goal)      on SE(3), position and orientation apart

x_real(x_cmd) = FK_actual(equilibrium of q = IK_nominal(x_cmd) under the wrench).  One step brings the error down by
the relative change of the deflection over the deflection itself, 2e-3 to 3e-3 on a large arm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Poses, lengths, product, rotation_from_vector, turn_between
from postproc.compensation.load_case import LoadCase
from postproc.model import StiffnessModel
from postproc.robot.inverse import Inverse, inverse

POSITION_TOLERANCE = 1e-8
"""[m] predicted error at which a motion is done: far below what any program's digits can express."""

ANGLE_TOLERANCE = 1e-8
"""[rad]"""

REST = 2e-10
"""[rad, m] What may remain of the displacement to an equilibrium: less than a nanometre at the tool."""

MAX_ITERATIONS = 20


@dataclass(frozen=True)
class Prediction:
    """Where the tool really is: ``pose`` of the TCP in the robot base, ``q`` (N, n) motors [rad, m]; ``displacement``
    (N, m) [rad, m] of the coordinates by load; ``reachable`` and ``settled`` (N,): the command is in reach, and the
    deflected robot found a stable rest."""

    pose: Poses
    q: Floats
    displacement: Floats
    reachable: Bools
    settled: Bools


def predict(
    model: StiffnessModel,
    command: Poses,
    case: LoadCase,
    start: Floats | None = None,
    q: Floats | None = None,
) -> Prediction:
    """The tool's pose when the controller is sent to ``command`` (N TCP poses in the robot base) in the load case
    ``case`` (N).

    ``start`` (N, m): the displacement of a state nearby, to start the equilibrium with; ``q`` (N, 6): motor angles at
    ``command``, where they are known.
    """
    if q is not None:
        solution = Inverse(q, np.asarray(np.isfinite(q).all(axis=1)))
    else:
        solution = inverse(model.robot.nominal, command @ case.tool.inverse(), case.branch, case.q_reference)
    rest = model.equilibrium(solution.q, case.wrench, case.tool, case.conditions, start, REST)
    return Prediction(rest.pose, solution.q, rest.displacement, solution.reachable, rest.converged)


@dataclass(frozen=True)
class Correction:
    """Result of the mirror iteration for N motions.

    command: TCP commands in the robot base; q (N, 6): their motor angles; history (K + 1, N) [m]: predicted position
    error before and after each iteration, NaN once a motion is done; error (N,) [m] and angle (N,) [rad]: the last of
    them; turn (N, 3) [rad]: that angle as a rotation vector, base axes, with what cannot be corrected; iterations (N,)
    used; reachable, settled, converged (N,).
    """

    command: Poses
    q: Floats
    history: Floats
    error: Floats
    angle: Floats
    turn: Floats
    iterations: Ints
    reachable: Bools
    settled: Bools
    converged: Bools


def mirror(
    model: StiffnessModel,
    wanted: Poses,
    goal: Poses,
    case: LoadCase,
    orientation_projection: Floats | None = None,
    guess: tuple[Poses, Floats] | None = None,
) -> Correction:
    """Correct N commands that start at ``wanted`` so that the predicted tool comes to ``goal`` in the load case
    ``case`` (N).

    ``orientation_projection`` (N, 3, 3): projection onto the rotation vectors that can be corrected (all of them
    without it); nothing else of the orientation is corrected, nor judged.  ``guess``: commands to start with instead of
    ``wanted``, turned from it as far as can be corrected, and displacements (N, m) [rad, m] to start their equilibria
    with; the result does not depend on them.

    A motion stops when it is within tolerance, out of reach, without equilibrium, or when an iteration does not at
    least halve its error (it would not settle): ``converged`` states which, nothing diverges silently.
    """
    n = len(wanted)
    first, displacement = (wanted, None) if guess is None else guess
    rotation, position = first.rotation.copy(), first.position.copy()
    if guess is not None and orientation_projection is not None:
        rotation = _turned_as_possible(wanted.rotation, rotation, orientation_projection)
    q, iterations = case.q_reference.copy(), np.zeros(n, np.int64)
    reachable, settled, converged = np.ones(n, bool), np.ones(n, bool), np.zeros(n, bool)
    history: list[Floats] = []
    last = np.full(n, np.inf)
    final, final_turn = np.full((2, n), np.nan), np.full((n, 3), np.nan)
    active = np.arange(n)
    for iteration in range(MAX_ITERATIONS + 1):
        some: Any = active if len(active) < n else slice(None)  # mostly all of them: nothing is copied
        here = predict(model, Poses(rotation[some], position[some]), case.part(some), displacement)
        shift, turn = pose_error(here.pose, goal[some])
        final_turn[some] = turn
        if orientation_projection is not None:
            turn = (orientation_projection[some] @ turn[..., None])[..., 0]
        error, angle = lengths(shift), lengths(turn)
        good = here.reachable & here.settled
        q[some], reachable[some], settled[some] = here.q, here.reachable, here.settled | ~here.reachable
        record = np.full(n, np.nan)
        record[some] = error
        history.append(record)
        final[:, some] = error, angle
        iterations[some] = iteration
        done = good & (error <= POSITION_TOLERANCE) & (angle <= ANGLE_TOLERANCE)
        converged[active[done]] = True
        size = error + angle  # 1 rad weighs as 1 m: both go down together
        going = good & ~done & (size < 0.5 * last[some])
        last[some] = size
        if not going.any() or iteration == MAX_ITERATIONS:
            break
        displacement = here.displacement
        if not going.all():
            active, some, displacement, shift, turn = (
                active[going],
                active[going],
                displacement[going],
                shift[going],
                turn[going],
            )
        position[some] -= shift
        rotation[some] = product(rotation_from_vector(-turn), rotation[some])
    return Correction(
        Poses(rotation, position),
        q,
        np.array(history),
        final[0],
        final[1],
        final_turn,
        iterations,
        reachable,
        settled,
        converged,
    )


def _turned_as_possible(wanted: Floats, guess: Floats, projection: Floats) -> Floats:
    """``wanted`` (N, 3, 3), turned to ``guess`` (N, 3, 3) by what the projections (N, 3, 3) leave of that turn."""
    if not projection.any():
        return wanted.copy()
    turn = (projection @ turn_between(wanted, guess)[..., None])[..., 0]
    return product(rotation_from_vector(turn), wanted)


def initial_guess(
    model: StiffnessModel,
    wanted: Poses,
    goal: Poses,
    case: LoadCase,
    farthest: float,
    q: Floats | None = None,
) -> tuple[Poses, Floats]:
    """What ``mirror`` can start with: commands whose loaded joints are where the goal is, and how far they are
    deflected there (N, m) [rad, m], in the load case ``case`` (N); the wanted pose where that is out of reach, or more
    than ``farthest`` [m] away.  ``q`` (N, n) [rad, m]: motors at the goal, where they are known."""
    if q is None:
        q = inverse(model.robot.nominal, goal @ case.tool.inverse(), case.branch, case.q_reference).q
    known = np.asarray(np.isfinite(q).all(axis=1))
    joints = q if known.all() else np.where(known[:, None], q, case.q_reference)
    motors, displacement = model.inverse_equilibrium(joints, case.wrench, case.tool, case.conditions)
    start = model.robot.nominal_chain.flange(motors) @ case.tool
    good = (
        known
        & (lengths(start.position - wanted.position) <= farthest)
        & np.isfinite(displacement).all(axis=1)
    )
    if good.all():
        return start, displacement
    return Poses(
        np.where(good[:, None, None], start.rotation, wanted.rotation),
        np.where(good[:, None], start.position, wanted.position),
    ), np.where(good[:, None], displacement, 0.0)


def pose_error(real: Poses, goal: Poses) -> tuple[Floats, Floats]:
    """real (-) goal: position difference (N, 3) [m] and rotation vector (N, 3) [rad], both in base axes."""
    return real.position - goal.position, turn_between(goal.rotation, real.rotation)


def interpolate_pose(wanted: Poses, command: Poses, gain: float | Floats) -> Poses:
    """The share ``gain`` (0..1; one for all, or (N, 1)) of the displacement from ``wanted`` to ``command``."""
    if isinstance(gain, float) and gain == 1.0:
        return command
    shift, turn = pose_error(command, wanted)
    turned = product(rotation_from_vector(gain * turn), wanted.rotation)
    return Poses(turned, wanted.position + gain * shift)
