"""The main job and its prediction, on paths.

Nothing is written that was not read back from its own bytes and checked.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place
from postproc.base.memory import release_free_memory
from postproc.base.paged_memory import large_arrays_in_files
from postproc.compensation.axis_limits import check_limits
from postproc.compensation.corner_fit import corners_not_improved, fit_corners
from postproc.compensation.correct import CorrectionResult, MotionOutcome, as_air, correct
from postproc.compensation.path_comparison import cuts_not_improved
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramp_points import LeastPoints
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.languages.dialect import EditedTargets, Program
from postproc.output.atomic_write import Content, write_atomically
from postproc.output.write import (
    IntendedProgram,
    WrittenProgram,
    edit_program,
    plan_motions,
    write,
    writing_settings,
)
from postproc.report.corrections_csv import correction_table, corrections_csv
from postproc.report.diff import unified_diff
from postproc.report.page import beside, program_page
from postproc.report.page_data import page_data
from postproc.report.part_mesh import MESHES, part_mesh
from postproc.report.report import Report, in_order_of_place, json_bytes
from postproc.workflows.closing_findings import closing_findings
from postproc.workflows.figures import report_of
from postproc.workflows.part import part_error_of
from postproc.workflows.preparation import (
    Prepared,
    Request,
    Stage,
    completed,
    prepare,
    refuse_without_force,
    silent,
)
from postproc.workflows.ramp_lengths import nearest_point
from postproc.workflows.replaced_reports import replaced_reports

if TYPE_CHECKING:
    from postproc.part.part_figures import PartFigures

LEAST = 200
"""Motions that may be inserted into any program where the cell does not limit its growth: a controller holds them."""


def predict(request: Request, stage: Stage = silent) -> Report:
    """The deflection at every pose; files only where ``report`` names a folder for them."""
    with large_arrays_in_files(request.program):
        return _predict(request, stage)


def _predict(request: Request, stage: Stage) -> Report:
    ready = prepare(request)
    refuse_without_force(request, ready)
    stage("predicting")
    result = _correct(ready, replace(ready.task, gain=0.0))
    part, of_part = part_error_of(ready, None)
    of_reports = []
    if request.report:
        of_reports = replaced_reports(
            request.report / f"{request.program.stem}.prediction.json", request.program
        )
    findings = in_order_of_place([*ready.findings, *result.findings, *of_part, *of_reports])
    report = report_of(request, ready, result, findings, part=None if part is None else part.figures)
    if request.keep_table:
        report = replace(report, motion_table=correction_table(ready.task, result))
    files: dict[Path, Content] = {}
    pages = [] if request.json is None else [request.json]
    shown: Path | None = None
    if request.report:
        files[request.report / f"{request.program.stem}.deflection.csv"] = corrections_csv(ready.task, result)
        pages.append(request.report / f"{request.program.stem}.prediction.json")
        shown = request.report / f"{request.program.stem}.prediction.html"
    names = [*files, *pages, *([shown] if shown else [])]
    report = replace(report, outputs=tuple(str(path) for path in names))
    _not_over_inputs(ready, report.outputs)
    if shown:
        links = beside(shown, {"deflections (CSV)": names[0], "result (JSON)": pages[-1]})
        drawn = page_data(ready.task, result, report, ready.program.documents)
        files[shown] = program_page(drawn, links, part, ready.task)
    ready.inputs.refuse_changed()
    write_atomically({**files, **dict.fromkeys(pages, json_bytes(report))}, still=ready.inputs.refuse_changed)
    return report


def compensate(request: Request, stage: Stage = silent) -> Report:
    """The main job: read, predict, correct, write, read back.

    ``stage`` is called with what is being done.  Raises Refusal, and has then written nothing.
    """
    with large_arrays_in_files(request.program):
        return _compensate(request, stage)


def _compensate(request: Request, stage: Stage) -> Report:
    ready = prepare(request)
    program = ready.program
    if program.marker is not None and not request.allow_compensated:
        line, column = program.documents[0].place(program.marker.start)
        raise Refusal(
            Finding(
                "FIL005",
                "this program contains the mark of an earlier compensation",
                str(request.program),
                line,
                column,
                help="compensate the original instead, or use --allow-compensated if this is intended",
            )
        )
    refuse_without_force(request, ready)
    stage("correcting")
    target = _target(request)
    excluded: dict[int, Finding] = {}
    least: dict[tuple[int, float], int] = {}
    while True:
        intended = _corrected(request, ready, target.stem, excluded, least)
        task, edits = intended.task, intended.edits
        stage("writing, and reading back")
        ready = ready.without_text()
        release_free_memory()
        written = write(
            ready.program,
            ready.dialect,
            intended,
            writing_settings(ready.cell, request.shared_points),
            ready.settings,
            partial(completed, cell=ready.cell, robot=ready.robot, program=request.program),
        )
        del intended  # before its place is needed
        result, division = written.result, written.division
        release_free_memory()
        worse = cuts_not_improved(task, result, division, written.error_between, written.across_before)
        corners = corners_not_improved(task, division)
        if not worse and not corners:
            break
        excluded |= worse
        least |= corners
        stage("correcting without what would be no better")
        ready = ready.with_text()
    program = ready.program
    findings = [
        *ready.findings,
        *result.findings,
        *division.findings,
        *closing_findings(request, ready, written),
    ]
    if ready.task.force.stock is not None:
        stage("cutting the part")
    part, of_part = part_error_of(ready, division)
    findings += of_part
    shown = None if part is None else part.figures
    paths = _output_paths(program, target)
    outputs = dict(zip(paths, written.contents, strict=True))
    stem = target.stem
    folder = request.report or target.parent
    names = [folder / f"{stem}.{end}" for end in ("report.json", "corrections.csv", "diff", "report.html")]
    names += [] if request.json is None else [request.json]
    if request.stream is not None:
        if request.report is not None:
            findings += replaced_reports(names[0], request.program)
        return _streamed(request, ready, written, in_order_of_place(findings), shown)
    findings += replaced_reports(names[0], request.program, target)
    stage("reporting")
    release_free_memory()
    report = report_of(request, ready, result, in_order_of_place(findings), written, shown)
    if report.exit == 1:
        raise Refusal(*report.findings)
    meshes = {} if part is None else {folder / f"{stem}.part.{end}": end for end in MESHES}
    report = replace(report, outputs=tuple(str(path) for path in (*paths, *names, *meshes)))
    if request.keep_table:
        table = correction_table(task, result, written.division, written.path_error)
        report = replace(report, motion_table=table)
    _not_over_inputs(ready, report.outputs)
    _refuse_suffix(target, ready)
    if request.dry_run:
        return _result_alone(request, ready, report)
    diff = chain.from_iterable(
        unified_diff(document, path.name, edits.of(index), outputs[path])
        for index, (document, path) in enumerate(zip(program.documents, paths, strict=True))
    )
    files: dict[Path, Content] = {
        **outputs,
        names[0]: json_bytes(report),
        names[1]: corrections_csv(task, result, written.division, written.path_error),
        names[2]: diff,
        names[3]: program_page(
            page_data(task, result, report, program.documents, written),
            beside(
                names[3],
                {
                    "difference": names[2],
                    "corrections (CSV)": names[1],
                    "result (JSON)": names[0],
                    "compensated program": target,
                },
            ),
            part,
            task,
        ),
        **dict.fromkeys(names[4:], json_bytes(report)),
    }
    if part is not None:
        files |= {path: part_mesh(part, end) for path, end in meshes.items()}
    release_free_memory()
    write_atomically(files, target, ready.inputs.refuse_changed)
    return report


def _result_alone(request: Request, ready: Prepared, report: Report) -> Report:
    """The report of a dry run, which writes the result that is asked for by name, and nothing else."""
    report = replace(report, outputs=() if request.json is None else (str(request.json),))
    if request.json is not None:
        write_atomically({request.json: json_bytes(report)}, still=ready.inputs.refuse_changed)
    return report


def _streamed(
    request: Request,
    ready: Prepared,
    written: WrittenProgram,
    findings: tuple[Finding, ...],
    part: PartFigures | None,
) -> Report:
    """The report of a program whose bytes go to the request's stream; its reports only where a folder is named."""
    documents, contents = ready.program.documents, written.contents
    for document, content in zip(documents[1:], contents[1:], strict=True):
        if content != document.raw:
            message = f"{document.path.name} changes with the program, and a stream has no second file"
            raise Refusal(Finding("FIL012", message, str(document.path), help="name a folder with -o"))
    report = report_of(request, ready, written.result, findings, written, part)
    if report.exit == 1:
        raise Refusal(*report.findings)
    pages = [] if request.json is None else [request.json]
    files: dict[Path, Content] = {}
    if request.report is not None:
        place = request.report / request.program.stem
        pages.append(place.with_name(f"{place.name}.report.json"))
        files[place.with_name(f"{place.name}.corrections.csv")] = corrections_csv(
            written.task, written.result, written.division, written.path_error
        )
    report = replace(report, outputs=tuple(map(str, [*files, *pages])))
    _not_over_inputs(ready, report.outputs)
    if request.dry_run:
        return _result_alone(request, ready, report)
    ready.inputs.refuse_changed()
    if files or pages:
        files |= dict.fromkeys(pages, json_bytes(report))
        write_atomically(files, still=ready.inputs.refuse_changed)
    if request.stream is not None:
        request.stream(contents[0])
    return report


