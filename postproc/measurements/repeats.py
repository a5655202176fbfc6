"""Rows that repeat one state: what differs between them is noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.tables import is_missing
from postproc.base.units import DEG, MM
from postproc.measurements.readings import Readings, alike, numbered

SAME_ANGLE, SAME_WAY, SAME_LOAD, SAME_SHARE = 0.1 * DEG, 1.0 * MM, 10.0, 0.1
"""[rad], [m], [N, N m] and share of the load that rows of one REPEAT id may differ by, as a new command and a new
hanging of the same weight do."""


def with_repeats(readings: Readings, ids: Sequence[str]) -> Readings:
    """With the numbers of repeated states: by their REPEAT ``ids`` (R,), or of rows with equal values where no id is
    given.  An id of several states is reported (MEA007)."""
    one = readings
    given = np.array([not is_missing(text) for text in ids], bool)
    if not given.any():
        same = alike(one.q, one.wrench, one.target, one.session, one.direction, one.temperature)
        return replace(one, repeat=same)
    alone = -1 - np.arange(len(one))
    id = np.where(given, numbered(ids)[1], alone)
    repeat = alike(one.session, one.target, id)
    first = _first(repeat)
    other = _differ(one, first) & (repeat >= 0)
    if not other.any():
        return replace(one, repeat=repeat)
    row = int(np.argmax(other))
    message = (
        f"column REPEAT: {ids[row]!r} has other joint angles or loads in line {one.line[first[row]]};"
        " only rows of this id that agree count as repeats"
    )
    finding = Finding("MEA007", message, *one.where(row))
    state = alike(one.q, one.wrench)
    state = np.where(state < 0, alone, state)
    mixed = np.isin(repeat, repeat[other])
    repeat = alike(one.session, one.target, id, np.where(mixed, state, 0))
    return replace(one, repeat=repeat, findings=(*one.findings, finding))


def _first(group: Ints) -> Ints:
    """(R,) the first row with the same number."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return np.asarray(first[inverse.reshape(-1)])


def _differ(readings: Readings, other: Ints) -> Bools:
    """(R,) whether a row is of another state than the row ``other`` (R,)."""
    q, wrench = readings.q, readings.wrench
    allowed: Floats = np.array([SAME_WAY if slides else SAME_ANGLE for _, slides in readings.joints])
    moved = (np.abs(q - q[other]) > allowed).any(axis=1)
    change = np.abs(wrench - wrench[other]).reshape(-1, 2, 3).max(axis=2)
    size = np.abs(wrench[other]).reshape(-1, 2, 3).max(axis=2)
    return np.asarray(moved | (change > SAME_LOAD + SAME_SHARE * size).any(axis=1))
