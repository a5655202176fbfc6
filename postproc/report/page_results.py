"""Pages of results that are tables: the text of the terminal, and the picture where there is one."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from markupsafe import Markup
from rich.table import Table
from rich.text import Text

from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.report import diagnosed_terminal, identified_terminal
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_picture import diagnosed_picture
from postproc.report.diagnosed_words import headline, paragraph
from postproc.report.identified import Identified
from postproc.report.identified_picture import identified_picture
from postproc.report.identified_terminal import verdict
from postproc.report.mapped import Mapped, _list
from postproc.report.mapped import _rows as map_rows
from postproc.report.page import FINDINGS, finding_rows, linked, rendered
from postproc.report.page_words import badge
from postproc.report.picture import picture
from postproc.report.picture_colours import follow_colours


@dataclass(frozen=True)
class PageTable:
    """A table of a page.  heads: of its columns, with whether the column is on the right; rows: cells; a row with
    one cell is a heading."""

    heads: tuple[tuple[str, bool], ...]
    rows: tuple[tuple[str, ...], ...]


def shown(table: Table) -> PageTable:
    """The table that the terminal shows, for a page."""
    columns = [[_plain(cell) for cell in column.cells] for column in table.columns]
    names = [
        _plain(column.header) or ("note" if place else "what") for place, column in enumerate(table.columns)
    ]
    heads = tuple(
        (name, column.justify == "right") for name, column in zip(names, table.columns, strict=True)
    )
    rows = []
    for cells in zip(*columns, strict=True):
        rows.append(cells[:1] if len(cells) > 1 and not any(cells[1:]) else cells)
    return PageTable(heads, tuple(rows))


def identified_page(result: Identified, links: Mapping[str, str]) -> bytes:
    """The page of an identification."""
    return result_page(
        "identification",
        result.robot,
        verdict(result),
        [],
        result.exit,
        identified_terminal._rows(result),
        [identified_terminal._parameters(result), identified_terminal._residuals(result)],
        [*identified_terminal._notes(result, True), *identified_terminal._outliers(result, True)],
        identified_picture(result, "svg"),
        "size of each residual before and after, by joint, direction, load and order; the tables show the same",
        result.findings,
        {result.robot: result.robot_digest, **dict(result.data)},
        links,
    )


def diagnosed_page(result: Diagnosed, links: Mapping[str, str]) -> bytes:
    """The page of a diagnosis."""
    terminal = diagnosed_terminal
    makers = (
        terminal._parameters,
        terminal._evidence,
        terminal._alternatives,
        terminal._refitted,
        terminal._where,
        terminal._residuals,
        terminal._next_poses,
    )
    return result_page(
        "diagnosis",
        result.robot,
        headline(result),
        [paragraph(result)],
        result.exit,
        diagnosed_terminal._rows(result),
        [make(result, True) for make in makers],
        [],
        diagnosed_picture(result, "svg"),
        "gap at each pose before and after, residual patterns, evidence of each candidate",
        result.findings,
        {result.robot: result.robot_digest, **dict(result.data)},
        links,
    )


def mapped_page(mapped: Mapped, links: Mapping[str, str]) -> bytes:
    """The page of a map; without a picture where it is a single cell or nothing is in reach."""
    table = Table("")
    for head in ("min mm", "at x, y, z mm", "max mm", "at x, y, z mm"):
        table.add_column(head, justify="right")
    for quantity in mapped.quantities:
        if quantity.extremes:
            cells = ((f"{end.value / MM:.4f}", _place(mapped, end.row)) for end in quantity.extremes)
            table.add_row(quantity.title, *(cell for pair in cells for cell in pair))
    extremes = mapped.quantities[0].extremes
    drawn = extremes is not None and mapped.cells > 1
    verdict = (
        "No cell is in reach."
        if extremes is None
        else (
            f"This force deflects the tool by {extremes[0].value / MM:.3f} to {extremes[1].value / MM:.3f} mm:"
            f" least at {_place(mapped, extremes[0].row)}, most at {_place(mapped, extremes[1].row)} mm."
        )
    )
    return result_page(
        "map",
        mapped.robot,
        verdict,
        [],
        mapped.exit,
        map_rows(mapped),
        [table],
        [],
        picture(mapped, "svg") if drawn else b"",
        "deflection over the workspace; the CSV has every cell",
        mapped.findings,
        {mapped.robot: mapped.digest},
        links,
    )


def result_page(
    what: str,
    title: str,
    verdict: str,
    words: Iterable[str],
    exit: int,
    facts: Iterable[tuple[str, str]],
    tables: Iterable[Table],
    notes: Iterable[str],
    drawing: bytes,
    seen: str,
    findings: tuple[Finding, ...],
    digests: Mapping[str, str],
    links: Mapping[str, str],
) -> bytes:
    """A page: what it is of, its title and verdict in words, facts, tables, notes, a picture with what is ``seen`` on
    it, findings, and digests of its inputs."""
    return rendered(
        "result.html.j2",
        goes=False,
        what=what,
        title=title,
        verdict=verdict,
        words=list(words),
        badge=badge(exit, None),
        facts=list(facts),
        tables=[one for one in map(shown, tables) if one.rows],
        notes=list(notes),
        drawing=Markup(
            "data:image/svg+xml;base64," + base64.b64encode(follow_colours(drawing)).decode("ascii")
        )
        if drawing
        else "",
        seen=seen,
        findings=finding_rows(findings),
        more_findings=max(0, len(findings) - FINDINGS),
        digests=digests,
        links=linked(links),
    )


def _place(mapped: Mapped, row: int) -> str:
    """Coordinates [mm] of a cell."""
    return _list(mapped.place(row).values())


def _plain(cell: object) -> str:
    """The text of a cell of a terminal's table."""
    return cell.plain if isinstance(cell, Text) else Text.from_markup(str(cell)).plain
