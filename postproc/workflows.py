"""Each command as a function on paths.

Reading, predicting and correcting are done by the rooms below; here they are put in their order, and nothing is
written that was not read back from its own bytes and checked.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.arrays import Floats
from postproc.cell import Cell, Frames, find_cell, frames_of, load_cell
from postproc.compensation.correct import Result, State, Task, correct
from postproc.compensation.doubt import doubt_of
from postproc.dialects import detect
from postproc.dialects.dialect import Dialect, Program
from postproc.document import Document
from postproc.effects import Conditions
from postproc.findings import Finding, Refusal
from postproc.forces import Wrenches, is_no_force, wrenches
from postproc.geometry import Poses, rotation_from_abc
from postproc.model import StiffnessModel, approach
from postproc.publish import publish
from postproc.report.checked import Checked
from postproc.report.files import corrections_csv, unified_diff
from postproc.report.report import Report, Spread, Worst, exit_code, in_order_of_place
from postproc.report.workspace import Mapped, map_csv, slices_shown
from postproc.robot.description import Robot, find_robot, load_robot, robot_files
from postproc.robot.geometries import SerialArm
from postproc.robot.track import Track, all_axes, follow, nominal_flange
from postproc.toolpath import Kind, Toolpath
from postproc.units import DEG, MM
from postproc.workspace import Grid, Load, Survey, has_compensator, survey, with_sign
from postproc.writing import write

WORST_PLACES = 5

Stage = Callable[[str], None]
"""Is told the name of each stage as it begins."""


@dataclass(frozen=True)
class Request:
    """What the user asked for.  ``force``: None without ``--force``, "" for a bare one, else its value."""

    program: Path
    force: str | None = None
    cell: Path | None = None
    robot: str | None = None
    gain: float = 1.0
    output: Path | None = None
    report: Path | None = None
    strict: bool = False
    dry_run: bool = False
    again: bool = False
    json: Path | None = None


@dataclass(frozen=True)
class MapRequest:
    """A map that the user asked for: per axis of the robot base one value or (from, to), each range in ``points``."""

    robot: str
    ranges_mm: tuple[tuple[float, ...], ...]
    points: int
    tool_mm_deg: tuple[float, ...]
    orientation_deg: tuple[float, ...]
    wrench: tuple[float, ...]
    frame: str
    linear: bool = False
    sign: str | None = None
    ignore_limits: bool = False
    status: int | None = None
    picture: Path | None = None
    csv: Path | None = None
    json: Path | None = None


@dataclass(frozen=True)
class Prepared:
    """A program with all that predicts it."""

    program: Program
    dialect: Dialect
    cell: Cell
    robot: Robot
    model: StiffnessModel
    wrenches: Wrenches
    task: Task
    findings: tuple[Finding, ...]


def read_program(path: Path) -> tuple[Dialect, Program]:
    """Read a program and what belongs to it.  Raises Refusal FIL001, FIL002, FIL003."""
    main = _document(path)
    if not main.raw.strip():
        raise Refusal(Finding("FIL002", "the file is empty", str(path)))
    dialect = detect(path, main.raw)
    documents = (main, *(_document(companion) for companion in dialect.companions(path)))
    return dialect, dialect.read(documents)


def _document(path: Path) -> Document:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise Refusal(Finding("FIL001", f"can not be read: {error.strerror}", str(path))) from None
    if b"\0" in raw:
        at = raw.index(b"\0")
        raise Refusal(Finding("FIL003", f"NUL at byte {at}: no text of a program", str(path)))
    return Document(path, raw)


def prepare(request: Request) -> Prepared:
    """Read program, cell and robot, and find force and axes of every motion."""
    dialect, read = read_program(request.program)
    cell = _cell(request)
    beside = None if request.robot else cell.path.parent
    robot = load_robot(find_robot(cell.robot, beside))
    full = StiffnessModel.from_robot(robot)
    process = cell.correct == "process"
    own: list[str] = []
    if not process and cell.controller.absolute_accuracy:
        own.append("geometric")
    if not process and cell.controller.gravity_compensated:
        own.append("weight")
    gravity = cell.robot_base.rotation.T @ full.gravity
    model = replace(full.without(families=own), gravity=gravity)

    path = completed(read.toolpath, cell, robot, request.program)
    program = replace(read, toolpath=path)
    if not len(path) and not is_no_force(request.force):
        raise Refusal(
            Finding("FIL009", f"no motion was found (read as {dialect.name})", str(request.program)),
            *program.findings,
        )
    frames = frames_of(cell, path, request.program)
    force = wrenches(request.program, path, frames, cell, request.force)
    _missing_points(program, force)
    base, tool = frames.base_in_robot, frames.tool_in_flange
    wanted = base @ path.target_in_base
    track = follow(robot, path, wanted @ tool.inverse(), _start(cell, robot))
    task = Task(
        file=str(request.program),
        toolpath=path,
        model=model,
        track=track,
        wanted=wanted,
        base=base,
        tool=tool,
        wrench=force.values,
        carries=force.carries,
        conditions=_conditions(request, path, cell, frames, model, force, track.q),
        process=process,
        gain=request.gain,
        max_correction=cell.max_correction,
        tolerance=cell.tolerance,
    )
    findings = [*program.findings, *force.findings, *model.doubts()]
    findings += _disagreeing(request.program, path, track)
    return Prepared(program, dialect, cell, robot, model, force, task, tuple(findings))


def _disagreeing(program: Path, path: Toolpath, track: Track) -> list[Finding]:
    """What S and T state with a motion, and the axes that bring the robot there, disagree on (KIN007)."""
    # A path motion keeps the branch that the robot is in, whatever its S says.
    elsewhere = (path.status >= 0) & (track.status >= 0) & (path.status & 7 != track.status)
    elsewhere &= path.known & np.isin(path.kind, (Kind.LIN, Kind.CIRC))
    findings = []
    for mask, message in (
        (~track.turn_holds, "the stated T is not that of this pose"),
        (elsewhere, "the stated S is not the configuration in which the robot comes here"),
    ):
        rows = np.flatnonzero(mask)
        if len(rows):
            more = f" ({len(rows)} motions, to line {path.line[rows[-1]]})" if len(rows) > 1 else ""
            findings.append(Finding("KIN007", message + more, str(program), int(path.line[rows[0]])))
    return findings


def check(path: Path) -> Checked:
    """Read a program only."""
    _, program = read_program(path)
    return Checked(program)


def robots(name: str | None) -> list[StiffnessModel]:
    """The models of all robots, or of one."""
    paths = [find_robot(name)] if name else list(robot_files().values())
    return [StiffnessModel.from_robot(load_robot(path)) for path in paths]


def _silent(_stage: str) -> None:
    """Progress that nobody watches."""


def map_workspace(request: MapRequest, stage: Stage = _silent) -> Mapped:
    """The deflection over a part of the workspace.  Raises Refusal, and has then written nothing."""
    robot = load_robot(find_robot(request.robot))
    model = StiffnessModel.from_robot(robot)
    if request.sign is not None:
        if not has_compensator(model):
            raise Refusal(
                Finding("MAP001", f"--sign {request.sign}, but no gravity_compensator", str(robot.path))
            )
        model = with_sign(model, request.sign)
    free = isinstance(robot.nominal, SerialArm)
    if free and request.status is not None:
        raise Refusal(Finding("MAP006", f"--status {request.status}, but this arm has no S", str(robot.path)))
    load = _load(request)
    stage("computing")
    found = survey(model, _grid(request), load)
    signs = {
        str(term.effect.described()["sign"]) for term in model.terms if "sign" in term.effect.described()
    }
    mapped = Mapped(
        survey=found,
        load=load,
        robot=robot.name,
        digest=robot.digest,
        axes=tuple((joint.name, "mm" if joint.kind == "prismatic" else "deg") for joint in robot.joints),
        effects=tuple(term.effect.name for term in model.terms),
        stated=request.wrench,
        frame=request.frame,
        sign=", ".join(sorted(signs)) or None,
        status=None if free else load.status,
    )
    findings = [*_map_findings(found, mapped.status, request.picture is not None), *model.doubts()]
    files: dict[Path, bytes] = {}
    if found.mapped.any():
        stage("drawing")
        if request.csv is not None:
            files[request.csv] = map_csv(mapped)
        if request.picture is not None:
            from postproc.report.picture import picture

            files[request.picture] = picture(mapped, request.picture.suffix[1:].lower())
    pages = [] if request.json is None else [request.json]
    mapped = replace(
        mapped,
        findings=tuple(findings),
        outputs=tuple(str(path) for path in (*files, *pages)),
        exit=exit_code(findings),
    )
    publish({**files, **dict.fromkeys(pages, _json(mapped))})
    return mapped


def _grid(request: MapRequest) -> Grid:
    axes = []
    for ends in request.ranges_mm:
        low, high = ends[0], ends[-1]
        several = low < high and request.points > 1
        axes.append(np.linspace(low, high, request.points) if several else np.array([(low + high) / 2]))
    return Grid(*(values * MM for values in axes))


def _load(request: MapRequest) -> Load:
    place, turn = np.array(request.tool_mm_deg[:3]) * MM, np.array(request.tool_mm_deg[3:]) * DEG
    orientation = rotation_from_abc(np.array(request.orientation_deg) * DEG)
    wrench = np.array(request.wrench).reshape(2, 3)
    if request.frame == "tool":
        wrench = wrench @ orientation.T
    return Load(
        tool=Poses.from_abc(place, turn),
        orientation=orientation,
        wrench=wrench.ravel(),
        status=2 if request.status is None else request.status,
        linear=request.linear,
        ignore_limits=request.ignore_limits,
    )


def _map_findings(found: Survey, status: int | None, drawn: bool) -> list[Finding]:
    """What is to be said of a map as a whole."""
    findings = []
    cells, unsettled = len(found.q), int(found.unsettled.sum())
    if status is None:
        findings.append(Finding("MAP007", "the arm has no S: neighbouring cells may differ in posture"))
    if not found.mapped.any():
        beyond = int(found.in_reach.sum())
        help = f"{beyond} cells are only beyond the axis limits: --ignore-limits" if beyond else ""
        branch = "" if status is None else f" with S {status}"
        findings.append(Finding("MAP002", f"none of {cells} cells can be reached{branch}", help=help))
    elif unsettled:
        findings.append(Finding("MAP003", f"{unsettled} of {cells} cells have no equilibrium"))
    elif not np.nanmax(found.size) > 0:
        findings.append(Finding("MAP005", "the deflection is zero everywhere"))
    slices = found.grid.shape[2]
    shown = len(slices_shown(slices))
    if drawn and found.mapped.any() and min(found.grid.shape) > 1 and shown < slices:
        findings.append(Finding("MAP004", f"the picture shows {shown} of {slices} slices along z"))
    return findings


def _cell(request: Request) -> Cell:
    """The cell file, or an empty cell where ``--robot`` says all that a program with its own frames needs."""
    try:
        cell = load_cell(request.cell or find_cell(request.program))
    except Refusal as refusal:
        if request.cell or not request.robot or refusal.findings[0].code != "CEL001":
            raise
        cell = Cell(path=Path("cell.yaml"), robot=request.robot)
    return replace(cell, robot=request.robot) if request.robot else cell


def _conditions(
    request: Request,
    path: Toolpath,
    cell: Cell,
    frames: Frames,
    model: StiffnessModel,
    force: Wrenches,
    q: Floats,
) -> Conditions:
    """What the model's effects need to know of the motions: spindle axes, weights on the flange, senses of approach."""
    spindle = None
    if "spindle.z" in model.chain.names:
        spindle = frames.spindle_in_tool
        lost = np.flatnonzero(force.carries & ~np.isfinite(spindle[:, 0]))
        if len(lost):
            raise Refusal(
                Finding(
                    "CEL002",
                    "the spindle axis of this tool is not known, and the model has a tool_compliance",
                    str(request.program),
                    int(path.line[lost[0]]),
                    help="add the tool to the cell, with its axis",
                )
            )
    mass, com = np.zeros(len(path)), np.zeros((len(path), 3))
    for row, frame in enumerate(path.frames):
        tool = cell.tools.get(frame.number or 0)
        if tool is not None and tool.mass is not None and tool.com is not None:
            mass[path.tool == row], com[path.tool == row] = tool.mass, tool.com
    return Conditions(
        spindle=spindle, direction=np.nan_to_num(approach(q)), payload_mass=mass, payload_com=com
    )


