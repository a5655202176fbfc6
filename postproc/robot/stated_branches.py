"""The branch of the inverse kinematics that a program states, in the words of its robots' maker."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Ints
from postproc.toolpath import Configuration


def stated_branches(configuration: Configuration) -> Ints:
    """(N,) the branch, bits as in KUKA's status S: wrist behind axis 1, elbow, A5 < 0; -1 where none is stated.

    ABB's cfx is 4 (wrist centre behind axis 1) + 2 (behind the lower arm) + 1 (axis 5 negative): ABB, Technical
    reference manual, RAPID Instructions, Functions and Data types, confdata (recalled, and as posts for it write it).
    The elbow bit of S is set with the wrist centre in front of the lower arm.
    """
    status, cfx = configuration["status"], configuration["cfx"]
    if not (cfx >= 0).any():
        return status
    branch = (cfx >> 2 & 1) | (~(cfx >> 1) & 1) << 1 | (cfx & 1) << 2
    return np.asarray(np.where(status >= 0, status, np.where(cfx >= 0, branch, -1)))
