"""The result of ``compensate diagnose`` on a terminal: the verdict in words, then its evidence in tables."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_detection import detection_table
from postproc.report.diagnosed_words import headline, paragraph
from postproc.report.formatting import campaign_in_words, count, fixed, shown_unit, some
from postproc.report.identified_terminal import add_sizes
from postproc.report.placed import stations, targets, tracker_scale
from postproc.report.terminal import show_findings, show_rows
from postproc.robot.description import robot_words

WIDE = 110
"""Columns of the paragraph at most: longer lines are hard to read."""

LEAST_CHANCE = 1e-99
"""A smaller probability is not printed as zero."""


def show_diagnosed(console: Console, result: Diagnosed, verbose: bool = False) -> None:
    """Verdict, paragraph, parameters, evidence, residual patterns, residuals, next poses, findings."""
    console.print(Text(sanitize(headline(result)), style="bold"), soft_wrap=True)
    console.print(Text(sanitize(paragraph(result))), width=min(WIDE, console.width))
    show_rows(console, ((key, Text(sanitize(value))) for key, value in fact_rows(result)))
    tables = (
        _places,
        parameter_table,
        evidence_table,
        alternatives_table,
        refitted_table,
        places_table,
        residual_table,
        detection_table,
        next_poses_table,
    )
    for make in tables:
        table = make(result, verbose)
        if table.row_count:
            console.print(table)
    if result.next_poses is not None and result.next_poses.readings.direction is not None:
        console.print("approach each axis in the direction of the columns DIR of the plan")
    show_findings(console, result.findings, verbose)
    for path in result.outputs:
        console.print(Text(sanitize(f"wrote {path}")), soft_wrap=True)
    if result.improves and result.robot_file is None:
        console.print("-o NEW.yaml writes the new robot file")
    if result.next_poses is not None and result.next_poses_file is None:
        console.print("--next-poses FILE.csv writes the poses to measure next")


def fact_rows(result: Diagnosed) -> Iterator[tuple[str, str]]:
    final = result.final
    yield "data", ", ".join(name for name, _ in result.data)
    yield "", campaign_in_words(final.campaign)
    yield "robot", robot_words(result.robot, result.robot_path)
    yield (
        "scatter",
        f"{result.scatter / MM:.4f} mm 3-D RMS, from: {final.noise.source}",
    )
    linear = result.diagnosis.search.linear
    yield "tried", f"{count(len(linear.candidates), 'candidate')}: {', '.join(result.tried)}"


def _table(title: str, *heads: str) -> Table:
    """A table whose first column is on the left, the others on the right but for one without a head."""
    table = Table(box=None, pad_edge=False)
    table.add_column(title)
    for head in heads:
        table.add_column(head, justify="right" if head else "left")
    return table


def _places(result: Diagnosed, _verbose: bool) -> Table:
    """Where tracker and targets were found."""
    table = _table("found with the fit", "x, mm", "y, mm", "z, mm", "A, deg", "B, deg", "C, deg")
    for kind, several in (("robot base in the tracker's frame", stations), ("target", targets)):
        for one in several(result.final):
            name = f"{kind} {one.name}".strip()
            cells = [f"{value:.3f} +- {wide:.2g}" for value, wide in zip(one.position, one.ci95, strict=True)]
            if one.angles is not None and one.angles_ci95 is not None:
                cells += [f"{value:.4f}" for value in one.angles]
            table.add_row(name, *cells)
    scale = tracker_scale(result.final)
    if scale is not None:
        table.add_row("scale of the tracker", f"{1e6 * scale[0]:.0f} +- {1e6 * scale[1]:.2g} ppm")
    return table


def parameter_table(result: Diagnosed, _verbose: bool) -> Table:
    """One row a parameter, under what it is of."""
    table = _table("missing", "value", "+- 95 %", "unit", "")
    for named in result.clear:
        table.add_row(Text(named.candidate.label, style="bold"))
        for estimate in named.estimates:
            word, size = shown_unit(estimate.unknown.parameter.unit)
            wide = estimate.ci95 / size
            note = "at its bound" if estimate.at_bound else ""
            value = fixed(estimate.value / size, wide)
            table.add_row(f"  {estimate.unknown.parameter.name}", value, fixed(wide, wide), word, note)
    return table


def evidence_table(result: Diagnosed, verbose: bool) -> Table:
    """The likelihood gain of each named or rejected candidate, in the fit and on held-out data."""
    table = _table(
        "evidence, 2 ln(likelihood ratio)",
        "likelihood\ngain",
        "expected\nby chance",
        "held-out\nposes",
        "held-out\nregions",
        "held-out\nsessions",
        "margin\nto next",
        "",
    )
    for named in result.verdict.named:
        its = named.evidence
        numbers = (its.heldout, its.regions, its.sessions)
        nearest = "" if its.alias is None else f"next: {its.alias.label}"
        cells = [
            _number(its.gain),
            f"{its.chance:.1g}" if its.chance > LEAST_CHANCE else "< 1e-99",
            *map(_number, numbers),
            _number(its.margin) if its.margin > 0 else "none",
        ]
        table.add_row(named.candidate.label, *cells, nearest)
    for candidate, why in result.verdict.rejected:
        table.add_row(candidate.label, *[""] * 6, f"rejected: {why}")
    return table


def alternatives_table(result: Diagnosed, _verbose: bool) -> Table:
    """The likelihood gain of each explanation of a set alone."""
    table = _table("indistinguishable", "likelihood gain alone")
    keys = [candidate.key for candidate in result.diagnosis.search.linear.candidates]
    alone = dict(zip(keys, result.gains.alone.tolist(), strict=True))
    for alternative in result.diagnosis.search.rivals:
        # what is never looked for by itself gains as much less than the first as it fits worse
        alone.setdefault(alternative.candidate.key, alone.get(alternative.of, np.nan) - alternative.worse)
    for number, alternatives in enumerate(result.verdict.alternatives):
        if number:
            table.add_section()
        for candidate in alternatives:
            table.add_row(candidate.label, _number(alone[candidate.key]))
    return table


def refitted_table(result: Diagnosed, _verbose: bool) -> Table:
    table = _table("changed in the robot file", "before", "value", "+- 95 %", "unit")
    for estimate in result.verdict.refitted:
        word, size = shown_unit(estimate.unknown.parameter.unit)
        wide = estimate.ci95 / size
        before, value = (fixed(v / size, wide) for v in (estimate.unknown.value, estimate.value))
        table.add_row(estimate.unknown.name, before, value, fixed(wide, wide), word)
    return table


def places_table(result: Diagnosed, verbose: bool) -> Table:
    """Patterns in the residuals of the robot file with its own parameters refitted."""
    table = _table("residual depends on", "share", "")
    rows = {one.variable: one for one in result.patterns}
    for name in some(list(rows), verbose):
        one = rows.get(name)
        if one is None:
            table.add_row(name)
        else:
            table.add_row(name, f"{100 * one.share:.0f} %", one.pattern)
    return table


def residual_table(result: Diagnosed, _verbose: bool) -> Table:
    """Residuals before and after: of the fit, of held-out poses."""
    table = _table("residuals, mm", "RMS", "mean", "max", "readings")
    rows = {
        "before": "robot file",
        "refitted": "its own parameters refitted",
        "after": "final model",
        "held_out_before": "held-out poses, robot file",
        "held_out_after": "held-out poses, final model",
    }
    if not result.diagnosis.base.unknowns:
        del rows["refitted"]
    add_sizes(table, {words: result.lengths[name] for name, words in rows.items()})
    for one in result.validation:
        for words, size in (("robot file", one.before), ("final model", one.after)):
            cells = [f"{value / MM:.3f}" for value in (size.rms, size.mean, size.max)]
            table.add_row(f"{one.file}, {words}", *cells, str(size.readings))
    if result.final.noise.known:
        table.add_row("scatter of the readings", f"{result.scatter / MM:.3f}")
    return table


def next_poses_table(result: Diagnosed, _verbose: bool) -> Table:
    planned = result.next_poses
    if planned is None:
        return _table("")
    heads = [name for name in planned.poses[0] if not name.startswith("DIR")]
    table = _table("measure next", *(name.replace("_", ", ") for name in heads))
    for number, pose in enumerate(planned.poses, 1):
        table.add_row(str(number), *(f"{pose[name]:.1f}" for name in heads))
    return table


def _number(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "-"
