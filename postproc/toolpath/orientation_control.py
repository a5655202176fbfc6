"""How the orientation of the tool runs along a motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.toolpath.columns import MotionColumns, column, not_given


class OrientationPath(IntEnum):
    """How the orientation runs from the start of a motion to its end."""

    SINGLE_AXIS = 0  # evenly about the one axis that leads there
    ROTARY_AXES = 1  # the words of rotary axes run linearly
    GREAT_CIRCLE = 2  # the tool's direction runs on a great circle, the turn about it evenly


class OrientationMode(IntEnum):
    """How the tool turns on a path motion."""

    VAR = 0  # evenly from its orientation at the start to that of the target
    CONSTANT = 1  # not at all: what the target states of it has no effect
    JOINT = (
        2  # as the wrist axes, each of which turns evenly from its angle at the start to that at the target
    )
    UNKNOWN = 3


@dataclass(frozen=True)
class OrientationControl(MotionColumns):
    """The orientation of N motions between their targets, and what the text does not determine of it.

    ``mode`` (N,): OrientationMode of path motions.
    ``path`` (N,): OrientationPath.
    ``rotary_from``, ``rotary_to`` (N, 3) [rad]: of ROTARY_AXES, A, B, C at the start and at the end of the motion, NaN
    where a word is not used or not known.  At the share t the orientation is

        R(t) = Rz(C(t)) Ry(B(t)) Rx(A(t)),  A(t) = A_from + t (A_to - A_from), likewise B and C.

    ``redundant_axis`` (N, 3): unit vector in tool axes about which the text does not state how the tool is turned (tool
    vectors, two rotary axes); NaN where it gives the whole orientation.
    ``part_turn`` (N, 3) [rad]: A, B, C by which the part is turned under the tool at the end of the motion, about axes
    that nothing states; NaN where they do not turn it, or are not known.
    ``in_machine`` (N,): the text states the orientation in the axes of the machine, which are taken for those of the
    base.
    ``programmed`` (N, 3, 3): the rotations of the text, where those of the toolpath are what the controller runs
    instead; None where they are the same.
    """

    mode: Ints = field(default_factory=not_given, metadata=column(dtype=np.int8, default=OrientationMode.VAR))
    path: Ints = field(
        default_factory=not_given, metadata=column(dtype=np.int8, default=OrientationPath.SINGLE_AXIS)
    )
    rotary_from: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    rotary_to: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    redundant_axis: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    part_turn: Floats = field(default_factory=not_given, metadata=column(3, default=np.nan))
    in_machine: Bools = field(default_factory=not_given, metadata=column(dtype=np.bool_, default=False))
    programmed: Floats | None = None

    @cached_property
    def any_by_words(self) -> bool:
        """Whether any motion's orientation runs otherwise than about a single axis."""
        return bool(self.path.any())

    def rotary_at(self, rows: Ints, share: Floats) -> Floats:
        """A, B, C (K, 3) [rad] at the shares (K,) of motions ``rows`` (K,) of ROTARY_AXES; at their end where their
        start is not known."""
        end = self.rotary_to[rows]
        start = self.rotary_from[rows]
        known = np.isfinite(start)
        return np.where(known, end + (1.0 - share)[:, None] * (np.where(known, start, end) - end), end)
