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
from postproc.languages.gcode.comments_passed import CommentPassed, varying_comments
from postproc.languages.gcode.execution import Execution
from postproc.languages.gcode.execution_flow import ExecutionFlow, FlowReason
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
_DELETED = re.compile(rb"[ \t]*+(?:N[ \t]*+\d++[ \t]*+)?/", re.I)


class Remarks(NamedTuple):
    annotations: tuple[Annotation, ...]
    comments: tuple[Annotation, ...]
    marker: Span | None
    marker_at: Span
    varying: Bools
    """(N,) motions at which it differs with the path of the program which FORCE or COMPENSATE comment is in force."""


def remarks(
    document: Document, source: Source, steps: Ints, execution: Execution, flow: ExecutionFlow
) -> Remarks:
    """``steps`` (N,): blocks of ``source`` that are the motions."""
    raw, run = document.raw, source.blocks.line
    comments = source.comments
    if execution.order is None:
        at = np.searchsorted(run, comments[:, 2])
        rows = np.searchsorted(run[steps], comments[:, 2])
    else:
        which, at = _passed(comments, execution.text.blocks.line, execution.order, execution)
        comments, rows = comments[which], np.searchsorted(steps, at)
    marker = _marker(raw, source.comments)
    lines = comments[:, 2]
    apart, alone = np.ones(0, np.bool_), np.ones(0, np.bool_)
    if len(lines):
        apart = ~np.isin(lines, source.blocks.line[source.blocks.wordy])
        alone = np.append(run, -1)[at] != lines
    may_pass = _conditional(at, alone, execution, flow)
    speaking, others, passed = [], [], []
    for place, ((start, stop), row, own) in enumerate(
        zip(comments[:, :2].tolist(), rows.tolist(), apart.tolist(), strict=True)
    ):
        said = _text(raw[start:stop])
        if marker is not None and start == marker.start:
            continue
        one = Annotation(row, said, int(lines[place]))
        if SPEAKS.match(said):
            sure = not may_pass[place] and not _slash(raw, start)
            speaking.append(one)
            passed.append(CommentPassed(one, int(at[place]), bool(alone[place]), sure))
        elif said and (own or meant_to_speak(said)):
            others.append(one)
    first = head(raw)
    varying = varying_comments(passed, execution, flow)[steps]
    return Remarks(tuple(speaking), tuple(others), marker, Span(0, first, first), varying)


def _slash(raw: bytes, start: int) -> bool:
    """Whether the line of the comment at ``start`` begins with a slash: it may be passed over."""
    return _DELETED.match(raw, raw.rfind(b"\n", 0, start) + 1, start) is not None


def _conditional(at: Ints, alone: Bools, execution: Execution, flow: ExecutionFlow) -> Bools:
    """(C,) comments, at steps ``at`` (C,), that the run may pass or not wherever it comes by; alone (C,): no block is
    in their line."""
    reason = np.append(flow.reason, FlowReason.NONE)
    if execution.followed:
        return np.asarray(~alone & (reason[at] == FlowReason.DELETED))
    inside = reason == FlowReason.FLOW
    before = (inside & np.append(False, inside[:-1])) | np.append(flow.entered, False)
    return np.asarray(np.where(alone, before[at], (inside | (reason == FlowReason.DELETED))[at]))


def _text(comment: bytes) -> str:
    said = comment.decode("latin-1")
    return (said[1:-1] if said[0] == "(" and said[-1] == ")" else said[1:]).strip()


def _marker(raw: bytes, comments: Ints) -> Span | None:
    """The first comment that says that the program is compensated."""
    if MARK.encode() not in raw:
        return None
    spans = comments[:, :2].tolist()
    return next((Span(0, *span) for span in spans if _text(raw[slice(*span)]).startswith(MARK)), None)


def _passed(comments: Ints, lines: Ints, order: Ints, execution: Execution) -> tuple[Ints, Ints]:
    """(K,) the comments in the order in which the run passes them, each as often as it does, and (K,) the steps before
    which it does; comments (C, 3); lines (T,): of the blocks as they are written, of which ``order`` (E,) runs one a
    step.

    A comment is passed before the block of its line, or before the next one, where that is not reached by a jump."""
    block = np.searchsorted(lines, comments[:, 2])
    inside = np.flatnonzero(block < len(lines))
    alone = np.ones(len(comments), np.bool_)
    alone[inside] = lines[block[inside]] != comments[inside, 2]
    jumped = np.zeros(len(order) + 1, np.bool_)
    jumped[execution.arrivals] = True
    by_block = np.argsort(order, kind="stable")
    first, behind = (np.searchsorted(order[by_block], block, side=side) for side in ("left", "right"))
    often = behind - first
    which = np.repeat(np.arange(len(comments)), often)
    at = by_block[np.arange(len(which)) + np.repeat(first - np.cumsum(often) + often, often)]
    passes = ~(alone[which] & jumped[at])
    found = [np.stack([which[passes], at[passes]], axis=1)]
    before: dict[int, list[int]] = {}
    for comment in np.flatnonzero(alone).tolist():
        before.setdefault(int(block[comment]), []).append(comment)
    for step, reached in execution.reached.tolist():
        if reached in before:
            found.append(np.array([[comment, step] for comment in before[reached]]))
    passed = np.concatenate(found)
    passed = passed[np.lexsort((passed[:, 0], passed[:, 1]))]
    return passed[:, 0], passed[:, 1]


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
