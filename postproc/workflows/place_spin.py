"""Programs whose tool turns about its spindle along the path: what it would bring, and their texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.document import Edits
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import product, rotation_from_vector
from postproc.base.units import MM
from postproc.languages.permitted import refuse_other
from postproc.output.write import edited_contents, writing_settings
from postproc.placement.part_motions import PartMotions
from postproc.placement.score_places import P95, score_places
from postproc.placement.spin import SAME, STEP, SpinScan, scan_spins
from postproc.report.placement import PlacedFigures
from postproc.report.placement_spin import WORTH, SpinFigures
from postproc.toolpath import Plan
from postproc.workflows.place_exact import figures_of, refuse_collisions
from postproc.workflows.place_problem import PlaceProblem, prepared_at
from postproc.workflows.place_spin_check import SHARED_POINTS, check_forces, check_turned
from postproc.workflows.place_spin_path import (
    SpinPath,
    plan_turns,
    refuse_unturnable,
    spin_path,
    spindle_axes,
)
from postproc.workflows.preparation import Prepared

MANY, SOME = 20_000, 1000
"""Places on paths from which on a turn is first looked at on some motions, and how many; a coarse scan follows."""

COARSE = 3
"""Steps of the grid of angles that a coarse scan makes at once."""

MOST_ROUNDS = 5
"""Times that a program is planned again without motions that its text cannot turn."""


@dataclass(frozen=True, eq=False)
class SpunPrograms:
    """figures: what it would bring; texts: file of a program -> what it would contain, empty where it is not worth it;
    unwritable: why it cannot be written."""

    figures: SpinFigures
    texts: Mapping[Path, bytes] = field(default_factory=dict)
    unwritable: Finding | None = None


def spin_programs(problem: PlaceProblem, place: Floats) -> SpunPrograms:
    """The programs with a tool that turns along the path, with the part at ``place`` (6,), and what they would cut.

    No cut has a larger error than with the tool as it is.  Raises Refusal PLC013 where no text can turn the tool,
    FIL008 where a text that was read back is not what was meant.
    """
    request, motions = problem.request, problem.motions
    before = prepared_at(problem.moved, place, request)
    now = figures_of(before, None)
    axes = [spindle_axes(ready) for ready in before]
    paths = [spin_path(ready, own) for ready, own in zip(before, axes, strict=True)]
    for ready, path in zip(before, paths, strict=True):
        refuse_unturnable(ready, path)
    value = now.figure(request.objective)
    many = len(motions) > MANY
    # the largest error of all motions is that of some, and no turn takes more from it than from these
    some = _some(problem, place) if many and request.objective != P95 else None
    scan, still, bound = _scanned(problem, place, some, COARSE if many and some is None else 1)
    if some is not None and not bound > WORTH * still:
        scan, still, bound = _scanned(problem, place, None, COARSE)
    figures = SpinFigures(value, bound=bound)
    if not np.isfinite(bound):
        reason = "a motion is closer to a limit or a singularity than the margin, however the tool is turned"
        return SpunPrograms(replace(figures, reason=reason))
    if bound > WORTH * still:
        reason = f"no turn leaves less than {bound / MM:.3f} of {still / MM:.3f} mm"
        return SpunPrograms(replace(figures, reason=reason))
    texts: dict[Path, bytes] = {}
    turns = []
    for k, ready in enumerate(before):
        own = np.flatnonzero(motions.program == k)
        turn, contents = _turned_program(ready, axes[k], paths[k], motions.take(own), scan.take(own))
        turns.append(turn)
        texts |= contents
    if not texts:
        reason = "no turn that is slow enough and keeps the margins leaves less"
        return SpunPrograms(replace(figures, reason=reason))
    after = prepared_at(problem.moved, place, request, texts)
    for one, other, own_axes in zip(before, after, axes, strict=True):
        check_turned(one, other, own_axes, writing_settings(one.cell, SHARED_POINTS))
    unwritable = None
    try:
        for one, other in zip(before, after, strict=True):
            check_forces(one, other)
    except Refusal as refusal:
        unwritable = refusal.findings[0]
    # the workpiece pushes as before, whatever a statement in the tool frame says now
    after = tuple(
        replace(other, task=replace(other.task, force=one.task.force))
        for one, other in zip(before, after, strict=True)
    )
    try:
        then = figures_of(after, request)
        refuse_collisions(problem.shapes, after)
    except Refusal as refusal:
        return SpunPrograms(replace(figures, reason=refusal.findings[0].message))
    if lost := _new_findings(before, after):
        return SpunPrograms(replace(figures, reason=lost))
    figures = replace(
        _with_turns(figures, paths, turns), after=then.figure(request.objective), error=then.error
    )
    if reason := _no_gain(now, then, request.objective):
        return SpunPrograms(replace(figures, reason=reason))
    return SpunPrograms(figures, texts, unwritable)


def _scanned(
    problem: PlaceProblem, place: Floats, rows: Ints | None, steps: int
) -> tuple[SpinScan, float, float]:
    """The scan of the motions ``rows`` (K,), of all without; [m] the objective with the tool as it is, and the least
    that any turn could leave, each motion turned as it is best for it; ``steps`` of the grid of angles at once."""
    motions, scoring = problem.motions, problem.scoring
    if rows is not None:
        motions, scoring = motions.take(rows), scoring.take(rows)
    scan = scan_spins(problem.model, motions, problem.room, scoring, place, steps * STEP)
    scan = scan.finer(steps) if steps > 1 else scan
    still = scan.error[len(scan.angle) // 2][motions.scored]
    least = np.where(scan.feasible, scan.error, np.inf)[:, motions.scored].min(axis=0)
    by_p95 = problem.request.objective == P95
    now, bound = (float(np.percentile(one, 95) if by_p95 else one.max()) for one in (still, least))
    return scan, now, bound


def _some(problem: PlaceProblem, place: Floats) -> Ints:
    """(K,) the motions with the largest errors at ``place`` (6,), and others evenly along the programs."""
    motions = problem.motions
    scores = score_places(problem.model, motions, problem.room, problem.scoring, place[None], detailed=True)
    assert scores.error is not None
    scored = np.flatnonzero(motions.scored)
    error = scores.error[0].mean(axis=1)[scored]
    chosen = [scored[np.argsort(-error)[:SOME]], scored[:: max(1, len(scored) // SOME)]]
    return motions.with_heads(np.unique(np.concatenate(chosen)))


def _turned_program(
    ready: Prepared, axes: Floats, path: SpinPath, motions: PartMotions, scan: SpinScan
) -> tuple[Floats, dict[Path, bytes]]:
    """(N,) [rad] turns at the ends of a program's motions and its files with them, no file where it does not turn."""
    nothing = np.zeros(len(path.step))
    for _ in range(MOST_ROUNDS):
        turns = plan_turns(ready, motions, scan, path)
        if turns is None:
            break
        contents, unwritten = _texts(ready, axes, turns)
        if not unwritten:
            return turns, contents
        locked = path.locked.copy()
        locked[[*unwritten]] = True
        path = replace(path, locked=locked)
    return nothing, {}


