"""Transmission error: a gear leads and lags with its angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.yaml_section import YamlSection
from postproc.effects.effect import Conditions, Offset, Parameter, Values
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint


class TransmissionError(Offset):
    """offset_i = sum over harmonics h of s_i_h sin(h q_i) + c_i_h cos(h q_i) [rad]; turning joints only.  q_i [rad] is
    the motor as commanded, counted as the controller counts it; the joint is at q_i + offset_i."""

    name = "transmission_error"
    family = "geometric"
    whole = True

    def __init__(self, joints: Sequence[Joint], harmonics: Sequence[float] = (1.0,)) -> None:
        self.harmonics = tuple(harmonics)
        self._waves = [
            (i, harmonic, wave)
            for i, joint in enumerate(joints)
            if joint.turns
            for harmonic in self.harmonics
            for wave in "sc"
        ]
        self.parameters = tuple(
            Parameter(
                f"{wave}{i + 1}_{harmonic:g}", "rad", 0.0, -0.02, 0.02, "harmonic of a gear's transmission error",
                joints[i].name,
            )
            for i, harmonic, wave in self._waves
        )  # fmt: skip

    @classmethod
    def from_options(cls, options: YamlSection, joints: Sequence[Joint]) -> Self:
        options.only("harmonics")
        if "harmonics" not in options:
            return cls(joints)
        harmonics = options.numbers("harmonics", None)
        if any(harmonic <= 0 for harmonic in harmonics) or len(set(harmonics)) < len(harmonics):
            raise options.error("YML004", "harmonics must be positive and distinct", "harmonics")
        return cls(joints, harmonics)

    @classmethod
    def variants(cls, joints: Sequence[Joint]) -> tuple[Self, ...]:
        return cls(joints, (1.0,)), cls(joints, (2.0,))

    def described(self) -> dict[str, object]:
        return {"harmonics": list(self.harmonics)}

    def add_offset(
        self, values: Values, chain: Chain, motors: Floats, conditions: Conditions, offset: Floats
    ) -> None:
        for parameter, (i, harmonic, wave) in zip(self.parameters, self._waves, strict=True):
            value = values[parameter.name]
            if value != 0.0:
                phase = harmonic * motors[i]
                offset[chain.motor_rows[i]] += value * (np.sin(phase) if wave == "s" else np.cos(phase))
