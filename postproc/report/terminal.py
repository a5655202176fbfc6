"""The report on a terminal: a short table, then what there is to say."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.findings import CODES, Finding
from postproc.report.report import Report, Spread
from postproc.units import MM

_STYLES = {"info": "cyan", "warning": "yellow", "error": "bold red"}
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")


def show(console: Console, report: Report, verbose: bool = False) -> None:
    """The table of one program, its findings, and where things are."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column()
    for key, value in _rows(report):
        table.add_row(key, value)
    console.print(table)
    if report.worst:
        console.print(_worst(report))
    show_findings(console, report.findings, verbose)
    for path in report.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def _rows(report: Report) -> Iterable[tuple[str, str]]:
    cuts = f"{report.cuts} cut" + ("" if report.cuts == 1 else "s")
    yield (
        "program",
        escape(f"{report.program} ({report.dialect}), {report.motions} motions,")
        + f" {report.cutting} cutting in {cuts}",
    )
    yield "robot", escape(report.robot)
    yield "force", escape(f"{report.force_source}, at most {report.force_max_n:.0f} N")
    yield "errors", "predicted, at the end points of cutting motions"
    yield "error before", f"{_spread(report.before)}, orientation {_deg(report.angle_before_deg)}"
    if report.after is not None and report.correction is not None and report.angle_after_deg is not None:
        share = "" if report.gain == 1.0 else f"; gain {report.gain:g}"
        yield "error after", f"{_spread(report.after)}, orientation {_deg(report.angle_after_deg)}"
        yield "correction", f"{_spread(report.correction)} ({report.iterations} iterations{share})"
        yield (
            "motions",
            (
                f"{report.corrected} corrected, {report.left} left, {report.motions - report.corrected - report.left}"
                " with nothing to correct"
            ),
        )


def _worst(report: Report) -> Table:
    table = Table(title="largest errors", title_justify="left", title_style="", box=None, pad_edge=False)
    for head in ("line", "before mm", "correction mm", "after mm", "force N"):
        table.add_column(head, justify="right")
    for worst in report.worst:
        after = "-" if math.isnan(worst.after_mm) else f"{worst.after_mm:.4f}"
        moved = "-" if math.isnan(worst.correction_mm) else f"{worst.correction_mm:.3f}"
        table.add_row(str(worst.line), f"{worst.before_mm:.3f}", moved, after, f"{worst.force_n:.0f}")
    return table


def show_findings(console: Console, findings: Sequence[Finding], verbose: bool = True) -> None:
    """``file:line:column CODE message``, the help below it."""
    for finding in findings:
        line = Text()
        if finding.place:
            line.append(printable(finding.place) + " ")
        line.append(finding.code, style=_STYLES[finding.severity])
        line.append(" " + printable(finding.message))
        console.print(line, soft_wrap=True)
        if verbose or finding.severity == "error":
            advice = finding.help or CODES[finding.code].explanation
            for part in advice.splitlines():
                console.print(Text("    " + printable(part), style="dim"), soft_wrap=True)


def printable(text: str) -> str:
    """Text of a program without the control characters that could drive a terminal."""
    return _CONTROL.sub("?", text)


def _spread(spread: Spread) -> str:
    if math.isnan(spread.max):
        return "-"
    return f"max {spread.max / MM:.4f} mm, rms {spread.rms / MM:.4f} mm, 95 % below {spread.p95 / MM:.4f} mm"


def _deg(value: float) -> str:
    return "-" if math.isnan(value) else f"max {value:.4f} deg"
