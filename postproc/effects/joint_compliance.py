"""Joint compliance: each actuator deflects in proportion to the torque on it (virtual joint model)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from postproc.effects.effect import LinearCompliance, per_joint
from postproc.robot.chain import Chain
from postproc.robot.geometries import Joint

PLAUSIBLE = (1e-9, 1e-3)
"""[rad/(N m)] Stiffer is no drive, and softer no arm that holds a spindle: 1e9 and 1e3 N m/rad."""


class JointCompliance(LinearCompliance):
    """theta_i = c_i tau_i, c_i [rad/(N m)] (a sliding joint: [m/N]); zero is a rigid joint.  theta_i adds to the
    joint's own coordinate; tau_i is the whole generalized force on it at the deflected pose: J^T w and all loads
    (weights, springs).

    The inverse of K_theta^0 in eq. (6) of Klimchik et al. (2014; see ``gravity_compensator``); c_i are the k_i of their
    Table 1.
    """

    name = "joint_compliance"
    family = "elastic"
    whole = True

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "virtual joint model: Klimchik et al., Sec. 3"
        units = ("rad/(N m)", "m/N")
        self.parameters = per_joint(joints, "c", units, 0.0, 1e-2, source, plausible=PLAUSIBLE)

    def rows(self, chain: Chain) -> Any:
        return chain.motors
