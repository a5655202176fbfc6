"""Whether a part of a tool is in stock where it must not be."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.units import MM
from postproc.process.stock.borrowed import borrowed, keep_alive
from postproc.process.stock.cells import Stock, lent_stock
from postproc.process.stock.compiled import compiled
from postproc.process.stock.contact import (
    BOUND,
    CutterCircle,
    SweepCutters,
    find_arcs,
    lent_cutters,
    set_pose,
)
from postproc.process.stock.distance import CUTTER, REMOVES, height_range

DEEP, NARROW = 0.02 * MM, 0.3 * MM
"""A collision is deeper than the first and wider than the second."""


@compiled
def collides(stock: Stock, profile: Floats, part: int, pose: Floats, time: int) -> bool:
    """Whether a part (CUTTING, SHANK or HOLDER) at ``pose`` reaches deeper than ``DEEP`` into what is left before the
    sweep ``time``; what is narrower than ``NARROW`` is not seen.

    profile (E, 8), pose (6, 3): as in ``find_contact``.
    """
    arc = np.zeros(12)
    low, high = np.inf, -np.inf
    for corner in range(8):
        height = 0.0
        for k in range(3):
            end = stock.blank.frame[1 + k] if corner >> k & 1 else stock.blank.frame[4 + k]
            height += (end - pose[0, k]) * pose[3, k]
        low, high = min(low, height), max(high, height)
    bound, at = np.zeros(64), np.zeros(64)
    for e in range(len(profile)):
        element = profile[e]
        if int(element[0]) != part:
            continue
        first, last = height_range(element, low, high)
        if last <= first:
            continue
        a, most = first, np.inf
        parts = int(max(2.0, np.ceil((last - first) / (4.0 * stock.grid[1]))))
        for place in range(parts + 1):
            top = 0
            at[0], bound[0] = first + (last - first) * place / parts, np.nan
            while top >= 0:
                s = at[top]
                if np.isnan(bound[top]):
                    if element[1] == 0.0:
                        r = element[2] + s / element[7] * (element[4] - element[2])
                        height = element[3] + s / element[7] * (element[5] - element[3])
                    else:
                        r = element[2] + element[4] * np.sin(s / element[4])
                        height = element[3] - element[4] * np.cos(s / element[4])
                    narrow = NARROW / max(r, NARROW)
                    find_arcs(stock, pose, CutterCircle(r, height, -np.pi, np.pi, DEEP, narrow), time, arc)
                    if arc[0] > 0.0:
                        return True
                    bound[top] = arc[BOUND]
                if place == 0 or most + bound[top] + (s - a) <= 0.0 or s - a < NARROW:
                    a, most = s, bound[top]
                    top -= 1
                else:
                    top += 1
                    at[top], bound[top] = 0.5 * (a + s), np.nan
    return False


@compiled
def collisions(
    stock: Stock, cutters: SweepCutters, sweep: Ints, share: Floats, part: Ints, found: Ints
) -> None:
    """``found`` (K,): 1 where the ``part`` (K,) at the pose reaches into stock; what the sweep itself removes is gone.

    sweep (K,) and the share (K,) of it.
    """
    stock, cutters = lent_stock(stock), lent_cutters(cutters)
    sweep, share, part, found = borrowed(sweep), borrowed(share), borrowed(part), borrowed(found)
    own = np.zeros((6, 3))
    pose = borrowed(own)
    for k in range(len(sweep)):
        j = sweep[k]
        set_pose(stock.sweeps, j, share[k], cutters.headings[j], pose)
        time = j + 1 if stock.sweeps[j, REMOVES] > 0.0 else j
        profile = cutters.profiles[int(stock.sweeps[j, CUTTER])]
        found[k] = 1 if collides(stock, profile, part[k], pose, time) else 0
    keep_alive(own)
