"""Orientations that a program states in the axes of the machine, in a cell whose bases are rotated."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from postproc.base.findings import Finding
from postproc.base.geometry import Poses, vector_from_rotation
from postproc.base.units import DEG
from postproc.cell import Cell
from postproc.toolpath import FrameRef, Toolpath

MESSAGE = (
    "the tool vector is in the axes of the machine (ORIMKS), and the base in the cell is rotated: how the tool is"
    " oriented on the part is not known"
)
SAME_ANGLE = 0.01 * DEG
"""A base that is rotated by less has the axes of the machine."""


def refuse_machine_orientations(path: Toolpath, cell: Cell, program: Path) -> Toolpath:
    """The toolpath, without the motions whose orientation is in the axes of the machine (ORIMKS) and whose base in the
    cell is rotated against these: the axes of the robot root, or what it stands on, may be either of them."""
    stated = path.orientation_control.in_machine
    if not stated.any():
        return path
    rotated = np.array([_is_rotated(frame, cell) for frame in path.frames] + [True])
    refused = dict(path.constraints.refused)
    for row in np.flatnonzero(stated & rotated[path.base]).tolist():
        help = "let the post-processor write tool vectors in the axes of the part (ORIWKS)"
        finding = Finding("GCO013", MESSAGE, str(program), int(path.line[row]), help=help)
        refused.setdefault(row, finding)
    return path.with_refused(refused)


def _is_rotated(frame: FrameRef, cell: Cell) -> bool:
    """Whether a base is rotated against the robot or against the world, or not known."""
    pose = frame.pose if frame.pose is not None else cell.bases.get(frame.entry or 0)
    if pose is None:
        return frame.number != 0
    poses: list[Poses] = [pose, cell.robot_base.inverse() @ pose]
    return max(float(np.linalg.norm(vector_from_rotation(one.rotation))) for one in poses) > SAME_ANGLE
