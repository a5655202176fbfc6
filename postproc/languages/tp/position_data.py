"""The points of /POS: their groups, frames, configurations and numbers, each with its place in the text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.base.arrays import Ints

_HEAD = re.compile(
    rb"\s*+P[ \t]*+\[[ \t]*+([0-9]{1,9}+)[ \t]*+(:[ \t]*+(?:\"[^\"\r\n]*+\"|[^\]\"\r\n]*+))?+[ \t]*+\]\s*+\{",
    re.I,
)
_GROUP = re.compile(rb"\s*+GP[ \t]*+([0-9]{1,9}+)[ \t]*+:", re.I)
_FRAME = re.compile(rb"\s*+(UF|UT)[ \t]*+:[ \t]*+([0-9]{1,9}+|F)\b", re.I)
_CONFIG = re.compile(rb"\s*+CONFIG[ \t]*+:[ \t]*+'([^'\r\n]*+)'", re.I)
_NUMBER = rb"[-+]?+(?:[0-9]++\.?+[0-9]*+|\.[0-9]++)(?:E[-+]?+[0-9]++)?+"
_VALUE = re.compile(
    rb"\s*+(X|Y|Z|W|P|R|J[1-9]|E[1-9])[ \t]*+=[ \t]*+(" + _NUMBER + rb"|\*++)[ \t]*+(mm|deg)?+",
    re.I,
)
_COMMA = re.compile(rb"\s*+,")
_END = re.compile(rb"\s*+\}\s*+;")
_CLOSE = re.compile(rb"\}\s*+;")
_NEXT = re.compile(rb"^[ \t]*+P[ \t]*+\[", re.M | re.I)
_FLAGS = re.compile(
    rb"\s*+([FN])\s*+([UD])\s*+([TB])\s*+,\s*+(-?[0-9]{1,9}+)\s*+,\s*+(-?[0-9]{1,9}+)\s*+,\s*+(-?[0-9]{1,9}+)\s*+",
    re.I,
)
CARTESIAN = (b"X", b"Y", b"Z", b"W", b"P", b"R")
JOINTS = tuple(b"J%d" % axis for axis in range(1, 7))
EXTERNAL = tuple(b"E%d" % axis for axis in range(1, 7))
COMMON_POINT = re.compile(
    rb"\s*+GP1:\s*+UF : ([0-9]{1,9}+), UT : ([0-9]{1,9}+),\s*+CONFIG : ('[^'\r\n]*+'),\s*+"
    + rb",\s*+".join(
        name + rb"[ \t]*+=[ \t]*+(" + _NUMBER + rb")[ \t]*+" + unit
        for name, unit in zip(CARTESIAN, (b"mm",) * 3 + (b"deg",) * 3, strict=True)
    )
    + rb"\s*+\}\s*+;"
)
"""The braces of a point as controllers and posts write them, taken at once; the general rules give the same."""
_UNITS = {
    **dict.fromkeys(CARTESIAN[:3], b"mm"),
    **dict.fromkeys(CARTESIAN[3:], b"deg"),
    **dict.fromkeys(JOINTS, b"deg"),
}


@dataclass(slots=True)
class PositionGroup:
    """What a point says of one motion group.

    ``frames``: UF and UT -> number, None where it holds in any (F); ``config``: the text of the configuration;
    ``values``: name -> value [mm, deg], None where it is not set (*); ``spans``: name -> start and stop of the literal.
    """

    number: int
    frames: dict[bytes, int | None] = field(default_factory=dict)
    config: bytes | None = None
    values: dict[bytes, float | None] = field(default_factory=dict)
    spans: dict[bytes, tuple[int, int]] = field(default_factory=dict)

    @property
    def is_joint(self) -> bool:
        return b"J1" in self.values

    def numbers(self, names: tuple[bytes, ...]) -> tuple[float, ...] | None:
        """The values of ``names``; None where one is missing or not set."""
        found = [self.values.get(name) for name in names]
        return (
            None
            if any(value is None for value in found)
            else tuple(value for value in found if value is not None)
        )


@dataclass(slots=True)
class TpPosition:
    """A point.  start, stop: its bytes, from the P on to its semicolon; ``number_span``: of its number; ``comment``: of
    the colon and the name after it, empty without; ``problem``: why its numbers are not known, "" where they are."""

    number: int
    start: int
    stop: int
    number_span: tuple[int, int]
    comment: tuple[int, int]
    groups: list[PositionGroup] = field(default_factory=list)
    problem: str = ""

    def group(self, number: int) -> PositionGroup | None:
        return next((group for group in self.groups if group.number == number), None)


class TpPositions(Mapping[int, TpPosition]):
    """The points of a file by their numbers.  Of those in the common form only the place is kept, and they are read
    again where they are asked for."""

    def __init__(self, raw: bytes) -> None:
        self._raw = raw
        self._common: dict[int, int] = {}  # number -> start
        self._others: dict[int, TpPosition] = {}

    def add(self, one: TpPosition, is_common: bool) -> None:
        """Takes up a point; one whose number is there already makes that one unknown."""
        number = one.number
        known = self.get(number)
        if known is not None:
            known.problem = f"P[{number}] is in the file twice"
            self._common.pop(number, None)
            self._others[number] = known
        elif is_common:
            self._common[number] = one.start
        else:
            self._others[number] = one

    def __getitem__(self, number: int) -> TpPosition:
        start = self._common.get(number)
        if start is None:
            return self._others[number]
        head = _HEAD.match(self._raw, start)
        assert head is not None  # it was there when the file was read
        return _position(self._raw, head, len(self._raw))[0]

    def __contains__(self, number: object) -> bool:
        return number in self._common or number in self._others

    def __iter__(self) -> Iterator[int]:
        yield from self._common
        yield from self._others

    def __len__(self) -> int:
        return len(self._common) + len(self._others)

    def is_common(self, number: int) -> bool:
        return number in self._common

    def common_spans(self, numbers: list[int]) -> Ints:
        """(K, 12) starts and stops of X, Y, Z, W, P, R, one after the other, of points (K,) in the common form."""
        raw, found = self._raw, []
        for number in numbers:
            point = COMMON_POINT.match(raw, raw.index(b"{", self._common[number]) + 1)
            assert point is not None
            found.append([at for span in point.regs[4:10] for at in span])
        return np.array(found, np.int64).reshape(-1, 2 * len(CARTESIAN))


def read_positions(raw: bytes, start: int, stop: int) -> tuple[TpPositions, list[int]]:
    """The points between two bytes by their numbers, and where text starts that is no point."""
    positions = TpPositions(raw)
    unreadable: list[int] = []
    at = start
    while True:
        head = _HEAD.match(raw, at, stop)
        if head is None:
            rest = re.compile(rb"\s*+").match(raw, at, stop)
            at = stop if rest is None else rest.end()
            if at >= stop:
                return positions, unreadable
            unreadable.append(at)
            after = _NEXT.search(raw, at + 1, stop)
            if after is None:
                return positions, unreadable
            at = after.start()
            continue
        one, is_common = _position(raw, head, stop)
        at = one.stop
        positions.add(one, is_common)


def _position(raw: bytes, head: re.Match[bytes], stop: int) -> tuple[TpPosition, bool]:
    """The point that starts with ``head``, and whether it is in the common form."""
    start = head.start() + len(head[0]) - len(head[0].lstrip())
    comment = head.span(2) if head[2] is not None else (head.end(1), head.end(1))
    one = TpPosition(int(head[1]), start, head.end(), head.span(1), comment)
    at = head.end()
    common = COMMON_POINT.match(raw, at, stop)
    if common is not None:
        one.stop = common.end()
        one.groups.append(_common_group(common))
        return one, True
    while True:
        end = _END.match(raw, at, stop)
        if end is not None:
            one.stop = end.end()
            if not one.groups:
                one.problem = f"P[{one.number}] has no group"
            return one, False
        after = _item(raw, at, stop, one)
        if after < 0:
            one.problem = f"P[{one.number}] is not understood"
            following = _NEXT.search(raw, at, stop)
            one.stop = stop if following is None else following.start()
            later = _CLOSE.search(raw, at, one.stop)
            one.stop = one.stop if later is None else later.end()
            return one, False
        comma = _COMMA.match(raw, after, stop)
        at = after if comma is None else comma.end()


def _common_group(match: re.Match[bytes]) -> PositionGroup:
    values = [float(text) for text in match.group(4, 5, 6, 7, 8, 9)]
    return PositionGroup(
        1,
        {b"UF": int(match[1]), b"UT": int(match[2])},
        match[3][1:-1],
        dict(zip(CARTESIAN, values, strict=True)),
        {name: match.span(place) for place, name in enumerate(CARTESIAN, 4)},
    )


def _item(raw: bytes, at: int, stop: int, one: TpPosition) -> int:
    """Where an item ends; -1 where there is none that is known, or it is there twice."""
    found = _GROUP.match(raw, at, stop)
    if found is not None:
        number = int(found[1])
        if one.group(number) is not None:
            return -1
        one.groups.append(PositionGroup(number))
        return found.end()
    if not one.groups:
        return -1
    group = one.groups[-1]
    found = _FRAME.match(raw, at, stop)
    if found is not None:
        name = found[1].upper()
        if name in group.frames:
            return -1
        group.frames[name] = None if found[2] in (b"F", b"f") else int(found[2])
        return found.end()
    found = _CONFIG.match(raw, at, stop)
    if found is not None:
        if group.config is not None:
            return -1
        group.config = found[1]
        return found.end()
    return _number(raw, at, stop, group)


def _number(raw: bytes, at: int, stop: int, group: PositionGroup) -> int:
    found = _VALUE.match(raw, at, stop)
    if found is None:
        return -1
    name, unit = found[1].upper(), (found[3] or b"").lower()
    if name in group.values or unit != _UNITS.get(name, unit) or not unit:
        return -1
    group.values[name] = None if found[2].startswith(b"*") else float(found[2])
    group.spans[name] = found.span(2)
    return found.end()


def configuration_flags(config: bytes) -> tuple[int, tuple[int, int, int]] | None:
    """The flags 4 B + 2 D + F of a configuration (0: N U T), and its turns of axes 1, 4, 6; None where it is none."""
    found = _FLAGS.fullmatch(config)
    if found is None:
        return None
    flags = (found[3].upper() == b"B") * 4 + (found[2].upper() == b"D") * 2 + (found[1].upper() == b"F")
    turns = tuple(int(found[k]) for k in (4, 5, 6))
    return flags, (turns[0], turns[1], turns[2])
