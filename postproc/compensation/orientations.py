"""How the orientation runs between two commands, and which orientations the words of a program can express."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base import rotary_words
from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Placed, Poses, product, rotation_from_vector, turned
from postproc.toolpath import OrientationPath, Toolpath

_OPPOSITE = 1e-6
"""[rad] Directions that are nearer to opposite have no great circle."""


@dataclass(frozen=True, eq=False)
class MotionParts:
    """Parts (K) of motions.  rows (K,): the motions; first, last (K,): where the parts start and end, as shares of the
    motions' paths; start, end (K, 3, 3): orientations there, in the robot base."""

    rows: Ints
    first: Floats
    last: Floats
    start: Floats
    end: Floats


@dataclass(frozen=True, eq=False)
class ProgrammedOrientations:
    """How N motions turn the tool.  base, wanted (N): bases and targets of the motions, in the robot base."""

    path: Toolpath
    base: Poses
    wanted: Placed

    def interpolate(self, parts: MotionParts, share: Floats, into: Floats) -> None:
        """Puts into ``into`` (K, 3, 3) the orientations at the shares (K,) of the parts (K) that turn otherwise than
        evenly about one axis."""
        control, rows = self.path.orientation_control, parts.rows
        if not control.any_by_words:
            return
        law = control.path[rows]
        at = np.flatnonzero(law == OrientationPath.ROTARY_AXES)
        if len(at):
            words = self._words(rows[at])
            one, two = words.inside(parts.start[at]), words.inside(parts.end[at])
            start_angles = rotary_words.angles_of(one, control.rotary_at(rows[at], parts.first[at]))
            stop_angles = rotary_words.angles_of(two, control.rotary_at(rows[at], parts.last[at]))
            # What the words do not express (another base or tool before) turns evenly.
            expressible = rotary_words.reproduced(one, start_angles) & rotary_words.reproduced(
                two, stop_angles
            )
            angles = start_angles + share[at][:, None] * (stop_angles - start_angles)
            here = words.outside(rotary_words.rotation_of(angles))
            into[at[expressible]] = here[expressible]
        at = np.flatnonzero(law == OrientationPath.GREAT_CIRCLE)
        if len(at):
            axis = control.redundant_axis[rows[at]]
            here, known = _on_great_circle(parts.start[at], parts.end[at], axis, share[at])
            into[at[known]] = here[known]

    def nearest_expressible(self, rows: Ints, share: Floats, rotation: Floats) -> Floats:
        """(K, 3, 3) orientations that the pair of axes of motions ``rows`` (K,) expresses near its place at the shares
        (K,) of their paths, with the tool along that of ``rotation`` (K, 3, 3) as far as they can:
        ``rotary_words.pointing``."""
        words = self._words(rows)
        tool = words.inside(rotation)[:, :, 2]
        near = self.path.orientation_control.rotary_at(rows, share)
        return words.outside(rotary_words.rotation_of(rotary_words.pointing(tool, near)))

    def _words(self, rows: Ints) -> _Words:
        frame = np.broadcast_to(self.base.shared(rows).rotation, (len(rows), 3, 3))
        to = rotary_words.rotation_of(self.path.orientation_control.rotary_to[rows])
        back = np.swapaxes(product(frame, to), 1, 2)
        return _Words(frame, product(back, self.wanted[rows].rotation))


