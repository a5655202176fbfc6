"""Forces turned against what is stated, for placements that hold whichever way the force really points."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats

SCENARIOS = 8
"""Senses in which a force is turned for the regret."""


def turned_forces(force: Floats, angle: float, senses: int) -> Floats:
    """(S, R, 3) [N] ``force`` (R, 3) turned by ``angle`` [rad] away from itself in ``senses`` evenly spaced senses, the
    same in all motions.

    The first sense lies in the plane of the force and the vertical, in that of x where the force is vertical.
    """
    size = np.linalg.norm(force, axis=1, keepdims=True)
    unit = force / np.where(size > 0, size, 1.0)
    vertical = np.abs(unit[:, 2:]) > 0.99
    reference = np.where(vertical, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    up = reference - np.sum(reference * unit, axis=1, keepdims=True) * unit
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    aside = np.cross(unit, up)
    sense = 2 * np.pi * np.arange(senses)[:, None, None] / senses
    return np.asarray(
        size * (np.cos(angle) * unit + np.sin(angle) * (np.cos(sense) * up + np.sin(sense) * aside))
    )
