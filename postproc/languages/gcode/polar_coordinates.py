"""Polar coordinates of a Fanuc (G16, until G15): in the plane the word of the first axis is a radius about the origin
of the coordinates, that of the second an angle from the first axis; operator's manuals, "polar coordinate command".

Both hold until they are stated again.  Under G91 the radius is measured from where the tool is: that is not read.
"""

from __future__ import annotations

import numpy as np

from postproc.languages.gcode.blocks import AXES, CHANGES, BlockWords
from postproc.languages.gcode.control import Group
from postproc.languages.gcode.execution_flow import FlowReason
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.positions import PolarTargets
from postproc.languages.gcode.words import How, key

_IN_PLANE = np.array([[0, 1], [2, 0], [1, 2]])
"""The axes of G17, G18, G19 in their order."""
_ALONE = (Group.TURNED, Group.SCALED, Group.MIRRORED, Group.PLACED)


def polar_targets(words: BlockWords) -> PolarTargets:
    """Of a whole program."""
    n, force = len(words), words.modal.force
    mode, codes = force[Group.POLAR], words.words(key("G"))
    starting = codes.block[codes.value == 16]
    of_offsets = words.has(key("H"))[starting].any()  # an Okuma, of which G16 H is another work offset
    if not mode.any() or not words.control.increments or of_offsets:
        return PolarTargets(everywhere([False] * 3, n), everywhere([np.nan] * 3, n), everywhere(False, n))
    before = np.append(words.modal.ahead[Group.POLAR], mode[:-1])
    result = PolarTargets(np.zeros((n, 3), np.bool_), np.full((n, 3), np.nan), (mode >= 0) & (before >= 0))
    plane, rows = force[Group.PLANE], np.arange(n)
    first, second = _IN_PLANE[np.clip(plane, 0, 2)].T
    lengths = np.stack([words.lengths(axis) for axis in AXES[:3]], axis=1)
    angles = np.stack([words.angles(axis) for axis in AXES[:3]], axis=1)
    hows = np.stack([words.how(axis) for axis in AXES[:3]], axis=1)
    known = (words.modal.flow.reason == FlowReason.NONE) & (force[Group.DISTANCE] == 0) & (plane >= 0)
    known &= ~(words.ambiguous | words.twice | words.modal.unknown | words.modal.unused)
    for group in _ALONE:
        known &= force[group] == 0
    # where another origin, plane or offset holds, or G16 is stated again, both are to be stated again
    starts = words.modal.has(*CHANGES) | (np.diff(plane, prepend=plane[:1]) != 0) | (mode != 1)
    starts |= words.modal.switched(Group.OFFSET) | words.modal.switched(Group.UNITS)
    starts[starting] = True
    section = np.maximum.accumulate(np.where(starts, rows, -1))
    moving = words.motion & ~words.machine & (mode == 1)
    held = []
    for axis, values in ((first, lengths), (second, angles)):
        how = hows[rows, axis]
        stated = moving & (how >= 0)
        sure = stated & known & np.isin(how, (How.NUMBER, How.INTEGER))
        at = np.maximum.accumulate(np.where(stated, rows, -1))
        fine = (at >= section) & (at >= 0) & sure[at]
        held.append(np.where(fine, values[at, axis[at]], np.nan))
        result.target[rows[stated], axis[stated]] = True
    any_axis = result.target.any(axis=1)
    radius = np.where(held[0] >= 0, held[0], np.nan)
    for axis, along in ((first, np.cos(held[1])), (second, np.sin(held[1]))):
        result.target[rows[any_axis], axis[any_axis]] = True
        result.place[rows, axis] = np.where(known, radius * along, np.nan)
    result.target[any_axis & (plane < 0)] = True
    return result