def _on_great_circle(start: Floats, end: Floats, tool: Floats, share: Floats) -> tuple[Floats, Floats]:
    """R(t) = G(t) R(0) S(t): G turns the direction of ``tool`` (K, 3, in tool axes) along the shortest path, S about
    the tool.

    Gives (K, 3, 3), and (K,) where there is one such path.
    """
    one, two = turned(start, tool), turned(end, tool)
    axis = np.cross(one, two)
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, np.sum(one * two, axis=1))
    known = np.isfinite(angle) & (angle < np.pi - _OPPOSITE)
    vector = axis * (angle / np.where(sine > 0, sine, 1.0))[:, None]
    vector, tool = (np.where(known[:, None], part, 0.0) for part in (vector, tool))
    # the spin: what remains of R(1) after the great circle turns about the tool
    remaining = product(np.swapaxes(product(rotation_from_vector(vector), start), 1, 2), end)
    odd = np.stack([remaining[:, k, j] - remaining[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=-1)
    trace = np.trace(remaining, axis1=1, axis2=2)
    spin = np.arctan2(0.5 * np.sum(odd * tool, axis=1), 0.5 * (trace - 1.0))
    path = rotation_from_vector(share[:, None] * vector)
    turn = rotation_from_vector((share * spin)[:, None] * tool)
    return product(product(path, start), turn), known


class _Words:
    """K motions: words express R(words) between the base and the tool as it is at A = B = C = 0."""

    def __init__(self, base: Floats, tool: Floats) -> None:
        self._base, self._tool = base, tool

    def inside(self, rotation: Floats) -> Floats:
        """What the words have to express (K, 3, 3) of orientations in the robot base."""
        return product(product(np.swapaxes(self._base, 1, 2), rotation), np.swapaxes(self._tool, 1, 2))

    def outside(self, rotation: Floats) -> Floats:
        """And back."""
        return product(product(self._base, rotation), self._tool)


def pairs(path: Toolpath, rows: Ints) -> Ints:
    """Places (P,) among ``rows`` (K,) of the motions that two rotary axes turn and whose words can be written."""
    if not path.orientation_control.any_by_words:
        return rows[:0]
    by_axes = (
        path.orientation_control.path[rows] == OrientationPath.ROTARY_AXES
    ) & path.constraints.orientation_programmed[rows]
    # All motions of a program use the same words.
    two = np.isfinite(path.orientation_control.rotary_to[rows]).sum(axis=1) == 2
    return np.flatnonzero(by_axes & two)


POLE = np.radians(1.0)
"""[rad] Lean at which a pair of axes is near its pole: farther away even segments become longer with the lean."""


def shares_between(path: Toolpath, rows: Ints, low: Floats, high: Floats, part: Floats) -> Floats:
    """(K,) shares of the paths of ``rows`` (K,): the parts ``part`` (K,), 0 to 1, of what lies between the shares
    ``low`` and ``high`` (K,).

    Evenly; where a pair of axes turns evenly in u = asinh(lean / POLE), because the outer one turns with 1 / lean.
    """
    shares = low + part * (high - low)
    at, (start, stop) = _leans(path, rows, low, high)
    if len(at):
        one, two = np.arcsinh(start / POLE), np.arcsinh(stop / POLE)
        lean = POLE * np.sinh(one + part[at] * (two - one))
        shares[at] = low[at] + (high[at] - low[at]) * (lean - start) / (stop - start)
    return np.where(part == 1.0, high, shares)


def shortest(path: Toolpath, rows: Ints, low: Floats, high: Floats) -> Floats:
    """(K,) by which factor the shortest of many segments of ``spread``, from the shares ``low`` to ``high`` (K,) of
    motions ``rows`` (K,), is shorter than an even one."""
    factor = np.ones(len(rows))
    at, (start, stop) = _leans(path, rows, low, high)
    if len(at):
        one, two = np.arcsinh(start / POLE), np.arcsinh(stop / POLE)
        nearest = np.where(start * stop < 0, 0.0, np.minimum(np.abs(one), np.abs(two)))
        factor[at] = np.minimum(1.0, np.cosh(nearest) * POLE * (two - one) / (stop - start))
    return factor


def _leans(path: Toolpath, rows: Ints, low: Floats, high: Floats) -> tuple[Ints, tuple[Floats, Floats]]:
    """Places among ``rows`` (K,) of motions whose lean from the outer axis changes, and the leans [rad] at the shares
    ``low`` and ``high`` (K,) of their paths."""
    at = pairs(path, rows)
    if not len(at):
        return at, (low[at], high[at])
    ends = [
        rotary_words.lean(path.orientation_control.rotary_at(rows[at], share[at])) for share in (low, high)
    ]
    half = np.pi * np.rint(0.5 * (ends[0] + ends[1]) / np.pi)  # the pole that lies nearest
    start, stop = ends[0] - half, ends[1] - half
    some = np.abs(stop - start) > 0.1 * POLE
    return at[some], (start[some], stop[some])
