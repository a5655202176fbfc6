"""A frame that is elsewhere than stated: what tool_offset and base_offset have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from postproc.base.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Parameter, Values, column
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class FrameOffset(Offset):
    """Three shifts x, y, z [m], then three turns rx, ry, rz [rad], each in the frame that the ones before moved: T =
    Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(rz)."""

    site: ClassVar[str]
    source: ClassVar[str]
    family = "geometric"

    def __init__(self, joints: Sequence[Joint]) -> None:
        axes = ("x", "y", "z", "rx", "ry", "rz")
        self.coordinates = tuple(f"{self.site}.{axis}" for axis in axes)
        self.parameters = tuple(
            Parameter(axis, "rad" if axis[0] == "r" else "m", 0.0, -1.0, 1.0, self.source) for axis in axes
        )

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        offset[[chain.index[name] for name in self.coordinates]] += column(values, self.parameters)
