"""Thermal growth: links that lengthen as the robot warms up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import Conditions, Offset, Parameter, Values, column
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint
from postproc.yamlfile import Section


class ThermalGrowth(Offset):
    """The distance from one joint to the next grows by g_i times the temperature over that of the calibration [m/K]
    (option ``variable: temperature``), or times the time since then [m/s] (``time``)."""

    name = "thermal_growth"
    family = "geometric"

    def __init__(self, joints: Sequence[Joint], variable: str = "temperature") -> None:
        self.variable = variable
        unit = "m/K" if variable == "temperature" else "m/s"
        grown = [(i, j) for i, j in enumerate(joints, 1) if np.linalg.norm(j.placement.position) > 1e-9]
        self.coordinates = tuple(f"{joint.name}.growth" for _, joint in grown)
        self.parameters = tuple(
            Parameter(
                f"g{i}", unit, 0.0, -1e-3, 1e-3, "linear expansion of the link before a joint", joint.name
            )
            for i, joint in grown
        )

    @classmethod
    def from_options(cls, options: Section, joints: Sequence[Joint]) -> Self:
        options.only("variable")
        return cls(joints, options.text("variable", "temperature", ("temperature", "time")))

    @classmethod
    def variants(cls, joints: Sequence[Joint]) -> tuple[Self, ...]:
        return cls(joints, "temperature"), cls(joints, "time")

    def described(self) -> dict[str, object]:
        return {"variable": self.variable}

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        amount = conditions.temperature if self.variable == "temperature" else conditions.time
        if amount is not None:
            offset[[chain.index[name] for name in self.coordinates]] += (
                column(values, self.parameters) * amount
            )
