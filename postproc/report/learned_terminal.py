"""The result of ``compensate learn`` on a terminal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.report.learned import GROUPS, Learned, cause_entry
from postproc.report.terminal import show_findings, show_rows

WORDS = {
    "nothing_missing": "the known causes explain this part",
    "named": "the known causes and {named} explain this part",
    "partly_named": "{named} is a cause; a part of the error has no name",
    "ambiguous": "one of several effects explains a part of the error: {alternatives}",
    "unknown": "a smooth part of the error has no name",
}


MOST_ALTERNATIVES = 4
NOTHING = 1e-3
"""Share of its standard deviation below which a value is shown as 0."""


def headline(learned: Learned) -> str:
    """The verdict in words."""
    result = learned.attribution
    named = " and ".join(one.name for one in result.named)
    shown, others = result.alternatives[:MOST_ALTERNATIVES], result.alternatives[MOST_ALTERNATIVES:]
    alternatives = " or ".join(shown) + (f" or {len(others)} more" if others else "")
    return WORDS[result.verdict].format(named=named, alternatives=alternatives)


def show_learned(console: Console, learned: Learned, verbose: bool = False) -> None:
    """Verdict, figures, causes and findings."""
    console.print(Text(sanitize(headline(learned)), style="bold"), soft_wrap=True)
    show_rows(console, ((key, Text(sanitize(value))) for key, value in rows(learned)))
    console.print(_causes(learned, verbose))
    show_findings(console, learned.findings, verbose)
    for path in learned.outputs:
        console.print(Text(sanitize(f"wrote {path}")), soft_wrap=True)


def rows(learned: Learned) -> Iterator[tuple[str, str]]:
    """The figures, with what they are."""
    result = learned.attribution
    kept = result.kept
    yield "program", learned.program
    yield "data", ", ".join(name for name, _ in learned.data)
    yield (
        "points",
        f"{learned.measured} measured, {int(kept.sum())} used, {int((~kept).sum())} outliers",
    )
    aligned = (result.deviation - result.by_alignment)[kept]
    yield "error", f"{_rms(aligned)} mm RMS measured, {learned.residual_rms / MM:.4f} mm remain unexplained"
    smooth = result.by_field
    if np.any(smooth):
        yield "smooth", f"{_rms(smooth)} mm RMS, {result.surface.length / MM:.0f} mm long, without a name"
    if len(learned.history) > 1:
        for number, one in enumerate(learned.history, 1):
            ends = one.promised
            words = "" if ends is None else f", {ends[0] / MM:.4f} to {ends[1] / MM:.4f} promised"
            yield f"part {number}", f"{one.rms / MM:.4f} mm RMS{words}: {one.file}"
    promise = learned.promise
    yield (
        "promise",
        f"{promise.before / MM:.4f} -> {promise.after / MM:.4f} mm RMS on the next part,"
        f" {promise.lower / MM:.4f} to {promise.upper / MM:.4f} (95 %)",
    )


def _rms(values: np.ndarray) -> str:
    return f"{float(np.sqrt(np.mean(values**2))) / MM:.4f}"


def _causes(learned: Learned, verbose: bool) -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("cause")
    for name in ("value", "95 % interval", "before"):
        table.add_column(name, justify="right")
    entries = [(cause, value, deviation) for cause, value, deviation in learned.causes()]
    for group in GROUPS:
        for cause, value, deviation in entries:
            turned = cause.unit == "rad" and cause.group == "force"
            if cause.group != group or (turned and not verbose):
                continue
            nothing = not cause.is_share() and abs(value) < NOTHING * deviation
            entry = cause_entry(cause, 0.0 if nothing else value, deviation)
            unit = "x" if entry["unit"] == "1" else f" {entry['unit']}"
            before = (
                f"1 +- {entry['before_ci95']:.2f}"
                if entry["unit"] == "1"
                else f"0 +- {entry['before_ci95']:.3g}"
            )
            table.add_row(
                Text(sanitize(cause.name)),
                f"{entry['value']:.4g}{unit}",
                f"{entry['lower']:.4g} .. {entry['upper']:.4g}",
                before,
            )
    return table
