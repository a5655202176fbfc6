"""The branches of the inverse kinematics of an arm with a spherical wrist, whoever made it."""

from __future__ import annotations

from enum import IntFlag

import numpy as np

from postproc.base.arrays import Floats, Ints


class BranchBit(IntFlag):
    """A branch is the sum of these; other arms than those with a spherical wrist have the branch 0 alone."""

    WRIST_BEHIND = 1  # the wrist centre is behind axis 1, in the overhead area
    ELBOW = 2  # axis 3 is beyond the stretched arm: the wrist centre is in front of the lower arm
    FLIPPED = 4  # axis 5 is negative


def negative_axes(q: Floats) -> Ints:
    """(N,) of axis angles (N, n) [rad]: bit i is set where axis i + 1 is negative."""
    return np.asarray(((q < 0).astype(np.int64) << np.arange(q.shape[1])).sum(axis=1))
