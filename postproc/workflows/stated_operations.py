"""Operations that a cell states figures of, held against those of a program: ``force_factors``, ``tool_errors``."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from postproc.base.findings import Finding
from postproc.cell import Cell
from postproc.cell.tool_errors import OTHERS
from postproc.process import Wrenches
from postproc.toolpath import Toolpath
from postproc.workflows.cell_force_factors import operations_of

ALIKE = 0.75
"""Share of common letters from which a word of four letters or more may be a slip of another one."""

SHOWN = 5


def stated_operation_findings(cell: Cell, forces: Wrenches, path: Toolpath) -> list[Finding]:
    """FRC039: the factors that act on forces; CEL015: a name that is hardly meant, as it resembles an operation of the
    program that has no entry, or as no entry fits the program; CEL016: entries of operations of other programs."""
    if not (cell.force_factors or cell.tool_errors) or not len(path):
        return []
    operations = operations_of(cell, forces, path)
    cut = np.unique(operations.which[forces.carries]) if forces.any else np.unique(operations.which)
    names = [operations.names[index] for index in cut.tolist()]
    file, findings = str(cell.path), []
    if cell.force_factors and forces.any:
        findings += _compared("force_factors", cell.force_factors, names, file, cell.force_factors_line)
        acting = [
            f"{name} {cell.force_factors[key].factor:g}"
            for name in names
            if (key := name if name in cell.force_factors else OTHERS) in cell.force_factors
        ]
        if acting:
            message = f"stated forces are multiplied by factors of the cell: {_listed(acting)}"
            findings.append(Finding("FRC039", message, file, cell.force_factors_line))
    tools = np.unique(path.tool[path.tool >= 0]).tolist()
    used = {path.frames[index].entry or 0 for index in tools}
    for number, error in cell.tool_errors.items():
        if number in used and error.walls:
            key = f"tool_errors: {number}: walls"
            findings += _compared(key, error.walls, names, file, cell.tool_errors_line)
    return findings


def _compared(
    key: str, stated: Mapping[str, object], names: Sequence[str], file: str, line: int
) -> list[Finding]:
    lost = [name for name in stated if name != OTHERS and name not in names]
    free = [name for name in names if name not in stated]
    findings, foreign = [], []
    for name in lost:
        meant = next((other for other in free if _may_be(name, other)), None)
        if meant is None:
            foreign.append(name)
            continue
        message = f"the operation {name!r} of {key} is not in the program; did you mean {meant!r}?"
        findings.append(Finding("CEL015", message, file, line, help=_WHOLE))
    if not foreign:
        return findings
    if not findings and len(lost) == sum(name != OTHERS for name in stated) and OTHERS not in stated:
        message = f"no operation of {key} is in the program, which has {_listed(names)}"
        return [Finding("CEL015", message, file, line, help=_WHOLE)]
    message = f"{key} states operations that are not in this program: {_listed(foreign)}"
    return [*findings, Finding("CEL016", message, file, line)]


_WHOLE = "write the whole name of the operation, as the comment OPERATION or the process file has it"


def _may_be(name: str, other: str) -> bool:
    """Whether ``name`` is some of the words of ``other``, or the same words but for slips within long ones."""
    one, two = name.split(), other.split()
    if set(one) < set(two):
        return True
    return len(one) == len(two) and all(
        a == b
        or (min(len(a), len(b)) >= 4 and difflib.SequenceMatcher(None, a, b, autojunk=False).ratio() >= ALIKE)
        for a, b in zip(one, two, strict=True)
    )


def _listed(words: Iterable[str]) -> str:
    every = list(words)
    return ", ".join(every[:SHOWN]) + (f" and {len(every) - SHOWN} more" if len(every) > SHOWN else "")
