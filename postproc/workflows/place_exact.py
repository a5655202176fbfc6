"""What the main job predicts at one place, and whether every motion is feasible there."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Refusal
from postproc.base.units import DEG
from postproc.compensation.correct import correct
from postproc.compensation.path_comparison import along_and_across
from postproc.compensation.uncertainty import evaluate_uncertainty
from postproc.report.placement import PlacedFigures
from postproc.report.report import Spread
from postproc.workflows.place_motions import motion_margins
from postproc.workflows.place_problem import PlaceProblem, prepared_at


def exact_figures(problem: PlaceProblem, place: Floats | None) -> PlacedFigures | None:
    """The figures of the main job with the part at ``place`` (6,), None for the present one; None where a motion is not
    feasible at a place that is not the present one."""
    request = problem.request
    try:
        prepared = problem.prepared if place is None else prepared_at(problem.moved, place, request)
    except Refusal:
        if place is None:
            raise
        return None
    limit, limit_line, singular, singular_line = np.inf, 0, np.inf, 0
    error, across, uncertainty, bound = [], [], 0.0, False
    for ready in prepared:
        task = ready.task
        margins = motion_margins(task)
        for one, rows in ((margins.limit, margins.rows),):
            at = int(one.argmin())
            if one[at] < limit:
                limit, limit_line = float(one[at]), int(task.toolpath.line[rows[at]])
        at = int(margins.singular.argmin())
        if margins.singular[at] < singular:
            singular, singular_line = float(margins.singular[at]), int(task.toolpath.line[margins.rows[at]])
        low = limit < request.limit_margin * DEG or singular < request.singularity_margin * DEG
        if place is not None and (low or len(margins.wrong)):
            return None
        try:
            result = correct(task)
        except Refusal:
            if place is None:
                raise
            return None
        scope = result.scope
        if place is not None and not np.isfinite(result.before[scope]).all():
            return None
        error.append(result.before[scope])
        across.append(along_and_across(task, result)[1][scope])
        spread = evaluate_uncertainty(task, result, ready.cell.force_ci95, ready.cell.force_vector)
        uncertainty = float(np.fmax(uncertainty, spread.after))
        bound |= spread.lower_bound
    return PlacedFigures(
        problem.room.present if place is None else place,
        error=Spread.of(np.concatenate(error)),
        across=Spread.of(np.concatenate(across)),
        uncertainty=uncertainty,
        lower_bound=bound,
        limit_deg=limit / DEG,
        limit_line=limit_line,
        singular_deg=singular / DEG,
        singular_line=singular_line,
    )
