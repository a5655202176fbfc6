"""Where the tool is after a canned cycle, along the axis in which it works."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.control import Group, Move
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.words import How, key


def cycle_ends(given: BlockWords, events: Ints) -> Floats:
    """(B,) [m] the coordinate of the working axis after the cycle of each block of a whole program, NaN where it is not
    known; ``events`` (E,): blocks that change the frame.

    G99: at R.  G98: where the first of the cycles without another motion between began, if that is not below R: from
    there controls differ.  R is known where it is a coordinate (G90); it holds to the end of these cycles.
    """
    n = len(given)
    cycle = given.motion & (given.move == Move.CYCLE)
    rows = np.flatnonzero(cycle)
    if not len(rows):
        return everywhere(np.nan, n)
    level = np.full(n, np.nan)
    axis = np.array([2, 1, 0])[np.clip(given.modal.force[Group.PLANE], 0, 2)]
    absolute = given.modal.force[Group.DISTANCE] == 0
    back = given.modal.force[Group.RETURN]
    plane, has_plane = given.lengths(key("R")), given.has(key("R"))
    height = np.stack([given.lengths(one) for one in AXES[:3]], axis=1)
    hows = np.stack([given.how(one) for one in AXES[:3]], axis=1)
    # Where the last coordinate of each axis is that a motion other than a cycle states.
    placed = (given.motion & ~given.machine & ~cycle & absolute)[:, None] & np.isin(
        hows, (How.NUMBER, How.INTEGER)
    )
    latest = np.maximum.accumulate(np.where(placed, np.arange(n)[:, None], -1), axis=0)
    frame = np.searchsorted(events, np.arange(n))
    at_r, before, last = np.nan, np.nan, -1
    for row in rows.tolist():
        if last < 0 or given.move[row - 1] != Move.CYCLE or axis[row] != axis[row - 1]:
            source = latest[row, axis[row]]
            same = source >= 0 and frame[source] == frame[row]
            at_r, before = np.nan, height[source, axis[row]] if same else np.nan
        elif frame[row] != frame[last]:
            at_r, before = np.nan, np.nan
        last = row
        if has_plane[row]:  # one that is computed is not known
            at_r = plane[row] if absolute[row] else np.nan
        elif not absolute[row]:
            at_r = np.nan
        if back[row] == 1:
            level[row] = at_r
        elif back[row] == 0 and before >= at_r:
            level[row] = before
    return level
