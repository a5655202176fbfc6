"""Motions whose coordinates the program mirrors: what that does to the side on which the tool cuts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.toolpath.columns import MotionColumns, column, not_given

_ACROSS = 0.9
"""Cosine between a tool and its image above which the image lies along the tool, so that its sides are known."""


@dataclass(frozen=True)
class Reflections(MotionColumns):
    """How the coordinates of N motions are mirrored, while their tool and its spindle are not.

    ``which`` (N,): index into ``matrices``, each (3, 3): the reflection in the axes of the base, the first one of
    motions that are not mirrored.
    """

    which: Ints = field(default_factory=not_given, metadata=column(dtype=np.int16, default=0))
    matrices: tuple[Floats, ...] = (np.eye(3),)

    @staticmethod
    def of_frames(reflections: Floats, frame: Ints) -> Reflections:
        """Of motions (N) in the frames ``frame`` (N,), which mirror by ``reflections`` (F, 3, 3)."""
        plain = np.eye(3)
        mirrors = (reflections != plain).any(axis=(1, 2))
        if not mirrors[frame].any():
            return Reflections()
        different, which = np.unique(reflections[mirrors], axis=0, return_inverse=True)
        index = np.zeros(len(reflections), np.int16)
        index[mirrors] = 1 + which.reshape(-1)
        return Reflections(index[frame], (plain, *different))

    def sides(self, rotation: Floats, spindle: Floats) -> Ints:
        """(N,) 1 where what is programmed to lie left of the feed does so, seen along the spindle, -1 where it lies to
        the right of it, 0 where that is not known: the tool is oblique to its image.

        rotation (N, 3, 3): tool in the base; spindle (N, 3): unit vectors in tool axes.  With the reflection H and the
        spindle b the area across b, and with it left and right, has the sign det(H) (b . H b).
        """
        sides = np.ones(len(self.which), np.int8)
        rows = np.flatnonzero(self.which)
        if not len(rows):
            return sides
        axis = np.einsum("nij,nj->ni", rotation[rows], spindle[rows])
        matrices = np.array(self.matrices)
        image = np.einsum("nij,nj->ni", matrices[self.which[rows]], axis)
        along = np.einsum("ni,ni->n", axis, image)
        hand = np.sign(np.linalg.det(matrices))[self.which[rows]] * np.sign(along)
        sides[rows] = np.where(np.abs(along) > _ACROSS, hand, 0)  # False for NaN
        return sides
