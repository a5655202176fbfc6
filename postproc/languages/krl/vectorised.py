"""Runs of lines in the form that nearly all lines of a generated program have, read together."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats
from postproc.base.dataclass import dataclass
from postproc.languages.krl.lexing import Statement


@dataclass(frozen=True, eq=False)
class VectorisedLines:
    """Lines ``LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}`` that follow one another, K of them.

    line: number of the first; is_line (K,): LIN, else PTP; values (K, 6) [mm, deg]; start, stop (K, 6): byte ranges of
    the literals; motion (K, 4): offsets of word, operand, after the operand, after the code; status, turn (K,): S and
    T, -1 without; approximation (K,): 0 without an approximation, 1 with C_DIS, 2 with another one; external (K, 6):
    E1..E6, NaN where a line does not state one; None where none states any.
    """

    line: int
    is_line: Bools
    values: Floats
    start: NDArray[Any]
    stop: NDArray[Any]
    motion: NDArray[Any]
    status: NDArray[np.int32]
    turn: NDArray[np.int32]
    approximation: NDArray[np.int8]
    external: Floats | None = None

    def __len__(self) -> int:
        return len(self.is_line)


Item = Statement | VectorisedLines
"""What a program consists of: statements, and runs of common lines."""
