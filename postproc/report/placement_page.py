"""The page of a placement: the text of the terminal, and the objective over x and y."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from postproc.report.placement import Placement, checked_words, facts, tables, verdict
from postproc.report.placement_picture import placement_picture
from postproc.report.result_page import ResultPage


def placement_page(done: Placement, links: Mapping[str, str]) -> bytes:
    """One page; links: what is beside it, words -> relative path."""
    sentence, checked = verdict(done), checked_words(done.shapes)
    return ResultPage(
        what="placement",
        title=", ".join(Path(name).name for name in done.programs),
        verdict=f"{sentence[0].upper()}{sentence[1:]}.",
        words=[f"{checked[0].upper()}{checked[1:]}."],
        exit=done.exit,
        facts=list(facts(done)),
        tables=tables(done),
        drawing=placement_picture(done, "svg"),
        alt_text="the objective over x and y with all else as at the best place; the present and the best place",
        findings=done.findings,
        digests={done.robot: done.digest},
    ).html(links)
