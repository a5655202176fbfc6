"""The result of ``compensate identify`` on a terminal: verdict, parameters, residuals, findings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats
from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.identification.fit import Estimate
from postproc.identification.validation import WIDER
from postproc.report.formatting import campaign_in_words, count, fixed, shown_unit, some
from postproc.report.identified import STRONG, Identified, Sum
from postproc.report.residuals import Sizes
from postproc.report.terminal import short_names, show_findings, show_rows
from postproc.robot.description import robot_words

IN_TABLES = frozenset({"IDN018", "IDN019", "IDN020", "IDN021", "IDN022", "IDN025", "IDN026"})
"""Findings whose content is in the tables: ``--verbose`` shows them too, with what to do."""


def show_identified(console: Console, result: Identified, verbose: bool = False) -> None:
    """The verdict, the data, the parameters, what was not identified, the residuals, and findings."""
    console.print(Text(verdict(result), style="bold"), soft_wrap=True)
    show_rows(console, ((key, Text(sanitize(value))) for key, value in fact_rows(result)))
    console.print(parameter_table(result))
    for line in note_lines(result, verbose):
        console.print(Text(sanitize(line)), soft_wrap=True)
    console.print(residual_table(result))
    for line in outlier_lines(result, verbose):
        console.print(Text(sanitize(line)), soft_wrap=True)
    show_findings(console, [f for f in result.findings if verbose or f.code not in IN_TABLES], verbose)
    for path in result.outputs:
        console.print(Text(sanitize(f"wrote {path}")), soft_wrap=True)


def verdict(result: Identified) -> str:
    """How many parameters were found, the residuals, and how these compare with the scatter of the readings."""
    after, gap = result.after, result.gap_mm()
    identified, asked = len(after.unknowns), len(after.asked)
    sentence = (
        f"{identified} of {asked} parameters found."
        if identified < asked
        else f"All {asked} parameters found."
    )
    if asked == 1:
        sentence = "The parameter was found."
    sentence += f" The residual falls from {gap['before_rms_mm']:.3f} to {gap['after_rms_mm']:.3f} mm RMS"
    without, held_out = gap.get("held_out_before_rms_mm"), gap.get("held_out_after_rms_mm")
    sentence += "." if held_out is None else f", to {held_out:.3f} mm on held-out poses."
    if held_out is not None and without is not None and held_out >= without:
        return f"{sentence} There the fit is no better than before: do not use it."
    if result.outliers and not result.outliers_excluded:
        return f"{sentence} {count(len(result.outliers), 'outlier')} among the readings: check these first."
    if after.freedom == 0:
        return f"{sentence} There are as many unknowns as measured numbers: this proves nothing."
    if not after.noise.known:
        return f"{sentence} How much of it is scatter is not known: no SIGMA is stated and no reading is repeated."
    scatter = f"{gap['noise_mm']:.3f} mm"
    if after.scatter_exceeded:
        return (
            f"{sentence} Readings scatter by {scatter}: the model lacks an effect, or the scatter is larger."
        )
    if after.times_stated:
        each = f"{after.shared_error / MM:.3f} mm in each coordinate"
        return (
            f"{sentence} Readings scatter by {scatter}, and those of one pose share another {each}:"
            " the model lacks an effect, or the robot does not come back to a pose any better."
        )
    return f"{sentence} Readings scatter by {scatter}: they show nothing more."


def fact_rows(result: Identified) -> Iterator[tuple[str, str]]:
    after = result.after
    yield "data", ", ".join(name for name, _ in result.data)
    yield "", campaign_in_words(after.campaign)
    yield "robot", robot_words(result.robot, result.robot_file)
    yield "effects", ", ".join(result.effects)
    if result.fixed:
        names = ", ".join(short_names(result.fixed))
        yield "fixed", f"{names}: dimensions of hardware without an interval, from the robot file"
    shared = after.shared_error
    together = f"; readings of one pose share another {shared / MM:.3f} mm" if shared > 0 else ""
    yield (
        "scatter",
        f"{result.sigma / MM:.4f} mm per coordinate (1 sigma), from: {after.noise.source}{together}",
    )
    how = "95 %, from the covariance"
    if not after.noise.known or after.scatter_exceeded:
        how += ", scaled to the residuals"
    if result.bootstrap is not None:
        how += f"; checked by a bootstrap of {result.bootstrap.draws} draws"
    yield "intervals", how


def parameter_table(result: Identified) -> Table:
    """One row a parameter, under the name of its effect."""
    table = Table(box=None, pad_edge=False)
    table.add_column("parameter")
    for head in ("before", "value", "+- 95 %", "%"):
        table.add_column(head, justify="right")
    table.add_column("unit")
    table.add_column("")
    effect = ""
    for estimate in result.after.estimates:
        own, _, name = estimate.unknown.name.partition(".")
        if own != effect:
            table.add_row(Text(own, style="bold"))
            effect = own
        table.add_row(f"  {name}", *_cells(result, estimate))
    return table


def _cells(result: Identified, estimate: Estimate) -> list[str]:
    unknown = estimate.unknown
    word, size = shown_unit(unknown.parameter.unit)
    wide = estimate.ci95 / size
    notes = []
    if estimate.at_bound:
        notes.append("at its bound")
    if unknown.prior is not None and not unknown.gauge:
        notes.append("its stated interval is used")
    drawn = result.bootstrap_ci95.get(unknown.name)
    if drawn is not None and drawn > WIDER * estimate.ci95:
        notes.append(f"+- {fixed(drawn / size, wide)} by bootstrap")
    return [
        "-" if unknown.stated is None else fixed(unknown.value / size, wide),
        fixed(estimate.value / size, wide),
        fixed(wide, wide),
        _percent(estimate),
        word,
        ", ".join(notes),
    ]


def note_lines(result: Identified, verbose: bool) -> Iterator[str]:
    """Condition and correlations, excluded parameters and why, and the sums that are known instead."""
    after = result.after
    pairs = [f"{' / '.join(short_names([a, b]))} {size:+.2f}" for a, b, size in result.correlations]
    strong = "; ".join(some(pairs, verbose)) or "none"
    yield f"condition    {after.condition:.3g}; correlations above {STRONG:g}: {strong}"
    reasons: dict[str, list[str]] = {}
    for dropped in after.dropped:
        reasons.setdefault(dropped.why, []).append(dropped.name)
    lines = [f"{', '.join(short_names(names))}: {why}" for why, names in reasons.items()]
    for line in some(lines, verbose):
        yield f"excluded     {line}"
    for line in some([_sum(one, result) for one in result.sums], verbose):
        yield f"sum          {line}"


def _sum(one: Sum, result: Identified) -> str:
    """``joint_offset.o2 + 0.98 link_geometry.ry2 = 1.20 +- 0.10 mrad``"""
    units = {unknown.name: unknown.parameter.unit for unknown in result.after.asked}
    word, size = shown_unit(one.unit)
    text = ""
    for name, weight in one.of.items():
        by = weight * shown_unit(units[name])[1] / size
        sign = " - " if by < 0 else " + "
        times = "" if math.isclose(abs(by), 1.0, rel_tol=1e-3) else f"{abs(by):.3g} "
        text += f"{sign if text else ''}{times}{name}"
    wide = one.ci95 / size
    return f"{text} = {fixed(one.value / size, wide)} +- {fixed(wide, wide)} {word}".rstrip()


def residual_table(result: Identified) -> Table:
    """Residuals before and after: of the fit, of held-out poses, of validation data."""
    table = Table(box=None, pad_edge=False)
    table.add_column("residuals, mm")
    for head in ("RMS", "mean", "max", "readings"):
        table.add_column(head, justify="right")
    deflection = result.after.campaign.readings.deflection
    rows = {
        "before": "the robot file" if deflection else "registration alone",
        "after": "fitted",
        "held_out_before": f"held-out poses ({result.folds}-fold), before",
        "held_out_after": f"held-out poses ({result.folds}-fold), after",
    }
    add_sizes(table, {rows[name]: lengths for name, lengths in result.lengths.items()})
    anew = ", registration refitted" if result.validation and result.validation.registered_anew else ""
    named = {f"validation{anew}, {name}": lengths for name, lengths in result.validation_lengths.items()}
    add_sizes(table, named)
    if len(result.validated_files) > 1:
        for file, lengths in result.validated_files:
            add_sizes(table, {f"{sanitize(file)}, {name}": values for name, values in lengths.items()})
    noise = result.gap_mm().get("noise_mm")
    if noise is not None:
        table.add_row("scatter of the readings", f"{noise:.3f}")
    return table


def add_sizes(table: Table, lengths: Mapping[str, Floats]) -> None:
    """A row of RMS, mean, maximum and number for each of ``lengths`` (R,) [m], under its name."""
    for name, values in lengths.items():
        size = Sizes.of(values)
        if size is not None:
            cells = [f"{value / MM:.3f}" for value in (size.rms, size.mean, size.max)]
            table.add_row(name, *cells, str(size.readings))


def outlier_lines(result: Identified, verbose: bool) -> Iterator[str]:
    if result.outliers:
        how = (
            "excluded"
            if result.outliers_excluded
            else "fitted with the others; --drop-outliers excludes them"
        )
        yield f"{count(len(result.outliers), 'outlier')} ({how})"
    lines = [
        f"{one.file}:{one.line} {one.distance / MM:.3g} mm off, {one.sigmas:.0f} sigma: {one.what}"
        for one in result.outliers
    ]
    for line in some(lines, verbose):
        yield f"  {line}"


def _percent(estimate: Estimate) -> str:
    """The interval as a share of the value, two digits."""
    if estimate.value == 0:
        return "-"
    share = 100 * estimate.ci95 / abs(estimate.value)
    return ">999" if share > 999 else fixed(share, share)
