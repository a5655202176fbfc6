"""Where an axis turns round inside of a motion, and a correction needs points of its own: there its motor crosses the
gap while the tool goes on."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.compensation.lost_motion import ROOM
from postproc.compensation.problem import CompensationProblem

NEARLY = 1e-9
"""Share of a spacing by which digits may be elsewhere."""


def find_reversals(task: CompensationProblem, spacing: Floats, room: float = ROOM) -> tuple[Ints, Floats]:
    """Motions (K,), in order, and the shares (K,) of their paths at which a reversal starts and ends that shows by more
    than ``room`` of the tolerance at the tool.  At the first place the correction still is that of the side before, at
    the second that of the side after; between them it is to run straight.

    ``spacing`` (N,) [m]: places that are nearer to each other, or to an end of their motion, are left out; but where a
    reversal ends sooner after the start of a motion, or starts later before its end, the place is as near as it may be:
    behind it the correction runs straight.  Rounding is no reversal.
    """
    none = np.empty(0, np.int64), np.empty(0)
    if task.lost_motion is None:
        return none
    turns = task.lost_motion.wanted
    shown = np.flatnonzero(np.abs(turns.new - turns.old) * _shows(task, turns.axis, turns.since) > room)
    position = np.concatenate([turns.since[shown], turns.until[shown]])
    order = np.argsort(position, kind="stable")
    position, ends = position[order], (np.arange(len(position)) >= len(shown))[order]
    rows, along = turns.line.place(position)
    length = task.desired_path.length[rows]
    least = np.minimum((1.0 + NEARLY) * spacing[rows] / np.maximum(length, NEARLY * spacing[rows]), 0.5)
    nearest = np.where(ends, np.maximum(along, least), np.minimum(along, 1.0 - least))
    within = np.where(ends, along > 0.0, along < 1.0)
    position, along = (
        position + np.where(within, nearest - along, 0.0) * length,
        np.where(within, nearest, along),
    )
    inside = task.desired_path.traceable[rows] & (np.minimum(along, 1.0 - along) * length >= spacing[rows])
    position, rows, along = position[inside], rows[inside], along[inside]
    keep = np.ones(len(rows), bool)
    last = -np.inf
    for i, (place, least) in enumerate(zip(position.tolist(), spacing[rows].tolist(), strict=True)):
        keep[i] = place - last >= least * (1 - 1e-6)
        last = place if keep[i] else last
    return rows[keep], along[keep]


def _shows(task: CompensationProblem, axis: Ints, position: Floats) -> Floats:
    """(T,) what half the gap of the axes ``axis`` (T,) moves the tool by at places on the line, over the tolerance."""
    assert task.lost_motion is not None
    rows, _ = task.lost_motion.wanted.line.place(position)
    q = task.track.q[rows]
    chain = task.model.robot.nominal_chain
    known = np.asarray(np.isfinite(q).all(axis=1))
    column = chain.jacobian(np.where(known[:, None], q, 0.0), task.tool[rows])[:, :3, chain.motor_rows]
    lever = np.linalg.norm(column, axis=1)[np.arange(len(rows)), axis]
    return np.asarray(np.where(known, 0.5 * task.lost_motion.gap[axis] * lever / task.tolerance, 0.0))
