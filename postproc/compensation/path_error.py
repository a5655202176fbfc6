"""How far the tool is from the wanted path between the points that a controller is sent to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import (
    Poses,
    arc_in_plane,
    arc_through,
    lengths,
    on_arc,
    product,
    turn_beside,
    turning,
)
from postproc.base.units import DEG, MM
from postproc.compensation.desired_path import interpolate_poses
from postproc.compensation.mirror import pose_error
from postproc.compensation.orientations import MotionParts
from postproc.compensation.problem import CompensationProblem

SHARES = (0.25, 0.5, 0.75)
"""Where the path between two points is evaluated; an error that grows from both of them is largest in the middle."""

ON_RAMPS = (0.125, 0.375, 0.625, 0.875)
"""And where besides on motions on which a ramp of the force lies: there it is largest anywhere."""

SHORT, LITTLE = 30 * MM, 3 * DEG
"""Of a segment that is shorter and turns by less, along an arc or in place, the middle is enough."""

SECANTS, FLATTEST, SAME_PLACE = 6, 0.05, 1e-7
"""Steps to the place whose force a tool has, the least share of its way on the path that it goes under load, and [m]
a step that is none."""

TURNED = 0.02
"""Share of the tolerance: a turn of the wanted orientation, where the tool is early or late, that is not looked at."""


@dataclass(frozen=True)
class PathSegments:
    """K segments of paths, as a controller makes them.

    rows (K,): the motion each belongs to; first, last (K,): the shares of its path where the segment starts and ends;
    start, end: TCP commands in the robot base; centre, normal (K, 3), sweep (K,): of arcs, NaN for straight segments.
    """

    rows: Ints
    first: Floats
    last: Floats
    start: Poses
    end: Poses
    centre: Floats
    normal: Floats
    sweep: Floats

    @staticmethod
    def straight(rows: Ints, first: Floats, last: Floats, start: Poses, end: Poses) -> PathSegments:
        """Straight segments of motions ``rows`` (K,) from the shares ``first`` to ``last`` (K,)."""
        none = np.full((len(rows), 3), np.nan)
        return PathSegments(rows, first, last, start, end, none, none, np.full(len(rows), np.nan))

    @staticmethod
    def round(
        rows: Ints, first: Floats, last: Floats, start: Poses, via: Poses, end: Poses, normal: Floats
    ) -> PathSegments:
        """Arcs through ``via``, of motions ``rows`` (K,) from the shares ``first`` to ``last`` (K,); about ``normal``
        (K, 3), with what remains along it in proportion, or where that is NaN in the plane of the three points."""
        points = start.position, via.position, end.position
        axis = np.where(np.isnan(normal), arc_through(*points)[1], normal)
        return PathSegments(rows, first, last, start, end, *arc_in_plane(*points, axis))

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, chosen: Ints) -> PathSegments:
        return PathSegments(
            self.rows[chosen],
            self.first[chosen],
            self.last[chosen],
            self.start[chosen],
            self.end[chosen],
            self.centre[chosen],
            self.normal[chosen],
            self.sweep[chosen],
        )

    @property
    def parts(self) -> MotionParts:
        """The parts of motions that the segments replace."""
        return MotionParts(self.rows, self.first, self.last, self.start.rotation, self.end.rotation)

    def along(self, share: Floats) -> Floats:
        """(K,) the shares of the paths of the motions at the shares (K,) of the segments."""
        return np.asarray(self.first + share * (self.last - self.first))

    def commands(self, task: CompensationProblem, share: Floats) -> Poses:
        """Commands (K) at the shares (K,) of the segments, with the orientations that the controller makes."""
        commands = self.at(share, task.toolpath.arcs.turns_along[self.rows])
        task.desired_path.turn(self.parts, share, commands)
        return commands

    def at(self, share: Floats, along: Bools | None = None) -> Poses:
        """Commands (K) at the shares (K,) of the segments; ``along`` (K,): arcs with which the tool turns."""
        commands = interpolate_poses(self.start, self.end, share)
        arcs = np.flatnonzero(np.isfinite(self.sweep))
        turns = arcs[:0] if along is None else arcs[along[arcs]]
        if len(turns):
            start, end = self.start.rotation[turns], self.end.rotation[turns]
            arc = self.sweep[turns, None] * self.normal[turns]
            commands.rotation[turns] = turning(start, turn_beside(start, end, arc), arc, share[turns])
        if len(arcs):
            commands.position[arcs] = on_arc(
                self.start.position[arcs],
                self.end.position[arcs],
                self.centre[arcs],
                self.normal[arcs],
                self.sweep[arcs],
                share[arcs],
            )
        return commands


def programmed(task: CompensationProblem, rows: Ints) -> PathSegments:
    """The motions ``rows`` (K,), whose paths are known, as the program has them."""
    desired_path = task.desired_path
    centre, normal, sweep = desired_path.circles(rows)
    none = np.zeros(len(rows))
    return PathSegments(
        rows, none, none + 1.0, desired_path.start[rows], task.wanted[rows], centre, normal, sweep
    )


def path_errors(
    task: CompensationProblem,
    segments: PathSegments,
    from_start: Bools | None = None,
    uncorrected_share: float = 0.0,
    shown: bool = False,
) -> tuple[Floats, Floats]:
    """Largest distance (K,) [m] of the predicted tool from the wanted path, and largest angle (K,) [rad] from the
    wanted orientation, inside of each segment; infinite where the robot cannot be there.

    Along the path the tool may be early or late: only what it is off the path counts.  ``from_start`` (K,): segments
    that are evaluated where they start as well (another ended there in its own place).  ``uncorrected_share``: the
    share of the error without a correction that is meant to stay, and is none.  ``shown``: all of the angle that shows
    on the part; else only what further points would take away.
    """
    length = lengths(segments.end.position - segments.start.position)
    _, turn = pose_error(segments.end, segments.start)
    long = (length > SHORT) | (lengths(turn) > LITTLE) | (segments.sweep > LITTLE)
    if task.external is not None:
        long |= task.external.moves(segments.rows)
    off, angle = np.zeros(len(segments)), np.zeros(len(segments))
    ramps = task.force.ramps
    ramped = np.zeros(len(segments), bool) if ramps is None else np.isin(segments.rows, ramps.row)
    for share in (*SHARES, *ON_RAMPS) if ramped.any() else SHARES:
        chosen = np.flatnonzero(ramped | (long & (share in SHARES)) | (share == 0.5))
        if len(chosen):
            here = _errors(
                task,
                segments if len(chosen) == len(segments) else segments[chosen],
                share,
                uncorrected_share,
                shown,
            )
            off[chosen] = np.maximum(off[chosen], here[0])
            angle[chosen] = np.maximum(angle[chosen], here[1])
    if from_start is not None and from_start.any():
        chosen = np.flatnonzero(from_start)
        here = _errors(task, segments[chosen], 0.0, uncorrected_share, shown)
        off[chosen], angle[chosen] = np.maximum(off[chosen], here[0]), np.maximum(angle[chosen], here[1])
    return off, angle


def path_errors_at(task: CompensationProblem, segments: PathSegments, share: Floats) -> tuple[Floats, Floats]:
    """Errors (K,) [m] and (K,) [rad] as of ``path_errors``, at the shares (K,) of the motions that the segments belong
    to, which lie on them."""
    return _errors(task, segments, (share - segments.first) / (segments.last - segments.first), 0.0, False)


def _errors(
    task: CompensationProblem,
    segments: PathSegments,
    share: float | Floats,
    uncorrected_share: float,
    shown: bool,
) -> tuple[Floats, Floats]:
    """As ``path_errors``, at one share of each segment."""
    rows, shares = segments.rows, np.broadcast_to(share, len(segments))
    along = segments.along(shares)
    wanted = task.desired_path.at(rows, along)
    command = segments.commands(task, shares)
    wrench = task.force.along(rows, _places(task, rows, along, command))
    real = task.simulated(rows, command, wrench, share=along, corrected=True)
    goal = task.goal(rows, wanted, along)
    shift, turn = _beside(task, rows, along, real.pose, wanted, goal, shown)
    if uncorrected_share:
        without = task.simulated(rows, wanted, wrench, share=along).pose
        parts = _beside(task, rows, along, without, wanted, goal, shown)
        shift, turn = shift - uncorrected_share * parts[0], turn - uncorrected_share * parts[1]
    if not shown:
        turn = task.correctable(rows, along, command, turn)
    good = real.reachable & real.settled
    off, angle = (np.where(good, lengths(part), np.inf) for part in (shift, turn))
    return off, angle


def _places(task: CompensationProblem, rows: Ints, share: Floats, command: Poses) -> Floats:
    """(K,) the shares of the places whose force the tools at ``command`` (K) have: those of ``rows`` (K,) that they are
    nearest to.  On ramps of the force that is another place than ``share`` (K,); looked for by secants where it is not
    known how corners are rounded off: elsewhere the rounded path is evaluated as a whole."""
    if task.force.ramps is None:
        return share
    unknown = np.isnan(task.toolpath.approximation[rows])
    some = np.flatnonzero(
        unknown & np.isin(rows, task.force.ramps.row) & (task.desired_path.length[rows] > 0)
    )
    if not len(some):
        return share
    row, there = rows[some], command[some]
    length = task.desired_path.length[row]
    at = share[some].copy()
    last, moved = np.full(len(some), np.nan), np.full(len(some), np.nan)
    found = share.copy()
    for _ in range(SECANTS):
        real = task.simulated(row, there, task.force.along(row, at), share=at, corrected=True)
        goal = task.goal(row, task.desired_path.at(row, at), at)
        ahead = np.sum((real.pose.position - goal.position) * task.desired_path.tangent(row, at), axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = (last - ahead) / moved
        slope = np.where(np.isfinite(slope), np.clip(slope, FLATTEST, 1.0 / FLATTEST), 1.0)
        step = np.where(real.settled & real.reachable, ahead / slope, 0.0)
        if not (np.abs(step) > SAME_PLACE).any():
            return found
        last, moved = ahead, step
        at = np.clip(at + step / length, 0.0, 1.0)
        found[some] = at
    return found


def _beside(
    task: CompensationProblem, rows: Ints, share: Floats, real: Poses, wanted: Poses, goal: Poses, shown: bool
) -> tuple[Floats, Floats]:
    """How far the tools ``real`` (K) are beside the wanted path (K, 3) [m], and how they are turned (K, 3) [rad]
    against what is wanted at the place of it that they are nearest to.

    A tool that is early by ds where the wanted orientation R(s) turns is compared with R(s + ds), not against ``goal``
    (K), which belongs to ``wanted`` (K) at the shares (K,) of the paths of ``rows`` (K,).
    """
    desired_path, tangent = task.desired_path, task.desired_path.tangent(rows, share)
    ahead = np.sum((real.position - goal.position) * tangent, axis=1)
    length = desired_path.length[rows]
    near = np.clip(share + ahead / np.where(length > 0, length, np.inf), 0.0, 1.0)
    least = TURNED * task.tolerance_angle / np.maximum(np.abs(near - share), 1e-12)
    some = np.flatnonzero(desired_path.angle[rows] > least)
    if len(some):
        there = desired_path.at(rows[some], near[some]).rotation
        moved = product(there, np.swapaxes(wanted.rotation[some], 1, 2))
        goal = goal.copy()
        goal.rotation[some] = product(moved, goal.rotation[some])
    shift, turn = (task.visible_errors if shown else task.pose_errors)(rows, real, goal)
    return shift - ahead[:, None] * tangent, turn
