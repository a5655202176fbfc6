"""Frames and arcs of single motions, in mm and deg as the text states them (batches: ``postproc.base.geometry``)."""

from __future__ import annotations

import math
from typing import NamedTuple

Numbers = tuple[float, float, float, float, float, float]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

ZERO: Numbers = (0.0,) * 6
"""The frame in which it is stated itself."""
STRAIGHT = 1e-6
"""Sine of the angle at the start of an arc below which its three points lie on a line."""


class Arc(NamedTuple):
    """The path of an arc: centre [mm], unit normal, sweep > 0 [deg] counter-clockwise about it, and where it ends."""

    centre: Vector
    normal: Vector
    sweep: float
    end: Vector


def rotation(a: float, b: float, c: float) -> Matrix:
    """R = Rz(A) Ry(B) Rx(C), angles in deg."""
    a, b, c = math.radians(a), math.radians(b), math.radians(c)
    sa, sb, sc, ca, cb, cc = math.sin(a), math.sin(b), math.sin(c), math.cos(a), math.cos(b), math.cos(c)
    return (
        (ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc),
        (sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc),
        (-sb, cb * sc, cb * cc),
    )


def angles(r: Matrix) -> Vector:
    """A, B, C [deg] of a rotation, |B| <= 90; A is 0 at the gimbal lock."""
    cos_b = math.hypot(r[0][0], r[1][0])
    a = 0.0 if cos_b < 1e-9 else math.atan2(r[1][0], r[0][0])
    sa, ca = math.sin(a), math.cos(a)
    b = math.atan2(-r[2][0], cos_b)
    c = math.atan2(sa * r[0][2] - ca * r[1][2], ca * r[1][1] - sa * r[0][1])
    return math.degrees(a), math.degrees(b), math.degrees(c)


def turned(r: Matrix, v: Vector) -> Vector:
    """R v."""
    return _dot(r[0], v), _dot(r[1], v), _dot(r[2], v)


def product(first: Numbers, second: Numbers) -> Numbers:
    """KRL's ``first:second``: the frame ``second``, which is stated in ``first``, where ``first`` is stated."""
    r = rotation(*first[3:])
    x, y, z = turned(r, second[:3])
    if not any(second[3:]):
        a, b, c = first[3:]
    else:
        u, v, w = zip(*rotation(*second[3:]), strict=True)
        first_row, second_row, third_row = ((_dot(row, u), _dot(row, v), _dot(row, w)) for row in r)
        a, b, c = angles((first_row, second_row, third_row))
    return first[0] + x, first[1] + y, first[2] + z, a, b, c


def inverse(frame: Numbers) -> Numbers:
    """KRL's ``INV_POS(frame)``: with it, ``product(inverse(frame), frame)`` is no displacement."""
    u, v, w = zip(*rotation(*frame[3:]), strict=True)
    back: Matrix = (u, v, w)
    x, y, z = turned(back, frame[:3])
    return -x, -y, -z, *angles(back)


def arc(start: Vector, through: Vector, end: Vector, angle: float | None) -> Arc | None:
    """The arc from ``start`` by way of ``through`` to ``end``; with ``angle`` [deg] (KRL's CA) it turns by that much, a
    negative one the other way round.  None where the points do not define a circle.

    With u = through - start, v = end - start, n = u x v: centre = start + (|u|^2 (v x n) + |v|^2 (n x u)) / (2 |n|^2).
    """
    u, v = _minus(through, start), _minus(end, start)
    n = _cross(u, v)
    uu, vv, nn = _dot(u, u), _dot(v, v), _dot(n, n)
    gap = _minus(v, u)
    if not nn > STRAIGHT**2 * uu * vv or not _dot(gap, gap) > 1e-12 * max(uu, vv) or angle == 0:
        return None
    p, q = _cross(v, n), _cross(n, u)
    offset = tuple((uu * p[i] + vv * q[i]) / (2 * nn) for i in range(3))
    centre = (start[0] + offset[0], start[1] + offset[1], start[2] + offset[2])
    length = math.sqrt(nn)
    normal = (n[0] / length, n[1] / length, n[2] / length)
    from_centre = _minus(start, centre)
    if angle is None:
        to_end = _minus(end, centre)
        sweep = math.atan2(_dot(normal, _cross(from_centre, to_end)), _dot(from_centre, to_end))
        return Arc(centre, normal, math.degrees(sweep % (2 * math.pi)), end)
    if angle < 0:
        normal = (-normal[0], -normal[1], -normal[2])
    t = math.radians(abs(angle))
    across = _cross(normal, from_centre)
    there = [centre[i] + math.cos(t) * from_centre[i] + math.sin(t) * across[i] for i in range(3)]
    return Arc(centre, normal, abs(angle), (there[0], there[1], there[2]))


def _dot(u: Vector, v: Vector) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _minus(u: Vector, v: Vector) -> Vector:
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def _cross(u: Vector, v: Vector) -> Vector:
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
