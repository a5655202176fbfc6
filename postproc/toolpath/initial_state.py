"""What the controller knows before a program starts and the program does not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType

from postproc.base.dataclass import dataclass

Symbol = float | Mapping[str, float]
"""The value of a name that only the controller knows: a number, or an aggregate by its component (capitals)."""


@dataclass(frozen=True)
class InitialState:
    """The state at the first statement of a program; None and absent: not stated.

    tool, base: the numbers in force.  words: axis word (X, Y, Z, A, B, C, in capitals) -> value in the base in force,
    mm or deg.
    """

    tool: int | None = None
    base: int | None = None
    words: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


UNSTATED = InitialState()
"""Nothing is stated."""
