"""A measured part as a picture: what was measured, what the causes explain, and what remains, on one scale of colours.

The points lie on the surface of the part where a stock is stated, else along the paths that cut; seen obliquely from
above, so that walls and floors show.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from postproc.base.arrays import Floats, Ints
from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.report.learned import Learned
from postproc.report.picture import rendered
from postproc.report.picture_colours import ON_DATA

YAW, PITCH = 0.5, 0.75
"""[rad] of the view: about the vertical, and from above."""

LIGHT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
PANELS = ("measured", "explained", "remaining")


@dataclass(frozen=True, eq=False)
class PartShape:
    """What the points lie on, in m in the axes of the base: ``path`` (M, 3) of the tip, NaN between cuts; vertices
    (V, 3) and faces (F, 3) of the surface, none without a stock."""

    path: Floats
    vertices: Floats
    faces: Ints


def learned_picture(learned: Learned, shape: PartShape, kind: str) -> bytes:
    """The picture of the last part as ``png`` or ``svg``; the same bytes for the same result."""
    return rendered(lambda: _draw(learned, shape), kind)


def panel_values(learned: Learned) -> dict[str, Floats]:
    """Name of a panel -> (K,) [m] at the points of the last part that are no outliers."""
    result = learned.attribution
    own = result.kept & (learned.file == learned.file.max())
    explained = result.by_causes + result.by_field
    values = (result.deviation - result.by_alignment, explained, learned.remaining)
    return {name: value[own] for name, value in zip(PANELS, values, strict=True)}


def _draw(learned: Learned, shape: PartShape) -> Figure:
    result = learned.attribution
    own = result.kept & (learned.file == learned.file.max())
    out = ~result.kept & (learned.file == learned.file.max())
    values = panel_values(learned)
    largest = max(float(np.abs(values[name]).max(initial=0.0)) for name in PANELS) / MM
    view = _view()
    figure = Figure(figsize=(7.2, 9.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, sharey=True)
    points, missed = learned.in_base[own] @ view.T / MM, learned.in_base[out] @ view.T / MM
    drawn: Any = None
    for axes, name in zip(panels, PANELS, strict=True):
        _draw_shape(axes, shape, view)
        drawn = axes.scatter(
            points[:, 0], points[:, 1], c=values[name] / MM, cmap="RdYlBu_r", vmin=-largest, vmax=largest,
            s=34, edgecolors="#404040", linewidths=0.5, zorder=4,
        )  # fmt: skip
        drawn.set_gid(f"{ON_DATA}-{name}")
        axes.plot(missed[:, 0], missed[:, 1], "x", color="black", markersize=7, zorder=5)
        rms = float(np.sqrt(np.mean(values[name] ** 2))) / MM
        axes.set_title(f"{name}: {rms:.4f} mm RMS", fontsize=10)
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.colorbar(
        drawn, ax=panels.tolist(), label="deviation, mm: + more material than nominal, - less", shrink=0.6
    )
    handles = (
        [Line2D([], [], marker="x", color="black", linestyle="none", label="outlier")] if out.any() else []
    )
    if handles:
        figure.legend(handles=handles, loc="outside lower center", fontsize=8, frameon=False)
    last = learned.data[-1][0]
    figure.suptitle(sanitize(f"{last}: {int(own.sum())} points"), fontsize=10, parse_math=False)
    return figure


def _view() -> Floats:
    """(3, 3) right, up and towards the reader, of a view from above."""
    c, s, cp, sp = np.cos(YAW), np.sin(YAW), np.cos(PITCH), np.sin(PITCH)
    return np.array([[c, s, 0], [-s * sp, c * sp, cp], [s * cp, -c * cp, sp]])


def _draw_shape(axes: Axes, shape: PartShape, view: Floats) -> None:
    """The surface, shaded, or the paths of the tip."""
    if not len(shape.faces):
        seen = shape.path @ view.T / MM
        axes.plot(seen[:, 0], seen[:, 1], color="#a0a0a0", linewidth=0.6, zorder=1)
        return
    corners = (shape.vertices @ view.T / MM)[shape.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    front = np.flatnonzero(normal[:, 2] > 0)
    order = front[np.argsort(corners[front, :, 2].mean(axis=1), kind="stable")]
    shade = np.repeat((0.55 + 0.35 * np.abs(normal[order] @ LIGHT))[:, None], 3, axis=1)
    surface = PolyCollection(
        corners[order, :, :2].tolist(), facecolors=shade, edgecolors=shade, linewidths=0.3, zorder=1
    )
    surface.set_rasterized(True)
    axes.add_collection(surface)
    axes.autoscale_view()