def _corrected(
    request: Request,
    ready: Prepared,
    stem: str,
    worse: Mapping[int, Finding],
    least: LeastPoints,
) -> IntendedProgram:
    """The correction and its edits; what cannot be divided or written as planned stays, and the rest is computed again.
    worse: rows whose cuts stay as they are, and why; least: of corners that were no better, their points."""
    task, cell = ready.task, ready.cell
    if worse:
        path = task.toolpath
        task = replace(task, toolpath=path.with_refused({**worse, **path.constraints.refused}))
    allowed = Limits(
        request.no_insert,
        cell.min_segment,
        cell.max_growth,
        1e-3 * cell.cycle_ms,
        0 if cell.growth_stated else LEAST,
        nearest_point(cell),
    )
    writing = writing_settings(cell, request.shared_points)
    while True:
        result = _correct(ready, task)
        if task.gain == 0.0:  # as asked: nothing moves, nothing is inserted
            result = replace(
                result, state=np.where(result.corrected, MotionOutcome.OFF, result.state).astype(np.int8)
            )
        release_free_memory()
        division = subdivide(task, result, allowed)
        result = as_air(result, division.lead_ins)
        release_free_memory()
        result, division = fit_corners(task, result, division, allowed, least)
        release_free_memory()
        limit_findings, beyond = check_limits(task, division)
        release_free_memory()
        division = replace(division, findings=(*division.findings, *limit_findings))
        moved = EditedTargets((), {**beyond, **division.not_refined})
        if not moved.unwritten:
            moved = ready.dialect.edit_targets(ready.program, plan_motions(task, division), writing)
        known = task.toolpath.constraints.refused
        unwritten = {row: finding for row, finding in moved.unwritten.items() if row not in known}
        if not moved.unwritten:
            edits = edit_program(ready.program, ready.dialect, moved.edits, ready.robot, stem)
            return IntendedProgram(task, result, division, edits)
        if not unwritten:
            raise ValueError("motions that are not corrected are refused again")
        task = replace(task, toolpath=task.toolpath.with_refused({**known, **unwritten}))


