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
    frame (see ``LinkCompliance`` for where that lies).  A joint without a motor has an axis too, and its name in place
    of the number: dx_P1.

    All Denavit-Hartenberg lengths and twists are among them.  They are redundant: a zero of A3 is a twist of A4 with a
    shift of it.  A fit reports the most plausible of all values that predict the same (``identification.unknowns``).
    """

    name = "link_geometry"
    family = "geometric"
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        numbered: list[tuple[str, str]] = []
        for i, joint in enumerate(joints, 1):
            numbered += [(passive.name, f"_{passive.name}") for passive in joint.passive]
            numbered.append((joint.name, str(i)))
        axes = [(name, number, axis) for name, number in numbered[1:] for axis in ("x", "y", "rx", "ry")]
        self.coordinates = tuple(f"{name}.{axis}" for name, _, axis in axes)
        self.parameters = tuple(self._parameter(*one) for one in axes)

    @staticmethod
    def _parameter(joint: str, number: str, axis: str) -> Parameter:
        turn = axis.startswith("r")
        return Parameter(
            f"{'' if turn else 'd'}{axis}{number}",
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
