"""The verdict of a page in words: what becomes better, how sure that is, what was left and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from rich.text import Text

from postproc.compensation.doubt import Doubt
from postproc.printable import printable_lines
from postproc.report.page_data import PageData
from postproc.report.report import Report
from postproc.report.terminal import _rows, _two_digits
from postproc.report.words import count
from postproc.units import MM

LEFT = 8
"""Cuts that were left are told one by one up to so many."""


@dataclass(frozen=True)
class Tile:
    """A figure that stands large: its name, value and what to know of it."""

    name: str
    value: str
    note: str


def printed(text: str) -> str:
    """Text of a program or a file name as a page can hold it; its lines stay lines."""
    return printable_lines(text.encode("utf-8", "replace").decode("utf-8"))


def badge(exit: int, changed: int | None) -> tuple[str, str, str]:
    """Class, sign and word of the state of the whole; ``changed``: motions that were, None where nothing should."""
    if exit == 1:
        return "bad", "✗", "not written"
    if exit:
        return "look", "!", "deserves a look"
    if changed == 0:
        return "none", "–", "nothing changed"
    return "good", "✓", "done"


def program_verdict(data: PageData) -> str:
    """One sentence: what was off, what is left of it, and how sure that is."""
    report = data.report
    if math.isnan(report.before.max):
        return "No motion cuts with a force: nothing bends, and nothing is corrected."
    before = f"{report.before.max / MM:.3f} mm{_interval(report.doubt, report.doubt.before)}"
    if not data.corrected or report.after is None:
        return (
            f"Uncorrected, the tool is predicted up to {before} away from where the program wants it,"
            f" over {count(report.cutting, 'cutting motion')}; nothing was changed."
        )
    if not report.corrected:
        return f"Nothing was corrected: the tool stays up to {before} away from where the program wants it."
    after = f"{report.after.max / MM:.4f} mm{_interval(report.doubt, report.doubt.after)}"
    if report.between is not None and np.isfinite(report.between.max):
        after += f" at the points, and is at most {report.between.max / MM:.4f} mm on the way between them"
    share = f" {report.gain:.0%} of the correction was applied, as asked." if report.gain < 1 else ""
    if report.corrected == report.cutting:
        which = "Every cutting motion is corrected"
    else:
        which = f"{report.corrected} of {count(report.cutting, 'cutting motion')} are corrected"
    if report.inserted:
        share = f" For that {count(report.inserted, 'motion')} were inserted.{share}"
    allowed = f" (tolerance {data.tolerance:g} mm)"
    return f"{which}: the largest predicted error falls from {before} to {after}{allowed}.{share}"


def program_tiles(data: PageData) -> list[Tile]:
    """Before, after, the worst place, how sure, what was left."""
    report = data.report
    tiles = [Tile("error before", _mm(report.before.max, 3), _rest(report.before.rms, report.before.p95))]
    if data.corrected and report.after is not None:
        tiles.append(Tile("error after", _mm(report.after.max, 4), _rest(report.after.rms, report.after.p95)))
        if report.between is not None and np.isfinite(report.between.max):
            between = _rest(report.between.rms, report.between.p95)
            tiles.append(Tile("after, on the way", _mm(report.between.max, 4), between))
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
    tiles.append(_how_sure(report))
    if data.corrected:
        note = f"of {count(report.cutting, 'cutting motion')}"
        note += f"; {data.off} more on the program's own word" if data.off else ""
        tiles.append(Tile("left as it was", count(report.left, "motion"), note))
    return tiles


def _how_sure(report: Report) -> Tile:
    doubt = report.doubt
    if doubt.worst < 0 or math.isnan(doubt.before):
        return Tile("how sure", "not known", "nothing that the prediction hangs on has an interval")
    width = doubt.before if math.isnan(doubt.after) or report.after is None else doubt.after
    value = f"± {_two_digits(width / MM)} mm" + (" or more" if doubt.lower_bound else "")
    told = f"95 %, mostly {doubt.blame[0][0]}" if doubt.blame else "95 %"
    return Tile("how sure", value, told + ("; not everything has an interval" if doubt.lower_bound else ""))


def left_over(data: PageData) -> list[str]:
    """What was left and why, cut by cut; [] where nothing was."""
    if not data.corrected:
        return []
    told = [f.message for f in data.report.findings if f.code == "COR003"]
    more = [f"and {len(told) - LEFT} more cuts, see the findings"] if len(told) > LEFT else []
    off = f"{count(data.off, 'motion')} between COMPENSATE OFF and ON, as the program says"
    return told[:LEFT] + more + ([off] if data.off else [])


def program_facts(report: Report) -> list[tuple[str, str]]:
    """The lines that the terminal shows as well."""
    return [(key, Text.from_markup(value).plain) for key, value in _rows(report)]


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


def _interval(doubt: Doubt, half_width: float) -> str:
    """`` ± 0.11 mm or more (95 %)``; empty where nothing is known."""
    if math.isnan(half_width):
        return ""
    return f" ± {_two_digits(half_width / MM)} mm{' or more' if doubt.lower_bound else ''} (95 %)"


def _rest(rms: float, p95: float) -> str:
    return (
        "" if math.isnan(rms) else f"at most; rms {rms / MM:.4f} mm, 95 % of motions below {p95 / MM:.4f} mm"
    )


def _mm(length: float, decimals: int) -> str:
    return "–" if not np.isfinite(length) else f"{length / MM:.{decimals}f} mm"
