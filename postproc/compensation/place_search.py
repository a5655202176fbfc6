"""The places of a path to which tools belong, between two each of which one is before and one after it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.compensation.brackets import Brackets

ROUNDS = 30
"""Steps at most between two places."""


class PlacesBeside:
    """The last places before and after the nearest one of S tools, and how far each tool is ahead of them, along the
    path: row and share on a path whose rows have the lengths (N,) [m]."""

    def __init__(self, count: int) -> None:
        self._known = np.full((2, 3, count), np.nan)

    def put(self, tools: Ints, row: Ints, share: Floats, ahead: Floats) -> None:
        """Notes that ``tools`` (K,) are ``ahead`` (K,) [m] of the shares (K,) of rows (K,); NaN is passed over."""
        for side, here in ((0, ahead >= 0), (1, ahead < 0)):
            self._known[side][:, tools[here]] = np.stack([row[here], share[here], ahead[here]])

    def search(
        self,
        tools: Ints,
        length: Floats,
        row: Ints,
        share: Floats,
        ahead: Callable[[Ints], Floats],
        settled: float,
    ) -> None:
        """Puts those of ``tools`` (K,) of which both are known at the places where they are not ``ahead``, to within
        ``settled`` [m]: sets their ``row`` (S,) and ``share`` (S,) and asks ``ahead`` for theirs (K,) [m] there."""
        tools = tools[np.isfinite(self._known[:, 2, tools]).all(axis=0)]
        if not len(tools):
            return
        rows = self._known[:, 0, tools].astype(np.int64)
        first, last = int(rows.min()), int(rows.max())
        rows -= first
        length = length[first : last + 1]
        begins = np.cumsum(np.append(0.0, length))
        low, high = begins[rows] + self._known[:, 1, tools] * length[rows]
        below, above = -self._known[:, 2, tools]
        brackets, active = Brackets(low, high, below, above), np.flatnonzero(low < high)
        asked, gaps = np.full((2, len(tools)), np.nan), np.full(len(tools), np.nan)
        for _ in range(ROUNDS):
            if not len(active):
                return
            at = brackets.secants(active)
            part = np.clip(np.searchsorted(begins, at, "right") - 1, 0, len(length) - 1)
            along = np.clip((at - begins[part]) / np.maximum(length[part], settled), 0.0, 1.0)
            # beside a leap the ends come together, and what is to be asked for is the same place again
            new = (np.stack((part, along)) != asked[:, active]).any(axis=0)
            some = active[new]
            if len(some):
                asked[:, some] = part[new], along[new]
                row[tools[some]], share[tools[some]] = first + part[new], along[new]
                gaps[some] = ahead(tools[some])
            gap = gaps[active]
            brackets.narrow(active, at, -gap)
            going: Bools = np.abs(gap) > settled
            active = active[going]
