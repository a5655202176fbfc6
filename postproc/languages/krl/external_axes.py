"""Where the external axes E1..E6 stand: what a target states, and what it leaves as it was."""

from __future__ import annotations

import re

import numpy as np

from postproc.base.arrays import Floats, is_shared
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import External
from postproc.toolpath import COMPUTED, LOST

NAN = float("nan")
UNSTATED: Numbers = (NAN,) * 6
"""Before the first motion that states them."""
ALL_LOST: Numbers = (LOST,) * 6


_AXIS = re.compile(rb"(?<![A-Za-z0-9_$])E([1-6])(?![A-Za-z0-9_$])", re.I)


def stated(words: External) -> Numbers:
    """E1..E6 [mm, deg] of a target: NaN where it leaves an axis out, COMPUTED where its value is no constant."""
    if not words:
        return UNSTATED
    values = [NAN] * 6
    for key, value, _ in words:
        values[key[1] - ord("1")] = COMPUTED if value is None or value != value else value
    return six(values)


def reached(before: Numbers, words: External, relative: bool = False) -> Numbers:
    """Where the axes are after a motion with these words; ``relative``: they say by how much the axes move."""
    if not words:
        return before
    values = list(before)
    for axis, value in enumerate(stated(words)):
        if value == value:
            values[axis] = _moved(values[axis], value) if relative else value
    return six(values)


def _moved(before: float, by: float) -> float:
    """A step from a place that is known; from any other it is where nobody knows, but for a step of zero."""
    if by == 0.0:
        return before
    return before + by if abs(before) < COMPUTED and by < COMPUTED else COMPUTED


def by_themselves(before: Numbers, code: bytes) -> Numbers:
    """Where the axes are after ASYPTP and its like, which send them on a way of their own: nobody knows."""
    named = {int(digit) - 1 for digit in _AXIS.findall(code)} or set(range(6))
    return six([COMPUTED if axis in named else value for axis, value in enumerate(before)])


def apart(before: Numbers) -> Numbers:
    """The same once the controller leaves the axes out of motions ($EX_AX_IGNORE, $ASYNC_AXIS): what was stated so far
    no longer states where they are."""
    return six([COMPUTED if value == value else value for value in before])


def carried_on(before: Numbers, own: Floats | None, left_out_of_motions: bool = False) -> Numbers | Floats:
    """(K, 6) [mm, deg] where the axes are after each of K lines that state ``own`` (K, 6), NaN where left out; one
    row for all where nothing moves.  ``left_out_of_motions``: what they state is not done."""
    if own is None:
        return before
    if left_out_of_motions:
        own = np.where(np.isnan(own), own, COMPUTED)
    left_out = np.isnan(own)
    if is_shared(own):
        return six(np.where(left_out[0], before, own[0]).tolist())
    if not left_out.any():
        return own
    last = np.maximum.accumulate(np.where(left_out, -1, np.arange(len(own))[:, None]), axis=0)
    found = np.take_along_axis(own, np.maximum(last, 0), axis=0)
    return np.where(last < 0, np.array(before), found)


def six(values: list[float]) -> Numbers:
    """Six values as a tuple of that length."""
    a, b, c, d, e, f = values
    return (a, b, c, d, e, f)
