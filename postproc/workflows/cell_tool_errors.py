"""How the tools of a cell differ from what is programmed, applied to a program."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.cell import Cell, MotionFrames
from postproc.cell.tool_errors import ToolError
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.tool_displacement import ToolDisplacement
from postproc.process.mirrored_cuts import oblique_findings
from postproc.process.operation_names import OperationNames
from postproc.toolpath import Toolpath
from postproc.workflows.cell_force_factors import operations_of
from postproc.workflows.stated_operations import stated_operation_findings

SHOWN = 4


def tool_numbers(path: Toolpath) -> Ints:
    """(N,) number of the tool of each motion, 0 without."""
    return np.array([frame.entry or 0 for frame in path.frames] + [0])[path.tool]


def tool_displacement(
    errors: Mapping[int, ToolError],
    task: CompensationProblem,
    spindle: Floats,
    tool: Ints,
    operations: OperationNames,
) -> ToolDisplacement:
    """Of ``errors`` by number of the tool; spindle (N, 3) in tool axes, tip-ward; tool (N,): numbers."""
    path = task.toolpath
    return ToolDisplacement(
        task.desired_path,
        spindle,
        tool,
        operations,
        {number: one.length for number, one in errors.items() if one.length},
        {number: one.radius for number, one in errors.items() if one.radius},
        {(number, name): one.side(name) for number, one in errors.items() for name in operations.names},
        path.reflections.sides(path.rotation, spindle),
        task.carries,
    )


def cell_tool_displacement(
    cell: Cell, task: CompensationProblem, frames: MotionFrames
) -> tuple[ToolDisplacement | None, list[Finding]]:
    """What the cell states of the tools of a program, None where it states nothing of them; and findings of cuts whose
    wall is on a side that nobody states, and of operations of the cell that the program does not have."""
    path = task.toolpath
    tool = tool_numbers(path)
    used = {number: one for number, one in cell.tool_errors.items() if (tool == number).any()}
    findings = stated_operation_findings(cell, task.force, path)
    if not used:
        return None, findings
    operations = operations_of(cell, task.force, path)
    for number, one in used.items():
        cut = np.unique(operations.which[task.carries & (tool == number)])
        lost = [operations.names[index] for index in cut.tolist() if not one.states(operations.names[index])]
        if one.radius and lost:
            names = ", ".join(lost[:SHOWN]) + (f" and {len(lost) - SHOWN} more" if len(lost) > SHOWN else "")
            message = (
                f"the radius of tool {number} is off by {one.radius / MM:+.3f} mm, and no side of a wall is stated"
                f" for {names}: it is not corrected there"
            )
            help = f"add to tool_errors: {number}: walls: {{{lost[0]}: left}}, or right, or none where no wall is cut"
            findings.append(Finding("CEL013", message, str(cell.path), cell.tool_errors_line, help=help))
    spindle = np.nan_to_num(frames.spindle_in_tool[np.arange(len(path))])
    displacement = tool_displacement(used, task, spindle, tool, operations)
    thicker = [number for number, one in used.items() if one.radius]
    oblique = np.flatnonzero(task.carries & (displacement.hand == 0) & np.isin(tool, thicker))
    findings += oblique_findings(oblique, "are not corrected for the radius of their tool", path, task.file)
    return displacement, findings
