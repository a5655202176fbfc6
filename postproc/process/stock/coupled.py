"""Engagement and displacement solved together: a tool that yields cuts less, and leaves more to what follows.

At a place of the path the tool is displaced by d = b + S w under the wrench w, and w = W(d) is what it meets there: the
equilibrium is the fixed point w = W(b + S w).  Places are solved in the order of the program, each in the stock that
the displaced tools before it left.  Steps go along secants (Anderson, D. G., Iterative procedures for nonlinear
integral equations, 1965, doi:10.1145/321296.321305, of depth 1); where these do not settle, as in a spring pass, whose
force rises steeply with the first micrometres, the size of the wrench is bracketed along its direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.cells import Stock
from postproc.process.stock.compiled import compiled
from postproc.process.stock.contact import COLUMNS, FORCE, NEAR_ZERO, RATE, find_contact, set_pose
from postproc.process.stock.displaced import displace_row
from postproc.process.stock.distance import CUTTER, rotated

SETTLED, OF_DISPLACEMENT = 0.1e-6, 1e-3
"""A place is solved where the displacement by its wrench and the one that it was computed at differ by less: [m], and
as a share of the displacement."""

LEAST_AREA = 1e-11
"""[m2] Across the feed: below it nothing is cut."""

AS_STRAIGHT = 1e-6
"""[m] A turn of the tool that moves its edges by less along a piece is taken by its mean."""

_STEPS, _TURNS, _HALVINGS = 8, 3, 18


class Pieces(NamedTuple):
    """P pieces of sweeps in the order in which they run.

    rows (P, ROW): as programmed; laws (P, 9), live (P, 2), heading (P, 3): as of ``find_contact``; start, end (P,):
    their nodes; fresh (P,): 1 where the node at the start is solved, 0 where it is the end of the piece before;
    earlier: sweeps of the stock before the first of them; known: 1 where the wrenches of the nodes are near the
    solution, 0 where that of the place before is a better guess.
    """

    rows: Floats
    laws: Floats
    live: Floats
    heading: Floats
    start: Ints
    end: Ints
    fresh: Ints
    earlier: int
    known: int


class Nodes(NamedTuple):
    """K places of paths, in the axes of the stock, wrenches [N, N m] about the tip.

    base (K, 6): displacement without wrench, shift [m] and turn [rad]; slope (K, 6, 6): its derivative by the wrench;
    wrench (K, 6): of the nominal engagement, to be replaced by the solution; residual (K,) [m]: what remains between
    both displacements; area (K,) [m2]: removed area across the feed.
    """

    base: Floats
    slope: Floats
    wrench: Floats
    residual: Floats
    area: Floats


@compiled
def solve_pieces(stock: Stock, profiles: Floats, pieces: Pieces, nodes: Nodes, lever: float) -> None:
    """Solve the nodes of all pieces in their order, and put the displaced pieces into the sweeps of ``stock``.

    profiles (T, E, 8): as of ``contacts``; lever [m]: how far from the tip a turn of the tool counts.
    """
    pose = np.zeros((6, 3))
    first, last, whole = np.zeros(6), np.zeros(6), np.array([0.0, 1.0])
    for p in range(len(pieces.rows)):
        profile = profiles[int(pieces.rows[p, CUTTER])]
        law, live, time = pieces.laws[p], pieces.live[p], pieces.earlier + p
        a, b = pieces.start[p], pieces.end[p]
        if pieces.fresh[p] > 0:
            set_pose(pieces.rows, p, 0.0, pieces.heading[p], pose)
            _solve(stock, profile, pose, law, live, time, nodes, a, lever)
        set_pose(pieces.rows, p, 1.0, pieces.heading[p], pose)
        if pieces.known == 0:
            nodes.wrench[b, :] = nodes.wrench[a]
        _solve(stock, profile, pose, law, live, time, nodes, b, lever)
        _displacement(nodes, a, nodes.wrench[a], first)
        _displacement(nodes, b, nodes.wrench[b], last)
        displace_row(pieces.rows, p, whole, first, last, lever, AS_STRAIGHT, stock.sweeps[time])


@compiled
def _displacement(nodes: Nodes, k: int, wrench: Floats, out: Floats) -> None:
    for i in range(6):
        out[i] = nodes.base[k, i]
        for j in range(6):
            out[i] += nodes.slope[k, i, j] * wrench[j]


@compiled
def _size(slope: Floats, wrench: Floats, lever: float) -> float:
    """[m] By how much a wrench displaces the tool."""
    shift, turn = 0.0, 0.0
    for i in range(6):
        d = 0.0
        for j in range(6):
            d += slope[i, j] * wrench[j]
        if i < 3:
            shift += d * d
        else:
            turn += d * d
    return float(np.sqrt(shift) + lever * np.sqrt(turn))


@compiled
def _met(
    stock: Stock, profile: Floats, pose: Floats, law: Floats, live: Floats, time: int, nodes: Nodes, k: int,
    wrench: Floats, moved: Floats, contact: Floats, out: Floats,
) -> float:  # fmt: skip
    """``out`` (6,): the wrench that the tool meets where ``wrench`` (6,) displaces it to; the removed area [m2]."""
    d = np.zeros(6)
    _displacement(nodes, k, wrench, d)
    moved[:] = pose
    for i in range(3):
        moved[0, i] += d[i]
    for axis in range(1, 4):
        x, y, z = rotated(pose[axis, 0], pose[axis, 1], pose[axis, 2], d[3], d[4], d[5], 1.0)
        moved[axis, 0], moved[axis, 1], moved[axis, 2] = x, y, z
    find_contact(stock, profile, moved, law, live, time, contact)
    out[:] = 0.0
    if contact[RATE] <= LEAST_AREA:
        return 0.0
    for i in range(3):
        for axis in range(3):
            out[i] += contact[FORCE + axis] * moved[1 + axis, i]
            out[3 + i] += contact[FORCE + 3 + axis] * moved[1 + axis, i]
    return float(contact[RATE])


@compiled
def _solve(
    stock: Stock, profile: Floats, pose: Floats, law: Floats, live: Floats, time: int, nodes: Nodes, k: int,
    lever: float,
) -> None:  # fmt: skip
    """The fixed point at node ``k``, from its wrench on."""
    moved, contact = np.zeros((6, 3)), np.zeros(COLUMNS)
    slope = nodes.slope[k]
    w, g, g_before = np.zeros(6), np.zeros(6), np.zeros(6)
    r, r_before = np.zeros(6), np.zeros(6)
    w[:] = nodes.wrench[k]
    best = np.inf
    for step in range(_STEPS):
        area = _met(stock, profile, pose, law, live, time, nodes, k, w, moved, contact, g)
        r[:] = g - w
        size = _size(slope, r, lever)
        limit = SETTLED + OF_DISPLACEMENT * _size(slope, g, lever)
        if size < best:
            best = size
            nodes.wrench[k, :] = w
            nodes.residual[k], nodes.area[k] = size, area
        if size <= limit:
            return
        if step == 0:
            g_before[:], r_before[:] = g, r
            w[:] = g
            continue
        # of both displacements the mix that would leave the least between them, were all linear
        along, square = 0.0, 0.0
        for i in range(3):
            now, change = 0.0, 0.0
            for j in range(6):
                now += slope[i, j] * r[j]
                change += slope[i, j] * (r[j] - r_before[j])
            along += now * change
            square += change * change
        theta = min(max(along / square, -1.0), 1.0) if square > 0.0 else 0.0
        r_before[:] = r
        w[:] = g - theta * (g - g_before)
        g_before[:] = g
    _bracket(stock, profile, pose, law, live, time, nodes, k, lever)


@compiled
def _bracket(
    stock: Stock, profile: Floats, pose: Floats, law: Floats, live: Floats, time: int, nodes: Nodes, k: int,
    lever: float,
) -> None:  # fmt: skip
    """The fixed point at node ``k`` where secants do not settle: the size of the wrench bracketed in its direction,
    which then is turned."""
    moved, contact = np.zeros((6, 3)), np.zeros(COLUMNS)
    slope = nodes.slope[k]
    g, w, unit, inner = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
    best = np.inf
    area = _met(stock, profile, pose, law, live, time, nodes, k, w, moved, contact, unit)
    for _ in range(_TURNS):
        square = _along(slope, unit, unit)
        full = _size(slope, unit, lever)
        if square == 0.0 or full <= SETTLED:
            nodes.wrench[k, :] = unit
            nodes.residual[k], nodes.area[k] = full, area
            return
        low, high, widening = 0.0, 1.0, True
        inner[:] = unit
        for _ in range(_HALVINGS):
            scale = high if widening else 0.5 * (low + high)
            w[:] = scale * unit
            area = _met(stock, profile, pose, law, live, time, nodes, k, w, moved, contact, g)
            size = _size(slope, g - w, lever)
            if size < best:
                best = size
                nodes.wrench[k, :] = w
                nodes.residual[k], nodes.area[k] = size, area
            if _along(slope, g, unit) > scale * square:
                inner[:] = g
                low = scale
                high = 2.0 * scale if widening else high
            else:
                high, widening = scale, False
            if not widening and (high - low) * full < 0.5 * SETTLED:
                break
        if best <= NEAR_ZERO + OF_DISPLACEMENT * full:  # of less the engagement knows nothing
            return
        turned = _along(slope, inner, inner)
        if turned == 0.0:
            return
        unit[:] = inner * np.sqrt(square / turned)


@compiled
def _along(slope: Floats, one: Floats, other: Floats) -> float:
    """[m2] The product of the shifts of two wrenches."""
    total = 0.0
    for i in range(3):
        a, b = 0.0, 0.0
        for j in range(6):
            a += slope[i, j] * one[j]
            b += slope[i, j] * other[j]
        total += a * b
    return total
