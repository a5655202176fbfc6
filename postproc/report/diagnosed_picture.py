"""A diagnosis as a picture: the gap at each pose before and after, residuals over what betrays the missing effect, and
what each candidate explains.

Grey, two blues, green and orange (Okabe and Ito) can be distinguished by everybody; points and bars differ by form too.
"""

from __future__ import annotations

from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullLocator

from postproc.base.arrays import Floats
from postproc.base.sanitize import sanitize, sanitize_lines
from postproc.base.units import MM
from postproc.diagnosis.residual_patterns import patterns
from postproc.diagnosis.search_result import Key
from postproc.identification.fit import Fit
from postproc.report.diagnosed import Diagnosed
from postproc.report.diagnosed_words import headline
from postproc.report.identified_picture import rows_to_draw
from postproc.report.picture import rendered
from postproc.report.residuals import ResidualVariable, Sizes, poses_in_order

PANELS = 2
"""Variables that residuals are drawn over."""

BARS = 12
"""Candidates that are drawn."""

NUMBERED = 40
"""Up to so many poses have their numbers below them."""

LINE = 150
"""Letters in a line of the title."""

LEAST = 1e-6
"""[mm] The scale of the gap starts no lower."""

_NAMES = {
    "before": "robot file",
    "refitted": "its parameters refitted",
    "explained": "with all effects found",
    "after": "final model",
    "held_out_after": "final model, held-out poses",
}
_STYLES: dict[str, dict[str, Any]] = {
    "before": {"color": "#7f7f7f", "marker": "s", "markersize": 4.5},
    "refitted": {"color": "#56b4e9", "marker": "^", "markersize": 4.5},
    "explained": {"color": "#009e73", "marker": "v", "markersize": 4.5},
    "after": {"color": "#0072b2", "marker": "o", "markersize": 5.0},
    "held_out_after": {"color": "#d55e00", "marker": "D", "markersize": 3.0},
}
_SCATTER: dict[str, Any] = {"color": "black", "linestyle": ":", "linewidth": 0.9}
_NEEDED: dict[str, Any] = {
    "color": "black",
    "linestyle": "none",
    "marker": "|",
    "markersize": 20,
    "markeredgewidth": 1.6,
}
_BARS: dict[str, dict[str, Any]] = {
    "named": {"facecolor": "#0072b2", "edgecolor": "#0072b2"},
    "indistinguishable": {"facecolor": "#d55e00", "edgecolor": "white", "hatch": "////"},
    "next explanation": {"facecolor": "#7f7f7f", "edgecolor": "white", "hatch": "...."},
    "rejected": {"facecolor": "white", "edgecolor": "#7f7f7f", "hatch": "xxxx"},
    "another": {"facecolor": "#cccccc", "edgecolor": "#cccccc"},
}


def diagnosed_picture(result: Diagnosed, kind: str) -> bytes:
    """The diagnosis as ``png`` or ``svg``; the same bytes for the same result."""
    return rendered(lambda: _figure(result), kind)


