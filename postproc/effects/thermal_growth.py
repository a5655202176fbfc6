"""Thermal growth: links that lengthen as the robot warms up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.yaml_section import YamlSection
from postproc.effects.effect import Conditions, Offset, Parameter, Values, column
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class ThermalGrowth(Offset):
    """The distance from one joint to the next grows by g_i times the temperature over that of the calibration [m/K]
    (option ``variable: temperature``), or times the time since then [m/s] (``time``).

    Option ``reference`` [degC]: the temperature of the calibration, from which a cell's ``temperature`` counts.
    """

    name = "thermal_growth"
    family = "geometric"

    def __init__(
        self, joints: Sequence[Joint], variable: str = "temperature", reference: float | None = None
    ) -> None:
        self.variable, self.reference = variable, reference
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
    def from_options(cls, options: YamlSection, joints: Sequence[Joint]) -> Self:
        options.only("variable", "reference")
        variable = options.text("variable", "temperature", ("temperature", "time"))
        if "reference" not in options:
            return cls(joints, variable)
        if variable == "time":
            raise options.error(
                "YML004", "excludes 'variable: time'; only a temperature has a reference", "reference"
            )
        return cls(joints, variable, options.number("reference", low=-10.0, high=60.0, unit="degC"))

    @classmethod
    def variants(cls, joints: Sequence[Joint]) -> tuple[Self, ...]:
        return cls(joints, "temperature"), cls(joints, "time")

    def described(self) -> dict[str, object]:
        reference = {} if self.reference is None else {"reference": self.reference}
        return self.form() | reference

    def form(self) -> dict[str, object]:
        return {"variable": self.variable}

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        amount = conditions.temperature if self.variable == "temperature" else conditions.time
        if amount is not None:
            offset[[chain.index[name] for name in self.coordinates]] += (
                column(values, self.parameters) * amount
            )
