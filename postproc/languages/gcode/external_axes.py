"""Axes beside X, Y, Z and the rotary ones: E1..E6, whose kinematics a cell can state, and all others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Floats, Ints, is_shared
from postproc.base.units import MM
from postproc.languages.gcode.blocks import SECOND, BlockWords
from postproc.languages.gcode.control import Group
from postproc.languages.gcode.words import How, key
from postproc.toolpath import COMPUTED, LOST

EXTERNAL = tuple(key("E", number) for number in range(1, 7))

_LETTERS = frozenset(key(one) for one in "XYZABCUVWEQ")


def addresses(words: Mapping[str, int]) -> tuple[int, ...]:
    """(6,) the keys of E1..E6, in place of which the cell may state other addresses: ``words``, address -> column."""
    found = list(EXTERNAL)
    for word, column in words.items():
        found[column] = key(word[0], int(word[1:]) if word[1:] else None)
    return tuple(found)


def external_axes(block_words: BlockWords, rows: Ints, axes: tuple[int, ...]) -> Floats:
    """(N, 6) [mm or deg] where the external axes are after the blocks ``rows`` (N,) of the motions, see ``Toolpath``;
    axes (6,): their keys.

    COMPUTED where a word is no number, is a step, or is in inches (whether the axis is linear is not said).
    """
    if not any(one in block_words.source.columns for one in axes):
        return np.broadcast_to(np.nan, (len(rows), 6))
    steps, metric = block_words.modal.force[Group.DISTANCE] != 0, block_words.length == MM
    found = np.full((len(rows), 6), np.nan)
    for axis, one in enumerate(axes):
        said = np.full(len(block_words), np.nan)
        said[block_words.modal.flow.forget] = LOST  # what was called may have moved it
        if one in block_words.source.columns:
            words = block_words.words(one)
            read = metric[words.block] & np.isin(words.how, (How.NUMBER, How.INTEGER, How.ABSOLUTE))
            read &= (words.how == How.ABSOLUTE) | ~steps[words.block]
            said[words.block] = np.where(read & np.isfinite(words.value), words.value, COMPUTED)
        last = np.maximum.accumulate(np.where(np.isnan(said), -1, np.arange(len(said))))[rows]
        found[:, axis] = np.where(last >= 0, said[last], np.nan)
    return found


def moves_external(external: Floats) -> dict[int, str]:
    """Motions in whose block an axis of ``external`` (N, 6) moves: nothing is inserted before them, for lack of words
    for it."""
    if is_shared(external) or not len(external):
        return {}
    before = np.concatenate([external[:1], external[:-1]])
    moves = ((external != before) & ~np.isnan(external) & (external != LOST)).any(axis=1)
    return dict.fromkeys(np.flatnonzero(moves).tolist(), "an external axis moves in its block")


def others_move(words: BlockWords, axes: tuple[int, ...]) -> dict[str, int]:
    """Address -> the first block that brings an axis beside those that are read, and the external ones ``axes`` (6,),
    to another place than zero."""
    moving: dict[str, int] = {}
    for one, column in words.source.columns.items():
        named = one % 256 in _LETTERS and 256 <= one < 1 << 14 and one not in words.columns
        if (named or one in SECOND) and one not in axes:
            away = column.block[column.value != 0.0]
            if len(away):
                moving[chr(one % 256) + (str(one // 256 - 1) if one >= 256 else "")] = int(away[0])
    return moving
