"""Short motions that go on from each other: their contacts are looked at as closely as those of a long motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.geometry import lengths
from postproc.base.units import DEG
from postproc.process.stock.contact import FORCE, RATE
from postproc.process.stock.distance import ANGLE, AXIS, CUTTER, STEP, TIP_POINT
from postproc.process.stock.motion_sweeps import MotionSweeps

_TREND = 0.2
"""Where the removed area changes by more than this share over two spacings, every motion is looked at."""

_JOINED, _SAME_WAY = 1e-9, 2 * DEG  # m, and of feed and spindle from one motion to the next


def chain_contacts(
    sweeps: MotionSweeps, laws: Floats, chosen: Ints, spacing: Floats, even: float,
    look: Callable[[Ints], Floats],
) -> Floats:  # fmt: skip
    """The contacts (K, C) in the middles of the sweeps ``chosen`` (K,), none longer than its ``spacing`` (M,) [m].

    Within a chain they are looked at a spacing apart.  Those between two are interpolated where both cut and are within
    the share ``even`` of the line through those beside them, in removed area and force; all others are looked at too.
    laws (M, 9): as of ``find_contact``; look: contacts of sweeps.
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
    steady = _steady(along[seen], contacts, first_of_chain[seen], even)
    between = ~known & steady[place] & steady[after]
    found = np.empty((len(chosen), contacts.shape[1]))
    found[seen] = contacts
    at = np.flatnonzero(between)
    one, two = seen[place[at]], seen[after[at]]
    share = ((along[at] - along[one]) / (along[two] - along[one]))[:, None]
    found[at] = (1 - share) * contacts[place[at]] + share * contacts[after[at]]
    rest = np.flatnonzero(~known & ~between)
    found[rest] = look(chosen[rest])
    return found


def _steady(along: Floats, contacts: Floats, first: Bools, even: float) -> Bools:
    """(K,) whether contacts (K, C) at the places ``along`` (K,) [m] of their chains, of which those start ones that are
    ``first``, lie on lines: a bend within which a line is ``even`` off at its middle node is a quarter of it off in
    between.  A step, and a dip that begins, are on no line."""
    steady = np.zeros(len(along), bool)
    if len(along) < 3:
        return steady
    inner = ~(first[1:-1] | first[2:])
    share = (along[1:-1] - along[:-2]) / np.where(inner, along[2:] - along[:-2], 1.0)
    rate, force = contacts[:, RATE], contacts[:, FORCE : FORCE + 3]
    most = np.maximum(np.maximum(rate[:-2], rate[1:-1]), rate[2:])
    least = np.minimum(np.minimum(rate[:-2], rate[1:-1]), rate[2:])
    off = np.abs((1 - share) * rate[:-2] + share * rate[2:] - rate[1:-1])
    line = (1 - share)[:, None] * force[:-2] + share[:, None] * force[2:]
    # of a tool without teeth or material no force is known
    bent = np.nan_to_num(lengths(line - force[1:-1]))
    size = np.nan_to_num(lengths(force[1:-1]))
    alike = (least > 0) & (most - least <= _TREND * most)
    steady[1:-1] = inner & alike & (off <= even * most) & (bent <= even * size)
    return steady


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