def _figure(result: Diagnosed) -> Figure:
    figure = Figure(figsize=(13.5, 7.4), layout="constrained")
    figure.suptitle(sanitize_lines(_title(result)), fontsize=10, parse_math=False)
    grid = figure.add_gridspec(2, PANELS + 1, width_ratios=[1.0] * PANELS + [1.15])
    _gap(figure.add_subplot(grid[0, :PANELS]), result)
    several = betrayals(result)
    for place, betrayal in enumerate(several):
        cell = grid[1, place] if len(several) > 1 else grid[1, :PANELS]
        _betrayed(figure.add_subplot(cell), betrayal, result)
    _evidence(figure.add_subplot(grid[:, PANELS]), result)
    for axes in figure.axes:
        axes.tick_params(labelsize=8)
        axes.grid(color="0.9", linewidth=0.6)
        axes.set_axisbelow(True)
    handles = [handle for axes in (figure.axes[0], figure.axes[-1]) for handle in _handles(axes)]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def _handles(axes: Axes) -> list[Any]:
    """What of a panel has a label, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    return list(dict(zip(labels, handles, strict=True)).values())


def series(result: Diagnosed) -> list[str]:
    """The residuals that are drawn: each fit once."""
    same = {"refitted": result.diagnosis.base, "explained": result.diagnosis.search.confirmed}
    return [name for name in _NAMES if (one := same.get(name)) is None or one.point is not result.final.point]


def _gap(axes: Axes, result: Diagnosed) -> None:
    """The root mean square of each pose, the largest of the robot file first."""
    number = poses_in_order(result.final.campaign.pose)
    poses = np.unique(number)
    sizes = {
        name: np.array([_rms(result.lengths[name][number == pose]) for pose in poses])
        for name in series(result)
    }
    order = np.argsort(-np.nan_to_num(sizes["before"]), kind="stable")
    for name, size in sizes.items():
        height = np.maximum(size[order], LEAST)
        axes.plot(np.arange(len(poses)), height, label=_NAMES[name], linestyle="none", **_STYLES[name])
    _scatter_line(axes, result)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    if len(poses) <= NUMBERED:
        axes.xaxis.set_major_locator(FixedLocator(range(len(poses))))
        axes.set_xticklabels([str(poses[k]) for k in order])
    axes.set_xlabel("pose, largest gap first", fontsize=9)
    axes.set_ylabel("residual, mm RMS", fontsize=9)


class Betrayal(NamedTuple):
    """Residuals ``before`` (R,) [mm] and ``after`` (R,) [mm] over a variable: along what a turn of its joint moves
    (``turning``), else their lengths.  share: of the squares that follow it, NaN where nothing does."""

    variable: ResidualVariable
    before: Floats
    after: Floats
    turning: bool
    share: float


def betrayals(result: Diagnosed) -> list[Betrayal]:
    """The variables that what is missing goes with, those of the joints that are named first; without any the order of
    the readings.  Before: the robot file, its own parameters refitted; after: with all that was chosen."""
    joints = {joint for named in result.verdict.named for joint in named.joints}
    several = sorted(result.patterns, key=lambda one: one.variable.partition(" ")[0] not in joints)
    shares = {one.variable: one.share for one in several[:PANELS]} or {"order": np.nan}
    before, after = _along(result.diagnosis.base), _along(result.diagnosis.search.confirmed)
    return [
        Betrayal(before[name][0], before[name][1], after[name][1], before[name][2], share)
        for name, share in shares.items()
    ]


def _along(fitted: Fit) -> dict[str, tuple[ResidualVariable, Floats, bool]]:
    """Of each variable that residuals are screened by: its values, the residuals [mm], whether along a turn."""
    residual, screened = fitted.point.residual[:, :3], {}
    for name, values, turns, (unit, size) in patterns(fitted, fitted.campaign):
        if turns is None:
            along = np.sqrt(np.nansum(residual**2, axis=1))
        else:
            length = np.maximum(np.linalg.norm(turns, axis=1), 1e-12)
            along = np.nansum(residual * turns, axis=1) / length
        screened[name] = (ResidualVariable(name, unit, values / size), along / MM, turns is not None)
    return screened


def _betrayed(axes: Axes, betrayal: Betrayal, result: Diagnosed) -> None:
    """Readings as points, and the mean of each part of them as a line."""
    variable = betrayal.variable
    rows = rows_to_draw(np.abs(betrayal.before))
    parts = variable.parts()
    middle = [float(np.median(variable.values[part])) for part in parts]
    drawn = series(result)
    both = {"refitted": betrayal.before, "explained": betrayal.after}
    for name, values in {fit if fit in drawn else "after": of for fit, of in both.items()}.items():
        style = _STYLES[name]
        axes.plot(variable.values[rows], values[rows], linestyle="none", alpha=0.4, **style)
        mean = [float(np.mean(values[part])) for part in parts]
        axes.plot(middle, mean, color=style["color"], linewidth=1.6)
    if betrayal.turning:
        axes.axhline(0.0, color="0.5", linewidth=0.8)
    else:
        _scatter_line(axes, result)
    share = f" ({100 * betrayal.share:.0f} % of the residual)" if np.isfinite(betrayal.share) else ""
    axes.set_title(sanitize(f"{variable.name}{share}"), fontsize=9, parse_math=False)
    axes.set_xlabel(sanitize(f"{variable.name}, {variable.unit}").rstrip(", "), fontsize=9, parse_math=False)
    joint = variable.name.partition(" ")[0]
    along = f"residual along a rotation of {joint}, mm" if betrayal.turning else "residual, mm"
    axes.set_ylabel(along, fontsize=9, parse_math=False)


def _evidence(axes: Axes, result: Diagnosed) -> None:
    """What each candidate explains alone, and within it what it adds to all that was chosen."""
    candidates, gains = result.diagnosis.search.linear.candidates, result.gains
    roles = roles_of(result)
    # those that the verdict speaks of, then the strongest
    order = sorted(range(len(candidates)), key=lambda g: (candidates[g].key not in roles, -gains.alone[g]))
    order = sorted(order[:BARS], key=lambda g: -gains.alone[g])
    for row, g in enumerate(order):
        role = roles.get(candidates[g].key, "another")
        axes.barh(row, gains.alone[g], height=0.7, label=f"{role}: explained alone", **_BARS[role])
        if result.diagnosis.search.chosen:
            axes.barh(row, gains.beside[g], height=0.25, facecolor="black", label="explained in addition")
    axes.plot(gains.needed[order], range(len(order)), label="required", **_NEEDED)
    axes.set_xscale("symlog", linthresh=10.0)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_yticks(range(len(order)), [sanitize(candidates[g].label) for g in order])
    for label in axes.get_yticklabels():
        label.set_parse_math(False)
    axes.set_ylim(max(len(order), 1) - 0.5, -0.5)
    axes.set_xlabel("likelihood gain, 2 ln(likelihood ratio)", fontsize=9)
    axes.set_title("evidence per candidate", fontsize=9)


def roles_of(result: Diagnosed) -> dict[Key, str]:
    """What the verdict makes of candidates; the others have no part."""
    verdict = result.verdict
    roles = {candidate.key: "rejected" for candidate, _ in verdict.rejected}
    aliases = [named.evidence.alias for named in verdict.named]
    roles |= {alias.key: "next explanation" for alias in aliases if alias is not None}
    roles |= {c.key: "indistinguishable" for one in verdict.alternatives for c in one}
    return roles | {named.candidate.key: "named" for named in result.clear}


def _scatter_line(axes: Axes, result: Diagnosed) -> None:
    if result.final.noise.known:
        axes.axhline(result.scatter / MM, label="scatter of the readings", **_SCATTER)


def _rms(lengths: Floats) -> float:
    """[mm], NaN of nothing."""
    size = Sizes.of(lengths)
    return size.rms / MM if size else np.nan


def _title(result: Diagnosed) -> str:
    gap, campaign = result.gap_mm(), result.final.campaign
    of = f"{len(campaign)} readings at {campaign.poses} poses"
    residuals = f"{gap['before_rms_mm']:.3f} mm RMS before, {gap['after_rms_mm']:.3f} mm after"
    if "held_out_after_rms_mm" in gap:
        residuals += f", {gap['held_out_after_rms_mm']:.3f} mm on held-out poses"
    return f"{result.robot}, {of}: {residuals}\n{fill(headline(result), LINE)}"
