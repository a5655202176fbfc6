"""The ``stock:`` and ``tools:`` of a process file, read strictly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import tan
from pathlib import Path
from typing import Any

from postproc.base.arrays import Floats, frozen
from postproc.base.units import DEG, MM
from postproc.base.yaml_section import YamlSection, load
from postproc.process.materials import Material
from postproc.process.process_file import ProcessValues, read_material, read_whole
from postproc.process.stock.cutters import SHAPES, Cutter
from postproc.process.tool_comments import CommentedTool

BLANKS = ("box", "cylinder", "stl", "from")
AXES = ("x", "y", "z")
FOOT = "center is the middle of a cylinder's foot, from which height goes along +axis"
_EDGES = ("teeth", "helix", "spindle", "material", "coefficients", "ci95")
_SHAPE_KEYS = {"bull": ("corner_radius",), "cone": ("angle", "tip_diameter"), "drill": ("point_angle",)}
_FAR = 100_000.0  # mm
_MOST_TEETH = 1000
_LEAST_DIAMETER = 0.1  # mm: below it no robot mills, and 0.016 is 16 in metres


@dataclass(frozen=True)
class Edges:
    """What the force of a tool needs besides its shape; None where it is not stated.  speed [rad/s]."""

    speed: float | None
    material: Material | None


@dataclass(frozen=True, eq=False)
class StockProcess:
    """A process file with a stock.

    blank: one of BLANKS; numbers: of a box its corners (2, 3) [m], of a cylinder the middle of its foot (3,), diameter
    and height [m] in one row; lengthwise: axis of a cylinder; file: of ``stl`` and ``from``; scale: mm of the STL's
    unit.  base: number of the base whose axes these are, None for that of the first cut.  rapid [m/s]: motions at this
    feed and above do not cut.
    """

    path: Path
    blank: str
    numbers: Floats
    lengthwise: int
    file: Path | None
    scale: float
    base: int | None
    line: int
    cutters: dict[int, Cutter]
    edges: dict[int, Edges]
    rapid: float


def read_stock_process(path: Path, commented: Mapping[int, CommentedTool] | None = None) -> StockProcess:
    """A process file with a stock: lengths in mm, angles in deg.  Refusal: FIL..., YML... with file, line and key.

    commented: tools by the comments of the program, for what the file does not state of them.
    """
    commented = {} if commented is None else commented
    top = load(path)
    if "operations" in top and "stock" in top:
        raise top.error("YML004", "excludes 'stock', which computes what operations state", "operations")
    top.only("stock", "tools", "defaults")
    stock = top.section("stock")
    stock.only(*BLANKS, "base")
    kinds = [key for key in BLANKS if key in stock]
    if len(kinds) != 1:
        what = f"excludes {kinds[0]!r}" if kinds else "does not state the blank"
        help = (
            "state one of: box: [[x, y, z], [x, y, z]], cylinder: {center: [x, y, z], diameter: ..., height: ...,"
            " axis: z}, stl: FILE, from: FILE.stock; "
        ) + FOOT
        raise stock.error("YML004" if kinds else "YML003", what, kinds[1] if kinds else None, help)
    kind = kinds[0]
    numbers, lengthwise, file, scale = _blank(stock, kind, path)
    defaults = top.section("defaults", None)
    defaults.only(*_EDGES, "rapid")
    tools = top.section("tools", None) if commented else top.section("tools")
    cutters, edges = {}, {}
    for key in tools:
        if not key.isdecimal() or not int(key):
            raise tools.error(
                "YML004", f"{key!r} is not the number of a tool", key, "write 1: {shape: flat, ...}"
            )
        if int(key) in cutters:
            raise tools.error("YML004", f"tool {int(key)} is stated twice", key, "state each tool once")
        section = tools.section(key)
        own = ProcessValues(section, defaults)
        known = commented.get(int(key))
        stated = "shape" in section or "diameter" in section or known is None
        cutters[int(key)] = _cutter(int(key), section, own, None if stated else known)
        edges[int(key)] = _edges(own)
    for number, tool in commented.items():
        if number not in cutters:
            own = ProcessValues(tools, defaults)
            cutters[number] = _of_comment(tool, own)
            edges[number] = _edges(own)
    if not cutters:
        raise top.error("YML003", "states no tool", "tools")
    return StockProcess(
        path=path,
        blank=kind,
        numbers=frozen(numbers),
        lengthwise=lengthwise,
        file=file,
        scale=scale,
        base=read_whole(stock, "base") if "base" in stock else None,
        line=stock.line_of(kind),
        cutters=cutters,
        edges=edges,
        rapid=defaults.number("rapid", low=1e-6, high=100.0, unit="m/s")
        if "rapid" in defaults
        else float("inf"),
    )


def _blank(stock: YamlSection, kind: str, path: Path) -> tuple[list[list[float]], int, Path | None, float]:
    if kind == "box":
        rows = stock.rows("box", 3, "mm")
        if len(rows) != 2:
            raise stock.error("YML004", f"{len(rows)} corners are given where 2 are needed", kind)
        low, high = ([choose(ends) * MM for ends in zip(*rows, strict=True)] for choose in (min, max))
        if any(b - a < 1e-9 for a, b in zip(low, high, strict=True)):
            raise stock.error("YML004", "the corners define no volume", kind)
        if max(abs(value) for row in rows for value in row) > _FAR:
            raise stock.error(
                "YML004", f"a corner is further than {_FAR:g} mm away", kind, "write lengths in mm"
            )
        return [low, high], 2, None, 1.0
    if kind == "cylinder":
        section = stock.section("cylinder")
        section.only("center", "diameter", "height", "axis")
        for key in ("center", "diameter", "height"):
            if key not in section:
                raise section.error("YML003", f"the key {key!r} is missing", None, FOOT)
        centre = section.numbers("center", 3, unit="mm")
        diameter, height = (
            section.number(key, low=1e-3, high=_FAR, unit="mm") for key in ("diameter", "height")
        )
        axis = AXES.index(section.text("axis", "z", choices=AXES))
        return [[value * MM for value in (*centre, diameter, height)]], axis, None, 1.0
    if kind == "stl" and stock.is_mapping("stl"):
        section = stock.section("stl")
        section.only("file", "scale")
        return [[]], 2, path.parent / section.text("file"), section.number("scale", 1.0, 1e-6, 1e6)
    return [[]], 2, path.parent / stock.text(kind), 1.0


def _cutter(
    number: int, section: YamlSection, own: ProcessValues, commented: CommentedTool | None = None
) -> Cutter:
    shape = section.text("shape", choices=SHAPES) if commented is None else commented.shape
    section.only(
        "shape",
        "diameter",
        "length",
        "shank",
        "holder",
        *_EDGES,
        *_SHAPE_KEYS.get(shape, ()),
    )

    def length(key: str, most: float = 1000.0) -> float:
        return section.number(key, low=1e-3, high=most, unit="mm") * MM

    radius = 0.5 * length("diameter") if commented is None else commented.radius
    if commented is None and 2 * radius < _LEAST_DIAMETER * MM:
        message = f"{2 * radius / MM:g} mm is thinner than any cutter of a robot"
        help = f"is it in metres? state mm: diameter: {2 * radius / MM * 1000:g}"
        raise section.error("YML004", message, "diameter", help)
    edge = length("length") if "length" in section else None
    corner, tip, taper = 0.0, 0.0, None
    if commented is not None:
        corner, taper = commented.corner, commented.taper
    elif shape == "ball":
        corner = radius
    elif shape == "bull":
        corner = length("corner_radius")
        if corner > radius:
            raise section.error("YML004", "exceeds the radius of the cutter", "corner_radius")
    elif shape in ("cone", "drill"):
        key = "angle" if shape == "cone" else "point_angle"
        taper = 0.5 * section.number(key, low=1.0, high=179.0, unit="deg") * DEG
        if "tip_diameter" in section:
            tip = 0.5 * section.number("tip_diameter", low=0.0, high=1000.0, unit="mm") * MM
            if tip >= radius:
                raise section.error("YML004", "is not below the diameter", "tip_diameter")
    if edge is not None and taper is not None and (radius - tip) / tan(taper) > edge * (1 + 1e-6):
        ends = 2 * (tip + edge * tan(taper)) / MM
        message = f"the diameter where the edges end is {ends:.4g} mm, below {2 * radius / MM:.6g} mm"
        help = f"compare {key}, the whole angle in deg, with length and diameter"
        raise section.error("YML004", message, "length", help)
    if edge is not None and edge < corner:
        raise section.error("YML004", "the edges are shorter than the radius of the corner", "length")
    shank = 0.5 * length("shank") if "shank" in section else None
    if shank is not None and edge is None:
        raise section.error(
            "YML003", "needs the length of the edges, above which it is", "shank", "state length: ..."
        )
    holder = None
    if "holder" in section:
        inner = section.section("holder")
        inner.only("diameter", "from")
        start = inner.number("from", low=1e-3, high=2000.0, unit="mm") * MM
        if edge is not None and start < edge:
            message = f"{start / MM:g} mm is within the edges, which end at {edge / MM:g} mm"
            raise inner.error(
                "YML004", message, "from", "state the height above the tip at which the holder starts"
            )
        holder = (0.5 * inner.number("diameter", low=1e-3, high=2000.0, unit="mm") * MM, start)
    return Cutter(
        number=number,
        shape=shape,
        radius=radius,
        length=edge,
        corner=corner,
        tip=tip,
        taper=taper,
        shank=shank,
        holder=holder,
        line=section.line,
        **_teeth(own),
    )


def _of_comment(tool: CommentedTool, own: ProcessValues) -> Cutter:
    """A tool of which the file states nothing but its defaults."""
    return Cutter(
        number=tool.number,
        shape=tool.shape,
        radius=tool.radius,
        corner=tool.corner,
        taper=tool.taper,
        **_teeth(own),
    )


def _teeth(own: ProcessValues) -> dict[str, Any]:
    return {
        "teeth": read_whole(own.place("teeth"), "teeth", _MOST_TEETH) if own.has("teeth") else None,
        "helix": own.number("helix") * DEG if own.has("helix") else None,
    }


def _edges(own: ProcessValues) -> Edges:
    known = own.has("material") or own.has("coefficients")
    speed = own.number("spindle") / 60 * 360 * DEG if own.has("spindle") else None
    return Edges(speed, read_material(own) if known else None)
