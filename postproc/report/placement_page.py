"""The page of a placement: the text of the terminal, and the objective over x and y."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

from markupsafe import Markup

from postproc.report.page import FINDINGS, finding_rows, linked, rendered
from postproc.report.page_results import shown
from postproc.report.page_words import badge
from postproc.report.placement import Placement, checked_words, facts, tables, verdict
from postproc.report.placement_picture import placement_picture


def placement_page(done: Placement, links: Mapping[str, str]) -> bytes:
    """One page; links: what is beside it, words -> relative path."""
    drawing = placement_picture(done, "svg")
    sentence, checked = verdict(done), checked_words(done.shapes)
    return rendered(
        "result.html.j2",
        goes=False,
        what="placement",
        title=", ".join(Path(name).name for name in done.programs),
        verdict=f"{sentence[0].upper()}{sentence[1:]}.",
        words=[f"{checked[0].upper()}{checked[1:]}."],
        badge=badge(done.exit, None),
        facts=list(facts(done)),
        tables=[one for one in map(shown, tables(done)) if one.rows],
        notes=[],
        drawing=Markup("data:image/svg+xml;base64," + base64.b64encode(drawing).decode("ascii"))
        if drawing
        else "",
        seen="the objective over x and y with all else as at the best place; the present and the best place",
        findings=finding_rows(done.findings),
        more_findings=max(0, len(done.findings) - FINDINGS),
        digests={done.robot: done.digest},
        links=linked(links),
    )
