"""The configuration of the robot as a program states it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Ints, frozen, shared

QUADRANTS = 50
"""Quarters of a turn that are stated are at least -50 and below 50."""


def pack_quadrants(quadrants: Sequence[float]) -> int:
    """Three quarters of a turn (cf1, cf4, cf6 of ABB) as one number, the same for the same three; -1 where one is no
    whole number or too large."""
    packed = 0
    for number in quadrants:
        if number != int(number) or not -QUADRANTS <= number < QUADRANTS:
            return -1
        packed = packed * 2 * QUADRANTS + int(number) + QUADRANTS
    return packed


def unpack_quadrants(packed: Ints) -> Ints:
    """(N, 3) the quarters of ``packed`` (N,)."""
    parts = packed[:, None] // (2 * QUADRANTS) ** np.arange(2, -1, -1)
    return np.asarray(parts % (2 * QUADRANTS) - QUADRANTS)


@dataclass(frozen=True)
class Configuration:
    """In which of the configurations that reach a target the robot is to be, as stated with each of N motions.

    ``numbers``: name -> (N,), -1 where it is not stated.  Names and meaning are those of one family of robots, such as
    status and turn of KUKA: only its languages and its robots know them.
    """

    numbers: Mapping[str, Ints] = field(default_factory=dict)
    count: int = 0

    def for_motions(self, count: int) -> Configuration:
        """Itself, of ``count`` motions.

        Raises ValueError when the numbers are those of another count: a defect of the program.
        """
        numbers = {name: shared(frozen(one, (count,), np.int32)) for name, one in self.numbers.items()}
        return replace(self, numbers=numbers, count=count)

    def __getitem__(self, name: str) -> Ints:
        """(N,) the number of this name, -1 where it is not stated."""
        column = self.numbers.get(name)
        return np.broadcast_to(np.int32(-1), self.count) if column is None else column

    def of(self, rows: Ints) -> Configuration:
        """That of the motions ``rows`` (K,)."""
        return Configuration({name: one[rows] for name, one in self.numbers.items()}, len(rows))

    @cached_property
    def stated(self) -> Bools:
        """(N,) any number is stated."""
        none = np.zeros(self.count, np.bool_)
        return np.asarray(np.any([none, *(one >= 0 for one in self.numbers.values())], axis=0))
