"""Where a program's forces come from: the option, the program's comments, the CSV beside it, the cell."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.cell import Cell, MotionFrames
from postproc.process.force_comments import marked_air, read_annotations
from postproc.process.mirrored_cuts import sideways_findings
from postproc.process.stated_forces import FORM, NotAForce, StatedForces, parse_force
from postproc.process.stock.stated_stock import has_stock
from postproc.process.wrenches import Wrenches, turn_to_robot_axes
from postproc.toolpath import Toolpath

LOG = ".csv"
PROCESS = (".yaml", ".yml")

_STATED = re.compile(r"force\s+[-+.@\d]", re.IGNORECASE)
"""A FORCE comment that is no FORCE OFF."""

_COMMENT = re.compile(r"force\s+(?:[-+.@\d]|off\b)", re.IGNORECASE)
"""Any FORCE comment."""

SourcedForces = tuple[StatedForces, tuple[Finding, ...], str]
"""Forces, what there is to say of them, and the name of their source."""


def wrenches(
    program: Path,
    toolpath: Toolpath,
    frames: MotionFrames,
    cell: Cell,
    spec: str | None,
    offset: bool = False,
    rapids: bool = False,
) -> Wrenches:
    """The wrench of every motion of ``toolpath``.

    spec: None = no --force (zero); '' = --force alone (the program's own: FORCE comments, then
    ``<stem>.force.csv`` beside it, then the cell's ``force`` or ``process``); else the value of --force, a path
    in it relative to the working folder.  ``offset``: a log's mean in air is taken off.  ``rapids``: its point-to-point
    motions are such as nobody cuts with (G0).  Refusal FRC001 to FRC005,
    FRC020, and those of a force CSV or a process file.
    """
    request = _ForceRequest(program, toolpath, frames, offset, rapids)
    if spec is None:
        request.no_offset("there is no --force")
        return Wrenches.zero(len(toolpath))
    if spec.strip():
        stated, findings, source = request.explicit(spec.strip(), Path(), "", 0, f"--force {spec.strip()}")
        findings = (*findings, *_overridden_comments(request, spec.strip()))
    else:
        stated, findings, source = _belonging(request, cell)
    return turn_to_robot_axes(stated, toolpath, frames, cell, str(program), source, findings)


def _overridden_comments(request: _ForceRequest, spec: str) -> list[Finding]:
    """FRC035 where the program has FORCE comments, and the value of --force is used instead; a table and a process
    still take motions after FORCE OFF for air."""
    one_force = not spec.lower().endswith((LOG, *PROCESS))
    form = _COMMENT if one_force else _STATED
    lines = [note.line for note in request.toolpath.annotations if form.match(note.text.strip())]
    if not lines:
        return []
    comments = f"{len(lines)} FORCE comments are" if len(lines) > 1 else "the FORCE comment is"
    also = ", FORCE OFF neither" if one_force else ""
    message = f"{comments} not used{also}: --force has a value"
    help = "use --force without a value for the forces of the comments"
    return [Finding("FRC035", message, str(request.program), lines[0], help=help)]


def not_requested(program: Path, toolpath: Toolpath, cell: Cell) -> Finding:
    """FRC030: a run without --force, which would predict and correct nothing; its help names the force that the program
    has, or all ways to state one."""
    source = _available_force(program, toolpath, cell)
    help = "add --force to the command" if source else ways_to_state(program, cell)
    message = "--force is missing, and without a force there is no deflection to predict or to correct"
    return Finding("FRC030", message + (f"; {source}" if source else ""), str(program), help=help)


def _available_force(program: Path, toolpath: Toolpath, cell: Cell) -> str:
    """A clause about the force that a bare --force takes; "" where there is none."""
    if any(_STATED.match(annotation.text.strip()) for annotation in toolpath.annotations):
        return "the program states its forces in FORCE comments"
    beside = program.with_name(program.stem + ".force.csv")
    if os.path.isfile(beside):
        return f"the forces are in {beside.name}"
    if cell.process is not None or cell.force is not None:
        return (
            f"the cell states {'process: ' + cell.process if cell.process else 'force: ' + str(cell.force)}"
        )
    return ""


def ways_to_state(program: Path, cell: Cell) -> str:
    """The ways to state a force, for a user."""
    return (
        "use one of: (1) a comment in the program, ;FORCE 0 360 560 @base, in G-code (FORCE 0 360 560 @BASE);"
        f" (2) {program.stem}.force.csv beside it, with the header line,fx,fy,fz and rows such as 12,0,360,560;"
        f" (3) force: 0,360,560@base, or process: milling.yaml, in {cell.path};"
        " then run with --force; or state it here: --force 0,360,560@base"
    )


@dataclass(frozen=True)
class _ForceRequest:
    """A program whose forces are sought."""

    program: Path
    toolpath: Toolpath
    frames: MotionFrames
    offset: bool
    rapids: bool

    def explicit(self, spec: str, folder: Path, file: str, line: int, name: str) -> SourcedForces:
        """A force given as text: a CSV or process file (relative to ``folder``), or one wrench for all motions."""
        if spec.lower().endswith(PROCESS):
            return self.process(folder / spec)
        if spec.lower().endswith(LOG):
            return self.table(folder / spec)
        self.no_offset(f"the force is {spec}")
        try:
            values, frame = parse_force(spec)
        except NotAForce as error:
            message = f"{name}: {error}" if spec in name else f"{name}: {spec[:60]!r}: {error}"
            help = f"write {FORM}; or name a CSV or YAML file"
            raise Refusal(Finding("FRC002", message, file, line, help=help)) from None
        all_of_one = np.broadcast_to(np.int32(0), len(self.toolpath))
        stated = StatedForces(np.array([values]), np.array([frame]), all_of_one)
        return stated, self.sideways(stated), spec

    def table(self, path: Path) -> SourcedForces:
        from postproc.base.tables import read_table  # these are loaded where there is a table
        from postproc.base.tables.header_units import without_units
        from postproc.process.force_logs import read_log
        from postproc.process.force_table import UNITS_OF_COLUMNS, place_column, read_force_table

        table = without_units(read_table(path, "FRC003"), UNITS_OF_COLUMNS)
        column, program = place_column(table), str(self.program)
        if column == "line":
            stated, findings = read_force_table(table, self.toolpath, program, self.offset)
            findings = (*findings, *self.sideways(stated))
        else:
            stated, findings = read_log(table, column, self.toolpath, self.frames, program, self.offset)
        return stated, findings, path.name

    def process(self, path: Path) -> SourcedForces:
        from postproc.process.operations import process_forces  # these are loaded where there is a process
        from postproc.process.stock.compiled import check_compiler

        self.no_offset("the force is computed from a process")
        if has_stock(path):
            check_compiler(str(path))
            from postproc.process.stock.simulation import stock_forces  # numba: only where there is a stock

            stated, findings = stock_forces(path, self.toolpath, self.frames, str(self.program))
            return stated, findings, f"stock of {path.name}"
        stated, findings = process_forces(path, self.toolpath, self.frames, str(self.program))
        return stated, findings, path.name

    def sideways(self, stated: StatedForces) -> tuple[Finding, ...]:
        """FRC037 of forces that are stated, not measured where they act or computed."""
        return sideways_findings(stated, self.toolpath, self.frames, str(self.program))

    def no_offset(self, why: str) -> None:
        """Refusal FRC020 where the offset of a log is to be taken off and there is no log."""
        if self.offset:
            message = f"--tare subtracts the offset of a log, and {why}"
            raise Refusal(Finding("FRC020", message, str(self.program), help="use --force LOG.csv --tare"))


def _belonging(request: _ForceRequest, cell: Cell) -> SourcedForces:
    """The force that belongs to the program, from the first source that exists.  Comments that state FORCE OFF alone
    state no force: the next source does, and motions under FORCE OFF are air."""
    program = request.program
    stated, findings = read_annotations(request.toolpath, str(program), request.rapids)
    beside = program.with_name(program.stem + ".force.csv")
    elsewhere = os.path.isfile(beside) or cell.process is not None or cell.force is not None
    if stated is not None and (stated.values.any() or not elsewhere):
        request.no_offset("the force comes from FORCE comments")
        findings = (*findings, *request.sideways(stated))
        if os.path.isfile(beside):
            message = f"{beside.name} is not used: the FORCE comments of the program come first"
            findings = (
                *findings,
                Finding("FRC031", message, str(program), help=f"use --force {beside.name}"),
            )
        return stated, findings, "FORCE comments"
    if os.path.isfile(beside):
        stated, more, source = request.table(beside)
    elif cell.process is not None:
        stated, more, _ = request.process(cell.path.parent / cell.process)
        source = f"cell: {cell.process}"
    elif cell.force is not None:
        stated, more, _ = request.explicit(
            cell.force, cell.path.parent, str(cell.path), cell.force_line, "force"
        )
        stated = stated.without(marked_air(request.toolpath))
        source = f"cell: {cell.force}"
    else:
        raise Refusal(
            Finding(
                "FRC001",
                "--force has no value, and no force belongs to this program",
                str(program),
                help=ways_to_state(program, cell),
            ),
            *findings,
        )
    return stated, (*findings, *more), source
