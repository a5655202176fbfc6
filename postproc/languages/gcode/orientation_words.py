"""What the orientation words of a block mean: a direction of the tool, or angles about axes that turn it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.geometry import rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG

UP = np.array([0.0, 0.0, 1.0])

STEEP = 0.05
"""An axis that turns more than 1 / STEEP times as far as the tool tilts is at its pole."""

_ROUNDS = 30
_STEP = 0.5  # rad, of one round
_SOLVED = 1e-9  # rad


class OrientationWords(Protocol):
    """One meaning of three orientation words; values are the numbers as written (deg, or components of a vector).

    words: their keys, -1 for one that is not used.  joint: the words are one whole: a block that writes one of them
    states all (those it leaves out are zero).  angles: the numbers are degrees, 360 of which are a turn.
    redundant_axis (3,): unit vector in tool axes about which the words do not state the turn; NaN where they state all.
    """

    @property
    def words(self) -> tuple[int, int, int]: ...
    @property
    def joint(self) -> bool: ...
    @property
    def angles(self) -> bool: ...
    @property
    def redundant_axis(self) -> Floats: ...

    def rotation(self, values: Floats) -> Floats:
        """(n, 3, 3) orientation of the tool in the base, of values (n, 3); NaN where it is not known."""

    def values(self, rotation: Floats, near: Floats) -> Floats:
        """(n, 3) numbers of orientations (n, 3, 3), those nearest to ``near`` (n, 3); NaN where there are none."""

    def writable(self, values: Floats) -> Bools:
        """(n,) at ``values`` (n, 3) small changes of the orientation are small changes of the numbers there."""


def swing(direction: Floats) -> Floats:
    """The shortest rotations (n, 3, 3) that bring the z axis to unit vectors (n, 3); about x where that is -z."""
    d = np.asarray(direction, dtype=float)
    sine = np.hypot(d[:, 0], d[:, 1])
    angle = np.arctan2(sine, d[:, 2])
    with np.errstate(invalid="ignore", divide="ignore"):
        axis = np.stack([-d[:, 1] / sine, d[:, 0] / sine, np.zeros(len(d))], axis=-1)
    axis[sine < 1e-12] = [1.0, 0.0, 0.0]
    return rotation_from_vector(axis * angle[:, None])


@dataclass(frozen=True, eq=False)
class Vector:
    """Components of a vector along the tool, from the tip to the spindle, of any length (A3= B3= C3=).

    frame (3, 3): axes of the programmed coordinates in the base.  start (3, 3): orientation of the tool in the base
    where the vector is the base's z; None where nothing states it.
    """

    words: tuple[int, int, int]
    frame: Floats
    start: Floats | None
    joint: bool = True
    angles: bool = False

    @property
    def redundant_axis(self) -> Floats:
        """(3,): see ``OrientationWords``."""
        return np.full(3, np.nan) if self.start is None else self.start.T @ UP

    def rotation(self, values: Floats) -> Floats:
        """(n, 3, 3) of ``values`` (n, 3): see ``OrientationWords``."""
        if self.start is None:
            return np.full((len(values), 3, 3), np.nan)
        components = np.nan_to_num(np.asarray(values, dtype=float))
        length = np.linalg.norm(components, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            direction = (components / length[:, None]) @ self.frame.T
        return swing(direction) @ self.start

    def values(self, rotation: Floats, near: Floats) -> Floats:
        """(n, 3) of ``rotation`` (n, 3, 3), as long as ``near`` (n, 3)."""
        if self.start is None:
            return np.full((len(rotation), 3), np.nan)
        direction = rotation @ (self.start.T @ UP) @ self.frame
        length = np.linalg.norm(np.nan_to_num(near), axis=1)
        return np.asarray(direction * np.where(length > 0, length, 1.0)[:, None])

    def writable(self, values: Floats) -> Bools:
        """(n,) of ``values`` (n, 3): see ``OrientationWords``."""
        return np.full(len(values), self.start is not None)


@dataclass(frozen=True, eq=False)
class Angles:
    """Angles [deg] of rotations one after the other, each about an axis that those before have turned.

    sequence: (axis 0 .. 2 for X .. Z, column 0 .. 2 of the word), in this order: R = prod R_axis(value[column]).
    The orientation of the tool in the base is frame @ R @ tool: ``frame`` (3, 3) the programmed axes in the base,
    ``tool`` (3, 3) the tool where all angles are zero, None where nothing states it.  With ``free_spin`` an orientation
    is written by where R z points, from the tip to the spindle, alone: rotary axes, A2= B2= C2= of five axes.
    """

    words: tuple[int, int, int]
    sequence: tuple[tuple[int, int], ...]
    frame: Floats
    tool: Floats | None
    free_spin: bool = False
    joint: bool = False
    angles: bool = True

    @property
    def redundant_axis(self) -> Floats:
        """(3,): see ``OrientationWords``."""
        return self.tool.T @ UP if self.free_spin and self.tool is not None else np.full(3, np.nan)

    def _turned(self, values: Floats) -> tuple[Floats, Floats]:
        """R (n, 3, 3) and the axes (n, 3, k) about which the angles turn it, in the programmed axes."""
        n = len(values)
        rotation = np.broadcast_to(np.eye(3), (n, 3, 3))
        axes = np.empty((n, 3, len(self.sequence)))
        for k, (axis, column) in enumerate(self.sequence):
            axes[:, :, k] = rotation[:, :, axis]
            rotation = rotation @ rotation_from_vector(
                np.nan_to_num(values[:, [column]]) * DEG * np.eye(3)[axis]
            )
        return rotation, axes

    def rotation(self, values: Floats) -> Floats:
        """(n, 3, 3) of ``values`` (n, 3): see ``OrientationWords``."""
        if self.tool is None:
            return np.full((len(values), 3, 3), np.nan)
        rotation, _ = self._turned(np.asarray(values, dtype=float))
        return self.frame @ rotation @ self.tool

    def values(self, rotation: Floats, near: Floats) -> Floats:
        """(n, 3) [deg] of ``rotation`` (n, 3, 3).  Newton's method from ``near`` (n, 3): the least change of the angles
        that makes up for what is left.

        An orientation that the angles say as a whole is taken so, which is regular at the pole of a pair as well; of
        others, where the spin is free, the direction of the tool.
        """
        if self.tool is None:
            return np.full(near.shape, np.nan)
        target = self.frame.T @ rotation @ self.tool.T
        found = self._solved(target, near, False)
        if self.free_spin:
            others = np.flatnonzero(np.isnan(found[:, self.sequence[0][1]]))
            found[others] = self._solved(target[others], near[others], True)
        return found

    def _solved(self, target: Floats, near: Floats, pointing: bool) -> Floats:
        """(n, 3) angles of rotations (n, 3, 3) in the programmed axes, or of where their z axes are ``pointing``; NaN
        where there are none."""
        found = np.nan_to_num(np.array(near, dtype=float))
        for column, word in enumerate(self.words):
            if word < 0:
                found[:, column] = np.nan
        columns = [column for _, column in self.sequence]
        if pointing:
            target = target[:, :, 2]
        rows = np.flatnonzero(np.isfinite(target).all(axis=tuple(range(1, target.ndim))))
        missed = np.ones(len(found), dtype=bool)
        last = np.full(len(found), np.inf)
        for _ in range(_ROUNDS):
            left, axes = self._remaining_turn(found[rows], target[rows], pointing)
            size = np.linalg.norm(left, axis=1)
            far = size > _SOLVED
            missed[rows[~far]] = False
            far &= pointing | (size < last[rows]) | (size > 0.1)  # what no longer comes nearer has no angles
            last[rows] = size
            rows, left, axes = rows[far], left[far], axes[far]
            if not len(rows):
                break
            back = np.swapaxes(axes, 1, 2)
            normal = back @ axes + 1e-12 * np.eye(axes.shape[2])
            change = np.linalg.solve(normal, back @ left[..., None])[..., 0]
            most = np.abs(change).max(axis=1, keepdims=True)
            found[np.ix_(rows, columns)] += change * np.minimum(1.0, _STEP / np.maximum(most, 1e-300)) / DEG
        found[missed] = np.nan
        return np.asarray(found)

    def _remaining_turn(self, values: Floats, target: Floats, pointing: bool) -> tuple[Floats, Floats]:
        """The rotation vector (n, 3) from the values to the target, and the axes (n, 3, k) that count for it."""
        rotation, axes = self._turned(values)
        if not pointing:
            return vector_from_rotation(target @ np.swapaxes(rotation, 1, 2)), axes
        tool = rotation[:, :, 2]
        cross = np.cross(tool, target)
        sine = np.linalg.norm(cross, axis=1)
        angle = np.arctan2(sine, np.sum(tool * target, axis=1))
        left = cross * (angle / np.maximum(sine, 1e-300))[:, None]
        return left, axes - tool[:, :, None] * (tool[:, None, :] @ axes)

    def writable(self, values: Floats) -> Bools:
        """(n,) of ``values`` (n, 3): see ``OrientationWords``."""
        if self.tool is None:
            return np.zeros(len(values), dtype=bool)
        rotation, axes = self._turned(np.asarray(values, dtype=float))
        if self.free_spin:
            tool = rotation[:, :, 2]
            axes = axes - tool[:, :, None] * (tool[:, None, :] @ axes)
        gains = np.linalg.svd(axes, compute_uv=False)
        rank = 2 if self.free_spin else 3
        if gains.shape[1] < rank:
            return np.zeros(len(values), dtype=bool)
        return np.asarray(gains[:, rank - 1] >= STEEP)
