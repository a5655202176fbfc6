"""A program with all that predicts it: read, placed, loaded, followed."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.batches import blocks
from postproc.base.document import Document
from postproc.base.findings import Finding, Refusal, Topic, nearest
from postproc.base.geometry import PoseRows, Poses
from postproc.base.input_files import Inputs, noted
from postproc.base.read_files import read_text_file
from postproc.base.units import DEG, MM
from postproc.cell import Cell, MotionFrames, find_cell, frames_of, load_cell, number_literal_tools
from postproc.compensation.known_error import KnownError
from postproc.compensation.lost_motion import add_lost_motion
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramped_forces import add_force_ramps
from postproc.effects import Conditions
from postproc.languages import DIALECTS, detect, unread_help
from postproc.languages.dialect import Dialect, Program, ReadingSettings, read_with_siblings
from postproc.model import StiffnessModel
from postproc.process import Wrenches, is_no_force, not_requested, wrenches
from postproc.robot.axis_track import (
    all_axes,
    external_joint,
    follow_axes,
    nominal_flange,
)
from postproc.robot.description import Robot, check_programmable, find_robot, load_robot
from postproc.robot.external_axes import External
from postproc.robot.geometries import SerialArm
from postproc.robot.orientation_modes import as_run
from postproc.robot.read_external_axes import fill_external_axes, follow_external_axes
from postproc.toolpath import Toolpath
from postproc.workflows.cell_force_factors import factored
from postproc.workflows.cell_tool_errors import cell_tool_displacement
from postproc.workflows.correction_mode import corrected_model, mode_findings, temperature_rise, touch_off
from postproc.workflows.data_list import read_controller_data
from postproc.workflows.machine_vectors import refuse_machine_orientations
from postproc.workflows.ramp_lengths import early_shares, ramp_lengths
from postproc.workflows.reading_findings import configuration_findings, reader_findings, start_findings

Stage = Callable[[str], None]
"""Receives the name of each stage as it starts."""


@dataclass(frozen=True)
class LearnedInputs:
    """What was learnt of a part of this program: its ``forces`` from those that are stated, errors that are known
    beside those of the model, and the ``robot``, where it is another."""

    forces: Callable[[Wrenches], Wrenches]
    known_error: KnownError
    robot: Robot | None = None


@dataclass(frozen=True)
class Request:
    """What the user asked for.  ``force``: None without ``--force``, "" for a bare one, else its value;
    ``tare``: the mean of a force log in air is subtracted; ``allow_compensated``: a program that carries the mark of an
    earlier compensation is accepted; ``no_insert``: no motion is inserted; ``shared_points``: as of ``Writing``;
    ``keep_table``: the report keeps the table of its motions; ``stream``: takes the bytes of the compensated program
    instead of a file; reports are then written only where ``report`` names a folder; ``learned``: of a part."""

    program: Path
    force: str | None = None
    cell: Path | None = None
    robot: str | None = None
    gain: float = 1.0
    output: Path | None = None
    report: Path | None = None
    strict: bool = False
    dry_run: bool = False
    allow_compensated: bool = False
    json: Path | None = None
    no_insert: bool = False
    shared_points: str = "copy-inline"
    config_dat: Path | None = None
    beside: Path | None = None
    tare: bool = False
    keep_table: bool = False
    stream: Callable[[bytes], object] | None = None
    learned: LearnedInputs | None = None


@dataclass(frozen=True)
class Prepared:
    """A program with all that predicts it."""

    program: Program
    dialect: Dialect
    settings: ReadingSettings
    cell: Cell
    robot: Robot
    model: StiffnessModel
    wrenches: Wrenches
    task: CompensationProblem
    findings: tuple[Finding, ...]
    inputs: Inputs

    def without_text(self) -> Prepared:
        """The same for what comes after the edits: only they need what the dialect knows of the text, and of a million
        motions that takes a tenth of a gigabyte."""
        return replace(self, program=replace(self.program, text=None))

    def with_text(self) -> Prepared:
        """The same with the text read again, for new edits."""
        text = self.dialect.read(self.program.documents, self.settings).text
        return replace(self, program=replace(self.program, text=text))


def silent(_stage: str) -> None:
    """Progress that nobody watches."""


def read_program(
    path: Path, cell: Cell | None = None, config_dat: Path | None = None, beside: Path | None = None
) -> tuple[Dialect, Program, ReadingSettings]:
    """Read a program and what belongs to it, with what the cell states of its language.

    ``config_dat``: instead of the cell's; ``beside``: the folder of what it calls, where that is not its own.
    Raises Refusal FIL001, FIL002, FIL003, YML004.
    """
    main = read_document(path)
    if not main.raw or main.raw.isspace():
        raise Refusal(Finding("FIL002", "the file is empty", str(path)))
    dialect = _dialect(path, main.raw, cell)
    companions = dialect.companions(path)
    if any(companion.samefile(path) for companion in companions):
        name, message = dialect.main_file(path).name, f"a {path.suffix} file contains the data of a program"
        help = f"name {name}: its data are read with it"
        raise Refusal(Finding("FIL009", f"{message}; the program is {name}", str(path), help=help))
    documents = (main, *(read_document(companion) for companion in companions))
    stated_files = [] if cell is None else cell.dialect_files
    references = tuple(map(read_controller_data, stated_files if config_dat is None else [config_dat]))
    settings = ReadingSettings(references=references)
    if cell is not None:
        stated = cell.orientation, cell.dialect_options, references, (), cell.symbols, cell.program_start
        words = {axis.word: axis.column for axis in cell.external_axes if axis.word}
        settings = ReadingSettings(*stated, external_words=words)
    program, settings = read_with_siblings(dialect, documents, settings, beside)
    if not len(program.toolpath) and cell is not None and cell.dialect is not None:
        _refuse_other_language(path, main.raw, dialect, cell)
    return dialect, program, settings


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


def _refuse_other_language(path: Path, raw: bytes, dialect: Dialect, cell: Cell) -> None:
    """Raises Refusal CEL008 where the cell's ``dialect`` found no motion in a program of another family."""
    other = next((one for one in DIALECTS.values() if one.claims(path, raw)), dialect)
    if other.family != dialect.family:
        message = (
            f"dialect.name: the cell states {dialect.name}, and {path.name} is a program in {other.family}"
        )
        help = "remove dialect.name, which detects the language of each program, or name another cell with --cell"
        raise Refusal(Finding("CEL008", message, str(cell.path), cell.dialect_line, help=help))


