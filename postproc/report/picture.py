"""A surveyed workspace as a picture: a filled map with its scale, a curve for a line, slices for a box.

The colour maps (viridis, cividis) rise in lightness, so that they can be read without telling red from green and in
print without colour.  What the arm does not reach is grey and hatched.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from postproc.base.arrays import Floats
from postproc.base.sanitize import sanitize
from postproc.base.units import MM
from postproc.report.mapped import Mapped, MappedQuantity, slices_shown
from postproc.report.picture_colours import ON_DATA

DPI = 100
COLOURS = {"deflection_mm": "viridis", "compensator_difference_mm": "cividis"}
_GREY, _HATCH = "#e2e2e2", "#a8a8a8"
_SETTINGS: dict[Any, Any] = {"hatch.linewidth": 0.6, "svg.hashsalt": "compensate", "svg.fonttype": "path"}


def picture(mapped: Mapped, kind: str) -> bytes:
    """The map as ``png`` or ``svg``; the same bytes for the same map."""
    ranged = [axis for axis, count in enumerate(mapped.survey.grid.shape) if count > 1]
    draw = (_curve, _curve, _plane, _slices)[len(ranged)]
    return rendered(lambda: draw(mapped, ranged), kind)


def rendered(draw: Callable[[], Figure], kind: str) -> bytes:
    """The figure that ``draw`` makes, as ``png`` or ``svg``; the same bytes for the same figure."""
    with mpl.rc_context(_SETTINGS):
        canvas = FigureCanvasAgg(draw())
        stream = io.BytesIO()
        smaller: dict[str, Any] = {"pil_kwargs": {"optimize": True}} if kind == "png" else {}
        stamp = {"Software": None} if kind == "png" else {"Date": None}
        canvas.figure.savefig(stream, format=kind, dpi=DPI, metadata=stamp, **smaller)
    return stream.getvalue()


def _plane(mapped: Mapped, ranged: list[int]) -> Figure:
    panels = [q for q in (mapped.quantities[0], mapped.quantities[2]) if q.extremes]
    across, up = (_coordinates(mapped, axis) for axis in ranged)
    tall = float(np.clip(np.ptp(up) / np.ptp(across), 0.25, 1.6))
    figure = Figure(figsize=(5.4 * len(panels) + 0.2, 4.2 * tall + 1.35), layout="constrained")
    figure.suptitle(_title(mapped), fontsize=10, parse_math=False)
    for axes, quantity in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        values = _cube(mapped, quantity).reshape(len(across), len(up)).T
        image = _fill(axes, across, up, values, _bounds(values), COLOURS[quantity.key])
        _contours(axes, across, up, values)
        figure.colorbar(image, cax=axes.inset_axes((1.03, 0.0, 0.045, 1.0)), label="mm")
        axes.set_title(_heading(quantity, values), fontsize=10)
        _name_axes(axes, ranged)
        _mark(axes, mapped, quantity, ranged)
    _legend(figure, mapped, marks=True)
    return figure


def _slices(mapped: Mapped, ranged: list[int]) -> Figure:
    quantity = mapped.quantities[0]
    across, up, levels = (_coordinates(mapped, axis) for axis in range(3))
    cube = _cube(mapped, quantity)
    shown = slices_shown(len(levels))
    columns = int(np.ceil(np.sqrt(len(shown))))
    rows = -(-len(shown) // columns)
    wide = float(np.clip(np.ptp(across) / np.ptp(up), 0.4, 2.5))
    figure = Figure(figsize=(3.0 * columns + 1.4, 3.0 * rows / wide + 1.3), layout="constrained")
    selection = "" if len(shown) == len(levels) else f", {len(shown)} of {len(levels)} slices"
    figure.suptitle(f"{_title(mapped)}\n{_heading(quantity, cube)}{selection}", fontsize=10, parse_math=False)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for place, axes in enumerate(panels.ravel()):
        if place >= len(shown):
            axes.set_visible(False)
            continue
        values = cube[:, :, shown[place]].T
        image = _fill(axes, across, up, values, _bounds(cube), COLOURS[quantity.key])
        axes.set_title(f"z {levels[shown[place]]:g} mm", fontsize=9)
        _name_axes(axes, [0, 1], left=place % columns == 0, below=place + columns >= len(shown))
        if place + columns >= len(shown):
            axes.tick_params(labelbottom=True)
    figure.get_layout_engine().set(h_pad=0.06)  # type: ignore[union-attr, call-arg]
    figure.colorbar(image, ax=panels.ravel().tolist(), shrink=0.8, pad=0.02, label="deflection, mm")
    _legend(figure, mapped, marks=False)
    return figure


def _curve(mapped: Mapped, ranged: list[int]) -> Figure:
    panels = [q for q in (mapped.quantities[0], mapped.quantities[2]) if q.extremes]
    axis = ranged[0]
    along = _coordinates(mapped, axis)
    figure = Figure(figsize=(8.0, 2.6 * len(panels) + 1.2), layout="constrained")
    figure.suptitle(_title(mapped), fontsize=10, parse_math=False)
    rows = figure.subplots(len(panels), 1, squeeze=False, sharex=True)[:, 0]
    for axes, quantity in zip(rows, panels, strict=True):
        values = _cube(mapped, quantity).ravel()
        _dim(axes)
        half = np.diff(along).mean() / 2
        for start, stop in _runs(np.isfinite(values)):
            axes.axvspan(
                along[start] - half, along[stop] + half, facecolor="white", edgecolor="none", zorder=0
            )
        axes.plot(along, values, marker=".", color="#31688e", linewidth=1.6)
        axes.set_title(_heading(quantity, values), fontsize=10)
        axes.set_ylabel("mm")
        axes.set_xlim(along[0] - half, along[-1] + half)
        axes.grid(color="0.85", linewidth=0.6)
        axes.set_axisbelow(True)
    rows[-1].set_xlabel(f"{'xyz'[axis]}, mm")
    _legend(figure, mapped, marks=False)
    return figure


def _coordinates(mapped: Mapped, axis: int) -> Floats:
    grid = mapped.survey.grid
    return np.asarray(np.round((grid.x, grid.y, grid.z)[axis] / MM, 9))


def _cube(mapped: Mapped, quantity: MappedQuantity) -> Floats:
    """[mm] over the grid's shape, NaN where there is no value."""
    values = np.full(mapped.cells, np.nan) if quantity.values is None else quantity.values
    return np.asarray(values / MM).reshape(mapped.survey.grid.shape)


