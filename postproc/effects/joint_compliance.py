"""Joint compliance: each actuator gives way in proportion to the torque on it (virtual joint model)."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Floats
from postproc.effects.effect import ComplianceLaw, Parameter, Values
from postproc.yamlfile import Section


class JointCompliance(ComplianceLaw):
    """theta_i = c_i tau_i, c_i [rad/(N m)]; zero is a rigid joint.

    The inverse of K_theta^0 in eq. (6) of Klimchik et al.; c_i are the k_i of their Table 1.
    """

    name = "joint_compliance"
    family = "elastic"

    def __init__(self, joint_names: tuple[str, ...]) -> None:
        self.parameters = tuple(
            Parameter(f"c{i}", "rad/(N m)", 0.0, 0.0, 1e-2, "VJM: Klimchik et al., Sec. 3")
            for i in range(1, len(joint_names) + 1)
        )

    @classmethod
    def from_options(cls, options: Section, joint_names: tuple[str, ...]) -> JointCompliance:
        options.only()
        return cls(joint_names)

    def displacement(self, values: Values, force: Floats) -> tuple[Floats, Floats]:
        compliance = np.array([values[p.name] for p in self.parameters])[:, None]
        return compliance * force, compliance
