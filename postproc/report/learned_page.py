"""The page of ``compensate learn``: the part with its errors, the causes before and after, the parts one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from rich.table import Table

from postproc.base.units import MM
from postproc.learning.unobserved import indistinct, products
from postproc.report.learned import GROUPS, MOST_PRODUCTS, Learned, cause_entry
from postproc.report.learned_picture import PartShape, learned_picture
from postproc.report.learned_terminal import headline, rows
from postproc.report.result_page import ResultPage

WORST = 20
"""Points of the table of the largest remaining errors."""


def learned_page(learned: Learned, shape: PartShape, links: Mapping[str, str]) -> bytes:
    """One page; links: what is beside it, words -> relative path."""
    sentence = headline(learned)
    return ResultPage(
        what="measured part",
        title=Path(learned.program).name,
        verdict=f"{sentence[0].upper()}{sentence[1:]}.",
        words=[_sentence(learned)],
        exit=learned.exit,
        facts=rows(learned),
        tables=[
            table
            for table in (_causes(learned), _parts(learned), _products(learned), _worst(learned))
            if table.row_count
        ],
        notes=list(_notes(learned)),
        drawing=learned_picture(learned, shape, "svg"),
        alt_text="deviation of each point: measured after the alignment, explained by causes and smooth error, and"
        " remaining, on one scale",
        findings=learned.findings,
        digests=dict(learned.data),
    ).html(links)


def _sentence(learned: Learned) -> str:
    promise = learned.promise
    words = (
        f"The error of this part is {promise.before / MM:.4f} mm RMS; that of the next one is expected to be"
        f" {promise.after / MM:.4f} mm, and lies between {promise.lower / MM:.4f} and {promise.upper / MM:.4f} mm in"
        " 95 of 100 cases."
    )
    return words if promise.better else f"{words} That is no better, so no next program is written."


def _causes(learned: Learned) -> Table:
    """Every cause with what was known of it before and what is known now."""
    table = Table("cause", "kind")
    for head in ("before", "lower, before", "upper, before", "after", "lower, after", "upper, after"):
        table.add_column(head, justify="right")
    table.add_column("unit")
    table.add_column("interval narrower by, %", justify="right")
    for group in GROUPS:
        for cause, value, deviation in (one for one in learned.causes() if one[0].group == group):
            after = cause_entry(cause, value, deviation)
            before = cause_entry(cause, 0.0, cause.deviation)
            numbers = [f"{one[key]:.4g}" for one in (before, after) for key in ("value", "lower", "upper")]
            unit = "factor" if cause.is_share() else str(after["unit"])
            table.add_row(cause.name, group, *numbers, unit, f"{100 * (1 - deviation / cause.deviation):.0f}")
    return table


def _parts(learned: Learned) -> Table:
    table = Table("part", "file", "program, SHA-256")
    for head in ("error, mm RMS", "promised at least", "promised at most"):
        table.add_column(head, justify="right")
    for number, one in enumerate(learned.history, 1):
        ends = ["", ""] if one.promised is None else [f"{end / MM:.4f}" for end in one.promised]
        table.add_row(str(number), one.file, one.program[:12], f"{one.rms / MM:.4f}", *ends)
    return table


def _products(learned: Learned) -> Table:
    """Pairs of which only the product is known."""
    table = Table("cause", "times")
    table.add_column("product known to, %", justify="right")
    for one, other, width in products(learned.attribution)[:MOST_PRODUCTS]:
        table.add_row(one, other, f"{100 * width:.1f}")
    return table


def _worst(learned: Learned) -> Table:
    """The points of which most remains."""
    result = learned.attribution
    table = Table("file", "feature")
    heads = (
        "row",
        "line of the program",
        "x, mm",
        "y, mm",
        "z, mm",
        "measured, mm",
        "explained, mm",
        "remaining, mm",
    )
    for head in heads:
        table.add_column(head, justify="right")
    table.add_column("outlier")
    explained = result.by_causes + result.by_field
    aligned = result.deviation - result.by_alignment
    for k in np.argsort(-np.abs(learned.remaining), kind="stable")[:WORST].tolist():
        place = [f"{one:.1f}" for one in learned.in_base[k] / MM]
        sizes = [f"{one[k] / MM:.4f}" for one in (aligned, explained, learned.remaining)]
        table.add_row(
            learned.data[int(learned.file[k])][0], learned.feature[k] or learned.operation[k], str(learned.line[k]),
            str(learned.program_line[k]), *place, *sizes, "" if result.kept[k] else "outlier",
        )  # fmt: skip
    return table


def _notes(learned: Learned) -> Iterator[str]:
    """What this part does not determine."""
    words = indistinct(learned.attribution)
    if words:
        yield f"{words[0].upper()}{words[1:]}."
    rivals = learned.attribution.rivals[:3]
    if rivals:
        named = ", ".join(f"{one.name} exp({one.gain:.1f})" for one in rivals)
        yield f"Likelihood of the deviations with an effect that is not named, to that without it: {named}."
