"""The statements of a program as text, for a comparison that knows nothing of how targets are written.

A statement of a motion is without its target: its numbers differ where it is corrected, and no other word does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.document import Document
from postproc.languages.dialect import Program
from postproc.toolpath import Kind, Toolpath

MOTION = b"\x01"
"""With which the text of a motion starts, so that it is never that of another statement."""

NONE: frozenset[bytes] = frozenset()


@dataclass(eq=False)
class Statements:
    """U statements of a file in their order.  texts (U): what is compared; lines (U): where they start, from 1.

    operands: number of a statement -> names of points in the place of numbers; points: number of a statement -> the
    name of the point that it declares, capitals.
    """

    texts: list[bytes] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    operands: dict[int, frozenset[bytes]] = field(default_factory=dict)
    points: dict[int, bytes] = field(default_factory=dict)

    def add(self, text: bytes, line: int) -> None:
        self.texts.append(text)
        self.lines.append(line)

    def add_motion(self, words: bytes, operands: frozenset[bytes], line: int) -> None:
        if operands:
            self.operands[len(self.texts)] = operands
        self.texts.append(MOTION + words)
        self.lines.append(line)


@dataclass(frozen=True)
class MovingLines:
    """Lines of a program, from 1: ``moving`` with a motion to places, ``inverse`` with a feed in inverse time."""

    moving: frozenset[int]
    inverse: frozenset[int]

    @staticmethod
    def of(path: Toolpath) -> MovingLines:
        places = path.known & ~path.on_axes & ~np.isin(path.kind, (Kind.AXIS, Kind.OTHER))
        return MovingLines(_numbers(path.line[places]), _numbers(path.line[path.inverse_time_feed]))


def _numbers(lines: Ints) -> frozenset[int]:
    return frozenset(np.unique(lines).tolist())


class StatementForm(Protocol):
    """How a language states motions and points.

    flowing: words that an inserted motion may state beside those of the motion that it is inserted before.
    """

    @property
    def flowing(self) -> frozenset[bytes]: ...

    def read(self, files: Sequence[list[bytes]], lines: MovingLines) -> list[Statements]:
        """The statements of the files, of which the first has the motions; each as a list of its lines."""

    def words(self, text: bytes) -> frozenset[bytes]:
        """The words of the text of a motion."""

    def insertable(self, words: frozenset[bytes]) -> bool:
        """Whether a motion with these words may be inserted at all."""

    def opens_block(self, text: bytes) -> bool:
        """Whether a statement opens a block of motions, before which one may be inserted."""


def program_lines(program: Program) -> list[list[bytes]]:
    """The lines of each file without their ends, the mark and the names of the program."""
    return [_lines(document, program, number) for number, document in enumerate(program.documents)]


def _lines(document: Document, program: Program, number: int) -> list[bytes]:
    spans = [(one.start, one.stop, b"\x02") for one in program.names if one.file == number]
    if number == 0 and program.marker is not None:
        spans.append((program.marker.start, program.marker.stop, b""))
    parts, last = [], 0
    for start, stop, text in sorted(spans):
        parts += [document.raw[last:start], text]
        last = stop
    raw = b"".join([*parts, document.raw[last:]]) if spans else document.raw
    return raw.removeprefix(b"\xef\xbb\xbf").split(b"\n")
