"""Comments of a program: what speaks to this tool, the mark of a compensated program, and where that goes."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.document import Document, Span
from postproc.languages.dialect import MARK
from postproc.languages.gcode.source import Source
from postproc.toolpath import Annotation

_SPEAKS = re.compile(r"(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)
_HEAD = re.compile(
    rb"[ \t]*+(?:%[^\r\n]*+|;[ \t]*+\$PATH[ \t]*+=[^\r\n]*+"
    rb"|(?:O|:)[ \t]*+(?:\d++|<[^>\r\n]*+>)[ \t]*+(?:\([^)\r\n]*+\)|;[^\r\n]*+)?[ \t]*+)"
    rb"\r?(?:\n|\Z)",
    re.I,
)
_EMPTY = re.compile(rb"[ \t\r]*+\n")


class Remarks(NamedTuple):
    annotations: tuple[Annotation, ...]
    comments: tuple[Annotation, ...]
    marker: Span | None
    marker_at: Span


def remarks(document: Document, source: Source, line: Ints) -> Remarks:
    """``line`` (N,): lines of the motions, ascending."""
    raw, marker = document.raw, None
    spans = source.comments[:, :2]
    lines = source.comments[:, 2]
    rows = np.searchsorted(line, lines)
    alone = ~np.isin(lines, source.blocks.line[source.blocks.wordy]) if len(lines) else lines
    speaking, others = [], []
    for (start, stop), number, row, own in zip(
        spans.tolist(), lines.tolist(), rows.tolist(), alone.tolist(), strict=True
    ):
        said = raw[start:stop].decode("latin-1")
        said = (said[1:-1] if said[0] == "(" and said[-1] == ")" else said[1:]).strip()
        if marker is None and said.startswith(MARK):
            marker = Span(0, start, stop)
        elif _SPEAKS.match(said):
            speaking.append(Annotation(row, said, number))
        elif own and said:
            others.append(Annotation(row, said, number))
    at = head(raw)
    return Remarks(tuple(speaking), tuple(others), marker, Span(0, at, at))


def head(raw: bytes) -> int:
    """Where the lines of ``%`` and the program's number, with which a program starts, end."""
    at = end = len(BOM_UTF8) if raw.startswith(BOM_UTF8) else 0
    while True:
        found = _HEAD.match(raw, at)
        if found is not None:
            at = end = found.end()
        elif (found := _EMPTY.match(raw, at)) is not None:
            at = found.end()
        else:
            return end
        if at >= len(raw):
            return end
