"""Comments: what speaks to this tool, and the mark of a compensated program."""

from __future__ import annotations

import re

from postproc.base.byte_search import find_word
from postproc.base.document import Document, Span
from postproc.base.findings import Finding
from postproc.languages.core.comments_in_force import SPEAKS, ShownComments
from postproc.languages.dialect import MARK
from postproc.languages.rapid.declared_data import walk
from postproc.languages.rapid.module_rows import ModuleRows
from postproc.languages.rapid.propagation import Propagation
from postproc.languages.rapid.syntax_tree import Remark
from postproc.toolpath import Annotation, ProgramComments
from postproc.toolpath.meant_comments import meant_to_speak

_MARKER = re.compile(rb"[ \t]*![ \t]*" + MARK.encode() + rb"[^\r\n]*")


def put_remarks(
    document: Document, flow: Propagation, rows: ModuleRows
) -> tuple[ProgramComments, list[Finding]]:
    """The comments at the rows before which they are run first.

    A motion that runs with another FORCE or COMPENSATE comment than the row before it has, gets that comment again;
    one that runs without any after such a row is refused.
    """
    notes: list[tuple[int, int, Annotation]] = []
    for order, (remark, row) in enumerate(flow.passed.values()):
        if SPEAKS.match(remark.text):
            notes.append((row, order, _annotation(document, row, remark)))
    shown = ShownComments()
    passed = iter(flow.passed.values())
    coming = next(passed, None)
    for row, stop, fact in rows.each():
        while coming is not None and coming[1] <= row:
            shown.add(coming[0])
            coming = next(passed, None)
        for word, said in shown.others(fact.force, fact.switch):
            open_rows = (one for one in range(row, stop) if one not in rows.problems)
            if not isinstance(said, Remark):
                message = f"no {word} comment is in force, after motions with one"
                rows.refuse_all(list(open_rows), ("RAP006", message))
            elif (first := next(open_rows, None)) is not None:
                notes.append((first, len(flow.passed) + first, _annotation(document, first, said)))
                shown.add(said)
    notes.sort(key=lambda note: note[:2])
    annotations = tuple(note for _, _, note in notes)
    comments, findings = _others(document, flow, rows)
    return ProgramComments(annotations, comments), findings


def _annotation(document: Document, row: int, remark: Remark) -> Annotation:
    return Annotation(row, remark.text, document.place(remark.start)[0])


def _others(
    document: Document, flow: Propagation, rows: ModuleRows
) -> tuple[tuple[Annotation, ...], list[Finding]]:
    """Comments that say nothing to this tool, in the order of the text, and those that do but are never run."""
    found = list(flow.module.remarks)
    for routine in flow.module.routines:
        for statement in (*walk(routine.body), *walk(routine.handlers)):
            if isinstance(statement, Remark):
                found.append(statement)
    comments, findings = [], []
    for remark in sorted(found, key=lambda one: one.start):
        line, column = document.place(remark.start)
        if SPEAKS.match(remark.text):
            if remark.start not in flow.passed:
                message = f"the comment {remark.text[:40]!r} is where no statement is run"
                findings.append(Finding("RAP016", message, str(document.path), line, column))
        elif (remark.alone and remark.text and not remark.text.startswith(MARK)) or meant_to_speak(
            remark.text
        ):
            row = flow.passed.get(remark.start, (remark, 0))[1]
            comments.append(Annotation(row, remark.text, line))
    return tuple(comments), findings


def find_marker(raw: bytes) -> Span | None:
    """The first line that is the comment of a compensated program."""
    mark = MARK.encode()
    at = find_word(raw, mark)
    while at >= 0:
        start = max(raw.rfind(b"\n", 0, at), raw.rfind(b"\r", 0, at)) + 1
        found = _MARKER.match(raw, start)
        if found:
            blank = len(found[0]) - len(found[0].lstrip(b" \t"))
            return Span(0, start + blank, found.end())
        at = find_word(raw, mark, at + len(mark))
    return None
