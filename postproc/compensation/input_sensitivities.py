"""Derivatives of the predicted error with respect to the uncertain inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import predict
from postproc.compensation.problem import CompensationProblem, rotate_wrench
from postproc.compensation.uncertain_inputs import COMPONENTS, FORCE, TURNS, UncertainInput
from postproc.effects import Conditions
from postproc.model import NOTHING, StiffnessModel


def _changed_wrench(entry: UncertainInput, value: float, wrench: Floats, axes: Floats | None) -> Floats:
    """The wrenches (N, 6) with one figure of the force at ``value``; ``axes`` (N, 3, 3): of the programmed base.

    A turn does not change the moment, which acts at the tool centre point.  Where no wrench acts none is added.
    """
    if entry.parameter == FORCE:
        return value * wrench
    assert axes is not None
    changed = wrench.copy()
    if entry.parameter in TURNS:
        axis = _across(wrench[:, :3], axes)[TURNS.index(entry.parameter)]
        changed[:, :3] = np.einsum("nij,nj->ni", rotation_from_vector(value * axis), wrench[:, :3])
    else:
        acts = wrench.any(axis=1)
        changed[acts, :3] += value * axes[acts, :, COMPONENTS.index(entry.parameter)]
    return changed


def _across(force: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (N, 3) across each force (N, 3) and each other, zero without a force.

    The second lies in the plane of the force and z of the programmed base ``axes`` (N, 3, 3), of x where the force
    points along z: a turn about it swings the force sideways, a turn about the first lifts it.
    """
    size = np.linalg.norm(force, axis=1, keepdims=True)
    unit = force / np.where(size > 0, size, 1.0)
    along_z = np.abs(np.sum(unit * axes[:, :, 2], axis=1)) > 0.99
    reference = np.where(along_z[:, None], axes[:, :, 0], axes[:, :, 2])
    second = reference - np.sum(reference * unit, axis=1, keepdims=True) * unit
    second = np.where(size > 0, second / np.linalg.norm(second, axis=1, keepdims=True), 0.0)
    return np.cross(unit, second), second


def sensitivities(
    model: StiffnessModel,
    entries: Sequence[UncertainInput],
    q: Floats,
    wrench: Floats,
    tool: Poses,
    conditions: Conditions = NOTHING,
    start: Floats | None = None,
    axes: Floats | None = None,
) -> Floats:
    """d(tool position)/d(figure) (N, 3, P) [m per SI unit] with the motors fixed at ``q`` (N, n) under ``wrench``
    (N, 6); ``start`` as of the equilibrium; ``axes`` (N, 3, 3) of the programmed base, for directions and components of
    the force.

    Central differences that stop at a parameter's bounds.  NaN where a stepped model has no equilibrium.
    """
    derivatives = np.zeros((len(q), 3, len(entries)))
    for column, entry in enumerate(entries):
        low = max(entry.value - entry.step, entry.lower)
        high = min(entry.value + entry.step, entry.upper)
        if not low < high:
            continue
        ends = []
        for value in (low, high):
            if entry.term < 0:
                acting = _changed_wrench(entry, value, wrench, axes)
                rest = model.equilibrium(q, acting, tool, conditions, start)
            else:
                stepped = model.with_values({(entry.term, entry.parameter): value})
                rest = stepped.equilibrium(q, wrench, tool, conditions, start)
            ends.append(np.where(rest.converged[:, None], rest.pose.position, np.nan))
        derivatives[:, :, column] = (ends[1] - ends[0]) / (high - low)
    return derivatives


def error_sensitivities(
    task: CompensationProblem,
    entries: Sequence[UncertainInput],
    rows: Ints,
    command: Poses,
    corrected: bool = False,
) -> tuple[Floats, Floats]:
    """The error (N, 3) [m] of ``rows`` with the controller sent to ``command``, and its sensitivities S (N, 3, P);
    ``corrected`` as of ``CompensationProblem.conditions_at``."""
    model, tool, wrench = task.model, task.tool[rows], task.wrench[rows]
    wanted, placed = task.wanted[rows], task.robot_from_path(rows)
    axes = task.base[rows].rotation
    if placed is not None:
        command, wrench = placed @ command, rotate_wrench(placed, wrench)
        axes = placed.rotation @ axes
    given = task.conditions_at(rows, corrected=corrected)
    here = predict(model, command, LoadCase(tool, wrench, given, task.track.branch[rows], task.track.q[rows]))
    moves = sensitivities(model, entries, here.q, wrench, tool, given, here.displacement, axes)
    moves -= goal_sensitivities(task, entries, rows, wanted)
    goal = task.goal(rows, wanted)
    return here.pose.position - (goal if placed is None else placed @ goal).position, moves


def goal_sensitivities(
    task: CompensationProblem, entries: Sequence[UncertainInput], rows: Ints, wanted: Poses
) -> Floats:
    """d(goal position)/d(figure) (N, 3, P) of motions ``rows`` (N,) with targets ``wanted`` (N): a base that was
    touched off moves with what the robot does without load."""
    touched = task.touched_off
    derivatives = np.zeros((len(rows), 3, len(entries)))
    if task.model.zero_without_load or (not task.process and touched is None):
        return derivatives
    still = np.arange(len(rows))
    if touched is not None and not task.process:
        frame = task.toolpath.base[rows]
        still = np.flatnonzero(~touched.known[frame])
        none = np.zeros((len(touched.row), 6))
        places = sensitivities(
            task.model,
            entries,
            touched.real.q,
            none,
            touched.tool,
            touched.conditions,
            touched.real.displacement,
            task.base[touched.row].rotation,
        )
        derivatives = touched.sensitivity(places, frame, wanted.position)
    if len(still):
        at, none = rows[still], np.zeros((len(still), 6))
        here, placed = task.unloaded(at, wanted[still]), task.robot_from_path(at)
        axes = task.base[at].rotation
        derivatives[still] = sensitivities(
            task.model,
            entries,
            here.q,
            none,
            task.tool[at],
            task.between_sides(at),
            here.displacement,
            axes if placed is None else placed.rotation @ axes,
        )
    return derivatives
