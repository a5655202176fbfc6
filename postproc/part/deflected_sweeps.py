"""What deflected tools sweep: the sweeps of a program with displaced poses, in parts that are displaced linearly."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import lengths, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.process.stock.displaced import EVEN, displaced_rows
from postproc.process.stock.distance import ANGLE, AXIS, CENTRE, NORMAL, STEP, TIP_POINT, TURN

Displacement = Callable[[Ints, Floats], tuple[Floats, Floats]]
"""Of motions (K,) at the shares (K,) of their paths: shift of the tip (K, 3) [m] and turn of the tool (K, 3) [rad]."""

_HALVINGS = 12
_SHORTEST = 0.02 * MM
_SMALL_ARC = 1.0 * DEG  # of an arc whose ends move otherwise


def deflect(
    rows: Floats, motion: Ints, share: Floats, lever: float, displacement: Displacement
) -> tuple[Floats, Ints, Floats]:
    """The sweeps ``rows`` (M, ROW), of motions ``motion`` (M,) from and to the shares (M, 2) of their paths, with
    displaced tools: rows (K, ROW), whose they are (K,) of the M, shares (K, 2) of the motions.

    lever [m]: how far from the tip a turn of the tool counts.
    """
    owner, part = np.arange(len(rows)), np.broadcast_to([0.0, 1.0], (len(rows), 2)).copy()
    owner, part = _short_arcs(rows, owner, part)
    ends = [_moved(motion, share, owner, part[:, side], displacement) for side in (0, 1)]
    long = lengths(rows[:, STEP : STEP + 3])
    done: list[tuple[Ints, Floats, Floats, Floats]] = []
    for halving in range(_HALVINGS + 1):
        off = np.zeros(len(owner))
        middle = 0.5 * (ends[0] + ends[1])
        for weight in (0.25, 0.5, 0.75):
            here = _moved(motion, share, owner, part @ [1 - weight, weight], displacement)
            middle = here if weight == 0.5 else middle
            deviation = here - (1 - weight) * ends[0] - weight * ends[1]
            off = np.maximum(off, lengths(deviation[:, :3]) + lever * lengths(deviation[:, 3:]))
        width = (part[:, 1] - part[:, 0]) * long[owner]
        split = (off > EVEN) & (width > _SHORTEST) & (halving < _HALVINGS)
        done.append((owner[~split], part[~split], ends[0][~split], ends[1][~split]))
        if not split.any():
            break
        half = part[split].mean(axis=1)
        owner = np.concatenate([owner[split], owner[split]])
        part = np.concatenate(
            [np.column_stack([part[split, 0], half]), np.column_stack([half, part[split, 1]])]
        )
        ends = [
            np.concatenate([ends[0][split], middle[split]]),
            np.concatenate([middle[split], ends[1][split]]),
        ]
    owner, part, first, last = (np.concatenate(values) for values in zip(*done, strict=True))
    order = np.lexsort((part[:, 0], owner))
    owner, part, first, last = owner[order], part[order], first[order], last[order]
    whole = share[owner]
    shares = whole[:, :1] + part * (whole[:, 1:] - whole[:, :1])
    return displaced_rows(rows[owner], part, first, last, lever), owner, shares


def _short_arcs(rows: Floats, owner: Ints, part: Floats) -> tuple[Ints, Floats]:
    """Arcs in parts of ``_SMALL_ARC`` at most: an arc whose ends move otherwise is no longer round."""
    parts = np.maximum(np.ceil(rows[:, ANGLE] / _SMALL_ARC), 1).astype(np.int64)
    owner = np.repeat(owner, parts)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    return owner, np.stack([place, place + 1], axis=1) / parts[owner, None]


def _moved(motion: Ints, share: Floats, owner: Ints, part: Floats, displacement: Displacement) -> Floats:
    """(K, 6) shift and turn at the parts (K,) of the sweeps ``owner`` (K,)."""
    whole = share[owner]
    at = whole[:, 0] + part * (whole[:, 1] - whole[:, 0])
    return np.concatenate(displacement(motion[owner], at), axis=1)


def tips_of(rows: Floats, share: Floats) -> Floats:
    """(K, 3) [m] the tips at the shares (K,) of sweeps ``rows`` (K, ROW)."""
    start, step = rows[:, TIP_POINT : TIP_POINT + 3], rows[:, STEP : STEP + 3]
    tips = start + share[:, None] * step
    arcs = np.flatnonzero(rows[:, ANGLE] > 0)
    if len(arcs):
        normal, centre = rows[arcs, NORMAL : NORMAL + 3], rows[arcs, CENTRE : CENTRE + 3]
        turn = rotation_from_vector((share[arcs] * rows[arcs, ANGLE])[:, None] * normal)
        rise = share[arcs] * np.einsum("ki,ki->k", step[arcs], normal)
        tips[arcs] = centre + (turn @ (start[arcs] - centre)[..., None])[..., 0] + rise[:, None] * normal
    return np.asarray(tips)


def axes_of(rows: Floats, share: Floats) -> Floats:
    """(K, 3) the spindle axes at the shares (K,) of sweeps ``rows`` (K, ROW)."""
    turn = rotation_from_vector(share[:, None] * rows[:, TURN : TURN + 3])
    return np.asarray((turn @ rows[:, AXIS : AXIS + 3, None])[..., 0])
