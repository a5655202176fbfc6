"""Zeros of many functions at once, each between a place where it is below zero and one where it is above."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints

NEAREST = 1e-12
"""Values that differ by less do not: the one place is taken."""


class Brackets:
    """T functions between the places ``low`` and ``high`` (T,), where they are ``below`` (T,), not above zero, and
    ``above`` (T,)."""

    def __init__(self, low: Floats, high: Floats, below: Floats, above: Floats) -> None:
        self._ends = low.copy(), high.copy()
        self._values = below.copy(), above.copy()
        self._side = np.zeros(len(low), np.int64)

    def secants(self, numbers: Ints) -> Floats:
        """(K,) where the lines through both ends of ``numbers`` (K,) are zero."""
        (low, high), (below, above) = ([v[numbers] for v in pair] for pair in (self._ends, self._values))
        at = low - below * (high - low) / np.maximum(above - below, NEAREST)
        return np.clip(at, low, high)

    def narrow(self, numbers: Ints, at: Floats, value: Floats) -> None:
        """The functions ``numbers`` (K,) have the values (K,) at the places ``at`` (K,).  The value of an end that
        stays again is halved (Illinois): else the lines come near a bend from one side, ever slower."""
        for side, here in ((-1, value < 0), (1, value >= 0)):
            one, stays = (0, 1) if side < 0 else (1, 0)
            some = numbers[here]
            self._ends[one][some], self._values[one][some] = at[here], value[here]
            again = some[self._side[some] == side]
            self._values[stays][again] *= 0.5
            self._side[some] = side
