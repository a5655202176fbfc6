"""A division with the points of its corners moved, and others inserted beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import Placed, PoseRows, Poses, lengths
from postproc.compensation.corner_points import ChosenPoints
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.divisible_motions import arc_normals
from postproc.compensation.mirror import pose_error
from postproc.compensation.path_error import PathSegments
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.rounded_path import original
from postproc.compensation.subdivision import CornerFits, Subdivision, subdivided_motions
from postproc.toolpath import Role

FLAT = 1e-6
"""[m] Height of an arc over its chord: a digit of a program."""


@dataclass(frozen=True)
class CornerDivision:
    """The points of G corners, P together.

    motion (P,): of the division that end in them, ascending; row, share (P,); group (P,), group_start (G + 1,): to
    which corner they belong; poses (P): their commands; arcs (A,): circles of the division whose points move, with the
    places ``via`` (A) in their middle.
    """

    division: Subdivision
    base: Placed
    motion: Ints
    row: Ints
    group: Ints
    group_start: Ints
    poses: Poses
    arcs: Ints
    via: Poses

    def moved(self, task: CompensationProblem, poses: Poses) -> CornerDivision:
        """The same with other poses (P)."""
        division = replace(self.division, command=_overlaid(self.base, self.motion, poses))
        if len(self.arcs):
            division = self._rounded(task, division, poses)
        return replace(self, division=division, poses=poses)

    @property
    def flat(self) -> Bools:
        """(G,) corners whose points leave an arc so flat that three points as they are written define no circle."""
        found = np.zeros(len(self.group_start) - 1, bool)
        radius = lengths(self.division.command[self.arcs].position - self.division.centre[self.arcs])
        arcs = self.arcs[radius * (1.0 - np.cos(0.5 * self.division.sweep[self.arcs])) < FLAT]
        found[self.group[np.isin(self.motion, arcs) | np.isin(self.motion + 1, arcs)]] = True
        return found

    def _rounded(self, task: CompensationProblem, division: Subdivision, poses: Poses) -> Subdivision:
        """The division with its arcs through the moved points; the middle of each moves as much as both do."""
        shift = np.zeros((len(division) + 1, 3))
        shift[self.motion + 1] = poses.position - self.base[self.motion].position
        via = self.via.position + 0.5 * (shift[self.arcs] + shift[self.arcs + 1])
        part = subdivided_motions(task, division, self.arcs)
        arcs = PathSegments.round(
            part.rows,
            part.first,
            part.last,
            part.start,
            Poses(self.via.rotation, via),
            part.end,
            arc_normals(task, part.rows),
        )
        circle = [np.array(values) for values in (division.centre, division.normal, division.sweep)]
        for values, new in zip(circle, (arcs.centre, arcs.normal, arcs.sweep), strict=True):
            values[self.arcs] = new
        return replace(division, centre=circle[0], normal=circle[1], sweep=circle[2])

    def result(self, task: CompensationProblem, result: CorrectionResult) -> CorrectionResult:
        """``result`` with the end points of the program's motions that are points of corners."""
        own = np.flatnonzero(self.division.role[self.motion] == Role.ORIGINAL)
        rows, poses = self.row[own], self.poses[own]
        shift, turn = pose_error(poses, task.wanted[rows])
        correction, turns = result.correction.copy(), np.array(result.turn)
        correction[rows], turns[rows] = shift, turn
        command = _overlaid(result.command, rows, poses)
        rounded = np.union1d(result.rounded, rows)
        return replace(result, command=command, correction=correction, turn=turns, rounded=rounded)


def _overlaid(base: Placed, rows: Ints, poses: Poses) -> PoseRows:
    """``base`` with ``poses`` (K) in its ``rows`` (K,), ascending."""

    def build(asked: Ints) -> Poses:
        found = base[asked].copy()
        near = np.minimum(np.searchsorted(rows, asked), len(rows) - 1)
        some = np.flatnonzero(rows[near] == asked) if len(rows) else rows
        found.put(some, poses[near[some]])
        return found

    return PoseRows(len(base), build)


