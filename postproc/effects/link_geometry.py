"""Link geometry: axes that do not lie where the robot's links state."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.base.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Parameter, Values, column
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class LinkGeometry(Offset):
    """The axis of each joint after the first, moved in the frame of that joint: shifts d_x, d_y [m] and turns r_x, r_y
    [rad] across the axis, before its own motion: Tx(d_x) Ty(d_y) Rx(r_x) Ry(r_y) Rz(q), about the origin of the joint's
    frame (see ``LinkCompliance`` for where that lies).

    All Denavit-Hartenberg lengths and twists are among them.  They are redundant: a zero of A3 is a twist of A4 with a
    shift of it.  A fit reports the most plausible of all values that predict the same (``identification.unknowns``).
    """

    name = "link_geometry"
    family = "geometric"
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.coordinates = tuple(
            f"{joint.name}.{axis}" for joint in joints[1:] for axis in ("x", "y", "rx", "ry")
        )
        number = {joint.name: i for i, joint in enumerate(joints, 1)}
        self.parameters = tuple(self._parameter(name, number) for name in self.coordinates)

    @staticmethod
    def _parameter(coordinate: str, number: dict[str, int]) -> Parameter:
        joint, axis = coordinate.rsplit(".", 1)
        turn = axis.startswith("r")
        return Parameter(
            f"{'' if turn else 'd'}{axis}{number[joint]}",
            "rad" if turn else "m",
            0.0,
            -0.1 if turn else -0.05,
            0.1 if turn else 0.05,
            "kinematic calibration: place of an axis relative to the one before",
            joint,
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        offset[[chain.index[name] for name in self.coordinates]] += column(values, self.parameters)
