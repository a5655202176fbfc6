"""The surface that a longer or thicker tool leaves: displaced along the spindle, and towards the wall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses, turned
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.known_error import KnownError
from postproc.process.operation_names import OperationNames

_STEEP = 0.1
"""Sine of the angle between spindle and feed below which no side of the feed is known."""


@dataclass(frozen=True, eq=False)
class ToolDisplacement(KnownError):
    """dl a + s dr (a x t) / |a x t|: a: spindle, tip-ward; t: feed; s: the wall lies right (1) or left (-1) of the
    feed, seen along the spindle, or nobody knows (0).

    spindle (N, 3): unit vectors in tool axes; tool (N,): its number; length: number of a tool -> dl [m]; radius: of a
    tool -> dr [m]; side: tool and operation -> s.
    """

    path: DesiredPath
    spindle: Floats
    tool: Ints
    operations: OperationNames
    length: Mapping[int, float] = field(default_factory=dict)
    radius: Mapping[int, float] = field(default_factory=dict)
    side: Mapping[tuple[int, str], int] = field(default_factory=dict)

    def at(self, rows: Ints, wanted: Poses, share: Floats | None = None) -> Floats:
        """(K, 3) [m] of motions ``rows`` (K,) at ``wanted`` (K) poses, at ``share`` (K,) of their paths."""
        along = np.ones(len(rows)) if share is None else share
        axis = turned(wanted.rotation, self.spindle[rows])
        tool = self.tool[rows]
        moved = np.zeros((len(rows), 3))
        for number, size in self.length.items():
            moved += np.where(tool == number, size, 0.0)[:, None] * axis
        towards = self._towards_wall(rows, tool)
        if towards.any():
            across = np.cross(axis, self.path.tangent(rows, along))
            long = np.linalg.norm(across, axis=1, keepdims=True)
            moved += towards[:, None] * np.where(long > _STEEP, across / np.maximum(long, _STEEP), 0.0)
        return np.nan_to_num(moved)

    def _towards_wall(self, rows: Ints, tool: Ints) -> Floats:
        """(K,) [m] s dr."""
        size = np.zeros(len(rows))
        for number, radius in self.radius.items():
            sides = np.array([self.side.get((number, name), 0) for name in self.operations.names])
            size += np.where(tool == number, radius * sides[self.operations.which[rows]], 0.0)
        return size
