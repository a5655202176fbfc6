"""Signed distances of a point to a cutter and to what a cutter sweeps.

All are negative inside, have the right sign, and change by at most the distance that the point moves (1-Lipschitz).
What follows relies on these two only, so an interval in which none can be zero needs no further look.  A cutter is
convex: along a straight motion its distance is a convex function of the share of the motion.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats
from postproc.process.stock.compiled import compiled

ACROSS, STRAIGHT, GENERAL, ROUND = 0, 1, 2, 3
"""Straight across the spindle; straight; any other; an arc about the spindle that does not rise."""

RADIUS, CORNER, LENGTH, TIP, TAPER, COSINE = range(6)
"""Columns of the rows of cutters (T, 6): radius, corner radius, length [m], radius at the tip [m], tangent of the half
angle (-1: no taper) and its cosine."""

_GOLDEN = 0.6180339887498949
_PLACE = 1e-9  # m: of the place on a line where it is nearest
_SHORT, _FEET = 1e-6, 6  # m: of the path of a ball, which has a foot; the steps to it
Triple = tuple[float, float, float]

TIP_POINT, STEP, AXIS, TURN, CENTRE, NORMAL, ANGLE, MODE, CUTTER, REMOVES = 0, 3, 6, 9, 12, 15, 18, 19, 20, 21
"""Columns of the rows of sweeps (M, ROW), parts of motions in the order in which they run, in the axes of the stock.

