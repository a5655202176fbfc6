"""The numbers of targets, and where they are in the text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.base.arrays import Bools, FewRows, Floats, Ints
from postproc.base.decimals import literals, other_literal
from postproc.languages.rapid.motion_facts import is_direct, item_of
from postproc.languages.rapid.plain_lines import each_number
from postproc.languages.rapid.syntax_tree import Aggregate, Argument, Index, Name, PlainPlaces
from postproc.languages.rapid.values import Leaf, Value, numbers_of

NUMBERS = 7
"""Of a target that can be corrected: x, y, z and q1 to q4."""
NOWHERE = ((-1, -1),) * NUMBERS
_LIST = re.compile(rb"\[[^\[\]]*+\]")
_LAST_NAME = re.compile(rb"(?<![A-Za-z0-9_])[A-Za-z0-9_]++(?=[ \t]*+\Z)")
_COMMENT = re.compile(rb"(\"[^\"\r\n]*+\")|![^\r\n]*+")
_EDITABLE = re.compile(rb"[-+]?[ \t]*[0-9.]")


@dataclass(frozen=True, slots=True)
class PointText:
    """A point of a motion.  spots: start and stop of the literals of x, y, z, q1..q4, -1 where there is none; operand:
    the bytes of the argument; ``words``: its configuration and external axes as text, b"" where they are not known;
    ``name``: of the variable that holds it, b"" without one; ``inline``: its literals are in the argument."""

    spots: tuple[tuple[int, int], ...]
    operand: tuple[int, int]
    words: bytes
    name: bytes
    inline: bool


@dataclass(frozen=True, slots=True)
class MotionText:
    """A motion statement: start, stop: its bytes; ``tail``: speed to the end as an inserted motion has them, without
    the zone; ``zone``: its text; ``alone``: nothing but blanks is before it in its line."""

    start: int
    stop: int
    speed: bytes
    zone: bytes
    tool: bytes
    alone: bool
    target: PointText | None
    via: PointText | None


class MotionTexts:
    """The texts of N motions; those of runs of common lines are made where they are asked for.

    texts, runs: of each fact; first (M + 1,), fact_of (N,): as in ``ModuleRows``.
    """

    def __init__(
        self,
        raw: bytes,
        texts: list[MotionText | None],
        runs: list[PlainPlaces | None],
        first: Ints,
        fact_of: Ints,
    ) -> None:
        self._raw, self._texts, self._runs, self._first, self._fact_of = raw, texts, runs, first, fact_of
        self._uses: dict[int, int] = {}
        for text, run in zip(texts, runs, strict=True):
            for point in () if text is None or run is not None else (text.target, text.via):
                for start, _ in () if point is None else point.spots:
                    if start >= 0:
                        self._uses[start] = self._uses.get(start, 0) + 1

    def __getitem__(self, row: int) -> MotionText | None:
        """That of a motion; None where it is not understood."""
        at = int(self._fact_of[row])
        text, run = self._texts[at], self._runs[at]
        if text is None or run is None:
            return text
        raw, place = self._raw, row - int(self._first[at])
        start = int(run.starts[place])
        target, stop = start + int(run.targets[place]), start + int(run.stops[place])
        ends = zip(run.literals[place].tolist(), run.literal_stops[place].tolist(), strict=True)
        spots = tuple((start + one, start + other) for one, other in ends)
        if run.named:
            point = _named_point(raw, spots, start, target)
        else:
            lists = _LIST.findall(raw, spots[-1][1] + 1, target)
            words = b",".join(b" ".join(one.split()) for one in lists)
            point = PointText(spots, (raw.index(b"[", start), target), words, b"", True)
        return replace(text, start=start, stop=stop, target=point)

    def uses(self, start: int) -> int:
        """How many points use the literal at an offset."""
        return self._uses.get(start, 1)

    def is_plain(self, rows: Ints) -> Bools:
        """(K,) whether motions (K,) are of runs, where every literal is in the line and of that motion alone."""
        there = np.array(
            [t is not None and r is not None for t, r in zip(self._texts, self._runs, strict=True)]
        )
        return np.asarray(there[self._fact_of[rows]], np.bool_)

    def literals(self, rows: Ints) -> tuple[Ints, Ints]:
        """Starts and stops (K, 7) of the literals of motions (K,) of runs, ascending.

        Raises ValueError for a motion of no run: a defect of the caller.
        """
        facts = self._fact_of[rows]
        cuts = [0, *(np.flatnonzero(np.diff(facts)) + 1).tolist(), len(rows)]
        starts, stops = [np.empty((0, NUMBERS), np.int64)], [np.empty((0, NUMBERS), np.int64)]
        for low, high in pairwise(cuts) if len(rows) else ():
            run = self._runs[facts[low]]
            if run is None:
                raise ValueError("a motion is of no run")
            these = rows[low:high] - self._first[facts[low]]
            begins = run.starts[these].astype(np.int64)[:, None]
            starts.append(begins + run.literals[these])
            stops.append(begins + run.literal_stops[these])
        return np.concatenate(starts), np.concatenate(stops)


@dataclass(frozen=True, eq=False)
class RapidSourceMap:
    """What the text says of N motions.  single (N, 7): x, y, z [mm], q1..q4 of the targets as written, of motions that
    are of no run, NaN where not known; vias (N, 3) [mm]: of arcs; ``motions``: their texts; ``read``: names that other
    code reads too.
    """

    raw: bytes
    single: FewRows
    vias: NDArray[np.float64]
    motions: MotionTexts
    read: frozenset[bytes]

    def literals(self, rows: Ints) -> tuple[Floats, Ints, Ints, Ints]:
        """Values, decimals, starts and stops (K, 7) of the literals of motions (K,) of runs, ascending."""
        start, stop = self.motions.literals(rows)
        text = np.frombuffer(self.raw, np.uint8)
        values, decimals = literals(text, start.ravel(), stop.ravel(), other_literal)
        return values.reshape(start.shape), decimals.reshape(start.shape), start, stop

    def numbers(self, rows: Ints) -> Floats:
        """(K, 7) [mm, 1] of motions (K,), ascending, as written; NaN where not known."""
        found = self.single[rows]
        plain = self.motions.is_plain(rows)
        if plain.any():
            found[plain] = self.literals(rows[plain])[0]
        return found


def in_one_line(text: bytes) -> bytes:
    """A part of a statement without its comments and line ends."""
    return b" ".join(_COMMENT.sub(rb"\1", text).split())


def target_numbers(value: Value) -> list[float]:
    """x, y, z, q1..q4 of a robtarget; NaN where one is not known."""
    return [number for number, _, _ in _leaves(value)]


def _leaves(value: Value) -> list[tuple[float, int, int]]:
    found = []
    for part, count in ((0, 3), (1, 4)):
        group = item_of(value, part)
        size = len(getattr(group, "items", ()))
        for at in range(count):
            leaf = item_of(group, at) if size == count else None
            if isinstance(leaf, Leaf) and not isinstance(leaf.value, bool | bytes):
                found.append((float(leaf.value), leaf.start, leaf.stop))
            else:
                found.append((math.nan, -1, -1))
    return found


def point_text(argument: Argument, value: Value, raw: bytes) -> PointText:
    """The places of a point that is an argument of a motion."""
    expression = argument.value
    start, stop = (
        (argument.start, argument.stop) if expression is None else (expression.start, expression.stop)
    )
    inline = isinstance(expression, Aggregate)
    direct = is_direct(argument)
    spots = tuple(
        (first, last) if (inline or direct) and _is_editable(raw, first, last) else (-1, -1)
        for _, first, last in _leaves(value)
    )
    if inline:  # a literal of a variable that is a part of the aggregate is not its own
        spots = tuple(spot if start <= spot[0] < stop else (-1, -1) for spot in spots)
    base: Any = expression
    while isinstance(base, Index):
        base = base.base
    name = base.name if direct and isinstance(base, Name) else b""
    return PointText(spots, (start, stop), _words(expression, value, raw), name, inline)


def _named_point(raw: bytes, spots: tuple[tuple[int, int], ...], start: int, target: int) -> PointText:
    """The point of a motion of a run to declared targets, between two bytes of the motion."""
    rest = each_number(raw[spots[-1][1] : raw.index(b";", spots[-1][1])])
    found = _LAST_NAME.search(raw, start, target)
    operand = (target, target) if found is None else found.span()
    return PointText(spots, operand, _listed(rest[:4], rest[4:]), raw[slice(*operand)].upper(), False)


def _is_editable(raw: bytes, start: int, stop: int) -> bool:
    """Whether a literal is a number in a list, with nothing but blanks before it."""
    if start < 0 or not _EDITABLE.match(raw, start, stop):
        return False
    at = start - 1
    while at >= 0 and raw[at] in b" \t\r\n":
        at -= 1
    return at >= 0 and raw[at] in b"[,"


def _words(expression: Any, value: Value, raw: bytes) -> bytes:
    """Configuration and external axes: as the aggregate has them, or as numbers."""
    if isinstance(expression, Aggregate) and len(expression.items) == 4:
        parts = expression.items[2:]
        return b",".join(in_one_line(raw[part.start : part.stop]) for part in parts)
    conf, external = numbers_of(item_of(value, 2), 4), numbers_of(item_of(value, 3), 6)
    if conf is None or external is None:
        return b""
    return _listed(conf, external)


def _listed(*parts: Iterable[float]) -> bytes:
    return b",".join(b"[" + b",".join(map(_spelt, part)) + b"]" for part in parts)


def _spelt(number: float) -> bytes:
    if number == 9e9:
        return b"9E9"
    return b"%d" % number if number == int(number) and abs(number) < 1e9 else repr(number).upper().encode()
