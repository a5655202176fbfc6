"""Tool offset: the TCP is not where the tool data state."""

from __future__ import annotations

from postproc.effects.frame_offset import FrameOffset


class ToolOffset(FrameOffset):
    """The TCP is not where the tool data say: shift and turn in tool axes.  After the stated TCP, about it; a wrench
    acts at the TCP that was moved."""

    name = "tool_offset"
    site = "tool"
    source = "error of a tool calibration"