def _missing_points(program: Program, force: Wrenches) -> None:
    """Refuse a cut whose points are declared nowhere because the module's data list is not there."""
    if len(program.documents) > 1:
        return
    refused = program.toolpath.refused
    lost = [row for row, why in refused.items() if why.code == "KRL003" and force.carries[row]]
    if lost:
        path, first = program.documents[0].path, refused[min(lost)]
        raise Refusal(
            Finding(
                "FIL006",
                f"{first.message}; {path.with_suffix('.dat').name} is not beside {path.name}"
                f" ({len(lost)} such motions)",
                str(path),
                first.line,
                first.column,
                help="copy the .dat of the module beside its .src",
            )
        )


def _start(cell: Cell, robot: Robot) -> Floats | None:
    """The joint values (n,) before the first motion [rad, m].  Raises Refusal YML004."""
    stated = cell.start_stated
    if stated is None:
        return None
    names = [joint.name for joint in robot.joints]
    if len(stated) != len(names):
        message = f"start: {len(stated)} values; {robot.name} has {len(names)} joints: {', '.join(names)}"
        raise Refusal(Finding("YML004", message, str(cell.path), cell.start_line))
    units = np.array([DEG if joint.kind == "revolute" else MM for joint in robot.joints])
    return np.asarray(stated * units)


