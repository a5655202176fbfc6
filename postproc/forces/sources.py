"""Where a program's forces come from: the option, the program's comments, the CSV beside it, the cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from postproc.cell import Cell, Frames
from postproc.findings import Finding, Refusal
from postproc.forces.annotations import read_annotations
from postproc.forces.operations import process_forces
from postproc.forces.stated import FORM, NotAForce, Stated, parse_force
from postproc.forces.table import read_force_table
from postproc.forces.wrench import Wrenches, turned
from postproc.toolpath import Toolpath

PROCESS = (".yaml", ".yml")


def wrenches(program: Path, toolpath: Toolpath, frames: Frames, cell: Cell, spec: str | None) -> Wrenches:
    """The wrench of every motion of ``toolpath``.

    spec: None = no --force (zero); '' = --force alone (the program's own: FORCE comments, then
    ``<stem>.force.csv`` beside it, then the cell's ``force`` or ``process``); else the value of --force, a path
    in it relative to the working folder.  Refusal FRC001 to FRC005, and those of a process file.
    """
    if spec is None:
        return Wrenches.zero(len(toolpath))
    if spec.strip():
        stated, findings = _explicit(
            spec.strip(), Path(), toolpath, frames, program, "", 0, f"--force {spec.strip()}"
        )
        is_file = spec.strip().lower().endswith((".csv", *PROCESS))
        source = Path(spec.strip()).name if is_file else spec.strip()
    else:
        stated, findings, source = _belonging(program, toolpath, frames, cell)
    return turned(stated, toolpath, frames, cell, str(program), source, findings)


def _belonging(
    program: Path, toolpath: Toolpath, frames: Frames, cell: Cell
) -> tuple[Stated, tuple[Finding, ...], str]:
    """The force that belongs to the program, from the first source that exists."""
    stated, findings = read_annotations(toolpath, str(program))
    if stated is not None:
        return stated, findings, "FORCE comments"
    beside = program.with_name(program.stem + ".force.csv")
    if beside.is_file():
        stated, more = read_force_table(beside, toolpath, str(program))
        return stated, (*findings, *more), beside.name
    if cell.process is not None:
        stated, more = process_forces(cell.path.parent / cell.process, toolpath, frames, str(program))
        return stated, (*findings, *more), f"cell: {cell.process}"
    if cell.force is not None:
        stated, more = _explicit(
            cell.force, cell.path.parent, toolpath, frames, program, str(cell.path), cell.force_line, "force"
        )
        return stated, (*findings, *more), f"cell: {cell.force}"
    raise Refusal(
        Finding(
            "FRC001",
            "--force stands alone, and no force belongs to this program",
            str(program),
            help="one of: (1) a comment in the program, ;FORCE 0 360 560 @base, in G-code (FORCE 0 360 560 @BASE); "
            f"(2) {beside.name} beside it, with the header line,fx,fy,fz and rows such as 12,0,360,560; "
            f"(3) force: 0,360,560@base, or process: milling.yaml, in {cell.path}; "
            "or give it here: --force 0,360,560@base",
        ),
        *findings,
    )


def _explicit(
    spec: str,
    folder: Path,
    toolpath: Toolpath,
    frames: Frames,
    program: Path,
    file: str,
    line: int,
    name: str,
) -> tuple[Stated, tuple[Finding, ...]]:
    """A force given as text: a CSV or process file (relative to ``folder``), or one wrench for all motions."""
    if spec.lower().endswith(PROCESS):
        return process_forces(folder / spec, toolpath, frames, str(program))
    if spec.lower().endswith(".csv"):
        return read_force_table(folder / spec, toolpath, str(program))
    try:
        values, frame = parse_force(spec)
    except NotAForce as error:
        message = f"{name}: {error}" if spec in name else f"{name}: {spec[:60]!r}: {error}"
        raise Refusal(Finding("FRC002", message, file, line, help=f"{FORM}; or a CSV or YAML file")) from None
    n = len(toolpath)
    return Stated(np.tile(values, (n, 1)), np.full(n, frame)), ()
