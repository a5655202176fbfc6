"""How programs state in which configuration the robot is to reach a target."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import DEG
from postproc.robot.geometries import Geometry
from postproc.toolpath import Configuration

SIGN_MARGIN = 0.01 * DEG
"""An axis nearer to a border than this is on both sides of it: taught values are rounded."""

TURNED = [-6, -3, -1]
"""Of the last six axes those whose turns makers state: 1, 4 and 6."""


class Maker:
    """A family of robots by what its programs state; this one states nothing.

    ``names``: the numbers of a ``Configuration`` that it knows.  ``branch_word``: its own word for the branch.
    ``turn_message``: what is reported where the turns of a pose are not those stated; ``mismatch_message``: where a
    corrected pose needs another full turn of an axis; ``quadrant_message``: where it is in another quadrant.
    """

    names: ClassVar[tuple[str, ...]] = ()
    branch_word: ClassVar[str] = ""
    turn_message: ClassVar[str] = ""
    mismatch_message: ClassVar[str] = ""
    quadrant_message: ClassVar[str] = ""

    def branches(self, stated: Configuration) -> Ints:
        """(N,) the branch of each motion, see ``BranchBit``; -1 where none is stated."""
        return np.full(stated.count, -1)

    def negative_axes(self, stated: Configuration) -> Ints:
        """(N,) as of ``branches.negative_axes``; -1 where the signs of the axes are not stated."""
        return np.full(stated.count, -1)

    def turns_change(self, arm: Geometry, stated: Configuration, before: Floats, after: Floats) -> Bools:
        """(N,) joint values ``before`` and ``after`` (N, n) [rad, m] differ in the turns that are stated."""
        return np.zeros(stated.count, np.bool_)

    def quadrants_change(self, stated: Configuration, before: Floats, after: Floats) -> Bools:
        """(N,) joint values ``before`` and ``after`` (N, n) [rad, m] differ in the quadrants that are stated."""
        return np.zeros(stated.count, np.bool_)

    def turns_match(self, stated: Configuration, q: Floats) -> Bools:
        """(N,) the stated turns are those of joint values ``q`` (N, n) [rad, m], or are not stated; an axis within
        ``SIGN_MARGIN`` of a border is on both sides of it."""
        return np.ones(stated.count, np.bool_)


def parts_differ(before: Floats, after: Floats, start: float, size: float) -> Bools:
    """(N,) axis 1, 4 or 6 of joint values ``before`` and ``after`` (N, n) [rad, m] is in another one of the parts of
    ``size`` [rad], of which one starts at ``start`` [rad]."""
    parts = [(q[:, TURNED] - start) // size for q in (before, after)]
    return np.asarray((parts[0] != parts[1]).any(axis=1))
