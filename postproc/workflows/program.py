"""The main job and its prediction, on paths.

Nothing is written that was not read back from its own bytes and checked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.blocks import give_back
from postproc.compensation.correct import Result, State, correct
from postproc.compensation.division import Division, Limits, divide, made
from postproc.compensation.doubt import doubt_of
from postproc.compensation.limits import limits
from postproc.compensation.task import Task
from postproc.dialects.dialect import Moved, Program
from postproc.document import Edits
from postproc.findings import Finding, Refusal
from postproc.geometry import lengths
from postproc.inputs import place
from postproc.publish import Content, publish
from postproc.report.diff import unified_diff
from postproc.report.files import corrections_csv
from postproc.report.page import beside, program_page
from postproc.report.page_data import page_data
from postproc.report.report import Link, Report, Spread, Worst, exit_code, in_order_of_place, json_bytes
from postproc.toolpath import Role
from postproc.units import DEG, MM
from postproc.workflows.preparation import Prepared, Request, Stage, completed, prepare, silent
from postproc.writing import Written, edited, planned, write, written_as

WORST_PLACES = 5


def predict(request: Request, stage: Stage = silent) -> Report:
    """The deflection at every pose; files only where ``report`` names a folder for them."""
    ready = prepare(request)
    stage("predicting")
    result = correct(replace(ready.task, gain=0.0))
    findings = in_order_of_place([*ready.findings, *result.findings])
    report = _report(request, ready, result, findings)
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
        files[shown] = program_page(page_data(ready.task, result, report, ready.program.documents), links)
    ready.inputs.refuse_changed()
    publish({**files, **dict.fromkeys(pages, json_bytes(report))}, still=ready.inputs.refuse_changed)
    return report


def compensate(request: Request, stage: Stage = silent) -> Report:
    """The main job: read, predict, correct, write, read back.

    ``stage`` is told what is being done.  Raises Refusal, and has then written nothing.
    """
    ready = prepare(request)
    program = ready.program
    if program.marker is not None and not request.again:
        line, column = program.documents[0].place(program.marker.start)
        raise Refusal(
            Finding(
                "FIL005",
                "this program carries the mark of an earlier compensation",
                str(request.program),
                line,
                column,
                help="compensate the original instead, or say --again if it is meant",
            )
        )
    stage("correcting")
    target = _target(request)
    task, result, division, edits = _corrected(request, ready, target.stem)
    stage("writing, and reading back")
    # Only writing needs it, and of a million motions it takes a tenth of a gigabyte.
    program = replace(program, text=None)
    ready = replace(ready, program=program)
    give_back()
    written = write(
        program,
        ready.dialect,
        task,
        result,
        division,
        edits,
        written_as(ready.cell, request.own_points),
        ready.settings,
        lambda path: completed(path, ready.cell, ready.robot, request.program),
    )
    result, division = written.result, written.division  # what was meant goes, before its place is needed
    give_back()
    findings = [*ready.findings, *result.findings, *division.findings, *_closing(request, ready, written)]
    paths = _output_paths(program, target)
    outputs = dict(zip(paths, written.contents, strict=True))
    stem = target.stem
    folder = request.report or target.parent
    names = [folder / f"{stem}.{end}" for end in ("report.json", "corrections.csv", "diff", "report.html")]
    names += [] if request.json is None else [request.json]
    stage("reporting")
    give_back()
    report = _report(request, ready, result, in_order_of_place(findings), written)
    if report.exit == 1:
        raise Refusal(*report.findings)
    report = replace(report, outputs=tuple(str(path) for path in (*paths, *names)))
    _not_over_inputs(ready, report.outputs)
    if request.dry_run:
        return replace(report, outputs=())
    diff = chain.from_iterable(
        unified_diff(document, path.name, edits.of(index), outputs[path])
        for index, (document, path) in enumerate(zip(program.documents, paths, strict=True))
    )
    files: dict[Path, Content] = {
        **outputs,
        names[0]: json_bytes(report),
        names[1]: corrections_csv(task, result, written.division, written.between),
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
        ),
        **dict.fromkeys(names[4:], json_bytes(report)),
    }
    ready.inputs.refuse_changed()
    give_back()
    publish(files, target, ready.inputs.refuse_changed)  # writing takes its time as well
    return report


def _corrected(request: Request, ready: Prepared, stem: str) -> tuple[Task, Result, Division, Edits]:
    """The correction and its edits; what can not be divided or written as planned stays, and the rest is made anew."""
    task, cell = ready.task, ready.cell
    allowed = Limits(request.keep_points, cell.min_segment, cell.max_growth)
    writing = written_as(cell, request.own_points)
    while True:
        result = correct(task)
        give_back()
        division = divide(task, result, allowed)
        give_back()
        told, beyond = limits(task, result, division)
        give_back()
        division = replace(division, findings=(*division.findings, *told))
        moved = Moved((), {**beyond, **division.held})
        if not moved.held:
            moved = ready.dialect.moved(ready.program, planned(task, division), writing)
        known = task.toolpath.refused
        held = {row: finding for row, finding in moved.held.items() if row not in known}
        if not moved.held:
            edits = edited(ready.program, ready.dialect, moved.edits, ready.robot, stem)
            return task, result, division, edits
        if not held:
            raise ValueError("motions that stay as they are were held again")
        task = replace(task, toolpath=replace(task.toolpath, refused={**known, **held}))


def _closing(request: Request, ready: Prepared, written: Written) -> list[Finding]:
    """What is to be said of the corrected program as a whole."""
    file, findings = str(request.program), []
    result, division = written.result, written.division
    path, tolerance = ready.task.toolpath, ready.cell.tolerance
    corrected = result.corrected
    if ready.task.process and not ready.wrenches.any:
        said = "--force was not given" if request.force is None else "no motion carries a force"
        findings.append(Finding("COR010", f"{said}: nothing is corrected", file))
    if division.inserted:
        links = int(division.links.sum())
        points = division.inserted - links
        first = int(division.source[np.argmax(division.role != Role.OWN)])
        findings.append(
            Finding(
                "COR012",
                f"{links} link{'' if links == 1 else 's'} where the correction steps, {points} points on the"
                f" way (the first one here): {len(division) / max(len(path), 1):.3f} times the motions",
                file,
                int(path.line[first]),
            )
        )
    if request.gain < 1.0:
        said = f"{request.gain:.0%} of the correction was applied, as asked"
        findings.append(Finding("COR007", said, file))
    told = "remain" if request.gain == 1.0 else "are beside what the gain leaves"
    turns = corrected & path.oriented
    for off, limit, rows, unit, word in (
        (written.off, tolerance, corrected, MM, "mm"),
        (written.off_angle, ready.cell.tolerance_angle, turns, DEG, "deg"),
    ):
        above = rows & ~(off <= limit)
        if above.any():
            row = int(np.argmax(np.where(above, np.nan_to_num(off, nan=np.inf), -1.0)))
            message = f"{off[row] / unit:.4f} {word} {told}, tolerance {limit / unit:g} {word}"
            message += f" ({int(above.sum())} motions)"
            findings.append(Finding("COR005", message, file, int(path.line[row])))
    between = np.nan_to_num(written.off_between)
    over = between > tolerance
    if over.any():
        worst = int(np.argmax(between))
        way = "the wanted way" if request.gain == 1.0 else "the way that the gain leaves"
        findings.append(
            Finding(
                "COR006",
                f"between its points the tool is up to {between[worst] / MM:.4f} mm from {way} (worst"
                f" here), tolerance {tolerance / MM:g} mm ({int(over.sum())} motions)",
                file,
                int(path.line[division.source[worst]]),
                help="no point may be inserted there (--keep-points, max_growth, min_segment, a spline, a TRIGGER), or"
                " the begin of the motion is not known",
            )
        )
    return findings


def _target(request: Request) -> Path:
    """Where the compensated program goes; a name without a suffix is a folder."""
    if request.output is None:
        folder = request.program.parent / "compensated"
        if folder.is_symlink():
            raise Refusal(
                Finding(
                    "FIL004",
                    "this folder is a link, which is not followed unasked",
                    str(folder),
                    help="name the folder with -o if it is meant",
                )
            )
        return folder / request.program.name
    if request.output.is_dir() or (request.program.suffix and not request.output.suffix):
        return request.output / request.program.name
    return request.output


def _output_paths(program: Program, target: Path) -> list[Path]:
    """Where the program's files go: companions beside it, under its stem, with their own suffix."""
    main = program.documents[0].path
    renamed = target.stem != main.stem
    companions = (document.path for document in program.documents[1:])
    return [target, *(target.with_name(target.stem + p.suffix if renamed else p.name) for p in companions)]


