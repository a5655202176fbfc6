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
    spans, lines = comments[:, :2], comments[:, 2]
    alone = np.ones(0, np.bool_)
    if len(lines):
        alone = ~np.isin(lines, source.blocks.line[source.blocks.wordy])
    speaking, others, conditional = [], [], []
    for (start, stop), number, row, own, may_pass in zip(
        spans.tolist(),
        lines.tolist(),
        rows.tolist(),
        alone.tolist(),
        _conditional(at, alone, execution, flow).tolist(),
        strict=True,
    ):
        said = _text(raw[start:stop])
        if marker is not None and start == marker.start:
            continue
        if SPEAKS.match(said):
            speaking.append(Annotation(row, said, number))
            conditional.append(may_pass)
        elif said and (own or meant_to_speak(said)):
            others.append(Annotation(row, said, number))
    first = head(raw)
    varying = _varying(speaking, conditional, len(steps))
    return Remarks(tuple(speaking), tuple(others), marker, Span(0, first, first), varying)


def _conditional(at: Ints, alone: Bools, execution: Execution, flow: ExecutionFlow) -> Bools:
    """(C,) comments, at steps ``at`` (C,), that the run may pass or not; alone (C,): no words are in their line."""
    n = len(flow.reason)
    uncertain = np.append(np.isin(flow.reason, (FlowReason.FLOW, FlowReason.DELETED)), False)
    if execution.followed:
        edge = np.zeros(n + 2, np.int32)
        np.add.at(edge, execution.perhaps[:, 0], 1)
        np.add.at(edge, execution.perhaps[:, 1] + 1, -1)
        before = np.cumsum(edge)[: n + 1] > 0
    else:
        inside = np.append(flow.reason == FlowReason.FLOW, False)
        before = (inside & np.append(False, inside[:-1])) | np.append(flow.entered, False)
    return np.asarray(np.where(alone, before[at], uncertain[at]))


def _varying(speaking: list[Annotation], conditional: list[bool], count: int) -> Bools:
    """(N,) see ``Remarks.varying``: behind a comment that may be passed or not, up to one that is."""
    edge = np.zeros(count + 1, np.int32)
    for word in ("FORCE", "COMPENSATE"):
        since, said = -1, ""
        for one, may_pass in zip(speaking, conditional, strict=True):
            if not one.text.upper().startswith(word):
                continue
            if not may_pass:
                if since >= 0:
                    edge[since] += 1
                    edge[one.row] -= 1
                since, said = -1, one.text
            elif since < 0 and one.text != said:
                since = one.row
        if since >= 0:
            edge[since] += 1
    return np.asarray(np.cumsum(edge)[:count] > 0)


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
