"""The components X, Y, Z, A, B, C of motions in bulk: what the text gives, and what is to be written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, Floats, Ints, differs
from postproc.base.decimals import decimals_of, fixed_one, literals
from postproc.base.document import Document
from postproc.base.geometry import abc_from_rotation, wrapped
from postproc.base.units import DEG, MM
from postproc.languages.core.plan_rows import PlanRows
from postproc.languages.dialect import Plan, Program, WritingSettings
from postproc.languages.krl.lexing import number
from postproc.languages.krl.source_map import KrlSourceMap

KEYS = "XYZABC"
LETTER = np.isin(
    np.arange(256),
    np.frombuffer(b"0123456789_$abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ", np.uint8),
)
"""(256,) the bytes that a name is made of."""


@dataclass(frozen=True, eq=False)
class Components:
    """K motions.  own (K, 6) [mm, deg]: values as the text gives them; decimals (K, 6) that they are written with, or
    are to be.  start, stop (K, 6), file (K, 6): their literals, in the row itself or, where it leaves them out, in the
    row before that gives them; -1 where none says them."""

    own: Floats
    decimals: Ints
    start: NDArray[Any]
    stop: NDArray[Any]
    file: NDArray[Any]

    @property
    def half_step(self) -> Floats:
        """(K, 6) [mm, deg]: what moves by no more stays as it is written."""
        return np.asarray(0.5 * 10.0**-self.decimals)

    def of(self, chosen: Bools) -> Components:
        """Those of the motions ``chosen`` (K,)."""
        return Components(
            self.own[chosen], self.decimals[chosen], self.start[chosen], self.stop[chosen], self.file[chosen]
        )

    def unchanged(self, wanted: Floats) -> Bools:
        """(K, 6) the components that are what is ``wanted`` (K, 6) [mm, deg] already, within half a step."""
        change = wanted - self.own
        change[:, 3:] = (change[:, 3:] + 180.0) % 360.0 - 180.0
        return np.asarray(np.abs(change) <= self.half_step)


class KrlWritePlan(PlanRows):
    """The rows of a program beside a plan, and what the writer looks up in them again and again.

    inserted (N,): how many motions of the plan are before each row's own.
    """

    def __init__(self, program: Program, plan: Plan, writing: WritingSettings) -> None:
        """Raises ValueError where the plan has not one motion with the text of every row."""
        super().__init__(program, plan, writing)
        self.places: KrlSourceMap = program.text
        self.documents: Sequence[Document] = program.documents
        self.raws = [np.frombuffer(document.raw, np.uint8) for document in program.documents]
        self.least = np.array([writing.mm] * 3 + [writing.deg] * 3)
        self.inserted: Ints = np.diff(self.own, prepend=-1) - 1
        self.has_angle = np.zeros(len(self.path), dtype=bool)
        self.has_angle[[row for row, arc in self.places.arcs.items() if arc.has_angle]] = True
        self.is_relative = np.zeros(len(self.path), dtype=bool)
        self.is_relative[list(self.places.relative)] = True

    @cached_property
    def _source_rows(self) -> NDArray[Any] | None:
        """(N, 6) the row whose text gives a component: the row itself, or that which it takes it from; None: always
        the row itself."""
        if not self.places.inherits.any():
            return None
        # A relative motion, and an arc with CA, do not end where the X, Y, Z say that they take over.
        ends_elsewhere = self.is_relative | self.has_angle
        bits = self.places.inherits & np.where(ends_elsewhere, 0b111000, 0b111111).astype(np.uint8)
        if not bits.any():
            return None
        rows = np.arange(len(bits), dtype=np.int32)[:, None]
        left_out = (bits[:, None] >> np.arange(6, dtype=np.uint8)) & 1 == 1
        elsewhere = {
            row: next((source for source in before if 0 <= source < row), row)
            for row, before in sorted(self.path.sequence.predecessors.items())
            if before != (row - 1,) and bits[row]
        }  # fmt: skip
        own = left_out.copy()
        own[list(elsewhere)] = False
        given = np.maximum.accumulate(np.where(own, 0, rows), axis=0)
        if elsewhere:
            # All motions that may precede such a row give the same numbers: those of the first count.
            last = np.broadcast_to(rows, given.shape).copy()
            for row, before in elsewhere.items():
                if before != row:
                    last[row] = np.where(left_out[row], last[given[before], np.arange(6)], row)
            given = last[given, np.arange(6)]
        return given

    @cached_property
    def is_inline(self) -> Bools:
        """(N,) straight and point-to-point motions to an aggregate in their line, absolute."""
        inline = ~self.is_relative
        inline[[*self.places.variables, *self.places.arcs]] = False
        return inline

    @cached_property
    def _aggregates(self) -> tuple[Ints, Ints]:
        """The aggregates that components can be inserted into, in order, and how many rows use each."""
        keys = self.places.insert.astype(np.int64) * len(self.raws) + self.places.home
        return np.unique(keys, return_counts=True)

    def uses_of(self, home: int, insert: int) -> int:
        """How many rows take components from the aggregate with this place of insertion."""
        keys, counts = self._aggregates
        return int(counts[np.searchsorted(keys, insert * len(self.raws) + home)])

    @cached_property
    def _unlike(self) -> frozenset[int]:
        """Where statements start that run several times, and whose literals some of their rows do not have: what these
        rows make of them is not known."""
        words = self.places.motion[:, 0]
        if (words[1:] > words[:-1]).all():
            return frozenset()
        inline = np.ones(len(words), np.bool_)
        inline[list(self.places.variables)] = False
        literals = np.concatenate([words[:, None], self.places.start], axis=1)[inline]
        starts, counts = np.unique(np.unique(literals, axis=0)[:, 0], return_counts=True)
        return frozenset(starts[counts > 1].tolist())

    def runs_unlike(self, row: int) -> bool:
        """Whether the aggregate in the line of a row also serves runs of which nothing is known."""
        return int(self.places.motion[row, 0]) in self._unlike and row not in self.places.variables

    def components(self, rows: Ints) -> Components:
        """What the text says of rows (K,).

        Where no literal states it, the value is that of the toolpath, in the spelling of A, B, C that has the literals
        that there are.
        """
        places, columns = self.places, np.arange(6)
        if self._source_rows is None:
            start, stop, file = places.start[rows], places.stop[rows], places.file[rows]
            start = np.where(self.is_relative[rows, None], -1, start)
        else:
            given = self._source_rows[rows]
            start, stop, file = (part[given, columns] for part in (places.start, places.stop, places.file))
            # The literals of a CA are not the end that others build on.
            start = np.where(self.has_angle[given] & (given != rows[:, None]) & (columns < 3), -1, start)
            start = np.where(self.is_relative[given], -1, start)
        said = start >= 0
        own, decimals = np.zeros(start.shape), np.broadcast_to(self.least, start.shape).copy()
        for index, raw in enumerate(self.raws):
            here = said & (file == index)
            if here.any():
                own[here], written = literals(raw, start[here], stop[here], other_literal)
                decimals[here] = np.maximum(written, decimals[here])
        lacking = np.flatnonzero(~said.all(axis=1))
        if len(lacking):
            where = rows[lacking]
            angles = _spelled(np.nan_to_num(self.path.rotation[where]), own[lacking, 3:], said[lacking, 3:])
            values = np.concatenate([self.path.position[where] / MM, angles], axis=1)
            own[lacking] = np.where(said[lacking], own[lacking], values)
        return Components(own, decimals, start, stop, file)

    def wanted(self, rows: Ints, own: Floats, position: Floats, rotation: Floats) -> Floats:
        """(K, 6) [mm, deg] targets of motions (K,) at ``position`` (K, 3) [m] and ``rotation`` (K, 3, 3) that stem from
        ``rows`` (K,), in the spelling of ``own`` (K, 6)."""
        result = own.copy()
        shifted = differs(position, self.path.position[rows]).any(axis=1) | self.has_angle[rows]
        turned = differs(rotation, self.path.rotation[rows]).any(axis=(1, 2))
        result[shifted, :3] = position[shifted] / MM
        result[turned, 3:] = abc_from_rotation(rotation[turned], own[turned, 3:] * DEG) / DEG
        return result

    def targets(self, rows: Ints) -> tuple[Components, Floats, Bools]:
        """What the text says of rows (K,), what it is to say (K, 6) [mm, deg], and which of that it says already."""
        said, there = self.components(rows), self.own[rows]
        wanted = self.wanted(rows, said.own, self.plan.position[there], self.plan.rotation[there])
        return said, wanted, said.unchanged(wanted)

    def texts(self, components: Components, wanted: Floats, unchanged: Bools, k: int) -> list[bytes]:
        """The six components of the ``k``-th motion of ``wanted`` (K, 6) [mm, deg] as they are to be written: as they
        are, where they stay: ``unchanged`` (K, 6)."""
        return [
            self.documents[components.file[k, i]]
            .raw[int(components.start[k, i]) : int(components.stop[k, i])]
            .lstrip(b"+")
            if unchanged[k, i] and components.start[k, i] >= 0
            else fixed_one(float(wanted[k, i]), int(components.decimals[k, i]))
            for i in range(6)
        ]


def _spelled(rotation: Floats, own: Floats, literal: Bools) -> Floats:
    """(K, 3) [deg] A, B, C of ``rotation`` (K, 3, 3) in the spelling in which those that literals state (``literal``
    (K, 3)) are ``own`` (K, 3) [deg]."""
    one = abc_from_rotation(rotation) / DEG
    # Where B is +-90 only A -+ C is defined: a C that is stated gives A.
    by = np.where(literal[:, 2] & ~literal[:, 0], np.sign(one[:, 1]) * (own[:, 2] - one[:, 2]), 0.0)
    near = np.where(literal, own, one)
    near[:, 0] += by
    one = abc_from_rotation(rotation, np.stack([near[:, 0], one[:, 1], near[:, 2]], axis=1) * DEG) / DEG
    two = np.stack([one[:, 0] + 180.0, 180.0 - one[:, 1], one[:, 2] + 180.0], axis=1)
    off = [np.where(literal, np.abs(wrapped((own - each) * DEG)), 0.0).sum(axis=1) for each in (one, two)]
    return np.where((off[1] < off[0])[:, None], wrapped(two * DEG) / DEG, one)


def other_literal(literal: bytes) -> tuple[float, int]:
    """Value and decimals of a literal in any form."""
    value = number(literal)
    return (0.0 if value is None else value), written_decimals(literal)


def written_decimals(literal: bytes) -> int:
    """The decimals that a literal of KRL is written with: none of a binary or hexadecimal one."""
    return 0 if literal.startswith(b"'") else decimals_of(literal)
