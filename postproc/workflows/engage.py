"""What a program cuts of its stock, on paths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import Inputs, noted
from postproc.base.paged_memory import large_arrays_in_files
from postproc.base.units import MM
from postproc.cell import frames_of
from postproc.output.atomic_write import write_atomically
from postproc.process.stock.compiled import check_compiler
from postproc.process.stock.cutters import CUTTING, HOLDER, SHANK
from postproc.process.stock.stated_stock import has_stock
from postproc.report.engaged import Engaged, engaged_csv, engaged_table
from postproc.report.report import exit_code, in_order_of_place, json_bytes
from postproc.robot.description import find_robot, load_robot
from postproc.robot.external_axes import External
from postproc.workflows.preparation import Request, Stage, cell_of, completed, read_program, silent
from postproc.workflows.reading_findings import reader_findings

_PARTS = {CUTTING: "cutter", SHANK: "shank", HOLDER: "holder"}


@dataclass(frozen=True)
class EngageRequest:
    """What the user asked for; ``process``: a process file with a stock, instead of the cell's."""

    program: Path
    process: Path | None = None
    cell: Path | None = None
    robot: str | None = None
    config_dat: Path | None = None
    csv: Path | None = None
    stock_out: Path | None = None
    json: Path | None = None
    strict: bool = False


def engage(request: EngageRequest, stage: Stage = silent) -> Engaged:
    """What each motion cuts, and with which force.  Raises Refusal, and has then written nothing."""
    with large_arrays_in_files(request.program), noted() as inputs:
        return _engage(request, inputs, stage)


def _engage(request: EngageRequest, inputs: Inputs, stage: Stage) -> Engaged:
    cell = cell_of(Request(request.program, cell=request.cell, robot=request.robot))
    process = request.process
    if process is None and cell.process is not None:
        process = cell.path.parent / cell.process
    if process is None:
        message = "neither --process nor the cell states a process file with a stock"
        help = (
            f"add process: milling.yaml to {cell.path}, with stock: and tools:, or use --process milling.yaml"
        )
        raise Refusal(Finding("YML003", message, str(cell.path), help=help))
    if not has_stock(process):
        help = "write stock: {box: [[x, y, z], [x, y, z]]} and tools: {1: {shape: flat, diameter: ..., length: ...}}"
        raise Refusal(Finding("YML003", "the key 'stock' is missing", str(process), help=help))
    check_compiler(str(process))
    from postproc.process.stock.simulation import simulate, unknown_forces

    stage("reading")
    _, program, _ = read_program(request.program, cell, request.config_dat)
    robot = load_robot(find_robot(cell.robot, None if request.robot else cell.path.parent))
    path = completed(program.toolpath, cell, robot, request.program)
    if not len(path):
        raise Refusal(
            Finding("FIL009", "the file contains no motion", str(request.program)), *program.findings
        )
    external = External.of(path, cell.external_axes, robot, cell.robot_base)
    frames = frames_of(cell, path, request.program, external)
    stage("cutting")
    run = simulate(process, path, frames, str(request.program))
    cut = run.engagement
    length = np.bincount(run.sweeps.motion, run.sweeps.length, len(path))
    size, largest = np.linalg.norm(cut.mean[:, :3], axis=1), np.linalg.norm(cut.largest[:, :3], axis=1)
    geometry = np.column_stack([cut.depth, cut.width, cut.entry, cut.exit, cut.chip])
    time = np.where(path.feed > 0, length / np.where(path.feed > 0, path.feed, 1.0), 0.0)
    state = np.where(cut.cuts, 1, 0)
    state[list(cut.hits)] = 2
    by_tool = {}
    for index, cutter in enumerate(run.sweeps.cutters):
        rows = np.unique(run.sweeps.motion[run.sweeps.which == index])
        rows = rows[cut.cuts[rows]]
        if len(rows):
            by_tool[cutter.number] = (
                len(rows),
                float(cut.volume[rows].sum() / MM**3),
                *(cut.most[rows].max(axis=0) / MM).tolist(),
                float(largest[rows].max()),
            )
    ci95 = run.ci95[cut.cuts]
    findings = in_order_of_place(
        [
            *reader_findings(program, path),
            *run.findings,
            *unknown_forces(run, path, str(request.program), "STK015"),
        ]
    )
    outputs = [one for one in (request.csv, request.stock_out, request.json) if one is not None]
    engaged = Engaged(
        program=str(request.program),
        dialect=program.dialect,
        process=process.name,
        blank=run.process.blank,
        line=path.line,
        state=state,
        values=engaged_table(cut.volume, time, cut.mean, largest, geometry, cut.power),
        mean=size,
        largest=largest,
        weight=np.where(cut.cuts, length, 0.0),
        by_tool=by_tool,
        ci95=None if np.isnan(ci95).any() else round(float(ci95.max()), 6),
        collisions=tuple(
            (int(path.line[row]), _PARTS[part]) for row, parts in sorted(cut.hits.items()) for part in parts
        ),
        findings=findings,
        exit=exit_code(findings, request.strict),
    )
    if engaged.exit == 1:
        return engaged
    engaged = replace(engaged, outputs=tuple(str(one) for one in outputs))
    files: dict[Path, bytes] = {}
    if request.csv is not None:
        files[request.csv] = engaged_csv(engaged)
    if request.stock_out is not None:
        files[request.stock_out] = run.stock_file()
    if request.json is not None:
        files[request.json] = json_bytes(engaged)
    inputs.refuse_outputs(files)
    write_atomically(files, still=inputs.refuse_changed)
    return engaged
