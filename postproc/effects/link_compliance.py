"""Link compliance: bearings and links that tilt across the axis of their joint."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.effects.effect import LinearCompliance, Parameter
from postproc.robot.geometries import Joint


class LinkCompliance(LinearCompliance):
    """Two small turns per joint, about the x and y axes of its frame (z is the joint's axis), before its own motion:
    theta = c tau, c [rad/(N m)]."""

    name = "link_compliance"
    family = "elastic"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "cross-axis virtual springs of an extended VJM"
        self.parameters = tuple(
            Parameter(f"c{i}{axis}", "rad/(N m)", 0.0, 0.0, 1e-4, source, joint.name)
            for i, joint in enumerate(joints, 1)
            for axis in "xy"
        )
        self.coordinates = tuple(f"{joint.name}.r{axis}" for joint in joints for axis in "xy")
