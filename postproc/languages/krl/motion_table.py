"""The motions that were found as arrays: what they are, and where their numbers stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Floats
from postproc.base.batches import each_block
from postproc.base.document import offset_type
from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.languages.krl.external_axes import UNSTATED, six
from postproc.languages.krl.motion_rows import NAN, NAN6, NO_ARC, MotionRow, MotionRows, VectorisedLot
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import KrlTarget
from postproc.languages.krl.vectorised import VectorisedLines
from postproc.toolpath import Kind

BLOCK = 1 << 14
"""Rows whose entries are brought into columns together."""
NOTHING = KrlTarget((None,) * 6)
"""Of a motion without a readable target."""


def _columns(entry: type[tuple[Any, ...]], rows: Sequence[Any]) -> Any:
    """The entries of named tuples as one of columns."""
    return entry(*zip(*rows, strict=True))


class Spots:
    """Where the numbers of all rows are: the columns of ``Places``."""

    def __init__(self, n: int, size: int) -> None:
        offsets = offset_type(size)
        self.start, self.stop = np.empty((n, 6), offsets), np.empty((n, 6), offsets)
        self.motion = np.empty((n, 4), offsets)
        self.insert = np.empty(n, offsets)
        self.file, self.home = np.zeros((n, 6), np.int8), np.zeros(n, np.int8)
        self.inherits = np.zeros(n, np.uint8)
        self.text = np.arange(n, dtype=np.int32)
        self._first: dict[int, int] = {}

    def first_of(self, part: slice, vectorised: VectorisedLines) -> int:
        """The number of the first text of common lines; where they run again they keep the numbers of their texts."""
        return self._first.setdefault(id(vectorised), part.start)

    def take_bulk(self, part: slice, first: int, vectorised: VectorisedLines) -> None:
        """Common lines; ``first``: of ``first_of``."""
        self.start[part], self.stop[part], self.motion[part] = (
            vectorised.start,
            vectorised.stop,
            vectorised.motion,
        )
        self.insert[part] = vectorised.stop[:, 5]
        self.text[part] = np.arange(first, first + len(vectorised))

    def take(self, part: slice, rows: list[MotionRow]) -> None:
        """Rows that were read alone."""
        columns = _columns(MotionRow, rows)
        targets = _columns(KrlTarget, [target or NOTHING for target in columns.target])
        self.motion[part] = columns.motion
        self.inherits[part] = columns.inherits
        self.start[part], self.stop[part], self.file[part] = targets.start, targets.stop, targets.file
        self.insert[part], self.home[part] = targets.insert, targets.home


class _Groups:
    """Runs of common lines, with the rows and the number of the first text of each, in groups of ``BLOCK`` rows."""

    def __init__(self) -> None:
        self.groups: list[list[tuple[slice, int, VectorisedLot]]] = []
        self._rows = BLOCK

    def add(self, part: slice, first: int, lot: VectorisedLot) -> None:
        if self._rows >= BLOCK:
            self.groups.append([])
            self._rows = 0
        self.groups[-1].append((part, first, lot))
        self._rows += part.stop - part.start


def _first(rows: MotionRows) -> Numbers:
    """E1..E6 of the first motion."""
    if not rows.chunks:
        return UNSTATED
    chunk = rows.chunks[0]
    if isinstance(chunk, list):
        return chunk[0].external
    return chunk.external if isinstance(chunk.external, tuple) else six(chunk.external[0].tolist())


class MotionTable:
    """The entries of all rows as arrays, which takes the rows' own away; rare lengths and angles are in mm and deg.

    ``word``: offset of the motion's word; ``scalar``: numbers of the rows that were read alone; ``spots``: None where
    the places are not wanted.
    """

    def __init__(self, rows: MotionRows, places: bool) -> None:
        n, size = len(rows), len(rows.document.raw)
        self.position: Floats = np.empty((n, 3))
        self.rotation: Floats = np.empty((n, 3, 3))
        self.kind = np.empty(n, np.int8)
        self.line = np.empty(n, np.int32)
        self.status, self.turn = (np.broadcast_to(np.int32(-1), n) for _ in range(2))
        self.base, self.tool = np.empty(n, np.int32), np.empty(n, np.int32)
        self.feed, self.blend, self.inserted = np.empty(n), np.empty(n), np.empty(n)
        self.word = np.empty(n, offset_type(size))
        self.orientation, self.arc_frame = np.zeros(n, np.int8), np.zeros(n, np.int8)
        self.spots = Spots(n, size) if places else None
        self.axes: dict[int, Numbers] = {}
        self.ways: dict[int, tuple[float, ...]] = {}
        self.scalar_rows: list[tuple[int, MotionRow]] = []
        self.external: Floats = np.broadcast_to(np.array(_first(rows)), (n, 6))
        at, bulk = 0, _Groups()
        rows.chunks.reverse()
        while rows.chunks:
            chunk = rows.chunks.pop()
            if isinstance(chunk, list):
                for first in range(0, len(chunk), BLOCK):  # columns of all of them take much memory
                    self._fill(at + first, chunk[first : first + BLOCK])
                at += len(chunk)
                continue
            part = slice(at, at + len(chunk.vectorised))
            self._state(part, chunk.vectorised.status, chunk.vectorised.turn)
            self._external(part, np.array(chunk.external))
            bulk.add(part, 0 if self.spots is None else self.spots.first_of(part, chunk.vectorised), chunk)
            at = part.stop
        each_block(lambda group: self._take_bulk(bulk.groups[group.start]), len(bulk.groups), 1)
        for row, blend in rows.approximated.items():
            self.blend[row] = blend

    def _take_bulk(self, group: list[tuple[slice, int, VectorisedLot]]) -> None:
        """The rows of runs of common lines, which are taken away."""
        group.reverse()
        while group:
            part, first, lot = group.pop()
            vectorised = lot.vectorised
            self._place(part, vectorised.values)
            self.kind[part] = np.where(vectorised.is_line, Kind.LIN, Kind.PTP)
            self.line[part] = vectorised.line + np.arange(len(vectorised))
            self.base[part], self.tool[part] = lot.base, lot.tool
            self.feed[part] = np.where(vectorised.is_line, lot.feed, NAN)
            self.blend[part] = np.array([0.0, lot.blend, NAN])[vectorised.approximation]
            self.inserted[part] = lot.blend
            self.word[part] = vectorised.motion[:, 0]
            self.orientation[part], self.arc_frame[part] = lot.orientation, lot.arc_frame
            if self.spots is not None:
                self.spots.take_bulk(part, first, vectorised)

    def _state(self, part: slice, status: NDArray[np.int32], turn: NDArray[np.int32]) -> None:
        """S and T; where no motion has them they take no memory."""
        if not self.status.flags.writeable:
            if (status < 0).all() and (turn < 0).all():
                return
            self.status, self.turn = self.status.copy(), self.turn.copy()
        self.status[part], self.turn[part] = status, turn

    def _external(self, part: slice, values: Floats) -> None:
        """E1..E6 of some rows, (6,) or (K, 6); where all rows have the same they take no memory."""
        if not self.external.flags.writeable:
            first = self.external[0]
            if ((values == first) | (np.isnan(values) & np.isnan(first))).all():
                return
            self.external = self.external.copy()
        self.external[part] = values

    def _place(self, part: slice, values: Floats) -> None:
        self.position[part] = values[:, :3] * MM
        angles = values[:, 3:]
        bits = angles.view(np.int64)  # a zero may have a sign
        same = len(bits) > 1 and bool((bits == bits[0]).all())
        self.rotation[part] = rotation_from_abc((angles[:1] if same else angles) * DEG)

    def _fill(self, at: int, rows: list[MotionRow]) -> None:
        part = slice(at, at + len(rows))
        self.scalar_rows += zip(range(at, at + len(rows)), rows, strict=True)
        columns = _columns(MotionRow, rows)
        self._place(part, np.array(columns.values))
        states = [(-1, -1) if t is None else (t.status, t.turn) for t in columns.target]
        self._state(part, *np.array(states, np.int32).T)
        self._external(part, np.array(columns.external))
        for array, column in (
            (self.kind, columns.kind), (self.line, columns.line), (self.base, columns.base),
            (self.tool, columns.tool), (self.feed, columns.feed), (self.blend, columns.blend),
            (self.orientation, columns.orientation), (self.arc_frame, columns.arc_frame),
            (self.inserted, columns.inserted),
        ):  # fmt: skip
            array[part] = column
        self.word[part] = [places[0] for places in columns.motion]
        if self.spots is not None:
            self.spots.take(part, rows)
        for i, row in enumerate(rows):
            if row.axes is not NAN6:
                self.axes[at + i] = row.axes
            if row.path is not NO_ARC:
                self.ways[at + i] = row.path
