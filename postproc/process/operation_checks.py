"""The operations of a process file against the program, its comments, the cell, and what tools and robots are: as the
tools of a stock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.process.cut_checks import CheckCodes, CheckedCut, wrong_forces, wrong_sizes
from postproc.process.milling_forces import mean_force, mean_torque
from postproc.process.process_file import Operation
from postproc.process.spindle_checks import differing_speed, implausible_chips, stopped_spindle
from postproc.process.tool_comments import NamedDiameter, read_named_diameters, read_tool_comments
from postproc.toolpath import Toolpath

OF_OPERATIONS = CheckCodes(
    comment="FRC041", speed="FRC042", stopped="FRC043", chip="FRC044", size="FRC045", force="FRC046"
)


def check_operations(
    operations: Sequence[Operation],
    rows: Mapping[int, Ints],
    toolpath: Toolpath,
    diameters: Mapping[int, float],
    path: Path,
    program: str,
) -> list[Finding]:
    """FRC041 to FRC046.  rows: by the index of an operation (K,) its motions that cut; diameters: of the cell's tools
    by number [m]."""
    named = read_named_diameters(toolpath)
    for number, tool in read_tool_comments(toolpath).items():  # their unit is known
        named[number] = [NamedDiameter(2 * tool.radius / MM, 1.0, tool.line)]
    findings, codes = [], OF_OPERATIONS
    for index, own in rows.items():
        cut = _checked(operations[index], own, toolpath, path)
        findings += _comments(cut, named, program)
        findings += implausible_chips(cut, toolpath, program, codes.chip)
        findings += stopped_spindle(cut, toolpath, program, codes.stopped)
        findings += differing_speed(cut, toolpath, program, codes.speed)
        findings += wrong_sizes(cut, diameters, toolpath, codes.size)
        findings += wrong_forces(cut, codes.force)
    return findings


def _checked(operation: Operation, rows: Ints, toolpath: Toolpath, path: Path) -> CheckedCut:
    cut = operation.cut
    frames = {toolpath.frames[index].entry for index in np.unique(toolpath.tool[rows]) if index >= 0}
    feed = np.array([operation.feed_per_tooth(toolpath.feed[rows]).max()])

    def everywhere(value: float) -> Floats:
        return np.full(len(rows), value)

    return CheckedCut(
        name=f"operation {operation.label}",
        numbers=tuple(sorted(number for number in frames if number)),
        diameter=cut.diameter,
        teeth=cut.teeth,
        helix=cut.helix,
        speed=operation.speed,
        material=operation.material,
        file=str(path),
        line=operation.line,
        rows=rows,
        depth=everywhere(cut.depth),
        width=everywhere(0.5 * cut.diameter * (np.cos(cut.entry) - np.cos(cut.exit))),
        force=float(np.linalg.norm(mean_force(cut, feed))),
        power=float(abs(mean_torque(cut, feed)[0]) * operation.speed),
    )


def _comments(cut: CheckedCut, named: Mapping[int, list[NamedDiameter]], program: str) -> list[Finding]:
    """One finding for each tool of the cut of which the comments name other diameters only; a number may be used for
    one cutter after another."""
    findings = []
    for number in cut.numbers:
        there = named.get(number, [])
        if there and not any(one.may_be(cut.diameter) for one in there):
            message = (
                f"this comment names {there[0].words} for tool {number}; the process file states the diameter"
                f" {cut.diameter / MM:g} mm for {cut.name}, which is used"
            )
            findings.append(Finding(OF_OPERATIONS.comment, message, program, there[0].line))
    return findings
