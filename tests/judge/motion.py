"""What a program says of one motion, whatever its language; SI and radians."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

MM, DEG = 1e-3, np.pi / 180

CONTINUOUS = -1.0
"""Approximation of a motion that flows into the next one within a distance that is not stated."""


@dataclass
class Motion:
    """One motion and what is modal at it.

    kind: PTP (air; target in the base), AXIS (air; target in joints), LIN, CIRC, SPL.  position (3,) [m] and rotation
    (3, 3): target in the base.  axes (6,) [rad]: of AXIS.  via (3,) [m]: of a CIRC through three points; centre (3,)
    [m], normal (3,) and turns (whole extra turns): of an arc about a stated centre, positive about the normal; angle
    [rad]: CA of a CIRC.  base, tool: (rotation, position).  spindle (3,): in tool axes, tip-ward.  feed [m/s].
    approximation [m]: 0 an exact stop, CONTINUOUS no stop and no stated distance.  external: E1 .. E6 [mm or deg].
    force: six numbers and their frame, None or zeros in air.  status, turn: of a PTP.  orientation_type, circle_type:
    #VAR, #CONSTANT, #JOINT; #BASE, #PATH.  block: number of the spline block.  words (3,)
    [rad]: rotary A, B, C that turn the tool; they run evenly.  turns: the turns that another target can state, "any",
    those of the tool's "axis", or "none"."""

    kind: str
    line: int
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    axes: np.ndarray | None = None
    via: np.ndarray | None = None
    centre: np.ndarray | None = None
    normal: np.ndarray | None = None
    angle: float | None = None
    base: tuple[np.ndarray, np.ndarray] = (np.eye(3), np.zeros(3))
    tool: tuple[np.ndarray, np.ndarray] = (np.eye(3), np.zeros(3))
    spindle: np.ndarray = field(default_factory=lambda: np.array([0.0, 0, 1]))
    feed: float = 0.0
    approximation: float = 0.0
    external: dict[str, float] = field(default_factory=dict)
    force: tuple[np.ndarray, str] | None = None
    status: int | None = None
    turn: int | None = None
    orientation_type: str = "#VAR"
    circle_type: str = "#BASE"
    block: int = 0
    words: np.ndarray | None = None
    turns: str = "any"

    @property
    def air(self) -> bool:
        return self.force is None or not self.force[0].any() or self.kind in ("PTP", "AXIS")


def about(axis: int, angle: float) -> np.ndarray:
    """(3, 3) rotation by ``angle`` [rad] about x, y or z."""
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def from_abc(a: float, b: float, c: float) -> np.ndarray:
    """(3, 3) KUKA's Rz(A) Ry(B) Rx(C), angles in deg."""
    return about(2, a * DEG) @ about(1, b * DEG) @ about(0, c * DEG)
