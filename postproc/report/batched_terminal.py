"""The summary of a batch on a terminal: one line a program, then findings and totals."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.base.sanitize import sanitize
from postproc.report.batched import DONE, FAILED, NOT_RUN, UNCHANGED, Batched, Outcome
from postproc.report.formatting import count, in_decimals
from postproc.report.terminal import show_findings

_STYLES = {DONE: "", UNCHANGED: "dim", FAILED: "bold red", NOT_RUN: "yellow"}


def show_batched(console: Console, batched: Batched, verbose: bool = False) -> None:
    """The table of a batch, why programs failed, and where the summary is."""
    table = Table(box=None, pad_edge=False)
    for head in ("program", "state"):
        table.add_column(head, overflow="fold")
    for head in ("motions", "corrected", "not corrected", "before mm", "after mm", "tolerance mm", "gain"):
        table.add_column(head, justify="right")
    table.add_column("verdict", overflow="fold")
    table.add_column("needs review", overflow="fold")
    for outcome in batched.outcomes:
        table.add_row(*_row(outcome), style="yellow" if outcome.exit == 3 else _STYLES[outcome.state])
    console.print(table)
    for outcome in batched.outcomes:
        if outcome.exit == 1 or verbose:
            show_findings(console, outcome.findings, verbose)
    if batched.skipped_files:
        console.print(f"skipped {count(len(batched.skipped_files), 'file')}: not a program")
        for path in batched.skipped_files if verbose else ():
            console.print(Text("    " + sanitize(path)), soft_wrap=True)
    console.print(closing(batched), markup=False)
    for path in batched.outputs:
        console.print(Text(f"wrote {sanitize(path)}"), soft_wrap=True)


def closing(batched: Batched) -> str:
    """``40 programs: 38 done, 2 failed``"""
    counts = ", ".join(f"{number} {state}" for state, number in batched.counts.items() if number)
    return f"{count(len(batched.outcomes), 'program')}: {counts}, in {batched.seconds:.1f} s"


def _row(outcome: Outcome) -> tuple[str, ...]:
    gravest = outcome.gravest
    return (
        escape(sanitize(outcome.name)),
        outcome.state,
        *(str(outcome.result.get(key, "-")) for key in ("motions", "corrected", "uncorrected")),
        in_decimals(outcome.figure("error_before_mm"), 3),
        in_decimals(outcome.figure("error_after_mm"), 4),
        *(outcome.number(key) for key in ("tolerance_mm", "gain")),
        outcome.verdict,
        "" if gravest is None else escape(gravest.code),
    )
