"""``compensate verify``: two written programs, run along their paths under the original's forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.paged_memory import large_arrays_in_files
from postproc.base.units import DEG, MM
from postproc.output.atomic_write import write_atomically
from postproc.report.report import Spread, exit_code, in_order_of_place, json_bytes
from postproc.report.verified import PathComparison, Verified, WorstError
from postproc.verification.approximation_words import other_words
from postproc.verification.differences import Difference, PathManner, in_air, missing, on_cuts
from postproc.verification.motion_ends import MotionEnds
from postproc.verification.pairing import Different, pair_motions
from postproc.verification.simulator import STEP, Simulation, Simulator
from postproc.workflows.preparation import (
    Prepared,
    Request,
    Stage,
    prepare,
    refuse_without_force,
    silent,
)
from postproc.workflows.stated_differences import mark_findings, statement_findings

WORST = 10
"""Places that are listed."""


def verify(
    request: Request,
    compensated: Path,
    step: float = STEP,
    stage: Stage = silent,
    page: Path | None = None,
) -> Verified:
    """The path error of ``request.program`` and of ``compensated``, both under the original's forces.

    ``step`` [m]: distance of the first samples; ``page``: file of the result for a browser.
    Raises Refusal, VER001 where the second does not come from the first.
    """
    with large_arrays_in_files(request.program, compensated):
        return _verify(request, compensated, step, stage, page)


def _verify(request: Request, compensated: Path, step: float, stage: Stage, page: Path | None) -> Verified:
    ready = prepare(request)
    refuse_without_force(request, ready)
    stage("reading the compensated program")
    other = prepare(_without_force(request, compensated, ready))
    try:
        pairing = pair_motions(ready.task, other.task)
    except Different as error:
        raise Refusal(
            Finding("VER001", str(error), str(request.program), error.line,
                    help="name the original first and the compensated program second, with the same cell")
        ) from None  # fmt: skip
    stage("simulating the original")
    simulator = Simulator.of(ready.task, pairing)
    cuts = pairing.stretches
    before = simulator.run(ready.task, cuts.start, cuts.stop, step)
    stage("simulating the compensated program")
    after = simulator.run(other.task, pairing.start, pairing.stop, step)
    manners = [PathManner.of(simulator, ready.task, before), PathManner.of(simulator, other.task, after)]
    findings = [
        *ready.findings,
        *_marks(ready, other, compensated),
        *statement_findings(
            ready.dialect.family,
            (ready.program, other.program),
            (ready.task.toolpath, other.task.toolpath),
            MotionEnds.of(simulator, other.task, after) if after.converged else None,
        ),
        *_figures(ready, ready, before, request.program, judged=False),
        *_figures(ready, other, after, compensated, judged=True),
        *_differences(simulator, ready, other, after, manners, request.program, compensated),
    ]
    ordered = in_order_of_place(findings)
    done = Verified(
        str(request.program),
        str(compensated),
        ready.robot.name,
        ready.wrenches.source,
        len(ready.task.toolpath),
        len(other.task.toolpath),
        step,
        ready.cell.tolerance,
        ready.cell.tolerance_angle,
        _path_comparison(simulator, ready, before, manners[0]),
        _path_comparison(simulator, other, after, manners[1]),
        ordered,
        exit_code(ordered, request.strict),
    )
    names = {"original": request.program, "compensated": compensated, "result (JSON)": request.json}
    files = {} if request.json is None else {request.json: json_bytes(done)}
    if page is not None:
        from postproc.report.page import beside  # these take their time to load
        from postproc.report.page_checks import verified_page

        files[page] = verified_page(done, beside(page, names))
    for inputs in (ready.inputs, other.inputs):
        inputs.refuse_outputs(list(files))
        inputs.refuse_changed()
    if files:
        write_atomically(files)
    return done


def _without_force(request: Request, compensated: Path, ready: Prepared) -> Request:
    """The compensated program in the cell of the original; its forces are those of the original's path."""
    cell = request.cell or _cell_of(ready)
    return replace(request, program=compensated, force=None, cell=cell, beside=request.program.parent)