def completed(path: Toolpath, cell: Cell, robot: Robot, program: Path) -> Toolpath:
    """The toolpath with targets that continue an axis motion filled in from where that one leads."""
    rows = np.flatnonzero(path.anchor >= 0)
    if not len(rows):
        return path
    frames = frames_of(cell, path, program)
    axes = np.zeros((len(path), 6))
    axes[rows] = path.axes[path.anchor[rows]]
    flange = nominal_flange(robot, all_axes(robot, axes, _start(cell, robot)))
    return path.completed(frames.base_in_robot.inverse() @ flange @ frames.tool_in_flange)


def predict(request: Request, stage: Stage = _silent) -> Report:
    """The deflection at every pose; files only where ``report`` names a folder for them."""
    ready = prepare(request)
    stage("predicting")
    result = correct(replace(ready.task, gain=0.0))
    findings = in_order_of_place([*ready.findings, *result.findings])
    report = _report(request, ready, result, findings, corrected=False)
    files: dict[Path, bytes] = {}
    pages = [] if request.json is None else [request.json]
    if request.report:
        files[request.report / f"{request.program.stem}.deflection.csv"] = corrections_csv(ready.task, result)
        pages.append(request.report / f"{request.program.stem}.prediction.json")
    report = replace(report, outputs=tuple(str(path) for path in (*files, *pages)))
    _not_over_inputs(ready, report.outputs)
    publish({**files, **dict.fromkeys(pages, _json(report))})
    return report