def find_cell_beside(program: Path) -> Cell | None:
    """The checked cell of a program; None where there is none."""
    try:
        return load_cell(find_cell(program))
    except Refusal as refusal:
        if refusal.findings[0].code != "CEL001":
            raise
        return None


def read_document(path: Path) -> Document:
    """A file of a program.  Raises Refusal FIL001 (not readable), FIL003 (no text)."""
    if os.path.isdir(path):
        help = f"name a program; compensate batch {path} compensates those of a folder"
        raise Refusal(Finding("FIL001", "this is a folder, not a program", str(path), help=help))
    return Document(path, read_text_file(path))


def prepare(request: Request) -> Prepared:
    """Read program, cell and robot, and find force and axes of every motion."""
    with noted() as inputs:
        return _prepared(request, inputs)


def _prepared(request: Request, inputs: Inputs) -> Prepared:
    if not os.path.isfile(request.program):
        read_document(request.program)  # raises the reason
    cell = cell_of(request)
    dialect, read, settings = read_program(request.program, cell, request.config_dat, request.beside)
    beside = None if request.robot else cell.path.parent
    learned = request.learned
    if learned is not None and learned.robot is not None:
        robot = learned.robot
    else:
        robot = load_robot(find_robot(cell.robot, beside))
    check_programmable(robot)
    full = StiffnessModel.from_robot(robot)
    gravity = cell.robot_base.rotation.T @ full.gravity
    model = replace(corrected_model(full, cell), gravity=gravity)
    warmer = temperature_rise(model, cell)

    path = completed(read.toolpath, cell, robot, request.program)
    program = replace(read, toolpath=path)
    if not len(path) and not is_no_force(request.force):
        message, raw = f"the file contains no motion (read as {dialect.name})", read.documents[0].raw
        help = unread_help(request.program, raw)
        raise Refusal(Finding("FIL009", message, str(request.program), help=help), *program.findings)
    external = External.of(path, cell.external_axes, robot, cell.robot_base)
    frames = frames_of(cell, path, request.program, external)
    base, tool, start = frames.base_in_robot, frames.tool_in_flange, _start(cell, robot)
    path, orientation_findings = as_run(path, base, tool, robot, start, str(request.program))
    rapids = dialect.family == "G-code"
    force = wrenches(request.program, path, frames, cell, request.force, request.tare, rapids)
    force = factored(cell, force, path, base[np.arange(len(path))].rotation)
    if learned is not None:
        force = learned.forces(force)
    _missing_points(program, force)
    _missing_orientation(request, path, force, cell)
    _other_carrier(request, path, force, external)
    wanted = PoseRows(len(path), lambda rows: base.shared(rows) @ path.target_in_base[rows]).remembered()

    def flanges(rows: Ints) -> Poses:
        there = wanted[rows] @ tool.shared(rows).inverse()
        placed = None if external is None else external.robot_from_path(rows)
        return there if placed is None else placed @ there

    flange = PoseRows(len(path), flanges)
    track = follow_axes(robot, path, flange, start, base, tool)
    task = CompensationProblem(
        file=str(request.program),
        toolpath=path,
        model=model,
        track=track,
        wanted=wanted,
        base=base,
        tool=tool,
        force=force,
        conditions=_conditions(request, path, cell, frames, model, force, warmer),
        process=cell.correct == "process",
        gain=request.gain,
        max_correction=cell.max_correction,
        tolerance=cell.tolerance,
        tolerance_angle=cell.tolerance_angle,
        external=external,
        known_error=None if learned is None else learned.known_error,
    )
    task = add_force_ramps(task, ramp_lengths(cell, path, force), early_shares(cell, task))
    spacing = np.maximum(cell.min_segment, 1e-3 * cell.cycle_ms * np.nan_to_num(path.feed))
    task = add_lost_motion(task, start, spacing)
    tool_findings: list[Finding] = []
    if learned is None:
        known, tool_findings = cell_tool_displacement(cell, task, frames)
        task = replace(task, known_error=known)
    findings = [
        *cell.findings,
        *start_findings(cell, robot, start),
        *tool_findings,
        *reader_findings(program, path),
        *orientation_findings,
        *force.findings,
        *model.plausibility_findings(),
    ]
    findings += mode_findings(full, cell, path, str(request.program))
    if cell.correct == "touched_off":
        touched, touch_findings = touch_off(task, cell)
        task = replace(task, touched_off=touched)
        findings += touch_findings
    findings += follow_external_axes(path, cell.external_axes, robot, request.program)
    if force.any and not model.is_compliant:
        findings.append(
            Finding("MOD003", f"{robot.name} has no compliance: this force deflects nothing", str(robot.path))
        )
    if not isinstance(robot.nominal, SerialArm):
        findings += configuration_findings(request.program, path, track)
    return Prepared(program, dialect, settings, cell, robot, model, force, task, tuple(findings), inputs)


