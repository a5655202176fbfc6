"""Where the motions of a program go."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from postproc.base.arrays import FewRows, Floats, Ints
from postproc.base.geometry import Poses
from postproc.toolpath.columns import MotionColumns, column, not_given

COMPUTED, LOST = np.inf, -np.inf
"""An external axis whose value is an expression that is not constant; one that something else may have moved."""


class Kind(IntEnum):
    """What a motion statement does.  Point-to-point motions (PTP, AXIS) are air moves whatever the force."""

    PTP = 0  # point to point, to a Cartesian target
    AXIS = 1  # point to point, to axis angles
    LIN = 2  # straight line
    CIRC = 3  # circular arc, or a helix
    OTHER = 4  # a motion that is none of these
    SPL = 5  # a point of a spline: the path between is the controller's


FrameComponents = tuple[float | None, float | None, float | None]


@dataclass(frozen=True)
class FrameRef:
    """A base or tool frame as the program names it.

    ``pose`` is the frame where the program itself states it (in the world for a base, on the flange for
    a tool); None where only the controller knows it, that is entry ``number`` of BASE_DATA / TOOL_DATA.
    ``line`` is where it was set, for messages.  ``declared``: what the controller's own file states of a frame whose
    ``pose`` the program does not state; the cell's base or tool of that number comes first.
    ``in_entry``: (number, pose) of a frame that the program states in such an entry (``BASE_DATA[2]:{X 10 ...}``):
    ``number`` and ``pose`` are None then, and ``declared`` is that of the entry; ``components``: X, Y, Z [m] that the
    program sets of such a frame afterwards (``$TOOL.Z=150``), None where it does not.  ``load``: mass [kg] of a tool
    and its centre [m] in flange axes where the program, or the controller's own file, states them.
    """

    number: int | None
    pose: Poses | None
    line: int = 0
    declared: Poses | None = None
    in_entry: tuple[int, Poses] | None = None
    components: FrameComponents = (None, None, None)
    load: tuple[float, float, float, float] | None = None

    @property
    def entry(self) -> int | None:
        """The number of the entry that it is, or in which it is stated; None without one."""
        return self.number if self.in_entry is None else self.in_entry[0]

    def placed_in(self, entry: Poses) -> Poses:
        """The frame where the controller's ``entry`` is this pose."""
        pose = entry if self.in_entry is None else entry @ self.in_entry[1]
        if self.components == (None, None, None):
            return pose
        changed = zip(self.components, pose.position, strict=True)
        return Poses(pose.rotation, np.array([old if new is None else new for new, old in changed]))


@dataclass(frozen=True)
class Targets(MotionColumns):
    """Where N motions go.

    ``kind`` (N,): Kind.
    ``position`` (N, 3) [m], ``rotation`` (N, 3, 3): target of the TCP in the programmed base, NaN where it is not
    known; the rotation is the one that the controller runs (see ``Toolpath.programmed_rotation``).
    ``axes`` (N, 6) [rad]: target of AXIS motions, NaN for others.
    ``base``, ``tool`` (N,): index into ``frames``, -1 where it is not known.
    ``external`` (N, 6) [mm or deg, as in the text]: external axes E1..E6 at the end of each motion; NaN where nothing
    has stated them yet, ``COMPUTED`` or ``LOST`` where they are not known.
    """

    kind: Ints = field(metadata=column(dtype=np.int8))
    position: Floats = field(metadata=column(3))
    rotation: Floats = field(metadata=column(3, 3))
    axes: FewRows | Floats
    base: Ints = field(metadata=column(dtype=np.int32))
    tool: Ints = field(metadata=column(dtype=np.int32))
    frames: tuple[FrameRef, ...]
    external: Floats = field(default_factory=not_given, metadata=column(6, default=np.nan))

    def __post_init__(self) -> None:
        n = len(self.kind)
        self._fill(n)
        object.__setattr__(self, "axes", FewRows.of(self.axes))
        if self.axes.shape != (n, 6):
            raise ValueError(f"axes have the shape {self.axes.shape} for {n} motions")
