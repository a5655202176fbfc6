"""What the main job predicts at one place, and whether every motion is feasible there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.units import DEG
from postproc.compensation.correct import correct
from postproc.compensation.path_comparison import along_and_across
from postproc.compensation.uncertainty import evaluate_uncertainty
from postproc.placement.collisions import CollisionShapes
from postproc.report.placement import PlacedFigures
from postproc.report.report import Spread
from postproc.workflows.place_collisions import collision_of
from postproc.workflows.place_motions import motion_margins
from postproc.workflows.place_problem import PlaceProblem, PlaceRequest, prepared_at
from postproc.workflows.preparation import Prepared


def exact_figures(problem: PlaceProblem, place: Floats | None) -> PlacedFigures | Finding:
    """The figures of the main job with the part at ``place`` (6,), None for the present one; the finding that states
    why a place that is not the present one is not feasible.  Raises Refusal where the present one cannot be
    predicted."""
    request = problem.request
    try:
        prepared = problem.prepared if place is None else prepared_at(problem.moved, place, request)
        figures = figures_of(prepared, None if place is None else request)
        if place is not None:
            refuse_collisions(problem.shapes, prepared)
    except Refusal as refusal:
        if place is None:
            raise
        return refusal.findings[0]
    return replace(figures, place=problem.room.present if place is None else place)


def refuse_collisions(shapes: CollisionShapes | Finding | None, prepared: Sequence[Prepared]) -> None:
    """Raises Refusal PLC002 for the first motion in which two links overlap."""
    if isinstance(shapes, CollisionShapes):
        for ready in prepared:
            if (found := collision_of(shapes, ready)) is not None:
                raise Refusal(found)


def figures_of(prepared: Sequence[Prepared], request: PlaceRequest | None) -> PlacedFigures:
    """The figures of the main job, without their place; ``request``: whose margins every motion must keep, None for
    any.  Raises Refusal as the main job does, PLC002 for a motion that is not feasible."""
    margins = _margins(prepared)
    if request is not None:
        for ready in prepared:
            _check(ready, request)
    return replace(_figures(prepared), **margins)


def _margins(prepared: Sequence[Prepared]) -> dict[str, Any]:
    """The least distances from limits and singularities over all programs, in deg, and their lines."""
    found: dict[str, Any] = {}
    for ready in prepared:
        margins = motion_margins(ready.task)
        for name, values in (("limit", margins.limit), ("singular", margins.singular)):
            at = int(values.argmin())
            angle, line = float(values[at] / DEG), int(ready.task.toolpath.line[margins.rows[at]])
            if angle < found.get(f"{name}_deg", np.inf):
                found[f"{name}_deg"], found[f"{name}_line"] = angle, line
    return found


def _check(ready: Prepared, request: PlaceRequest) -> None:
    """Raises Refusal PLC002 for the first motion that is not feasible, whose path is closer to a limit than it may be,
    or whose configuration is not the stated one."""
    task, margins = ready.task, motion_margins(ready.task)
    found = margins.lack(ready.robot, (request.limit_margin, request.singularity_margin))
    if found is not None:
        row, words = found
        raise Refusal(Finding("PLC002", words, task.file, int(task.toolpath.line[row])))
    if len(margins.wrong):
        message = "the stated configuration of this motion is not one that reaches it"
        raise Refusal(Finding("PLC002", message, task.file, int(task.toolpath.line[margins.wrong[0]])))


def _figures(prepared: Sequence[Prepared]) -> PlacedFigures:
    """What the main job predicts over all programs.  Raises Refusal as that does, PLC002 without an equilibrium."""
    error, across, uncertainty, bound = [], [], 0.0, False
    for ready in prepared:
        task, result = ready.task, correct(ready.task)
        scope = result.scope
        if not np.isfinite(result.before[scope]).all():
            row = int(np.flatnonzero(scope & ~np.isfinite(result.before))[0])
            message = "the error of this motion cannot be predicted"
            raise Refusal(Finding("PLC002", message, task.file, int(task.toolpath.line[row])))
        error.append(result.before[scope])
        across.append(along_and_across(task, result)[1][scope])
        spread = evaluate_uncertainty(task, result, ready.cell.force_ci95, ready.cell.force_vector)
        uncertainty = float(np.fmax(uncertainty, spread.after))
        bound |= spread.lower_bound
    return PlacedFigures(
        np.zeros(6),
        error=Spread.of(np.concatenate(error)),
        across=Spread.of(np.concatenate(across)),
        uncertainty=uncertainty,
        lower_bound=bound,
    )
