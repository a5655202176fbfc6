"""Targets: the numbers of an aggregate such as ``{X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 35}`` and their places."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from postproc.languages.krl.lexing import NAME, is_number, number, value_end
from postproc.languages.krl.spatial import ZERO, Numbers

Six = tuple[float | None, float | None, float | None, float | None, float | None, float | None]
NOWHERE = (-1,) * 6
_NONE: Six = (None,) * 6
NAN = float("nan")

COMPONENTS = {b"X": 0, b"Y": 1, b"Z": 2, b"A": 3, b"B": 4, b"C": 5}
AXES = {b"A1": 0, b"A2": 1, b"A3": 2, b"A4": 3, b"A5": 4, b"A6": 5}
EXTERNAL = frozenset([b"E1", b"E2", b"E3", b"E4", b"E5", b"E6"])
_STATES = (b"S", b"T")
_CARTESIAN = 6
_TAGS = frozenset([b"FRAME", b"POS", b"E3POS", b"E6POS", b"AXIS", b"E3AXIS", b"E6AXIS"])

_TAG = re.compile(rb"[ \t]*(" + NAME + rb")[ \t]*:[ \t]*")
_KEY = re.compile(rb"[ \t]*(" + NAME + rb")((?:[ \t]*\[[^\],]*\])?)[ \t]*")

_END = rb"[ \t]*+(?:,(?![ \t]*+\})[ \t]*+|(?=\}))"
_REAL = rb"[ \t]++([-+]?\d{1,15}+(?:\.\d{0,20}+)?+(?:E[-+]?\d{1,2}+)?+)" + _END
_BITS = rb"(?=[ \t'])[ \t]*+(\d{1,9}+|'B[01]{1,30}+')" + _END
_EXTERNALS = b"".join(rb"(?:E%d%s)?+" % (i, _REAL) for i in range(1, 7))
_TAGGED = rb"\{[ \t]*+(?:(?:%s)[ \t]*+:[ \t]*+)?+"
_PLAIN = re.compile(
    _TAGGED % rb"FRAME|(?:E[36])?POS"
    + b"".join(rb"(?:%s%s)?+" % (key, _REAL) for key in COMPONENTS)
    + b"".join(rb"(?:%s%s)?+" % (key, _BITS) for key in _STATES)
    + _EXTERNALS
    + rb"\}\Z",
    re.I,
)
_PLAIN_AXES = re.compile(
    _TAGGED % rb"(?:E[36])?AXIS"
    + rb"(?=(A))"
    + b"".join(rb"(?:%s%s)?+" % (key, _REAL) for key in AXES)
    + _EXTERNALS
    + rb"\}\Z",
    re.I,
)
"""Literals in their usual order, as most aggregates are."""

External = tuple[tuple[bytes, float | None, bytes], ...]
Evaluate = Callable[[bytes], Any]
"""The value of an expression: a number, or whatever else it is."""


@dataclass(frozen=True, slots=True)
class UnknownValue:
    """Why something is not known: a code, and words that complete "... because"."""

    code: str
    message: str


@dataclass(frozen=True, slots=True)
class FrameEntry(UnknownValue):
    """A copy of an entry of BASE_DATA or TOOL_DATA whose numbers only the cell states, or (``within``: X..C, mm and
    deg) of a frame that is stated in it."""

    table: bytes = b""
    number: int = 0
    within: Numbers = ZERO


class KrlTarget(NamedTuple):
    """What a point is.

    values: X, Y, Z [mm], A, B, C [deg], None where left out, NaN where not known; start, stop, file: byte range and
    document of each literal, -1 where there is none; axes: A1..A6 [deg] of an axis target, else None; status, turn: S
    and T, -1 where missing; insert, home: offset at which missing components are written, and its document, -1 where
    there is no aggregate; external: key, value (None for what is not a number) and text of the external axes; lost: the
    first component that is not known, and why.
    """

    values: Six
    start: tuple[int, ...] = NOWHERE
    stop: tuple[int, ...] = NOWHERE
    file: tuple[int, ...] = NOWHERE
    axes: Six | None = None
    status: int = -1
    turn: int = -1
    insert: int = -1
    home: int = -1
    external: External = ()
    unknown: UnknownValue | None = None
    locked: str = ""

    @property
    def missing(self) -> str:
        """The names of the components that are left out."""
        names, values = ("A1 A2 A3 A4 A5 A6", self.axes) if self.axes else ("X Y Z A B C", self.values)
        return _left_out(names, *[value is None for value in values])

    @property
    def numbers(self) -> Numbers | None:
        """X .. C where all are known."""
        if self.axes is not None or self.unknown is not None or None in self.values:
            return None
        x, y, z, a, b, c = (0.0 if value is None else value for value in self.values)
        return (x, y, z, a, b, c)

    @property
    def words(self) -> bytes:
        """What it holds besides X .. C, as it is written."""
        words = [
            b"%s %d" % item for item in zip(_STATES, (self.status, self.turn), strict=True) if item[1] >= 0
        ]
        return b",".join([*words, *(key + b" " + text for key, _, text in self.external)])

    def detached(self) -> KrlTarget:
        """The value without its places: a copy of it."""
        if self.start is NOWHERE and self.home < 0 and not self.locked:
            return self
        return KrlTarget(
            self.values,
            axes=self.axes,
            status=self.status,
            turn=self.turn,
            external=self.external,
            unknown=self.unknown,
        )

    def component(self, key: bytes) -> float | None:
        """The number of a component, None where it has none."""
        if key in COMPONENTS and self.axes is None:
            value = self.values[COMPONENTS[key]]
        elif key in AXES and self.axes is not None:
            value = self.axes[AXES[key]]
        elif key in _STATES:
            bits = self.status if key == b"S" else self.turn
            value = bits if bits >= 0 else None
        else:
            value = next((v for name, v, _ in self.external if name == key), None)
        return None if value is None or value != value else value

    def changed(
        self, key: bytes, value: float | None, why: UnknownValue, place: tuple[int, int, int], text: bytes
    ) -> KrlTarget | UnknownValue:
        """The target after a component was assigned ``value`` (None: not known, for the reason ``why``), by the literal
        at ``place`` (file, start, stop; -1 for an expression)."""
        if key in EXTERNAL:
            others = tuple(item for item in self.external if item[0] != key)
            return self._replace(external=(*others, (key, value, text)))
        if key in _STATES:
            bits = int(value) if value is not None and 0 <= value < 2**31 and value == int(value) else -1
            return self._replace(status=bits) if key == b"S" else self._replace(turn=bits)
        table, have = (COMPONENTS, self.values) if key in COMPONENTS else (AXES, self.axes)
        if key not in table or have is None or (key in COMPONENTS and self.axes is not None):
            return UnknownValue(
                "KRL002", f"{key.decode('latin-1')} is assigned, but it has no such component"
            )
        i = table[key]
        lost = self.unknown
        if value is None:
            value, lost = NAN, lost or why
        filled = six((*have[:i], value, *have[i + 1 :]))
        if lost is not None and not any(v != v for v in filled):
            lost = None
        if key in AXES:
            return self._replace(axes=filled, unknown=lost)
        start, stop, file = (
            (*old[:i], new, *old[i + 1 :])
            for old, new in zip(
                (self.start, self.stop, self.file), (place[1], place[2], place[0]), strict=True
            )
        )
        return self._replace(values=filled, start=start, stop=stop, file=file, unknown=lost)


@lru_cache(maxsize=128)
def _left_out(names: str, *omitted: bool) -> str:
    return ", ".join(name for name, left_out in zip(names.split(), omitted, strict=True) if left_out)


def known(values: Numbers) -> KrlTarget:
    """A computed target."""
    return KrlTarget(values)


def parse(text: bytes, at: int, file: int, evaluate: Evaluate | None = None) -> KrlTarget | UnknownValue:
    """The target in ``text``, an aggregate with its braces that is at byte ``at`` of document ``file``.

    A component that is no literal is given to ``evaluate``; its place is then unknown.
    """
    found = plain(text, 0, len(text), file)
    if found is None:
        return _parse(text, at, file, evaluate)
    start, stop = (
        tuple([place + at if place >= 0 else -1 for place in places]) for places in (found.start, found.stop)
    )
    return found._replace(start=start, stop=stop, insert=found.insert + at)


def plain(raw: bytes, start_at: int, end: int, file: int) -> KrlTarget | None:
    """The target in bytes ``start_at`` to ``end`` of document ``file``, where all are literals in their usual order,
    one of X .. C or A1 .. A6 among them; else None."""
    found = _PLAIN.match(raw, start_at, end)
    if found is None:
        return _plain_axes(raw, start_at, end, file)
    start, stop = zip(*found.regs[1:7], strict=True)
    insert = max(stop)
    if insert < 0:
        return None
    given = found.groups()
    files: tuple[int, ...] = NOWHERE
    if file >= 0:
        files = (file,) * 6 if -1 not in start else tuple([file if place >= 0 else -1 for place in start])
    values = six([None if literal is None else float(literal) for literal in given[:6]])
    last = found.lastindex
    if last is None or last <= _CARTESIAN:
        return KrlTarget(values, start, stop, files, None, -1, -1, insert, file)
    status, turn = (-1 if bits is None else int(number(bits) or 0) for bits in given[6:8])
    return KrlTarget(values, start, stop, files, None, status, turn, insert, file, _stated(given[8:]))


def _plain_axes(raw: bytes, start_at: int, end: int, file: int) -> KrlTarget | None:
    found = _PLAIN_AXES.match(raw, start_at, end)
    if found is None:
        return None
    given = found.groups()
    axes = six([None if literal is None else float(literal) for literal in given[1:7]])
    external = _stated(given[7:])
    return KrlTarget(_NONE, axes=axes, insert=found.start(1), home=file, external=external)


def _stated(axes: Sequence[bytes | None]) -> External:
    """E1 .. E6 of their literals."""
    return tuple([(b"E%d" % i, float(word), word) for i, word in enumerate(axes, 1) if word is not None])


def _parse(text: bytes, at: int, file: int, evaluate: Evaluate | None) -> KrlTarget | UnknownValue:
    inner = text[1:-1]
    tag = _TAG.match(inner)
    place = 0
    if tag is not None:
        if tag[1].upper() not in _TAGS:
            return UnknownValue("KRL001", f"the type {shown(tag[1])} is not the type of a point")
        place = tag.end()
    nested = b"(" in inner or b"{" in inner or b"[" in inner
    values: list[float | None] = [None] * 6
    axes: list[float | None] = [None] * 6
    start, stop = list(NOWHERE), list(NOWHERE)
    states = {b"S": -1, b"T": -1}
    seen: set[bytes] = set()
    external: list[tuple[bytes, float | None, bytes]] = []
    first = insert = -1
    while place < len(inner):
        key_found = _KEY.match(inner, place)
        if key_found is None:
            return UnknownValue("KRL001", f"'{shown(inner[place:])}' is not a component with its value")
        key = key_found[1].upper()
        if key in seen:
            return UnknownValue("KRL001", f"{shown(key)} occurs twice")
        seen.add(key)
        if first < 0:
            first = at + 1 + key_found.start(1)
        start_at = key_found.end()
        end = value_end(inner, start_at) if nested else inner.find(b",", start_at)
        end = len(inner) if end < 0 else end
        literal = inner[start_at:end].rstrip(b" \t")
        value = number(literal) if not key_found[2] else None
        is_literal = value is not None
        if value is None and literal and evaluate is not None and not key_found[2]:
            computed = evaluate(literal)
            if is_number(computed):
                value = float(computed)
        problem = _misread(key, key_found, literal, value)
        if problem is not None:
            return problem
        if value is not None and key in COMPONENTS:
            i = COMPONENTS[key]
            values[i] = value
            insert = at + 1 + start_at + len(literal)
            if is_literal:
                start[i], stop[i] = at + 1 + start_at, insert
        elif value is not None and key in AXES:
            axes[AXES[key]] = value
        elif value is not None and key in states:
            states[key] = int(value)
        elif key in EXTERNAL:
            external.append((key, value, literal))
        place = end
        if place < len(inner):
            place += 1
            if not inner[place:].strip():
                return UnknownValue("KRL001", "a component is missing after the last comma")
    if not seen:
        return UnknownValue("KRL001", "the aggregate is empty")
    is_axis = any(value is not None for value in axes)
    if is_axis and any(value is not None for value in values):
        return UnknownValue("KRL001", "it mixes axes with Cartesian components")
    is_axis = is_axis or (tag is not None and tag[1].upper().endswith(b"AXIS"))
    files = tuple(file if offset >= 0 else -1 for offset in start)
    return KrlTarget(
        six(values), tuple(start), tuple(stop), files, six(axes) if is_axis else None,
        states[b"S"], states[b"T"], first if insert < 0 else insert, file, tuple(external),
    )  # fmt: skip


def _misread(key: bytes, field: re.Match[bytes], literal: bytes, value: float | None) -> UnknownValue | None:
    """Why a field cannot be used; an external axis may be anything, it stays as it is."""
    if key in EXTERNAL:
        return None if literal else UnknownValue("KRL001", f"{shown(key)} has no value")
    if key not in COMPONENTS and key not in AXES and key not in _STATES:
        return UnknownValue("KRL001", f"{shown(field[1])} is not a component of a point")
    if not literal:
        return UnknownValue("KRL001", f"{shown(key)} has no value")
    if value is None:
        return UnknownValue("KRL002", f"{shown(key)} is '{shown(literal)}', which is not a constant")
    if key in _STATES and not (0 <= value < 2**31 and value == int(value)):
        return UnknownValue("KRL001", f"{shown(key)} is {value:g}, which is not a bit pattern")
    return None


def six(values: Sequence[float | None]) -> Six:
    """Six values as a tuple of that length."""
    x, y, z, a, b, c = values
    return (x, y, z, a, b, c)


def fields(text: bytes) -> dict[bytes, bytes]:
    """Keys (upper case, with the brackets of an array's element) and values of any other aggregate, such as FDAT's."""
    inner = text.strip()[1:-1]
    tag = _TAG.match(inner)
    place = tag.end() if tag else 0
    found: dict[bytes, bytes] = {}
    while place < len(inner) and (key := _KEY.match(inner, place)):
        end = value_end(inner, key.end())
        found[key[1].upper() + key[2].replace(b" ", b"")] = inner[key.end() : end].strip()
        place = end + 1
    return found


def shown(text: bytes) -> str:
    """A piece of code for a message."""
    words = text.decode("latin-1").strip()
    return words if len(words) <= 40 else words[:37] + "..."
