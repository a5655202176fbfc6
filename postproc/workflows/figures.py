"""What is reported of a corrected or predicted program: the figures of its report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import lengths
from postproc.base.units import DEG, MM
from postproc.compensation.correct import CorrectionResult, MotionOutcome
from postproc.compensation.path_comparison import errors_inside
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision, subdivided_motions
from postproc.compensation.uncertainty import evaluate_uncertainty
from postproc.output.write import WrittenProgram
from postproc.report.report import (
    PathFigures,
    Report,
    Spread,
    TransitionMove,
    Worst,
    exit_code,
)
from postproc.workflows.preparation import Prepared, Request

if TYPE_CHECKING:
    from postproc.part.part_figures import PartFigures

WORST_PLACES = 5


def report_of(
    request: Request,
    ready: Prepared,
    result: CorrectionResult,
    findings: tuple[Finding, ...],
    written: WrittenProgram | None = None,
    part: PartFigures | None = None,
) -> Report:
    task, corrected = ready.task, written is not None
    scope = result.scope
    size = lengths(result.correction)
    worst = tuple(
        Worst(
            int(task.toolpath.line[row]),
            float(result.before[row] / MM),
            float(size[row] / MM) if corrected else math.nan,
            float(result.after[row] / MM) if corrected else math.nan,
            float(np.linalg.norm(task.wrench[row, :3])),
        )
        for row in _largest_rows(result.before, scope, WORST_PLACES)
    )
    return Report(
        program=str(request.program),
        dialect=ready.dialect.name,
        robot=ready.robot.name,
        motions=len(task.toolpath),
        cuts=int(result.cut.max(initial=-1)) + 1,
        cutting=int(scope.sum()),
        corrected=int(result.corrected.sum()) if corrected else 0,
        inserted=written.division.inserted if written else 0,
        transition_moves=_transition_moves(task, written.division) if written else (),
        uncorrected=int((result.state == MotionOutcome.UNCORRECTED).sum()),
        iterations=int(result.iterations.max(initial=0)),
        gain=request.gain,
        mode=ready.cell.correct,
        force_source=ready.wrenches.source,
        force_max_n=ready.wrenches.max_force,
        force_peak_n=ready.wrenches.peak_force,
        before=Spread.of(result.before[scope]),
        before_inside=float(errors_inside(task)[1].max(initial=-np.inf)),
        after=Spread.of(result.after[scope]) if corrected else None,
        path_error=Spread.of(written.path_error) if written else None,
        correction=Spread.of(size[result.corrected]) if corrected else None,
        angle_before_deg=_largest(result.before_angle[scope]) / DEG,
        angle_after_deg=_largest(result.after_angle[scope]) / DEG if corrected else None,
        path_error_deg=_largest(written.between_angle) / DEG if written else None,
        worst=worst,
        uncertainty=evaluate_uncertainty(task, result, ready.cell.force_ci95, ready.cell.force_vector),
        model=_model(ready),
        digests={
            "robot": ready.robot.digest,
            **{
                document.path.name: document.digest
                for document in (*ready.settings.siblings, *ready.program.documents)
            },
        },
        findings=findings,
        exit=exit_code(findings, request.strict),
        tolerance=ready.cell.tolerance,
        path=_path_figures(task, result, written) if written else None,
        part=part,
    )


def _path_figures(
    task: CompensationProblem, result: CorrectionResult, written: WrittenProgram
) -> PathFigures:
    scope, rows = result.scope, np.flatnonzero(result.scope)
    along, across = written.along_before, written.across_before
    # what is not corrected stays as it was
    beside = np.where(result.corrected, result.across_after, across)[rows]
    ahead = np.sqrt(np.maximum(result.after[rows] ** 2 - beside**2, 0.0))
    ramps = task.force.ramps
    starts, lengths = (rows[:0], np.empty(0)) if ramps is None else ramps.steps()[:2]
    longest, line = math.nan, 0
    if len(starts):
        most = int(np.argmax(lengths))
        longest, line = float(lengths[most]), int(task.toolpath.line[starts[most]])
    return PathFigures(
        Spread.of(np.abs(along[scope])),
        Spread.of(across[scope]),
        Spread.of(ahead),
        Spread.of(beside),
        task.ramp,
        len(starts),
        longest,
        line,
        written.transitions,
    )


def _largest_rows(values: Floats, mask: Bools, count: int) -> Ints:
    """The rows of the ``count`` largest of ``values`` (N,), the largest first, of those in ``mask`` that are known."""
    rows = np.flatnonzero(mask & np.isfinite(values))
    known = values[rows]
    if len(rows) > count:
        high = known >= np.partition(known, -count)[-count]
        rows, known = rows[high], known[high]
    return rows[np.argsort(-known, kind="stable")[:count]]


def _transition_moves(task: CompensationProblem, division: Subdivision) -> tuple[TransitionMove, ...]:
    links = np.flatnonzero(division.transitions)
    moves = subdivided_motions(task, division, links)
    length = np.linalg.norm(moves.end.position - moves.start.position, axis=1) / MM
    lines = task.toolpath.line[division.source[links]]
    return tuple(TransitionMove(int(line), float(mm)) for line, mm in zip(lines, length, strict=True))


def _model(ready: Prepared) -> dict[str, object]:
    """Effects, options, values with interval and source, as they were used."""
    return {
        ready.model.label(index): {
            **term.effect.described(),
            "parameters": {
                name: {
                    "value": value.value,
                    "unit": next(p.unit for p in term.effect.parameters if p.name == name),
                    "interval": value.interval,
                    "level": value.level if value.level or value.interval is None else "unstated",
                    "source": value.source,
                }
                for name, value in term.stated.items()
            },
        }
        for index, term in enumerate(ready.model.terms)
    }


def _largest(values: Floats) -> float:
    seen = values[np.isfinite(values)]
    return float(seen.max()) if len(seen) else math.nan
