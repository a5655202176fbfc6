"""Where the points lie on which the correction follows a ramp of the force, as few as hold the tolerance.

A force that changes over a ramp turns the correction where the ramp starts and where it ends.  A point at each place,
and others beside them that keep the rounding short, follow that; but points that may lie anywhere follow it with fewer:
their coordinates are fitted to the curve of the commands by which the tool is on the rounded path of the original.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import PoseRows, lengths
from postproc.base.units import MM
from postproc.compensation.approximations import approximations
from postproc.compensation.corner_division import commands_on_path, commands_on_rounded_path
from postproc.compensation.corner_points import ChosenPoints, shortest_arc
from postproc.compensation.correct import CorrectionResult
from postproc.compensation.point_fit import Curves
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramp_fits import (
    CLOSE_STARTS,
    STARTS,
    CloseFits,
    FittedPoints,
    FittedRamps,
    fit_ramps,
)
from postproc.compensation.rounded_path import original
from postproc.compensation.subdivision import Limits, Subdivision
from postproc.toolpath import Role

MOST = 200
"""Ramps whose points are fitted: the first of a program."""

NEVER = 1_000_000
"""More points than a ramp may have."""

LeastPoints = Mapping[tuple[int, float], int]
"""By row and share of corners, or of where ramps end, the number of points that are inserted at least on a ramp;
``NEVER``: the corner stays as it is."""

MARGIN = 3.0 * MM
"""[m] The curve goes on before the vertex and after the ramp by this, and twice the approximation."""

ON_ARC = 12.0 * MM
"""[m] The same on an arc: as far as the polygon is compared with it."""

NEAREST = 1e-9
"""[m] The next point of an arc is by so much at least beyond the curve."""

PLACES, CLOSE_PLACES = 440, 1760
"""Places of a curve, between which it is straight; and of one to which points are fitted closely from the start on."""

PAYS = 0.9
"""Share of the error that is left which a fit with more points has to come below."""

PAYS_CLOSE = 0.97
"""The same of a close fit."""

SEARCHED = 8
"""Ramps that no fit holds, and ramps that one nearly holds, that are fitted closely: the first of a program."""

NEARLY = 1.08
"""By this factor more than what is allowed remains at most of what is fitted closely before there are more points."""

SHOWS = 0.9
"""Share of the tolerance: ramps whose ends are rounded off by less keep the one point that they have."""

APART = 0.1
"""Share of the shortest line by which points are apart along the path of the program at least."""


def choose_ramp_points(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints,
    allowed: float,
    anyhow: Ints,
    close: CloseFits,
) -> tuple[Subdivision, ChosenPoints | None, Ints]:
    """The division without the points of those ramps for which others were found, these, and the rows (L,) of the ramps
    left.  allowed [m]: error; for ramps of the rows ``anyhow`` (A,) what comes nearest will do where nothing holds it;
    ``close``: fits that were done already.
    """
    ramps, inner, fewest = _ramps(task, result, division, limits, least)
    if not len(ramps.row):
        return division, None, np.empty(0, np.int64)
    curves = _curves(task, division, ramps)
    spare = limits.inserted(len(task.toolpath)) - division.inserted
    found: dict[int, FittedPoints] = {}
    nearest: dict[int, FittedPoints] = {}
    left, tried = np.arange(len(ramps.row)), set[int]()

    def close_curve(name: int) -> Curves:
        return close.curve(
            curves.place[name], lambda: _curves(task, division, ramps[np.array([name])], CLOSE_PLACES)
        )

    for count in range(1, len(STARTS) + 1):
        some = left[(fewest[left] <= count) & (count <= inner[left] + spare)]
        for name, one in fit_ramps(ramps[some], curves[some], count, allowed, some).items():
            if (
                allowed < one.largest <= NEARLY * allowed
                and not ramps.exact[name]
                and len(tried | {name}) <= SEARCHED
            ):
                this, tried = np.array([name]), tried | {name}
                one = close.go_on(ramps[this], close_curve(name), one, allowed)
            if one.largest <= allowed:
                found[name] = one
            elif name not in nearest or one.largest < PAYS * nearest[name].largest:
                nearest[name] = one
        left = np.array([k for k in left if k not in found], np.int64)
    for name in left[~ramps.exact[left]][:SEARCHED].tolist():
        this, curve = np.array([name]), close_curve(name)
        for number, (words, _) in enumerate(CLOSE_STARTS):
            if not fewest[name] <= len(words) - 1 <= inner[name] + spare:
                continue
            near = close.fit(ramps[this], curve, number, allowed)
            if near is None:
                continue
            if near.largest <= allowed:
                found[name] = near
                break
            if name not in nearest or near.largest < PAYS_CLOSE * nearest[name].largest:
                nearest[name] = near
    wanted = np.isin(ramps.row, anyhow).tolist()
    found |= {name: one for name, one in nearest.items() if name not in found and wanted[name]}
    part, chosen = _without_points(task, division, ramps, found)
    return part, chosen, ramps.row[[k for k in left if k not in found]]


def _ramps(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision,
    limits: Limits,
    least: LeastPoints,
) -> tuple[FittedRamps, Ints, Ints]:
    """The ramps that end in an inserted point of their motion, alone and away from others; and (G,) how many points are
    inserted for each, and have to be at least."""
    none = np.empty(0, np.int64)
    parts, path, desired_path = task.force.ramps, task.toolpath, task.desired_path
    inserted = np.flatnonzero((division.role == Role.INTERMEDIATE) & (division.share < 1.0))
    if parts is None or not len(inserted) or limits.no_insert:
        pair = np.empty((0, 2))
        never = none > 0
        ramps = FittedRamps(none, none, none, np.empty(0), never, pair, pair, pair, none, pair > 0)
        return ramps, none, none
    row, many = np.unique(parts.row, return_counts=True)
    at = np.searchsorted(parts.row, row)
    end = parts.length[at]
    good = (many == 1) & (parts.start[at] <= 0.0) & (end < parts.extent[at]) & ~parts.before[at]
    row, end = row[good], end[good]
    before = row - 1
    on = result.corrected & desired_path.traceable & (desired_path.length > 0) & task.carries
    on[list({**path.constraints.locked, **path.constraints.no_insert_before})] = False
    good = (
        on[row] & on[before] & (result.cut[row] == result.cut[before]) & (path.tool[row] == path.tool[before])
    )
    row, end = row[good], end[good]
    length = desired_path.length
    # the point that ends the ramp, and that of the vertex
    key = division.source[inserted] + division.share[inserted]
    near = np.minimum(np.searchsorted(key, row + end / length[row] - 1e-9), len(key) - 1)
    knot = inserted[near]
    own = np.flatnonzero(division.original)
    vertex = own[row - 1]
    good = np.abs(key[near] - row - end / length[row]) < 1e-8
    places = [((int(r) - 1, 1.0), (int(r), float(s))) for r, s in zip(row, division.share[knot], strict=True)]
    fewest = np.array([max(least.get(one, 0) for one in pair) for pair in places], np.int64)
    good &= fewest < NEVER
    reach = np.stack([approximations(task, division, motions) for motions in (vertex, knot)], axis=1)
    good &= np.isfinite(reach).all(axis=1) & (reach[:, 1] > 0)
    row, end, knot, vertex, reach, fewest = (
        a[good][: 2 * MOST] for a in (row, end, knot, vertex, reach, fewest)
    )
    exact = reach[:, 0] == 0
    arc = np.stack([desired_path.arc[row - 1], desired_path.arc[row]], axis=1)
    feed = np.nan_to_num(np.fmax(path.feed[row], path.feed[row - 1]))
    spacing = np.broadcast_to(np.maximum(limits.ramp_end, feed * limits.cycle)[:, None], arc.shape).copy()
    for side in (0, 1):
        some = np.flatnonzero(arc[:, side])
        spacing[some, side] = np.maximum(spacing[some, side], shortest_arc(task, row[some] - 1 + side))
    # as far as nothing else is: half of what is left of either motion
    taken = np.zeros(len(path))
    taken[parts.row] = np.minimum(parts.length - parts.start, parts.extent)
    last = end + 2.0 * spacing[:, 1]
    beyond, inner = length[row] - end, np.zeros(len(row), np.int64)
    place = division.share[inserted] * length[division.source[inserted]]
    behind = np.where(exact, np.inf, length[row - 1] - taken[row - 1])
    for k in range(len(row)):
        here = place[division.source[inserted] == row[k]]
        inner[k] = int((here <= last[k]).sum())
        further = here[here > last[k]]
        beyond[k] = min(beyond[k], *(further - end[k])) if len(further) else beyond[k]
        others = place[
            (division.source[inserted] == row[k] - 1) & (place > taken[row[k] - 1] + 2.0 * spacing[k, 0])
        ]
        behind[k] = min(behind[k], length[row[k] - 1] - others.max()) if len(others) else behind[k]
    most = reach.max(axis=1)
    # from the next point on an arc bends anew
    half = np.where(arc, 1.0, 0.5) * np.minimum(
        np.stack([behind, beyond], axis=1), np.where(arc, np.inf, 1e3)
    )
    straight = np.minimum(MARGIN + 2.0 * most, half.min(axis=1))
    margin = np.where(arc, np.minimum(half, ON_ARC), straight[:, None])
    good = (margin >= most[:, None] + 2.0 * spacing).all(axis=1) & (
        inner + _rounded_off(task, division, vertex, knot, end, most) > 1
    )
    chosen = np.flatnonzero(good)[:MOST]
    ramps = FittedRamps(vertex, knot, row, end, exact, reach, spacing, margin, vertex + inner + 1, arc)
    return ramps[chosen], inner[chosen], fewest[chosen]


def _rounded_off(
    task: CompensationProblem, division: Subdivision, vertex: Ints, knot: Ints, end: Floats, reach: Floats
) -> Bools:
    """(G,) whether a parabola of ``reach`` (G,) [m] takes more than ``SHOWS`` of the tolerance off a correction that
    changes evenly over the ramps, k d / 4 where it turns by k [m a m]."""
    row = division.source[knot]
    places = (division.share[motions] for motions in (vertex, knot))
    wanted = (task.desired_path.at(at, share) for at, share in zip((row - 1, row), places, strict=True))
    shift = [
        division.command[motions].position - pose.position
        for motions, pose in zip((vertex, knot), wanted, strict=True)
    ]
    return np.asarray(0.25 * reach * lengths(shift[1] - shift[0]) / end > SHOWS * task.tolerance)


def _curves(
    task: CompensationProblem, division: Subdivision, ramps: FittedRamps, places: int = PLACES
) -> Curves:
    """Commands by which the tool is on the rounded path of the program, from before the vertex (there, where it is
    exact) to after the ramp."""
    rounded = np.stack([~ramps.exact, np.ones(len(ramps.row), bool)], axis=1)
    sides = np.where(rounded, ramps.margin, 0.0)
    on_ramp = np.ceil((places - 1) * ramps.end / (ramps.end + sides.sum(axis=1)))
    step = ramps.end / on_ramp  # the curve turns where the ramp starts and ends: there are places
    before = np.floor((places - 1 - on_ramp) * sides[:, 0] / sides.sum(axis=1))
    first = -step * before
    along = (first[:, None] + step[:, None] * np.arange(places)).ravel()
    row = np.repeat(ramps.row, places)
    row = np.where(along < 0.0, row - 1, row)
    share = along / task.desired_path.length[row]
    share = np.where(along < 0.0, 1.0 + share, share)
    place = commands_on_rounded_path(task, row, share).position
    unrounded = commands_on_path(task, row, share).position if ramps.arc.any() else place
    tangent = original(task, row, share)[1]
    shape = (len(ramps.row), places, 3)
    place, unrounded, tangent = place.reshape(shape), unrounded.reshape(shape), tangent.reshape(shape)
    turn = np.stack([np.zeros(len(first)), ramps.end], axis=1)
    # the points before the vertex, or it, and after those of the ramp
    before = np.where(ramps.exact, ramps.vertex, ramps.vertex - 1)
    far = division.command[before].position, division.command[ramps.after].position
    stop = first + step * (places - 1)
    away = [np.sum((far[k] - place[:, -k]) * tangent[:, -k], axis=1) for k in (0, 1)]
    ends = np.stack([first + np.minimum(away[0], -step), stop + np.maximum(away[1], step)], axis=1)
    for side, (motion, row) in enumerate(((before, ramps.row - 1), (ramps.after, ramps.row))):
        share = np.where(division.source[motion] == row, division.share[motion], 0.0)
        on_path = task.desired_path.length[row] * (share if side else share - 1.0)
        beyond = np.maximum(on_path, stop + NEAREST) if side else np.minimum(on_path, first - NEAREST)
        ends[:, side] = np.where(ramps.arc[:, side] & rounded[:, side], beyond, ends[:, side])
    place, unrounded = (
        np.concatenate([far[0][:, None], a, far[1][:, None]], axis=1) for a in (place, unrounded)
    )
    tangent = np.concatenate([tangent[:, :1], tangent, tangent[:, -1:]], axis=1)
    return Curves(first, step, ends, turn, place, tangent, ramps.arc, unrounded)


def _without_points(
    task: CompensationProblem, division: Subdivision, ramps: FittedRamps, fitted: dict[int, FittedPoints]
) -> tuple[Subdivision, ChosenPoints | None]:
    """The division without the points of the ramps that were ``fitted``, but one of those after exact vertices; and
    what is inserted instead."""
    if not fitted:
        return division, None
    names = np.array(sorted(fitted), np.int64)
    length = task.desired_path.length
    dropped, own, group, row, share, place, moved = [], [], [], [], [], [], []
    inserted = np.flatnonzero((division.role == Role.INTERMEDIATE) & (division.share < 1.0))
    for number, name in enumerate(names.tolist()):
        ramp, points = ramps[np.array([name])], fitted[name]
        here = int(ramp.row[0])
        mine = inserted[division.source[inserted] == here]
        last = ramp.end[0] + 2.0 * ramp.spacing[0, 1]
        mine = mine[division.share[mine] * length[here] <= last]
        kept = int(ramp.knot[0]) if ramp.exact[0] else int(ramp.vertex[0])
        dropped += [k for k in mine.tolist() if k != kept]
        own.append(kept)
        moved.append(points.place[points.own])
        fixed = float(ramp.end[0]) if ramp.exact[0] else 0.0
        apart = APART * ramp.spacing[0].min()
        along = points.along.copy()
        along[points.own] = fixed
        for k in range(points.own + 1, len(along)):
            along[k] = max(along[k], along[k - 1] + apart)
        for k in range(points.own - 1, -1, -1):
            along[k] = min(along[k], along[k + 1] - apart)
        for k in range(len(along)):
            if k != points.own:
                at = here if along[k] > 0 else here - 1
                group.append(number)
                row.append(at)
                share.append(along[k] / length[at] + (0.0 if along[k] > 0 else 1.0))
                place.append(points.place[k])
    keep = np.ones(len(division), bool)
    keep[dropped] = False
    kept_motions = np.flatnonzero(keep)
    chosen = ChosenPoints(
        np.searchsorted(kept_motions, np.array(own)),
        np.full(len(names), np.inf),
        np.ones(len(names), bool),
        np.array(group, np.int64),
        np.array(row, np.int64),
        np.array(share, float),
        np.array(moved).reshape(-1, 3),
        np.array(place, float).reshape(-1, 3),
    )
    return _part(division, kept_motions), chosen


def _part(division: Subdivision, motions: Ints) -> Subdivision:
    """The division with these ``motions`` alone."""
    names = ("source", "role", "share", "centre", "normal", "sweep", "moved")
    arrays = {name: getattr(division, name)[motions] for name in names}
    command = PoseRows(len(motions), lambda rows: division.command[motions[rows]])
    return replace(division, command=command, **arrays)
