"""The process file: what each operation of a program cuts, read from YAML and checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.units import DEG, MM
from postproc.base.yaml_section import YamlSection, load
from postproc.process.materials import (
    CUTTING,
    EDGE,
    Material,
    find_material,
    known_materials,
    nearest_material,
    stated_coefficients,
)
from postproc.process.milling_forces import DIRECTIONS, Engagement, engagement

JOINS = ("lines", "name", "tool")
"""By what an operation finds its motions, the more particular first."""

_CUT = (
    "diameter",
    "teeth",
    "helix",
    "axial_depth",
    "radial_width",
    "direction",
    "spindle",
    "rapid",
    "material",
    "coefficients",
    "ci95",
)
_RANGES = {
    "diameter": (0.01, 1000.0, "mm"),
    "axial_depth": (1e-4, 1000.0, "mm"),
    "radial_width": (1e-4, 1000.0, "mm"),
    "spindle": (1.0, 1e6, "1/min"),
    "rapid": (1e-6, 100.0, "m/s"),
    "helix": (-75.0, 75.0, "deg"),
}
"""Key -> lowest and highest value, and the unit: wider than any cutter is."""

_MOST_TEETH = 1000


@dataclass(frozen=True)
class Operation:
    """One operation.  Joined by one of: ``name``, words of a comment; ``tool``, its number; ``lines``, first and last.

    speed [rad/s]; rapid [m/s]: motions at this feed and above are air (infinite: none); line: where it is in the
    file; mirrored: as it is where the program mirrors the side that it cuts.
    """

    name: str
    tool: int
    lines: tuple[int, int]
    cut: Engagement
    speed: float
    rapid: float
    material: Material
    line: int
    mirrored: bool = False

    @property
    def label(self) -> str:
        """What the operation is called in messages."""
        lines = f"lines {self.lines[0]} to {self.lines[1]}"
        own = repr(self.name) if self.name else f"tool {self.tool}" if self.tool else lines
        return f"{own} (mirrored)" if self.mirrored else own

    def as_mirrored(self) -> Operation:
        """The same where the program mirrors the side that it cuts, and the spindle turns as before."""
        return replace(self, cut=self.cut.on_the_other_side(), mirrored=True)

    def feed_per_tooth(self, feed: float | np.ndarray) -> np.ndarray:
        """[m], of the shape of ``feed``, a scalar or (N,) [m/s]: feed / (turns per second x teeth)."""
        return np.asarray(feed * 2 * np.pi / (self.speed * self.cut.teeth))


def read_process(path: Path) -> tuple[Operation, ...]:
    """The operations of a process file.  Refusal: FIL..., YML... with file, line and key.

    Lengths in mm, angles in deg, spindle in 1/min, rapid in m/s, coefficients in N/mm2 and N/mm.
    """
    top = load(path)
    top.only("defaults", "operations")
    defaults = top.section("defaults", None)
    defaults.only(*_CUT)
    sections = top.sections("operations")
    if not sections:
        message = "contains no operation" if "operations" in top else "the key 'operations' is missing"
        raise top.error("YML003", message, help="operations: [{name: ..., diameter: ..., teeth: ...}, ...]")
    operations: list[Operation] = []
    for section in sections:
        operation = _operation(section, defaults)
        _check_apart(section, operation, operations)
        operations.append(operation)
    return tuple(operations)


def _operation(section: YamlSection, defaults: YamlSection) -> Operation:
    section.only(*JOINS, *_CUT)
    by = [key for key in JOINS if key in section]
    if len(by) != 1:
        what = "does not state which motions belong to it" if not by else f"excludes {by[1]!r}"
        raise section.error(
            "YML003" if not by else "YML004",
            what,
            by[0] if by else None,
            "state one of: name (words of a comment in the program), tool (its number), lines: [first, last]",
        )
    own = ProcessValues(section, defaults)
    diameter = own.number("diameter") * MM
    material = read_material(own)
    entry, exit_angle = _engagement(own, diameter)
    cut = Engagement(
        diameter=diameter,
        teeth=read_whole(own.place("teeth"), "teeth", _MOST_TEETH),
        helix=own.number("helix") * DEG,
        depth=own.number("axial_depth") * MM,
        entry=entry,
        exit=exit_angle,
        coefficients=material.coefficients,
    )
    return Operation(
        name=_name(section),
        tool=read_whole(section, "tool") if "tool" in section else 0,
        lines=_lines(section),
        cut=cut,
        speed=own.number("spindle") * 2 * np.pi / 60,
        rapid=own.number("rapid") if own.has("rapid") else np.inf,
        material=material,
        line=section.line,
    )


class ProcessValues:
    """Keys of an operation, or of the defaults where it does not have them."""

    def __init__(self, section: YamlSection, defaults: YamlSection) -> None:
        self.section, self.defaults = section, defaults

    def has(self, key: str) -> bool:
        return key in self.section or key in self.defaults

    def place(self, key: str) -> YamlSection:
        """The section that holds ``key``; the operation's own where neither does, so that it is reported there."""
        return self.defaults if key in self.defaults and key not in self.section else self.section

    def number(self, key: str) -> float:
        """The number under ``key``, in the unit of the file."""
        low, high, unit = _RANGES[key]
        return self.place(key).number(key, low=low, high=high, unit=unit)


