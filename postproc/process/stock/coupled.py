"""Engagement and displacement solved together: a tool that yields cuts less, and leaves more to what follows.

At a place of the path the tool is displaced by d = b + S w under the wrench w, and w = W(d) is what it meets there: the
equilibrium is the fixed point w = W(b + S w).  Places are solved in the order of the program, each in the stock that
the displaced tools before it left.  The tool cuts in the direction in which it moves itself, from its place before to
b + S w, and with the chip of its own speed: where the path turns it follows only as it yields.

Steps go along secants (Anderson, D. G., Iterative procedures for nonlinear integral equations, 1965,
doi:10.1145/321296.321305, of depth 1).  Where places are nearer to each other than the tool is displaced, a small
change of the wrench turns the direction by much: there steps follow the derivative, damped (Marquardt, D. W., An
algorithm for least-squares estimation of nonlinear parameters, 1963, doi:10.1137/0111030).  Where neither settles, as
in a spring pass, whose force rises steeply with the first micrometres, the size of the wrench is bracketed along its
direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.process.stock.borrowed import borrowed, keep_alive
from postproc.process.stock.bounds import set_bound
from postproc.process.stock.cells import Stock, lent_stock
from postproc.process.stock.compiled import compiled
from postproc.process.stock.contact import (
    COLUMNS,
    FORCE,
    NEAR_ZERO,
    RATE,
    SweepCutter,
    find_contact,
    set_pose,
)
from postproc.process.stock.coupled_pieces import Nodes, Pieces, lent_nodes, lent_pieces
from postproc.process.stock.displaced import displace_row
from postproc.process.stock.distance import CUTTER, rotated, speed_bound

SETTLED, OF_DISPLACEMENT = 0.1e-6, 1e-3
"""A place is solved where the displacement by its wrench and the one that it was computed at differ by less: [m], and
as a share of the displacement."""

UNSETTLED = 5e-6
"""[m] Above it no place near the one before is in equilibrium with the force that is met there."""

LOST = 0.1
"""Share of the displacement by the force above which what remains there is no place near the solution."""

LEAST_AREA = 1e-11
"""[m2] Across the feed: below it nothing is cut."""

AS_STRAIGHT = 1e-6
"""[m] A turn of the tool that moves its edges by less along a piece is taken by its mean."""

_AS_BEFORE = 1.1
"""What remains at a place that was solved with a stock nearly the same is taken up to as many times what remained."""

_STEPS, _TURNS, _HALVINGS = 8, 3, 18
_DAMPED, _TURNING = 24, 0.7
"""Damped steps; and the share of the way from place to place by which the tool is displaced where it turns by much."""

_VARIED = 3e-6  # m: by which a derivative looks aside, and as a share of the displacement:
_VARIED_SHARE = 0.01
_ALONG_SPINDLE = 0.0174524  # within a degree of it no direction across it is known


class ToolAtNode(NamedTuple):
    """The tool at one node, and what its displacements are tried with.

    pose (6, 3): as programmed, of ``set_pose``; came (4,): displacement [m] from which the tool comes, and the length
    [m] of its path since, 0 where it is not known; moved (6, 3), contact (COLUMNS,): of the displacement tried last.
    """

    stock: Stock
    cutter: SweepCutter
    pose: Floats
    came: Floats
    moved: Floats
    contact: Floats


@compiled
def solve_pieces(stock: Stock, profiles: Floats, pieces: Pieces, nodes: Nodes, lever: float) -> None:
    """Solve the nodes of all pieces in their order, and put the displaced pieces into the sweeps of ``stock``.

    profiles (T, E, 8): as of ``contacts``; lever [m]: how far from the tip a turn of the tool counts.
    """
    stock, profiles, pieces, nodes = (
        lent_stock(stock),
        borrowed(profiles),
        lent_pieces(pieces),
        lent_nodes(nodes),
    )
    own, numbers, whole = np.zeros((12, 3)), np.zeros((4, max(COLUMNS, 6))), np.array([0.0, 1.0])
    poses, rows = borrowed(own), borrowed(numbers)
    pose, moved = poses[:6], poses[6:]
    came, contact, first, last = rows[0, :4], rows[1, :COLUMNS], rows[2, :6], rows[3, :6]
    for p in range(len(pieces.rows)):
        profile = profiles[int(pieces.rows[p, CUTTER])]
        time = pieces.earlier + p
        cutter = SweepCutter(profile, pieces.laws[p], pieces.live[p], time)
        tool = ToolAtNode(stock, cutter, pose, came, moved, contact)
        a, b = pieces.start[p], pieces.end[p]
        if pieces.fresh[p] > 0:
            set_pose(pieces.rows, p, 0.0, pieces.heading[p], pose)
            came[3] = 0.0
            _solve(tool, nodes, a, a, lever)
        _displacement(nodes, a, nodes.wrench[a], first)
        came[:3], came[3] = first[:3], speed_bound(pieces.rows, p, 0.0)
        set_pose(pieces.rows, p, 1.0, pieces.heading[p], pose)
        if pieces.known == 0:
            nodes.wrench[b, :] = nodes.wrench[a]
        _solve(tool, nodes, a, b, lever)
        if came[3] > 0.0 and nodes.residual[b] > max(
            UNSETTLED, LOST * _size(nodes.slope[b], nodes.wrench[b], lever)
        ):
            _solve_as_programmed(tool, nodes, a, b, lever)
        _displacement(nodes, b, nodes.wrench[b], last)
        displace_row(pieces.rows, p, whole, first, last, lever, AS_STRAIGHT, stock.sweeps[time])
        if len(stock.bounds):
            set_bound(stock.sweeps, stock.cutters, time, stock.bounds[time])
    keep_alive(own)
    keep_alive(numbers)


@compiled
def _solve_as_programmed(tool: ToolAtNode, nodes: Nodes, before: int, k: int, lever: float) -> None:
    """The wrench of node ``k`` with the direction and the chip of the programmed feed, where its own have no
    equilibrium; what remains of these stays its residual.  From where the tool comes is no longer known."""
    rest = nodes.residual[k]
    tool.came[3] = 0.0
    nodes.wrench[k, :] = nodes.wrench[before]
    _solve(tool, nodes, before, k, lever)
    nodes.residual[k] = rest


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
def _met(tool: ToolAtNode, nodes: Nodes, k: int, wrench: Floats, out: Floats) -> float:
    """``out`` (6,): the wrench that the tool meets where ``wrench`` (6,) displaces it to; the removed area [m2]."""
    pose, moved, contact = tool.pose, tool.moved, tool.contact
    d = np.zeros(6)
    _displacement(nodes, k, wrench, d)
    moved[:] = pose
    for i in range(3):
        moved[0, i] += d[i]
    for axis in range(1, 4):
        x, y, z = rotated(pose[axis, 0], pose[axis, 1], pose[axis, 2], d[3], d[4], d[5], 1.0)
        moved[axis, 0], moved[axis, 1], moved[axis, 2] = x, y, z
    if tool.came[3] > 0.0:
        _set_own_velocity(tool.cutter.profile, pose, tool.came, moved)
    find_contact(tool.stock, tool.cutter, moved, contact)
    out[:] = 0.0
    if contact[RATE] <= LEAST_AREA:
        return 0.0
    for i in range(3):
        for axis in range(3):
            out[i] += contact[FORCE + axis] * moved[1 + axis, i]
            out[3 + i] += contact[FORCE + 3 + axis] * moved[1 + axis, i]
    return float(contact[RATE])


@compiled
def _set_own_velocity(profile: Floats, pose: Floats, came: Floats, moved: Floats) -> None:
    """``moved`` (6, 3), as of ``set_pose``, with the feed along the way that the tool goes itself, in parts of the
    programmed speed; ``pose``: where it is not displaced.

    Along the spindle a tool with a flat end keeps the programmed speed: what a displacement adds is thinner than its
    edges are sharp, and all its end would rub."""
    flat = profile[0, 1] == 0.0 and abs(profile[0, 5] - profile[0, 3]) < 1e-12
    x, y, z = moved[1], moved[2], moved[3]
    own, turn, heading = np.zeros(3), np.zeros(3), np.zeros(3)
    along, square = 0.0, 0.0
    for i in range(3):
        own[i] = (moved[0, i] - pose[0, i] - came[i]) / came[3]
        for axis in range(3):
            own[i] += pose[4, axis] * pose[1 + axis, i]
        turn[i] = moved[5, 0] * x[i] + moved[5, 1] * y[i] + moved[5, 2] * z[i]
        along += own[i] * z[i]
        square += own[i] * own[i]
    size = 0.0
    for i in range(3):
        heading[i] = own[i] - along * z[i]
        size += heading[i] * heading[i]
    size = np.sqrt(size)
    if size > _ALONG_SPINDLE * np.sqrt(square):
        for i in range(3):
            x[i] = heading[i] / size
        y[0], y[1], y[2] = z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]
    axial = moved[4, 2]
    for axis in range(3):
        a = moved[1 + axis]
        moved[4, axis] = own[0] * a[0] + own[1] * a[1] + own[2] * a[2]
        moved[5, axis] = turn[0] * a[0] + turn[1] * a[1] + turn[2] * a[2]
    if flat:
        moved[4, 2] = axial


@compiled
def _solve(tool: ToolAtNode, nodes: Nodes, before: int, k: int, lever: float) -> None:
    """The fixed point at node ``k``, from its wrench on, or from that of the node ``before``."""
    slope = nodes.slope[k]
    w, g, g_before = np.zeros(6), np.zeros(6), np.zeros(6)
    r, r_before = np.zeros(6), np.zeros(6)
    w[:] = nodes.wrench[k]
    best = np.inf
    if nodes.residual[k] > 0.0:
        area = _met(tool, nodes, k, w, g)
        size = _size(slope, g - w, lever)
        if size <= SETTLED + max(OF_DISPLACEMENT * _size(slope, g, lever), _AS_BEFORE * nodes.residual[k]):
            nodes.residual[k], nodes.area[k] = size, area
            return
    displaced = max(_size(slope, w, lever), _size(slope, nodes.wrench[before], lever))
    turning = displaced > _TURNING * tool.came[3] > 0.0
    if turning and _settle_turning(tool, nodes, before, k, lever):
        return
    for step in range(0 if turning else _STEPS):
        area = _met(tool, nodes, k, w, g)
        r[:] = g - w
        size = _size(slope, r, lever)
        limit = SETTLED + OF_DISPLACEMENT * _size(slope, g, lever)
        if size < best:
            best = size
            nodes.wrench[k, :] = w
            nodes.residual[k], nodes.area[k] = size, area
        if size <= limit:
            # where hardly anything yields, the wrench before may be far from the one that is met
            if step == 0:
                nodes.wrench[k, :] = g
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
    _bracket(tool, nodes, k, lever)


@compiled
def _settle_turning(tool: ToolAtNode, nodes: Nodes, before: int, k: int, lever: float) -> bool:
    """The fixed point at node ``k`` by damped steps along the derivative of what remains by the force; whether it
    settles.  The node keeps the best that was seen."""
    slope = nodes.slope[k]
    w, g, r = np.zeros(6), np.zeros(6), np.zeros(6)
    trial, varied = nodes.wrench[before].copy(), np.zeros(6)
    change, rest = np.zeros((6, 3)), np.zeros(3)
    left, square = np.zeros((3, 3)), np.zeros((3, 3))
    best, damping, fresh = np.inf, 1e-3, False
    for start in range(2):  # from where the force was, or from where it is expected
        if start == 1:
            trial[:] = nodes.wrench[k]
        area = _met(tool, nodes, k, trial, varied)
        size = _size(slope, varied - trial, lever)
        if size < best:
            best, at_best = size, area
            w[:], g[:] = trial, varied
    for _ in range(_DAMPED):
        nodes.wrench[k, :] = w
        nodes.residual[k], nodes.area[k] = best, at_best
        if best <= SETTLED + OF_DISPLACEMENT * _size(slope, g, lever):
            return True
        r[:] = g - w
        if not fresh:
            aside = _VARIED + _VARIED_SHARE * _size(slope, w, lever)
            for j in range(3):
                unit = np.sqrt(slope[0, j] ** 2 + slope[1, j] ** 2 + slope[2, j] ** 2)
                change[:, j] = 0.0
                if unit == 0.0:
                    continue
                trial[:] = w
                trial[j] += aside / unit
                _met(tool, nodes, k, trial, varied)
                for i in range(6):
                    change[i, j] = (varied[i] - g[i]) * unit / aside
            fresh = True
        # of the shifts: those by what remains, and their derivative by the force
        for i in range(3):
            rest[i] = 0.0
            for m in range(6):
                rest[i] += slope[i, m] * r[m]
            for j in range(3):
                left[i, j] = -slope[i, j]
                for m in range(6):
                    left[i, j] += slope[i, m] * change[m, j]
        for i in range(3):
            for j in range(3):
                square[i, j] = 0.0
                for m in range(3):
                    square[i, j] += left[m, i] * left[m, j]
        trace = square[0, 0] + square[1, 1] + square[2, 2]
        if trace == 0.0:
            return False
        for i in range(3):
            square[i, i] += damping * trace
        force = _solved(square, -(left.T @ rest))
        for i in range(3):
            trial[i] = w[i] + force[i]
            trial[3 + i] = g[3 + i]
            for j in range(3):
                trial[3 + i] += change[3 + i, j] * force[j]
        area = _met(tool, nodes, k, trial, varied)
        size = _size(slope, varied - trial, lever)
        if size < best:
            # a derivative that foretold well is used again
            fresh = size < 0.3 * best
            damping = max(0.1 * damping, 1e-9)
            best, at_best = size, area
            w[:], g[:] = trial, varied
        elif damping > 1e3:
            return False
        else:
            damping *= 10.0
    return False


@compiled
def _solved(matrix: Floats, right: Floats) -> Floats:
    """(3,) the solution of three equations, matrix (3, 3), by Cramer's rule."""
    a, b, c = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    found = np.empty(3)
    whole = _triple(a, b, c)
    found[0], found[1], found[2] = (
        _triple(right, b, c) / whole,
        _triple(a, right, c) / whole,
        _triple(a, b, right) / whole,
    )
    return found