TIP_POINT and STEP (3 each) [m]: where the tip starts, and from there to its end; AXIS (3): unit vector of the
spindle at the start, from the tip back to the spindle; TURN (3) [rad]: rotation vector by which it turns; CENTRE
(3) [m], NORMAL (3), ANGLE [rad]: of arcs, see ``Arcs``, angle 0 for lines; MODE: ACROSS, STRAIGHT, GENERAL or ROUND;
CUTTER: row of the cutters; REMOVES: 1 where it cuts, 0 for a rapid motion.  One array, because each array that a
compiled function is given costs.
"""
ROW = 22


@compiled
def cutter_distance(cutters: Floats, c: int, across: float, height: float) -> float:
    """Of a point ``across`` [m] from the spindle axis and ``height`` [m] above the tip; cutters (T, 6)."""
    corner = cutters[c, CORNER]
    out = across - (cutters[c, RADIUS] - corner)
    below = corner - height
    d = np.sqrt(out * out + below * below) - corner if out > 0.0 and below > 0.0 else max(out, below) - corner
    if cutters[c, TAPER] >= 0.0:
        d = max(d, (across - cutters[c, TIP] - height * cutters[c, TAPER]) * cutters[c, COSINE])
    return max(d, height - cutters[c, LENGTH])


@compiled
def height_range(element: Floats, low: float, high: float) -> tuple[float, float]:
    """The lengths [m] of a profile ``element`` (8,) between two heights above the tip."""
    long = element[7]
    if element[1] == 0.0:
        rise = element[5] - element[3]
        if abs(rise) < 1e-12:
            return (0.0, long) if low <= element[3] <= high else (0.0, 0.0)
        first, last = long * (low - element[3]) / rise, long * (high - element[3]) / rise
        return min(max(first, 0.0), long), min(max(last, 0.0), long)
    radius = element[4]
    below = min(max((element[3] - low) / radius, 0.0), 1.0)
    above = min(max((element[3] - high) / radius, 0.0), 1.0)
    return radius * np.arccos(below), radius * np.arccos(above)


@compiled
def rotated(
    vx: float, vy: float, vz: float, kx: float, ky: float, kz: float, share: float
) -> tuple[float, float, float]:
    """The vector v turned by ``share`` of the rotation vector k (Rodrigues)."""
    angle = np.sqrt(kx * kx + ky * ky + kz * kz)
    if angle < 1e-12:
        return vx, vy, vz
    ux, uy, uz = kx / angle, ky / angle, kz / angle
    s, c = np.sin(angle * share), np.cos(angle * share)
    along = (ux * vx + uy * vy + uz * vz) * (1.0 - c)
    return (
        c * vx + s * (uy * vz - uz * vy) + along * ux,
        c * vy + s * (uz * vx - ux * vz) + along * uy,
        c * vz + s * (ux * vy - uy * vx) + along * uz,
    )


@compiled
def tip_at(sweeps: Floats, j: int, t: float) -> tuple[float, float, float]:
    """The tip [m] at the share ``t`` of sweep ``j`` of sweeps (M, 22)."""
    x, y, z = sweeps[j, TIP_POINT], sweeps[j, TIP_POINT + 1], sweeps[j, TIP_POINT + 2]
    dx, dy, dz = sweeps[j, STEP], sweeps[j, STEP + 1], sweeps[j, STEP + 2]
    angle = sweeps[j, ANGLE]
    if angle == 0.0:
        return x + t * dx, y + t * dy, z + t * dz
    cx, cy, cz = sweeps[j, CENTRE], sweeps[j, CENTRE + 1], sweeps[j, CENTRE + 2]
    nx, ny, nz = sweeps[j, NORMAL], sweeps[j, NORMAL + 1], sweeps[j, NORMAL + 2]
    rise = t * (dx * nx + dy * ny + dz * nz)
    x, y, z = rotated(x - cx, y - cy, z - cz, angle * nx, angle * ny, angle * nz, t)
    return cx + x + rise * nx, cy + y + rise * ny, cz + z + rise * nz


@compiled
def axis_at(sweeps: Floats, j: int, t: float) -> tuple[float, float, float]:
    """The spindle axis, from the tip back to the spindle, at the share ``t`` of sweep ``j`` of sweeps (M, 22)."""
    x, y, z = sweeps[j, AXIS], sweeps[j, AXIS + 1], sweeps[j, AXIS + 2]
    return rotated(x, y, z, sweeps[j, TURN], sweeps[j, TURN + 1], sweeps[j, TURN + 2], t)


@compiled
def turn_of(sweeps: Floats, j: int) -> float:
    """[rad] By how much the spindle turns along sweep ``j`` of sweeps (M, 22)."""
    return np.sqrt(sweeps[j, TURN] ** 2 + sweeps[j, TURN + 1] ** 2 + sweeps[j, TURN + 2] ** 2)


@compiled
def arc_of(sweeps: Floats, j: int) -> tuple[float, float]:
    """The radius of sweep ``j`` of sweeps (M, 22) and its advance along the normal [m]; of a line infinite, and 0."""
    if sweeps[j, ANGLE] == 0.0:
        return np.inf, 0.0
    rise, out, square = 0.0, 0.0, 0.0
    for k in range(3):
        n, r = sweeps[j, NORMAL + k], sweeps[j, TIP_POINT + k] - sweeps[j, CENTRE + k]
        rise += sweeps[j, STEP + k] * n
        out += r * n
        square += r * r
    return np.sqrt(max(square - out * out, 0.0)), rise


@compiled
def speed_bound(sweeps: Floats, j: int, reach: float) -> float:
    """[m] How far any point within ``reach`` [m] of the tip moves along sweep ``j`` of sweeps (M, 22)."""
    length = np.sqrt(sweeps[j, STEP] ** 2 + sweeps[j, STEP + 1] ** 2 + sweeps[j, STEP + 2] ** 2)
    if sweeps[j, ANGLE] != 0.0:
        radius, rise = arc_of(sweeps, j)
        length = np.sqrt((sweeps[j, ANGLE] * radius) ** 2 + rise * rise)
    return length + turn_of(sweeps, j) * reach


@compiled
def pose_distance(sweeps: Floats, cutters: Floats, j: int, t: float, x: float, y: float, z: float) -> float:
    """Of the point to the cutter at the share ``t`` of sweep ``j``; sweeps (M, 22), cutters (T, 6)."""
    return _distance_at(sweeps, cutters, j, tip_at(sweeps, j, t), axis_at(sweeps, j, t), x, y, z)


@compiled
def _distance_at(
    sweeps: Floats, cutters: Floats, j: int, tip: Triple, axis: Triple, x: float, y: float, z: float
) -> float:
    wx, wy, wz = x - tip[0], y - tip[1], z - tip[2]
    height = wx * axis[0] + wy * axis[1] + wz * axis[2]
    across = np.sqrt(max(wx * wx + wy * wy + wz * wz - height * height, 0.0))
    return cutter_distance(cutters, int(sweeps[j, CUTTER]), across, height)


@compiled
def _straight(sweeps: Floats, cutters: Floats, j: int, x: float, y: float, z: float, enough: float) -> float:
    """``swept_distance`` of a sweep whose spindle keeps its direction."""
    c = int(sweeps[j, CUTTER])
    wx, wy, wz = x - sweeps[j, TIP_POINT], y - sweeps[j, TIP_POINT + 1], z - sweeps[j, TIP_POINT + 2]
    ax, ay, az = sweeps[j, AXIS], sweeps[j, AXIS + 1], sweeps[j, AXIS + 2]
    dx, dy, dz = sweeps[j, STEP], sweeps[j, STEP + 1], sweeps[j, STEP + 2]
    height, rise = wx * ax + wy * ay + wz * az, dx * ax + dy * ay + dz * az
    ux, uy, uz = wx - height * ax, wy - height * ay, wz - height * az
    dx, dy, dz = dx - rise * ax, dy - rise * ay, dz - rise * az
    # |u - t d|^2 = uu - 2 t ud + t^2 dd
    uu, ud, dd = ux * ux + uy * uy + uz * uz, ux * dx + uy * dy + uz * dz, dx * dx + dy * dy + dz * dz
    if sweeps[j, MODE] == ACROSS:
        beyond = max(-height, height - cutters[c, LENGTH])
        if beyond > enough:  # no need of a root
            return beyond
        t = min(max(ud / dd, 0.0), 1.0) if dd > 0.0 else 0.0
        return cutter_distance(cutters, c, np.sqrt(max(uu - t * (2.0 * ud - t * dd), 0.0)), height)
    middle = cutter_distance(cutters, c, np.sqrt(max(uu - ud + 0.25 * dd, 0.0)), height - 0.5 * rise)
    half = 0.5 * np.sqrt(dd + rise * rise)
    if middle - half > enough or middle <= -enough:
        return middle - half if middle > 0.0 else middle
    # a convex function is least where it is least nearby: beside the cylinder at the foot on the path of the axis,
    # below a ball at the foot on the path of its middle
    corner, flat = cutters[c, CORNER], cutters[c, RADIUS] - cutters[c, CORNER]
    if cutters[c, TAPER] < 0.0:
        t = min(max(ud / dd, 0.0), 1.0) if dd > 0.0 else 0.5
        at, across = height - t * rise, np.sqrt(max(uu - t * (2.0 * ud - t * dd), 0.0))
        if (
            at > corner
            and across - cutters[c, RADIUS] > at - cutters[c, LENGTH]
            and (flat == 0.0 or across - flat > corner - at)
        ):
            return across - cutters[c, RADIUS]
        if flat == 0.0:
            t = min(max((ud + (height - corner) * rise) / (dd + rise * rise), 0.0), 1.0)
            at = height - t * rise
            if at < corner:
                return np.sqrt(max(uu - t * (2.0 * ud - t * dd), 0.0) + (corner - at) ** 2) - corner
    low, high = 0.0, 1.0
    t1, t2 = 1.0 - _GOLDEN, _GOLDEN
    f1 = cutter_distance(cutters, c, np.sqrt(max(uu - t1 * (2.0 * ud - t1 * dd), 0.0)), height - t1 * rise)
    f2 = cutter_distance(cutters, c, np.sqrt(max(uu - t2 * (2.0 * ud - t2 * dd), 0.0)), height - t2 * rise)
    best = middle
    length = 2.0 * half
    while (high - low) * length > _PLACE:
        if min(f1, f2) - (high - low) * length > enough:
            return min(f1, f2) - (high - low) * length
        if f1 < f2:
            high, t2, f2 = t2, t1, f1
            t1 = high - _GOLDEN * (high - low)
            f1 = cutter_distance(
                cutters, c, np.sqrt(max(uu - t1 * (2.0 * ud - t1 * dd), 0.0)), height - t1 * rise
            )
        else:
            low, t1, f1 = t1, t2, f2
            t2 = low + _GOLDEN * (high - low)
            f2 = cutter_distance(
                cutters, c, np.sqrt(max(uu - t2 * (2.0 * ud - t2 * dd), 0.0)), height - t2 * rise
            )
    for t in (0.0, 1.0):
        f = cutter_distance(cutters, c, np.sqrt(max(uu - t * (2.0 * ud - t * dd), 0.0)), height - t * rise)
        best = min(best, f)
    return min(best, f1, f2)


@compiled
def line_distance(
    sweeps: Floats, cutters: Floats, first: int, last: int, x: float, y: float, z: float, enough: float
) -> float:
    """``swept_distance`` of the sweeps ``first`` to ``last``, one line across the spindle.  sweeps (M, 22), cutters (T,
    6)."""
    c = int(sweeps[first, CUTTER])
    wx, wy, wz = (
        x - sweeps[first, TIP_POINT],
        y - sweeps[first, TIP_POINT + 1],
        z - sweeps[first, TIP_POINT + 2],
    )
    ax, ay, az = sweeps[first, AXIS], sweeps[first, AXIS + 1], sweeps[first, AXIS + 2]
    height = wx * ax + wy * ay + wz * az
    beyond = max(-height, height - cutters[c, LENGTH])
    if beyond > enough:
        return beyond
    dx = sweeps[last, TIP_POINT] + sweeps[last, STEP] - sweeps[first, TIP_POINT]
    dy = sweeps[last, TIP_POINT + 1] + sweeps[last, STEP + 1] - sweeps[first, TIP_POINT + 1]
    dz = sweeps[last, TIP_POINT + 2] + sweeps[last, STEP + 2] - sweeps[first, TIP_POINT + 2]
    ux, uy, uz = wx - height * ax, wy - height * ay, wz - height * az
    uu, ud, dd = ux * ux + uy * uy + uz * uz, ux * dx + uy * dy + uz * dz, dx * dx + dy * dy + dz * dz
    t = min(max(ud / dd, 0.0), 1.0)
    return cutter_distance(cutters, c, np.sqrt(max(uu - t * (2.0 * ud - t * dd), 0.0)), height)


@compiled
def _round(sweeps: Floats, cutters: Floats, j: int, x: float, y: float, z: float, enough: float) -> float:
    """``swept_distance`` of a sweep in an arc about its spindle, of less than half a turn: nearest is the place at the
    angle of the point, or an end."""
    c = int(sweeps[j, CUTTER])
    ax, ay, az = sweeps[j, AXIS], sweeps[j, AXIS + 1], sweeps[j, AXIS + 2]
    px, py, pz = sweeps[j, TIP_POINT], sweeps[j, TIP_POINT + 1], sweeps[j, TIP_POINT + 2]
    height = (x - px) * ax + (y - py) * ay + (z - pz) * az
    beyond = max(-height, height - cutters[c, LENGTH])
    if beyond > enough:
        return beyond
    cx, cy, cz = sweeps[j, CENTRE], sweeps[j, CENTRE + 1], sweeps[j, CENTRE + 2]
    nx, ny, nz = sweeps[j, NORMAL], sweeps[j, NORMAL + 1], sweeps[j, NORMAL + 2]
    rx, ry, rz = px - cx, py - cy, pz - cz
    along = rx * nx + ry * ny + rz * nz
    rx, ry, rz = rx - along * nx, ry - along * ny, rz - along * nz
    ux, uy, uz = x - cx, y - cy, z - cz
    along = ux * nx + uy * ny + uz * nz
    ux, uy, uz = ux - along * nx, uy - along * ny, uz - along * nz
    turned = rx * ux + ry * uy + rz * uz
    side = nx * (ry * uz - rz * uy) + ny * (rz * ux - rx * uz) + nz * (rx * uy - ry * ux)
    angle = sweeps[j, ANGLE]
    if 0.0 <= np.arctan2(side, turned) <= angle:
        radius = np.sqrt(rx * rx + ry * ry + rz * rz)
        return cutter_distance(cutters, c, abs(np.sqrt(ux * ux + uy * uy + uz * uz) - radius), height)
    ex, ey, ez = rotated(rx, ry, rz, nx, ny, nz, angle)
    first = (ux - rx) ** 2 + (uy - ry) ** 2 + (uz - rz) ** 2
    last = (ux - ex) ** 2 + (uy - ey) ** 2 + (uz - ez) ** 2
    return cutter_distance(cutters, c, np.sqrt(min(first, last)), height)


@compiled
def _below_ball(
    sweeps: Floats, cutters: Floats, j: int, tip: Triple, axis: Triple, x: float, y: float, z: float
) -> tuple[bool, float]:
    """Whether the point is nearest to the round end of a ball along sweep ``j``, and its distance [m]: at the foot on
    the way of the ball's middle, which is almost straight.  ``tip`` and ``axis``: in the middle of the sweep."""
    c = int(sweeps[j, CUTTER])
    corner = cutters[c, CORNER]
    if cutters[c, TAPER] >= 0.0 or cutters[c, RADIUS] > corner:
        return False, 0.0
    wx, wy, wz = sweeps[j, TURN], sweeps[j, TURN + 1], sweeps[j, TURN + 2]
    bend = 0.5 * corner * (wx * wx + wy * wy + wz * wz)  # from the tangent, of the square of the share
    t = 0.5
    for _ in range(_FEET):
        vx, vy, vz = (
            x - tip[0] - corner * axis[0],
            y - tip[1] - corner * axis[1],
            z - tip[2] - corner * axis[2],
        )
        tx, ty, tz = wy * axis[2] - wz * axis[1], wz * axis[0] - wx * axis[2], wx * axis[1] - wy * axis[0]
        dx, dy, dz = (
            sweeps[j, STEP] + corner * tx,
            sweeps[j, STEP + 1] + corner * ty,
            sweeps[j, STEP + 2] + corner * tz,
        )
        square = dx * dx + dy * dy + dz * dz
        if square < _SHORT * _SHORT:
            return False, 0.0
        along = vx * dx + vy * dy + vz * dz
        to = min(max(t + along / square, 0.0), 1.0)
        step = to - t
        if bend * step * step < _PLACE:
            vx, vy, vz = vx - step * dx, vy - step * dy, vz - step * dz
            ax, ay, az = axis[0] + step * tx, axis[1] + step * ty, axis[2] + step * tz
            return vx * ax + vy * ay + vz * az < 0.0, np.sqrt(vx * vx + vy * vy + vz * vz) - corner
        t = to
        tip, axis = tip_at(sweeps, j, t), axis_at(sweeps, j, t)
    return False, 0.0


