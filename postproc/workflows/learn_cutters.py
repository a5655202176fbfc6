"""The tools that left a measured surface: from where the main job takes them, and from the cell."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.learning import codes as codes
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.stated_stock import has_stock
from postproc.process.stock.stock_section import read_stock_process
from postproc.process.tool_comments import CommentedTool, read_tool_comments
from postproc.workflows.preparation import Prepared

SAME = 1e-6
"""[m] Radii that differ by less are one."""


def cutters_of(ready: Prepared, number: Ints) -> tuple[tuple[Cutter, ...], tuple[Finding, ...]]:
    """The tools that cut: of the process file with the comments of the program that it takes, else by a comment alone,
    else flat ends of the diameter that cell or process state; number (N,): of each motion's tool.  Raises Refusal
    LRN011 where no tool is known."""
    cell, carries = ready.cell, ready.task.carries
    commented = read_tool_comments(ready.task.toolpath)
    stated = _of_process(ready, commented)
    findings, cutters = [], []
    for one in np.unique(number[carries]).tolist():
        if one in stated:
            cutters.append(stated[one])
            continue
        radius, comment = _stated_radius(ready, carries & (number == one), one), commented.get(one)
        if comment is not None and (radius is None or abs(comment.radius - radius) < SAME):
            cutters.append(
                Cutter(one, comment.shape, comment.radius, corner=comment.corner, taper=comment.taper)
            )
            message = f"tool {one} is {comment.words}, by this comment"
            findings.append(Finding("LRN007", message, ready.task.file, comment.line))
        elif radius is not None:
            cutters.append(Cutter(one, "flat", radius))
            message = (
                f"tool {one} is taken as a flat end of {2 * radius / MM:g} mm, the diameter that is stated"
            )
            findings.append(Finding("LRN007", message, str(cell.path)))
    if not cutters:
        message = (
            "neither process file, cell nor program states the shape or the diameter of a tool that cuts"
        )
        help = "add diameter: 16 to the tool in the cell, or its shape to tools: of the process file"
        raise Refusal(Finding("LRN011", message, str(cell.path), help=help))
    return tuple(cutters), tuple(findings)


def _of_process(ready: Prepared, commented: Mapping[int, CommentedTool]) -> Mapping[int, Cutter]:
    """Those of the stock that the forces come from, else of the process file that the cell names."""
    if ready.wrenches.stock is not None:
        from postproc.process.stock.simulation import StockRun  # numba: only where there is a stock

        assert isinstance(ready.wrenches.stock, StockRun)
        return ready.wrenches.stock.process.cutters
    cell = ready.cell
    if cell.process is not None and has_stock(cell.path.parent / cell.process):
        return read_stock_process(cell.path.parent / cell.process, commented).cutters
    return {}


def _stated_radius(ready: Prepared, rows: np.ndarray, number: int) -> float | None:
    """[m] by the cell, else by the operations of a process file, where these are one for all motions ``rows`` (N,)."""
    tool = ready.cell.tools.get(number)
    if tool is not None and tool.diameter is not None:
        return 0.5 * tool.diameter
    if ready.wrenches.radius is None:
        return None
    radii = ready.wrenches.radius[rows]
    radii = np.unique(radii[np.isfinite(radii)])
    return float(radii[0]) if len(radii) == 1 else None