def _not_over_inputs(ready: Prepared, outputs: Sequence[str]) -> None:
    cell = ready.cell
    # a force may be a file, read in this run or not, or be said in numbers, which name none
    named = (cell.path.parent / said for said in (cell.force, cell.process) if said)
    ready.inputs.refuse_outputs(map(Path, outputs), named)
    if len({place(Path(output)) for output in outputs}) < len(outputs):
        raise Refusal(Finding("FIL007", "two outputs have one name", outputs[0]))


def _report(
    request: Request,
    ready: Prepared,
    result: Result,
    findings: tuple[Finding, ...],
    written: Written | None = None,
) -> Report:
    task, corrected = ready.task, written is not None
    scope = result.state != State.AIR
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
        links=_links(task, written.division) if written else (),
        left=int((result.state == State.LEFT).sum()),
        iterations=int(result.iterations.max(initial=0)),
        gain=request.gain,
        mode=ready.cell.correct,
        force_source=ready.wrenches.source,
        force_max_n=ready.wrenches.max_force,
        force_peak_n=ready.wrenches.peak_force,
        before=Spread.of(result.before[scope]),
        after=Spread.of(result.after[scope]) if corrected else None,
        between=Spread.of(written.between) if written else None,
        correction=Spread.of(size[result.corrected]) if corrected else None,
        angle_before_deg=_largest(result.before_angle[scope]) / DEG,
        angle_after_deg=_largest(result.after_angle[scope]) / DEG if corrected else None,
        worst=worst,
        doubt=doubt_of(task, result, ready.cell.force_ci95),
        model=_model(ready),
        digests={
            "robot": ready.robot.digest,
            **{document.path.name: document.digest for document in ready.program.documents},
        },
        findings=findings,
        exit=exit_code(findings, request.strict),
    )


def _largest_rows(values: Floats, mask: Bools, count: int) -> Ints:
    """The rows of the ``count`` largest of ``values`` (N,), the largest first, of those in ``mask`` that are known."""
    rows = np.flatnonzero(mask & np.isfinite(values))
    known = values[rows]
    if len(rows) > count:
        high = known >= np.partition(known, -count)[-count]
        rows, known = rows[high], known[high]
    return rows[np.argsort(-known, kind="stable")[:count]]


def _links(task: Task, division: Division) -> tuple[Link, ...]:
    links = np.flatnonzero(division.links)
    ways = made(task, division, links)
    length = np.linalg.norm(ways.end.position - ways.begin.position, axis=1) / MM
    lines = task.toolpath.line[division.source[links]]
    return tuple(Link(int(line), float(mm)) for line, mm in zip(lines, length, strict=True))


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
