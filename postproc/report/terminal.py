"""The report on a terminal: a short table, then the findings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from postproc.base.findings import Finding
from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.compensation.uncertain_inputs import DIRECTION, FORCE
from postproc.compensation.uncertainty import Uncertainty
from postproc.report.formatting import two_digits
from postproc.report.part_report import part_rows
from postproc.report.program_verdict import verdict_sentence
from postproc.report.report import PathFigures, Report, Spread

if TYPE_CHECKING:  # takes its time to load: only where something is printed
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

_STYLES = {"info": "cyan", "warning": "yellow", "error": "bold red"}
NAMED = 3
"""Parameters that the line on the uncertainty names."""


def show(console: Console, report: Report, verbose: bool = False) -> None:
    """The table of one program, its findings, and where things are."""
    from rich.text import Text

    show_rows(console, ((key, Text(value)) for key, value in report_rows(report)))
    if report.worst:
        console.print(_worst(report))
    show_findings(console, report.findings, verbose)
    for path in report.outputs:
        console.print(Text(f"wrote {path}"), soft_wrap=True)


def show_rows(console: Console, rows: Iterable[tuple[str, str | Text]]) -> None:
    """Keys, in bold, and what belongs to them; a ``str`` may have markup."""
    from rich.table import Table

    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold")
    table.add_column()
    for key, value in rows:
        table.add_row(key, value)
    console.print(table)


def report_rows(report: Report) -> Iterable[tuple[str, str]]:
    """Keys, and what belongs to them as plain text."""
    cuts = _count(report.cuts, "cut")
    yield (
        "program",
        f"{report.program} ({report.dialect}), {report.motions} motions, {report.cutting} cutting in {cuts}",
    )
    yield "robot", report.robot
    peak = "" if math.isnan(report.force_peak_n) else f", peaks up to {report.force_peak_n:.0f} N"
    yield "force", f"{report.force_source}, at most {report.force_max_n:.0f} N{peak}"
    inside = math.isfinite(report.before_inside)
    covers = "along cutting motions, whose force changes, and at their end points" if inside else ""
    yield "errors", f"predicted, {covers or 'at the end points of cutting motions'}"
    along = f"max {report.largest_before / MM:.4f} mm; at end points " if inside else ""
    before = along + _spread(report.before, _interval(report.uncertainty, report.uncertainty.before))
    yield "error before", f"{before}, orientation {_deg(report.angle_before_deg)}"
    if report.after is not None and report.correction is not None and report.angle_after_deg is not None:
        share = "" if report.gain == 1.0 else f"; gain {report.gain:g}"
        along = f"max {report.largest_after / MM:.4f} mm; at end points " if inside else ""
        after = along + _spread(report.after, _interval(report.uncertainty, report.uncertainty.after))
        yield "error after", f"{after}, orientation {_deg(report.angle_after_deg)}"
        if report.path_error is not None:
            turned = report.path_error_deg
            angle = "" if turned is None or math.isnan(turned) else f", orientation {_deg(turned)}"
            yield "path error", f"{_spread(report.path_error)}{angle}, between the points as written"
        yield from part_rows(report.part, report.uncertainty)
        if report.path is not None:
            yield "across feed", _before_after(report.path.across_before, report.path.across_after)
            yield "along feed", _before_after(report.path.along_before, report.path.along_after)
        yield "correction", f"{_spread(report.correction)} ({_count(report.iterations, 'iteration')}{share})"
        yield (
            "motions",
            (
                f"{report.corrected} corrected, {report.uncorrected} not corrected,"
                f" {report.motions - report.corrected - report.uncorrected} with nothing to correct;"
                f" {report.inserted} inserted{_transition_moves(report)}"
            ),
        )
        if report.path is not None:
            yield "transitions", _transitions(report.path)
    if report.uncertainty.worst >= 0:
        first, *more = _uncertainty(report)
        yield "uncertainty", first
        for line in more:
            yield "", line
    if sentence := verdict_sentence(report):
        yield "verdict", sentence


def _count(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _transition_moves(report: Report) -> str:
    """How many of the inserted motions lead from one correction to the next, mostly at the start of a cut."""
    if not report.transition_moves:
        return ""
    longest = max(report.transition_moves, key=lambda move: move.length_mm)
    number = _count(len(report.transition_moves), "transition move")
    return f", of these {number}, up to {longest.length_mm:.3f} mm (line {longest.line})"


def _before_after(before: Spread, after: Spread) -> str:
    """Two spreads of one kind of error, in mm."""
    if math.isnan(before.max):
        return "-"
    one, two = (f"max {s.max / MM:.4f}, rms {s.rms / MM:.4f} mm" for s in (before, after))
    return f"{one} before; {two} after"


def _transitions(path: PathFigures) -> str:
    """Lead-ins, and what the output does where its correction changes."""
    transitions = path.transitions
    ramps = ""
    if path.ramps:
        longest = f"{path.longest_ramp / MM:.1f} mm (line {path.longest_ramp_line})"
        reach = (
            f"{path.ramp / MM:g} to {longest}"
            if path.longest_ramp > 1.001 * path.ramp
            else f"{path.ramp / MM:g} mm"
        )
        ramps = f", {_count(path.ramps, 'force ramp')} of {reach}"
    speed = f", {transitions.speed / MM:.1f} mm/s" if math.isfinite(transitions.speed) else ""
    rate = (
        f", correction changes by at most {transitions.rate:.3f} mm/mm{speed} (line {transitions.rate_line})"
        if transitions.rate_line
        else ""
    )
    return (
        f"{_count(transitions.lead_ins, 'lead-in')} in air{ramps}; in cuts {_count(transitions.stops, 'stop')} added,"
        f" {_count(transitions.backwards, 'backward motion')}{rate}"
    )


def _worst(report: Report) -> Table:
    from rich.table import Table

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
    from rich.text import Text

    for finding in findings:
        line = Text()
        if finding.place:
            line.append(sanitize(finding.place) + " ")
        line.append(finding.code, style=_STYLES[finding.severity])
        line.append(" " + sanitize(finding.message))
        console.print(line, soft_wrap=True)
        if finding.severity != "info" or verbose:
            shown = finding.advice if verbose or finding.severity == "error" else finding.help
            for part in shown.splitlines():
                console.print(Text("    " + sanitize(part), style="dim"), soft_wrap=True)


def _interval(uncertainty: Uncertainty, half_width: float) -> str:
    """`` +- 0.11 (95 %)``; empty where that is not known."""
    if math.isnan(half_width) or uncertainty.unknown:
        return ""
    return f" +- {'at least ' if uncertainty.lower_bound else ''}{two_digits(half_width / MM)} (95 %)"


def _uncertainty(report: Report) -> list[str]:
    """The uncertainty of the errors, its budget, and what the intervals do not cover."""
    uncertainty = report.uncertainty
    missing = missing_intervals(uncertainty)
    if not uncertainty.unknown:
        return [describe_budget(uncertainty), *([f"at least: {missing}"] if missing else [])]
    if not uncertainty.intervals:
        return ["not known: no input has an interval", *([missing] if missing else [])]
    width = uncertainty.before if report.after is None else uncertainty.after
    alone = f"the stated intervals alone: {two_digits(width / MM)} mm (95 %), {describe_budget(uncertainty)}"
    return [f"not known: {missing}", *([] if math.isnan(width) else [alone])]


def describe_budget(uncertainty: Uncertainty) -> str:
    """Where the intervals come from."""
    seen, contributions = 0.0, []
    for name, share in uncertainty.budget[:NAMED]:
        if name == FORCE:
            name += (
                ", one scale per operation" if uncertainty.force_differs else ", one scale for all motions"
            )
        if name == DIRECTION:
            name = "direction of the force"
        contributions.append(f"{name} ({100 * share:.0f} %)")
        seen += share
        if seen > 0.95:
            break
    parts = [
        "mostly " + ", ".join(short_names(contributions))
        if contributions
        else "no contribution of the intervals"
    ]
    if len(uncertainty.level_unstated) == 1:
        parts.append("the level of 1 interval is not stated")
    elif uncertainty.level_unstated:
        parts.append(f"levels of {len(uncertainty.level_unstated)} intervals are not stated")
    return "; ".join(parts)


def missing_intervals(uncertainty: Uncertainty) -> str:
    """Inputs without an interval, and the effect of 10 % of each; empty where every input has one."""
    names = [(name, length) for name, length in uncertainty.effect_of_10_percent if name != FORCE]
    parts = []
    if names:
        words = ", ".join(short_names([name for name, _ in names[:NAMED]]))
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        has = f"has no interval (10 % of it: {two_digits(names[0][1] / MM)} mm)"
        if len(names) > 1:
            each = ", ".join(two_digits(length / MM) for _, length in names[:NAMED])
            has = f"have no interval (10 % of each: {each} mm)"
        parts.append(f"{words}{more} {has}")
    for _, length in (entry for entry in uncertainty.effect_of_10_percent if entry[0] == FORCE):
        tenth = f"(10 % of it: {two_digits(length / MM)} mm)"
        parts.append(f"nor has the force {tenth}" if parts else f"the force has no interval {tenth}")
    if uncertainty.unstable:
        parts.append(f"{uncertainty.unstable} motions have no equilibrium within the intervals")
    return ", ".join(parts)


def short_names(names: Sequence[str]) -> list[str]:
    """``effect.a, effect.b`` as ``effect.a, b``."""
    effects = [name.partition(".")[0] for name in names]
    return [
        name.partition(".")[2] if i and effects[i] == effects[i - 1] else name for i, name in enumerate(names)
    ]


def _spread(spread: Spread, interval: str = "") -> str:
    if math.isnan(spread.max):
        return "-"
    return f"max {spread.max / MM:.4f} mm{interval}, rms {spread.rms / MM:.4f} mm, 95 % below {spread.p95 / MM:.4f} mm"


def _deg(value: float) -> str:
    return "-" if math.isnan(value) else f"max {value:.4f} deg"