def refuse_without_force(request: Request, ready: Prepared) -> None:
    """Raises Refusal FRC030 where no force is stated and nothing else deflects the tool."""
    if request.force is None and ready.task.process:
        program = ready.program
        raise Refusal(not_requested(request.program, program.toolpath, ready.cell), *program.findings)


def cell_of(request: Request) -> Cell:
    """The cell file, or an empty cell where ``--robot`` states all that a program with its own frames needs."""
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
    frames: MotionFrames,
    model: StiffnessModel,
    force: Wrenches,
    warmer: float | None,
) -> Conditions:
    """What the model's effects need to know of the motions: spindle axes, weights on the flange, and by how much the
    robot is ``warmer`` [K] than at its calibration."""
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
            tool = cell.tools.get(frame.entry or 0)
            if tool is not None and tool.mass is not None and tool.com is not None:
                mass[path.tool == row], com[path.tool == row] = tool.mass, tool.com
    return Conditions(
        spindle=spindle,
        temperature=None if warmer is None else np.broadcast_to(warmer, (len(path),)),
        payload_mass=mass,
        payload_com=com,
    )


def _missing_points(program: Program, force: Wrenches) -> None:
    """Refuse a cut whose points are declared nowhere because the file that declares them is not there."""
    if len(program.documents) > 1:
        return
    refused = program.toolpath.constraints.refused
    lost = [row for row, why in refused.items() if why.topic is Topic.UNDECLARED_POINT and force.carries[row]]
    if lost:
        path, first = program.documents[0].path, refused[min(lost)]
        raise Refusal(
            Finding(
                "FIL006",
                f"{len(lost)} motions under force use points that no file of the program declares; {first.message}",
                str(path),
                first.line,
                first.column,
                help=first.advice,
            )
        )


