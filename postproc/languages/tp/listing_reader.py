"""Reads a TP listing: its statements, what holds where, its motions."""

from __future__ import annotations

from codecs import BOM_UTF8
from functools import partial

import numpy as np

from postproc.base.document import Document, Span
from postproc.base.findings import Finding
from postproc.base.memory import without_garbage_collection
from postproc.languages.core.row_facts import not_understood, shown
from postproc.languages.dialect import EditSyntax, Program, ReadingSettings
from postproc.languages.tp.position_data import TpPositions, read_positions
from postproc.languages.tp.statement_flow import StatementFlow
from postproc.languages.tp.statement_parsing import parse_statements
from postproc.languages.tp.tp_listing import TpListing, read_listing
from postproc.languages.tp.tp_propagation import TpPropagation, TpState
from postproc.languages.tp.tp_remarks import find_marker
from postproc.languages.tp.tp_rows import RowBuilder, TpRows, read_points
from postproc.languages.tp.tp_source_map import TpSourceMap
from postproc.languages.tp.tp_toolpath import row_finding, toolpath_of


@without_garbage_collection()
def read(documents: tuple[Document, ...], settings: ReadingSettings) -> Program:
    """The program of a file; never raises on its content."""
    document = documents[0]
    listing = read_listing(document.raw)
    positions, strange_points = _positions(listing)
    flow = StatementFlow(parse_statements(listing.statements))
    problem = _structure_problem(listing, flow, strange_points)
    if flow.problem is None and problem is not None:
        flow.problem = (0, problem[1])
    run = TpPropagation(flow)
    run.run(TpState(base=settings.initial.base, tool=settings.initial.tool))
    rows = RowBuilder(document, listing, positions, run).build()
    path, runs, findings = toolpath_of(document, listing, run, rows)
    findings += _structure(document, listing, problem)
    findings += _statements(document, listing, run)
    findings += _assumed(document, rows)
    places = TpSourceMap.of(listing, positions, rows, runs, read_points(flow.statements))
    at = max(listing.main, len(BOM_UTF8) if document.raw.startswith(BOM_UTF8) else 0)
    return Program(
        dialect="tp",
        documents=documents,
        toolpath=path,
        text=places if settings.places else None,
        findings=tuple(sorted(findings, key=lambda finding: (finding.line, finding.column))),
        marker=find_marker(listing, run),
        marker_at=Span(0, at, at),
        names=() if listing.name[0] < 0 else (Span(0, *listing.name),),
        edit_syntax=EditSyntax(numbers_after=b"=[;N", comment=b"!", points=listing.point_lines),
    )


def _positions(listing: TpListing) -> tuple[TpPositions, list[int]]:
    start, stop = listing.points
    if start < 0:
        return TpPositions(listing.raw), []
    first = listing.raw.find(b"\n", start) + 1 or len(listing.raw)
    return read_positions(listing.raw, first, stop if stop >= 0 else len(listing.raw))


def _structure_problem(
    listing: TpListing, flow: StatementFlow, strange_points: list[int]
) -> tuple[int, str] | None:
    """Where the structure of the file is not understood, and why."""
    if listing.main < 0:
        return None
    if listing.points[1] < 0:
        return len(listing.raw) - 1, "the file has no /POS, or no /END after it"
    if listing.unreadable:
        return min(listing.unreadable), "text in /MN is no statement"
    if strange_points:
        return strange_points[0], "text in /POS is no point"
    opened = np.flatnonzero(listing.statements.columns()[:, -1] == 0)
    if len(opened):
        return listing.statements[int(opened[0])].line_start, "a statement has no ; at its end"
    if flow.problem is not None:
        at, why = flow.problem
        return listing.statements[at].line_start, why
    return None


def _structure(document: Document, listing: TpListing, problem: tuple[int, str] | None) -> list[Finding]:
    if listing.main < 0:
        return [_finding(document, "FTP018", "the file has no /MN", 0)]
    found = []
    if problem is not None:
        found.append(_finding(document, "FTP007", problem[1], max(problem[0], 0)))
    span = listing.attributes.get(b"LINE_COUNT")
    if span is not None and listing.raw[span[0] : span[1]].strip() not in (b"0", b"%d" % listing.count):
        message = f"LINE_COUNT is {shown(listing.raw[span[0] : span[1]])}, and /MN has {listing.count} lines"
        found.append(_finding(document, "FTP019", message, span[0]))
    return found


def _statements(document: Document, listing: TpListing, run: TpPropagation) -> list[Finding]:
    """Statements that are not understood, and calls."""
    unread = [listing.statements[at] for at in sorted(run.unread)]
    found = not_understood(
        [(one.text, one.line_start) for one in unread], partial(_finding, document, "FTP001")
    )
    names: set[str] = set()
    for at, name in sorted(run.calls.items()):
        if name not in names:
            message = f"{name[:40]} is not in this file: it may move the robot and select frames"
            found.append(_finding(document, "FTP010", message, listing.statements[at].line_start))
        names.add(name)
    return found


def _assumed(document: Document, rows: TpRows) -> list[Finding]:
    """That frames of points were taken, once."""
    for row, name in rows.assumed.items():
        more = f", and at {len(rows.assumed) - 1} other motions" if len(rows.assumed) > 1 else ""
        message = f"{name}_NUM is not known here{more}; the frames of the points are taken"
        return [row_finding(document, rows, row, "FTP017", message)]
    return []


def _finding(document: Document, code: str, message: str, at: int) -> Finding:
    return Finding(code, message, str(document.path), *document.place(at))
