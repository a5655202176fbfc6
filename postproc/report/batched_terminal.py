"""The summary of a batch on a terminal: one line a program, then what there is to say."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.printable import printable
from postproc.report.batched import DONE, FAILED, NOT_RUN, UNCHANGED, Batched, Outcome
from postproc.report.terminal import show_findings
from postproc.report.words import count

_STYLES = {DONE: "", UNCHANGED: "dim", FAILED: "bold red", NOT_RUN: "yellow"}


def show_batched(console: Console, batched: Batched, verbose: bool = False) -> None:
    """The table of a batch, why programs failed, and where the summary is."""
    table = Table(box=None, pad_edge=False)
    for head in ("program", "state"):
        table.add_column(head, overflow="fold")
    for head in ("motions", "corrected", "left", "before mm", "after mm"):
        table.add_column(head, justify="right")
    table.add_column("deserves a look", overflow="fold")
    for outcome in batched.outcomes:
        table.add_row(*_row(outcome), style="yellow" if outcome.exit == 3 else _STYLES[outcome.state])
    console.print(table)
    for outcome in batched.outcomes:
        if outcome.exit == 1 or verbose:
            show_findings(console, outcome.findings, verbose)
    if batched.passed_over:
        console.print(f"passed over, no programs: {count(len(batched.passed_over), 'file')}")
        for path in batched.passed_over if verbose else ():
            console.print(Text("    " + printable(path)), soft_wrap=True)
    console.print(closing(batched), markup=False)
    for path in batched.outputs:
        console.print(Text(f"wrote {printable(path)}"), soft_wrap=True)


def closing(batched: Batched) -> str:
    """``40 programs: 38 done, 2 failed``"""
    counts = ", ".join(f"{number} {state}" for state, number in batched.counts.items() if number)
    return f"{count(len(batched.outcomes), 'program')}: {counts}, in {batched.seconds:.1f} s"


def _row(outcome: Outcome) -> tuple[str, ...]:
    gravest = outcome.gravest
    return (
        escape(printable(outcome.name)),
        outcome.state,
        *(str(outcome.result.get(key, "-")) for key in ("motions", "corrected", "left")),
        _mm(outcome.figure("error_before_mm"), 3),
        _mm(outcome.figure("error_after_mm"), 4),
        "" if gravest is None else escape(gravest.code),
    )


def _mm(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
