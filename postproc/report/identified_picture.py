"""The residuals of an identification as a picture: the size of each before and after, by each joint, direction,
load and in the order of time, on a logarithmic scale.

Grey, blue and orange (Okabe and Ito) can be distinguished by everybody; lines and points differ by their form too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from postproc.base.arrays import Floats, Ints
from postproc.base.sanitize import sanitize, sanitize_lines
from postproc.base.units import MM
from postproc.report.identified import Identified
from postproc.report.picture import rendered
from postproc.report.residuals import ResidualVariable, Sizes

COLUMNS = 3
MAX_POINTS = 900
"""Readings of each series that are drawn as points; lines are those of all."""

WORST = 20
"""Of them, so many are the largest, which are always drawn."""

FEW = 200
"""Up to so many readings are drawn large."""

SMALL = 2.0
"""[%] Of the fitted residuals, so many lie below the scale and are drawn at its edge."""

LEAST = 1e-6
"""[mm] The scale starts no lower."""

_NAMES = {"before": "before", "after": "fitted", "held_out_after": "held-out poses"}
_COLOURS = {"before": "#7f7f7f", "after": "#0072b2", "held_out_after": "#d55e00"}
_LINES: dict[str, dict[str, Any]] = {
    "before": {"linestyle": "-", "linewidth": 1.8, "marker": "s", "markersize": 3.5},
    "after": {"linestyle": "-", "linewidth": 2.2, "marker": "o", "markersize": 4.5},
    "held_out_after": {"linestyle": "--", "linewidth": 1.2, "marker": "D", "markersize": 2.0},
}
_POINTS = {"before": "s", "after": "o"}
_SCATTER: dict[str, Any] = {"color": "black", "linestyle": ":", "linewidth": 0.9}
_OUTLIER: dict[str, Any] = {
    "marker": "o",
    "markersize": 7,
    "markerfacecolor": "none",
    "markeredgecolor": "black",
    "linestyle": "none",
}


def identified_picture(result: Identified, kind: str) -> bytes:
    """The residuals as ``png`` or ``svg``; the same bytes for the same result."""
    return rendered(lambda: _figure(result), kind)


def _figure(result: Identified) -> Figure:
    by = [*result.joints, *([result.load] if result.load else []), result.order]
    count = len(by) + 1
    rows = -(-count // COLUMNS)
    figure = Figure(figsize=(3.7 * COLUMNS, 2.5 * rows + 1.1), layout="constrained")
    figure.suptitle(sanitize_lines(_title(result)), fontsize=10, parse_math=False)
    panels = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True).ravel()
    ends = _scale(result)
    for axes, variable in zip(panels, by, strict=False):
        _scattered(axes, result, variable, ends[0])
    _directions(panels[len(by)], result)
    for place, axes in enumerate(panels):
        axes.set_visible(place < count)
        axes.set_yscale("log")
        axes.set_ylim(*ends)
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_locator(NullLocator())
        axes.tick_params(labelsize=8)
        axes.grid(color="0.9", linewidth=0.6)
        axes.set_axisbelow(True)
        if place % COLUMNS == 0:
            axes.set_ylabel("residual, mm", fontsize=9)
    _legend(figure, result)
    return figure


def _scattered(axes: Axes, result: Identified, variable: ResidualVariable, least: float) -> None:
    """Readings as points, and the root mean square of each part of them as a line."""
    few = len(result.after.campaign) <= FEW
    style: dict[str, Any] = {"markeredgewidth": 0, "linestyle": "none"}
    style |= {"markersize": 4.5, "alpha": 0.7} if few else {"markersize": 2.6, "alpha": 0.35}
    for name, marker in _POINTS.items():
        size = result.lengths[name] / MM
        rows = rows_to_draw(size)
        height = np.maximum(size[rows], least)
        axes.plot(variable.values[rows], height, marker=marker, color=_COLOURS[name], **style)
    parts = variable.parts()
    middle = [float(np.median(variable.values[rows])) for rows in parts]
    for name, line in _LINES.items():
        if name in result.lengths:
            mean = [_rms(result.lengths[name][rows]) for rows in parts]
            axes.plot(middle, mean, color=_COLOURS[name], **line)
    far = _fitted_outliers(result)
    axes.plot(variable.values[far], result.lengths["after"][far] / MM, **_OUTLIER)
    if result.after.noise.known:
        axes.axhline(result.after.noise.rms / MM, **_SCATTER)
    axes.set_xlabel(sanitize(f"{variable.name}, {variable.unit}").rstrip(", "), fontsize=9, parse_math=False)


def _directions(axes: Axes, result: Identified) -> None:
    """Root mean square of each coordinate, robot base axes."""
    for name, line in _LINES.items():
        if name in result.residuals:
            mean = [_rms(result.residuals[name][result.counts, axis]) for axis in range(3)]
            axes.plot(range(3), mean, color=_COLOURS[name], **line)
    if result.after.noise.known:
        axes.axhline(result.sigma / MM, **_SCATTER)
    axes.set_xticks(range(3), list("xyz"))
    axes.set_xlim(-0.5, 2.5)
    axes.set_xlabel("direction, robot base (one coordinate)", fontsize=9)


def rows_to_draw(size: Floats) -> Ints:
    """Rows (K,) of ``size`` (R,) that are drawn: all, or ``MAX_POINTS`` of them, the largest among them."""
    seen = np.flatnonzero(np.isfinite(size))
    if len(seen) <= MAX_POINTS:
        return seen
    by_size = seen[np.argsort(-size[seen], kind="stable")]
    rest = np.sort(by_size[WORST:])
    some = rest[np.linspace(0, len(rest) - 1, MAX_POINTS - WORST).round().astype(int)]
    return np.sort(np.concatenate([by_size[:WORST], some]))


def _scale(result: Identified) -> tuple[float, float]:
    """[mm] Where the scale starts and ends."""
    seen = [lengths[np.isfinite(lengths)] / MM for lengths in (result.lengths[name] for name in _POINTS)]
    least = max(0.8 * float(np.percentile(seen[1], SMALL)), LEAST)
    return least, max(1.4 * max(float(lengths.max()) for lengths in seen), 2.0 * least)


def _fitted_outliers(result: Identified) -> list[int]:
    return [outlier.row for outlier in result.outliers if result.counts[outlier.row]]


def _rms(values: Floats) -> float:
    """[mm], NaN of nothing."""
    size = Sizes.of(values)
    return size.rms / MM if size else np.nan


def _legend(figure: Figure, result: Identified) -> None:
    handles: list[Any] = [
        Line2D([], [], color=_COLOURS[name], label=f"{label} (line: RMS)", **_LINES[name])
        for name, label in _NAMES.items()
        if name in result.lengths
    ]
    if result.after.noise.known:
        handles.append(Line2D([], [], label="scatter of the readings", **_SCATTER))
    if _fitted_outliers(result):
        handles.append(Line2D([], [], label="outlier", **_OUTLIER))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False)


def _title(result: Identified) -> str:
    gap, campaign = result.gap_mm(), result.after.campaign
    residuals = f"{gap['before_rms_mm']:.3f} mm RMS before, {gap['after_rms_mm']:.3f} mm fitted"
    if "held_out_after_rms_mm" in gap:
        residuals += f", {gap['held_out_after_rms_mm']:.3f} mm on held-out poses"
    of = f"{len(campaign)} readings at {campaign.poses} poses"
    return f"{result.robot}, {', '.join(result.effects)}: {of}\n{residuals}"
