"""What is inserted so that the path between corrected points is right too: transition moves where the correction steps,
and points where a straight or round path between two of them would exceed the tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.batches import each_block
from postproc.base.geometry import PoseRows, Poses
from postproc.compensation.correct import CorrectionResult, correct
from postproc.compensation.divisible_motions import (
    DivisibleMotions,
    arc_normals,
    motions_per_block,
)
from postproc.compensation.knots import split_at_knots
from postproc.compensation.mirror import interpolate_pose
from postproc.compensation.path_error import PathSegments
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.refinement import enforce_budget, refine
from postproc.compensation.subdivision import Limits, Subdivision, subdivided_motions
from postproc.compensation.transitions import add_transitions
from postproc.toolpath import Role


def subdivide(task: CompensationProblem, result: CorrectionResult, limits: Limits) -> Subdivision:
    """The motions of the output: end points as ``result`` has them, lead-ins, transition moves and further points where
    they are needed."""
    full = result
    if task.gain != 1.0:  # the points of a first cut are those of the last one
        full = correct(replace(task, gain=1.0, max_correction=np.inf))
        full = replace(full, state=result.state)
    motions = DivisibleMotions(task, full, limits)
    add_transitions(motions)
    split_at_knots(motions)
    refine(motions)
    enforce_budget(motions)
    return _build_subdivision(motions)


def _build_subdivision(motions: DivisibleMotions) -> Subdivision:
    task, n = motions.task, motions.n
    segments, linked = np.ones(n, np.int32), motions.returns.copy()
    if len(motions.owner) == len(motions.rows):
        segments[motions.rows] = motions.count
    else:
        segments[motions.rows] = np.bincount(motions.owner, motions.count, len(motions.rows)).astype(np.int32)
    linked[motions.rows] = motions.needs_transition
    total = segments + linked
    source = np.repeat(np.arange(n, dtype=np.int32), total)
    start = np.cumsum(total) - total  # of the motions of each row
    number = np.arange(len(source)) - start[source]
    is_link = linked[source] & (number == 0)
    is_own = number + 1 == total[source]
    role = np.where(is_link, Role.TRANSITION, np.where(is_own, Role.ORIGINAL, Role.INTERMEDIATE)).astype(
        np.int8
    )
    share = np.where(is_link, 0.0, 1.0)
    del number

    inserted = np.flatnonzero(~is_own)
    there = Poses(np.empty((len(inserted), 3, 3)), np.empty((len(inserted), 3)))
    transitions = np.flatnonzero(is_link[inserted])
    to = source[inserted[transitions]]
    there.put(transitions, task.desired_path.start[to])
    mine = np.searchsorted(motions.rows, to)
    own = np.flatnonzero(motions.full.corrected[to])
    there.put(transitions[own], motions.starts[motions.start_at[mine[own]]])

    arc = task.desired_path.arc[motions.rows]
    none = np.broadcast_to(np.nan, (len(source), 3))
    arcs = [none, none, none[:, 0]]
    if arc.any():
        arcs = [path.copy() for path in arcs]
    chosen = np.flatnonzero((motions.count > 1) | arc[motions.owner] | (motions.high < 1.0))
    earlier = np.cumsum(motions.count) - motions.count  # segments before each interval
    first_of = np.searchsorted(motions.owner, np.arange(len(motions.rows)))
    first = (start + linked)[motions.rows[motions.owner]] + earlier - earlier[first_of[motions.owner]]

    def divided(part: slice) -> None:
        some = chosen[part]
        segments, owner = motions.segments(some, motions.count[some])
        lost = task.desired_path.arc[segments.rows] & ~np.isfinite(segments.sweep)
        motions.leave_undivided(
            segments.rows[lost], "COR013", "the corrected points of this arc are not on a circle"
        )
        each = motions.count[some]
        number = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
        place = first[some][owner] + number
        share[place] = segments.last
        inner = np.flatnonzero(segments.last < 1.0)
        there.put(np.searchsorted(inserted, place[inner]), segments.end[inner])
        if arc.any():
            for path, values in zip(arcs, (segments.centre, segments.normal, segments.sweep), strict=True):
                path[place] = values

    each_block(divided, len(chosen), motions_per_block(motions.count[chosen]))

    full, led = motions.full.command, np.flatnonzero(motions.has_lead_in)
    lead_ins = motions.rows[led] - 1
    leads = motions.starts[motions.start_at[led]]
    moved = motions.full.corrected[source] | is_link
    moved[np.flatnonzero(is_own)[lead_ins]] = True

    def command(rows: Ints) -> Poses:
        at = source[rows]
        commands = full[at].copy()
        if len(lead_ins):
            near = np.minimum(np.searchsorted(lead_ins, at), len(lead_ins) - 1)
            some = np.flatnonzero((lead_ins[near] == at) & is_own[rows])
            commands.put(some, leads[near[some]])
        added = np.flatnonzero(~is_own[rows])
        if len(added):
            commands.put(added, there[np.searchsorted(inserted, rows[added])])
        return commands

    division = Subdivision(
        source,
        role,
        share,
        PoseRows(len(source), command).remembered(),
        arcs[0],
        arcs[1],
        arcs[2],
        moved,
        tuple(motions.findings),
        dict(sorted(motions.not_refined.items())),
        lead_ins,
    )
    return division if task.gain == 1.0 else _scaled(task, division)


def _scaled(task: CompensationProblem, division: Subdivision) -> Subdivision:
    """The division with the share ``gain`` of every correction."""
    source, desired_path = division.source, task.desired_path

    def command(rows: Ints) -> Poses:
        commands = division.command[rows].copy()
        moved = np.flatnonzero(division.moved[rows])
        at, share = source[rows[moved]], division.share[rows[moved]]
        wanted = task.wanted[at].copy()
        on_path = np.flatnonzero(desired_path.traceable[at])
        wanted.put(on_path, desired_path.at(at[on_path], share[on_path]))
        part = interpolate_pose(wanted, commands[moved], task.gain)
        commands.put(moved, Poses(task.expressible_orientations(at, share, part.rotation), part.position))
        return commands

    scaled = replace(division, command=PoseRows(len(division), command).remembered())
    curved = np.flatnonzero(np.isfinite(division.sweep))
    if not len(curved):
        return scaled
    before, part = subdivided_motions(task, division, curved), subdivided_motions(task, scaled, curved)
    wanted = desired_path.at(source[curved], 0.5 * (before.first + before.last))
    via = interpolate_pose(wanted, before.at(np.full(len(curved), 0.5)), task.gain)
    normal = arc_normals(task, source[curved])
    arcs = PathSegments.round(part.rows, part.first, part.last, part.start, via, part.end, normal)
    for name in ("centre", "normal", "sweep"):
        values = getattr(scaled, name).copy()
        values[curved] = getattr(arcs, name)
        scaled = replace(scaled, **{name: values})
    return scaled
