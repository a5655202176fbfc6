"""The report on a terminal: a short table, then what there is to say."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from postproc.compensation.doubt import FORCE, Doubt
from postproc.findings import CODES, Finding
from postproc.printable import printable
from postproc.report.report import Report, Spread
from postproc.units import MM

_STYLES = {"info": "cyan", "warning": "yellow", "error": "bold red"}
NAMED = 3
"""Parameters that the line on the doubt names."""


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
    cuts = _count(report.cuts, "cut")
    yield (
        "program",
        escape(f"{report.program} ({report.dialect}), {report.motions} motions,")
        + f" {report.cutting} cutting in {cuts}",
    )
    yield "robot", escape(report.robot)
    peak = "" if math.isnan(report.force_peak_n) else f", peaks up to {report.force_peak_n:.0f} N"
    yield "force", escape(f"{report.force_source}, at most {report.force_max_n:.0f} N{peak}")
    yield "errors", "predicted, at the end points of cutting motions"
    before = _spread(report.before, _interval(report.doubt, report.doubt.before))
    yield "error before", f"{before}, orientation {_deg(report.angle_before_deg)}"
    if report.after is not None and report.correction is not None and report.angle_after_deg is not None:
        share = "" if report.gain == 1.0 else f"; gain {report.gain:g}"
        after = _spread(report.after, _interval(report.doubt, report.doubt.after))
        yield "error after", f"{after}, orientation {_deg(report.angle_after_deg)}"
        if report.between is not None:
            yield "on the way", f"{_spread(report.between)}, between the points as written"
        yield "correction", f"{_spread(report.correction)} ({_count(report.iterations, 'iteration')}{share})"
        yield (
            "motions",
            (
                f"{report.corrected} corrected, {report.left} left, {report.motions - report.corrected - report.left}"
                f" with nothing to correct; {report.inserted} inserted{_links(report)}"
            ),
        )
    if report.doubt.worst >= 0:
        yield "doubt", escape(_doubt(report.doubt))
        if report.doubt.lower_bound:
            yield "", escape(_left_out(report.doubt))


def _count(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _links(report: Report) -> str:
    """Links are counted apart: they lead from one correction to the next, mostly at the begin of a cut."""
    if not report.links:
        return ""
    longest = max(report.links, key=lambda link: link.length_mm)
    return f", {_count(len(report.links), 'link')} among them, up to {longest.length_mm:.3f} mm (line {longest.line})"


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


def _interval(doubt: Doubt, half_width: float) -> str:
    """`` +- 0.11 (95 %)``; empty where nothing is known."""
    if math.isnan(half_width):
        return ""
    return f" +- {_two_digits(half_width / MM)}{' or more' if doubt.lower_bound else ''} (95 %)"


def _doubt(doubt: Doubt) -> str:
    """Where the intervals come from."""
    if not doubt.intervals:
        return "not known, nothing has an interval"
    seen, told = 0.0, []
    for name, share in doubt.blame[:NAMED]:
        if name == FORCE:
            name += ", each operation with its own" if doubt.force_differs else ", one scale for all motions"
        told.append(f"{name} ({100 * share:.0f} %)")
        seen += share
        if seen > 0.95:
            break
    parts = ["mostly " + ", ".join(_once(told)) if told else "none from the intervals"]
    if len(doubt.level_unstated) == 1:
        parts.append("the level of 1 interval is not stated")
    elif doubt.level_unstated:
        parts.append(f"levels of {len(doubt.level_unstated)} intervals are not stated")
    return "; ".join(parts)


def _left_out(doubt: Doubt) -> str:
    """What the intervals leave out, and what a tenth of it is worth."""
    names = [(name, length) for name, length in doubt.tenth if name != FORCE]
    parts = []
    if names:
        words = ", ".join(_once([name for name, _ in names[:NAMED]]))
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        has = f"has no interval (10 % of it: {_two_digits(names[0][1] / MM)} mm)"
        if len(names) > 1:
            each = ", ".join(_two_digits(length / MM) for _, length in names[:NAMED])
            has = f"have no interval (10 % of each: {each} mm)"
        parts.append(f"{words}{more} {has}")
    for _, length in (entry for entry in doubt.tenth if entry[0] == FORCE):
        tenth = f"(10 % of it: {_two_digits(length / MM)} mm)"
        parts.append(f"nor has the force {tenth}" if parts else f"the force has no interval {tenth}")
    if doubt.unstable:
        parts.append(f"{doubt.unstable} motions have no stable rest within the intervals")
    return "at least: " + ", ".join(parts)


def _once(names: Sequence[str]) -> list[str]:
    """``effect.a, effect.b`` as ``effect.a, b``."""
    effects = [name.partition(".")[0] for name in names]
    return [
        name.partition(".")[2] if i and effects[i] == effects[i - 1] else name for i, name in enumerate(names)
    ]


def _two_digits(value: float) -> str:
    """Two significant digits without an exponent."""
    if value == 0 or not math.isfinite(value):
        return "0" if value == 0 else "-"
    return f"{value:.{max(0, 1 - math.floor(math.log10(abs(value))))}f}"


def _spread(spread: Spread, interval: str = "") -> str:
    if math.isnan(spread.max):
        return "-"
    return f"max {spread.max / MM:.4f} mm{interval}, rms {spread.rms / MM:.4f} mm, 95 % below {spread.p95 / MM:.4f} mm"


def _deg(value: float) -> str:
    return "-" if math.isnan(value) else f"max {value:.4f} deg"
