"""What the cell states of how real tools differ from what control and program take them for: ``tool_errors``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from postproc.base.units import MM
from postproc.base.yaml_section import YamlSection

OTHERS = "others"
"""Key of what holds for all operations that have no entry of their own."""

WALL_SIDES = {"left": -1, "none": 0, "right": 1}
"""Where the wall lies that a tool cuts, seen along the spindle towards its tip in the sense of the feed."""

LARGEST = 5.0
"""[mm] A tool that differs by more is another one."""

SIZES = ("radius", "length")


@dataclass(frozen=True, eq=False)
class ToolError:
    """``radius``, ``length`` [m] by which a tool is larger and longer; ``radius_ci95``, ``length_ci95`` [m]: half
    widths of their 95 % intervals, None without; ``walls``: operation, in upper case, -> -1 (left), 1 (right of the
    feed) or 0 (it cuts none); the radius acts only where there is one."""

    radius: float = 0.0
    length: float = 0.0
    radius_ci95: float | None = None
    length_ci95: float | None = None
    walls: Mapping[str, int] = field(default_factory=dict)

    def side(self, operation: str) -> int:
        """-1, 1, or 0 where there is no wall, or nothing is stated."""
        return self.walls.get(operation, self.walls.get(OTHERS, 0))

    def states(self, operation: str) -> bool:
        """Whether it is stated where the wall of an operation lies, or that it has none."""
        return operation in self.walls or OTHERS in self.walls


def read_tool_error(section: YamlSection) -> ToolError:
    """One tool of ``tool_errors``.  Refusal YML003, YML004."""
    keys = [*SIZES, *(f"{name}_ci95" for name in SIZES)]
    section.only(*keys, "walls")
    if not any(name in section for name in SIZES):
        raise section.error("YML003", "states nothing", help="write radius: or length:, in mm")
    for name in SIZES:
        if f"{name}_ci95" in section and name not in section:
            raise section.error("YML003", f"is incomplete: {name!r} is missing", f"{name}_ci95")
    values = {
        key: section.number(key, low=0.0 if key.endswith("ci95") else -LARGEST, high=LARGEST, unit="mm") * MM
        for key in keys
        if key in section
    }
    walls: dict[str, int] = {}
    stated = section.section("walls", {})
    for key in stated:
        name = key if key == OTHERS else " ".join(key.split()).upper()
        if name in walls:
            raise stated.error("YML004", f"the operation {name!r} occurs twice", key)
        walls[name] = WALL_SIDES[stated.text(key, choices=tuple(WALL_SIDES))]
    return ToolError(**values, walls=walls)