@compiled
def _triple(a: Floats, b: Floats, c: Floats) -> float:
    """The determinant of three columns (3,)."""
    return float(
        a[0] * (b[1] * c[2] - b[2] * c[1])
        - b[0] * (a[1] * c[2] - a[2] * c[1])
        + c[0] * (a[1] * b[2] - a[2] * b[1])
    )


@compiled
def _bracket(tool: ToolAtNode, nodes: Nodes, k: int, lever: float) -> None:
    """The fixed point at node ``k`` where steps do not settle: the size of the wrench bracketed in its direction,
    which then is turned.  The node keeps what it has where this comes no closer."""
    slope = nodes.slope[k]
    g, w, unit, inner = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
    best = nodes.residual[k]
    area = _met(tool, nodes, k, w, unit)
    for _ in range(_TURNS):
        square = _along(slope, unit, unit)
        full = _size(slope, unit, lever)
        if square == 0.0 or full <= SETTLED:
            if full < best:
                nodes.wrench[k, :] = unit
                nodes.residual[k], nodes.area[k] = full, area
            return
        low, high, widening = 0.0, 1.0, True
        inner[:] = unit
        for _ in range(_HALVINGS):
            scale = high if widening else 0.5 * (low + high)
            w[:] = scale * unit
            area = _met(tool, nodes, k, w, g)
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
