"""Pages of results that are tables: the text of the terminal, and the picture where there is one."""

from __future__ import annotations

from collections.abc import Mapping

from rich.table import Table

from postproc.base.units import MM
from postproc.report import diagnosed_terminal, identified_terminal
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_detection import detection_table
from postproc.report.diagnosed_picture import diagnosed_picture
from postproc.report.diagnosed_words import headline, paragraph
from postproc.report.identified import Identified
from postproc.report.identified_picture import identified_picture
from postproc.report.identified_terminal import verdict
from postproc.report.mapped import Mapped, map_rows, number_list
from postproc.report.picture import picture
from postproc.report.result_page import ResultPage


def identified_page(result: Identified, links: Mapping[str, str]) -> bytes:
    """The page of an identification."""
    return ResultPage(
        what="identification",
        title=result.robot,
        verdict=verdict(result),
        exit=result.exit,
        facts=identified_terminal.fact_rows(result),
        tables=[identified_terminal.parameter_table(result), identified_terminal.residual_table(result)],
        notes=[
            *identified_terminal.note_lines(result, True),
            *identified_terminal.outlier_lines(result, True),
        ],
        drawing=identified_picture(result, "svg"),
        alt_text="size of each residual before and after, by joint, direction, load and order; as in the tables",
        findings=result.findings,
        digests={result.robot: result.robot_digest, **dict(result.data)},
    ).html(links)


def diagnosed_page(result: Diagnosed, links: Mapping[str, str]) -> bytes:
    """The page of a diagnosis."""
    terminal = diagnosed_terminal
    makers = (
        terminal.parameter_table,
        terminal.evidence_table,
        terminal.alternatives_table,
        terminal.refitted_table,
        terminal.places_table,
        terminal.residual_table,
        detection_table,
        terminal.next_poses_table,
    )
    return ResultPage(
        what="diagnosis",
        title=result.robot,
        verdict=headline(result),
        words=[paragraph(result)],
        exit=result.exit,
        facts=diagnosed_terminal.fact_rows(result),
        tables=[make(result, True) for make in makers],
        drawing=diagnosed_picture(result, "svg"),
        alt_text="gap at each pose before and after, residual patterns, evidence of each candidate",
        findings=result.findings,
        digests={result.robot: result.robot_digest, **dict(result.data)},
    ).html(links)


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
    return ResultPage(
        what="map",
        title=mapped.robot,
        verdict=verdict,
        exit=mapped.exit,
        facts=map_rows(mapped),
        tables=[table],
        drawing=picture(mapped, "svg") if drawn else b"",
        alt_text="deflection over the workspace; the CSV has every cell",
        findings=mapped.findings,
        digests={mapped.robot: mapped.digest},
    ).html(links)


def _place(mapped: Mapped, row: int) -> str:
    """Coordinates [mm] of a cell."""
    return number_list(mapped.place(row).values())
