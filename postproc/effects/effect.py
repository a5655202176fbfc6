"""What an effect is: a named piece of physics with parameters, added to one chain.

An effect acts on the generalized coordinates of the chain (motor angle q plus displacement) in one of the ways
below; the solver in ``model`` only sums.  Arrays are component first, (n, N): n coordinates, N states.
A parameter at its null value is the same as no effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

from postproc.arrays import Floats
from postproc.yamlfile import Section

Values = Mapping[str, float]


@dataclass(frozen=True)
class Parameter:
    """Name, SI unit, null value (effect absent), bounds, and where its definition comes from."""

    name: str
    unit: str
    null: float
    lower: float = -math.inf
    upper: float = math.inf
    source: str = ""


class Effect:
    """Base of all effects.  ``family``: ``elastic``, ``geometric`` or ``weight`` (what a controller may correct)."""

    name: ClassVar[str]
    family: ClassVar[str]
    parameters: tuple[Parameter, ...]

    @classmethod
    def from_options(cls, options: Section, joint_names: tuple[str, ...]) -> Self:
        """The effect as the ``options:`` of a robot file describe it.  Raises Refusal with the line."""
        raise NotImplementedError

    def described(self) -> dict[str, object]:
        """The options, for reports."""
        return {}


class ComplianceLaw(Effect):
    """Displacement of the coordinates as a function of the generalized force on them."""

    def displacement(self, values: Values, force: Floats) -> tuple[Floats, Floats]:
        """Displacement (n, N) [rad] under ``force`` (n, N) [N m], and its derivative, coordinate by coordinate."""
        raise NotImplementedError


class Load(Effect):
    """A generalized force on the coordinates, from an energy."""

    def force(self, values: Values, coordinates: Floats, motors: Floats) -> tuple[Floats, Floats]:
        """Force (n, N) [N m] at displaced ``coordinates`` (n, N) of a robot whose ``motors`` stand at (n, N) [rad].

        The second result is its derivative with respect to the coordinates, coordinate by coordinate.
        """
        raise NotImplementedError
