"""The objective of a placement over x and y, with the room, the present place and the best one."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.placement.room import FREEDOMS, UNITS, X, Y
from postproc.report.picture import rendered
from postproc.report.placement import OBJECTIVE_WORDS, Placement

_GREY, _HATCH = "#e2e2e2", "#a8a8a8"


def placement_picture(done: Placement, kind: str) -> bytes:
    """The picture as ``png`` or ``svg``; b"" where not both x and y are free, or no place of the plane is feasible."""
    if done.grid is None or not np.isfinite(done.grid.value).any():
        return b""
    return rendered(lambda: _draw(done), kind)


def _draw(done: Placement) -> Figure:
    assert done.grid is not None
    grid, best, present = done.grid, done.best.place, done.present.place
    x, y, values = grid.x / MM, grid.y / MM, grid.value.T / MM
    figure = Figure(figsize=(7.0, 6.4), layout="constrained")
    axes = figure.subplots()
    axes.patch.set(facecolor=_GREY, hatch="////", edgecolor=_HATCH)
    half = [(end[-1] - end[0]) / (len(end) - 1) / 2 for end in (x, y)]
    image = axes.imshow(
        np.ma.masked_invalid(values),
        origin="lower",
        extent=(x[0] - half[0], x[-1] + half[0], y[0] - half[1], y[-1] + half[1]),
        interpolation="nearest",
        cmap="viridis",
    )
    axes.set_aspect("equal" if 0.2 <= np.ptp(x) / np.ptp(y) <= 5 else "auto")
    figure.colorbar(image, ax=axes, label=f"{OBJECTIVE_WORDS[done.objective]}, mm", shrink=0.85)
    if done.room.polygon is not None:
        axes.add_patch(Polygon(done.room.polygon / MM, fill=False, edgecolor="black", linewidth=1.4))
    style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "linestyle": "none"}
    handles: list[Any] = []
    for place, marker, label in ((present, "s", "present place"), (best, "*", "best place")):
        axes.plot(place[X] / MM, place[Y] / MM, marker, markersize=12, clip_on=False, zorder=5, **style)
        handles.append(Line2D([], [], marker=marker, markersize=9, label=label, **style))
    if np.isnan(values).any():
        handles.append(Patch(facecolor=_GREY, hatch="////", edgecolor=_HATCH, label="not feasible"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    others = [
        f"{FREEDOMS[i].replace('_', ' ')} {best[i] / UNITS[i]:.1f}" for i in done.room.free if i not in (X, Y)
    ]
    held = f"\nall else as at the best place: {', '.join(others)}" if others else ""
    axes.set_title(f"{sanitize(done.robot)}: base {done.base}{held}", fontsize=10, parse_math=False)
    axes.set_xlabel("x of the base, mm", fontsize=9)
    axes.set_ylabel("y of the base, mm", fontsize=9)
    axes.tick_params(labelsize=8)
    return figure
