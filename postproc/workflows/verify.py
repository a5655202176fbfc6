"""``compensate verify``: two written programs, simulated along their ways."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.findings import Finding, Refusal
from postproc.publish import publish
from postproc.report.report import Spread, exit_code, in_order_of_place, json_bytes
from postproc.report.verified import Place, Verified, Way
from postproc.units import MM
from postproc.verification import STEP, Different, Simulation, matched, simulate, worst_places
from postproc.workflows.preparation import Prepared, Request, Stage, prepare, silent

CUT_ENDS = 0.05 * MM
"""What the first and the last sample of a cut may be off: there the tool enters the material and leaves it."""


def verify(request: Request, compensated: Path, step: float = STEP, stage: Stage = silent) -> Verified:
    """The path error of ``request.program`` and of ``compensated``, both under the original's forces.

    ``step`` [m]: distance of the samples.  Raises Refusal, VER001 where the second is not made of the first.
    """
    ready = prepare(request)
    stage("reading the compensated program")
    other = prepare(_without_force(request, compensated, ready))
    try:
        match = matched(ready.task, other.task)
    except Different as error:
        raise Refusal(
            Finding("VER001", str(error), str(request.program), error.line,
                    help="name the original first, and what was made of it second, with the same cell")
        ) from None  # fmt: skip
    stage("simulating the original")
    before = simulate(ready.task, ready.task, np.arange(len(ready.task.toolpath)), step)
    stage("simulating the compensated program")
    after = simulate(ready.task, other.task, match, step)
    findings = [*ready.findings, *_findings(ready, other, compensated, after)]
    told = in_order_of_place(findings)
    done = Verified(
        str(request.program),
        str(compensated),
        ready.robot.name,
        ready.wrenches.source,
        len(ready.task.toolpath),
        len(other.task.toolpath),
        step,
        ready.cell.tolerance,
        _way(ready, before),
        _way(other, after),
        told,
        exit_code(told, request.strict),
    )
    for inputs in (ready.inputs, other.inputs):
        inputs.refuse_outputs([] if request.json is None else [request.json])
        inputs.refuse_changed()
    if request.json is not None:
        publish({request.json: json_bytes(done)})
    return done


def _without_force(request: Request, compensated: Path, ready: Prepared) -> Request:
    """The compensated program in the cell of the original; its forces are those of the original's path."""
    return replace(request, program=compensated, force=None, cell=request.cell or _cell_of(ready))


def _cell_of(ready: Prepared) -> Path | None:
    return ready.cell.path if ready.cell.path.is_file() else None


def _way(ready: Prepared, simulation: Simulation) -> Way:
    cut, off = ~simulation.link, simulation.distance
    ends = simulation.first | simulation.last
    places = worst_places(simulation, ready.task.toolpath)
    return Way(
        len(off),
        Spread.of(off[cut]),
        Spread.of(off[ends]),
        simulation.links,
        simulation.link_length,
        Spread.of(off[simulation.link]),
        simulation.skipped,
        tuple(Place(line, error / MM, axis, force) for line, error, axis, force in places),
    )


def _findings(ready: Prepared, other: Prepared, compensated: Path, after: Simulation) -> list[Finding]:
    findings, file, path = [], str(compensated), other.task.toolpath
    if other.program.marker is None:
        findings.append(Finding("VER002", "this program does not say that it is compensated", file))
    off = np.where(after.link, -1.0, after.distance)
    if len(off) and off.max() > ready.cell.tolerance:
        worst = int(np.argmax(off))
        findings.append(
            Finding(
                "VER003",
                f"{off[worst] / MM:.4f} mm beside the path (worst here), tolerance {ready.cell.tolerance / MM:g} mm",
                file,
                int(path.line[after.motion[worst]]),
            )
        )
    ends = np.where(after.first | after.last, after.distance, -1.0)
    if len(ends) and ends.max() > max(CUT_ENDS, ready.cell.tolerance):
        worst = int(np.argmax(ends))
        findings.append(
            Finding("VER003", f"a cut begins or ends {ends[worst] / MM:.4f} mm beside its place", file,
                    int(path.line[after.motion[worst]]))
        )  # fmt: skip
    if after.skipped:
        findings.append(
            Finding(
                "VER004",
                f"{after.skipped} motions under force can not be simulated (splines, unknown places)",
                file,
            )
        )
    if not len(off):
        findings.append(Finding("VER004", "no motion under force was simulated: is --force missing?", file))
    return findings
