"""Base offset: the robot is not where the cell states."""

from __future__ import annotations

from postproc.effects.frame_offset import FrameOffset


class BaseOffset(FrameOffset):
    """The robot is not where the cell states: shift and turn in axes of the robot base (registration).  About the
    origin of the robot base, before the first joint: base_in_cell is that stated, then this offset; wrenches and
    gravity keep the axes of the robot base that were stated."""

    name = "base_offset"
    site = "base"
    source = "error of the registration of robot and cell"
