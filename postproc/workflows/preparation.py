"""A program with all that predicts it: read, placed, loaded, followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.arrays import Floats, Ints
from postproc.cell import Cell, Frames, find_cell, frames_of, load_cell
from postproc.compensation.task import Task
from postproc.dialects import DIALECTS, detect
from postproc.dialects.dialect import Dialect, Program, Settings
from postproc.document import Document
from postproc.effects import Conditions
from postproc.files import read_plain
from postproc.findings import Finding, Refusal, nearest
from postproc.forces import Wrenches, is_no_force, wrenches
from postproc.geometry import PoseRows, Poses
from postproc.inputs import Inputs, noted
from postproc.model import StiffnessModel, approach
from postproc.robot.description import Robot, find_robot, load_robot
from postproc.robot.geometries import SerialArm
from postproc.robot.track import Track, all_axes, follow, nominal_flange
from postproc.toolpath import Kind, Toolpath
from postproc.units import DEG, MM

Stage = Callable[[str], None]
"""Is told the name of each stage as it begins."""


@dataclass(frozen=True)
class Request:
    """What the user asked for.  ``force``: None without ``--force``, "" for a bare one, else its value;
    ``force_offset``: the mean of a force log in air is taken off."""

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
    keep_points: bool = False
    own_points: str = "inline"
    config_dat: Path | None = None
    force_offset: bool = False


@dataclass(frozen=True)
class Prepared:
    """A program with all that predicts it."""

    program: Program
    dialect: Dialect
    settings: Settings
    cell: Cell
    robot: Robot
    model: StiffnessModel
    wrenches: Wrenches
    task: Task
    findings: tuple[Finding, ...]
    inputs: Inputs


def silent(_stage: str) -> None:
    """Progress that nobody watches."""


def read_program(
    path: Path, cell: Cell | None = None, config_dat: Path | None = None
) -> tuple[Dialect, Program, Settings]:
    """Read a program and what belongs to it, with what the cell says of its language.

    ``config_dat``: instead of the cell's.  Raises Refusal FIL001, FIL002, FIL003, YML004.
    """
    main = read_document(path)
    if not main.raw.strip():
        raise Refusal(Finding("FIL002", "the file is empty", str(path)))
    dialect = _dialect(path, main.raw, cell)
    documents = (main, *(read_document(companion) for companion in dialect.companions(path)))
    if config_dat is None and cell is not None and cell.config_dat is not None:
        config_dat = cell.path.parent / cell.config_dat
    references = () if config_dat is None else (read_document(config_dat),)
    settings = Settings(references=references)
    if cell is not None:
        settings = Settings(cell.orientation, cell.integer_words, references)
    return dialect, dialect.read(documents, settings), settings


def _dialect(path: Path, raw: bytes, cell: Cell | None) -> Dialect:
    if cell is None or cell.dialect is None:
        return detect(path, raw)
    if cell.dialect not in DIALECTS:
        known = ", ".join(DIALECTS)
        raise Refusal(
            Finding(
                "YML004",
                f"dialect.name: {cell.dialect!r} is not one of {known}{nearest(cell.dialect, DIALECTS)}",
                str(cell.path),
                cell.dialect_line,
            )
        )
    return DIALECTS[cell.dialect]


def near_cell(program: Path) -> Cell | None:
    """The checked cell of a program; None where there is none."""
    try:
        return load_cell(find_cell(program))
    except Refusal as refusal:
        if refusal.findings[0].code != "CEL001":
            raise
        return None


def read_document(path: Path) -> Document:
    """A file of a program.  Raises Refusal FIL001 (not readable), FIL003 (no text)."""
    return Document(path, read_plain(path))


def prepare(request: Request) -> Prepared:
    """Read program, cell and robot, and find force and axes of every motion."""
    with noted() as inputs:
        return _prepared(request, inputs)


def _prepared(request: Request, inputs: Inputs) -> Prepared:
    if not request.program.is_file():
        read_document(request.program)  # tells why
    cell = _cell(request)
    dialect, read, settings = read_program(request.program, cell, request.config_dat)
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
    force = wrenches(request.program, path, frames, cell, request.force, request.force_offset)
    _missing_points(program, force)
    _missing_orientation(request, path, force, cell)
    base, tool = frames.base_in_robot, frames.tool_in_flange
    wanted = PoseRows(len(path), lambda rows: base.shared(rows) @ path.target_in_base[rows]).remembered()
    flange = PoseRows(len(path), lambda rows: wanted[rows] @ tool.shared(rows).inverse())
    track = follow(robot, path, flange, _start(cell, robot))
    task = Task(
        file=str(request.program),
        toolpath=path,
        model=model,
        track=track,
        wanted=wanted,
        base=base,
        tool=tool,
        force=force,
        conditions=_conditions(request, path, cell, frames, model, force, track.q),
        process=process,
        gain=request.gain,
        max_correction=cell.max_correction,
        tolerance=cell.tolerance,
        tolerance_angle=cell.tolerance_angle,
    )
    findings = [*program.findings, *force.findings, *model.doubts()]
    if force.any and not model.gives_way:
        findings.append(
            Finding(
                "MOD003", f"{robot.name} has no compliance: under this force nothing bends", str(robot.path)
            )
        )
    if not isinstance(robot.nominal, SerialArm):
        findings += _disagreeing(request.program, path, track)
    return Prepared(program, dialect, settings, cell, robot, model, force, task, tuple(findings), inputs)


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
    weighs = any(tool.mass is not None and tool.com is not None for tool in cell.tools.values())
    mass, com = np.broadcast_to(0.0, (len(path),)), np.broadcast_to(0.0, (len(path), 3))
    if weighs:
        mass, com = mass.copy(), com.copy()
        for row, frame in enumerate(path.frames):
            tool = cell.tools.get(frame.number or 0)
            if tool is not None and tool.mass is not None and tool.com is not None:
                mass[path.tool == row], com[path.tool == row] = tool.mass, tool.com
    directed = any(term.effect.by_direction for term in model.terms)
    return Conditions(
        spindle=spindle,
        direction=np.nan_to_num(approach(q)) if directed else None,
        payload_mass=mass,
        payload_com=com,
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


def _missing_orientation(request: Request, path: Toolpath, force: Wrenches, cell: Cell) -> None:
    """Refuse cuts of a program that says positions only, in a cell that does not say how the tool stands."""
    lost = force.carries & ~path.oriented & np.isfinite(path.position).all(axis=1)
    lost &= ~np.isfinite(path.rotation[:, 0, 0])
    if lost.any():
        row = int(np.argmax(lost))
        raise Refusal(
            Finding(
                "CEL004",
                f"the program says no orientation, and the cell {cell.path} does not either",
                str(request.program),
                int(path.line[row]),
                help="add the tool's orientation in the base to the cell: orientation: {a: 0, b: 0, c: 180}",
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

    def reached(rows: Ints) -> Poses:
        axes = all_axes(robot, path.axes[path.anchor[rows]], _start(cell, robot))
        flange = nominal_flange(robot, axes)
        return frames.base_in_robot[rows].inverse() @ flange @ frames.tool_in_flange[rows]

    return path.completed(PoseRows(len(path), reached))
