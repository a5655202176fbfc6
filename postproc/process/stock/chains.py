"""Short motions that go on from each other: their contacts are looked at as closely as those of a long motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import lengths
from postproc.base.units import DEG
from postproc.process.stock.contact import RATE
from postproc.process.stock.distance import ANGLE, AXIS, CUTTER, STEP, TIP_POINT
from postproc.process.stock.motion_sweeps import MotionSweeps

_JOINED, _SAME_WAY = 1e-9, 2 * DEG  # m, and of feed and spindle from one motion to the next


def chain_contacts(
    sweeps: MotionSweeps, laws: Floats, chosen: Ints, spacing: Floats, even: float,
    look: Callable[[Ints], Floats],
) -> Floats:  # fmt: skip
    """The contacts (K, C) in the middles of the sweeps ``chosen`` (K,), none longer than its ``spacing`` (M,) [m].

    Within a chain they are looked at a spacing apart.  Those between two that cut are interpolated where the removed
    areas differ by at most the share ``even``, there and beside; all others are looked at too.  laws (M, 9): as of
    ``find_contact``; look: contacts of sweeps.
    """
    if not len(chosen):
        return look(chosen)
    joins = _joins(sweeps, laws, chosen)
    chain = np.cumsum(~joins) - 1
    length = sweeps.length[chosen]
    along = np.cumsum(length) - 0.5 * length
    start = along[np.flatnonzero(~joins)][chain]
    step = np.floor((along - start) / spacing[chosen])
    first_of_chain = ~joins
    first = first_of_chain | np.append(True, step[1:] != step[:-1])
    last = np.append(~joins[1:], True)
    seen = np.flatnonzero(first | last)
    contacts = look(chosen[seen])
    place = np.searchsorted(seen, np.arange(len(chosen)), side="right") - 1
    after = np.minimum(place + 1, len(seen) - 1)
    known = np.zeros(len(chosen), bool)
    known[seen] = True
    rate = contacts[:, RATE]
    # a gap between two that are alike may still hold a dip: those beside it have to be alike too
    alike = np.zeros(len(seen) + 1, bool)
    alike[1:-1] = ~first_of_chain[seen[1:]]
    alike[1:-1] &= (np.minimum(rate[1:], rate[:-1]) > 0) & (
        np.abs(np.diff(rate)) <= even * np.maximum(rate[1:], rate[:-1])
    )
    flat = np.zeros(len(seen) + 1, bool)
    flat[1:-1] = alike[1:-1] & alike[:-2] & alike[2:]
    between = ~known & flat[place + 1]
    found = np.empty((len(chosen), contacts.shape[1]))
    found[seen] = contacts
    at = np.flatnonzero(between)
    one, two = seen[place[at]], seen[after[at]]
    share = ((along[at] - along[one]) / (along[two] - along[one]))[:, None]
    found[at] = (1 - share) * contacts[place[at]] + share * contacts[after[at]]
    rest = np.flatnonzero(~known & ~between)
    found[rest] = look(chosen[rest])
    return found


def _joins(sweeps: MotionSweeps, laws: Floats, chosen: Ints) -> Bools:
    """(K,) whether each of ``chosen`` goes on from the one before it, by the same law in nearly the same direction."""
    rows, own = sweeps.rows[chosen], laws[chosen]
    tip, step, axis = (rows[:, at : at + 3] for at in (TIP_POINT, STEP, AXIS))
    joins = np.zeros(len(chosen), bool)
    size = lengths(step)
    joins[1:] = (
        (np.diff(chosen) == 1)
        & (rows[1:, CUTTER] == rows[:-1, CUTTER])
        & (rows[1:, ANGLE] == 0)
        & (rows[:-1, ANGLE] == 0)
        & ((own[1:] == own[:-1]) | np.isnan(own[1:]) & np.isnan(own[:-1])).all(axis=1)
        & (lengths(tip[1:] - tip[:-1] - step[:-1]) < _JOINED)
        & (np.sum(step[1:] * step[:-1], axis=1) >= np.cos(_SAME_WAY) * size[1:] * size[:-1])
        & (np.sum(axis[1:] * axis[:-1], axis=1) >= np.cos(_SAME_WAY))
    )
    return joins
