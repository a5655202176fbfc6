"""Words of macro calls (G65, G66, G66.1) are values for variables, and not what their letters are elsewhere.

Of a Fanuc all letters but G, L, N, O and P are arguments (operator's manual, custom macro, "argument specification").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.execution_flow import EACH, MODAL, MODAL_EACH, macro_modes
from postproc.languages.gcode.modal import decode_g_codes
from postproc.languages.gcode.source import MACRO, Source, WordColumn
from postproc.languages.gcode.words import How, key

_NO_ARGUMENTS = tuple(key(letter) for letter in "GLNOP")
_COORDINATES = tuple(key(letter) for letter in "XYZIJKR")
"""In a block with G65 these move nothing, and what they mean without a decimal point is reported."""
_HELD = tuple(key(letter) for letter in "FST")


def without_modal_arguments(source: Source, control: Control) -> Source:
    """A program without the arguments of G66 and G66.1, and of the blocks under the latter: these keep coordinates,
    which say that such a block does something."""
    codes, modal = source.column(key("G")), np.zeros(len(source.blocks), np.bool_)
    modal[codes.block[np.isin(codes.value, (MODAL, MODAL_EACH))]] = True
    if not control.iso or not modal.any():
        return source
    each = macro_modes(source) == EACH
    return _without(source, {one: modal | (each & (one not in _COORDINATES)) for one in source.columns})


def without_arguments(source: Source, control: Control) -> Source:
    """A run without the arguments of G65, but for coordinates; in blocks with a code that is not known, of which a
    macro may be called, F, S and T are not read."""
    if not control.iso:
        return source
    codes = source.column(key("G"))
    single, unknown = np.zeros(len(source.blocks), np.bool_), np.zeros(len(source.blocks), np.bool_)
    single[codes.block[codes.value == MACRO]] = True
    unknown[codes.block[decode_g_codes(codes.value, control)[2] < 0]] = True
    if single.any():
        source = _without(source, {one: single for one in source.columns if one not in _COORDINATES})
    if not unknown.any():
        return source
    columns = dict(source.columns)
    for one in _HELD:
        column = source.column(one)
        unread = unknown[column.block]
        if unread.any():
            how = np.where(unread, np.int8(How.UNREAD), column.how)
            columns[one] = WordColumn(column.block, np.where(unread, np.nan, column.value), how)
    return replace(source, columns=columns)


def _without(source: Source, of_calls: Mapping[int, Bools]) -> Source:
    """Without the words in blocks ``of_calls`` (B,) of their key, but for those that say what is called."""
    columns = dict(source.columns)
    for one, column in source.columns.items():
        if one in of_calls and one not in _NO_ARGUMENTS:
            columns[one] = column.where(~of_calls[one][column.block])
    return replace(source, columns=columns)
