"""How the motions of a program follow each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Bools, Floats, frozen, shared
from postproc.toolpath.columns import MotionColumns, column, not_given


@dataclass(frozen=True)
class MotionSequence(MotionColumns):
    """How N motions follow each other.

    ``approximation`` (N,) [m]: the controller may depart from the path that far before the end point; 0 where it stops
    or passes exactly, NaN where the distance is not known.
    ``approximation_number`` (N,): what the text states in the place of a distance (the number of CNT; below zero the
    register that has it), NaN where it states none.
    ``stops`` (N,): the controller comes to rest at the end point: it is not approximated (``approximation`` is 0), and
    is no inner point of a spline block; without it wherever ``approximation`` is 0.
    ``continues`` (N,): in every execution the motion starts where the row before it ends, and no other motion starts
    there; the first one starts where the program does.  False where paths of the program meet or part, and for motions
    that never run: where such a motion starts is not known.
    ``predecessors``: row that does not continue the row before it -> the rows whose ends may be its start, -1 for the
    start of the program, -2 for what the program does not contain.
    ``drills`` (N,): the motion is a drill cycle, and its target the bottom of the hole: the tool comes down to it from
    above and goes back up.  Neither it nor the motion behind it ``continues``, although no other motion is between.
    ``waits`` (N,): after the motion the program waits, or may: for a time, an input, an operator, a tool.
    """

    approximation: Floats = field(default_factory=not_given, metadata=column(default=0.0))
    approximation_number: Floats = field(default_factory=not_given, metadata=column(default=np.nan))
    stops: Bools = field(default_factory=not_given)
    continues: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=True))
    predecessors: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    drills: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=False))
    waits: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=False))

    def _fill(self, count: int) -> None:
        super()._fill(count)
        stops = self.stops if len(self.stops) else self.approximation == 0.0
        object.__setattr__(self, "stops", shared(frozen(stops, (count,), np.bool_)))
