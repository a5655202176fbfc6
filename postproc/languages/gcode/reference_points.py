"""Where rotary axes are at a reference point, as the cell states it: ``symbols: {G28: {B: 0, C: 0}}``."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import DEG
from postproc.languages.gcode.blocks import AXES, BlockWords
from postproc.languages.gcode.control import Once
from postproc.languages.gcode.modal_fill import everywhere
from postproc.languages.gcode.words import key
from postproc.toolpath.initial_state import Symbol

_CODES = (28.0, 30.0)


def reference_angles(words: BlockWords, symbols: Mapping[str, Symbol]) -> Floats:
    """(B, 6) [rad] of a whole program: the words that the rotary axes have after a block that leads them to a
    reference point; NaN for other axes and blocks, where the cell does not state them, where the program itself stores
    a reference point, and where it shifts the origin of a rotary axis."""
    stated = {code: _angles(symbols.get(f"G{code:.0f}")) for code in _CODES}
    nothing = everywhere(np.full(6, np.nan), len(words))
    if not words.control.iso or all(np.isnan(angles).all() for angles in stated.values()):
        return nothing
    modal = words.modal
    shifting = modal.has(Once.SHIFT, Once.LOCAL, Once.RESTORE) & words.has(*AXES[3:])
    if shifting.any() or modal.has(Once.STORE).any():
        return nothing
    result = np.array(nothing)
    codes = words.words(key("G"))
    named = words.present
    led = named | ~np.any(named, axis=1)[:, None]
    others = np.zeros(
        len(words), np.bool_
    )  # G30 P3 leads to a further one, and so may what is not exactly G28
    others[codes.block[np.isin(np.floor(codes.value), (*_CODES, 29.0)) & ~np.isin(codes.value, _CODES)]] = (
        True
    )
    others |= words.has(key("P"))
    for code, angles in stated.items():
        rows = codes.block[codes.value == code]
        others[rows[1:][rows[1:] == rows[:-1]]] = True
        rows = rows[~others[rows] & np.isnan(result[rows]).all(axis=1)]
        result[rows] = np.where(led[rows], angles, np.nan)
    return result


def _angles(symbol: Symbol | None) -> Floats:
    """(6,) [rad] what a symbol states of A, B, C; NaN for what it does not."""
    parts = symbol if isinstance(symbol, Mapping) else {}
    return np.array([np.nan] * 3 + [parts.get(axis, np.nan) * DEG for axis in "ABC"])
