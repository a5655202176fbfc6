"""Where the numbers of the motions are in the text: from the reader to the writer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Ints
from postproc.base.document import Offsets, Span


class PointVariable(NamedTuple):
    """A target that the motion line does not write as a plain aggregate: a variable, or an expression of points.

    name: the variable as the line names it (``P1``, ``P[2]``, ``S.P``), b"" for an expression.
    type: type for a new point (E6POS, FRAME ...), as far as it is known, else that which the value needs.
    declared: the line (without its ending) of the declaration in a document of the program, after which another
    declaration can stand; None where there is none (undeclared, declared in a file that is never written).
    words: what the value holds besides X .. C, to be carried over: ``S 2,T 35,E1 0.0``, b"" for nothing.
    """

    name: bytes
    type: bytes
    declared: Span | None
    words: bytes


class Auxiliary(NamedTuple):
    """The auxiliary point of an arc (X, Y, Z count), and its angle CA.

    start, stop, file: as in ``Places``, three components; insert, home: as there; operand: its text in document 0.
    variable: None for an aggregate in the line.  text: number of its text, among those of ``Places.text``.
    locked: why its literals must stay as they are, "" where they need not.
    angle: what is after CA, None without CA or where its value is not known; has_angle: the line has a CA.
    """

    start: tuple[int, int, int]
    stop: tuple[int, int, int]
    file: tuple[int, int, int]
    insert: int
    home: int
    operand: Span
    variable: PointVariable | None
    text: int
    locked: str
    angle: Span | None
    has_angle: bool


@dataclass(frozen=True, slots=True)
class Relative:
    """A motion whose text states its target relative to the end of the row before (X..C of the toolpath are absolute).

    word: LIN_REL ...; reference: ``#BASE`` / ``#TOOL`` after the aggregate, None where it is left out (#BASE).
    in_tool: the translation is in the axes of the end orientation of the row before, else in those of the base.
    Only translations are understood; the literals in ``Places`` are those of the differences.
    """

    word: Span
    reference: Span | None
    in_tool: bool


@dataclass(frozen=True, eq=False)
class KrlSourceMap:
    """Per row, N motions as in the toolpath; the motion lines themselves are in document 0.

    start, stop (N, 6): byte range of the literals of X, Y, Z, A, B, C; -1 where no literal gives the component.
    file (N, 6): document of each literal, -1 where there is none.
    inherits (N,): bit i is set where component i is left out and so is that of the end point of the row before
    (start is -1).  Where start is -1 and the bit is not set, the component is computed (an expression, or set by one).
    insert (N,): offset at which missing components of the target's aggregate are written (", Z 5" after its last
    component; before its first one if it has no X .. C); home (N,): document of that aggregate, -1: there is none.
    motion (N, 4): offsets in document 0: of the motion's word, of the operand (of an arc: its end point), after the
    operand, after the code of the line (blanks and comment not included).
    text (N,): rows with the same number take at least one literal from the same place of the text.

    Rows with the same ``toolpath.line`` are one statement that runs several times: an aggregate there serves all.

    variables: rows whose operand is no plain aggregate in the line.
    locked: row -> why the literals in place must not be edited (other code reads them, another program may): such a
    motion can only move with a point of its own.
    arcs: auxiliary points.  relative: rows with relative text.
    """

    start: Offsets
    stop: Offsets
    file: NDArray[np.int8]
    inherits: NDArray[np.uint8]
    insert: Offsets
    home: NDArray[np.int8]
    motion: Offsets
    text: Ints
    variables: Mapping[int, PointVariable] = field(default_factory=dict)
    locked: Mapping[int, str] = field(default_factory=dict)
    arcs: Mapping[int, Auxiliary] = field(default_factory=dict)
    relative: Mapping[int, Relative] = field(default_factory=dict)
