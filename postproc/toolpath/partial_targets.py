"""Targets of which the text gives only some coordinates."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.dataclass import dataclass
from postproc.toolpath.columns import MotionColumns, column, not_given


@dataclass(frozen=True)
class PartialTargets(MotionColumns):
    """The targets among N that follow a motion to axis angles and omit coordinates, which are those where that one
    ends.

    ``inherits_from_row`` (N,): the row of that motion, whose end gives what is omitted; -1 for all other targets.
    ``coordinates`` (N, 6) [m, rad]: X, Y, Z, A, B, C in the programmed base as stated, NaN where omitted.
    """

    inherits_from_row: Ints = field(default_factory=not_given, metadata=column(dtype=np.int32, default=-1))
    coordinates: Floats = field(default_factory=not_given, metadata=column(6, default=np.nan))
