"""``compensate learn``: a measured part to causes, a robot file, force factors and the next program, on paths."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import place
from postproc.base.paged_memory import large_arrays_in_files
from postproc.base.read_files import read_file
from postproc.base.system import relative_path
from postproc.base.units import MM
from postproc.learning.attribution import Attribution, attribute
from postproc.learning.causes import CausePrediction, PriorKnowledge
from postproc.learning.copied_parts import refuse_copied_parts
from postproc.learning.history import RecordedStep
from postproc.learning.measured_part import MeasuredPart, read_measured_part
from postproc.learning.other_readings import StatedPart, check_readings
from postproc.learning.plausible import FirstLook, check_deviations, check_explained, scatter_findings
from postproc.learning.promise import Promise, measured_rms, promise
from postproc.learning.push_test import with_push_test
from postproc.learning.unobserved import indistinct
from postproc.measurements import read_measurements
from postproc.output.atomic_write import replace_file, write_atomically
from postproc.report.learned import Learned, LearnedPart, learned_csv
from postproc.report.report import Report, exit_code, in_order_of_place, json_bytes
from postproc.robot.description import robot_of
from postproc.workflows.kinds import PART, check_kind
from postproc.workflows.learn_commands import cutting_file
from postproc.workflows.learn_history import (
    Remembered,
    keep_program,
    kept_before,
    record_path,
    record_step,
    remember,
)
from postproc.workflows.learn_inputs import learned_inputs, tool_remains, walls_of
from postproc.workflows.learn_points import CutProgram, Matched, match, read_job
from postproc.workflows.learn_robot import force_factor_lines, learned_robot_file
from postproc.workflows.learn_tool import tool_and_base_findings, tool_error_lines
from postproc.workflows.preparation import Request, Stage, silent
from postproc.workflows.program import compensate

SHOWN = 5


@dataclass(frozen=True)
class LearnRequest:
    """What the user asked for.  ``main``: the program, its cell, force and how it is written; ``measured``: files of
    parts that it cut; ``known_force``: half width of the 95 % interval of all forces as a share, as a gauge showed
    it; ``push``: readings of a push test; ``gain``: share of what was learnt that the next program applies;
    ``history``: file of the record of parts, beside the cell without; ``new_history``: whatever it holds; ``positive``:
    what a positive DEV of the files that are named is, stated again, "" without."""

    main: Request
    measured: tuple[Path, ...]
    known_force: float | None = None
    push: Path | None = None
    output: Path | None = None
    gain: float = 1.0
    history: Path | None = None
    new_history: bool = False
    positive: str = ""
    csv: Path | None = None
    page: Path | None = None
    json: Path | None = None
    strict: bool = False
    dry_run: bool = False


def learn(request: LearnRequest, stage: Stage = silent) -> Learned:
    """Causes, values and the next program.  Raises Refusal, and has then written nothing."""
    with large_arrays_in_files(request.main.program):
        return _learn(request, stage)


def _learn(request: LearnRequest, stage: Stage) -> Learned:
    main = request.main
    stage("reading")
    for path in request.measured:
        check_kind(path, PART)
    named = [read_measured_part(path) for path in request.measured]
    _check_parts(named, request.positive)
    job = read_job(main)
    record = request.history or record_path(job, main.program)
    remembered = remember(job, main, named, record, request.new_history, _folder(request))
    parts = remembered.parts
    refuse_copied_parts(parts)
    known = known_before(request, job)
    programs = [cutting_file(main.program, part, remembered.kept)[1] for part in parts]
    stage("matching points to motions")
    matched = match(main, job, parts, known, remembered.kept)
    prediction = CausePrediction(matched.points, job.ready.model, matched.causes)
    if request.push is not None:
        joints = [(joint.name, joint.kind != "revolute") for joint in job.ready.robot.joints]
        prediction = with_push_test(prediction, read_measurements(request.push, joints))
    file = str(parts[0].file)
    look = FirstLook.of(prediction, matched.deviation, matched.layout)
    stated = [
        StatedPart(
            matched.file == number,
            not part.cut_with,
            str(part.file),
            part.sign_seen,
            request.positive == part.sign,
            _largest(part),
        )
        for number, part in enumerate(parts)
    ]
    for part in stated:
        rows = np.flatnonzero(part.points)
        wrong = check_deviations(
            look.part(rows),
            [matched.feature[i] for i in rows],
            part.original,
            part.file,
            len(parts) > 1,
            part.sign_seen,
        )
        if wrong:
            raise Refusal(*wrong)
    stage("attributing")
    try:
        result = attribute(prediction, matched.deviation, matched.layout, matched.around)
    except np.linalg.LinAlgError as error:
        message = f"the deviations determine no causes: {error}"
        raise Refusal(Finding("LRN004", message, file, help="check DEV and the base of the points")) from None
    wrong = check_explained(result, file)
    readings = [] if wrong else check_readings(prediction, result, matched.around, stated, request.gain)
    wrong += [one for one in readings if one.severity == "error"]
    if wrong:
        raise Refusal(*wrong)
    last = matched.file == len(parts) - 1
    promised = promise(result, last, request.gain)
    promised, remains = tool_remains(job, matched, result.damped(request.gain), last, promised)
    history = _history(parts, programs, remembered, matched, result)
    findings = [*(f for part in parts for f in part.findings), *job.findings, *matched.findings]
    findings += [
        *readings,
        *remembered.findings,
        *_findings(parts, matched, result, promised),
        *_unkept(parts, history),
        *remains,
    ]
    lines = f"{main.program.stem}.tool_errors.yaml"
    findings += tool_and_base_findings(result, file, lines)
    learned = Learned(
        program=str(main.program),
        robot=job.ready.robot.name,
        data=tuple((part.file.name, part.digest) for part in parts),
        measured=matched.measured,
        attribution=result,
        feature=matched.feature,
        line=matched.line,
        file=matched.file,
        operation=tuple(job.operations.names[i] for i in matched.operation.tolist()),
        program_line=job.ready.task.toolpath.line[matched.points.row],
        in_base=(matched.points.point - job.ready.task.base[matched.points.row[:1]].position) @ matched.axes,
        promise=promised,
        history=history,
        gain=request.gain,
        findings=in_order_of_place(findings),
        exit=exit_code(findings, request.strict),
    )
    return _published(request, job, matched, (remembered, programs), learned, stage)


def _largest(part: MeasuredPart) -> str:
    """X Y Z [mm] of the largest deviation."""
    return " ".join(f"{one:.3f}" for one in part.point[np.argmax(np.abs(part.deviation))] / MM)


def _folder(request: LearnRequest) -> Path:
    """Of the next program."""
    return request.output or request.main.program.parent / "learned"


def _history(
    parts: Sequence[MeasuredPart],
    programs: Sequence[str],
    remembered: Remembered,
    matched: Matched,
    result: Attribution,
) -> tuple[LearnedPart, ...]:
    """Each part with its error, and what was promised of it."""
    rows = []
    for number, (part, program) in enumerate(zip(parts, programs, strict=True)):
        step = remembered.history.promised(program)
        ends = None if step is None else (step.lower_rms_mm * MM, step.upper_rms_mm * MM)
        rows.append(LearnedPart(part.file.name, program, measured_rms(result, matched.file == number), ends))
    return tuple(rows)


def _unkept(parts: Sequence[MeasuredPart], history: Sequence[LearnedPart]) -> list[Finding]:
    """Parts that exceed what was promised of them."""
    findings = []
    for part, one in zip(parts, history, strict=True):
        if one.promised is not None and one.rms > one.promised[1]:
            most = f"{one.promised[1] / MM:.3f} mm"
            message = f"this part has {one.rms / MM:.3f} mm RMS where at most {most} were promised"
            findings.append(Finding("LRN017", message, str(part.file)))
    return findings


def _check_parts(parts: Sequence[MeasuredPart], positive: str) -> None:
    """A part that is named twice would count twice, and a sign that is stated again must be that of each file.  Raises
    Refusal LRN001."""
    seen: dict[str, MeasuredPart] = {}
    for part in parts:
        other = seen.setdefault(part.digest, part)
        if other is not part:
            message = f"{part.file.name} has the same content as {other.file.name}"
            raise Refusal(Finding("LRN001", message, str(part.file), help="name each part once"))
        if positive and positive != part.sign:
            message = f"the file states that a positive DEV is {part.sign}, the command that it is {positive}"
            help = "one of them is wrong: look at a place of the part with a large deviation again"
            raise Refusal(Finding("LRN001", message, str(part.file), help=help))


def known_before(request: LearnRequest, job: CutProgram) -> PriorKnowledge:
    """What the command, the cell or the process states of the forces."""
    cell = job.ready.cell
    own = cell.force_ci95 if request.known_force is None else request.known_force
    if own is None and job.ready.wrenches.ci95 is not None:
        stated = job.ready.wrenches.ci95[job.ready.wrenches.carries]
        own = None if np.isnan(stated).any() or not len(stated) else float(stated.max())
    vector = cell.force_vector
    return PriorKnowledge(own, 0.0 if vector is None else vector.direction)


def _findings(
    parts: Sequence[MeasuredPart], matched: Matched, result: Attribution, promised: Promise
) -> list[Finding]:
    findings = []
    file = str(parts[0].file)
    out = np.flatnonzero(~result.kept)
    for number in out[:SHOWN].tolist():
        message = f"the deviation {matched.deviation[number] / MM:+.3f} mm is an outlier, and is excluded"
        help = ""
        if matched.around.corner[number] > 0.0 and "corner_force" not in result.effect_names:
            message += "; it is in a corner, where a larger force would do this too"
            help = "measure more points in the corners; they show which of the two it is"
        findings.append(
            Finding(
                "LRN006", message, str(parts[matched.file[number]].file), int(matched.line[number]), help=help
            )
        )
    if len(out) > SHOWN:
        findings.append(
            Finding("LRN006", f"{len(out) - SHOWN} more points are outliers, and are excluded", file)
        )
    if any(not part.cut_with for part in parts):
        message = (
            "a part was cut by the uncompensated program: its forces are those of the engagement that it had"
        )
        findings.append(Finding("LRN014", message, file))
    for one in result.named:
        findings.append(
            Finding("LRN012", f"{one.name} is named: exp({one.gain:.1f}) times likelier than without", file)
        )
    if result.alternatives:
        names = ", ".join(result.alternatives)
        findings.append(Finding("LRN013", f"{names}: the points cannot distinguish these effects", file))
    if result.verdict in ("unknown", "partly_named") and result.surface.size > 0:
        size = float(np.sqrt(np.mean(result.by_field**2)))
        message = f"a smooth error of {size / MM:.3f} mm RMS has no name; it is corrected at this place only"
        findings.append(Finding("LRN010", message, file))
    findings += scatter_findings(result, file)
    words = indistinct(result)
    if words:
        findings.append(Finding("LRN008", words, file))
    if not promised.better:
        findings.append(_no_better(promised, file))
    return findings


def _no_better(promised: Promise, file: str) -> Finding:
    message = (
        f"the next part would have {promised.after / MM:.3f} mm RMS where this one has"
        f" {promised.before / MM:.3f} mm: the next program is not written"
    )
    return Finding("LRN009", message, file)


def _published(
    request: LearnRequest,
    job: CutProgram,
    matched: Matched,
    cut: tuple[Remembered, Sequence[str]],
    learned: Learned,
    stage: Stage,
) -> Learned:
    """Writes the next program by the main job, then what was learnt; cut: the parts, and what cut each of them."""
    if learned.exit == 1:
        return learned
    (remembered, programs), parts = cut, cut[0].parts
    main, result, folder, robot = request.main, learned.attribution, _folder(request), job.ready.robot
    stem = robot.path.stem.removesuffix("_learned")
    robot_path = folder / f"{stem}_learned.yaml"
    gap = {"before_rms_mm": learned.promise.before / MM, "after_rms_mm": learned.residual_rms / MM}
    content = learned_robot_file(result, robot, parts, gap, robot_path)
    factors = force_factor_lines(result, parts, job.ready.cell)
    files: dict[Path, bytes] = {}
    if content is not None:
        files[robot_path] = content
    if factors:
        files[folder / f"{main.program.stem}.force_factors.yaml"] = factors
    if tools := tool_error_lines(result, parts, job.ready.cell, walls_of(result, job)):
        files[folder / f"{main.program.stem}.tool_errors.yaml"] = tools
    own = folder / f"{main.program.stem}.learned.json"
    extra = [path for path in (request.csv, request.page, request.json) if path is not None]
    _spare(request, job, parts, [*files, own, *extra, remembered.path])
    applied = result.damped(request.gain)
    inputs = learned_inputs(job, matched, applied)
    acting = content
    if request.gain != 1.0 or result.stand_in:
        acting = learned_robot_file(applied, robot, parts, gap, robot_path, at_this_place=True) or content
    if acting is not None:
        inputs = replace(inputs, robot=robot_of(acting, robot_path))
    following = folder / main.program.name
    if learned.promise.better:
        stage("compensating the next program")
        asked = replace(main, output=following, learned=inputs, keep_table=True, json=None)
        report = compensate(replace(asked, dry_run=True), stage)
        learned = _with_uncorrected(learned, report, matched, str(parts[-1].file))
        if learned.promise.better:
            if not request.dry_run:
                stage("writing the next program")
                with kept_before(following):
                    report = compensate(asked, stage)
            learned = replace(learned, next_program=report)
        findings = in_order_of_place([*learned.findings, *report.findings])
        learned = replace(learned, findings=findings, exit=exit_code(findings, request.strict))
    if request.dry_run:
        return learned
    outputs = () if learned.next_program is None else learned.next_program.outputs
    learned = replace(learned, outputs=(*outputs, *map(str, [*files, own, *extra, remembered.path])))
    files[own] = json_bytes(learned)
    if request.csv is not None:
        files[request.csv] = learned_csv(learned)
    if request.page is not None:
        from postproc.workflows.learn_page import page_of

        links = {
            "next program": None if learned.next_program is None else following,
            "robot file": robot_path if robot_path in files else None,
            "points (CSV)": request.csv,
            "result (JSON)": own,
        }
        files[request.page] = page_of(learned, job, matched, request.page, links)
    if request.json is not None:
        files[request.json] = json_bytes(learned)
    kept = keep_program(following) if learned.next_program is not None else None
    record = record_step(remembered, programs, _step(learned, remembered.path, kept))
    if request.new_history and remembered.raw is not None:
        files[remembered.path.with_suffix(".json.old")] = remembered.raw
    job.ready.inputs.refuse_changed()
    write_atomically(files, last=own, still=remembered.refuse_changed)
    replace_file(remembered.path, record.as_bytes(), remembered.refuse_changed)
    return learned


def _with_uncorrected(learned: Learned, report: Report, matched: Matched, file: str) -> Learned:
    """What was learnt, with the promise of a next program that leaves motions as they are; ``file``: of the part that
    was cut last."""
    result = learned.attribution
    own = np.flatnonzero(result.kept & (matched.file == len(learned.data) - 1))
    row, table = matched.points.row[own], report.table()
    uncorrected = np.isin(table["state"][row], ("uncorrected", "off"))
    if not uncorrected.any():
        return learned
    moved = MM * np.column_stack([table[f"deflection_{axis}_mm"][row] for axis in "xyz"])
    error = np.nan_to_num(np.sum(moved * (matched.points.normal[own] @ matched.axes), axis=1))
    promised = learned.promise.with_uncorrected(error, ~uncorrected, result.layout.free[own])
    message = (
        f"{int(uncorrected.sum())} of {len(own)} points lie on motions that the next program does not correct;"
        f" with them the promise were {learned.promise.after / MM:.3f} mm RMS"
    )
    line = int(learned.program_line[own][uncorrected].min())
    findings = [*learned.findings, Finding("LRN021", message, learned.program, line)]
    if not promised.better:
        findings.append(_no_better(promised, file))
    return replace(learned, promise=promised, findings=tuple(findings))


def _step(learned: Learned, record: Path, kept: Path | None) -> RecordedStep:
    """This run, for the record; kept: the copy of the next program."""
    ends = learned.promise
    after, lower, upper = (round(value / MM, 6) for value in (ends.after, ends.lower, ends.upper))
    step = RecordedStep(len(learned.data), learned.attribution.verdict, after, lower, upper)
    if kept is None:
        return step
    digest = hashlib.sha256(read_file(kept)).hexdigest()
    return replace(step, file=Path(relative_path(kept, record.parent)).as_posix(), sha256=digest)


def _spare(
    request: LearnRequest, job: CutProgram, parts: Sequence[MeasuredPart], outputs: Sequence[Path]
) -> None:
    """Raises Refusal FIL007 for an output that is an input, or that is named twice."""
    push = [] if request.push is None else [request.push]
    job.ready.inputs.refuse_outputs(outputs, [*(part.file for part in parts), *push])
    if len({place(path) for path in outputs}) < len(outputs):
        raise Refusal(Finding("FIL007", "two results have the same name", str(outputs[0])))
