"""Where a direction of the tool (A3= B3= C3=, angles, I J K of G43.5) leaves the rotary axes when its mode has ended.

They stay where it has put them: outside of the mode nothing is known of the tool, until words of the rotary axes or a
swivelled plane say where it is, or the direction was that of the axes at 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.blocks import BlockWords
from postproc.languages.gcode.control import Group, ToolAxis
from postproc.languages.gcode.positions import Trace
from postproc.languages.gcode.words import key

_CENTRES = tuple(key(letter) for letter in "IJK")


def directing(words: BlockWords) -> Bools:
    """(B,) blocks that state a direction of the tool."""
    force = words.modal.force
    unread = (force[Group.TCP] == 1) & (force[Group.FOREIGN] == 1) & words.control.iso
    stated = words.has(*words.control.vector, *words.control.euler)
    return np.asarray(stated | (unread & words.has(*_CENTRES)))


def tilting(words: BlockWords) -> Bools:
    """(B,) blocks that state a direction other than Z of their coordinates, or may do so."""
    stated = directing(words)
    if not stated.any():
        return stated
    upright = words.modal.flow.reason == 0
    for one in words.control.euler:
        column = words.words(one)
        upright[column.block[column.value != 0]] = False
    if words.control.vector:
        x, y, z = (words.words(one) for one in words.control.vector)
        for column in (x, y):
            upright[column.block[column.value != 0]] = False
        along = words.has(*words.control.euler)
        along[z.block[z.value > 0]] = True
        upright &= along
    else:
        upright &= words.has(*words.control.euler)
    return np.asarray(stated & ~upright)


@dataclass(frozen=True, eq=False)
class ToolTilts:
    """Of a whole program: at (B,) the block that states the last direction of the tool, -1 without; tilts (B,): it may
    be another one than Z; since (B,): the last block by which all rotary axes are stated again, -1 without."""

    at: Ints
    tilts: Bools
    since: Ints

    @staticmethod
    def of(words: BlockWords, used: Ints) -> ToolTilts:
        """``used`` (K,): keys of the words of rotary axes in the program."""
        numbers = np.arange(len(words))

        def latest(blocks: Bools) -> Ints:
            return np.asarray(np.maximum.accumulate(np.where(blocks, numbers, -1)))

        sure = words.modal.flow.reason == 0
        stated = [latest(words.has(one) & sure) for one in used.tolist()]
        since = np.min(stated, axis=0) if len(stated) > 1 else np.full(len(words), -1)
        return ToolTilts(latest(directing(words)), tilting(words), since)

    def left(self, trace: Trace, blocks: Ints) -> Bools:
        """(N,) whether at ``blocks`` (N,), outside of the mode, a direction from before may have left the tool."""
        at = self.at[blocks]
        turned = np.array([not np.array_equal(frame.turn, np.eye(3)) for frame in trace.frames])
        tilted = (at >= 0) & (self.tilts[at] | turned[trace.frame_of(np.maximum(at, 0))])
        frames = np.array(
            [frame.rotary is not None or frame.tool == ToolAxis.NORMAL for frame in trace.frames]
        )
        back = np.flatnonzero(frames)
        started = np.append(trace.started(back), np.iinfo(np.int64).max)
        last = np.searchsorted(started, blocks, side="right") - 1
        brought_back = (last >= 0) & (started[np.maximum(last, 0)] > at)
        return np.asarray(tilted & ~brought_back & (self.since[blocks] <= at))
