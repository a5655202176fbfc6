"""Where a cutter at one place of its path touches stock, and with which force.

The surface of the cutter is cut into circles by the length s along its profile.  At the angle phi, clockwise from +y
seen from the spindle, with the profile's slope k (0 across the axis, 90 deg along it) the outward normal is

    n = sin k (sin phi, cos phi, 0) - cos k (0, 0, 1),

and the chip h = c n.v for the feed per tooth c and the velocity v of the cutter there over that of its tip; v is
known to give h = c (A sin phi + B cos phi + C).  Edges cut where h > 0 and stock is outside: on arcs of the
circle.  The linear edge-force model for the length ds of the edge: Ft = (Ktc h + Kte) ds against the rotation, Fr
= (Krc h + Kre) ds along -n, Fa = (Kac h + Kae) ds along the edge, towards the tip for a right-hand helix.  The
mean over a turn is teeth / 2 pi times the integral over the arcs and the profile.  Source: Y. Altintas,
Manufacturing Automation, 2nd ed., 2.8 and 2.10; a bottom edge (k = 0) is taken by the same law.

Arcs are found by halving: the distance to the stock changes by at most the length of arc, so most intervals need one
look.  The profile is halved likewise until the integrals no longer change, so that no boundary of a slice counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.borrowed import borrowed, keep_alive
from postproc.process.stock.cells import Stock, lent_stock, nearest_line
from postproc.process.stock.compiled import compiled
from postproc.process.stock.cutter_circles import chip_of, circle_at, on_circle
from postproc.process.stock.distance import (
    ANGLE,
    CENTRE,
    CUTTER,
    NORMAL,
    STEP,
    TURN,
    axis_at,
    height_range,
    tip_at,
)
from postproc.process.stock.empty_patches import arc_bound, touches_none

RATE, FORCE, MOMENT, LOW, HIGH, ENTRY, EXIT, RIGHT, LEFT, CHIP = 0, 1, 4, 7, 8, 9, 10, 11, 12, 13
"""Columns of a contact: removed area across the feed [m2]; force [N] and moment at the tip [N m] in the feed
frame; heights above the tip [m]; angles [rad]; offsets across the feed, y [m]; the largest chip [m]."""
COLUMNS = 14

NEAR_ZERO = 2e-7
"""m: a cutter that follows a surface which is already cut does not cut it again for the digits of a number."""

_LEAST_STOCK = 1e-8  # m: thinner is a digit of a number
_LEAST_ARC = 0.02 * np.pi / 180
_FIRST_ARC = 45.0 * np.pi / 180  # at most: proofs of wider ones are rare
_SMALL_ARC, _SMALLER_ARC, _STRAIGHT_ENOUGH = 12.0 * np.pi / 180, 1.0 * np.pi / 180, 0.02
_GRAZING = 0.01
_LEAST_SHARE = 2e-4  # of the radius: the shortest length of profile
_LEAST_GAP = (
    4e-3  # of the radius: between two circles without stock so near none is in between that a force shows
)
_BESIDE_TIP = 1e-6  # of the corner radius: where a surface has no slope its edges have no side of the feed
_EVEN, _EVEN_AT_END = 2e-3, 3e-4  # change of a panel's integrals that ends its halving, as a share of all
_BENT = 0.2
_SKEW = 0.5 * np.pi
_MOST_PARTS = 32

# of a circle: integrals of 1, sin, cos, sin2, sin cos, cos2; largest distance seen and possible; extent
_GREATEST, BOUND, _FIRST, _LAST, _MOST_LEFT, _MOST_RIGHT = range(6, 12)


class SweepCutters(NamedTuple):
    """What cuts in M sweeps, by T cutters.

    profiles (T, E, 8): see ``Cutter.profile``, unused rows with the part 9; laws (M, 9), live (M, 2): as of
    ``SweepCutter``; headings (M, 3): x of the feed frames where the feed is along z.
    """

    profiles: Floats
    laws: Floats
    live: Floats
    headings: Floats


class SweepCutter(NamedTuple):
    """What cuts in one sweep.

    profile (E, 8): see ``Cutter.profile``; law (9,): feed per tooth [m], teeth, sign of the helix, Ktc, Krc, Kac [Pa],
    Kte, Kre, Kae [N/m]; live (2,): heights [m] between which there may be stock; time: the sweep.
    """

    profile: Floats
    law: Floats
    live: Floats
    time: int


class CutterCircle(NamedTuple):
    """The part of a circle of a cutter in which stock is looked for: radius and height above the tip [m], the first and
    the last angle [rad]; stock of at least ``margin`` [m] outside counts, on arcs down to ``least`` [rad]."""

    radius: float
    height: float
    low: float
    high: float
    margin: float
    least: float


@compiled
def set_pose(sweeps: Floats, j: int, t: float, heading: Floats, pose: Floats) -> None:
    """``pose`` (6, 3): tip [m], axes x, y, z of the feed frame, velocity and rotation for the speed 1 of the tip,
    in that frame; ``heading`` (3,): x where the feed is along z; sweeps (M, 22)."""
    tip, axis = tip_at(sweeps, j, t), axis_at(sweeps, j, t)
    step, n, angle = sweeps[j, STEP : STEP + 3], sweeps[j, NORMAL : NORMAL + 3], sweeps[j, ANGLE]
    vx, vy, vz = step[0], step[1], step[2]
    if angle != 0.0:
        c = sweeps[j, CENTRE : CENTRE + 3]
        rise = step[0] * n[0] + step[1] * n[1] + step[2] * n[2]
        dx, dy, dz = tip[0] - c[0], tip[1] - c[1], tip[2] - c[2]
        vx = angle * (n[1] * dz - n[2] * dy) + rise * n[0]
        vy = angle * (n[2] * dx - n[0] * dz) + rise * n[1]
        vz = angle * (n[0] * dy - n[1] * dx) + rise * n[2]
    speed = max(np.sqrt(vx * vx + vy * vy + vz * vz), 1e-9)
    along = vx * axis[0] + vy * axis[1] + vz * axis[2]
    hx, hy, hz = vx - along * axis[0], vy - along * axis[1], vz - along * axis[2]
    size = np.sqrt(hx * hx + hy * hy + hz * hz)
    if size < 0.0174524 * speed:  # within a degree of the spindle
        along = heading[0] * axis[0] + heading[1] * axis[1] + heading[2] * axis[2]
        hx, hy, hz = heading[0] - along * axis[0], heading[1] - along * axis[1], heading[2] - along * axis[2]
        size = np.sqrt(hx * hx + hy * hy + hz * hz)
    for k in range(3):
        pose[0, k], pose[3, k] = tip[k], axis[k]
    pose[1, 0], pose[1, 1], pose[1, 2] = hx / size, hy / size, hz / size
    x, z = pose[1], pose[3]
    pose[2, 0] = z[1] * x[2] - z[2] * x[1]
    pose[2, 1] = z[2] * x[0] - z[0] * x[2]
    pose[2, 2] = z[0] * x[1] - z[1] * x[0]
    turn = sweeps[j, TURN : TURN + 3]
    for k in range(3):
        a = pose[1 + k]
        pose[4, k] = (vx * a[0] + vy * a[1] + vz * a[2]) / speed
        pose[5, k] = (turn[0] * a[0] + turn[1] * a[1] + turn[2] * a[2]) / speed


@compiled
def _outside(
    stock: Stock, pose: Floats, r: float, height: float, phi: float, time: int
) -> tuple[float, int, int]:
    """Distance to the stock at the angle ``phi`` of the circle with the radius ``r`` at ``height`` [m], and the sweeps
    that are nearest."""
    x, y, z = on_circle(pose, r, height, phi)
    return nearest_line(stock, x, y, z, time, 0.0)


@compiled
def _add(arc: Floats, a: float, b: float, r: float) -> None:
    """The arc from ``a`` to ``b`` added to the integrals and the extent of its circle."""
    sa, ca, sb, cb = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    arc[0] += b - a
    arc[1] += ca - cb
    arc[2] += sb - sa
    arc[3] += 0.5 * (b - a) - 0.5 * (sb * cb - sa * ca)
    arc[4] += 0.5 * (sb * sb - sa * sa)
    arc[5] += 0.5 * (b - a) + 0.5 * (sb * cb - sa * ca)
    arc[_FIRST] = min(arc[_FIRST], a)
    arc[_LAST] = max(arc[_LAST], b)
    arc[_MOST_LEFT] = max(arc[_MOST_LEFT], r * max(ca, cb))
    arc[_MOST_RIGHT] = min(arc[_MOST_RIGHT], r * min(ca, cb))
    for turn in (-2, -1, 0, 1, 2):  # where cos has its ends
        if a < turn * np.pi < b:
            arc[_MOST_LEFT if turn % 2 == 0 else _MOST_RIGHT] = r if turn % 2 == 0 else -r


@compiled
def _add_above_zero(arc: Floats, a: float, ga: float, b: float, gb: float, r: float) -> None:
    """The part from ``a`` to ``b`` added where the distance, linear from ``ga`` to ``gb``, is above zero."""
    if ga > 0.0 and gb > 0.0:
        _add(arc, a, b, r)
    elif ga > 0.0:
        _add(arc, a, a + (b - a) * ga / (ga - gb), r)
    elif gb > 0.0:
        _add(arc, b - (b - a) * gb / (gb - ga), b, r)


@compiled
def _grazes(ga: float, gb: float) -> bool:
    """Whether one of two distances of unlike sign is too small against the other for a line to say where zero is: just
    outside of stock the nearest surface may be another one, such as the floor below a wall."""
    return (ga > 0.0) != (gb > 0.0) and min(abs(ga), abs(gb)) < _GRAZING * max(abs(ga), abs(gb))


@compiled
def find_arcs(stock: Stock, pose: Floats, circle: CutterCircle, time: int, arc: Floats) -> None:
    """The arcs of ``circle`` with stock before the sweep ``time``, put into ``arc`` (12,): integrals, extremes and
    ends.  pose (6, 3): of ``set_pose``."""
    r, height, low, high, margin, least = circle
    arc[:] = 0.0
    arc[_GREATEST], arc[BOUND], arc[_FIRST], arc[_LAST] = -np.inf, -np.inf, np.inf, -np.inf
    arc[_MOST_LEFT], arc[_MOST_RIGHT] = -np.inf, np.inf
    parts = int(max(4.0, np.ceil((high - low) / _FIRST_ARC)))
    ends, values, lines = np.empty(64), np.empty(64), np.empty((64, 2), np.int64)
    a = low
    ga, first, last = _outside(stock, pose, r, height, a, time)
    ga -= margin
    arc[_GREATEST] = ga
    for part in range(parts):
        top = 0
        ends[0] = low + (high - low) * (part + 1) / parts
        values[0], lines[0, 0], lines[0, 1] = _outside(stock, pose, r, height, ends[0], time)
        values[0] -= margin
        while top >= 0:
            b, gb = ends[top], values[top]
            arc[_GREATEST] = max(arc[_GREATEST], gb)
            wide = r * (b - a)
            above = 0.5 * (ga + gb + wide)
            if above > 0.0 and ga <= 0.0 and gb <= 0.0:
                above = min(above, arc_bound(stock, pose, r, height, a, b, (first, last)) - margin)
            if above <= 0.0:
                arc[BOUND] = max(arc[BOUND], above)
            elif ga + gb >= wide:
                _add(arc, a, b, r)
            elif b - a < least:
                arc[BOUND] = max(arc[BOUND], above)
                _add_above_zero(arc, a, ga, b, gb, r)
            else:
                middle = 0.5 * (a + b)
                g, owner, end = _outside(stock, pose, r, height, middle, time)
                g -= margin
                bend = abs(ga - 2.0 * g + gb)
                if abs(g) < NEAR_ZERO and abs(ga) < NEAR_ZERO and abs(gb) < NEAR_ZERO and b - a < 0.3:
                    arc[BOUND] = max(arc[BOUND], NEAR_ZERO)
                elif (
                    b - a < _SMALL_ARC
                    and bend < _STRAIGHT_ENOUGH * (abs(ga) + abs(gb))
                    and not (_grazes(ga, g) or _grazes(g, gb))
                ) or (b - a < _SMALLER_ARC and (ga > 0.0) == (g > 0.0) and (gb > 0.0) == (g > 0.0)):
                    # no boundary of the stock turns here: one that is crossed is where a line says
                    arc[BOUND] = max(arc[BOUND], max(ga, max(g, gb)))
                    arc[_GREATEST] = max(arc[_GREATEST], g)
                    _add_above_zero(arc, a, ga, middle, g, r)
                    _add_above_zero(arc, middle, g, b, gb, r)
                else:
                    top += 1
                    ends[top], values[top], lines[top, 0], lines[top, 1] = middle, g, owner, end
                    continue
            a, ga, first, last = b, gb, lines[top, 0], lines[top, 1]
            top -= 1


# a node of the profile: length, contact, greatest, bound, then what is integrated: rate, force, moment, angle
_AT, _TOUCHES, _SEEN, _MOST, _SUM = 0, 1, 2, 3, 4
_NODE = 13


@compiled
def _set_node(
    stock: Stock, cutter: SweepCutter, e: int, s: float, pose: Floats, contact: Floats, node: Floats
) -> None:
    """What the circle at the length ``s`` [m] of the element ``e`` of a profile adds, by the metre of profile."""
    own = np.zeros(12)
    _set_node_by(stock, cutter, e, s, pose, contact, node, borrowed(own))
    keep_alive(own)


@compiled
def _set_node_by(
    stock: Stock,
    cutter: SweepCutter,
    e: int,
    s: float,
    pose: Floats,
    contact: Floats,
    node: Floats,
    arc: Floats,
) -> None:
    """``_set_node``; arc (12,): of ``find_arcs``."""
    law = cutter.law
    r, height, sine, cosine = circle_at(cutter.profile[e], s)
    node[:] = 0.0
    node[_AT] = s
    a, b, c, middle, half = chip_of(pose, r, height, sine, cosine)
    if half < 0.0:
        return
    circle = CutterCircle(r, height, middle - half, middle + half, _LEAST_STOCK, _LEAST_ARC)
    find_arcs(stock, pose, circle, cutter.time, arc)
    node[_SEEN], node[_MOST] = arc[_GREATEST], arc[BOUND]
    if arc[0] <= 0.0:
        return
    node[_TOUCHES] = 1.0
    chip, teeth, helix = law[0], law[1], law[2]
    one, sin, cos = arc[0], arc[1], arc[2]
    h, hs, hc = (
        a * sin + b * cos + c * one,
        a * arc[3] + b * arc[4] + c * sin,
        a * arc[4] + b * arc[5] + c * cos,
    )
    scale = teeth / (2.0 * np.pi)
    t, ts, tc = (
        scale * (law[3] * chip * h + law[6] * one),
        scale * (law[3] * chip * hs + law[6] * sin),
        scale * (law[3] * chip * hc + law[6] * cos),
    )
    n, ns, nc = (
        scale * (law[4] * chip * h + law[7] * one),
        scale * (law[4] * chip * hs + law[7] * sin),
        scale * (law[4] * chip * hc + law[7] * cos),
    )
    e, es, ec = (
        scale * helix * (law[5] * chip * h + law[8] * one),
        scale * helix * (law[5] * chip * hs + law[8] * sin),
        scale * helix * (law[5] * chip * hc + law[8] * cos),
    )
    fx, fy, fz = -tc - sine * ns - cosine * es, ts - sine * nc - cosine * ec, cosine * n - sine * e
    k = _SUM
    node[k] = r * h
    node[k + 1], node[k + 2], node[k + 3] = fx, fy, fz
    node[k + 4] = r * (cosine * nc - sine * ec) - height * fy
    node[k + 5] = height * fx - r * (cosine * ns - sine * es)
    node[k + 6] = r * t
    node[k + 7] = r * one
    contact[LOW], contact[HIGH] = min(contact[LOW], height), max(contact[HIGH], height)
    shift = 0.0
    if arc[_FIRST] < -_SKEW and arc[_LAST] - arc[_FIRST] < 6.28:
        shift = 2.0 * np.pi if arc[_LAST] < -_SKEW + 1e-9 else 0.0
    contact[ENTRY] = min(contact[ENTRY], arc[_FIRST] + shift)
    contact[EXIT] = max(contact[EXIT], arc[_LAST] + shift)
    contact[RIGHT], contact[LEFT] = min(contact[RIGHT], arc[_MOST_RIGHT]), max(contact[LEFT], arc[_MOST_LEFT])
    thickest = max(
        a * np.sin(arc[_FIRST]) + b * np.cos(arc[_FIRST]), a * np.sin(arc[_LAST]) + b * np.cos(arc[_LAST])
    )
    if arc[_FIRST] <= middle <= arc[_LAST]:
        thickest = np.sqrt(a * a + b * b)
    contact[CHIP] = max(contact[CHIP], chip * (thickest + c))


@compiled
def find_contact(stock: Stock, cutter: SweepCutter, pose: Floats, contact: Floats) -> None:
    """The contact of one pose (6, 3), as of ``set_pose``, put into ``contact`` (COLUMNS,)."""
    profile, live = cutter.profile, cutter.live
    contact[:] = 0.0
    contact[LOW], contact[HIGH], contact[ENTRY], contact[EXIT] = np.inf, -np.inf, np.inf, -np.inf
    contact[RIGHT], contact[LEFT] = np.inf, -np.inf
    own, total, rough = np.zeros((67 + _MOST_PARTS, _NODE)), np.zeros(8), np.zeros(8)
    every = borrowed(own)
    left, middle, nodes, starts = every[0], every[1], every[2:66], every[66:]
    for e in range(len(profile)):
        element = profile[e]
        if element[0] != 0.0:
            break
        flat = element[1] == 0.0 and abs(element[5] - element[3]) < 1e-12
        if flat and pose[4, 2] >= -1e-9 and abs(pose[5, 0]) + abs(pose[5, 1]) < 1e-12:
            continue  # a flat end that does not go down
        first, last = height_range(element, live[0], live[1])
        if element[1] != 0.0:
            first = max(first, _BESIDE_TIP * element[4])
        if last <= first:
            continue
        least, gap = _LEAST_SHARE * max(element[4], element[2]), _LEAST_GAP * max(element[4], element[2])
        parts = int(min(max(2.0, np.ceil((last - first) / (4.0 * stock.grid[1]))), _MOST_PARTS))
        rough[:] = 0.0
        for part in range(parts + 1):
            s = first + (last - first) * part / parts
            _set_node(stock, cutter, e, s, pose, contact, starts[part])
            weight = (last - first) / parts * (0.5 if part in (0, parts) else 1.0)
            for k in range(8):
                rough[k] += weight * starts[part, _SUM + k]
        for k in range(8):
            rough[k] += total[k]
        left[:] = starts[0]
        for part in range(parts):
            top = 0
            nodes[0] = starts[part + 1]
            while top >= 0:
                right = nodes[top]
                wide = right[_AT] - left[_AT]
                empty = left[_TOUCHES] == 0.0 and right[_TOUCHES] == 0.0
                done = empty and (
                    left[_MOST] + right[_MOST] + wide <= 0.0
                    or touches_none(
                        stock, pose, element, left[_AT], right[_AT], _LEAST_STOCK, gap, cutter.time
                    )
                )
                if not done and wide < least:
                    for k in range(8):
                        total[k] += 0.5 * wide * (left[_SUM + k] + right[_SUM + k])
                    done = True
                if not done:
                    _set_node(stock, cutter, e, 0.5 * (left[_AT] + right[_AT]), pose, contact, middle)
                    if empty and middle[_TOUCHES] == 0.0:
                        done = wide < gap or (
                            abs(left[_SEEN]) < NEAR_ZERO
                            and abs(middle[_SEEN]) < NEAR_ZERO
                            and abs(right[_SEEN]) < NEAR_ZERO
                            and wide < 0.5 * stock.grid[1]
                        )
                        bend = abs(left[_SEEN] - 2.0 * middle[_SEEN] + right[_SEEN])
                        none = max(left[_SEEN], max(middle[_SEEN], right[_SEEN]))
                        done = done or (wide < stock.grid[1] and bend < -_BENT * none)
                    else:
                        done = True
                        inside = left[_TOUCHES] * middle[_TOUCHES] * right[_TOUCHES]
                        even = _EVEN if inside > 0.0 else _EVEN_AT_END
                        for k in (0, 7):
                            outer = left[_SUM + k] + right[_SUM + k]
                            inner = middle[_SUM + k]
                            change = wide * abs(outer - 2.0 * inner) / 6.0
                            if change > even * max(rough[k], total[k]):
                                done = False
                        if done:
                            for k in range(8):
                                total[k] += (
                                    wide * (left[_SUM + k] + 4.0 * middle[_SUM + k] + right[_SUM + k]) / 6.0
                                )
                if done:
                    left[:] = right
                    top -= 1
                else:
                    top += 1
                    nodes[top] = middle
    keep_alive(own)
    contact[RATE] = total[0]
    for k in range(6):
        contact[FORCE + k] = total[1 + k]


@compiled
def lent_cutters(cutters: SweepCutters) -> SweepCutters:
    """The same, for compiled code that does not count references to it."""
    return SweepCutters(
        borrowed(cutters.profiles), borrowed(cutters.laws), borrowed(cutters.live), borrowed(cutters.headings)
    )


@compiled
def contacts(stock: Stock, cutters: SweepCutters, sweep: Ints, share: Floats, found: Floats) -> None:
    """``found`` (K, COLUMNS) of K poses: sweep (K,) and the share (K,) of it."""
    stock, cutters = lent_stock(stock), lent_cutters(cutters)
    sweep, share, found = borrowed(sweep), borrowed(share), borrowed(found)
    own = np.zeros((6, 3))
    pose = borrowed(own)
    for k in range(len(sweep)):
        j = sweep[k]
        set_pose(stock.sweeps, j, share[k], cutters.headings[j], pose)
        profile = cutters.profiles[int(stock.sweeps[j, CUTTER])]
        find_contact(stock, SweepCutter(profile, cutters.laws[j], cutters.live[j], j), pose, found[k])
    keep_alive(own)
