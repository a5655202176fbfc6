"""What the page of a program shows of its part: figures, a table, a static picture of each side, and the mesh."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.units import MM
from postproc.compensation.uncertainty import Uncertainty
from postproc.part.part_figures import ErrorFigures, PartError, PartFigures
from postproc.report.part_mesh import BANDS, band_colours
from postproc.report.part_report import SIDES, forces_sentence, side_sentence

WIDE, HIGH = 640, 400
"""Pixels of a static picture."""

_BESIDE, _PITCH = 0.66, 0.6  # rad: the reader is opposite to the robot, to one side of it and above
_LIGHT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
_EACH = (
    np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2], [4, 0, 0], [0, 4, 0], [0, 0, 4]]) / 4
)  # of a triangle's corners
_LARGEST = 32767
_NOTHING = -32768  # of what the program does not make

SIDE_WORDS = {"before": "as posted", "after": "as compensated"}


def part_section(part: PartError, uncertainty: Uncertainty, yaw: float) -> dict[str, object]:
    """What ``part.html.j2`` shows, but for the ``data`` of its script (``part_data``); ``yaw``: of the view."""
    figures = part.figures
    sides = [side for side in (part.before, part.after) if side is not None]
    pictures = []
    for (name, _), side in zip(figures.sides, sides, strict=True):
        colours = band_colours(part.vertex_errors(side), figures.tolerance)
        pictures.append((SIDE_WORDS[name], _png(_picture(part, colours, yaw))))
    sentences = [
        f"{SIDES[name].capitalize()}: {side_sentence(side, figures.tolerance, uncertainty)}."
        for name, side in figures.sides
    ]
    return {
        "sentence": " ".join([*sentences, f"Forces: {forces_sentence(figures)}."]),
        "images": pictures,
        "wide": WIDE,
        "high": HIGH,
        "key": _png(np.repeat(np.repeat(BANDS[None], 32, axis=1), 14, axis=0)),
        "tolerance": f"{figures.tolerance / MM:g}",
        "spacing": f"{figures.spacing / MM:.2g}",
        "rows": list(_rows(figures)),
    }


def oblique_yaw(part: PartError, robot: Sequence[float]) -> float:
    """[rad] The turn of the view about z in which the part hides the robot, not the robot the part; ``robot``: the pose
    of its base in the axes of the stock, as of ``part_scene``."""
    vertices = part.surface.vertices
    x, y = (0.5 * (vertices.min(axis=0) + vertices.max(axis=0)) / MM)[:2] - np.array([robot[3], robot[7]])
    return float(np.arctan2(y, x)) + _BESIDE


def part_data(part: PartError, scene: Mapping[str, Any]) -> dict[str, object]:
    """What ``part.js`` draws: places in 65,535ths of the extent, errors in 32,767ths of the range [mm]; ``scene``: what
    is around the part (``part_scene``)."""
    vertices, tolerance = part.surface.vertices, part.figures.tolerance
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = np.maximum(high - low, 1e-9)
    places = np.zeros((len(vertices), 4), "<u2")
    places[:, :3] = np.round((vertices - low) / extent * 65535)
    span = 4 * tolerance  # what exceeds twice the tolerance has one colour
    errors = np.zeros((len(vertices), 2), "<i2")
    for column, side in enumerate((part.before, part.after or part.before)):
        error = part.vertex_errors(side)
        scaled = np.clip(np.nan_to_num(error) / span, -0.99, 0.99) * _LARGEST
        errors[:, column] = np.where(np.isnan(error), _NOTHING, np.round(scaled))
    middle = 0.5 * (low + high)
    return {
        "vertices": _text(places),
        "errors": _text(errors),
        "faces": _text(part.surface.faces.astype("<u4")),
        "corners": part.surface.faces.size,
        "extent": np.round(extent / MM, 4).tolist(),
        "middle": np.round(middle / MM, 4).tolist(),
        "yaw": oblique_yaw(part, scene["robot"]),
        "scene": dict(scene),
        "range": span / MM,
        "tolerance": tolerance / MM,
        "bands": BANDS[:, :3].tolist(),
        "sides": len(part.figures.sides),
        "worst": [
            np.round((np.array(side.worst.position) - middle) / MM, 4).tolist()
            for _, side in part.figures.sides
        ],
    }


def _text(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _rows(figures: PartFigures) -> Iterator[dict[str, str]]:
    whole = (figures.before.whole, None if figures.after is None else figures.after.whole)
    groups = [("all", 1.0, *whole)]
    groups += [(group.name, group.area, group.before, group.after) for group in figures.features]
    groups += [
        (f"{group.name}, lines {group.lines[0]} to {group.lines[1]}", group.area, group.before, group.after)
        for group in figures.operations
    ]
    for name, area, before, after in groups:
        yield {"name": name, "area": f"{100 * area:.1f} %", "side": "before", **_cells(before)}
        if after is not None:
            yield {"name": name, "area": "", "side": "after", **_cells(after)}


def _cells(figures: ErrorFigures) -> dict[str, str]:
    lengths = {
        "gouge": figures.gouge_max,
        "excess": figures.excess_max,
        "rms": figures.rms,
        "p95": figures.p95,
    }
    return {
        **{key: f"{value / MM:.4f}" for key, value in lengths.items()},
        "out": f"{100 * figures.out:.1f} %",
    }


def _picture(part: PartError, colours: Any, yaw: float) -> Any:
    """(HIGH, WIDE, 4) the part in parallel projection, seen as the page's script shows it first."""
    surface = part.surface
    c, s, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(_PITCH), np.sin(_PITCH)
    view = np.array([[c, s, 0], [-s * sp, c * sp, cp], [s * cp, -c * cp, sp]])
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    seen = (surface.vertices - 0.5 * (low + high)) @ view.T
    span = np.abs(view[:2]) @ (high - low)
    scale = 0.92 * min(WIDE / span[0], HIGH / span[1])
    corners = seen[surface.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    front = normal[:, 2] > 0
    light = 0.55 + 0.45 * np.abs(normal[front] @ _LIGHT)
    image = np.zeros((HIGH * WIDE, 4), np.uint8)
    depth = np.full(HIGH * WIDE, -np.inf)
    shown = colours[surface.faces[front]].astype(float)
    for weights in _EACH:
        points = np.einsum("c,fck->fk", weights, corners[front])
        shade = np.einsum("c,fck->fk", weights, shown)
        shade[:, :3] *= light[:, None]
        _splat(points, shade, scale, image, depth)
    return image.reshape(HIGH, WIDE, 4)


def _splat(points: Floats, shade: Floats, scale: float, image: Any, depth: Floats) -> None:
    """The nearest of ``points`` (F, 3) with their colours ``shade`` (F, 4) put into ``image`` (P, 4), each on a square
    of pixels; ``depth`` (P,): of what is there."""
    order = np.argsort(points[:, 2], kind="stable")
    x = WIDE / 2 + scale * points[order, 0]
    y = HIGH / 2 - scale * points[order, 1]
    for right in (-0.5, 0.5):
        for down in (-0.5, 0.5):
            i, j = np.floor(y + down).astype(np.int64), np.floor(x + right).astype(np.int64)
            inside = (i >= 0) & (i < HIGH) & (j >= 0) & (j < WIDE)
            pixel, rows = (i * WIDE + j)[inside], order[inside]
            nearer = points[rows, 2] > depth[pixel]
            pixel, rows = pixel[nearer], rows[nearer]
            image[pixel] = shade[rows]  # in the order of depth: the nearest is last
            depth[pixel] = points[rows, 2]


def _png(image: Any) -> str:
    """An image (H, W, 4) as the address of its PNG."""
    from matplotlib.image import imsave  # takes its time to load

    stream = io.BytesIO()
    imsave(stream, np.ascontiguousarray(image), format="png")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