def _texts(ready: Prepared, axes: Floats, turns: Floats) -> tuple[dict[Path, bytes], Mapping[int, Finding]]:
    """The files of a program with its tool turned by ``turns`` (N,) [rad] about ``axes`` (N, 3); or the rows that
    cannot be written so, and why."""
    program, dialect = ready.program, ready.dialect
    path = program.toolpath
    rotation = np.array(path.programmed_rotation)
    rows = np.flatnonzero(np.abs(turns) > SAME)
    rotation[rows] = product(rotation[rows], rotation_from_vector(turns[rows, None] * axes[rows]))
    plan = replace(Plan.of(path), rotation=rotation)
    moved = dialect.edit_targets(program, plan, writing_settings(ready.cell, SHARED_POINTS))
    if moved.unwritten:
        return {}, moved.unwritten
    edits = Edits.joined(moved.edits)
    refuse_other(program, edits, dialect.letters)
    contents = edited_contents(program.documents, edits)
    return {document.path: raw for document, raw in zip(program.documents, contents, strict=True)}, {}


def _new_findings(before: Sequence[Prepared], after: Sequence[Prepared]) -> str:
    """The first thing that is wrong with the turned programs and not with those as they are; "" without."""
    for one, other in zip(before, after, strict=True):
        known = {(finding.code, finding.line) for finding in one.findings}
        for finding in other.findings:
            if finding.severity != "info" and (finding.code, finding.line) not in known:
                return f"line {finding.line}: {finding.message}"
    return ""


def _with_turns(figures: SpinFigures, paths: Sequence[SpinPath], turns: Sequence[Floats]) -> SpinFigures:
    """``figures`` with how far and how fast the tool turns."""
    per_length = per_time = 0.0
    for path, turn in zip(paths, turns, strict=True):
        step = np.abs(np.diff(turn, prepend=0.0))
        moves = path.length > 0
        rate = np.divide(step, path.length, out=np.zeros(len(step)), where=moves)
        per_length = max(per_length, float(rate.max(initial=0.0)))
        per_time = max(per_time, float(np.nan_to_num(rate * path.feed).max(initial=0.0)))
    every = np.concatenate(turns)
    return replace(
        figures,
        turn=(float(every.min()), float(every.max())),
        per_length=per_length,
        per_time=per_time,
        motions=int((np.abs(every) > SAME).sum()),
    )


def _no_gain(now: PlacedFigures, then: PlacedFigures, objective: str) -> str:
    """Why a turn is not worth it; "" where it is."""
    before, after = now.figure(objective), then.figure(objective)
    if not after <= WORTH * before:
        return f"it would leave {after / MM:.3f} of {before / MM:.3f} mm"
    for name, one, other in (
        ("largest error", now.error.max, then.error.max),
        ("largest error across the feed", now.across.max, then.across.max),
    ):
        if other > one * (1 + 1e-6):
            return f"the {name} would grow from {one / MM:.3f} to {other / MM:.3f} mm"
    return ""
