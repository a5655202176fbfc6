"""The configuration of the robot as a program states it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from postproc.base.arrays import Bools, Ints, frozen, shared
from postproc.base.dataclass import dataclass


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

    @cached_property
    def stated(self) -> Bools:
        """(N,) any number is stated."""
        none = np.zeros(self.count, np.bool_)
        return np.asarray(np.any([none, *(one >= 0 for one in self.numbers.values())], axis=0))
