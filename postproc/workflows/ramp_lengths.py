"""Over how much of the path a force that steps goes over, by what the cell and the process state."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import MM
from postproc.cell import Cell
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramped_forces import ASSUMED, EarlyShares
from postproc.process import Wrenches
from postproc.toolpath import Toolpath

NEAREST = 0.3 * MM
"""[m] Distance of a point that ends a ramp from the next, where the cell does not say how short a motion may be."""


def nearest_point(cell: Cell) -> float:
    """[m] how near to another a point may be where a ramp of the force ends."""
    return cell.min_segment if cell.segment_stated else NEAREST


def ramp_lengths(cell: Cell, path: Toolpath, force: Wrenches) -> Floats:
    """(N,) [m] path over which a force that steps inside a cut goes over: as the cell states; with a stock, in
    which the change of the engagement is known, the shortest motion; else the cutter's radius where the process or the
    cell's tool states it, or what is assumed."""
    if cell.force_ramp is not None:
        return np.broadcast_to(cell.force_ramp, (len(path),))
    if force.stock is not None:
        return np.maximum(nearest_point(cell), 1e-3 * cell.cycle_ms * np.nan_to_num(path.feed))
    radius = np.full(len(path.frames) + 1, np.nan)  # the last is for an unknown tool
    for index, frame in enumerate(path.frames):
        tool = cell.tools.get(frame.entry or 0)
        if tool is not None and tool.diameter is not None:
            radius[index] = 0.5 * tool.diameter
    if force.radius is None and np.isnan(radius).all():
        return np.broadcast_to(ASSUMED, (len(path),))
    ramp = radius[path.tool]
    if force.radius is not None:
        ramp = np.where(np.isnan(force.radius), ramp, force.radius)
    return np.where(np.isnan(ramp), ASSUMED, ramp) if np.isnan(ramp).any() else ramp


def early_shares(cell: Cell, task: CompensationProblem) -> EarlyShares | None:
    """Which shares of the steps of the force go over before them: with a stock, so that the tool digs into the part
    least; none where the cell states a ramp, which follows its step."""
    if task.force.stock is None or cell.force_ramp is not None:
        return None
    from postproc.part.step_sides import find_early_shares  # numba: only where there is a stock
    from postproc.process.stock.simulation import StockRun

    run = task.force.stock
    assert isinstance(run, StockRun)
    return lambda rows, change: find_early_shares(task, run, rows, change)
