"""The verdict of a page in words: what becomes better, its uncertainty, what is not corrected and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.base.sanitize import sanitize_lines
from postproc.base.units import MM
from postproc.compensation.uncertainty import Uncertainty
from postproc.report.formatting import count, two_digits
from postproc.report.page_data import PageData
from postproc.report.program_verdict import verdict_sentence
from postproc.report.report import Report
from postproc.report.terminal import missing_intervals, report_rows

LISTED = 8
"""Cuts that are not corrected are listed up to so many."""


@dataclass(frozen=True)
class Tile:
    """A large figure: its name, value and a note."""

    name: str
    value: str
    note: str


def printed(text: str) -> str:
    """Text of a program or a file name as a page can hold it; its lines stay lines."""
    if text.isascii() and text.isprintable():  # nearly every line
        return text
    return sanitize_lines(text.encode("utf-8", "replace").decode("utf-8"))


def badge(exit: int, changed: int | None) -> tuple[str, str, str]:
    """Class, sign and word of the state of the whole; ``changed``: motions that were, None where nothing should."""
    if exit == 1:
        return "bad", "✗", "not written"
    if exit:
        return "look", "!", "needs review"
    if changed == 0:
        return "none", "–", "nothing changed"
    return "good", "✓", "done"


def program_verdict(data: PageData) -> str:
    """One sentence: the error before and after, and its uncertainty."""
    report = data.report
    if math.isnan(report.before.max):
        return "No motion cuts with a force: no deflection, and nothing is corrected."
    before = f"{report.before.max / MM:.3f} mm{_interval(report.uncertainty, report.uncertainty.before)}"
    if math.isfinite(report.before_inside):
        before = (
            f"{report.largest_before / MM:.3f} mm along motions whose force changes ({before} at the points)"
        )
    if not data.corrected or report.after is None:
        return (
            f"Without correction, the predicted error of the tool is up to {before}"
            f" over {count(report.cutting, 'cutting motion')}; nothing was changed."
        )
    if not report.corrected:
        return f"Nothing was corrected: the predicted error of the tool is up to {before}."
    after = f"{report.after.max / MM:.4f} mm{_interval(report.uncertainty, report.uncertainty.after)}"
    if report.path_error is not None and np.isfinite(report.path_error.max):
        after += (
            f" at the points; the path error between points is at most {report.path_error.max / MM:.4f} mm"
        )
    share = f" {report.gain:.0%} of the correction was applied, as asked." if report.gain < 1 else ""
    if report.corrected == report.cutting:
        which = "Every cutting motion is corrected"
    else:
        which = f"{report.corrected} of {count(report.cutting, 'cutting motion')} are corrected"
    if report.inserted:
        share = f" {count(report.inserted, 'motion')} {'was' if report.inserted == 1 else 'were'} inserted.{share}"
    allowed = f" (tolerance {data.tolerance:g} mm)"
    sentence = verdict_sentence(report)
    conclusion = f" {sentence[0].upper()}{sentence[1:]}." if sentence else ""
    return f"{which}: the largest predicted error falls from {before} to {after}{allowed}.{share}{conclusion}"


def program_tiles(data: PageData) -> list[Tile]:
    """Before, after, the worst place, the uncertainty, what is not corrected."""
    report = data.report
    rest = _rest(report.before.rms, report.before.p95)
    if math.isfinite(report.before_inside):
        rest = f"along motions whose force changes; at the points {_mm(report.before.max, 3)}, {rest}"
    tiles = [Tile("error before", _mm(report.largest_before, 3), rest)]
    if data.corrected and report.after is not None:
        tiles.append(Tile("error after", _mm(report.after.max, 4), _rest(report.after.rms, report.after.p95)))
        if report.path_error is not None and np.isfinite(report.path_error.max):
            between = _rest(report.path_error.rms, report.path_error.p95)
            tiles.append(Tile("path error between points", _mm(report.path_error.max, 4), between))
    if data.places:
        row = data.places[0].row
        place = ", ".join(f"{value:.1f}" for value in data.position[row])
        cut = f"cut {data.cut[row] + 1}, " if data.cut[row] >= 0 else ""
        tiles.append(
            Tile(
                "worst place",
                f"line {data.line[row]}",
                f"{cut}{data.before[row]:.3f} mm before; at {place} mm in the robot base",
            )
        )
    tiles.append(_uncertainty(report))
    if data.corrected:
        note = f"of {count(report.cutting, 'cutting motion')}"
        note += f"; {data.off} more between COMPENSATE OFF and ON" if data.off else ""
        tiles.append(Tile("not corrected", count(report.uncorrected, "motion"), note))
    return tiles


def _uncertainty(report: Report) -> Tile:
    uncertainty = report.uncertainty
    if uncertainty.worst < 0 or math.isnan(uncertainty.before):
        return Tile("uncertainty", "not known", "no input has an interval")
    width = uncertainty.before if math.isnan(uncertainty.after) or report.after is None else uncertainty.after
    if uncertainty.unknown:
        return Tile("uncertainty", "not known", missing_intervals(uncertainty))
    value = f"{'at least ' if uncertainty.lower_bound else ''}± {two_digits(width / MM)} mm"
    description = f"95 %, mostly {uncertainty.budget[0][0]}" if uncertainty.budget else "95 %"
    return Tile(
        "uncertainty",
        value,
        description + ("; not every input has an interval" if uncertainty.lower_bound else ""),
    )


def reasons(data: PageData) -> list[str]:
    """What is not corrected and why, cut by cut; [] where everything is."""
    if not data.corrected:
        return []
    messages = [f.message for f in data.report.findings if f.code == "COR003"]
    more = [f"and {len(messages) - LISTED} more cuts, see the findings"] if len(messages) > LISTED else []
    off = f"{count(data.off, 'motion')} between COMPENSATE OFF and ON, as the program says"
    return messages[:LISTED] + more + ([off] if data.off else [])


def program_facts(report: Report) -> list[tuple[str, str]]:
    """The lines that the terminal shows as well."""
    return list(report_rows(report))


def parameter_rows(model: Mapping[str, object]) -> list[dict[str, str]]:
    """One row a parameter of the model as it was used, under its effect."""
    rows = []
    for effect, described in model.items():
        if not isinstance(described, dict):
            continue
        options = ", ".join(f"{key} {value}" for key, value in described.items() if key != "parameters")
        parameters = described["parameters"]
        if not parameters:
            rows.append({"effect": effect, "options": options, "name": "", "value": "", "unit": ""})
            rows[-1] |= {"interval": "", "source": ""}
        for name, stated in parameters.items():
            interval, level = stated["interval"], stated["level"]
            wide = "none" if interval is None else f"± {interval:.3g}"
            how = "" if interval is None else f" ({level if isinstance(level, str) else f'{level:.0%}'})"
            rows.append(
                {
                    "effect": effect,
                    "options": options,
                    "name": name,
                    "value": f"{stated['value']:.6g}",
                    "unit": stated.get("unit", ""),
                    "interval": wide + how,
                    "source": str(stated["source"] or ""),
                }
            )
    return rows


def _interval(uncertainty: Uncertainty, half_width: float) -> str:
    """`` ± 0.11 mm (95 %)``; empty where that is not known."""
    if math.isnan(half_width) or uncertainty.unknown:
        return ""
    return f" ± {'at least ' if uncertainty.lower_bound else ''}{two_digits(half_width / MM)} mm (95 %)"


def _rest(rms: float, p95: float) -> str:
    return (
        "" if math.isnan(rms) else f"at most; rms {rms / MM:.4f} mm, 95 % of motions below {p95 / MM:.4f} mm"
    )


def _mm(length: float, decimals: int) -> str:
    return "–" if not np.isfinite(length) else f"{length / MM:.{decimals}f} mm"