def _other_carrier(request: Request, path: Toolpath, force: Wrenches, external: External | None) -> None:
    """Refuse a motion under force that starts where a base on another positioner is: which path it takes on the part is
    nothing that a program means."""
    if external is None:
        return
    lost = np.flatnonzero(force.carries & external.changes_carrier)
    if len(lost):
        raise Refusal(
            Finding(
                "EXT005",
                "a motion under force starts in a base at another place than that of the motion before it",
                str(request.program),
                int(path.line[lost[0]]),
                help="write a motion without force in the new base before it",
            )
        )


def _missing_orientation(request: Request, path: Toolpath, force: Wrenches, cell: Cell) -> None:
    """Refuse cuts of a program that states positions only, in a cell that does not state how the tool is oriented."""
    lost = force.carries & ~path.constraints.orientation_programmed & ~path.keeps_orientation
    for rows in blocks(len(path)) if lost.any() else ():
        lost[rows] &= np.isfinite(path.position[rows]).all(axis=1) & ~np.isfinite(path.rotation[rows, 0, 0])
    if cell.orientation is not None:
        lost[[*path.constraints.refused]] = False  # rotary axes without a TCP mode: these motions alone
    if lost.any():
        row = int(np.argmax(lost))
        raise Refusal(
            Finding(
                "CEL004",
                f"the program states no orientation, and neither does the cell {cell.path}",
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
        message = (
            f"start: {len(stated)} values are given; {robot.name} has {len(names)} joints: {', '.join(names)}"
        )
        raise Refusal(Finding("YML004", message, str(cell.path), cell.start_line))
    units = np.array([DEG if joint.kind == "revolute" else MM for joint in robot.joints])
    return np.asarray(robot.joint_values((stated * units)[None])[0])


def completed(path: Toolpath, cell: Cell, robot: Robot, program: Path) -> Toolpath:
    """The toolpath as the cell completes it: external axes, numbers of literal tools, what axis motions lead to."""
    start = _start(cell, robot)
    path = refuse_machine_orientations(number_literal_tools(cell, path), cell, program)
    path = fill_external_axes(path, cell.external_axes, robot, start, program, cell.path)
    rows = np.flatnonzero(path.partial_targets.inherits_from_row >= 0)
    if not len(rows):
        return path
    external = External.of(path, cell.external_axes, robot, cell.robot_base)
    frames = frames_of(cell, path, program, external)

    def reached(rows: Ints) -> Poses:
        anchor = path.partial_targets.inherits_from_row[rows]
        axes = all_axes(robot, path.axes[anchor], external_joint(robot, path, anchor, start))
        flange = nominal_flange(robot, axes)
        if external is not None and external.constant is None:
            flange = external.placed(path.external[anchor], external.carrier[rows]).inverse() @ flange
        return frames.base_in_robot[rows].inverse() @ flange @ frames.tool_in_flange[rows]

    return path.completed(PoseRows(len(path), reached))
