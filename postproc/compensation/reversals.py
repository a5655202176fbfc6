"""Where an axis turns round inside of a motion, and a correction needs points of its own: there its motor crosses the
gap while the tool goes on."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.compensation.lost_motion import ROOM
from postproc.compensation.problem import CompensationProblem


def find_reversals(task: CompensationProblem, spacing: Floats, room: float = ROOM) -> tuple[Ints, Floats]:
    """Motions (K,), in order, and the shares (K,) of their paths at which a reversal starts and ends that shows by more
    than ``room`` of the tolerance at the tool.  At the first place the correction still is that of the side before, at
    the second that of the side after; between them it is to run straight.

    ``spacing`` (N,) [m]: places that are nearer to each other, or to an end of their motion, are left out.  Rounding is
    no reversal, nor is one between two motions: the target there is a point anyway.
    """
    none = np.empty(0, np.int64), np.empty(0)
    if task.lost_motion is None:
        return none
    turns = task.lost_motion.wanted
    shown = np.flatnonzero(np.abs(turns.new - turns.old) * _shows(task, turns.axis, turns.since) > room)
    position = np.sort(np.concatenate([turns.since[shown], turns.until[shown]]))
    rows, along = turns.line.place(position)
    length = task.desired_path.length[rows]
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
