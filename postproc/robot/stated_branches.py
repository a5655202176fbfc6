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

    Fanuc's flags are 4 for B (bottom: wrist centre behind axis 1), 2 for D (elbow down) and 1 for F (flip: axis 5
    positive as Fanuc counts it, which is negative as KUKA does); B is not read here: FANUC, operator's manual of
    R-30iB, configuration (recalled; N U T with J5 = -90 is the tool pointing down from a level forearm).
    """
    status, cfx, nut = configuration["status"], configuration["cfx"], configuration["nut"]
    if (nut >= 0).any():
        known = (nut >= 0) & (nut & 4 == 0)
        return np.asarray(np.where(known, (~(nut >> 1) & 1) << 1 | (nut & 1) << 2, status))
    if not (cfx >= 0).any():
        return status
    branch = (cfx >> 2 & 1) | (~(cfx >> 1) & 1) << 1 | (cfx & 1) << 2
    return np.asarray(np.where(status >= 0, status, np.where(cfx >= 0, branch, -1)))
