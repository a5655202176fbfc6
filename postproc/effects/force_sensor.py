"""Force sensor: what was measured is not quite what acts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.effects.effect import ChainState, Load, Parameter, Values
from postproc.robot.chain import generalized_force
from postproc.robot.geometries import Joint


class ForceSensor(Load):
    """The wrench that acts is (1 + gain) (stated - bias): ``gain`` [1], ``fx``, ``fy``, ``fz`` [N] and ``mx``, ``my``,
    ``mz`` [N m] of the bias in axes of the robot base.  What it adds to the stated wrench w acts at the TCP: tau += J^T
    (gain w - (1 + gain) bias).

    A wrench of zero is a tool that touches nothing, not a reading: it stays zero.
    """

    name = "force_sensor"
    family = "sensor"

    def __init__(self, joints: Sequence[Joint]) -> None:
        source = "static error of a force gauge"
        self.parameters = (
            Parameter("gain", "1", 0.0, -0.5, 0.5, source),
            *(Parameter(f"f{axis}", "N", 0.0, -1000.0, 1000.0, source) for axis in "xyz"),
            *(Parameter(f"m{axis}", "N m", 0.0, -1000.0, 1000.0, source) for axis in "xyz"),
        )

    def add_force(self, values: Values, state: ChainState, force: Floats, slope: Floats) -> None:
        bias = np.array([values[name] for name in ("fx", "fy", "fz", "mx", "my", "mz")])[:, None]
        gain = values["gain"]
        error = gain * state.wrench - (1 + gain) * bias
        error = np.where(np.any(state.wrench != 0, axis=0), error, 0.0)
        force += generalized_force(state.swept, state.swept.position, error)
