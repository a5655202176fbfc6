"""CONFIG of Fanuc."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.robot.geometries import Geometry
from postproc.robot.makers.maker import Maker, parts_differ
from postproc.toolpath import Configuration


class Fanuc(Maker):
    """``nut``: 4 for B (bottom: wrist centre behind axis 1), 2 for D (elbow down) and 1 for F (flip: axis 5 positive as
    Fanuc counts it, which is the bit of ``BranchBit``); B is not read here.  ``revolutions``: the turns of axes 1, 4
    and 6, packed: 0 is -180 to 179 deg.

    Source: FANUC, operator's manual of R-30iB, configuration (recalled; N U T with J5 = -90 is the tool pointing down
    from a level forearm).
    """

    names = ("nut", "revolutions")
    branch_word = "CONFIG"
    mismatch_message = (
        "the target has a CONFIG mismatch: the corrected pose is in another turn of J1, J4 or J6"
    )

    def branches(self, stated: Configuration) -> Ints:
        """(N,), -1 where the flags are not stated or name the bottom."""
        nut = stated["nut"]
        known = (nut >= 0) & (nut & 4 == 0)
        return np.asarray(np.where(known, (~(nut >> 1) & 1) << 1 | (nut & 1) << 2, -1))

    def turns_change(self, arm: Geometry, stated: Configuration, before: Floats, after: Floats) -> Bools:
        """(N,) axis 1, 4 or 6 is in another turn at joint values ``after`` than at ``before`` (N, n) [rad, m], and
        turns are stated."""
        return np.asarray((stated["revolutions"] >= 0) & parts_differ(before, after, -np.pi, 2 * np.pi))
