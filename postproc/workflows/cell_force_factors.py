"""The factors that a cell states of the forces of its operations, applied to a program."""

from __future__ import annotations

from postproc.base.arrays import Floats
from postproc.cell import Cell
from postproc.cell.tool_errors import OTHERS
from postproc.process import Wrenches
from postproc.process.force_factors import ForceFactors
from postproc.process.operation_names import OperationNames, name_operations
from postproc.process.process_file import read_process
from postproc.process.stock.stated_stock import has_stock
from postproc.toolpath import Toolpath


def operations_of(cell: Cell, forces: Wrenches, path: Toolpath) -> OperationNames:
    """The operations of a program: by the process file where the forces come from it.  Raises Refusal of that file."""
    if cell.process is not None:
        process = cell.path.parent / cell.process
        if not has_stock(process) and process.name in forces.source:
            return name_operations(path, read_process(process))
    return name_operations(path)


def cell_force_factors(cell: Cell) -> ForceFactors:
    """What the cell states."""
    known = cell.force_factors
    others = known.get(OTHERS)
    return ForceFactors(
        {name: one.factor for name, one in known.items() if name != OTHERS},
        {name: one.turn for name, one in known.items()},
        1.0 if others is None else others.factor,
        ci95={name: one.ci95 for name, one in known.items() if one.ci95 is not None},
    )


def factored(cell: Cell, forces: Wrenches, path: Toolpath, base: Floats) -> Wrenches:
    """Forces (N) with the factors of the cell; base (N, 3, 3): axes of the programmed base."""
    if not cell.force_factors or not forces.any:
        return forces
    return cell_force_factors(cell).acting(forces, operations_of(cell, forces, path), base)