@compiled
def swept_distance(
    sweeps: Floats, cutters: Floats, j: int, x: float, y: float, z: float, enough: float
) -> float:
    """Of the point to all that the cutter of sweep ``j`` is in; beyond ``enough`` [m] on either side a bound.

    sweeps (M, 22), cutters (T, 6).
    """
    if sweeps[j, MODE] == ROUND:
        return _round(sweeps, cutters, j, x, y, z, enough)
    if sweeps[j, MODE] != GENERAL:
        return _straight(sweeps, cutters, j, x, y, z, enough)
    tip, axis = tip_at(sweeps, j, 0.5), axis_at(sweeps, j, 0.5)
    middle = _distance_at(sweeps, cutters, j, tip, axis, x, y, z)
    away = np.sqrt((x - tip[0]) ** 2 + (y - tip[1]) ** 2 + (z - tip[2]) ** 2)
    half = 0.5 * speed_bound(sweeps, j, away)
    half += 0.5 * half * turn_of(sweeps, j)
    if middle - half > enough or middle <= -enough:
        return middle - half if middle > 0.0 else middle
    if sweeps[j, ANGLE] == 0.0:
        found, d = _below_ball(sweeps, cutters, j, tip, axis, x, y, z)
        if found:
            return min(d, middle)
    low, high = 0.0, 1.0
    t1, t2 = 1.0 - _GOLDEN, _GOLDEN
    f1, f2 = pose_distance(sweeps, cutters, j, t1, x, y, z), pose_distance(sweeps, cutters, j, t2, x, y, z)
    length = 2.0 * half
    while (high - low) * length > _PLACE:
        least = min(f1, f2)
        if least - (high - low) * length > enough:
            return least - (high - low) * length
        if least <= -enough:
            return least
        if f1 < f2:
            high, t2, f2 = t2, t1, f1
            t1 = high - _GOLDEN * (high - low)
            f1 = pose_distance(sweeps, cutters, j, t1, x, y, z)
        else:
            low, t1, f1 = t1, t2, f2
            t2 = low + _GOLDEN * (high - low)
            f2 = pose_distance(sweeps, cutters, j, t2, x, y, z)
    ends = min(
        pose_distance(sweeps, cutters, j, 0.0, x, y, z), pose_distance(sweeps, cutters, j, 1.0, x, y, z)
    )
    return min(middle, ends, f1, f2)
