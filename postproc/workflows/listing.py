"""What needs no work: a program read only, the robots that there are."""

from __future__ import annotations

from pathlib import Path

from postproc.model import StiffnessModel
from postproc.report.checked import Checked
from postproc.robot.description import find_robot, load_robot, robot_files
from postproc.workflows.preparation import read_program


def check(path: Path) -> Checked:
    """Read a program only."""
    _, program = read_program(path)
    return Checked(program)


def robots(name: str | None) -> list[StiffnessModel]:
    """The models of all robots, or of one."""
    paths = [find_robot(name)] if name else list(robot_files().values())
    return [StiffnessModel.from_robot(load_robot(path)) for path in paths]
