"""Errors of the tool that are known beside those of the model: what was learnt of one part at its place."""

from __future__ import annotations

from abc import ABC, abstractmethod

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses


class KnownError(ABC):
    """A displacement of the surface that the tool leaves; a correction moves the goal the other way."""

    @abstractmethod
    def at(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Floats:
        """(K, 3) [m] in the robot base, of motions ``rows`` (K,) at the wanted poses (K), which are at the shares (K,)
        of their paths, or at their ends."""
