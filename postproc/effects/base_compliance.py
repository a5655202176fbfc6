"""Base compliance: the foundation gives way under the whole robot."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.effects.effect import LinearCompliance, Parameter
from postproc.robot.geometries import Joint


class BaseCompliance(LinearCompliance):
    """Three shifts c_x, c_y, c_z [m/N] along and three turns c_rx, c_ry, c_rz [rad/(N m)] about the axes of the robot
    base, in this order from the ground up."""

    name = "base_compliance"
    family = "elastic"
    coordinates = ("base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz")

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "six virtual springs under the robot"
        self.parameters = tuple(
            Parameter(
                f"c_{name.removeprefix('base.')}",
                "rad/(N m)" if ".r" in name else "m/N",
                0.0,
                0.0,
                1e-4 if ".r" in name else 1e-5,
                source,
            )
            for name in self.coordinates
        )
