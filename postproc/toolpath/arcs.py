"""The paths of arcs."""

from __future__ import annotations

from dataclasses import field
from enum import IntEnum
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.base.geometry import turned
from postproc.toolpath.columns import MotionColumns, column, not_given


class ArcFrame(IntEnum):
    """To what the orientation on an arc refers."""

    BASE = 0  # to the base, as on a straight line
    PATH = 1  # to the frame of the path, which turns with the tangent
    UNKNOWN = 2


@dataclass(frozen=True)
class Arcs(MotionColumns):
    """The arcs and helices (CIRC) among N motions, in the programmed base; NaN in all other rows.

    From the start p0 to the target p1, at the share t of the path:

        p(t) = c + R(t s n) (p0 - c) + t ((p1 - p0) . n) n

    with the rotation R of a rotation vector.

    ``centre`` (N, 3) [m]: c, a point of the arc's axis.
    ``normal`` (N, 3): n, unit vector of the arc's axis.
    ``sweep`` (N,) [rad]: s > 0, counter-clockwise seen from the tip of the normal.
    ``plane_free`` (N,): the text gives the arc by three points, which may be in any plane but allow no advance along
    the normal; False: the program selects its plane, its normal is kept and an advance is possible.
    ``frame`` (N,): ArcFrame, to what the orientation refers.
    """

    centre: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    normal: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    sweep: Floats = field(default_factory=not_given, metadata=column(default=np.nan))
    plane_free: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=True))
    frame: Ints = field(default_factory=not_given, metadata=column(dtype=np.int8, default=ArcFrame.BASE))

    @cached_property
    def turns_along(self) -> Bools:
        """(N,) arcs with which the tool turns."""
        return np.asarray((self.frame == ArcFrame.PATH) & np.isfinite(self.sweep))

    def turn(self, rows: Ints, base: Floats) -> Floats:
        """(K, 3) [rad] the rotation vectors by which the tool turns along with the arcs ``rows`` (K,), 0 where it does
        not; base (K, 3, 3) or (3, 3): rotation of their programmed base in the axes that are asked for."""
        turn = np.zeros((len(rows), 3))
        along = np.flatnonzero(self.turns_along[rows])
        if len(along):
            at = rows[along]
            turn[along] = turned(
                base if base.ndim == 2 else base[along], self.sweep[at, None] * self.normal[at]
            )
        return turn