def _cell_of(ready: Prepared) -> Path | None:
    return ready.cell.path if ready.cell.path.is_file() else None


def _path_comparison(
    simulator: Simulator, ready: Prepared, simulation: Simulation, manner: PathManner
) -> PathComparison:
    samples, cuts = simulation.samples, simulator.pairing.stretches
    none = Spread(np.nan, np.nan, np.nan)
    figures = simulation.converged and len(samples.motion) > 0
    ends = samples.first | samples.last
    tangent = simulator.path.tangent(samples.place.row[ends], samples.place.share[ends])
    along = np.abs(np.sum(samples.place.error[ends] * tangent, axis=1))
    off = np.append(samples.distance, simulation.point_error)
    return PathComparison(
        samples=len(off),
        error=Spread(float(off.max()), samples.rms, samples.percentile(0.95)) if figures
        else Spread.of(off) if simulation.converged else none,
        ends=Spread.of(samples.distance[ends]) if figures else none,
        along_at_ends=float(along.max(initial=0.0)) if figures else np.nan,
        missed=simulation.missed,
        turn=_largest_turn(simulation),
        change=simulation.change,
        change_turn=simulation.change_angle,
        stops=len(manner.stops),
        backwards=len(manner.backwards),
        approaches=len(simulation.approaches),
        approach_length=simulation.approach_length,
        unknown_corners=simulation.unknown,
        points_alone=int((cuts.stop - cuts.start)[~cuts.length & ~cuts.air].sum()),
        skipped=simulation.skipped,
        converged=simulation.converged,
        worst=_worst(simulator, ready, simulation),
    )  # fmt: skip


def _largest_turn(simulation: Simulation) -> float:
    """[rad]; NaN where it is not known."""
    if not simulation.converged or not len(simulation.samples.motion) + len(simulation.points):
        return float("nan")
    return float(np.append(simulation.samples.place.turn, simulation.point_turn).max())


def _worst(simulator: Simulator, ready: Prepared, simulation: Simulation) -> tuple[WorstError, ...]:
    """The motions with the largest errors."""
    samples = simulation.samples
    off = np.nan_to_num(samples.distance)
    in_base = np.einsum(
        "nji,nj->ni", simulator.original.base[samples.place.row].rotation, samples.place.error
    )
    worst: dict[int, WorstError] = {}
    for sample in np.argsort(-off, kind="stable"):
        if len(worst) == WORST or not simulation.converged:
            break
        motion = int(samples.motion[sample])
        if motion not in worst:
            axis = "XYZ"[int(np.argmax(np.abs(in_base[sample])))]
            line, force = int(ready.task.toolpath.line[motion]), float(samples.place.force[sample])
            worst[motion] = WorstError(line, float(off[sample]) / MM, axis, force)
    return tuple(worst.values())


def _marks(ready: Prepared, other: Prepared, compensated: Path) -> list[Finding]:
    if other.program.marker is not None:
        return mark_findings(other.program, ready.program, ready.robot)
    return [Finding("VER002", "this program has no mark of a compensation", str(compensated))]


def _figures(
    ready: Prepared, run: Prepared, simulation: Simulation, file: Path, judged: bool
) -> list[Finding]:
    """The findings on the figures of one program; ``judged``: its errors have to be within the tolerances."""
    samples, line = simulation.samples, run.task.toolpath.line
    findings: list[Finding] = []
    if not simulation.converged:
        lost = np.concatenate(
            [samples.motion[~samples.place.settled], simulation.points[np.isnan(simulation.point_error)]]
        )
        message = "force and place on the path do not converge, or the robot cannot reach the place"
        code, what = ("VER007", "no error") if judged else ("VER008", "no error before the correction")
        findings.append(_first(code, f"{message}; {what} is computed", file, line[np.unique(lost)]))
    elif judged:
        findings += _above(ready, run, simulation, file)
    if judged and simulation.skipped:
        message = f"{simulation.skipped} motions under force cannot be simulated: their places are not known"
        findings.append(Finding("VER004", message, str(file)))
    if judged and not len(samples.motion) + len(simulation.points):
        findings.append(
            Finding("VER004", "no motion under force is simulated: the force of all motions is 0", str(file))
        )
    return findings