def _bounds(values: Floats) -> tuple[float, float]:
    return float(np.nanmin(values)), float(np.nanmax(values))


def _dim(axes: Axes) -> None:
    """Grey and hatched, wherever nothing is drawn over it."""
    axes.patch.set(facecolor=_GREY, hatch="////", edgecolor=_HATCH)


def _fill(
    axes: Axes, across: Floats, up: Floats, values: Floats, bounds: tuple[float, float], colours: str
) -> Any:
    """One square of colour a cell, its place in the middle."""
    _dim(axes)
    half = [(values[-1] - values[0]) / (len(values) - 1) / 2 for values in (across, up)]
    extent = (across[0] - half[0], across[-1] + half[0], up[0] - half[1], up[-1] + half[1])
    image = axes.imshow(
        np.ma.masked_invalid(values),
        origin="lower",
        extent=extent,
        interpolation="nearest",
        vmin=bounds[0],
        vmax=bounds[1],
        cmap=colours,
    )
    ratio = np.ptp(across) / np.ptp(up)
    axes.set_aspect("equal" if 0.2 <= ratio <= 5 else "auto")
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.yaxis.set_major_locator(MaxNLocator(6))
    axes.tick_params(labelsize=8)
    return image


def _contours(axes: Axes, across: Floats, up: Floats, values: Floats) -> None:
    """Thin labelled lines, where the grid is fine enough to draw them; dark on the light end of the colours."""
    least, greatest = _bounds(values)
    if min(values.shape) < 5 or greatest - least <= 1e-9:
        return
    levels = [level for level in MaxNLocator(7).tick_values(least, greatest) if least < level < greatest]
    colours = ["white" if (level - least) / (greatest - least) < 0.6 else "#202020" for level in levels]
    lines = axes.contour(
        across, up, np.ma.masked_invalid(values), levels=levels, colors=colours, linewidths=0.7
    )
    lines.set_gid(f"{ON_DATA}-contours")
    for number, label in enumerate(axes.clabel(lines, fmt="%g", fontsize=7.5, inline_spacing=3)):
        label.set_gid(f"{ON_DATA}-level-{number}")


def _mark(axes: Axes, mapped: Mapped, quantity: MappedQuantity, ranged: list[int]) -> None:
    if quantity.extremes is None:
        return
    for extreme, marker in zip(quantity.extremes, "ov", strict=True):
        place = mapped.survey.grid.positions[extreme.row] / MM
        axes.plot(
            place[ranged[0]],
            place[ranged[1]],
            marker,
            markersize=8,
            color="white",
            markeredgecolor="black",
            clip_on=False,
            zorder=5,
            gid=f"{ON_DATA}-{marker}",
        )


def _name_axes(axes: Axes, ranged: list[int], left: bool = True, below: bool = True) -> None:
    if below:
        axes.set_xlabel(f"{'xyz'[ranged[0]]}, mm", fontsize=9)
    if left:
        axes.set_ylabel(f"{'xyz'[ranged[1]]}, mm", fontsize=9)


def _legend(figure: Figure, mapped: Mapped, marks: bool) -> None:
    handles: list[Any] = []
    if marks:
        style: dict[str, Any] = {"color": "white", "markeredgecolor": "black", "linestyle": "none"}
        handles += [
            Line2D([], [], marker="o", label="smallest", **style),
            Line2D([], [], marker="v", label="largest", **style),
        ]
    if mapped.unreachable or mapped.survey.unsettled.any():
        limits = "" if mapped.load.ignore_limits else " or beyond the axis limits"
        label = f"out of reach{limits} ({mapped.unreachable} of {mapped.cells} cells)"
        handles.append(Patch(facecolor=_GREY, hatch="////", edgecolor=_HATCH, label=label))
    if handles:
        figure.legend(
            handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False
        )


def _title(mapped: Mapped) -> str:
    grid = mapped.survey.grid
    fixed_axes = [
        f"{name} {_coordinates(mapped, axis)[0]:g} mm"
        for axis, name in enumerate("xyz")
        if grid.shape[axis] == 1
    ]
    how = ["linear, eq. (5)" if mapped.load.linear else "deflected equilibrium"]
    if mapped.sign:
        how.append(f"compensator sign {mapped.sign}")
    return f"{sanitize(mapped.robot)}, force {mapped.force}\n{', '.join([*fixed_axes, *how])}"


def _heading(quantity: MappedQuantity, values: Floats) -> str:
    name = {"deflection_mm": "deflection"}.get(quantity.key, "compensator on/off, difference")
    least, greatest = _bounds(values)
    decimals = int(np.clip(2 - np.floor(np.log10(max(greatest, 1e-9))), 3, 9))
    return f"{name}: {least:.{decimals}f} to {greatest:.{decimals}f} mm"


def _runs(true: Any) -> list[tuple[int, int]]:
    """First and last index of every run of true values."""
    edges = np.diff(np.concatenate([[0], np.asarray(true, np.int8), [0]]))
    starts, stops = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return list(zip(starts.tolist(), stops.tolist(), strict=True))