def _correct(ready: Prepared, task: CompensationProblem) -> CorrectionResult:
    """``correct``.  A Refusal also has the warnings about the forces: what is beyond any robot follows from them."""
    try:
        return correct(task)
    except Refusal as refusal:
        warnings = [one for one in ready.wrenches.findings if one.severity == "warning"]
        raise Refusal(*refusal.findings, *warnings) from refusal


def _target(request: Request) -> Path:
    """Where the compensated program goes; a name without a suffix is a folder."""
    if request.output is None:
        folder = request.program.parent / "compensated"
        if folder.is_symlink():
            raise Refusal(
                Finding(
                    "FIL004",
                    "this folder is a symbolic link, which is not followed by default",
                    str(folder),
                    help="name the folder with -o if it is intended",
                )
            )
        return folder / request.program.name
    if os.path.isdir(request.output) or (request.program.suffix and not request.output.suffix):
        return request.output / request.program.name
    return request.output


def _refuse_suffix(target: Path, ready: Prepared) -> None:
    """Raises Refusal FIL014 where the controller would not load a file of this name, and the program's own it may."""
    known, own = ready.dialect.suffixes, ready.program.documents[0].path.suffix
    if known and target.suffix.lower() not in (*known, own.lower()):
        family = ready.dialect.family
        message = (
            f"the suffix of the output is {target.suffix!r}, that of a {family} program {' or '.join(known)}"
        )
        help = f"name it {target.with_suffix(own).name}"
        raise Refusal(Finding("FIL014", message, str(target), help=help))


def _output_paths(program: Program, target: Path) -> list[Path]:
    """Where the program's files go: companions beside it, under its stem, with their own suffix."""
    main = program.documents[0].path
    renamed = target.stem != main.stem
    companions = (document.path for document in program.documents[1:])
    return [target, *(target.with_name(target.stem + p.suffix if renamed else p.name) for p in companions)]


def _not_over_inputs(ready: Prepared, outputs: Sequence[str]) -> None:
    cell = ready.cell
    # a force may be a file, read in this run or not, or be stated in numbers, which name none
    named = [cell.path.parent / name for name in (cell.force, cell.process) if name]
    ready.inputs.refuse_outputs(map(Path, outputs), named)
    if len({place(Path(output)) for output in outputs}) < len(outputs):
        raise Refusal(Finding("FIL007", "two outputs have the same name", outputs[0]))