def compensate(request: Request, stage: Stage = _silent) -> Report:
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
    result = correct(ready.task)
    stage("writing, and reading back")
    target = _target(request)
    written = write(
        program,
        ready.dialect,
        ready.task,
        result,
        ready.cell,
        ready.robot,
        target.stem,
        lambda path: completed(path, ready.cell, ready.robot, request.program),
    )
    edits, result = written.edits, written.result
    findings = [*ready.findings, *result.findings, *_closing(request, ready, result)]
    paths = _output_paths(program, target)
    outputs = dict(zip(paths, written.contents, strict=True))
    stem = target.stem
    folder = request.report or target.parent
    names = [folder / f"{stem}.{end}" for end in ("report.json", "corrections.csv", "diff")]
    names += [] if request.json is None else [request.json]
    stage("reporting")
    report = _report(request, ready, result, in_order_of_place(findings), corrected=True)
    if report.exit == 1:
        raise Refusal(*report.findings)
    report = replace(report, outputs=tuple(str(path) for path in (*paths, *names)))
    _not_over_inputs(ready, report.outputs)
    if request.dry_run:
        return replace(report, outputs=())
    diff = b"".join(
        unified_diff(document, path.name, [edit for edit in edits if edit.span.file == index])
        for index, (document, path) in enumerate(zip(program.documents, outputs, strict=True))
    )
    files = {
        **outputs,
        names[0]: _json(report),
        names[1]: corrections_csv(ready.task, result),
        names[2]: diff,
        **dict.fromkeys(names[3:], _json(report)),
    }
    for document in program.documents:
        if _document(document.path).digest != document.digest:
            raise Refusal(Finding("FIL010", "the file changed while it was read", str(document.path)))
    publish(files, last=target)
    return report


