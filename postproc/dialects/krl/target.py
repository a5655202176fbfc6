"""Targets: the numbers of an aggregate such as ``{X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 35}`` and their places."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from postproc.dialects.krl.lexing import NAME, number

Six = tuple[float | None, float | None, float | None, float | None, float | None, float | None]
NOWHERE = (-1,) * 6

COMPONENTS = {b"X": 0, b"Y": 1, b"Z": 2, b"A": 3, b"B": 4, b"C": 5}
AXES = {b"A1": 0, b"A2": 1, b"A3": 2, b"A4": 3, b"A5": 4, b"A6": 5}
EXTERNAL = frozenset([b"E1", b"E2", b"E3", b"E4", b"E5", b"E6"])
_TAGS = frozenset([b"FRAME", b"POS", b"E3POS", b"E6POS", b"AXIS", b"E3AXIS", b"E6AXIS"])

_TAG = re.compile(rb"[ \t]*(" + NAME + rb")[ \t]*:[ \t]*")
_FIELD = re.compile(rb"[ \t]*(" + NAME + rb")((?:[ \t]*\[[^\]]*\])?)[ \t]*([^,]*?)[ \t]*(?=,|\Z)")

_PLAIN = rb"[-+]?\d{1,15}(?:\.\d{0,20})?"
_REAL = rb"(" + _PLAIN + rb")"
_STATE = rb"(\d{1,9}|'[Bb][01]{1,30}')"
_EXTERNAL = b"".join(rb"(?:[ \t]*,[ \t]*E%d[ \t]+" % i + _PLAIN + rb")?" for i in range(1, 7))
External = tuple[tuple[bytes, float | None], ...]
QUICK = re.compile(
    rb"[ \t]*(LIN|PTP)[ \t]*\{[ \t]*"
    + rb"[ \t]*,[ \t]*".join(key + rb"[ \t]+" + _REAL for key in COMPONENTS)
    + rb"(?:[ \t]*,[ \t]*S(?=[ \t'])[ \t]*" + _STATE + rb"[ \t]*,[ \t]*T(?=[ \t'])[ \t]*" + _STATE + rb")?"
    + rb"("
    + _EXTERNAL
    + rb")[ \t]*\}[ \t]*(?:C_(?:DIS|VEL|ORI|PTP)[ \t]*)?\r?\n?\Z",
    re.I,
)  # fmt: skip
"""The line that nearly all lines of a generated program are; ``parse`` gives the same for it, slower."""


@dataclass(frozen=True, slots=True)
class Target:
    """What an aggregate says.

    values: X, Y, Z [mm], A, B, C [deg], None where missing; start, stop: byte range of each literal, -1 where
    there is none; axes: A1..A6 [deg] of an axis target, else None; status, turn: S and T, -1 where missing;
    insert: offset at which missing components are written; file: document that holds it, -1 if none does;
    external: the external axes that it names, with None for what is not a number.
    """

    values: Six
    start: tuple[int, ...]
    stop: tuple[int, ...]
    axes: Six | None = None
    status: int = -1
    turn: int = -1
    insert: int = -1
    file: int = -1
    external: External = ()

    @property
    def missing(self) -> list[str]:
        """The components that are not written."""
        names, values = ("A1 A2 A3 A4 A5 A6", self.axes) if self.axes else ("X Y Z A B C", self.values)
        return [name for name, value in zip(names.split(), values, strict=True) if value is None]


@dataclass(frozen=True, slots=True)
class Unclear:
    """Why something is not known: a code, and words that complete "... because"."""

    code: str
    message: str


def quick(found: re.Match[bytes]) -> Target:
    """The target of a line that ``QUICK`` matched, in document 0."""
    _, x, y, z, a, b, c, status, turn, external = found.groups()
    others = _externals(external) if external else ()
    spans = [found.span(i) for i in range(2, 8)]
    start, stop = zip(*spans, strict=True)
    values = (float(x), float(y), float(z), float(a), float(b), float(c))
    if status is None:
        return Target(values, start, stop, None, -1, -1, stop[5], 0, others)
    return Target(values, start, stop, None, _integer(status), _integer(turn), stop[5], 0, others)


@lru_cache(maxsize=1024)
def _externals(text: bytes) -> External:
    return tuple((field[1].upper(), number(field[3])) for field in _FIELD.finditer(text, text.find(b",") + 1))


def _integer(literal: bytes) -> int:
    return int(literal[2:-1], 2) if literal.startswith(b"'") else int(literal)


def parse(text: bytes, at: int, file: int) -> Target | Unclear:
    """The target in ``text``, an aggregate with its braces that stands at byte ``at`` of document ``file``."""
    inner = text[1:-1]
    tag = _TAG.match(inner)
    place = 0
    if tag is not None:
        if tag[1].upper() not in _TAGS:
            return Unclear("KRL001", f"the type {_shown(tag[1])} is not one of a point")
        place = tag.end()
    values: list[float | None] = [None] * 6
    axes: list[float | None] = [None] * 6
    start, stop = list(NOWHERE), list(NOWHERE)
    states = {b"S": -1, b"T": -1}
    seen: set[bytes] = set()
    external: list[tuple[bytes, float | None]] = []
    first = insert = -1
    while place < len(inner):
        field = _FIELD.match(inner, place)
        if field is None:
            return Unclear("KRL001", f"'{_shown(inner[place:])}' is not a component and its value")
        key = field[1].upper()
        if key in seen:
            return Unclear("KRL001", f"{_shown(key)} is given twice")
        seen.add(key)
        if first < 0:
            first = at + 1 + field.start(1)
        value = number(field[3]) if not field[2] else None
        problem = _misread(key, field, value)
        if problem is not None:
            return problem
        if value is not None and key in COMPONENTS:
            i = COMPONENTS[key]
            values[i] = value
            start[i], stop[i] = at + 1 + field.start(3), at + 1 + field.end(3)
            insert = stop[i]
        elif value is not None and key in AXES:
            axes[AXES[key]] = value
        elif value is not None and key in states:
            states[key] = int(value)
        elif key in EXTERNAL:
            external.append((key, value))
        place = field.end()
        if place < len(inner):
            place += 1
            if not inner[place:].strip():
                return Unclear("KRL001", "a component is missing behind the last comma")
    if not seen:
        return Unclear("KRL001", "the aggregate is empty")
    is_axis = any(value is not None for value in axes)
    if is_axis and any(value is not None for value in values):
        return Unclear("KRL001", "it mixes axes with Cartesian components")
    is_axis = is_axis or (tag is not None and tag[1].upper().endswith(b"AXIS"))
    return Target(
        six(values), tuple(start), tuple(stop), six(axes) if is_axis else None,
        states[b"S"], states[b"T"], first if insert < 0 else insert, file, tuple(external),
    )  # fmt: skip


def _misread(key: bytes, field: re.Match[bytes], value: float | None) -> Unclear | None:
    """Why a field can not be used; an external axis may be anything, it stays as it is."""
    if key in EXTERNAL:
        return None if field[3] else Unclear("KRL001", f"{_shown(key)} has no value")
    if key not in COMPONENTS and key not in AXES and key not in (b"S", b"T"):
        return Unclear("KRL001", f"{_shown(field[1])} is not a component of a point")
    if not field[3]:
        return Unclear("KRL001", f"{_shown(key)} has no value")
    if value is None:
        return Unclear("KRL002", f"{_shown(key)} is '{_shown(field[3])}', which is not a number")
    if key in (b"S", b"T") and not (0 <= value < 2**31 and value == int(value)):
        return Unclear("KRL001", f"{_shown(key)} is {value:g}, which is not a bit pattern")
    return None


def six(values: Sequence[float | None]) -> Six:
    """Six values as a tuple of that length."""
    x, y, z, a, b, c = values
    return (x, y, z, a, b, c)


def fields(text: bytes) -> dict[bytes, bytes]:
    """Keys (upper case) and values of any other aggregate, such as FDAT's."""
    inner = text.strip()[1:-1]
    tag = _TAG.match(inner)
    found = _FIELD.finditer(inner, tag.end() if tag else 0)
    return {field[1].upper(): field[3].strip() for field in found}


def _shown(text: bytes) -> str:
    shown = text.decode("latin-1").strip()
    return shown if len(shown) <= 40 else shown[:37] + "..."
