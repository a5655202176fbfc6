"""Status and Turn of KUKA."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.robot.branches import negative_axes
from postproc.robot.geometries import Geometry, SerialArm
from postproc.robot.makers.maker import SIGN_MARGIN, Maker
from postproc.toolpath import Configuration


class Kuka(Maker):
    """``status``: S, whose bits 0, 1 and 2 are those of ``BranchBit``; its other bits are no matter of the branch.
    ``turn``: T, bit i is set where axis i + 1 is negative.

    Source: KUKA System Software 8.3, Operating and Programming Instructions for System Integrators (2013), Status and
    Turn.
    """

    names = ("status", "turn")
    branch_word = "S"
    turn_message = "the stated T (Turn) is not that of this pose"
    mismatch_message = (
        "the target has a Status/Turn mismatch: the corrected pose is on the other side of an axis angle"
    )

    def branches(self, stated: Configuration) -> Ints:
        """(N,), -1 where S is not stated."""
        status = stated["status"]
        return np.asarray(np.where(status >= 0, status & 7, -1))

    def negative_axes(self, stated: Configuration) -> Ints:
        """(N,) T, -1 where it is not stated."""
        return stated["turn"]

    def turns_change(self, arm: Geometry, stated: Configuration, before: Floats, after: Floats) -> Bools:
        """(N,) T is stated and differs between joint values ``before`` and ``after`` (N, n) [rad, m]; an arm of another
        geometry has none."""
        if isinstance(arm, SerialArm):
            return np.zeros(stated.count, np.bool_)
        changed = negative_axes(before[:, -6:]) != negative_axes(after[:, -6:])
        return np.asarray((stated["turn"] >= 0) & changed)

    def turns_match(self, stated: Configuration, q: Floats) -> Bools:
        """(N,) T is that of joint values ``q`` (N, n) [rad, m], or is not stated."""
        arm, known = q[:, -6:], np.isfinite(q[:, -6:])
        bits = (stated["turn"][:, None] >> np.arange(6)) & 1 == 1
        wrong = (stated["turn"] >= 0)[:, None] & (bits != (arm < 0)) & (np.abs(arm) > SIGN_MARGIN) & known
        return np.asarray(~wrong.any(axis=1))
