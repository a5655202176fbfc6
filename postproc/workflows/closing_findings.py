"""What is reported of a corrected program as a whole."""

from __future__ import annotations

import numpy as np

from postproc.base import rotary_words
from postproc.base.findings import Finding
from postproc.base.units import DEG, MM
from postproc.compensation.path_comparison import errors_inside, short_motions
from postproc.compensation.splines import unknown_displacements
from postproc.compensation.subdivision import Subdivision
from postproc.output.write import (
    WrittenProgram,
)
from postproc.toolpath import Kind, OrientationPath, Role, Toolpath
from postproc.workflows.corner_findings import corner_findings
from postproc.workflows.missing_points import why_no_more_points
from postproc.workflows.preparation import Prepared, Request


def closing_findings(request: Request, ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """The findings on the corrected program as a whole."""
    file, findings = str(request.program), []
    result, division = written.result, written.division
    path, tolerance = ready.task.toolpath, ready.cell.tolerance
    corrected = result.corrected
    if ready.task.process and not ready.wrenches.any:
        findings.append(Finding("COR010", "no motion has a force: nothing is corrected", file))
    if division.inserted or len(division.lead_ins):
        changed = (division.role != Role.ORIGINAL) | (division.moved & ~corrected[division.source])
        findings.append(
            Finding(
                "COR012",
                _inserted(division, len(path)),
                file,
                int(path.line[division.source[np.argmax(changed)]]),
            )
        )
    findings += corner_findings(ready, written)
    if request.gain < 1.0:
        share = f"{request.gain:.0%} of the correction is applied, as --gain requests"
        findings.append(Finding("COR007", share, file))
    beyond = "" if request.gain == 1.0 else " beyond the share that --gain keeps"
    turns = corrected & path.constraints.orientation_programmed
    for off, limit, rows, unit, word in (
        (written.residual, tolerance, corrected, MM, "mm"),
        (written.off_angle, ready.cell.tolerance_angle, turns, DEG, "deg"),
    ):
        above = rows & ~(off <= limit)
        if above.any():
            row = int(np.argmax(np.where(above, np.nan_to_num(off, nan=np.inf), -1.0)))
            message = (
                f"the residual is {off[row] / unit:.4f} {word}{beyond}, tolerance {limit / unit:g} {word}"
            )
            message += f" ({int(above.sum())} motions)"
            help = _POLE if unit == DEG and _by_pair(path, row) else ""
            findings.append(Finding("COR005", message, file, int(path.line[row]), help=help))
    findings += _between(request, ready, written) + _not_turned(ready, written)
    findings += _changing_forces(ready, written) + _short(ready, written)
    findings += _started(ready, written)
    return findings + _splines(ready, written) + _assumed(request, ready, written)


def _changing_forces(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Where the force changes inside of motions, and the tool is further off than at their end points."""
    task = ready.task
    rows, off = errors_inside(task)
    if not len(rows):
        return []
    at_ends = float(np.nanmax(written.across_before[written.result.scope], initial=0.0))
    worst = int(np.argmax(off))
    if not off[worst] > at_ends:
        return []
    message = (
        f"the force changes inside of {len(rows)} motions: between the end points the uncorrected tool is up to"
        f" {off[worst] / MM:.4f} mm off across the feed (worst here), at them up to {at_ends / MM:.4f}; the uncertainty"
        " between them is larger in the same proportion"
    )
    return [Finding("COR024", message, task.file, int(task.toolpath.line[rows[worst]]))]


def _short(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Motions that the correction leaves shorter than the controller runs without slowing down."""
    path, division = ready.task.toolpath, written.division
    short = short_motions(ready.task, division, 1e-3 * ready.cell.cycle_ms)
    if not len(short):
        return []
    cycle = f"an interpolation cycle of {ready.cell.cycle_ms:g} ms at the programmed feed"
    message = f"a motion is shorter than {cycle}"
    if len(short) > 1:
        message = f"{len(short)} motions are shorter than {cycle} (the first one here)"
    return [Finding("COR025", message, ready.task.file, int(path.line[division.source[short[0]]]))]


def _started(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Cutting motions before which paths of the program meet or part, or a hole is drilled: nothing leads to their
    corrected start."""
    path = ready.task.toolpath
    on_a_path = np.isin(path.kind, (Kind.LIN, Kind.CIRC)) & written.result.corrected & ready.task.carries
    rows = np.flatnonzero(on_a_path & ~path.continues & ~path.drills)
    rows = rows[rows > 0]
    if not len(rows):
        return []
    before = [one for one in path.predecessors.get(int(rows[0]), ()) if one >= 0]
    lines = " or ".join(str(path.line[one]) for one in before[:4])
    why = "branches of the program meet or part" if path.paths_meet[rows[0]] else "a drill cycle is"
    message = (
        f"{why} before this motion{f' (after line {lines})' if lines else ''}: its end"
        f" point is corrected, its start is not ({len(rows)} motions)"
    )
    help = "program a motion in air to the start of the cut, within the same branch"
    if not path.paths_meet[rows[0]]:
        help = "program a motion in air to the start of the cut, after the drill cycle"
    return [Finding("COR023", message, ready.task.file, int(path.line[rows[0]]), help=help)]


def _not_turned(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Cutting motions whose text cannot state the orientation that would be needed: those that keep the one before
    (COR019), and those that have no words for it (COR021)."""
    path, division, limit = ready.task.toolpath, written.division, ready.cell.tolerance_angle
    motion = written.result.corrected & ready.task.carries & ~path.constraints.orientation_programmed
    off = np.where(motion, np.nan_to_num(written.result.after_angle), 0.0)
    np.fmax.at(off, division.source, np.where(motion[division.source], written.between_angle, 0.0))
    findings = []
    for code, rows, why, help in (
        (
            "COR019",
            path.keeps_orientation,
            "#CONSTANT keeps the orientation of the motion before, so only the position is corrected",
            "program the cut with $ORI_TYPE=#VAR, or state tolerance_deg in the cell",
        ),
        (
            "COR021",
            ~path.keeps_orientation,
            "the program does not state the tool's orientation, so only the position is corrected",
            "",
        ),
    ):
        above = rows & (off > limit)
        if above.any():
            row = int(np.argmax(np.where(above, off, -1.0)))
            message = f"the tool remains rotated by {off[row] / DEG:.4f} deg, tolerance {limit / DEG:g} deg"
            message += f" ({int(above.sum())} motions): {why}"
            findings.append(Finding(code, message, ready.task.file, int(path.line[row]), help=help))
    return findings


def _splines(ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """Splines on which the force turns with a feed that only the controller knows."""
    rows, off = unknown_displacements(ready.task, written.result)
    above = off > ready.cell.tolerance
    if not above.any():
        return []
    worst = int(np.argmax(off))
    message = (
        "only the controller knows the path between the points of a spline: the force rotates with it, and the tool may"
        f" be off by {off[worst] / MM:.4f} mm (worst here), tolerance {ready.cell.tolerance / MM:g} mm"
        f" ({int(above.sum())} points)"
    )
    line = int(ready.task.toolpath.line[rows[worst]])
    help = "program the spline with points nearer to each other, or state the force @base"
    return [Finding("COR018", message, ready.task.file, line, help=help)]


def _assumed(request: Request, ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """How rotary axes are taken to run between blocks, where another control would lead the tool elsewhere."""
    path = ready.task.toolpath
    if not path.orientation_control.any_by_words:
        return []
    rows = np.flatnonzero(
        written.result.corrected & (path.orientation_control.path == OrientationPath.ROTARY_AXES) & path.known
    )
    apart = np.nan_to_num(
        rotary_words.beside_great_circle(
            path.orientation_control.rotary_from[rows], path.orientation_control.rotary_to[rows]
        )
    )
    above = apart > ready.cell.tolerance_angle
    if not above.any():
        return []
    worst = int(np.argmax(apart))
    message = (
        "between blocks the words of rotary axes are assumed to run linearly; a control that moves the tool on a great"
        f" circle rotates it up to {apart[worst] / DEG:.4f} deg otherwise ({int(above.sum())} motions)"
    )
    return [Finding("COR020", message, str(request.program), int(path.line[rows[worst]]))]


def _between(request: Request, ready: Prepared, written: WrittenProgram) -> list[Finding]:
    """The findings on the path between the points."""
    path, source, cell, findings = ready.task.toolpath, written.division.source, ready.cell, []
    beyond = "" if request.gain == 1.0 else " beyond the share that --gain keeps"
    for off, rows, limit, unit, what, word in (
        (written.off_between, None, cell.tolerance, MM, "path", "mm"),
        (
            written.off_between_angle,
            path.constraints.orientation_programmed,
            cell.tolerance_angle,
            DEG,
            "orientation",
            "deg",
        ),
    ):
        over = off > limit
        if rows is not None:
            over &= rows[source]
        if over.any():
            worst = int(np.argmax(np.where(over, off, -1.0)))
            row = int(source[worst])
            message = (
                f"the {what} error between points is up to {off[worst] / unit:.4f} {word}{beyond} (worst"
                f" here), tolerance"
                f" {limit / unit:g} {word} ({int(over.sum())} motions)"
            )
            by_pair = unit == DEG and _by_pair(path, row)
            help = _POLE if by_pair else why_no_more_points(request, ready, written.division, row)
            findings.append(Finding("COR006", message, str(request.program), int(path.line[row]), help=help))
    return findings


def _inserted(division: Subdivision, count: int) -> str:
    """What was inserted, and what leads into cuts."""
    links, leads = int(division.transitions.sum()), len(division.lead_ins)
    points = division.inserted - links
    parts = [
        (points, "intermediate point{} inserted"),
        (links, "transition move{} inserted where the correction steps"),
        (leads, "air move{} moved to the corrected start of the next cut"),
    ]
    counts = ", ".join(f"{n} " + words.format("" if n == 1 else "s") for n, words in parts if n)
    return (
        f"the output has {counts} (the first one here): {len(division) / max(count, 1):.3f} times the motions"
    )


_POLE = (
    "near the pole of two rotary axes the outer one hardly rotates the tool: it stays within"
    f" {rotary_words.SWING / DEG:g} deg of its programmed place, and the rest of the error remains"
)


def _by_pair(path: Toolpath, row: int) -> bool:
    """Whether two rotary axes turn the tool in a motion."""
    by_axes = path.orientation_control.path[row] == OrientationPath.ROTARY_AXES
    return bool(by_axes and np.isfinite(path.orientation_control.rotary_to[row]).sum() == 2)
