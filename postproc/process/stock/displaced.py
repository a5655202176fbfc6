"""Sweeps whose tool is displaced: its ends shifted and turned, in between linearly."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.compiled import compiled
from postproc.process.stock.distance import (
    ANGLE,
    AXIS,
    CENTRE,
    GENERAL,
    MODE,
    NORMAL,
    ROW,
    STEP,
    STRAIGHT,
    TIP_POINT,
    TURN,
    axis_at,
    rotated,
    tip_at,
)

EVEN = 0.02e-6
"""[m] By how much a displacement between two places may differ from linear, and a turn that is omitted move a point."""


def displaced_rows(
    rows: Floats, part: Floats, first: Floats, last: Floats, lever: float, even: float = EVEN
) -> Floats:
    """(K, ROW) the parts (K, 2) of sweeps ``rows`` (K, ROW) as sweeps of their own.

    Their ends are displaced by ``first`` and ``last`` (K, 6), shift [m] and turn [rad]; a turn that moves no point
    within ``lever`` [m] by more than ``even`` [m] is omitted.
    """
    out = np.zeros((len(rows), ROW))
    parts = np.ascontiguousarray(part, float)
    _displace_rows(np.ascontiguousarray(rows), parts, first, last, lever, even, out)
    return out


@compiled
def _displace_rows(
    rows: Floats, part: Floats, first: Floats, last: Floats, lever: float, even: float, out: Floats
) -> None:
    rows, part, first, last, out = (
        borrowed(rows),
        borrowed(part),
        borrowed(first),
        borrowed(last),
        borrowed(out),
    )
    for k in range(len(rows)):
        displace_row(rows, k, part[k], first[k], last[k], lever, even, out[k])


@compiled
def displace_row(
    rows: Floats, j: int, part: Floats, first: Floats, last: Floats, lever: float, even: float, out: Floats
) -> None:  # fmt: skip
    """``out`` (ROW,): the sweep ``j`` of ``rows`` from and to the shares ``part`` (2,), displaced at its ends by
    ``first`` and ``last`` (6,), see ``displaced_rows``."""
    start, stop = part[0], part[1]
    out[:] = 0.0
    out[MODE:] = rows[j, MODE:]
    (x0, y0, z0), (x1, y1, z1) = tip_at(rows, j, start), tip_at(rows, j, stop)
    x0, y0, z0 = x0 + first[0], y0 + first[1], z0 + first[2]
    dx, dy, dz = x1 + last[0] - x0, y1 + last[1] - y0, z1 + last[2] - z0
    (ax, ay, az), (bx, by, bz) = axis_at(rows, j, start), axis_at(rows, j, stop)
    ax, ay, az = rotated(ax, ay, az, first[3], first[4], first[5], 1.0)
    bx, by, bz = rotated(bx, by, bz, last[3], last[4], last[5], 1.0)
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    sine = np.sqrt(cx * cx + cy * cy + cz * cz)
    turn = np.arctan2(sine, ax * bx + ay * by + az * bz)
    turns = lever * turn > even
    if turns:
        scale = turn / sine
        out[TURN], out[TURN + 1], out[TURN + 2] = cx * scale, cy * scale, cz * scale
    else:
        ax, ay, az = ax + bx, ay + by, az + bz
        size = np.sqrt(ax * ax + ay * ay + az * az)
        ax, ay, az = ax / size, ay / size, az / size
    out[TIP_POINT], out[TIP_POINT + 1], out[TIP_POINT + 2] = x0, y0, z0
    out[STEP], out[STEP + 1], out[STEP + 2] = dx, dy, dz
    out[AXIS], out[AXIS + 1], out[AXIS + 2] = ax, ay, az
    angle = rows[j, ANGLE] * (stop - start)
    out[ANGLE] = angle
    out[MODE] = GENERAL if angle > 0.0 or turns else STRAIGHT
    nx, ny, nz = rows[j, NORMAL], rows[j, NORMAL + 1], rows[j, NORMAL + 2]
    out[NORMAL], out[NORMAL + 1], out[NORMAL + 2] = nx, ny, nz
    if angle > 0.0:
        # the circle in the plane of the old one that goes through both displaced ends by the same angle
        rise = dx * nx + dy * ny + dz * nz
        hx, hy, hz = dx - rise * nx, dy - rise * ny, dz - rise * nz
        far = 0.5 / np.tan(0.5 * angle)
        out[CENTRE] = x0 + 0.5 * hx + far * (ny * hz - nz * hy)
        out[CENTRE + 1] = y0 + 0.5 * hy + far * (nz * hx - nx * hz)
        out[CENTRE + 2] = z0 + 0.5 * hz + far * (nx * hy - ny * hx)
