"""Base offset: the robot does not stand where the cell says."""

from __future__ import annotations

from postproc.effects.frame_offset import FrameOffset


class BaseOffset(FrameOffset):
    """The robot does not stand where the cell says: shift and turn in axes of the robot base (registration)."""

    name = "base_offset"
    site = "base"
    source = "error of the registration of robot and cell"