def _closing(request: Request, ready: Prepared, result: Result) -> list[Finding]:
    """What is to be said of the corrected program as a whole."""
    file, findings = str(request.program), []
    corrected = result.corrected
    if request.force is None and not corrected.any():
        findings.append(Finding("COR010", "--force was not given: nothing is corrected", file))
    above = corrected & (result.after > ready.cell.tolerance)
    if request.gain < 1.0:
        findings.append(
            Finding("COR007", f"{request.gain:.0%} of the correction was applied, as asked", file)
        )
    elif above.any():
        row = int(np.argmax(np.where(corrected, result.after, -1.0)))
        findings.append(
            Finding(
                "COR005",
                f"{result.after[row] / MM:.4f} mm remain, tolerance {ready.cell.tolerance / MM:g} mm"
                f" ({int(above.sum())} motions)",
                file,
                int(ready.task.toolpath.line[row]),
            )
        )
    if corrected.any():
        cuts = len(np.unique(result.cut[corrected]))
        findings.append(
            Finding(
                "COR006",
                f"{int(corrected.sum())} end points in {cuts} cuts are corrected; between the points the path is not"
                " checked, and each correction fades in along the first motion of its cut",
                file,
                help="long motions and cut entries keep a part of their error: let the CAM system post shorter"
                " segments there",
            )
        )
    return findings


def _target(request: Request) -> Path:
    """Where the compensated program goes; a name without a suffix is a folder."""
    if request.output is None:
        return request.program.parent / "compensated" / request.program.name
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
    inputs = {document.path.resolve() for document in ready.program.documents}
    inputs |= {ready.cell.path.resolve(), ready.robot.path.resolve()}
    for output in outputs:
        if Path(output).resolve() in inputs:
            raise Refusal(Finding("FIL007", "this output is an input of the same run", output))
    if len({Path(output).resolve() for output in outputs}) < len(outputs):
        raise Refusal(Finding("FIL007", "two outputs have one name", outputs[0]))


def _report(
    request: Request, ready: Prepared, result: Result, findings: tuple[Finding, ...], corrected: bool
) -> Report:
    task = ready.task
    scope = result.state != State.AIR
    size = np.linalg.norm(result.command.position - task.wanted.position, axis=1)
    force = np.linalg.norm(task.wrench[:, :3], axis=1)
    order = np.argsort(-np.nan_to_num(np.where(scope, result.before, -1.0), nan=-1.0), kind="stable")
    worst = tuple(
        Worst(
            int(task.toolpath.line[row]),
            float(result.before[row] / MM),
            float(size[row] / MM) if corrected else math.nan,
            float(result.after[row] / MM) if corrected else math.nan,
            float(force[row]),
        )
        for row in order[:WORST_PLACES]
        if scope[row] and np.isfinite(result.before[row])
    )
    return Report(
        program=str(request.program),
        dialect=ready.dialect.name,
        robot=ready.robot.name,
        motions=len(task.toolpath),
        cuts=int(result.cut.max(initial=-1)) + 1,
        cutting=int(scope.sum()),
        corrected=int(result.corrected.sum()) if corrected else 0,
        inserted=0,
        left=int((result.state == State.LEFT).sum()),
        iterations=int(result.iterations.max(initial=0)),
        gain=request.gain,
        mode=ready.cell.correct,
        force_source=ready.wrenches.source,
        force_max_n=ready.wrenches.max_force,
        before=Spread.of(result.before[scope]),
        after=Spread.of(result.after[scope]) if corrected else None,
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


def _model(ready: Prepared) -> dict[str, object]:
    """Effects, options, values with interval and source, as they were used."""
    return {
        term.effect.name: {
            **term.effect.described(),
            "parameters": {
                name: {
                    "value": value.value,
                    "interval": value.interval,
                    "level": value.level if value.level or value.interval is None else "unstated",
                    "source": value.source,
                }
                for name, value in term.stated.items()
            },
        }
        for term in ready.model.terms
    }


def _largest(values: Floats) -> float:
    seen = values[np.isfinite(values)]
    return float(seen.max()) if len(seen) else math.nan


def _json(report: Report | Mapped) -> bytes:
    return (json.dumps(report.as_json(), indent=2, allow_nan=False) + "\n").encode()
