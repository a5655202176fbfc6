"""What needs no work: a program read only, the robots that there are."""

from __future__ import annotations

from pathlib import Path

from postproc.cell import load_cell
from postproc.model import StiffnessModel
from postproc.output.atomic_write import write_atomically
from postproc.report.checked import Checked
from postproc.robot.description import find_robot, load_robot, robot_files
from postproc.workflows.preparation import find_cell_beside, read_program


def check(
    path: Path, cell: Path | None = None, config_dat: Path | None = None, page: Path | None = None
) -> Checked:
    """Read a program only, with what the nearest cell, or ``cell``, states of its language; ``page``: file of the
    result for a browser."""
    known = find_cell_beside(path) if cell is None else load_cell(cell)
    _, program, _ = read_program(path, known, config_dat)
    checked = Checked(program)
    if page is not None:
        from postproc.report.page import beside
        from postproc.report.page_checks import checked_page

        write_atomically({page: checked_page(checked, beside(page, {"program": path}))})
    return checked


def robots(name: str | None) -> list[StiffnessModel]:
    """The models of all robots, or of one."""
    paths = [find_robot(name)] if name else list(robot_files().values())
    return [StiffnessModel.from_robot(load_robot(path)) for path in paths]
