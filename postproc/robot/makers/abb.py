"""confdata of ABB."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.robot.makers.maker import SIGN_MARGIN, TURNED, Maker, parts_differ
from postproc.toolpath import Configuration, unpack_quadrants


class Abb(Maker):
    """``cfx``: 4 (wrist centre behind axis 1) + 2 (behind the lower arm) + 1 (axis 5 negative); the bit of the elbow in
    ``BranchBit`` is set with the wrist centre in front of the lower arm.  ``quadrants``: cf1, cf4 and cf6, packed: 0 is
    0 to 90 deg of axis 1, 4 or 6, -1 is -90 to 0.

    Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types, confdata (recalled, and as
    posts for it write it).
    """

    names = ("cfx", "quadrants")
    branch_word = "cfx"
    turn_message = "the stated quadrants (cf1, cf4, cf6) are not those of this pose"
    mismatch_message = (
        "the target has a Status/Turn mismatch: the corrected pose is on the other side of an axis angle"
    )
    quadrant_message = (
        "the corrected pose is in another quadrant of axis 1, 4 or 6 than cf1, cf4 and cf6 state"
    )

    def branches(self, stated: Configuration) -> Ints:
        """(N,), -1 where cfx is not stated."""
        cfx = stated["cfx"]
        branch = (cfx >> 2 & 1) | (~(cfx >> 1) & 1) << 1 | (cfx & 1) << 2
        return np.asarray(np.where(cfx >= 0, branch, -1))

    def quadrants_change(self, stated: Configuration, before: Floats, after: Floats) -> Bools:
        """(N,) axis 1, 4 or 6 is in another quarter of a turn at joint values ``after`` than at ``before`` (N, n)
        [rad, m], and quarters are stated."""
        return np.asarray((stated["quadrants"] >= 0) & parts_differ(before, after, 0.0, 0.5 * np.pi))

    def turns_match(self, stated: Configuration, q: Floats) -> Bools:
        """(N,) the quadrants are those of joint values ``q`` (N, n) [rad, m], or are not stated; whole turns do not
        count."""
        turned, quarter = q[:, -6:][:, TURNED], 0.5 * np.pi
        away = np.abs(turned - quarter * np.round(turned / quarter)) > SIGN_MARGIN
        supervised = (stated["quadrants"] >= 0) & (stated["cfx"] >= 0)
        other = np.floor(np.nan_to_num(turned) / quarter).astype(np.int64) - unpack_quadrants(
            stated["quadrants"]
        )
        elsewhere = supervised[:, None] & (other % 4 != 0) & away & np.isfinite(turned)
        return np.asarray(~elsewhere.any(axis=1))