def _above(ready: Prepared, run: Prepared, simulation: Simulation, file: Path) -> list[Finding]:
    """Errors above the tolerances."""
    samples, cell, findings = simulation.samples, ready.cell, []
    line = run.task.toolpath.line
    motions = np.append(samples.motion, simulation.points)
    off = np.append(samples.distance, simulation.point_error)
    turns = np.append(samples.place.turn, simulation.point_turn)
    if len(off) and off.max() > cell.tolerance:
        far = f"the tool is {off.max() / MM:.4f} mm off the path", f"tolerance {cell.tolerance / MM:g} mm"
        findings.append(_worst_of(far, off, cell.tolerance, motions, line, file))
    elif simulation.missed > cell.tolerance:
        message = f"a place of the path is {simulation.missed / MM:.4f} mm off the path of the tool"
        findings.append(Finding("VER003", f"{message}, tolerance {cell.tolerance / MM:g} mm", str(file)))
    if len(turns) and turns.max() > cell.tolerance_angle:
        far = (
            f"the tool is {turns.max() / DEG:.4f} deg off its orientation",
            f"tolerance {cell.tolerance_angle / DEG:g} deg",
        )
        findings.append(_worst_of(far, turns, cell.tolerance_angle, motions, line, file))
    return findings


def _worst_of(
    words: tuple[str, str], off: Floats, tolerance: float, motions: Ints, line: Ints, file: Path
) -> Finding:
    above = len(np.unique(motions[off > tolerance]))
    count = f"worst here; {above} motions exceed it" if above > 1 else "here only"
    message = f"{words[0]} ({count}), {words[1]}"
    return Finding("VER003", message, str(file), int(line[motions[int(np.argmax(off))]]))


def _differences(
    simulator: Simulator,
    ready: Prepared,
    other: Prepared,
    after: Simulation,
    manners: Sequence[PathManner],
    original: Path,
    compensated: Path,
) -> list[Finding]:
    """What differs beside places; one finding for all motions with the same difference."""
    differences = [*on_cuts(simulator, other.task, after), *in_air(simulator, other.task, after)]
    samples = after.samples
    # of a program that is beside its path none ends where it should
    if len(samples.motion) and samples.percentile(0.95) <= ready.cell.tolerance:
        differences += missing(simulator, after.samples)
    lines = {True: other.task.toolpath.line, False: ready.task.toolpath.line}
    files = {True: compensated, False: original}
    stated = other_words(*([one.raw for one in which.program.documents] for which in (ready, other)))
    if stated is not None:
        message = f"the program states another approximation: {stated[0]}"
        words = [Finding("VER005", message, str(compensated), stated[1])]
    else:
        words = []
    findings = words + _grouped(differences, lambda one: (one.what, one.run), lines, files)
    for what, name in (
        ("the motion leads against the feed", "backwards"),
        ("the motion has no length", "idle"),
    ):
        before, now = (getattr(manner, name) for manner in manners)
        if len(now) > len(before):
            more = f"; the original has {len(before)} such motions" if len(before) else ""
            findings.append(_first("VER006", what + more, compensated, lines[True][now]))
    return findings


def _grouped(
    differences: Sequence[Difference],
    key: Callable[[Difference], tuple[str, bool]],
    lines: dict[bool, Ints],
    files: dict[bool, Path],
) -> list[Finding]:
    groups: dict[tuple[str, bool], list[int]] = {}
    for one in differences:
        groups.setdefault(key(one), []).append(int(lines[one.run][one.row]))
    return [
        _first(
            "VER006" if what.startswith("the motion stops") else "VER005", what, files[run], np.unique(rows)
        )
        for (what, run), rows in groups.items()
    ]


def _first(code: str, message: str, file: Path, lines: Ints) -> Finding:
    """A finding at the first of these lines, which states how many there are."""
    more = f" ({len(lines)} motions, to line {lines.max()})" if len(lines) > 1 else ""
    return Finding(code, message + more, str(file), int(lines.min()) if len(lines) else 0)
