"""The lines of a TP listing: its sections, its attributes, and the numbered statements of /MN."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from postproc.base.arrays import Ints

_SECTION = re.compile(rb"[ \t]*+/(PROG|ATTR|APPL|MN|POS|END)\b", re.I)
_NUMBER = re.compile(rb"([ \t]*+[0-9]{1,9}+)[ \t]*+:")
_CONTINUED = re.compile(rb"[ \t]*+:")
_NAME = re.compile(rb"[ \t]*+/PROG[ \t]++([A-Za-z0-9_\-]++)", re.I)
_ATTRIBUTE = re.compile(rb"[ \t]*+([A-Z_]++)[ \t]*+=[ \t]*+([^;\r\n]*+)", re.I)
_LINE_END = bytes.maketrans(b"\r\n", b"  ")


@dataclass(slots=True)
class NumberedStatement:
    """A statement of /MN.

    ``start``, ``stop``: its bytes after the colon and before the semicolon; ``text``: these, with blanks in the place
    of line ends and of the colons of continued lines, so that offsets are the same; ``line``: of the file, from 1;
    ``line_start``: its first byte; ``number``: start and stop of its line number with the blanks before it, start -1
    where it has none; ``closed``: it ends with a semicolon.
    """

    start: int
    stop: int
    text: bytes
    line: int
    line_start: int
    number: tuple[int, int]
    closed: bool = False


class NumberedStatements:
    """The statements of a file in their order, kept as numbers; each is made where it is asked for."""

    def __init__(self, raw: bytes) -> None:
        self._raw, self._numbers = raw, array("q")

    def __len__(self) -> int:
        return len(self._numbers) // _COLUMNS

    def __getitem__(self, at: int) -> NumberedStatement:
        if not 0 <= at < len(self):
            raise IndexError(at)
        start, stop, line, line_start, *number, closed = self._numbers[at * _COLUMNS : (at + 1) * _COLUMNS]
        text = _masked(self._raw, start, stop)
        return NumberedStatement(start, stop, text, line, line_start, (number[0], number[1]), bool(closed))

    def __iter__(self) -> Iterator[NumberedStatement]:
        return map(self.__getitem__, range(len(self)))

    def append(self, one: NumberedStatement) -> None:
        self._numbers.extend((one.start, one.stop, one.line, one.line_start, *one.number, one.closed))

    def pop(self) -> NumberedStatement:
        """The last one, which is no longer there."""
        last = self[len(self) - 1]
        del self._numbers[-_COLUMNS:]
        return last

    def columns(self) -> Ints:
        """(K, 7): start, stop, line, line_start, start and stop of the number, closed."""
        return np.array(self._numbers, np.int64).reshape(-1, _COLUMNS)


_COLUMNS = 7


@dataclass
class TpListing:
    """A file.

    ``name``: start and stop of the program's name, -1 without; ``attributes``: name -> start and stop of the value;
    ``main``: start of the line after /MN, -1 without; ``points``: start of the line /POS and of the line after the
    points (/END), -1 without, ``point_lines``: their lines, from 1; ``unreadable``: bytes of /MN that are no statement:
    start -> text.
    """

    raw: bytes
    name: tuple[int, int] = (-1, -1)
    attributes: dict[bytes, tuple[int, int]] = field(default_factory=dict)
    main: int = -1
    points: tuple[int, int] = (-1, -1)
    point_lines: tuple[int, int] = (0, 0)
    statements: NumberedStatements = field(init=False)
    unreadable: dict[int, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.statements = NumberedStatements(self.raw)

    @cached_property
    def count(self) -> int:
        """Numbered lines of /MN, of a file that is read."""
        return int((self.statements.columns()[:, 4] >= 0).sum())


def read_listing(raw: bytes) -> TpListing:
    """The sections and statements of a file; never raises on its content."""
    listing = TpListing(raw)
    section, line, at = b"", 0, 0
    if raw.startswith(b"\xef\xbb\xbf"):
        at = 3
    while at < len(raw):
        line += 1
        stop = raw.find(b"\n", at) + 1 or len(raw)
        found = _SECTION.match(raw, at, stop)
        if found is not None and section != b"END":
            section = found[1].upper()
            _open(listing, section, at, stop, line)
        elif section == b"MN":
            _main_line(listing, at, stop, line)
        elif section == b"ATTR":
            value = _ATTRIBUTE.match(raw, at, stop)
            if value is not None:
                listing.attributes.setdefault(value[1].upper(), value.span(2))
        at = stop
    return listing


def _open(listing: TpListing, section: bytes, at: int, stop: int, line: int) -> None:
    if section == b"PROG":
        found = _NAME.match(listing.raw, at, stop)
        if found is not None:
            listing.name = found.span(1)
    elif section == b"MN" and listing.main < 0:
        listing.main = stop
    elif section == b"POS" and listing.points[0] < 0:
        listing.points, listing.point_lines = (at, -1), (line, 0)
    elif section == b"END" and listing.points[0] >= 0:
        listing.points = (listing.points[0], at)
        listing.point_lines = (listing.point_lines[0], line)


def _main_line(listing: TpListing, at: int, stop: int, line: int) -> None:
    raw = listing.raw
    found = _NUMBER.match(raw, at, stop)
    if found is not None:
        one = NumberedStatement(found.end(), found.end(), b"", line, at, found.span(1))
        _extend(raw, one, stop)
        listing.statements.append(one)
        return
    if not raw[at:stop].strip():
        return
    if len(listing.statements) and not listing.statements[len(listing.statements) - 1].closed:
        one = listing.statements.pop()
        _extend(raw, one, stop)
        listing.statements.append(one)
        return
    more = _CONTINUED.match(raw, at, stop)
    if more is None:
        listing.unreadable[at] = raw[at:stop].strip()
        return
    one = NumberedStatement(more.end(), more.end(), b"", line, at, (-1, -1))
    _extend(raw, one, stop)
    listing.statements.append(one)


def _extend(raw: bytes, one: NumberedStatement, stop: int) -> None:
    """The statement goes on to the end of a line, or to the semicolon that closes it."""
    end = stop
    while end > one.stop and raw[end - 1] in b" \t\r\n":
        end -= 1
    one.closed = end > one.stop and raw[end - 1] == ord(";")
    one.stop = end - 1 if one.closed else max(end, one.stop)


def _masked(raw: bytes, start: int, stop: int) -> bytes:
    text = raw[start:stop]
    if b"\n" not in text:
        return text.replace(b"\r", b" ")
    parts = text.split(b"\n")
    for k, part in enumerate(parts[1:], 1):
        found = _CONTINUED.match(part)
        if found is not None:
            parts[k] = part[: found.end() - 1] + b" " + part[found.end() :]
    return b"\n".join(parts).translate(_LINE_END)
