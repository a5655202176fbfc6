"""Feeds: F in a minute, in a turn of the spindle, or as the inverse of a block's time."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Floats, Ints
from postproc.dialects.gcode.blocks import Blocks
from postproc.dialects.gcode.control import Feed, Group, Once
from postproc.dialects.gcode.words import key


def feeds(given: Blocks, rows: Ints, length: Floats) -> Floats:
    """(N,) [m/s] of the motions in blocks ``rows``; NaN where it is not known.

    G94: F length units a minute; G95: F length units a turn, S turns a minute; G93: the block takes 1/F minutes for its
    ``length`` (N,) [m].
    """
    mode, n = given.modal.force[Group.FEED], len(given)
    # F and S of a dwell are times (G4 F2).
    dwell = given.modal.has(Once.DWELL)
    number = given.number(key("F"))
    stated = np.maximum.accumulate(np.where((given.of(key("F")) >= 0) & ~dwell, np.arange(n), -1))
    at = np.maximum(stated, 0)
    rate = np.where((stated >= 0) & (number[at] > 0), number[at] * given.length[at], np.nan)
    # F means another thing in another mode, and has to be stated again there.
    rate[mode[at] != mode] = np.nan
    spindle = np.maximum.accumulate(np.where((given.of(key("S")) >= 0) & ~dwell, np.arange(n), -1))
    turns = np.where(spindle >= 0, given.number(key("S"))[np.maximum(spindle, 0)], np.nan)
    turns[given.modal.force[Group.SPINDLE] != 0] = np.nan
    own = np.where(number > 0, number, np.nan)[rows]
    here = mode[rows]
    result = np.where(here == Feed.PER_TURN, rate[rows] * turns[rows], rate[rows])
    result = np.where(here == Feed.INVERSE_TIME, np.where(length > 0, length, np.nan) * own, result)
    result[here < 0] = np.nan
    return np.asarray(result / 60.0)
