"""Base compliance: the foundation deflects under the whole robot."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.effects.effect import LinearCompliance, Parameter
from postproc.robot.geometries import Joint


class BaseCompliance(LinearCompliance):
    """theta = c tau: three shifts along, c_x, c_y, c_z [m/N], and three turns about, c_rx, c_ry, c_rz [rad/(N m)], the
    axes of the robot base, through its origin.

    They are before the first joint in this order from the ground up, each in the frame that the ones before moved: T
    = Tx Ty Tz Rx Ry Rz.  tau: force [N] along and moment [N m] about that axis, of the wrench at the TCP and of all
    weights, at the deflected pose.
    """

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
