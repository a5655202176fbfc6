"""Transition moves and lead-ins where the correction steps at the start of a cut."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.batches import each_block, in_blocks
from postproc.base.geometry import Poses, lengths, turn_between
from postproc.compensation.correct import MotionOutcome
from postproc.compensation.cuts import feed_motions
from postproc.compensation.divisible_motions import (
    ROOM,
    SAME,
    STEP,
    DivisibleMotions,
)
from postproc.robot.half_turns import HALF
from postproc.toolpath import Kind


def add_transitions(motions: DivisibleMotions) -> None:
    """Where the correction steps at the start of a motion under force, the motion in air before it ends where its
    own correction starts, or a transition move leads there."""
    task, rows, corrected = motions.task, motions.rows, motions.full.corrected
    other = np.flatnonzero(
        np.concatenate([rows[:0] > 0, *in_blocks(lambda part: task.steps(rows[part], corrected), len(rows))])
    )
    motions.starts = Poses(np.empty((len(other), 3, 3)), np.empty((len(other), 3)))
    motions.start_at[other] = np.arange(len(other))

    def stepped(part: slice) -> None:
        at = rows[other[part]]
        own = motions.commands(at, np.zeros(len(at)), "where this motion starts")
        shift, turn = task.pose_errors(at, own, motions.entry[at])
        motions.starts.put(part, own)
        motions.step[other[part]] = np.maximum(
            np.linalg.norm(shift, axis=1) / task.tolerance,
            np.linalg.norm(turn, axis=1) / task.tolerance_angle,
        )

    each_block(stepped, len(other))
    carries = task.carries[rows]
    motions.needs_transition = carries & (motions.step > ROOM)
    some = np.flatnonzero(carries & (motions.step > STEP) & ~motions.needs_transition & ~motions.spline)
    if len(some):
        motions.needs_transition[some[motions.largest_errors(some, motions.least_segments()[some]) > 1.0]] = (
            True
        )
    entered = np.flatnonzero(motions.needs_transition)
    motions.has_lead_in[entered] = _can_lead(motions, rows[entered]) & _turns_alike(motions, entered)
    # before a spline block a transition move may be, though nothing else may be inserted before its points
    enters = np.isin(rows, list(task.toolpath.constraints.spline_headers)) & (not motions.limits.no_insert)
    motions.needs_transition &= ~motions.has_lead_in & (motions.free[rows] | enters)
    _return_by_transition(motions)


def _can_lead(motions: DivisibleMotions, rows: Ints) -> Bools:
    """(K,) whether the motion before each of ``rows`` (K,) is one in air at feed, straight and of known end, whose
    text can state where the cut starts corrected."""
    path, before = motions.task.toolpath, np.maximum(rows - 1, 0)
    can = (
        (rows > 0)
        & (path.kind[before] == Kind.LIN)
        & path.known[before]
        & path.continues[before]
        & path.continues[rows]
    )
    # without a force it may be corrected for what the robot does by itself
    in_air = (MotionOutcome.AIR,) if motions.task.process else (MotionOutcome.AIR, MotionOutcome.CORRECTED)
    can &= np.isin(motions.full.state[before], in_air) & ~motions.task.carries[before]
    can &= feed_motions(path)[before] & (motions.task.track.branch[before] >= 0)
    can &= (path.tool[before] == path.tool[rows]) & (
        path.constraints.orientation_programmed[before] == path.constraints.orientation_programmed[rows]
    )
    free = path.orientation_control.redundant_axis
    can &= np.isclose(free[before], free[rows], atol=1e-9, equal_nan=True).all(axis=1)
    fixed = np.zeros(motions.n, bool)
    fixed[[*path.constraints.refused, *path.constraints.locked]] = True
    return np.asarray(can & ~fixed[before])


def _turns_alike(motions: DivisibleMotions, entered: Ints) -> Bools:
    """(K,) whether the motion before each of the places ``entered`` (K,) still turns in the same sense where it ends at
    the corrected start: of half a turn the sense may be the other one then."""
    alike, before, half = (
        np.ones(len(entered), bool),
        motions.rows[entered] - 1,
        motions.task.track.half_turns,
    )
    at = np.flatnonzero(np.isin(before, half.rows))
    if len(at):
        start = motions.task.desired_path.start[before[at]].rotation
        turn = turn_between(start, motions.starts[motions.start_at[entered[at]]].rotation)
        expected = half.vector[np.searchsorted(half.rows, before[at])]
        alike[at] = (np.sum(turn * expected, axis=1) > 0) & (lengths(turn) < np.pi - HALF)
    return alike


def _return_by_transition(motions: DivisibleMotions) -> None:
    """An arc that is not corrected starts where it was programmed, even if the motion before it ends elsewhere."""
    path, full, desired_path = motions.task.toolpath, motions.full, motions.task.desired_path
    arcs = np.flatnonzero((path.kind == Kind.CIRC) & ~full.corrected)
    arcs = arcs[arcs > 0]
    arcs = arcs[full.corrected[arcs - 1]]
    away = np.linalg.norm(motions.entry[arcs].position - desired_path.start[arcs].position, axis=1)
    arcs = arcs[away > SAME]
    motions.returns[arcs[motions.free[arcs]]] = True
    motions.leave_undivided(
        arcs[~motions.free[arcs]] - 1, "COR013", "an uncorrected arc starts where this motion ends"
    )
