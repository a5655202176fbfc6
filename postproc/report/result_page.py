"""The page of a result that is tables: the text of the terminal, and the picture where there is one."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from markupsafe import Markup
from rich.table import Table
from rich.text import Text

from postproc.base.findings import Finding
from postproc.report.page import FINDINGS, finding_rows, linked, rendered
from postproc.report.page_words import badge
from postproc.report.picture_colours import follow_colours


@dataclass(frozen=True)
class PageTable:
    """A table of a page.  heads: of its columns, with whether the column is on the right; rows: cells; a row with
    one cell is a heading."""

    heads: tuple[tuple[str, bool], ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, kw_only=True)
class ResultPage:
    """What a page shows.  what: it is of; title; verdict: in words, with more of them in ``words``; exit: of the
    command; facts: name and value; tables, as the terminal shows them; notes; drawing: SVG, and ``alt_text`` for who
    does not see it; findings; digests: of the inputs."""

    what: str
    title: str
    verdict: str
    exit: int
    facts: Iterable[tuple[str, str]]
    tables: Sequence[Table]
    findings: Sequence[Finding]
    words: Sequence[str] = ()
    notes: Sequence[str] = ()
    drawing: bytes = b""
    alt_text: str = ""
    digests: Mapping[str, str] = field(default_factory=dict)

    def html(self, links: Mapping[str, str]) -> bytes:
        """The page; links: what is beside it, words -> relative path."""
        drawing = base64.b64encode(follow_colours(self.drawing)).decode("ascii") if self.drawing else ""
        return rendered(
            "result.html.j2",
            goes=False,
            what=self.what,
            title=self.title,
            verdict=self.verdict,
            words=list(self.words),
            badge=badge(self.exit, None),
            facts=list(self.facts),
            tables=[one for one in map(shown, self.tables) if one.rows],
            notes=list(self.notes),
            drawing=Markup(f"data:image/svg+xml;base64,{drawing}") if drawing else "",
            alt_text=self.alt_text,
            findings=finding_rows(self.findings),
            more_findings=max(0, len(self.findings) - FINDINGS),
            digests=self.digests,
            links=linked(links),
        )


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


def _plain(cell: object) -> str:
    """The text of a cell of a terminal's table."""
    return cell.plain if isinstance(cell, Text) else Text.from_markup(str(cell)).plain
