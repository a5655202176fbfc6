"""Comments: what speaks to this tool, and the mark of a compensated program."""

from __future__ import annotations

from postproc.base.document import Document, Span
from postproc.base.findings import Finding
from postproc.languages.core.comments_in_force import SPEAKS, ShownComments
from postproc.languages.dialect import MARK
from postproc.languages.tp.tp_listing import TpListing
from postproc.languages.tp.tp_propagation import TpPropagation
from postproc.languages.tp.tp_rows import TpRows
from postproc.languages.tp.tp_statements import TpMove, TpRemark
from postproc.toolpath import Annotation, ProgramComments


def annotate(
    document: Document, listing: TpListing, run: TpPropagation, rows: TpRows
) -> tuple[ProgramComments, list[Finding]]:
    """The comments at the rows before which they are.

    A motion that runs with another FORCE or COMPENSATE comment than the last one in the text above it gets that comment
    again; one that runs without any below one in the text is refused.
    """
    annotations: list[Annotation] = []
    comments: list[Annotation] = []
    findings: list[Finding] = []
    shown = ShownComments()
    row = 0
    for at, one in enumerate(run.flow.statements):
        if isinstance(one, TpRemark):
            line = listing.statements[at].line
            if SPEAKS.match(one.text) is None:
                if one.text and not one.text.startswith(MARK):
                    comments.append(Annotation(row, one.text, line))
            elif run.before[at] is not None:
                annotations.append(Annotation(row, one.text, line))
                shown.add(one)
            else:
                message = f"the comment {one.text[:40]!r} is where no statement is run"
                findings.append(Finding("FTP016", message, str(document.path), *document.place(one.start)))
        elif rows.row_of[at] >= 0:
            row = int(rows.row_of[at])
            annotations += _repeated(rows, row, shown, document) if isinstance(one, TpMove) else []
            row += 1
    return ProgramComments(tuple(annotations), tuple(comments)), findings


def _repeated(rows: TpRows, row: int, shown: ShownComments, document: Document) -> list[Annotation]:
    """Comments in force at a row that are not the last ones in the text above."""
    state = rows.states[row]
    if state is None or row in rows.problems:
        return []
    found = []
    for word, said in shown.others(state.force, state.switch):
        if isinstance(said, TpRemark):
            found.append(Annotation(row, said.text, document.place(said.start)[0]))
            shown.add(said)
        else:
            rows.refuse(row, "FTP006", f"no {word} comment is in force, below one in the text")
    return found


def find_marker(listing: TpListing, run: TpPropagation) -> Span | None:
    """The first comment of a compensated program: its sign and its text."""
    raw = listing.raw
    for one in run.flow.statements:
        if isinstance(one, TpRemark) and one.text.startswith(MARK.strip()):
            stop = one.stop
            while raw[stop - 1] in b" \t":
                stop -= 1
            return Span(0, one.start, stop)
    return None
