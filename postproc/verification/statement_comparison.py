"""What two programs state beside the places of their motions: every statement of one is one of the other, in order.

Motions may be inserted before others of the same cut, with words of these.  The statements are compared from the last
to the first, as what is inserted precedes what it belongs to; where they differ, a few of each are passed over until
they are the same again.  Motions with the same words are one as good as the other here: which of them a statement
follows is seen from their places (``motion_ends``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from postproc.base.arrays import Ints
from postproc.verification.stated_texts import MOTION, NONE, StatementForm, Statements

WINDOW = 40
"""Statements that are passed over, at most, to where two programs state the same again."""

INSERTED = 1000
"""Inserted motions that are passed over there."""

MOST = 500
"""Differences after which all that precedes counts as one."""


class StatementChange(Enum):
    """How a statement differs."""

    OTHER = "other"
    ADDED = "added"
    MISSING = "missing"
    ELSEWHERE = "elsewhere"  # the same, after another motion


@dataclass(frozen=True)
class StatementDifference:
    """A statement that differs: its number in the original and in the second program, -1 where it is in one alone."""

    change: StatementChange
    one: int
    two: int


@dataclass(frozen=True, eq=False)
class ComparedStatements:
    """differences: from the first to the last; same (K, 2): numbers of the other statements but motions in the original
    and in the second program."""

    differences: list[StatementDifference]
    same: Ints


def compare_statements(
    original: Statements, other: Statements, form: StatementForm, new_points: frozenset[bytes]
) -> ComparedStatements:
    """The statements of ``other`` beside those of ``original``.

    ``new_points``: points that the second program alone declares, for its motions.
    """
    comparison = _Comparison(original, other, form, new_points)
    differences = comparison.differences()
    return ComparedStatements(differences, np.array(comparison.same, np.int64).reshape(-1, 2)[::-1])


def new_points(original: Sequence[Statements], other: Sequence[Statements]) -> frozenset[bytes]:
    """Points that motions of ``other`` lead to and that ``original`` does not declare."""
    there = {name for one in original for name in one.points.values()}
    used = {name for one in other for names in one.operands.values() for name in names}
    used -= {name for one in original for names in one.operands.values() for name in names}
    return frozenset({name for one in other for name in one.points.values()} & used - there)


class _Comparison:
    def __init__(
        self, original: Statements, other: Statements, form: StatementForm, points: frozenset[bytes]
    ) -> None:
        self.original, self.other, self.form, self.points = original, other, form, points
        self.same: list[tuple[int, int]] = []
        self._insertable: dict[tuple[bytes, bytes, bytes], bool] = {}

    def differences(self) -> list[StatementDifference]:
        one, two = self.original.texts, self.other.texts
        found: list[StatementDifference] = []
        i, j = len(one) - 1, len(two) - 1
        source, header, may = -1, b"", False  # the motion that others may be inserted before, its block
        while i >= 0 or j >= 0:
            if i >= 0 and j >= 0 and self._same(i, j):
                text = one[i]
                if text.startswith(MOTION):
                    source, header, may = i, b"", True
                else:
                    header, may = text, self.form.opens_block(text)
                    self.same.append((i, j))
                i, j = i - 1, j - 1
            elif j >= 0 and (self._is_new_point(j) or (may and self._is_inserted(j, source, header))):
                j -= 1
            else:
                passed, added = self._passed(i, j, source if may else -1, header, len(found))
                found += self._changes(i, passed, j, added)
                for at in range(i, i - passed, -1):
                    if one[at].startswith(MOTION):
                        source, header, may = at, b"", True
                        break
                i, j = i - passed, j - added
        return found[::-1]

    def _same(self, i: int, j: int) -> bool:
        """Whether a statement of the original is that of the second program; its points may be other ones in numbers,
        or new ones."""
        if self.original.texts[i] != self.other.texts[j]:
            return False
        if j not in self.other.operands:
            return True
        return self.other.operands[j] <= self.original.operands.get(i, NONE) | self.points

    def _is_new_point(self, j: int) -> bool:
        """Whether a statement of the second program declares a point that the original does not have."""
        return self.other.points.get(j) in self.points

    def _is_inserted(self, j: int, before: int, header: bytes) -> bool:
        """Whether a statement of the second program is a motion that may be inserted before one of the original; or
        that one, where what is inserted before it was taken for it."""
        text = self.other.texts[j]
        if before < 0 or not text.startswith(MOTION):
            return False
        operands = self.other.operands.get(j, NONE)
        if operands and not operands <= self.original.operands.get(before, NONE) | self.points:
            return False
        source = self.original.texts[before]
        key = text, source, header
        known = self._insertable.get(key)
        if known is None:
            words, form = self.form.words(text[1:]), self.form
            may = form.words(source[1:]) | form.flowing | (form.words(header) if header else NONE)
            known = self._insertable[key] = words <= may and form.insertable(words)
        return known

    def _passed(self, i: int, j: int, source: int, header: bytes, differences: int) -> tuple[int, int]:
        """How many statements of each, before numbers ``i`` and ``j``, are passed over: the fewest after which some are
        the same again; one of each where two motions differ."""
        if i < 0 or j < 0:
            return i + 1, j + 1
        one, two = self.original.texts, self.other.texts
        if one[i].startswith(MOTION) and two[j].startswith(MOTION) and self._again(i - 1, j - 1):
            return 1, 1
        for count in range(1, WINDOW + 1 if differences < MOST else 0):
            if source >= 0 and self._again_after_inserted(i, j - count, source, header):
                return 0, count
            for passed in range(count + 1):
                if self._again(i - passed, j - count + passed):
                    return passed, count - passed
        start, end = 0, min(i, j)
        while start < end and self._same(start, start):
            start += 1
        return i + 1 - start, j + 1 - start

    def _again_after_inserted(self, i: int, j: int, source: int, header: bytes) -> bool:
        """Whether motions inserted before ``source`` end at number ``j``, before which both go on alike."""
        first = j
        while j >= 0 and first - j < INSERTED and self._is_inserted(j, source, header):
            j -= 1
        return j < first and self._again(i, j)

    def _again(self, i: int, j: int) -> bool:
        """Whether both go on alike from these numbers, towards their starts."""
        if i < -1 or j < -1:
            return False
        if i < 0 or j < 0:
            return i == j
        return self._same(i, j) and (i == 0 or j == 0 or self._same(i - 1, j - 1))

    def _changes(self, i: int, passed: int, j: int, added: int) -> list[StatementDifference]:
        both = min(passed, added)
        changes = [StatementDifference(StatementChange.OTHER, i - k, j - k) for k in range(both)]
        changes += [StatementDifference(StatementChange.MISSING, i - k, -1) for k in range(both, passed)]
        changes += [StatementDifference(StatementChange.ADDED, -1, j - k) for k in range(both, added)]
        return changes
