"""The error of the part's surface as posted and as compensated, from the predicted displacement of the tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import lengths
from postproc.base.units import DEG, MM
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.part.coupled_engagement import CoupledEngagement, Paths, solve_coupled
from postproc.part.deflected_sweeps import Displacement, axes_of, deflect, tips_of
from postproc.part.displacement import Displacements
from postproc.part.part_figures import (
    FEATURES,
    CutForces,
    ErrorFigures,
    PartError,
    PartFigures,
    PartSide,
    SideFigures,
    Surface,
    SurfaceGroup,
    WorstPoint,
)
from postproc.part.surface import POINTS, find_surface
from postproc.part.surface_error import find_errors
from postproc.process.stock.blank import corners_of
from postproc.process.stock.distance import AXIS, REMOVES
from postproc.process.stock.simulation import StockRun
from postproc.toolpath import Toolpath

_FLOOR, _WALL = np.cos(10 * DEG), np.sin(10 * DEG)
_SURE = 1.05  # of the largest displacement that was seen
_LEAST_REACH = 0.01 * MM
_GOUGE = 1e-7  # m: in what the program does not make, less is none
_BESIDE = 5 * MM
_LONGEST = 0.2  # m: edges whose length is not stated


class _Nominal(NamedTuple):
    """What is known of a program before its tools are displaced.

    The surface that is meant; its points that are ``own`` (K,), which the program makes or gouges, with the motion (K,)
    that does and the feature (K,) that they belong to; its sweeps ``paths`` that may reach the part; the sweeps of
    earlier programs; lever [m]: how far an edge is from the tip at most.
    """

    run: StockRun
    surface: Surface
    own: Ints
    made_by: Ints
    feature: Ints
    paths: Paths
    earlier: Floats
    lever: float


class _UnknownDisplacement(Exception):
    """The displacement of the motions ``args[0]`` (L,) is not known."""


def find_part_error(
    task: CompensationProblem,
    run: StockRun,
    division: Subdivision | None,
    count: int = POINTS,
    as_nominal: str = "",
) -> PartError | Finding:
    """The error of the part that ``task`` leaves in the stock of ``run``, at about ``count`` points.

    As posted, and with ``division`` as compensated: both with engagement and displacement solved together, unless
    ``as_nominal`` says why the forces of the task are taken.  A correction follows the forces of the task, those of a
    tool that goes as programmed; where the path turns at once no tool that yields does.  PRT001 where it is not
    known, and why.
    """
    nominal = _nominal(run, count)
    path = task.toolpath
    paths = nominal.paths
    cutting = np.unique(paths.motion[run.engagement.cuts[paths.motion]])
    displaced = Displacements(task, run.sweeps.in_stock)
    try:
        lost = cutting[~task.desired_path.traceable[cutting]]
        if len(lost):
            raise _UnknownDisplacement(lost)
        every = [displaced] if division is None else [displaced, replace(displaced, division=division)]
        solved = list(
            in_blocks(
                lambda part: as_nominal or solve_coupled(run, paths, every[part.start], nominal.lever),
                len(every),
                1,
            )
        )
        sides = [
            _side(nominal, one, paths)
            if isinstance(forces, str)
            else _side(nominal, replace(one, wrench=forces.along), forces.pieces)
            for one, forces in zip(every, solved, strict=True)
        ]
    except (
        Refusal
    ) as too_large:  # sweeps of displaced tools in parts of millimetres need more than the program's
        return Finding("PRT001", too_large.findings[0].message, task.file)
    except _UnknownDisplacement as unknown:
        lost = unknown.args[0]
        message = f"the displacement of the tool is not known in {len(lost)} motions that reach the part"
        return Finding("PRT001", message, task.file, int(path.line[lost[0]]))
    nominal, sides = _of_program(nominal, sides)
    if not len(nominal.own):
        return Finding("PRT001", "the program leaves no surface of its own on the part", task.file)
    area = nominal.surface.area[nominal.own]
    whole = [_figures(nominal, side, path, task.tolerance) for side in sides]
    figures = PartFigures(
        len(nominal.own),
        nominal.surface.spacing,
        float(area.sum()),
        task.tolerance,
        whole[0],
        None if division is None else whole[1],
        _groups(FEATURES, nominal.feature, nominal, sides, task),
        _groups(*_operations(nominal), nominal, sides, task),
        _cut_forces(task, nominal, solved[0]),
        None if division is None else _cut_forces(task, nominal, solved[1]),
    )
    after = None if division is None else sides[1]
    wrenches = [None if isinstance(forces, str) else forces.along for forces in solved]
    last = solved[-1]
    unsettled = np.empty(0, np.int64) if isinstance(last, str) else last.unsettled
    wrench = (wrenches[0], wrenches[-1])
    return PartError(figures, nominal.surface, nominal.own, sides[0], after, wrench, unsettled)


def _cut_forces(task: CompensationProblem, nominal: _Nominal, solved: CoupledEngagement | str) -> CutForces:
    """The forces of a side against those of the nominal engagement."""
    motions = np.unique(nominal.paths.motion)
    # what the ends have before ramps take a part of it, as in all that the report says of the force
    ends = [task.force.start[motions], task.force.values[motions]]
    if task.force.ramps is not None:
        row, share = task.force.ramps.ends()
        near = np.isin(row, motions)
        ends.append(task.force.along(row[near], share[near]))
    largest = float(lengths(np.concatenate(ends)[:, :3]).max(initial=0.0))
    if isinstance(solved, str):
        return CutForces(solved, largest, None, None)
    return CutForces("", largest, solved.largest, solved.residual)


def _nominal(run: StockRun, count: int) -> _Nominal:
    surface = find_surface(run.engagement.stock, count)
    earlier = run.engagement.stock.sweeps[: 0 if run.before is None else len(run.before.rows)]
    own = np.flatnonzero(surface.sweep >= len(earlier))
    sweep = surface.sweep[own] - len(earlier)
    made_by, feature = run.sweeps.motion[sweep], _features(run, surface.normals[own], sweep)
    return _Nominal(run, surface, own, made_by, feature, paths_of(run), earlier, lever_of(run))


def _features(run: StockRun, normals: Floats, sweep: Ints) -> Ints:
    """(K,) numbers in ``FEATURES`` of points with the ``normals`` (K, 3) where the cutter of ``sweep`` (K,) is."""
    slope = np.abs(np.einsum("ki,ki->k", normals, run.sweeps.rows[sweep, AXIS : AXIS + 3]))
    return np.where(slope >= _FLOOR, 0, np.where(slope <= _WALL, 1, 2))


def _of_program(nominal: _Nominal, sides: Sequence[PartSide]) -> tuple[_Nominal, list[PartSide]]:
    """The sides, of all points of the surface, at those that the program makes, and at those of the blank and of
    earlier programs that its displaced tools gouge."""
    surface, sweeps = nominal.surface, nominal.run.sweeps
    worst = np.argmin([side.error for side in sides], axis=0)
    error, motion = (
        np.choose(worst, [getattr(side, name) for side in sides]) for name in ("error", "motion")
    )
    gouged = np.flatnonzero((surface.sweep < len(nominal.earlier)) & (error < 0.0))
    sweep = np.searchsorted(sweeps.motion, motion[gouged])
    own = np.concatenate([nominal.own, gouged])
    nominal = nominal._replace(
        own=own,
        made_by=np.concatenate([nominal.made_by, motion[gouged]]),
        feature=np.concatenate([nominal.feature, _features(nominal.run, surface.normals[gouged], sweep)]),
    )
    return nominal, [
        PartSide(side.error[own], side.motion[own], side.share[own], side.arm[own]) for side in sides
    ]


def lever_of(run: StockRun) -> float:
    """[m] how far an edge of any tool is from the tip at most."""
    return max(min(cutter.edge_length, _LONGEST) + cutter.radius for cutter in run.sweeps.cutters)


def paths_of(run: StockRun) -> Paths:
    """The sweeps of a program that may reach the part."""
    near, sweeps = _near(run), run.sweeps
    return Paths(
        sweeps.rows[near], sweeps.motion[near], sweeps.share[near], sweeps.which[near], np.flatnonzero(near)
    )


def _near(run: StockRun) -> Bools:
    """(M,) the sweeps of the program that remove material and are not beside the blank."""
    rows = run.sweeps.rows
    low, high = corners_of(run.blank)
    wide = max(cutter.radius for cutter in run.sweeps.cutters) + _BESIDE
    top = np.array([cutter.edge_length for cutter in run.sweeps.cutters])[run.sweeps.which]
    places = [np.full(len(rows), share) for share in (0.0, 0.5, 1.0)]
    tips = [tips_of(rows, place) for place in places]
    tops = [tip + top[:, None] * axes_of(rows, place) for tip, place in zip(tips, places, strict=True)]
    ends = np.stack([*tips, *tops])
    apart = np.any((ends.max(axis=0) + wide < low) | (ends.min(axis=0) - wide > high), axis=1)
    return np.asarray((rows[:, REMOVES] > 0) & ~apart)


def _side(nominal: _Nominal, displacement: Displacement, paths: Paths) -> PartSide:
    """The errors with displaced tools along ``paths``, at all points of the surface: at those that the program does not
    make they are 0 but where it gouges.  Raises _UnknownDisplacement."""
    largest, lost = 0.0, np.zeros(0, np.int64)

    def moved(motion: Ints, share: Floats) -> tuple[Floats, Floats]:
        nonlocal largest, lost
        shift, turn = displacement(motion, share)
        unknown = ~np.isfinite(shift[:, 0])
        lost = np.union1d(lost, motion[unknown])
        shift[unknown], turn[unknown] = 0.0, 0.0
        largest = max(largest, float((lengths(shift) + nominal.lever * lengths(turn)).max(initial=0.0)))
        return shift, turn

    rows, owner, share = deflect(paths.rows, paths.motion, paths.share, nominal.lever, moved)
    if len(lost):
        raise _UnknownDisplacement(lost)
    surface = nominal.surface
    found = find_errors(
        nominal.run.engagement.stock,
        np.concatenate([nominal.earlier, rows]),
        max(_SURE * largest, _LEAST_REACH),
        surface.points,
        surface.normals,
    )
    sweep = found.sweep - len(nominal.earlier)
    at = np.maximum(sweep, 0)
    motion = np.where(sweep >= 0, paths.motion[owner[at]], -1)
    place = share[at, 0] + found.share * (share[at, 1] - share[at, 0])
    arm = surface.points - tips_of(rows[at], np.nan_to_num(found.share))
    # beside an edge what is nearest is a wall of the program, not a gouge in the face beside it
    gouged = found.along_normal & (found.error < -_GOUGE) & (sweep >= 0)
    made = surface.sweep >= len(nominal.earlier)
    return PartSide(np.where(made | gouged, found.error, 0.0), motion, place, arm)


def _figures(nominal: _Nominal, side: PartSide, path: Toolpath, tolerance: float) -> SideFigures:
    worst = int(np.argmax(np.abs(side.error)))
    x, y, z = nominal.surface.points[nominal.own[worst]].tolist()
    point = WorstPoint(
        (x, y, z),
        int(path.line[side.motion[worst]]) if side.motion[worst] >= 0 else 0,
        float(side.error[worst]),
        FEATURES[nominal.feature[worst]],
    )
    return SideFigures(ErrorFigures.of(side.error, nominal.surface.area[nominal.own], tolerance), point)


def _operations(nominal: _Nominal) -> tuple[list[str], Ints]:
    """Names of the operations, runs of motions with one tool; and which one each point (K,) belongs to."""
    sweeps = nominal.run.sweeps
    motions, first = np.unique(sweeps.motion, return_index=True)
    tool = sweeps.which[first]
    starts = np.append(True, tool[1:] != tool[:-1])
    names = [f"tool {sweeps.cutters[index].number}" for index in tool[starts]]
    return names, (np.cumsum(starts) - 1)[np.searchsorted(motions, nominal.made_by)]


def _groups(
    names: Sequence[str],
    group: Ints,
    nominal: _Nominal,
    sides: Sequence[PartSide],
    task: CompensationProblem,
) -> tuple[SurfaceGroup, ...]:
    """The figures of the groups of points (K,) that have any."""
    area = nominal.surface.area[nominal.own]
    groups = []
    for index, name in enumerate(names):
        at = np.flatnonzero(group == index)
        if not len(at):
            continue
        line = task.toolpath.line[nominal.made_by[at]]
        figures = [ErrorFigures.of(side.error[at], area[at], task.tolerance) for side in sides]
        groups.append(
            SurfaceGroup(
                name,
                (int(line.min()), int(line.max())),
                float(area[at].sum() / area.sum()),
                figures[0],
                figures[1] if len(figures) > 1 else None,
            )
        )
    return tuple(groups)
