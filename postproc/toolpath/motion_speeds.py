"""How fast the motions of a program run."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.toolpath.columns import MotionColumns, column, not_given


@dataclass(frozen=True)
class MotionSpeeds(MotionColumns):
    """How fast N motions run.

    ``feed`` (N,) [m/s]: NaN where it is not known.
    ``spindle`` (N,) [rad/s]: the speed of the spindle, as the program states it: below zero where it turns
    counter-clockwise (-inf at a speed that is not known), 0 where it is stopped; NaN where nothing is stated, or it
    varies.
    ``inverse_time_feed`` (N,): the text gives the time that the motion takes, its feed follows from its length (G93).
    """

    feed: Floats = field(metadata=column())
    spindle: Floats = field(default_factory=not_given, metadata=column(default=np.nan))
    inverse_time_feed: Bools = field(
        default_factory=not_given, metadata=column(dtype=np.bool_, default=False)
    )
