"""The robot cell of a program: frames, tools, force and tolerances, read from ``cell.yaml`` and checked."""

from postproc.cell import codes as codes
from postproc.cell.description import MODES, Cell, Controller, ForceVectorInterval, Tool
from postproc.cell.motion_frames import MotionFrames, frames_of, number_literal_tools
from postproc.cell.read_cell import AXES, KEYS, NAME, find_cell, load_cell

__all__ = [
    "AXES",
    "KEYS",
    "MODES",
    "NAME",
    "Cell",
    "Controller",
    "ForceVectorInterval",
    "MotionFrames",
    "Tool",
    "find_cell",
    "frames_of",
    "load_cell",
    "number_literal_tools",
]
