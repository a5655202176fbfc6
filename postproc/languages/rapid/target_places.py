"""The numbers of targets, and where they are in the text."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.languages.rapid.motion_facts import is_direct, item_of
from postproc.languages.rapid.syntax_tree import Aggregate, Argument, Index, Name
from postproc.languages.rapid.values import Leaf, Value, numbers_of

NUMBERS = 7
"""Of a target that can be corrected: x, y, z and q1 to q4."""
NOWHERE = ((-1, -1),) * NUMBERS
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


@dataclass(frozen=True, eq=False)
class RapidSourceMap:
    """What the text says of N motions.  numbers (N, 7): x, y, z [mm], q1..q4 of the targets as written, NaN where not
    known; vias (N, 3) [mm]: of arcs; ``motions``: their texts, None where a motion is not understood; ``read``: names
    that other code reads too.
    """

    numbers: NDArray[np.float64]
    vias: NDArray[np.float64]
    motions: tuple[MotionText | None, ...]
    read: frozenset[bytes]
    uses: dict[int, int] = field(default_factory=dict)

    @staticmethod
    def count_uses(motions: tuple[MotionText | None, ...]) -> dict[int, int]:
        """Offset of a literal -> how many points use it."""
        uses: dict[int, int] = {}
        for motion in motions:
            for point in () if motion is None else (motion.target, motion.via):
                for start, _ in () if point is None else point.spots:
                    if start >= 0:
                        uses[start] = uses.get(start, 0) + 1
        return uses


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
        return b",".join(b" ".join(raw[part.start : part.stop].split()) for part in parts)
    conf, external = numbers_of(item_of(value, 2), 4), numbers_of(item_of(value, 3), 6)
    if conf is None or external is None:
        return b""
    return b",".join(b"[" + b",".join(map(_spelt, part)) + b"]" for part in (conf, external))


def _spelt(number: float) -> bytes:
    if number == 9e9:
        return b"9E9"
    return b"%d" % number if number == int(number) and abs(number) < 1e9 else repr(number).upper().encode()


def decimals_of(literal: bytes) -> int:
    """The decimals that a literal is written with, its exponent considered."""
    mantissa, _, exponent = literal.upper().partition(b"E")
    written = len(mantissa.partition(b".")[2].strip())
    return min(max(written - int(exponent or b"0"), 0), 12)