def _engagement(own: ProcessValues, diameter: float) -> tuple[float, float]:
    """Entry and exit angle [rad] of ``direction`` and ``radial_width``."""
    section = own.place("direction")
    direction = section.text("direction", choices=DIRECTIONS)
    if direction == "slot" and not own.has("radial_width"):
        return engagement(direction, diameter, diameter)
    width = own.number("radial_width") * MM
    section = own.place("radial_width")
    if width > diameter * (1 + 1e-9):
        message = f"{width / MM:g} mm is wider than the cutter, whose diameter is {diameter / MM:g} mm"
        raise section.error(
            "YML004", message, "radial_width", "state the width of material that the cutter removes"
        )
    if direction == "slot" and width < diameter * (1 - 1e-9):
        message = f"{width / MM:g} mm is not a slot of a cutter with a diameter of {diameter / MM:g} mm"
        raise section.error(
            "YML004", message, "radial_width", "state direction: up or down for a part of the diameter"
        )
    return engagement(direction, width, diameter)


def read_material(own: ProcessValues) -> Material:
    """Of ``material`` or ``coefficients``: the operation's own before the defaults'; ``ci95`` before the table's."""
    for section in (own.section, own.defaults):
        if "material" in section and "coefficients" in section:
            raise section.error("YML004", "excludes 'material'; state only one of them", "coefficients")
        if "coefficients" in section:
            coefficients = section.section("coefficients")
            coefficients.only(*CUTTING, *EDGE, "source")
            return _with_interval(stated_coefficients(coefficients), own)
        if "material" in section:
            name = section.text("material")
            material = find_material(name)
            if material is None:
                raise section.error(
                    "YML004",
                    f"{name[:60]!r} is not known{nearest_material(name)}",
                    "material",
                    f"these are known: {known_materials()}; or state coefficients: "
                    "{ktc: ..., krc: ..., kac: ..., kte: ..., kre: ..., kae: ...} in N/mm2 and N/mm",
                )
            return _with_interval(material, own)
    raise own.section.error(
        "YML003",
        "the key 'material' is missing",
        None,
        f"state one of {known_materials()}; or coefficients: {{...}}",
    )


def _with_interval(material: Material, own: ProcessValues) -> Material:
    if not own.has("ci95"):
        return material
    return replace(material, ci95=own.place("ci95").number("ci95", low=0.0, high=1.0))


def _name(section: YamlSection) -> str:
    if "name" not in section:
        return ""
    name = " ".join(section.text("name").split())
    if not name:
        raise section.error("YML004", "is empty", "name")
    return name


def _lines(section: YamlSection) -> tuple[int, int]:
    if "lines" not in section:
        return (0, 0)
    first, last = section.numbers("lines", 2)
    if first < 1 or last < first or first != int(first) or last != int(last):
        raise section.error(
            "YML004", f"{first:g} to {last:g} is not a range of lines", "lines", "write [first, last], from 1"
        )
    return int(first), int(last)


def read_whole(section: YamlSection, key: str, most: int = 10**6) -> int:
    value = section.number(key)
    if value < 1 or value != int(value) or value > most:
        raise section.error("YML004", f"{value:g} is not a whole number from 1 to {most}", key)
    return int(value)


def _check_apart(section: YamlSection, new: Operation, before: list[Operation]) -> None:
    """Two operations that claim the same motions by the same means contradict each other."""
    for old in before:
        if new.name and new.name.lower() == old.name.lower():
            raise section.error("YML004", f"{new.name!r} is defined twice, first in line {old.line}", "name")
        if new.tool and new.tool == old.tool:
            raise section.error(
                "YML004", f"tool {new.tool} has an operation already, in line {old.line}", "tool"
            )
        if new.lines[1] and old.lines[1] and new.lines[0] <= old.lines[1] and old.lines[0] <= new.lines[1]:
            message = (
                f"lines {new.lines[0]} to {new.lines[1]} overlap those of the operation in line {old.line}"
            )
            raise section.error("YML004", message, "lines")