def with_corners(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    chosen: ChosenPoints,
    used: Bools,
    fitted: CornerDivision | None = None,
) -> CornerDivision:
    """The division with what is inserted for the corners ``used`` (G,); their points as they are, or as ``fitted``."""
    numbers = np.flatnonzero(used)
    inserted = np.flatnonzero(used[chosen.group])
    row = np.concatenate([division.source[chosen.corner[numbers]], chosen.row[inserted]])
    share = np.concatenate([division.share[chosen.corner[numbers]], chosen.share[inserted]])
    corner = np.concatenate([chosen.corner[numbers], np.full(len(inserted), -1)])
    group = np.concatenate([numbers, chosen.group[inserted]])
    inner = np.concatenate([chosen.inner[numbers], np.ones(len(inserted), bool)])
    order = np.lexsort((share, row))
    row, share, corner, group, inner = (a[order] for a in (row, share, corner, group, inner))

    added = np.flatnonzero(corner < 0)
    key = division.source + 0.5 * np.where(division.role == Role.TRANSITION, 0.0, division.share)
    before = np.searchsorted(key, row[added] + 0.5 * share[added])
    old = np.insert(np.arange(len(division)), before, -1)
    motion = np.empty(len(row), np.int64)
    motion[added] = before + np.arange(len(added))
    there = np.flatnonzero(corner >= 0)
    motion[there] = corner[there] + np.searchsorted(before, corner[there], "right")

    many = np.zeros(len(used), np.int64)
    if chosen.place is not None:
        many = np.bincount(chosen.group, minlength=len(used)) + (
            division.role[chosen.corner] != Role.ORIGINAL
        )
    own = np.zeros(len(used), np.int64)
    own[group[there]] = motion[there]

    poses = Poses(np.empty((len(row), 3, 3)), np.empty((len(row), 3)))
    poses.put(there, division.command[corner[there]])
    new = np.flatnonzero(inner)
    poses.put(new, commands_on_rounded_path(task, row[new], share[new]))
    begun = poses
    if chosen.own_place is not None and chosen.place is not None:  # arcs bend as on the path itself
        begun = poses.copy()
        begun.put(there, division.command[corner[there]])
        begun.put(added, commands_on_path(task, row[added], share[added]))
        poses.position[:] = np.concatenate([chosen.own_place[numbers], chosen.place[inserted]])[order]
    arcs = [np.insert(a, before, np.nan, axis=0) for a in (division.centre, division.normal, division.sweep)]
    made = Subdivision(
        np.insert(division.source, before, row[added].astype(division.source.dtype)),
        np.insert(division.role, before, np.int8(Role.INTERMEDIATE)),
        np.insert(division.share, before, share[added]),
        PoseRows(len(old), lambda rows: _of_old(division.command, old[rows])),
        arcs[0],
        arcs[1],
        arcs[2],
        np.insert(division.moved, before, True),
        division.findings,
        division.not_refined,
        division.lead_ins,
        fits=_all_fits(
            division.fits, CornerFits(motion, own[group], chosen.before[group], many[group]), before
        ),
    )
    curved = _arcs_of(task, made, motion)
    via = _on_path(task, made, curved)
    start = np.searchsorted(group, np.arange(len(used) + 1))  # corners follow each other
    base = _overlaid(made.command, motion, begun)
    found = CornerDivision(made, base, motion, row, group, start, poses, curved, via)
    return found.moved(task, poses if fitted is None else fitted.poses[np.flatnonzero(used[fitted.group])])


def _all_fits(old: CornerFits | None, new: CornerFits, before: Ints) -> CornerFits:
    """The ``new`` fits of a division with those that it had before motions were inserted ``before`` (A,) others."""
    if old is None:
        return new
    point, corner = (at + np.searchsorted(before, at, "right") for at in (old.point, old.corner))
    point = np.concatenate([point, new.point])
    order = np.argsort(point, kind="stable")
    return CornerFits(
        point[order],
        np.concatenate([corner, new.corner])[order],
        np.concatenate([old.before, new.before])[order],
        np.concatenate([old.inserted, new.inserted])[order],
    )


def _of_old(command: Placed, old: Ints) -> Poses:
    """Commands (K) of motions of a division before others were inserted; of these, -1, any."""
    return command[np.maximum(old, 0)].copy()


def commands_on_rounded_path(task: CompensationProblem, row: Ints, share: Floats) -> Poses:
    """The commands (K) by which the tool is on the rounded path of the program at the shares (K,) of rows (K,)."""
    wanted, _ = original(task, row, share)
    goal = task.goal(row, wanted, share)
    return task.command(row, wanted, task.force.along(row, share), goal, share=share).command


def commands_on_path(task: CompensationProblem, row: Ints, share: Floats) -> Poses:
    """The commands (K) at the shares (K,) of rows (K,) of the path that rounds off nothing."""
    wanted = task.desired_path.at(row, share)
    goal = task.goal(row, wanted, share)
    return task.command(row, wanted, task.force.along(row, share), goal, share=share).command


def _arcs_of(task: CompensationProblem, division: Subdivision, motion: Ints) -> Ints:
    """Arcs among the motions that start or end in the points of ``motion`` (P,), ascending."""
    near = np.unique(np.concatenate([motion, motion + 1]))
    return np.asarray(near[task.desired_path.arc[division.source[near]]])


def _on_path(task: CompensationProblem, division: Subdivision, motions: Ints) -> Poses:
    """The commands (K) in the middle of the arcs ``motions`` (K,)."""
    row = division.source[motions].astype(np.int64)
    last = division.share[motions]
    before = np.maximum(motions - 1, 0)
    first = np.where((division.source[before] == row) & (motions > 0), division.share[before], 0.0)
    return commands_on_path(task, row, 0.5 * (first + last))
