"""The tool's orientation from rotary words.

R(A, B, C) = Rz(C) Ry(B) Rx(A) in the base's axes (A about X, B about Y, C about Z, as the tool turns against the part),
and the tool stands at R(A, B, C) turned, with ``turned`` its orientation at A = B = C = 0.  An axis that no block names
stays at 0.  That holds where X, Y, Z are the tool's tip (TCP modes); else where the tip is, and how the part
stands, is the machine's own, and only blocks with all rotary axes at 0 say where the tool is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Bools, Floats, Ints

NEAR_POLE = 0.1
"""cos B below which A and C turn far for a small tilt."""

WHOLE = 1e-9
"""[rad] a rotary axis this near to 0 stands at 0."""


@dataclass(frozen=True, eq=False)
class Stand:
    """rotation (N, 3, 3); oriented (N,): its three angles can be written; wrong (N,): 0, or 1 rotary axes away from 0
    or not known without a TCP mode, 2 not known in one."""

    rotation: Floats
    oriented: Bools
    wrong: Ints


def rotation(angles: Floats) -> Floats:
    """R = Rz(C) Ry(B) Rx(A) of A, B, C (..., 3) [rad]."""
    (sa, sb, sc), (ca, cb, cc) = np.moveaxis(np.sin(angles), -1, 0), np.moveaxis(np.cos(angles), -1, 0)
    rows = [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def stand(begin: Floats, end: Floats, used: Bools, tcp: Bools, rapid: Bools, turned: Floats) -> Stand:
    """The orientation of N motions.

    begin, end (N, 3) [rad]: rotary positions; used (3,): axes that the program names; tcp, rapid (N,); turned (3, 3),
    NaN where nothing says it.
    """
    n = len(end)
    wrong = np.zeros(n, np.int64)
    result = np.broadcast_to(turned, (n, 3, 3))
    oriented = np.zeros(n, np.bool_)
    if not used.any():
        return Stand(result, oriented, wrong)
    there = np.where(used, end, 0.0)
    before = np.where(used, begin, 0.0)
    unknown = np.isnan(there).any(axis=1)
    away = (np.abs(there) > WHOLE).any(axis=1)
    away |= ~rapid & (np.abs(before) > WHOLE).any(axis=1)
    wrong[~tcp & (unknown | away)] = 1
    wrong[tcp & unknown] = 2
    turns = rotation(there)
    result = np.where((wrong == 0)[:, None, None], turns @ turned, np.nan)
    oriented = tcp & (wrong == 0) & used.all() & (np.abs(np.cos(there[:, 1])) > NEAR_POLE)
    return Stand(result, oriented, wrong)
