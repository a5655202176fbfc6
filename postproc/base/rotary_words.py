"""Rotary words A, B, C as a control with a tool centre point mode runs them: R = Rz(C) Ry(B) Rx(A), each word linear.

Two words are a pair of axes that point the tool (its z axis); where the inner one is at 0 the tool lies in the
outer axis, which then states nothing of its direction: the pole.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats
from postproc.base.geometry import abc_from_rotation, rotation_from_abc, wrapped
from postproc.base.units import DEG

SWING = 3 * DEG
"""By how much the outer axis of a pair may leave its programmed place near the pole to turn the tool's direction."""

STEEP = 0.05
"""Sine of the lean from which on the outer axis turns the tool as far as it takes, 1 / STEEP times that at most."""

RETURN = 3.0
"""How many times SWING the outer axis would have to turn where it starts to go back to its place."""

_TINY = 1e-12


def used(angles: Floats) -> tuple[int, ...]:
    """Columns of the words (n, 3) that a program uses, the outer one first; the others are NaN."""
    return tuple(column for column in (2, 1, 0) if len(angles) and not np.isnan(angles[:, column]).all())


def rotation_of(angles: Floats) -> Floats:
    """R = Rz(C) Ry(B) Rx(A) (n, 3, 3) of A, B, C (n, 3) [rad], NaN where a word is not used."""
    return rotation_from_abc(np.nan_to_num(angles)[:, ::-1])


def angles_of(rotation: Floats, near: Floats) -> Floats:
    """A, B, C (n, 3) [rad] of rotations (n, 3, 3) that words can express, those nearest to ``near`` (n, 3).

    A pair is computed from the whole rotation, which is regular at the pole: R i = R_o i for the inner axis i.
    """
    columns, angles = used(near), np.array(near)
    if len(columns) == 3:
        angles[:] = abc_from_rotation(rotation, near[:, ::-1])[:, ::-1]
    elif len(columns) == 2:
        outer, inner = columns
        o, i = np.eye(3)[[outer, inner]]
        axis = rotation @ i
        angles[:, outer] = np.arctan2(axis @ np.cross(o, i), axis @ i)
        angles[:, inner] = _inner(rotation[:, :, 2], angles[:, outer], outer, inner)
    elif columns == (2,):
        angles[:, 2] = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    elif columns:
        angles[:, columns[0]] = _inner(rotation[:, :, 2], np.zeros(len(near)), 2, columns[0])
    return np.asarray(near + wrapped(angles - near))


def _inner(tool: Floats, angle: Floats, outer: int, inner: int) -> Floats:
    """(n,) [rad] of the inner axis with which the z axis comes nearest to ``tool`` (n, 3), the outer one at ``angle``
    (n,)."""
    turn = np.full((len(tool), 3), np.nan)
    turn[:, outer] = angle
    inside = np.einsum("nji,nj->ni", rotation_of(turn), tool)
    return np.asarray(np.arctan2(inside @ np.cross(np.eye(3)[inner], [0.0, 0.0, 1.0]), inside[:, 2]))


def pointing(tool: Floats, near: Floats) -> Floats:
    """A, B, C (n, 3) [rad] of a pair of axes that point the tool along unit vectors (n, 3), near ``near`` (n, 3).

    With p what the direction lies across the plane of the inner axis and s what it leans in it, the outer axis would
    turn by x = atan(p / s).  It turns by min(x, b, RETURN b^2 s / p), b = max(SWING, p / STEEP): all of it
    away from the pole, no more than b near it, and back to its place, continuously, at the pole itself, where it can
    not turn the tool.  What then remains across is not expressed by the words.
    """
    outer, inner = used(near)
    o, i = np.eye(3)[[outer, inner]]
    rotation = np.full_like(near, np.nan)
    rotation[:, outer] = near[:, outer]
    inside = np.einsum("nji,nj->ni", rotation_of(rotation), tool)  # as the outer axis is at its place
    # R_o(x) i . tool = 0
    across, lean = -(inside @ i), inside @ np.cross(o, i)
    sense = np.where(lean < 0, -1.0, 1.0)
    change = np.arctan2(sense * across, np.maximum(np.abs(lean), _TINY))
    size, bound = np.abs(change), np.maximum(SWING, np.abs(across) / STEEP)
    back = RETURN * bound * bound * np.abs(lean) / np.maximum(np.abs(across), _TINY)
    change = np.sign(change) * np.minimum(np.minimum(size, bound), back)
    angles = np.array(near)
    angles[:, outer] = near[:, outer] + change
    angles[:, inner] = _inner(tool, angles[:, outer], outer, inner)
    angles[:, inner] = near[:, inner] + wrapped(angles[:, inner] - near[:, inner])
    return angles


def reproduced(rotation: Floats, angles: Floats) -> Bools:
    """(n,) the words (n, 3) express the rotations (n, 3, 3)."""
    return np.asarray(np.abs(rotation_of(angles) - rotation).max(axis=(1, 2)) < 1e-7)


def lean(angles: Floats) -> Floats:
    """(n,) [rad] of the tool from the outer axis of a pair, by the words (n, 3); a pole at every multiple of pi."""
    outer, inner = used(angles)
    return angles[:, inner] + (0.0 if outer == 2 else 0.5 * np.pi)


def beside_great_circle(start: Floats, end: Floats) -> Floats:
    """(n,) [rad] between the tool half way of words that run linearly from ``start`` to ``end`` (n, 3) and half way of
    the great circle between the same directions: what two controls may make of one program; NaN where not known."""
    one, two, here = (rotation_of(words)[:, :, 2] for words in (start, end, 0.5 * (start + end)))
    sum_ = one + two
    sine, cosine = np.linalg.norm(np.cross(here, sum_), axis=1), np.sum(here * sum_, axis=1)
    known = np.isfinite(start).any(axis=1) & np.isfinite(end).any(axis=1)
    return np.where(known, np.arctan2(sine, cosine), np.nan)
