"""Points on the planned arcs."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import rotation_from_vector
from postproc.base.units import MM
from postproc.languages.dialect import Plan


def on_arcs(plan: Plan, motions: Ints, before: Floats) -> Floats:
    """Points (K, 3) [mm] of the arcs ``motions`` (K,) of a plan, an angle (K,) [rad] before their end.

    c + R(n, -angle) (e - c); NaN for motions that are no arcs.
    """
    centre = plan.centre[motions]
    turn = rotation_from_vector(np.nan_to_num(-before[:, None] * plan.normal[motions]))
    radius = plan.position[motions] - centre
    return np.asarray((centre + (turn @ radius[..., None])[..., 0]) / MM)


def half_way(plan: Plan, motions: Ints) -> Floats:
    """The auxiliary points (K, 3) [mm] of ``motions`` (K,) that say an arc best: in its middle."""
    return on_arcs(plan, motions, plan.sweep[motions] / 2)
