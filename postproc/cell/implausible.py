"""What a cell file states that no cell has: other units, a spindle turned round, a tolerance that tolerates all.

Every one is a warning, because a strange cell may be right; it is reported in every run until the file is changed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding
from postproc.base.geometry import lengths
from postproc.base.units import DEG, MM, are_radians
from postproc.base.yaml_section import YamlSection
from postproc.cell.description import Cell, Tool

METRES = 5.0
"""[mm] Frames whose largest coordinate is below it were written in metres: no arm of this size mills."""
FAR = 100_000.0
"""[mm] Frames that are farther away were written in a smaller unit."""
TONNES, GRAMS = 0.5, 1000.0
"""[kg] Spindles and tools weigh more than the one and less than the other."""
LARGE_TOLERANCE, LARGE_ANGLE = 5.0 * MM, 2.0 * DEG
"""Tolerances above these leave nothing to be corrected."""
THIN = 0.1 * MM
"""Cutters are thicker, and forces change along a longer path."""
BEHIND, BESIDE = -1.0 * MM, 150.0 * MM
"""A tool centre point behind the flange's face, and nearer to its axis than this, is inside the wrist."""
POINTS_BACK = -0.5
"""Cosine between the spindle's axis, tip-ward, and the direction from the flange to the tip, from which on the axis
points from the tip to the spindle."""


def implausible(top: YamlSection, cell: Cell) -> tuple[Finding, ...]:
    """CEL005, CEL006 and CEL007 of a cell that was read from ``top``."""
    found: list[Finding] = []
    for key, numbered in (("tools", cell.tools), ("bases", cell.bases)):
        parent = top.section(key, None)
        for number in numbered:
            section = parent.section(str(number))
            found += _frame(section)
    if "robot_base" in top:
        found += _frame(top.section("robot_base"))
    for number, tool in cell.tools.items():
        found += _tool(top.section("tools").section(str(number)), tool)
    if "orientation" in top:
        section = top.section("orientation")
        values = [section.number(k, 0.0) for k in "abc"]
        found += _angles(section, values, "a")
    if cell.start_stated is not None:
        found += _angles(top, list(cell.start_stated[:6]), "start")
    if cell.tolerance > LARGE_TOLERANCE:
        message = f"a path error of {cell.tolerance / MM:g} mm leaves nothing to be corrected"
        found.append(_finding(top, "CEL007", message, "tolerance", "write it in mm, for example 0.02"))
    if cell.tolerance_angle > LARGE_ANGLE:
        message = f"an error of {cell.tolerance_angle / DEG:g} deg leaves nothing to be corrected"
        found.append(_finding(top, "CEL007", message, "tolerance_deg", "write it in deg, for example 0.01"))
    if cell.force_ramp is not None and 0.0 < cell.force_ramp < THIN:
        short = cell.force_ramp / MM
        message = f"no force changes along {short:g} mm of path; is the length in metres?"
        help = f"lengths are in mm; from metres this is {1000.0 * short:g}"
        found.append(_finding(top, "CEL005", message, "force_ramp", help))
    return tuple(found)


def _frame(section: YamlSection) -> Iterator[Finding]:
    place = np.array([section.number(key) for key in "xyz"])
    largest = float(np.abs(place).max())
    if 0.0 < largest < METRES:
        scaled = ", ".join(f"{key}: {1000.0 * value:g}" for key, value in zip("xyz", place, strict=True))
        message = f"its largest coordinate is {largest:g} mm, as if it were in metres"
        yield _finding(
            section, "CEL005", message, help=f"lengths are in mm; in metres this would be {scaled}"
        )
    elif largest > FAR:
        message = f"it is {largest / 1000.0:g} m away, as if it were in another unit than mm"
        yield _finding(section, "CEL005", message, help="lengths are in mm")
    yield from _angles(section, [section.number(key, 0.0) for key in "abc"], "a")


def _angles(section: YamlSection, values: list[float], key: str) -> Iterator[Finding]:
    """Angles of which each is zero or a round part of pi, written with digits."""
    if are_radians(values):
        degrees = ", ".join(f"{value / DEG:.4g}" for value in values)
        message = (
            f"the angles {', '.join(f'{v:g}' for v in values)} deg are round numbers if they are radians"
        )
        there = key if key in section else None
        yield _finding(section, "CEL005", message, there, f"angles are in deg; from radians: {degrees}")


def _tool(section: YamlSection, tool: Tool) -> Iterator[Finding]:
    tip: Floats = tool.pose.position
    reach = float(lengths(tip[None])[0])
    if tip[2] < BEHIND and np.hypot(tip[0], tip[1]) < BESIDE:
        message = (
            f"the tool centre point is {-tip[2] / MM:g} mm inside the wrist, on the arm's side of the flange"
        )
        yield _finding(
            section, "CEL006", message, "z", "x y z go from the flange to the tip; +z leaves the flange"
        )
    elif reach > 0:
        axis = tool.pose.rotation @ tool.axis
        if float(axis @ tip) < POINTS_BACK * reach:
            message = "the spindle's axis is reversed: it leads from the tip back to the flange"
            help = "axis is the direction from the spindle to the tip, in the tool's axes: change its sign"
            yield _finding(section, "CEL006", message, "axis" if "axis" in section else None, help)
    if tool.mass is not None and 0.0 < tool.mass < TONNES:
        message = f"a tool of {tool.mass:g} kg has no spindle; is it in tonnes?"
        yield _finding(section, "CEL005", message, "mass", "masses are in kg")
    elif tool.mass is not None and tool.mass > GRAMS:
        message = f"no robot carries a tool of {tool.mass:g} kg; is it in grams?"
        yield _finding(section, "CEL005", message, "mass", "masses are in kg")
    if tool.diameter is not None and tool.diameter < THIN:
        thin = tool.diameter / MM
        message = f"no cutter is {thin:g} mm thin; is its diameter in metres?"
        help = f"lengths are in mm; from metres this is {1000.0 * thin:g}"
        yield _finding(section, "CEL005", message, "diameter", help)
    if tool.com is not None:
        largest = float(np.abs(tool.com).max()) / MM
        if 0.0 < largest < METRES:
            message = f"the centre of mass is {largest:g} mm from the flange, as if it were in metres"
            yield _finding(section, "CEL005", message, "com", "lengths are in mm")


def _finding(
    section: YamlSection, code: str, message: str, key: str | None = None, help: str = ""
) -> Finding:
    return section.error(code, message, key, help).findings[0]
