"""Runs of declared targets, and of motions to them, in the form in which posts write them, read together with numpy.

A motion to a declared target is taken so where its name is nowhere else in the file: then nothing assigns it, reads it,
or moves there too.  What is elsewhere is known when the file is at its end; ``NamedReader.elsewhere`` says for which
names it is to be read again without.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Ints
from postproc.base.decimals import literals, other_literal
from postproc.base.document import offset_type
from postproc.languages.rapid.plain_lines import (
    BLANK,
    FEWEST,
    LINE_END,
    MOST,
    MOTION_TAIL,
    MOTION_WORD,
    TARGET,
    WORDS,
    each_number,
    number_places,
)
from postproc.languages.rapid.syntax_tree import Instruction, PlainMotions, PlainPlaces

_NAME = rb"[A-Za-z][A-Za-z0-9_]*+"
_DECLARED = (
    BLANK
    + rb"(?i:(?:(?:LOCAL|TASK)[ \t]++)?(?:CONST|PERS|VAR)[ \t]++robtarget)[ \t]++("
    + _NAME
    + rb")"
    + BLANK
    + rb":="
    + BLANK
    + TARGET
    + BLANK
    + rb";"
    + LINE_END
)
_DECLARATIONS = re.compile(rb"(?:" + _DECLARED + rb"){%d,%d}+" % (FEWEST, MOST))
_DECLARATION = re.compile(_DECLARED)
_MOTION = re.compile(rb"(" + MOTION_WORD + rb")[ \t]++(" + _NAME + rb")(" + MOTION_TAIL + rb")" + LINE_END)
_MOTIONS = re.compile(
    _MOTION.pattern
    + rb"(?:" + BLANK + rb"\1[ \t]++" + _NAME + rb"\3" + LINE_END + rb"){%d,%d}+" % (FEWEST - 1, MOST - 1)
)  # fmt: skip
"""Lines that are alike but for the names of their targets."""
_TARGET_NAME = re.compile(BLANK + MOTION_WORD + rb"[ \t]++(" + _NAME + rb")")
_ANY_NAME = re.compile(_NAME)


@dataclass(frozen=True, slots=True, eq=False)
class _Motions:
    """K lines of motions that are alike.  starts, stops (K,): offsets of the statements and of their ends; names (K,):
    offsets of the targets, and their ends; rows (K,): of the targets, -1 for what is none of the declared ones."""

    starts: Ints
    stops: Ints
    names: Ints
    rows: Ints
    ends: Ints


class NamesElsewhere(NamedTuple):
    """Names that are not taken in runs: ``used``: of motions, as they are there otherwise too; ``declared``: of
    declarations, as they are there several times."""

    used: frozenset[bytes] = frozenset()
    declared: frozenset[bytes] = frozenset()

    def __or__(self, other: NamesElsewhere) -> NamesElsewhere:
        return NamesElsewhere(self.used | other.used, self.declared | other.declared)


class DeclaredTargets:
    """N declared targets: values (N, 7): x, y, z [mm], q1..q4; spots, stops (N, 7): offsets of their literals; extras
    (U, 10), which (N,): configurations and external axes; starts: name -> offset of its declaration."""

    def __init__(self) -> None:
        self.starts: dict[bytes, int] = {}
        self.rows: dict[bytes, int] = {}
        self._parts: list[tuple[NDArray[Any], ...]] = []
        self._whole: tuple[NDArray[Any], ...] | None = None
        self._extras: dict[bytes, int] = {}

    def add(self, names: list[bytes], starts: list[int], *columns: NDArray[Any]) -> None:
        """Takes up K targets; ``columns``: as of ``columns``, (K, 7), (K, 7), (K, 7), (K,)."""
        at = len(self.rows)
        self.rows.update(zip(names, range(at, at + len(names)), strict=True))
        self.starts.update(zip(names, starts, strict=True))
        self._parts.append(columns)
        self._whole = None

    def number_of(self, rest: bytes) -> int:
        """The row of ``extras`` of a text."""
        return self._extras.setdefault(rest, len(self._extras))

    def columns(self) -> tuple[NDArray[Any], ...]:
        """values (N, 7), spots (N, 7), stops (N, 7), which (N,) of all targets."""
        if self._whole is None:
            self._whole = tuple(np.concatenate(column) for column in zip(*self._parts, strict=True))
            self._parts = [self._whole]
        return self._whole

    def extras(self) -> NDArray[Any]:
        """(U, 10)."""
        return np.array([each_number(rest) for rest in self._extras])


class NamedReader:
    """Finds the runs of a text."""

    def __init__(self, raw: bytes, without: NamesElsewhere) -> None:
        self.targets = DeclaredTargets()
        self._raw, self._without = raw, without
        self._passed = 0
        self._block: _Motions | None = None
        self._spans: list[tuple[int, int]] = []  # of what was taken
        self._used: set[bytes] = set()
        self._repeated: set[bytes] = set()
        self._twice: set[bytes] = set()

    def declared(self, start: int) -> int:
        """The end of the run of declarations that starts at a byte, which are taken up; -1 where there is none."""
        raw = self._raw
        if start < self._passed or _DECLARATION.match(raw, start) is None:
            return -1
        found = _DECLARATIONS.match(raw, start)
        if found is None:
            return -1
        end = found.end()
        text = np.frombuffer(raw, np.uint8, end - start, start)
        begins = np.concatenate([[0], np.flatnonzero(text == 0x0A)[:-1] + 1])
        declared = (_DECLARATION.match(raw, at) for at in (begins + start).tolist())
        names = [each[1].upper() for each in declared if each is not None]
        brackets = np.flatnonzero(text == 0x5B)
        spots, stops = number_places(text, brackets[np.searchsorted(brackets, begins)])
        values, _ = literals(text, spots.ravel(), stops.ravel(), other_literal)
        semicolons = np.flatnonzero(text == 0x3B)
        ends = semicolons[np.searchsorted(semicolons, begins)] + start
        rests = [raw[a:b] for a, b in zip((stops[:, -1] + start).tolist(), ends.tolist(), strict=True)]
        known = len(set(names)) == len(names) and self.targets.rows.keys().isdisjoint(names)
        if not (known and self._without.declared.isdisjoint(names) and np.isfinite(values).all()):
            self._repeated |= self.targets.rows.keys() & set(names)
            self._passed = end
            return -1
        if not all(np.isfinite(each_number(rest)).all() for rest in dict.fromkeys(rests)):
            self._passed = end
            return -1
        which = np.fromiter(map(self.targets.number_of, rests), np.int32, len(rests))
        kind = offset_type(len(raw))
        self.targets.add(
            names,
            (begins + start).tolist(),
            values.reshape(spots.shape),
            (spots + start).astype(kind),
            (stops + start).astype(kind),
            which,
        )
        self._spans.append((start, end))
        return end

    def run(self, first: Instruction) -> PlainMotions | None:
        """The run that starts with the statement ``first``; None where there is none."""
        start = first.start
        if first.name not in WORDS or not self.targets.rows:
            return None
        block = self._block
        if block is None or not block.starts[0] <= start <= block.starts[-1]:
            block = self._block = self._lines(first)
        if block is None:
            return None
        at = int(np.searchsorted(block.starts, start))
        if block.starts[at] != start or block.stops[at] != first.stop:
            return None
        unknown = np.flatnonzero(block.rows[at:] < 0)
        count = int(unknown[0]) if len(unknown) else len(block.starts) - at
        return None if count < FEWEST else self._run(first, block, slice(at, at + count))

    def _lines(self, first: Instruction) -> _Motions | None:
        """The lines that are like the one of ``first``, from it on."""
        raw, start = self._raw, first.start
        head = max(raw.rfind(b"\n", 0, start), raw.rfind(b"\r", 0, start)) + 1
        if raw[head:start].strip(b" \t") or _MOTION.match(raw, start) is None:
            return None
        found = _MOTIONS.match(raw, start)
        if found is None or found.end(3) != first.stop:
            return None
        end = found.end()
        text = np.frombuffer(raw, np.uint8, end - start, start)
        begins = np.concatenate([[0], np.flatnonzero(text == 0x0A)[:-1] + 1])
        ends = np.append(begins[1:], len(text)) + start
        semicolons = np.flatnonzero(text == 0x3B)
        stops = semicolons[np.searchsorted(semicolons, begins)] + 1 + start
        while (blank := text[begins] <= 0x20).any():
            begins += blank
        names, rows = [], []
        for at in (begins + start).tolist():
            name = _TARGET_NAME.match(raw, at)
            names.append(-1 if name is None else name.start(1))
            rows.append(-1 if name is None else self._row(name[1].upper()))
        return _Motions(begins + start, stops, np.array(names), np.array(rows), np.array(ends))

    def _row(self, name: bytes) -> int:
        return -1 if name in self._without.used else self.targets.rows.get(name, -1)

    def _run(self, first: Instruction, block: _Motions, these: slice) -> PlainMotions:
        raw = self._raw
        starts, stops, rows = block.starts[these], block.stops[these], block.rows[these]
        names = block.names[these]
        tail = first.stop - (names[0] + len(_ANY_NAME.match(raw, names[0])[0]))  # type: ignore[index]
        targets = stops - tail
        for a, b in zip(names.tolist(), targets.tolist(), strict=True):
            name = raw[a:b].strip().upper()
            (self._twice if name in self._used else self._used).add(name)
        values, spots, spot_stops, which = (column[rows] for column in self.targets.columns())
        kinds, of_kind = np.unique(which, return_inverse=True)
        end = int(block.ends[these.stop - 1])
        self._spans.append((int(starts[0]), end))
        offset = offset_type(len(raw))
        places = PlainPlaces(
            starts=starts.astype(offset),
            targets=(targets - starts).astype(np.int32),
            stops=(stops - starts).astype(np.int32),
            literals=(spots - starts[:, None]).astype(offset),
            literal_stops=(spot_stops - starts[:, None]).astype(offset),
            named=True,
        )
        return PlainMotions(
            first, places, values, self.targets.extras()[kinds], of_kind.astype(np.int32), end
        )

    def elsewhere(self, declared: set[bytes]) -> NamesElsewhere:
        """Names that were taken and are in the file once more; ``declared``: those of other declarations."""
        found = set(self._twice)
        at = 0
        for start, stop in [*self._spans, (len(self._raw), len(self._raw))] if self._used else ():
            rest = {name.upper() for name in _ANY_NAME.findall(self._raw, at, start)}
            found |= rest & self._used
            at = stop
        again = self._repeated | (declared & self.targets.starts.keys())
        return NamesElsewhere(frozenset(found), frozenset(again))
