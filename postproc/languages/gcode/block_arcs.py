"""The arcs among the blocks of a program: from the words that state them to their geometry."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.units import MM
from postproc.languages.gcode.arcs import PLANES, ArcGeometry, ArcWords, arcs, through
from postproc.languages.gcode.blocks import THROUGH, BlockWords
from postproc.languages.gcode.control import Group, Move
from postproc.languages.gcode.positions import Positions
from postproc.languages.gcode.words import How, key


def given_by_point(block_words: BlockWords, rows: Ints) -> Bools:
    """(N,) arcs among the motions in the blocks ``rows`` (N,) that a point on their path gives, if they are some."""
    words = (
        block_words.has(*THROUGH)[rows]
        if THROUGH[0] in block_words.columns
        else np.zeros(len(rows), np.bool_)
    )
    return np.asarray(words | (block_words.move[rows] == Move.THROUGH))


def unevenly_scaled(block_words: BlockWords, rows: Ints, plane: Ints, where: Positions) -> Bools:
    """(N,) motions in the blocks ``rows`` (N,) whose circles in ``plane`` (N,) are none in the base."""
    factors = np.array([np.linalg.norm(frame.turn, axis=0) for frame in where.frames])[where.frame[rows]]
    within = np.where(given_by_point(block_words, rows), -1, plane)  # that of a point may be any
    first, third = PLANES[within, 0], np.where(within < 0, -1, PLANES[within, 2])
    apart = np.abs(factors - factors[np.arange(len(rows)), first, None]) > 1e-9
    return np.asarray((apart & (np.arange(3) != third[:, None])).any(axis=1))


def arcs_of_blocks(
    block_words: BlockWords, rows: Ints, start: Floats, end: Floats, plane: Ints, is_arc: Bools
) -> ArcGeometry:
    """The arcs among the motions in the blocks ``rows`` (N,), where ``is_arc`` (N,), from ``start`` to ``end`` (N, 6)
    [m, rad] in ``plane`` (N,); NaN for all others."""
    n = len(rows)
    result = ArcGeometry(
        np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan), np.zeros(n, np.int64)
    )
    between = given_by_point(block_words, rows)
    word, usual = block_words.control.turns
    turns = np.zeros(n)
    if word in block_words.columns:
        turns = np.nan_to_num(block_words.number(word)[rows] - usual)
        turns[turns % 1 != 0] = np.nan
    for some, keys in (
        (is_arc & ~between, tuple(key(letter) for letter in "IJK")),
        (is_arc & between, THROUGH),
    ):
        if not some.any():
            continue
        at = rows[some]
        hows = np.stack([block_words.how(one)[at] for one in keys], axis=1)
        values = np.stack([block_words.lengths(one)[at] for one in keys], axis=1)
        group = Group.DISTANCE if keys is THROUGH else Group.ARCS
        relative = block_words.modal.force[group][at] == 1
        absolute = np.where(hows == How.ABSOLUTE, True, (relative != (group == Group.DISTANCE))[:, None])
        absolute &= hows != How.INCREMENTAL
        if keys is THROUGH:
            via = np.where(absolute & (hows >= 0), values, start[some, :3] + np.where(hows >= 0, values, 0.0))
            found = through(start[some, :3], via, end[some, :3], turns[some])
        else:
            counter, radius = block_words.move[at] == Move.COUNTER, block_words.lengths(key("R"))[at]
            words = ArcWords(counter, values, absolute, radius, turns[some])
            gap = np.asarray(block_words.control.radius_gap)[(block_words.length[at] > MM).astype(int)]
            found = arcs(start[some, :3], end[some, :3], plane[some], words, gap)
        either = (block_words.modal.force[group][at] < 0) & np.isin(hows, (How.NUMBER, How.INTEGER)).any(
            axis=1
        )
        for array in (found.centre, found.normal, found.sweep):
            array[either] = np.nan
        for name in ("centre", "normal", "sweep", "wrong"):
            getattr(result, name)[some] = getattr(found, name)
    return result
