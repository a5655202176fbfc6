"""Where the force steps inside a cut it is given a ramp, on which the correction can follow it without going back.

Which force acts: that of the place s of the program's path to which the deflected tool x is nearest, where the tangent
t(s) is square to x - g(s).  With a command c that is (x(c, F(s)) - g(s)) . t(s) = 0, solved for s.  On a ramp the
displacement itself goes along the feed by k m per m, so that s follows from the command by 1 / (1 - k): the steeper the
ramp, the more a small difference of its length moves the place.  The length of a ramp is therefore part of the
definition of the force.  It follows from the correction at the vertex, the command that has the deflected tool there
under the force before and after; a displacement taken at the programmed pose instead is another one by what the
stiffness changes between the two, and a ramp of k = 0.9 that is 0.016 mm longer has its places 0.16 mm apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import each_block
from postproc.compensation.problem import CompensationProblem
from postproc.process.force_ramps import Ramps

ASSUMED = 5e-3
"""[m] Length of a ramp where neither the cell nor the process states it or the cutter's radius."""

SHORTEST = 1e-4
"""[m] A ramp is no shorter."""

SAME = 1e-9
"""Share of the largest force: what changes by less goes on."""

STEEPEST = 0.9
"""By how much a correction may go back along the feed on a ramp, m per m of path: no motion on it leads backwards."""


EarlyShares = Callable[[Ints, Floats], Floats]
"""Of motions (K,) at whose start the correction steps by (K, 3) [m]: the shares (K,) of it that go over before."""


def add_force_ramps(
    task: CompensationProblem, ramp: Floats | float, early: EarlyShares | None = None
) -> CompensationProblem:
    """The task, in which no force steps inside a cut: each step that is not measured goes over along ``ramp`` (N,) [m]
    of the path after it, or along as much more as a correction needs that goes back along the feed (``STEEPEST``);
    the shares ``early`` of it along as much of the path before."""
    if task.force.measured:
        return task
    task = _limit_profiles(task)
    rows = task.force.inner_steps
    known = task.desired_path.traceable[rows] & task.toolpath.known[rows - 1]
    known &= (task.track.branch[rows] >= 0) & task.track.reachable[rows] & task.track.reachable[rows - 1]
    known &= task.toolpath.tool[rows] == task.toolpath.tool[rows - 1]
    away = np.abs(task.force.start[rows] - task.force.values[rows - 1]).max(axis=1, initial=0.0)
    rows = rows[known & (away > SAME * max(1.0, task.force.max_force))]
    if not len(rows):
        return task
    change = np.nan_to_num(correction_steps(task, rows))
    sooner = np.zeros(len(rows)) if early is None else early(rows, change)
    tangents = (
        task.desired_path.tangent(rows, np.zeros(len(rows))),
        task.desired_path.tangent(rows - 1, np.ones(len(rows))),
    )
    back = -np.minimum(
        *(
            share * np.nan_to_num(np.sum(change * tangent, axis=1))
            for share, tangent in zip((1.0 - sooner, sooner), tangents, strict=True)
        )
    )
    asked = np.broadcast_to(ramp, (len(task.toolpath),))[rows]
    length = np.maximum(np.maximum(asked, SHORTEST), back / STEEPEST)
    desired_path = task.desired_path
    task = replace(
        task, force=task.force.ramped(rows, length, desired_path.length, sooner), ramp=float(asked.min())
    )
    vars(task)["desired_path"] = desired_path  # forces change no path
    return task


def _limit_profiles(task: CompensationProblem) -> CompensationProblem:
    """The task, in which no correction goes back along the feed by more than ``STEEPEST`` where the force changes
    inside of a motion: of a part that is steeper one of its two places is left out, and the change takes longer."""
    profiles = task.force.ramps
    if profiles is None:
        return task
    row, share, rest = profiles.places()
    ahead = np.empty(len(row))

    def look(part: slice) -> None:
        at, place = row[part], share[part]
        wanted = task.desired_path.at(at, place)
        made = task.command(at, wanted, task.force.along(at, place), task.goal(at, wanted, place))
        shift = made.command.position - wanted.position
        ahead[part] = np.nan_to_num(np.sum(shift * task.desired_path.tangent(at, place), axis=1))

    each_block(look, len(row))
    length = task.desired_path.length
    kept = np.arange(len(row))
    while True:
        here = row[kept]
        gain = np.diff(ahead[kept]) + STEEPEST * length[here[1:]] * np.diff(share[kept])
        steep = np.flatnonzero((here[1:] == here[:-1]) & (gain < -SAME))
        # the place after the part, but the end of a motion stays
        out = np.where(share[kept[steep + 1]] < 1.0, steep + 1, steep)
        out = out[share[kept[out]] > 0.0]
        if not len(out):
            break
        kept = np.delete(kept, out)
    if len(kept) == len(row):
        return task
    ramps = Ramps.profile(row[kept], share[kept], rest[kept], length)
    desired_path = task.desired_path
    task = replace(task, force=replace(task.force, ramps=ramps))
    vars(task)["desired_path"] = desired_path
    return task


def correction_steps(task: CompensationProblem, rows: Ints) -> Floats:
    """(K, 3) [m] by how much the correction would step where the motions ``rows`` (K,) start: that under the force with
    which they start, less that under the force with which the motion before them ends."""
    steps = np.empty((len(rows), 3))

    def stepped(part: slice) -> None:
        at = rows[part]
        wanted = task.desired_path.at(at, np.zeros(len(at)))
        goal = task.goal(at, wanted)
        new, old = (
            task.command(at, wanted, wrench, goal).command.position
            for wrench in (task.force.start[at], task.force.values[at - 1])
        )
        steps[part] = new - old

    each_block(stepped, len(rows))
    return steps
