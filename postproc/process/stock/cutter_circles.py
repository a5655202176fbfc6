"""The circles into which the surface of a cutter is cut, and the angles at which their edges cut."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.process.stock.compiled import compiled


@compiled
def circle_at(element: Floats, s: float) -> tuple[float, float, float, float]:
    """At the length ``s`` [m] of an ``element`` (8,) of a profile, see ``Cutter.profile``: the radius and the height
    above the tip [m] of its circle, sine and cosine of the slope."""
    if element[1] == 0.0:
        share = s / element[7]
        r = element[2] + share * (element[4] - element[2])
        height = element[3] + share * (element[5] - element[3])
        return r, height, (element[5] - element[3]) / element[7], (element[4] - element[2]) / element[7]
    sine, cosine = np.sin(s / element[4]), np.cos(s / element[4])
    return element[2] + element[4] * sine, element[3] - element[4] * cosine, sine, cosine


@compiled
def chip_of(
    pose: Floats, r: float, height: float, sine: float, cosine: float
) -> tuple[float, float, float, float, float]:
    """The chip of the feed 1 at the angle phi of a circle, a sin(phi) + b cos(phi) + c: its a, b, c, and the middle and
    half of the angles [rad] at which it is above zero, half -1 where it is at none.

    pose (6, 3): as of ``set_pose``; the circle as of ``circle_at``.
    """
    v, w = pose[4], pose[5]
    lever = r * cosine + height * sine
    a, b, c = v[0] * sine + w[1] * lever, v[1] * sine - w[0] * lever, -v[2] * cosine
    size = np.sqrt(a * a + b * b)
    if c <= -size + 1e-12:
        return a, b, c, 0.0, -1.0
    return a, b, c, np.arctan2(a, b), np.pi if c >= size else np.arccos(-c / size)


@compiled
def on_circle(pose: Floats, r: float, height: float, phi: float) -> tuple[float, float, float]:
    """The place [m] at the angle ``phi`` [rad] of the circle with the radius ``r`` at ``height`` [m]; pose (6, 3)."""
    s, c = r * np.sin(phi), r * np.cos(phi)
    return (
        pose[0, 0] + s * pose[1, 0] + c * pose[2, 0] + height * pose[3, 0],
        pose[0, 1] + s * pose[1, 1] + c * pose[2, 1] + height * pose[3, 1],
        pose[0, 2] + s * pose[1, 2] + c * pose[2, 2] + height * pose[3, 2],
    )
