"""The force at places along the motions of a program, as profiles of the motions."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.force_profiles import ForceProfiles, reduce_profiles
from postproc.process.stock.motion_sweeps import MotionSweeps

LEAST_PART = 0.125
"""Radii of the cutter: a straight part of a profile is no shorter."""


def profiles_of_places(sweeps: MotionSweeps, sweep: Ints, weight: Floats, wrench: Floats) -> ForceProfiles:
    """The profiles of motions of which all places (K,) are given, in their order on the path.

    sweep (K,): of which sweep each is; weight (K,) [m]: the length of path that it represents; wrench (K, 6): in feed
    axes.  Sweeps of the motions without a place are far from the stock.
    """
    if not len(sweep):
        return ForceProfiles.none()
    first = np.flatnonzero(np.append(True, sweep[1:] != sweep[:-1]))
    total = np.cumsum(weight) - weight
    within = total - np.repeat(total[first], np.diff(np.append(first, len(sweep)))) + 0.5 * weight
    low, high = sweeps.share[sweep].T
    share = low + (high - low) * within / np.maximum(sweeps.length[sweep], 1e-9)
    beside = np.setdiff1d(np.flatnonzero(np.isin(sweeps.motion, sweeps.motion[sweep])), sweep)
    sweep = np.concatenate([sweep, beside, beside])
    share = np.concatenate([share, *sweeps.share[beside].T])
    wrench = np.concatenate([wrench, np.zeros((2 * len(beside), 6))])
    order = np.lexsort((share, sweeps.motion[sweep]))
    sweep, share, wrench = sweep[order], share[order], wrench[order]
    motion = sweeps.motion[sweep]
    length = np.bincount(sweeps.motion, sweeps.length)[motion]
    radius = np.array([cutter.radius for cutter in sweeps.cutters])[sweeps.which[sweep]]
    return reduce_profiles(motion, share, wrench, LEAST_PART * radius / np.maximum(length, 1e-9))
