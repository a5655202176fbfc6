"""Around which samples of an error it may be larger in between."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints

NEARLY, SUMMITS = 0.8, 4
"""Share of the largest sample that another summit has at least, and how many there are at most."""


def summits(sizes: Floats) -> tuple[Ints, Ints]:
    """Where errors may be largest between their samples.

    ``sizes`` (K, S) [m or rad]: samples in the order of a path, one path a row.  Returns the rows (P,) and the places
    in them (P,), ascending by row: the largest of each, and others that are no smaller than those beside them and than
    ``NEARLY`` of it, ``SUMMITS`` at most.
    """
    beside = np.pad(sizes, ((0, 0), (1, 1)), constant_values=-np.inf)
    summit = (sizes >= beside[:, :-2]) & (sizes > beside[:, 2:])
    largest = sizes.max(axis=1, keepdims=True)
    height = np.where(summit & (sizes >= NEARLY * largest), sizes, -np.inf)
    np.put_along_axis(height, sizes.argmax(axis=1)[:, None], np.inf, axis=1)
    order = np.argsort(-height, axis=1, kind="stable")[:, :SUMMITS]
    row, number = np.nonzero(np.take_along_axis(height, order, axis=1) > -np.inf)
    return row, order[row, number]
