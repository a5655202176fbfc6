"""Comments of a program: what speaks to this tool, the mark of a compensated program, and where that goes."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.base.document import Document, Span
from postproc.languages.core.comments_in_force import SPEAKS
from postproc.languages.dialect import MARK
from postproc.languages.gcode.source import Source
from postproc.toolpath import Annotation
from postproc.toolpath.meant_comments import meant_to_speak

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


def remarks(
    document: Document, source: Source, steps: Ints, in_text_order: bool, in_other_file: Bools
) -> Remarks:
    """``steps`` (N,): blocks of ``source`` that are the motions; in_other_file (B,): those of other files."""
    raw, run = document.raw, source.blocks.line
    comments = source.comments
    if in_text_order:
        rows = np.searchsorted(run[steps], comments[:, 2])
    else:
        comments, rows = _passed(comments, run, steps, in_other_file)
    marker = _marker(raw, source.comments)
    spans, lines = comments[:, :2], comments[:, 2]
    alone = ~np.isin(lines, source.blocks.line[source.blocks.wordy]) if len(lines) else lines
    speaking, others = [], []
    for (start, stop), number, row, own in zip(
        spans.tolist(), lines.tolist(), rows.tolist(), alone.tolist(), strict=True
    ):
        said = _text(raw[start:stop])
        if marker is not None and start == marker.start:
            continue
        if SPEAKS.match(said):
            speaking.append(Annotation(row, said, number))
        elif said and (own or meant_to_speak(said)):
            others.append(Annotation(row, said, number))
    at = head(raw)
    return Remarks(tuple(speaking), tuple(others), marker, Span(0, at, at))


def _text(comment: bytes) -> str:
    said = comment.decode("latin-1")
    return (said[1:-1] if said[0] == "(" and said[-1] == ")" else said[1:]).strip()


def _marker(raw: bytes, comments: Ints) -> Span | None:
    """The first comment that says that the program is compensated."""
    if MARK.encode() not in raw:
        return None
    spans = comments[:, :2].tolist()
    return next((Span(0, *span) for span in spans if _text(raw[slice(*span)]).startswith(MARK)), None)


def _passed(comments: Ints, run: Ints, steps: Ints, in_other_file: Bools) -> tuple[Ints, Ints]:
    """The comments in the order in which the run passes them, each as often as it does; the motions after them."""
    if not len(comments) or not len(run):
        return comments, comments[:, 2]
    lines = comments[:, 2]
    cuts = np.flatnonzero((np.diff(run) <= 0) & ~in_other_file[1:]) + 1
    which, at = [], []
    for start, stop in zip(np.append(0, cuts).tolist(), np.append(cuts, len(run)).tolist(), strict=True):
        low, high = np.searchsorted(lines, [run[start], run[stop - 1] + 1]).tolist()
        if start == 0 and run[0] == run.min():
            low = 0  # those at the head of the file
        which.append(np.arange(low, high))
        at.append(start + np.searchsorted(run[start:stop], lines[low:high]))
    return comments[np.concatenate(which)], np.searchsorted(steps, np.concatenate(at))


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
